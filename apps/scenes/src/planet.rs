//! A planet whose colours, heights, lights and clouds are virtual textures of their own: one group, one
//! feedback entry.
//!
//! What each attribute does to the picture is the shader's business (planet.wgsl); that it is the same from
//! ordinary textures, `reference`'s.

mod reference;

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3};
use vastex::diagnostics::FrameStats;
use vastex::{GroupId, Sampled, Settings, TextureId, Textures, TileSource, ViewId};

use crate::attribute::Attribute;
use crate::shaders;
use crate::wait::read_texture;
use vastex_viewer::Gpu;
use vastex_viewer::Picture;
use vastex_viewer::Pose;
use vastex_viewer::Target;
use vastex_viewer::layers::BACKGROUND;
use vastex_viewer::stage::{
    Canvas, Frame, Pictures, StageScene, StageView, TargetKind, Uniform, filled_buffer,
};
use vastex_viewer::surface::{Corners, PipelineParts};
use vastex_viewer::{Scene, surface};

/// The format of pictures.
pub(crate) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// A texture of a planet.
pub type Part = (Attribute, Arc<dyn TileSource>);

/// What the shaders are told; laid out as `Planet` in planet.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct PlanetUniform {
    clip_from_world: Mat4,
    sun: Vec3,
    relief: f32,
    height_texel: Vec2,
    unused: [f32; 2],
    ids: [u32; 8],
}

/// Towards the sun: over 60 degrees east, 20 degrees north.
const SUN: Vec3 = Vec3::new(0.47, 0.81, 0.34);
/// The Earth's mountains, of heights up to 9 km stored as 0 to 1, made ten times as steep.
const RELIEF: f32 = 0.002;

/// A planet of several attributes, each a texture of its own, and the canvas that it is drawn on.
pub struct Planet {
    pub(crate) gpu: Gpu,
    pub(crate) textures: Textures,
    pub(crate) parts: Vec<Part>,
    pub(crate) scene: PlanetScene,
    /// What the globe is seen through.
    camera: Uniform,
    canvas: Canvas,
}

/// What is drawn of a planet.
pub(crate) struct PlanetScene {
    pub(crate) group: GroupId,
    pub(crate) globe: Globe,
    picture: wgpu::RenderPipeline,
    wanted: wgpu::RenderPipeline,
}

impl Planet {
    /// A planet of these textures, each attribute once at most, for pictures of `size` pixels.
    pub fn new(
        gpu: &Gpu,
        parts: Vec<Part>,
        size: [u32; 2],
        settings: Settings,
    ) -> Result<Planet, vastex::Error> {
        let device = &gpu.device;
        let mut textures = Textures::new(device, &gpu.queue, settings)?;
        let ids: Vec<TextureId> = parts
            .iter()
            .map(|(_, source)| textures.add_blocking(source.clone()))
            .collect::<Result<_, _>>()?;
        let group = textures.add_group(parts.iter().map(|(part, _)| part.name()).zip(ids))?;
        let globe = Globe::new(gpu, height_texel(&parts));
        let attributes: Vec<Attribute> = parts.iter().map(|(part, _)| *part).collect();
        let kinds = textures.kinds(group)?;
        let text = shaders::planet(&textures.wgsl(&kinds), &attributes);
        let module = &vastex::shader_module(device, Some("planet"), text);
        let pipeline = |entries, format| {
            let textures_layout = textures.bind_group_layout(&kinds);
            let groups = [Some(&textures_layout), Some(&globe.layout)];
            PipelineParts { module, constants: &[], corners: Corners::Vertices, entries, formats: &[format] }
                .pipeline(device, &groups)
        };
        Ok(Planet {
            camera: Uniform::new::<PlanetUniform>(device, &globe.layout),
            canvas: Canvas::new(gpu, size, FORMAT, TargetKind::Direct),
            scene: PlanetScene {
                picture: pipeline(["place", "shade"], FORMAT),
                wanted: pipeline(["place_feedback", "want"], Textures::FEEDBACK_FORMAT),
                group,
                globe,
            },
            gpu: gpu.clone(),
            textures,
            parts,
        })
    }

