//! A planet whose colours, heights, lights and clouds are virtual textures of their own: one group, one feedback entry.
//!
//! What each attribute does to the picture is the shader's business (planet.wgsl); that it is the same from ordinary textures,
//! `planet_reference`'s.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3};
use vastex::{FeedbackWay, FrameStats, GroupId, Settings, TextureId, Textures, TileSource};

use crate::compare::Picture;
use crate::draw::{BACKGROUND, PictureTarget, depth_view, filled_buffer};
use crate::gpu::Gpu;
use crate::pipeline::{Corners, PipelineParts};
use crate::pose::Pose;
use crate::read::read_texture;
use crate::scene::{Scene, surface};
use crate::shaders;
use crate::uniform::Uniform;

/// The format of pictures.
pub(crate) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// What a texture of a planet says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Attribute {
    /// The ground by day.
    Color,
    /// How high it is, in the first channel.
    Height,
    /// How light it is by night, in the first channel.
    Night,
    /// How dense the clouds over it are, in the first channel.
    Clouds,
}

impl Attribute {
    /// Every attribute.
    pub const ALL: [Attribute; 4] =
        [Attribute::Color, Attribute::Height, Attribute::Night, Attribute::Clouds];

    /// Its name, as the member of a group and for people.
    pub fn name(self) -> &'static str {
        match self {
            Attribute::Color => "color",
            Attribute::Height => "height",
            Attribute::Night => "night",
            Attribute::Clouds => "clouds",
        }
    }

    /// What is seen where there is no texture of it.
    pub(crate) fn without(self) -> &'static str {
        match self {
            Attribute::Color => "vec4<f32>(0.35, 0.35, 0.35, 1.0)",
            Attribute::Height | Attribute::Night | Attribute::Clouds => "vec4<f32>()",
        }
    }
}

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
}

/// Towards the sun: over 60 degrees east, 20 degrees north.
const SUN: Vec3 = Vec3::new(0.47, 0.81, 0.34);
/// The Earth's mountains, of heights up to 9 km stored as 0 to 1, made ten times as steep.
const RELIEF: f32 = 0.002;

/// See the head of the file.
pub struct Planet {
    pub(crate) gpu: Gpu,
    pub(crate) textures: Textures,
    pub(crate) parts: Vec<Part>,
    pub(crate) group: GroupId,
    pub(crate) globe: Globe,
    size: [u32; 2],
    picture: wgpu::RenderPipeline,
    wanted: wgpu::RenderPipeline,
    colour: wgpu::Texture,
    colour_view: wgpu::TextureView,
    depth_view: wgpu::TextureView,
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
        let ids: Vec<TextureId> =
            parts.iter().map(|(_, source)| textures.add(source.clone())).collect::<Result<_, _>>()?;
        let group = textures.add_group(parts.iter().map(|(part, _)| part.name()).zip(ids))?;
        let globe = Globe::new(gpu, height_texel(&parts));
        let attributes: Vec<Attribute> = parts.iter().map(|(part, _)| *part).collect();
        let text = shaders::planet(&textures.wgsl(group), &attributes);
        let module = &vastex::shader_module(device, Some("planet"), text);
        let pipeline = |entries, format| {
            let groups = [Some(textures.bind_group_layout(group)), Some(&globe.layout)];
            PipelineParts { module, constants: &[], corners: Corners::Vertices, entries, formats: &[format] }
                .pipeline(device, &groups)
        };
        let colour = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("planet"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        Ok(Planet {
            picture: pipeline(["place", "shade"], FORMAT),
            wanted: pipeline(["place_feedback", "want"], Textures::FEEDBACK_FORMAT),
            colour_view: colour.create_view(&Default::default()),
            depth_view: depth_view(device, size),
            gpu: gpu.clone(),
            textures,
            parts,
            group,
            globe,
            size,
            colour,
        })
    }

    /// Plays one frame, but for the picture.
    pub fn frame(&mut self, pose: Pose) -> Result<FrameStats, vastex::Error> {
        self.globe.look_from(&self.gpu.queue, pose, self.size);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let (globe, wanted, group) = (&self.globe, &self.wanted, self.group);
        self.textures
            .feedback(&mut encoder, self.size, |pass, groups| globe.draw(pass, wanted, &groups[group]))?;
        self.textures.update()?;
        if self.textures.feedback_way() == FeedbackWay::Inline {
            let (size, picture) = (self.size, &self.picture);
            let target = PictureTarget { colour: &self.colour_view, depth: &self.depth_view };
            self.textures.main_pass(&mut encoder, size, |encoder, groups| {
                globe.draw(&mut target.begin(encoder, BACKGROUND), picture, &groups[group]);
            })?;
        }
        self.gpu.queue.submit([encoder.finish()]);
        Ok(self.textures.stats())
    }

    /// The picture of the last frame, from what is in the pools now.
    pub fn picture(&self) -> Picture {
        self.picture_by(&self.picture, None)
    }

    /// The same by another pipeline, with one more bind group.
    pub(crate) fn picture_by(
        &self,
        pipeline: &wgpu::RenderPipeline,
        more: Option<&wgpu::BindGroup>,
    ) -> Picture {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let target = PictureTarget { colour: &self.colour_view, depth: &self.depth_view };
        let mut pass = target.begin(&mut encoder, BACKGROUND);
        pass.set_bind_group(2, more, &[]);
        self.globe.draw(&mut pass, pipeline, self.textures.bind_group(self.group));
        drop(pass);
        Picture { size: self.size, rgba: read_texture(&self.gpu, encoder, &self.colour, 4) }
    }

    /// The textures, to ask about them.
    pub fn textures(&self) -> &Textures {
        &self.textures
    }
}

/// The globe under its sun, apart from the textures on it.
pub(crate) struct Globe {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
    height_texel: Vec2,
    uniform: Uniform,
    pub(crate) layout: wgpu::BindGroupLayout,
}

impl Globe {
    fn new(gpu: &Gpu, height_texel: Vec2) -> Globe {
        let (device, mesh) = (&gpu.device, surface(Scene::Globe, 2.0));
        let filled = |bytes, usage| filled_buffer(device, &gpu.queue, bytes, usage);
        let layout = Uniform::layout(device);
        let uniform = Uniform::new::<PlanetUniform>(device, &layout);
        Globe {
            vertices: filled(bytemuck::cast_slice(&mesh.vertices), wgpu::BufferUsages::VERTEX),
            indices: filled(bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX),
            index_count: mesh.indices.len() as u32,
            height_texel,
            uniform,
            layout,
        }
    }

    fn look_from(&self, queue: &wgpu::Queue, pose: Pose, size: [u32; 2]) {
        let told = PlanetUniform {
            clip_from_world: pose.clip_from_world(size[0] as f32 / size[1] as f32, 2.0),
            sun: SUN.normalize(),
            relief: RELIEF,
            height_texel: self.height_texel,
            unused: [0.0; 2],
        };
        self.uniform.set(queue, &told);
    }

    fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        textures: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, textures, &[]);
        pass.set_bind_group(1, &self.uniform.group, &[]);
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
