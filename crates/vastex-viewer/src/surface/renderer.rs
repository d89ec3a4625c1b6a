//! Draws a scene: the picture, and the feedback pass that goes with it.
//!
//! The picture from an ordinary texture, to compare with, is the business of those who judge pictures.

mod parts;
mod plans;

use std::sync::{Arc, OnceLock};

use glam::Vec4;
use vastex::{Error, LayerId, Region, Sampled, TextureId, Textures};

use super::camera_binding::{CameraBinding, Placed, Places};
use super::compiled::CompiledScenes;
use super::fixed::{self, LayerPlace};
use super::mesh::{Mesh, grid, surface};
use super::patches::QUADS;
use super::planet::PlanetLight;
use super::relief::{Relief, ReliefSurface};
use super::scene_pipelines::{PipelineMaker, ScenePipelines};
use super::tiling::Tiling;
use crate::camera::Pose;
use crate::gpu::Gpu;
use crate::layers::{ColorMap, Ground, LayerUniform, Layers, MOST_LAYERS};
use crate::picture::PicturePart;
use crate::scene::Scene;
use crate::stage::{StageScene, Target, TargetKind, Uniform, filled_buffer, takes_light};

/// What is drawn.
#[derive(Clone, Debug)]
pub struct SceneDesc {
    /// The scene.
    pub scene: Scene,
    /// What is on it. The first layer's texture says how wide the image is.
    pub layers: Layers,
    /// The heights that displace it, which the layers were made with; without any a terrain is flat.
    pub relief: Option<Relief>,
    /// How textures lie on a surface without heights.
    pub tiling: Tiling,
    /// True to draw the image in fixed point at any size and distance; false to do so only where a mesh would
    /// not be exact.
    pub always_fixed: bool,
    /// How a planet is lit; without effect on other scenes.
    pub light: PlanetLight,
}

/// What a picture follows from beside the contents of textures: pictures of one renderer whose shaders were
/// told the same are the same. Another renderer's are never taken for them.
#[cfg(feature = "egui")]
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Told {
    /// What is bound for one renderer's camera, and for nothing else.
    camera_group: wgpu::BindGroup,
    camera: Vec<u8>,
    layers: u64,
}

/// A scene with textures on it, ready to be drawn.
#[derive(Debug)]
pub struct SceneRenderer {
    /// What it was made of, but for the layers.
    made_of: SceneDesc,
    layers: Layers,
    relief: Option<ReliefSurface>,
    /// What pictures of its size are of a whole one.
    part: Option<PicturePart>,
    /// What pictures of its size are of what a camera sees.
    view: Option<PicturePart>,
    /// Which part of pictures panes share.
    room: Option<PicturePart>,
    ground: Ground,
    /// Texels of the first layer's texture.
    size: [u32; 2],
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
    camera: CameraBinding,
    /// What is told of the layers of a list.
    told_layers: Option<Uniform>,
    /// How often something was told of layers.
    layer_changes: u64,
    maker: Arc<PipelineMaker>,
    picture: ScenePipelines,
    wanted: ScenePipelines,
    /// Texture space is one texture's, not a group's.
    spread: OnceLock<Option<wgpu::RenderPipeline>>,
    /// What is around a planet.
    sky: Option<OnceLock<wgpu::RenderPipeline>>,
}

impl SceneRenderer {
    /// Prepares a scene for pictures of `format`. A list of layers is drawn as light: into half floats or an
    /// sRGB format; other formats are given it encoded. Fails where a texture was removed.
    pub fn new(
        gpu: &Gpu,
        textures: &Textures,
        desc: SceneDesc,
        format: wgpu::TextureFormat,
    ) -> Result<SceneRenderer, Error> {
        let Gpu { device, queue, .. } = gpu;
        let SceneDesc { scene, layers, relief, tiling, .. } = desc.clone();
        let size = match layers.iter().next() {
            Some(first) => textures.texture(first.layer.texture())?.description().geometry.size(),
            None => [1; 3],
        };
        let image = f64::from(size[0]) / f64::from(size[1]);
        let mut relief = relief.map(|relief| relief.surface(scene, image as f32));
        if let Some(relief) = relief.as_mut().filter(|_| scene == Scene::Planet) {
            relief.exaggerate(desc.light.exaggeration);
        }
        let mesh = if relief.is_some() { patch_mesh() } else { surface(scene, image as f32) };
        let filled = |bytes, usage| filled_buffer(device, queue, bytes, usage);
        let maker =
            Arc::new(PipelineMaker::new(gpu, textures, scene, (&layers, relief.as_ref()), tiling, format)?);
        let mut renderer = SceneRenderer {
            made_of: desc,
            size: [size[0], size[1]],
            vertices: filled(bytemuck::cast_slice(&mesh.vertices), wgpu::BufferUsages::VERTEX),
            indices: filled(bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX),
            index_count: mesh.indices.len() as u32,
            camera: CameraBinding::new(device, maker.camera_layout(), relief.is_some()),
            told_layers: maker
                .layers_layout()
                .map(|layout| Uniform::new::<[LayerUniform; MOST_LAYERS]>(device, layout)),
            layer_changes: 0,
            picture: maker.pipelines("place", "shade", None, &[format]),
            wanted: maker.wanted(),
            spread: OnceLock::new(),
            sky: layers.is_on_planet().then(OnceLock::new),
            maker,
            relief,
            part: None,
            view: None,
            room: None,
            ground: Ground::default(),
            layers: layers.clone(),
        };
        renderer.set_layers(queue, textures, &layers);
        Ok(renderer)
    }