    /// Plays one frame, but for the picture.
    pub fn frame(&mut self, pose: Pose) -> Result<FrameStats, vastex::Error> {
        let views = [StageView { view: ViewId::MAIN, camera: &self.camera, pose }];
        let (picture, pictures) = (self.canvas.size(), Pictures::ForFeedback);
        let frame = Frame { views: &views, expected: None, picture, has_feedback: true, pictures };
        let target = self.canvas.target();
        let encoder = frame.record(&self.gpu, &mut self.textures, &self.scene, &target, |_, _| Ok(()))?;
        self.gpu.queue.submit([encoder.finish()]);
        Ok(self.textures.stats())
    }

    /// The picture of the last frame, from what is in the pools now.
    pub fn picture(&self) -> Picture {
        self.picture_by(&self.scene.picture, None)
    }

    /// The same by another pipeline, with one more bind group.
    pub(crate) fn picture_by(
        &self,
        pipeline: &wgpu::RenderPipeline,
        more: Option<&wgpu::BindGroup>,
    ) -> Picture {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut pass = self.canvas.target().begin(&mut encoder, BACKGROUND);
        pass.set_bind_group(2, more, &[]);
        let PlanetScene { globe, group, .. } = &self.scene;
        if let Ok(group) = self.textures.bind_group(*group) {
            globe.draw(&mut pass, pipeline, &self.camera, group);
        }
        drop(pass);
        Picture { size: self.canvas.size(), rgba: read_texture(&self.gpu, encoder, self.canvas.picture(), 4) }
    }

    /// The textures, to ask about them.
    pub fn textures(&self) -> &Textures {
        &self.textures
    }
}

impl StageScene for PlanetScene {
    type Pose = Pose;
    type Camera = Uniform;

    fn sampled(&self) -> Sampled {
        self.group.into()
    }

    fn place(
        &self,
        camera: &Uniform,
        queue: &wgpu::Queue,
        textures: &Textures,
        pose: &Pose,
        [width, height]: [u32; 2],
    ) {
        let mut ids = [0; 8];
        let of_group = textures.bindings().ids(self.group).unwrap_or_default();
        ids.iter_mut().zip(of_group).for_each(|(place, id)| *place = id);
        let told = PlanetUniform {
            clip_from_world: pose.clip_from_world(f64::from(width) / f64::from(height), 2.0),
            sun: SUN.normalize(),
            relief: RELIEF,
            height_texel: self.globe.height_texel,
            unused: [0.0; 2],
            ids,
        };
        camera.set(queue, &told);
    }

    fn draw_wanted(&self, camera: &Uniform, pass: &mut wgpu::RenderPass<'_>, textures: &wgpu::BindGroup) {
        self.globe.draw(pass, &self.wanted, camera, textures);
    }

    fn draw_picture(
        &self,
        camera: &Uniform,
        encoder: &mut wgpu::CommandEncoder,
        textures: &wgpu::BindGroup,
        target: &Target<'_>,
    ) {
        self.globe.draw(&mut target.begin(encoder, BACKGROUND), &self.picture, camera, textures);
    }
}

/// The globe under its sun, apart from the textures on it.
pub(crate) struct Globe {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
    height_texel: Vec2,
    pub(crate) layout: wgpu::BindGroupLayout,
}

impl Globe {
    fn new(gpu: &Gpu, height_texel: Vec2) -> Globe {
        let (device, mesh) = (&gpu.device, surface(Scene::Globe, 2.0));
        let filled = |bytes, usage| filled_buffer(device, &gpu.queue, bytes, usage);
        Globe {
            vertices: filled(bytemuck::cast_slice(&mesh.vertices), wgpu::BufferUsages::VERTEX),
            indices: filled(bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX),
            index_count: mesh.indices.len() as u32,
            height_texel,
            layout: Uniform::layout(device),
        }
    }

    fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        camera: &Uniform,
        textures: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, textures, &[]);
        pass.set_bind_group(1, &camera.group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.index_count, 0, 0..1);
    }
}

/// uv of a texel of the heights.
fn height_texel(parts: &[Part]) -> Vec2 {
    let heights = parts.iter().find(|(part, _)| *part == Attribute::Height);
    let [width, height, _] = heights.map_or([1; 3], |(_, source)| source.description().geometry.size());
    Vec2::new(1.0 / width as f32, 1.0 / height as f32)
}
