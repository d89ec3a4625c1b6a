//! The pipelines of a scene: one for each way in which its surface is placed, of one shader module. Each is
//! compiled when something is drawn with it for the first time, since most scenes are only ever drawn in one
//! way, and compiling is most of what opening one takes; and not at all where the same device drew a scene
//! like it (`compiled`).

use std::sync::{Arc, OnceLock};

use vastex::{Error, Kinds, LayerId, Textures};

use super::compiled::{CompiledScenes, ModuleKey, PipelineKey};
use super::pipeline::{Corners, Drawing, PipelineParts};
use super::relief::ReliefSurface;
use super::shaders;
use super::tiling::Tiling;
use crate::gpu::Gpu;
use crate::layers::{ColorMap, Layers, LayersText};
use crate::scene::Scene;
use crate::stage::{Uniform, takes_light};

/// Pipelines that draw the same: the surface as a mesh and, where it can be drawn so, in fixed point.
#[derive(Debug)]
pub struct ScenePipelines {
    maker: Arc<PipelineMaker>,
    /// The entry points of the two stages, for either way.
    entries: [[String; 2]; 2],
    group: Option<Vec<wgpu::BindGroupLayoutEntry>>,
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
            let key = PipelineKey {
                entries: self.entries[way].clone(),
                constants: maker.constants.clone(),
                corners: maker.corners[way],
                drawing: Drawing::Nearest,
                group: self.group.clone(),
                formats: self.formats.clone(),
            };
            maker.program.pipeline(&maker.gpu, key, maker.layers_layout.as_ref())
        })
    }
}

/// Makes the pipelines of a scene.
#[derive(Debug)]
pub(super) struct PipelineMaker {
    gpu: Gpu,
    /// Every entry point that draws the scene.
    program: SceneProgram,
    constants: Vec<(&'static str, u64)>,
    /// What constants of flat surfaces follow from, for plans.
    flat: (Scene, Tiling),
    /// In either way.
    corners: [Corners; 2],
    pub(super) has_fixed: bool,
    has_texture_space: bool,
    layers_layout: Option<wgpu::BindGroupLayout>,
    format: wgpu::TextureFormat,
}

impl PipelineMaker {
    pub(super) fn new(
        gpu: &Gpu,
        textures: &Textures,
        scene: Scene,
        (layers, relief): (&Layers, Option<&ReliefSurface>),
        tiling: Tiling,
        format: wgpu::TextureFormat,
    ) -> Result<PipelineMaker, Error> {
        let kinds = layers.kinds(textures)?;
        let text = layers.text_of(&kinds);
        let program = SceneProgram::new(gpu, textures, kinds, text, relief.is_some());
        let of_layers = layers.constants(takes_light(format)).into_iter().chain(tiling.constants());
        let constants = match relief {
            Some(relief) => bits(of_layers.chain(relief.constants())),
            None => bits(of_layers.chain([of_globe(scene)])),
        };
        let corners = match (relief, scene) {
            (Some(_), _) => [Corners::Patches, Corners::FixedPatches],
            (None, Scene::Globe | Scene::Planet) => [Corners::Outside, Corners::None],
            (None, Scene::Image | Scene::Plane | Scene::Terrain) => [Corners::Vertices, Corners::None],
        };
        let is_even = tiling == Tiling::default() && matches!(scene, Scene::Image | Scene::Globe);
        Ok(PipelineMaker {
            gpu: gpu.clone(),
            program,
            constants,
            flat: (scene, tiling),
            corners,
            has_fixed: relief.is_some() || is_even,
            has_texture_space: relief.is_none() && layers.is_single(),
            layers_layout: (!layers.is_single()).then(|| Uniform::layout(&gpu.device)),
            format,
        })
    }

    pub(super) fn camera_layout(&self) -> &wgpu::BindGroupLayout {
        let [_, camera] = &self.program.layouts;
        camera
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
        group: Option<&[wgpu::BindGroupLayoutEntry]>,
        formats: &[wgpu::TextureFormat],
    ) -> ScenePipelines {
        self.of_ways(|way| [format!("{place}_{way}"), format!("{shade}_{way}")], group, formats)
    }

    /// Pipelines of the feedback pass.
    pub(super) fn wanted(self: &Arc<Self>) -> ScenePipelines {
        let entries = |way: &str| [format!("place_{way}_feedback"), format!("want_{way}")];
        self.of_ways(entries, None, &[Textures::FEEDBACK_FORMAT])
    }

    fn of_ways(
        self: &Arc<Self>,
        entries: impl Fn(&str) -> [String; 2],
        group: Option<&[wgpu::BindGroupLayoutEntry]>,
        formats: &[wgpu::TextureFormat],
    ) -> ScenePipelines {
        ScenePipelines {
            maker: Arc::clone(self),
            entries: ["mesh", "fixed"].map(entries),
            group: group.map(<[_]>::to_vec),
            formats: formats.to_vec(),
            compiled: [const { OnceLock::new() }; 2],
        }
    }

