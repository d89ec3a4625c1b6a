//! The pipelines of a scene: one for each way in which its surface is placed, of one shader module. Each is compiled when something is drawn with
//! it for the first time, since most scenes are only ever drawn in one way, and compiling is most of what opening one takes.

use std::sync::{Arc, OnceLock};

use vastex::{Error, LayerId, Textures, shader_module};

use super::pipeline::{Corners, PipelineParts};
use super::relief::ReliefSurface;
use super::shaders;
use super::tiling::Tiling;
use crate::layers::{ColorMap, Layers};
use crate::scene::Scene;
use crate::stage::{Uniform, takes_light};

/// Pipelines that draw the same: the surface as a mesh and, where it can be drawn so, in fixed point.
#[derive(Debug)]
pub struct ScenePipelines {
    maker: Arc<PipelineMaker>,
    /// The entry points of the two stages, for either way.
    entries: [[String; 2]; 2],
    group: Option<wgpu::BindGroupLayout>,
    formats: Vec<wgpu::TextureFormat>,
    compiled: [OnceLock<wgpu::RenderPipeline>; 2],
}

/// Places of the two ways.
const MESH: usize = 0;
const FIXED: usize = 1;

impl ScenePipelines {
    /// What draws the surface as a mesh.
    pub(super) fn mesh(&self) -> &wgpu::RenderPipeline {
        self.way(MESH)
    }

    /// What draws it in fixed point.
    pub(super) fn fixed(&self) -> Option<&wgpu::RenderPipeline> {
        self.maker.has_fixed.then(|| self.way(FIXED))
    }

    /// Compiles both.
    pub(super) fn compile(&self) {
        self.mesh();
        self.fixed();
    }

    fn way(&self, way: usize) -> &wgpu::RenderPipeline {
        self.compiled[way].get_or_init(|| {
            let maker = &self.maker;
            let [place, shade] = &self.entries[way];
            let parts = maker.parts([place, shade], maker.corners[way], &self.formats);
            parts.pipeline(&maker.device, &maker.groups(self.group.as_ref()))
        })
    }
}

/// Makes the pipelines of a scene.
#[derive(Debug)]
pub(super) struct PipelineMaker {
    device: wgpu::Device,
    /// Every entry point that draws the scene.
    module: wgpu::ShaderModule,
    constants: Vec<(&'static str, f64)>,
    /// What constants of flat surfaces follow from, for plans.
    flat: (Scene, Tiling),
    /// In either way.
    corners: [Corners; 2],
    pub(super) has_fixed: bool,
    has_texture_space: bool,
    /// Whether the text has the entry points of plans.
    has_plans: bool,
    textures_layout: wgpu::BindGroupLayout,
    camera_layout: wgpu::BindGroupLayout,
    layers_layout: Option<wgpu::BindGroupLayout>,
    format: wgpu::TextureFormat,
}

impl PipelineMaker {
    pub(super) fn new(
        device: &wgpu::Device,
        textures: &Textures,
        scene: Scene,
        (layers, relief): (&Layers, Option<&ReliefSurface>),
        tiling: Tiling,
        format: wgpu::TextureFormat,
    ) -> Result<PipelineMaker, Error> {
        let (kinds, text_of) = (layers.kinds(textures)?, layers.text_of());
        let vastex = textures.wgsl(&kinds);
        let text = match relief {
            Some(_) => shaders::relief(&vastex, text_of),
            None => shaders::layered(&vastex, text_of),
        };
        let of_layers = layers.constants(takes_light(format)).into_iter().chain(tiling.constants());
        let constants = match relief {
            Some(relief) => of_layers.chain(relief.constants()).collect(),
            None => of_layers.chain([of_globe(scene)]).collect(),
        };
        let corners = match (relief, scene) {
            (Some(_), _) => [Corners::Patches, Corners::FixedPatches],
            (None, Scene::Globe) => [Corners::Outside, Corners::None],
            (None, Scene::Image | Scene::Plane | Scene::Terrain) => [Corners::Vertices, Corners::None],
        };
        let is_even = tiling == Tiling::default() && matches!(scene, Scene::Image | Scene::Globe);
        Ok(PipelineMaker {
            device: device.clone(),
            module: shader_module(device, Some("scene"), text),
            constants,
            flat: (scene, tiling),
            corners,
            has_fixed: relief.is_some() || is_even,
            has_texture_space: relief.is_none() && layers.is_single(),
            has_plans: relief.is_none() && layers.is_single(),
            textures_layout: textures.bind_group_layout(&kinds),
            camera_layout: Uniform::layout(device),
            layers_layout: (!layers.is_single()).then(|| Uniform::layout(device)),
            format,
        })
    }

