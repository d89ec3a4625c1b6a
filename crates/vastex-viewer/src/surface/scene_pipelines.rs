//! The pipelines of a scene: one for each way in which its surface is placed, of one shader module.

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
    pub(super) mesh: wgpu::RenderPipeline,
    pub(super) fixed: Option<wgpu::RenderPipeline>,
}

/// Makes the pipelines of a scene.
#[derive(Debug)]
pub(super) struct PipelineMaker {
    /// Every entry point that draws the scene.
    module: wgpu::ShaderModule,
    constants: Vec<(&'static str, f64)>,
    /// What constants of flat surfaces follow from, for plans.
    flat: (Scene, Tiling),
    /// In either way.
    corners: [Corners; 2],
    has_fixed: bool,
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
        &self,
        device: &wgpu::Device,
        place: &str,
        shade: &str,
        group: Option<&wgpu::BindGroupLayout>,
        formats: &[wgpu::TextureFormat],
    ) -> ScenePipelines {
        self.of_ways(
            device,
            [&|way| format!("{place}_{way}"), &|way| format!("{shade}_{way}")],
            group,
            formats,
        )
    }

    /// Those of the feedback pass.
    pub(super) fn wanted(&self, device: &wgpu::Device) -> ScenePipelines {
        let entries: [&dyn Fn(&str) -> String; 2] =
            [&|way| format!("place_{way}_feedback"), &|way| format!("want_{way}")];
        self.of_ways(device, entries, None, &[Textures::FEEDBACK_FORMAT])
    }

    fn of_ways(
        &self,
        device: &wgpu::Device,
        entries: [&dyn Fn(&str) -> String; 2],
        group: Option<&wgpu::BindGroupLayout>,
        formats: &[wgpu::TextureFormat],
    ) -> ScenePipelines {
        let groups = self.groups(group);
        let pipeline = |way: &str, corners| {
            let entries = entries.map(|entry| entry(way));
            self.parts([&entries[0], &entries[1]], corners, formats).pipeline(device, &groups)
        };
        let [mesh, fixed] = self.corners;
        let fixed = self.has_fixed.then(|| pipeline("fixed", fixed));
        ScenePipelines { mesh: pipeline("mesh", mesh), fixed }
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
    pub(super) fn spread(&self, device: &wgpu::Device) -> Option<wgpu::RenderPipeline> {
        self.has_texture_space.then(|| {
            let spread = self.parts(["spread", "need"], self.corners[0], &[Textures::TEXTURE_SPACE_FORMAT]);
            spread.blended(device, &self.groups(None), Textures::TEXTURE_SPACE_BLEND)
        })
    }

    /// What draws a plan of a layer over the whole picture. Fails where the texture was removed.
    pub(super) fn plan(
        &self,
        device: &wgpu::Device,
        textures: &Textures,
        layer: LayerId,
        color_map: ColorMap,
        (entry, group): (&str, Option<&wgpu::BindGroupLayout>),
    ) -> Result<wgpu::RenderPipeline, Error> {
        // A plan is of a texture, not of the group that is sampled where there are heights or several layers.
        let kinds = textures.kinds(layer)?;
        let flat = || shader_module(device, Some("plan"), shaders::flat(&textures.wgsl(&kinds)));
        let module = if self.has_plans { &self.module } else { &flat() };
        let textures_layout = textures.bind_group_layout(&kinds);
        let mut groups = vec![Some(&textures_layout), Some(&self.camera_layout)];
        groups.extend(group.map(Some));
        let (scene, tiling) = self.flat;
        let of_map = color_map.constants(takes_light(self.format)).into_iter();
        let constants: Vec<_> = of_map.chain(tiling.constants()).chain([of_globe(scene)]).collect();
        let (corners, constants, formats) = (Corners::None, &constants, &[self.format]);
        let parts = PipelineParts { module, constants, corners, entries: ["fill", entry], formats };
        Ok(parts.plan(device, &groups))
    }
}

/// What pipelines with fixed.wgsl are made with.
fn of_globe(scene: Scene) -> (&'static str, f64) {
    ("FIXED_GLOBE", f64::from(u8::from(scene == Scene::Globe)))
}