    /// What draws the surface in texture space.
    pub(super) fn spread(&self) -> Option<wgpu::RenderPipeline> {
        self.has_texture_space.then(|| {
            let key = PipelineKey {
                entries: ["spread", "need"].map(str::to_owned),
                constants: self.constants.clone(),
                corners: self.corners[MESH],
                drawing: Drawing::Blended(Textures::TEXTURE_SPACE_BLEND),
                group: None,
                formats: vec![Textures::TEXTURE_SPACE_FORMAT],
            };
            self.program.pipeline(&self.gpu, key, self.layers_layout.as_ref())
        })
    }

    /// What draws what is around a planet behind it.
    pub(super) fn sky(&self) -> wgpu::RenderPipeline {
        let key = PipelineKey {
            entries: ["planet_fill", "planet_sky"].map(str::to_owned),
            constants: self.constants.clone(),
            corners: Corners::None,
            drawing: Drawing::Everywhere,
            group: None,
            formats: vec![self.format],
        };
        self.program.pipeline(&self.gpu, key, self.layers_layout.as_ref())
    }

    /// What draws a plan of a layer over the whole picture. Fails where the texture was removed.
    pub(super) fn plan(
        &self,
        textures: &Textures,
        layer: LayerId,
        color_map: ColorMap,
        (entry, group): (&str, Option<&[wgpu::BindGroupLayoutEntry]>),
    ) -> Result<wgpu::RenderPipeline, Error> {
        // A plan is of a texture, not of the group that is sampled where there are heights or several layers.
        let program =
            SceneProgram::new(&self.gpu, textures, textures.kinds(layer)?, LayersText::ALONE, false);
        let (scene, tiling) = self.flat;
        let of_map = color_map.constants(takes_light(self.format)).into_iter();
        let key = PipelineKey {
            entries: ["fill", entry].map(str::to_owned),
            constants: bits(of_map.chain(tiling.constants()).chain([of_globe(scene)])),
            corners: Corners::None,
            drawing: Drawing::Everywhere,
            group: group.map(<[_]>::to_vec),
            formats: vec![self.format],
        };
        Ok(program.pipeline(&self.gpu, key, None))
    }
}

/// A text of scenes, and what stands at its first two bind groups.
#[derive(Debug)]
struct SceneProgram {
    text: ModuleKey,
    module: wgpu::ShaderModule,
    layouts: [wgpu::BindGroupLayout; 2],
}

impl SceneProgram {
    fn new(
        gpu: &Gpu,
        textures: &Textures,
        kinds: Kinds,
        layers: LayersText,
        has_relief: bool,
    ) -> SceneProgram {
        let layouts = [textures.bind_group_layout(&kinds), Uniform::layout(&gpu.device)];
        let text = ModuleKey { kinds, place: textures.inspect().settings().binding, layers, has_relief };
        let module = gpu.kept::<CompiledScenes>().module(&gpu.device, &text, |text| {
            let vastex = textures.wgsl(&text.kinds);
            match has_relief {
                true => shaders::relief(&vastex, layers),
                false => shaders::layered(&vastex, layers),
            }
        });
        SceneProgram { text, module, layouts }
    }

    /// A pipeline that was compiled before or is now. The third bind group is that of a list of layers, else
    /// the key's.
    fn pipeline(
        &self,
        gpu: &Gpu,
        key: PipelineKey,
        of_layers: Option<&wgpu::BindGroupLayout>,
    ) -> wgpu::RenderPipeline {
        let device = &gpu.device;
        gpu.kept::<CompiledScenes>().pipeline(&(self.text.clone(), key), |key| {
            let more = key.group.as_ref().map(|entries| {
                device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                    label: Some("scene"),
                    entries,
                })
            });
            let third = of_layers.or(more.as_ref());
            let groups: Vec<_> = self.layouts.iter().chain(third).map(Some).collect();
            let [place, shade] = &key.entries;
            let constants: Vec<_> =
                key.constants.iter().map(|&(name, bits)| (name, f64::from_bits(bits))).collect();
            let parts = PipelineParts {
                module: &self.module,
                constants: &constants,
                corners: key.corners,
                entries: [place, shade],
                formats: &key.formats,
            };
            parts.drawing(device, &groups, key.drawing)
        })
    }
}

/// Values of constants as they are compared.
fn bits(constants: impl Iterator<Item = (&'static str, f64)>) -> Vec<(&'static str, u64)> {
    constants.map(|(name, value)| (name, value.to_bits())).collect()
}

/// What pipelines with fixed.wgsl are made with.
fn of_globe(scene: Scene) -> (&'static str, f64) {
    ("FIXED_GLOBE", f64::from(u8::from(scene.is_round())))
}