    pub(super) fn camera_layout(&self) -> &wgpu::BindGroupLayout {
        &self.camera_layout
    }

    /// Of what is told of the layers of a list.
    pub(super) fn layers_layout(&self) -> Option<&wgpu::BindGroupLayout> {
        self.layers_layout.as_ref()
    }

    pub(super) fn format(&self) -> wgpu::TextureFormat {
        self.format
    }

    /// By entry points that are there for either way.
    pub(super) fn pipelines(
        self: &Arc<Self>,
        place: &str,
        shade: &str,
        group: Option<&wgpu::BindGroupLayout>,
        formats: &[wgpu::TextureFormat],
    ) -> ScenePipelines {
        self.of_ways(|way| [format!("{place}_{way}"), format!("{shade}_{way}")], group, formats)
    }

    /// Those of the feedback pass.
    pub(super) fn wanted(self: &Arc<Self>) -> ScenePipelines {
        let entries = |way: &str| [format!("place_{way}_feedback"), format!("want_{way}")];
        self.of_ways(entries, None, &[Textures::FEEDBACK_FORMAT])
    }

    fn of_ways(
        self: &Arc<Self>,
        entries: impl Fn(&str) -> [String; 2],
        group: Option<&wgpu::BindGroupLayout>,
        formats: &[wgpu::TextureFormat],
    ) -> ScenePipelines {
        ScenePipelines {
            maker: Arc::clone(self),
            entries: ["mesh", "fixed"].map(entries),
            group: group.cloned(),
            formats: formats.to_vec(),
            compiled: [const { OnceLock::new() }; 2],
        }
    }

    fn parts<'a>(
        &'a self,
        entries: [&'a str; 2],
        corners: Corners,
        formats: &'a [wgpu::TextureFormat],
    ) -> PipelineParts<'a> {
        PipelineParts { module: &self.module, constants: &self.constants, corners, entries, formats }
    }

    fn groups<'a>(
        &'a self,
        more: Option<&'a wgpu::BindGroupLayout>,
    ) -> Vec<Option<&'a wgpu::BindGroupLayout>> {
        let mut groups = vec![Some(&self.textures_layout), Some(&self.camera_layout)];
        groups.extend(self.layers_layout.as_ref().or(more).map(Some));
        groups
    }

    /// What draws the surface in texture space.
    pub(super) fn spread(&self) -> Option<wgpu::RenderPipeline> {
        self.has_texture_space.then(|| {
            let spread =
                self.parts(["spread", "need"], self.corners[MESH], &[Textures::TEXTURE_SPACE_FORMAT]);
            spread.blended(&self.device, &self.groups(None), Textures::TEXTURE_SPACE_BLEND)
        })
    }

    /// What draws a plan of a layer over the whole picture. Fails where the texture was removed.
    pub(super) fn plan(
        &self,
        textures: &Textures,
        layer: LayerId,
        color_map: ColorMap,
        (entry, group): (&str, Option<&wgpu::BindGroupLayout>),
    ) -> Result<wgpu::RenderPipeline, Error> {
        // A plan is of a texture, not of the group that is sampled where there are heights or several layers.
        let kinds = textures.kinds(layer)?;
        let flat = || shader_module(&self.device, Some("plan"), shaders::flat(&textures.wgsl(&kinds)));
        let module = if self.has_plans { &self.module } else { &flat() };
        let textures_layout = textures.bind_group_layout(&kinds);
        let mut groups = vec![Some(&textures_layout), Some(&self.camera_layout)];
        groups.extend(group.map(Some));
        let (scene, tiling) = self.flat;
        let of_map = color_map.constants(takes_light(self.format)).into_iter();
        let constants: Vec<_> = of_map.chain(tiling.constants()).chain([of_globe(scene)]).collect();
        let (corners, constants, formats) = (Corners::None, &constants, &[self.format]);
        let parts = PipelineParts { module, constants, corners, entries: ["fill", entry], formats };
        Ok(parts.plan(&self.device, &groups))
    }
}

/// What pipelines with fixed.wgsl are made with.
fn of_globe(scene: Scene) -> (&'static str, f64) {
    ("FIXED_GLOBE", f64::from(u8::from(scene == Scene::Globe)))
}
