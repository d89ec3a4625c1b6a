//! A globe with a texture of any size on it, flown over from orbit down to its texels.
//!
//! Where the camera is is f64, what is drawn is told from the camera (`globe_grid`), and texels in fixed point from the one below it, so
//! nothing trembles. The scene `globe` (`draw`) has its surface in the world, and textures in uv: for up to 2^16 texels per axis.

use std::sync::Arc;

use glam::Mat4;
use vastex::{FeedbackWay, FrameStats, Settings, TextureId, Textures, TileSource};

use crate::compare::Picture;
use crate::draw::{BACKGROUND, PictureTarget, depth_view, filled_buffer};
use crate::globe_grid::{GlobeGrid, GlobePose};
use crate::gpu::Gpu;
use crate::pipeline::{Corners, PipelineParts};
use crate::planet::FORMAT;
use crate::read::read_texture;
use crate::shaders;
use crate::uniform::Uniform;

/// Frames of the path down.
const FRAMES: u64 = 600;

/// What the shader is told; laid out as `Descent` in descent.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct DescentUniform {
    clip_from_camera: Mat4,
    anchor: [u32; 2],
    unused: [u32; 2],
}

/// See the head of the file.
pub struct Descent {
    gpu: Gpu,
    textures: Textures,
    texture: TextureId,
    size: [u32; 2],
    surface: Surface,
    picture: wgpu::RenderPipeline,
    wanted: wgpu::RenderPipeline,
    colour: wgpu::Texture,
    colour_view: wgpu::TextureView,
    depth_view: wgpu::TextureView,
}

impl Descent {
    /// A globe with the first layer of a texture on it, for pictures of `size` pixels. Feedback has a pass of its own.
    pub fn new(
        gpu: &Gpu,
        source: Arc<dyn TileSource>,
        size: [u32; 2],
        settings: Settings,
    ) -> Result<Descent, vastex::Error> {
        let device = &gpu.device;
        let feedback = settings.feedback.filter(|&way| way != FeedbackWay::Inline);
        let settings = Settings { feedback: feedback.or(Some(FeedbackWay::Separate)), ..settings };
        let mut textures = Textures::new(device, &gpu.queue, settings)?;
        let texture = textures.add(source)?;
        let surface = Surface::new(gpu);
        let text = shaders::descent(&textures.wgsl(texture));
        let module = &vastex::shader_module(device, Some("descent"), text);
        let pipeline = |entries, format| {
            let groups = [Some(textures.bind_group_layout(texture)), Some(&surface.layout)];
            PipelineParts { module, constants: &[], corners: Corners::Vertices, entries, formats: &[format] }
                .pipeline(device, &groups)
        };
        let colour = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("descent"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        Ok(Descent {
            picture: pipeline(["place", "shade"], FORMAT),
            wanted: pipeline(["place_feedback", "want"], Textures::FEEDBACK_FORMAT),
            colour_view: colour.create_view(&Default::default()),
            depth_view: depth_view(device, size),
            gpu: gpu.clone(),
            textures,
            texture,
            size,
            surface,
            colour,
        })
    }

    /// Frames of [`Descent::pose`].
    pub const FRAMES: u64 = FRAMES;

    /// The way down: from three radii above to two metres above a place in the Alps, at an even pace in levels; the camera turns to the
    /// horizon as it comes near the ground. Holds its last pose.
    pub fn pose(frame: u64) -> GlobePose {
        let t = frame.min(FRAMES - 1) as f64 / (FRAMES - 1) as f64;
        let altitude = 3.0 * (2.0 * GlobePose::METRE / 3.0).powf(t);
        // On over the ground by as much as is in view.
        let on = altitude.min(1.0) * 2.0;
        GlobePose {
            longitude: 0.14 - on,
            latitude: 0.81 - 0.3 * on,
            altitude,
            pitch: (t * 2.4 - 1.2).clamp(0.0, 1.15),
        }
    }

    /// Plays one frame, but for the picture.
    pub fn frame(&mut self, pose: &GlobePose) -> Result<FrameStats, vastex::Error> {
        let [width, height, _] = self.textures.description(self.texture).geometry.size();
        let view = self.size[0] as f32 / self.size[1] as f32;
        self.surface.set(&self.gpu.queue, &GlobeGrid::new(pose, [width, height], view));
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let (surface, wanted, texture) = (&self.surface, &self.wanted, self.texture);
        self.textures.feedback(&mut encoder, self.size, |pass, groups| {
            surface.draw(pass, wanted, &groups[texture]);
        })?;
        self.textures.update()?;
        self.gpu.queue.submit([encoder.finish()]);
        Ok(self.textures.stats())
    }

    /// The picture of the last frame, from what is in the pool now.
    pub fn picture(&self) -> Picture {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let target = PictureTarget { colour: &self.colour_view, depth: &self.depth_view };
        let mut pass = target.begin(&mut encoder, BACKGROUND);
        self.surface.draw(&mut pass, &self.picture, self.textures.bind_group(self.texture));
        drop(pass);
        Picture { size: self.size, rgba: read_texture(&self.gpu, encoder, &self.colour, 4) }
    }

    /// The textures, to ask about them.
    pub fn textures(&self) -> &Textures {
        &self.textures
    }
}

/// The grid on the GPU, apart from the texture on it.
struct Surface {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    uniform: Uniform,
    layout: wgpu::BindGroupLayout,
}

impl Surface {
    fn new(gpu: &Gpu) -> Surface {
        let device = &gpu.device;
        // Every grid has the same indices, and as many vertices.
        let nowhere = GlobePose { longitude: 0.0, latitude: 0.0, altitude: 1.0, pitch: 0.0 };
        let mesh = GlobeGrid::new(&nowhere, [2, 1], 1.0).mesh;
        let filled = |bytes, usage| filled_buffer(device, &gpu.queue, bytes, usage);
        let layout = Uniform::layout(device);
        let uniform = Uniform::new::<DescentUniform>(device, &layout);
        Surface {
            vertices: filled(bytemuck::cast_slice(&mesh.vertices), wgpu::BufferUsages::VERTEX),
            indices: filled(bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX),
            uniform,
            layout,
        }
    }

    fn set(&self, queue: &wgpu::Queue, grid: &GlobeGrid) {
        let GlobeGrid { mesh, anchor, clip_from_camera } = grid;
        let told = DescentUniform { clip_from_camera: *clip_from_camera, anchor: *anchor, unused: [0; 2] };
        self.uniform.set(queue, &told);
        queue.write_buffer(&self.vertices, 0, bytemuck::cast_slice(&mesh.vertices));
    }

    fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        texture: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, texture, &[]);
        pass.set_bind_group(1, &self.uniform.group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..GlobeGrid::index_count(), 0, 0..1);
    }
}
