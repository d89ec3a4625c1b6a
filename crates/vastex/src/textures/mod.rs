//! The textures of one device, as an application has them: four parts, joined here and in the files of this folder.
//!
//! What happens each frame is `frame`'s business. Each part keeps its state to itself, so a method here is a call or two.

mod add;
mod ahead;
mod cpu;
mod dump;
mod feedback;
mod frame;
mod groups;
mod inspect;
mod memory;
mod requests;
mod shaders;
mod stats;
mod survey;
mod trace;
mod views;

use std::sync::Arc;

use vastex_core::{Description, LevelRule, PageId, PageState, PoolId, TextureId};
use vastex_wgpu::FeedbackWay;

use crate::cpu::CpuSide;
use crate::error::Error;
use crate::gpu::Gpu;
use crate::paging::Paging;
use crate::sampled::LayerId;
use crate::settings::{Filter, Settings};
use crate::watch::Watch;
pub use add::AddError;
pub use views::ViewSettings;

/// The virtual textures of a device, and the loop that keeps their pools filled.
///
/// Textures of the same tile size, and formats and resolutions of the layers, share a pool; the others have their own.
pub struct Textures {
    settings: Settings,
    /// What is wanted and loaded.
    paging: Paging,
    /// What is on the GPU.
    gpu: Gpu,
    /// What is kept for people and tools.
    watch: Watch,
    /// What the CPU samples.
    cpu: CpuSide,
}

impl Textures {
    /// No textures yet, on the application's own device. Fails where the device lacks what the settings ask for, and in a browser for
    /// [`crate::Pace::LockStep`].
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, settings: Settings) -> Result<Textures, Error> {
        Ok(Textures {
            paging: Paging::new(&settings)?,
            gpu: Gpu::new(device, queue, &settings)?,
            watch: Watch::new(settings.telemetry_frames),
            cpu: CpuSide::new(settings.cpu_cache_bytes),
            settings,
        })
    }

    /// The textures there are.
    pub fn iter(&self) -> impl Iterator<Item = TextureId> + '_ {
        self.paging.textures().map(|(texture, _)| texture)
    }

    /// The layer of that name, if the texture has one.
    pub fn layer(&self, texture: TextureId, name: &str) -> Option<LayerId> {
        let index = self.description(texture).layers.iter().position(|layer| layer.name == name)?;
        Some(LayerId::new(texture, index))
    }

    /// How the texels of a layer are blended: as was asked for when its texture was added, by [`crate::Settings::filter`], or, where its values
    /// may not be mixed, not at all.
    pub fn filter(&self, layer: impl Into<LayerId>) -> Filter {
        self.gpu.sampling_of(layer.into()).filter
    }

    /// What is known of a texture.
    #[expect(clippy::expect_used, reason = "an id of another `Textures` is a mistake in the program")]
    pub fn description(&self, texture: TextureId) -> &Arc<Description> {
        &self.paging.texture(texture).expect("a texture of this `Textures`").description
    }

    /// The pool of a texture, as events and statistics name it.
    pub fn pool_of(&self, texture: TextureId) -> Option<PoolId> {
        self.paging.pager().pool_of(texture)
    }

    /// The mip bias in force for a texture, that of its pool, in eighths of a level.
    pub fn bias_eighths(&self, texture: TextureId) -> u16 {
        self.pool_of(texture).map_or(0, |pool| self.paging.pager().pool(pool).bias_eighths())
    }

    /// Sets how the levels of a texture are chosen, from the next feedback and picture on: a clamp of levels and a bias of its
    /// own, before the mip bias of its pool. The levels that there are and the bias that can be are the limits. Says
    /// whether there is such a texture.
    pub fn set_levels(&mut self, texture: TextureId, rule: LevelRule) -> bool {
        self.gpu.set_levels(texture, rule) && self.paging.set_levels(texture, rule)
    }

    /// How the levels of a texture are chosen, within the levels that it has.
    pub fn levels(&self, texture: TextureId) -> Option<LevelRule> {
        self.paging.pager().levels(texture)
    }

    /// The state of a page.
    pub fn state(&self, page: PageId) -> PageState {
        self.paging.pager().state(page)
    }

    /// How views say what they want: as the settings say, or the best that the device has.
    pub fn feedback_way(&self) -> FeedbackWay {
        self.gpu.way()
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}