    /// Into what a list of layers is drawn.
    pub fn target_kind(adapter: &wgpu::Adapter, layers: &Layers) -> TargetKind {
        TargetKind::for_layers(adapter, if layers.is_single() { 1 } else { 2 })
    }

    /// What the layers are like in frames from here on: those of the list that the renderer was made with,
    /// after [`Layers::set`] said that it can stay.
    pub fn set_layers(&mut self, queue: &wgpu::Queue, textures: &Textures, layers: &Layers) {
        self.layers = layers.clone();
        self.layer_changes += 1;
        if let Some(told) = &self.told_layers {
            told.set(queue, &layers.uniforms(textures));
        }
    }

    /// How a planet is lit from the next frame on. Without effect on other scenes.
    pub fn set_light(&mut self, light: PlanetLight) {
        self.made_of.light = light;
        if let Some(relief) = self.relief.as_mut().filter(|_| self.made_of.scene == Scene::Planet) {
            relief.exaggerate(light.exaggeration);
        }
    }

    /// What is seen around the surface and through it, from the next pose on. Around a planet is space.
    pub fn set_ground(&mut self, ground: Ground) {
        self.ground = ground;
    }

    fn ground(&self) -> Ground {
        if self.made_of.scene == Scene::Planet { Ground::Dark } else { self.ground }
    }

    /// How a planet is lit.
    pub fn light(&self) -> PlanetLight {
        self.made_of.light
    }

    /// This scene with another list of layers, for pictures of the same format.
    pub fn with_layers(
        &self,
        gpu: &Gpu,
        textures: &Textures,
        layers: Layers,
    ) -> Result<SceneRenderer, Error> {
        let desc = SceneDesc { layers, ..self.made_of.clone() };
        let renderer = SceneRenderer::new(gpu, textures, desc, self.format())?;
        Ok(SceneRenderer { part: self.part, view: self.view, ground: self.ground, ..renderer })
    }

    /// The heights that say how high the ground is below a camera, in a picture of so many pixels: texels of
    /// their texture, on the levels that are asked for; `None` if no heights displace the scene.
    pub fn ground_below(
        &self,
        textures: &Textures,
        pose: &Pose,
        picture: [u32; 2],
    ) -> Option<(TextureId, Region)> {
        self.relief.as_ref()?.region_below(textures, pose, self.view_in(picture).whole)
    }

    /// The scene.
    pub fn scene(&self) -> Scene {
        self.made_of.scene
    }

    /// The value that is drawn where there is no surface, in the values of the renderer's pictures.
    pub fn background(&self) -> Vec4 {
        self.ground().told(takes_light(self.format()))[0]
    }

    /// Width over height of the image.
    pub fn image_aspect(&self) -> f64 {
        f64::from(self.size[0]) / f64::from(self.size[1])
    }

    /// Where the camera is in the frame that is about to be drawn, and how many pixels the picture has. Over
    /// heights it is as far above the ground as the pose says, as far as `textures` know the ground.
    pub fn set_pose(&self, queue: &wgpu::Queue, textures: &Textures, pose: &Pose, picture: [u32; 2]) {
        self.place(&self.camera, queue, textures, pose, picture);
    }

    /// A camera to draw the scene through from another place in the same encoder.
    pub fn new_camera(&self, device: &wgpu::Device) -> CameraBinding {
        CameraBinding::new(device, self.maker.camera_layout(), self.relief.is_some())
    }

    /// Draws the level that each part of the texture needs, into a pass of [`vastex::Ahead::texture_space`];
    /// `None` if heights displace the scene or several layers are on it.
    pub fn draw_spread(&self, pass: &mut wgpu::RenderPass<'_>, texture_group: &wgpu::BindGroup) {
        if let Some(spread) = self.spread.get_or_init(|| self.maker.spread()) {
            self.bind(&self.camera, pass, spread, texture_group);
            self.draw_mesh(pass);
        }
    }

