//! The shader modules and pipelines that scenes of one device were drawn with, so that a scene like one
//! before it is drawn without compiling anything.
//!
//! What a scene is drawn with is the business of `scene_pipelines`.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use vastex::{BindingPlace, Kinds, shader_module};

use super::pipeline::{Corners, Drawing};
use crate::layers::LayersText;

/// So many modules are kept: those of as many kinds of scenes.
const MOST_MODULES: usize = 32;
/// So many pipelines are kept: those of as many kinds of scenes and targets.
const MOST_PIPELINES: usize = 128;

/// What the text of a scene follows from.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct ModuleKey {
    /// What the layers are sampled by.
    pub(super) kinds: Kinds,
    /// And where that is bound.
    pub(super) place: BindingPlace,
    /// How many there are.
    pub(super) layers: LayersText,
    /// True if heights displace the surface.
    pub(super) has_relief: bool,
}

/// What a pipeline follows from beside its module.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct PipelineKey {
    /// The entry points of the vertex and of the fragment stage.
    pub(super) entries: [String; 2],
    /// Names of overridable constants and the bits of their values.
    pub(super) constants: Vec<(&'static str, u64)>,
    pub(super) corners: Corners,
    pub(super) drawing: Drawing,
    /// One more bind group.
    pub(super) group: Option<Vec<wgpu::BindGroupLayoutEntry>>,
    pub(super) formats: Vec<wgpu::TextureFormat>,
}

/// What is kept for one device ([`crate::Gpu::kept`]).
#[derive(Debug)]
pub(super) struct CompiledScenes {
    modules: Mutex<Recent<ModuleKey, wgpu::ShaderModule>>,
    pipelines: Mutex<Recent<(ModuleKey, PipelineKey), wgpu::RenderPipeline>>,
    /// Pipelines so far.
    compiled: AtomicU32,
}

impl Default for CompiledScenes {
    fn default() -> CompiledScenes {
        CompiledScenes {
            modules: Mutex::new(Recent::new(MOST_MODULES)),
            pipelines: Mutex::new(Recent::new(MOST_PIPELINES)),
            compiled: AtomicU32::new(0),
        }
    }
}

impl CompiledScenes {
    /// Pipelines that were compiled so far.
    pub(super) fn compiled(&self) -> u32 {
        self.compiled.load(Ordering::Relaxed)
    }

    /// The module of a text, which is parsed where it is not there.
    pub(super) fn module(
        &self,
        device: &wgpu::Device,
        key: &ModuleKey,
        text: impl FnOnce(&ModuleKey) -> String,
    ) -> wgpu::ShaderModule {
        let place = Recent::place(&self.modules, key.clone());
        place.get_or_init(|| shader_module(device, Some("scene"), text(key))).clone()
    }

    /// A pipeline, which `compile` makes where it is not there. Nobody else waits for that but who wants the
    /// same one.
    pub(super) fn pipeline(
        &self,
        key: &(ModuleKey, PipelineKey),
        compile: impl FnOnce(&PipelineKey) -> wgpu::RenderPipeline,
    ) -> wgpu::RenderPipeline {
        let place = Recent::place(&self.pipelines, key.clone());
        place
            .get_or_init(|| {
                self.compiled.fetch_add(1, Ordering::Relaxed);
                compile(&key.1)
            })
            .clone()
    }
}

/// What was asked for last, up to a number of things.
#[derive(Debug)]
struct Recent<K, V> {
    most: usize,
    asked: u64,
    /// With the number of the question that it was asked for by last.
    places: HashMap<K, (u64, Arc<OnceLock<V>>)>,
}

impl<K: Clone + Eq + Hash, V> Recent<K, V> {
    fn new(most: usize) -> Recent<K, V> {
        Recent { most, asked: 0, places: HashMap::new() }
    }

    /// The place of a thing; that of the one which was not asked for longest goes where there are too many.
    fn place(kept: &Mutex<Recent<K, V>>, key: K) -> Arc<OnceLock<V>> {
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        let Recent { most, asked, places } = &mut *kept;
        *asked += 1;
        let place = places.entry(key).or_default();
        place.0 = *asked;
        let place = Arc::clone(&place.1);
        if places.len() > *most
            && let Some(oldest) =
                places.iter().min_by_key(|(_, (asked, _))| asked).map(|(key, _)| key.clone())
        {
            places.remove(&oldest);
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::Recent;

    #[test]
    fn what_was_not_asked_for_longest_goes() {
        let recent: Mutex<Recent<u32, u32>> = Mutex::new(Recent::new(2));
        for (key, is_kept) in
            [(1, false), (2, false), (1, true), (3, false), (1, true), (2, false), (3, false)]
        {
            let place = Recent::place(&recent, key);
            assert_eq!(place.get().is_some(), is_kept, "{key}");
            assert_eq!(*place.get_or_init(|| key), key);
            assert!(recent.lock().unwrap().places.len() <= 2);
        }
    }
}