    /// What the scene's own camera sees it through.
    pub fn camera(&self) -> &CameraBinding {
        &self.camera
    }

    /// What the shaders of its pictures are told through its own camera, as that was placed last.
    #[cfg(feature = "egui")]
    pub(crate) fn told(&self) -> Told {
        let (camera, layers) = (self.camera.last_bytes(), self.layer_changes);
        Told { camera_group: self.camera.group().clone(), camera, layers }
    }

    /// Draws by pipelines of [`SceneRenderer::pipelines`], through its own camera, in every pane.
    pub fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipelines: &ScenePipelines,
        texture_group: &wgpu::BindGroup,
    ) {
        for pane in 0..self.layers.panes() {
            self.turn_to_pane(&self.camera, pass, pane);
            self.draw_through(&self.camera, pass, pipelines, texture_group);
        }
    }

    /// What is drawn next is in a pane, where there are several.
    fn turn_to_pane(&self, camera: &CameraBinding, pass: &mut wgpu::RenderPass<'_>, pane: u32) {
        if self.layers.panes() > 1 {
            let [left, width, height] = camera.pane();
            pass.set_viewport(left + pane as f32 * width, 0.0, width, height, 0.0, 1.0);
        }
    }

    /// Draws the surface as a camera sees it: as a mesh or in fixed point.
    fn draw_through(
        &self,
        camera: &CameraBinding,
        pass: &mut wgpu::RenderPass<'_>,
        pipelines: &ScenePipelines,
        texture_group: &wgpu::BindGroup,
    ) {
        let fixed = camera.is_fixed().then(|| pipelines.fixed()).flatten();
        self.bind(camera, pass, fixed.unwrap_or_else(|| pipelines.mesh()), texture_group);
        match (&self.relief, fixed) {
            (Some(_), _) => {
                pass.set_vertex_buffer(0, camera.patches.slice(..));
                pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..self.index_count, 0, 0..camera.patch_count());
            }
            (None, Some(_)) => pass.draw(0..3, 0..1),
            (None, None) => self.draw_mesh(pass),
        }
    }

    fn draw_mesh(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.index_count, 0, 0..1);
    }

    /// Sets everything that all pipelines of the scene share.
    fn bind(
        &self,
        camera: &CameraBinding,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        texture_group: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, texture_group, &[]);
        pass.set_bind_group(1, camera.group(), &[]);
        if let Some(layers) = &self.told_layers {
            pass.set_bind_group(2, &layers.group, &[]);
        }
    }

    /// Pipelines that draw the same surface by another entry point of the fragment stage, `entry_mesh` and
    /// `entry_fixed` in the text: its targets, and the layout of one more bind group, for a scene of one
    /// opaque layer.
    pub fn pipelines(
        &self,
        entry: &str,
        group: Option<&[wgpu::BindGroupLayoutEntry]>,
        formats: &[wgpu::TextureFormat],
    ) -> ScenePipelines {
        self.maker.pipelines("place", entry, group, formats)
    }

    /// Compiles the pipelines of picture and feedback that nothing was drawn with yet. A host that is to miss
    /// no frame when a camera comes so near that a mesh is not exact any more calls this while nobody waits.
    /// Costs tens of milliseconds the first time, then nothing.
    pub fn compile_all(&self) {
        self.picture.compile();
        self.wanted.compile();
        if let Some(sky) = &self.sky {
            sky.get_or_init(|| self.maker.sky());
        }
    }

    /// Pipelines that were compiled for scenes on a device so far. A pipeline that a scene before had is not
    /// compiled again, so a frame in which this grows may have taken longer for it.
    pub fn pipelines_compiled(gpu: &Gpu) -> u32 {
        gpu.kept::<CompiledScenes>().compiled()
    }

    /// How a camera sees the scene in fixed point at a pose: the texel that it is told from; `None` if a mesh
    /// is exact enough.
    pub fn anchor(&self, textures: &Textures, pose: &Pose, picture: [u32; 2]) -> Option<[u32; 2]> {
        match self.placed(textures, pose, &self.part_of(picture)).0 {
            Placed::Fixed(fixed) => Some(fixed.anchor()),
            Placed::FixedRelief(seen) => Some(seen.fixed.anchor()),
            Placed::Mesh(_) | Placed::Relief(_) => None,
        }
    }

    /// How a part of a picture is seen, what uv is in the middle of the view where that is told, and which
    /// part of what the camera sees it is: an image's camera is moved itself.
    fn placed(
        &self,
        textures: &Textures,
        pose: &Pose,
        part: &PicturePart,
    ) -> (Placed, glam::DVec2, PicturePart) {
        let is_image = matches!(pose, Pose::Image { .. });
        let seen = if is_image { PicturePart::all(part.size) } else { self.seen_in(part) };
        let (pose, picture) = (&pose.in_part(part, self.size), seen.whole);
        let is_always_fixed = self.made_of.always_fixed || self.layers.is_by_texel();
        let is_fixed =
            self.maker.has_fixed && (is_always_fixed || fixed::is_needed(pose, self.size, picture));
        let middle = fixed::middle(pose).unwrap_or_default();
        match &self.relief {
            Some(relief) => {
                let in_fixed_point = || relief.seen_in_fixed_point(textures, pose, self.size, &seen);
                match is_fixed.then(in_fixed_point).flatten() {
                    Some(placed) => {
                        let middle = placed.middle;
                        (Placed::FixedRelief(placed), middle, seen)
                    }
                    None => (Placed::Relief(relief.seen_from(textures, pose, &seen)), middle, seen),
                }
            }
            None => {
                let uniform = || fixed::uniform(pose, self.size, picture);
                let view = f64::from(picture[0] as f32) / f64::from(picture[1] as f32);
                let mesh = || Placed::Mesh(seen.cropped(pose.clip_from_world(view, self.image_aspect())));
                (is_fixed.then(uniform).flatten().map_or_else(mesh, Placed::Fixed), middle, seen)
            }
        }
    }

    /// The heights that displace the scene.
    pub(super) fn relief(&self) -> Option<&ReliefSurface> {
        self.relief.as_ref()
    }

    /// How textures lie on the surface.
    pub(super) fn tiling(&self) -> Tiling {
        self.made_of.tiling
    }

    /// Returns true if heights displace the scene.
    pub fn has_relief(&self) -> bool {
        self.relief.is_some()
    }

    /// The format of its pictures.
    pub fn format(&self) -> wgpu::TextureFormat {
        self.maker.format()
    }

    /// What is on the scene.
    pub fn layers(&self) -> &Layers {
        &self.layers
    }

    /// The layer that is asked about where one is meant: of several the uppermost that is seen.
    pub fn layer(&self) -> LayerId {
        self.layers.inspected().layer
    }

    /// How the values of [`SceneRenderer::layer`] become colours.
    pub fn color_map(&self) -> ColorMap {
        self.layers.inspected().color_map
    }
}

impl StageScene for SceneRenderer {
    type Pose = Pose;
    type Camera = CameraBinding;

    fn sampled(&self) -> Sampled {
        self.layers.sampled()
    }

    fn place(
        &self,
        camera: &CameraBinding,
        queue: &wgpu::Queue,
        textures: &Textures,
        pose: &Pose,
        picture: [u32; 2],
    ) {
        // Panes beside each other are seen through one camera; what feedback has of the picture is all of one
        // pane.
        let panes = self.panes_in(picture);
        let part = self.part_of([panes.width, picture[1]]);
        let (placed, middle, seen) = self.placed(textures, pose, &part);
        let place = |spread| LayerPlace::new(middle, spread, self.size);
        let places: Places = self.layers.places(textures).map(place);
        let ids = self.layers.ids(textures);
        let planet = self.sky.as_ref().zip(self.relief.as_ref());
        let view = self.view_in(part.whole);
        let planet = planet.map(|(_, relief)| self.made_of.light.uniform(pose, &view, relief.sea()));
        let seen = (part, seen, &panes, self.ground());
        let placed = (&placed, places, planet, self.layers.growing_told(self.size[1]));
        camera.set(queue, placed, ids, &self.layers.shown_map(), seen);
    }

    fn draw_wanted(
        &self,
        camera: &CameraBinding,
        pass: &mut wgpu::RenderPass<'_>,
        textures: &wgpu::BindGroup,
    ) {
        self.draw_through(camera, pass, &self.wanted, textures);
    }

    fn draw_picture(
        &self,
        camera: &CameraBinding,
        encoder: &mut wgpu::CommandEncoder,
        textures: &wgpu::BindGroup,
        target: &Target<'_>,
    ) {
        let mut pass = target.begin(encoder, self.background());
        if let Some(sky) = &self.sky {
            self.bind(camera, &mut pass, sky.get_or_init(|| self.maker.sky()), textures);
            pass.draw(0..3, 0..1);
        }
        for pane in 0..self.layers.panes() {
            self.turn_to_pane(camera, &mut pass, pane);
            self.draw_through(camera, &mut pass, &self.picture, textures);
        }
    }
}

/// The quads of a patch; where its corners are, the vertex stage knows by their numbers.
fn patch_mesh() -> Mesh {
    let Mesh { indices, .. } = grid([QUADS; 2], |uv| uv.extend(0.0));
    Mesh { vertices: Vec::new(), indices }
}
