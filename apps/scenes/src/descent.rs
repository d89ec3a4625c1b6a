//! A globe with a texture of any size on it, flown over from orbit down to its texels.
//!
//! Where the camera is is f64, what is drawn is told from the camera (`globe_grid`), and texels in fixed
//! point from the one below it, so nothing trembles. The scene `globe` (`vastex-viewer`) is drawn in fixed
//! point where its mesh would not be exact; this one always is, on a grid of its own.

use std::sync::Arc;

use glam::Mat4;
use vastex::diagnostics::FrameStats;
use vastex::{FeedbackMode, Sampled, Settings, TextureId, Textures, TileSource, ViewId};

use crate::planet::FORMAT;
use crate::shaders;
use crate::wait::read_texture;
use vastex_viewer::Gpu;
use vastex_viewer::Picture;
use vastex_viewer::Target;
use vastex_viewer::layers::BACKGROUND;
use vastex_viewer::stage::{
    Canvas, Frame, Pictures, StageScene, StageView, TargetKind, Uniform, draw_again, filled_buffer,
};
use vastex_viewer::surface::{Corners, PipelineParts};
use vastex_viewer::{GlobeGrid, GlobePose};

/// Frames of the path down.
const FRAMES: u64 = 600;

/// What the shader is told; laid out as `Descent` in descent.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct DescentUniform {
    clip_from_camera: Mat4,
    anchor: [u32; 2],
    texture: u32,
    unused: u32,
}

/// A globe with a texture of any size, flown over from orbit down to its texels.
pub struct Descent {
    gpu: Gpu,
    textures: Textures,
    scene: DescentScene,
    camera: DescentCamera,
    canvas: Canvas,
}

/// What is drawn of the globe.
struct DescentScene {
    texture: TextureId,
    indices: wgpu::Buffer,
    picture: wgpu::RenderPipeline,
    wanted: wgpu::RenderPipeline,
}

/// The grid as one camera sees it.
struct DescentCamera {
    vertices: wgpu::Buffer,
    uniform: Uniform,
}

impl Descent {
    /// A globe with the first layer of a texture on it, for pictures of `size` pixels. Feedback has a pass of
    /// its own.
    pub fn new(
        gpu: &Gpu,
        source: Arc<dyn TileSource>,
        size: [u32; 2],
        settings: Settings,
    ) -> Result<Descent, vastex::Error> {
        let device = &gpu.device;
        let feedback = settings.feedback.filter(|&mode| mode != FeedbackMode::Inline);
        let settings = Settings { feedback: feedback.or(Some(FeedbackMode::Separate)), ..settings };
        let mut textures = Textures::new(device, &gpu.queue, settings)?;
        let texture = textures.add_blocking(source)?;
        let layout = Uniform::layout(device);
        let kinds = textures.kinds(texture)?;
        let text = shaders::descent(&textures.wgsl(&kinds));
        let module = &vastex::shader_module(device, Some("descent"), text);
        let pipeline = |entries, format| {
            let textures_layout = textures.bind_group_layout(&kinds);
            let groups = [Some(&textures_layout), Some(&layout)];
            PipelineParts { module, constants: &[], corners: Corners::Vertices, entries, formats: &[format] }
                .pipeline(device, &groups)
        };
        // Every grid has the same indices, and as many vertices.
        let nowhere = GlobePose { longitude: 0.0, latitude: 0.0, altitude: 1.0, pitch: 0.0 };
        let mesh = GlobeGrid::new(&nowhere, [2, 1], 1.0).mesh;
        let filled = |bytes, usage| filled_buffer(device, &gpu.queue, bytes, usage);
        Ok(Descent {
            camera: DescentCamera {
                vertices: filled(bytemuck::cast_slice(&mesh.vertices), wgpu::BufferUsages::VERTEX),
                uniform: Uniform::new::<DescentUniform>(device, &layout),
            },
            scene: DescentScene {
                indices: filled(bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX),
                picture: pipeline(["place", "shade"], FORMAT),
                wanted: pipeline(["place_feedback", "want"], Textures::FEEDBACK_FORMAT),
                texture,
            },
            canvas: Canvas::new(gpu, size, FORMAT, TargetKind::Direct),
            gpu: gpu.clone(),
            textures,
        })
    }

    /// Frames of [`Descent::pose`].
    pub const FRAMES: u64 = FRAMES;

    /// The way down: from three radii above to two metres above a place in the Alps, at an even pace in
    /// levels; the camera turns to the horizon as it comes near the ground. Holds its last pose.
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
        let views = [StageView { view: ViewId::MAIN, camera: &self.camera, pose: *pose }];
        let (picture, pictures) = (self.canvas.size(), Pictures::Never);
        let frame = Frame { views: &views, expected: None, picture, has_feedback: true, pictures };
        let target = self.canvas.target();
        let encoder = frame.record(&self.gpu, &mut self.textures, &self.scene, &target, |_, _| Ok(()))?;
        self.gpu.queue.submit([encoder.finish()]);
        Ok(self.textures.stats())
    }

    /// The picture of the last frame, from what is in the pool now.
    pub fn picture(&self) -> Picture {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        draw_again(&mut encoder, &self.textures, &self.scene, &self.camera, &self.canvas.target());
        Picture { size: self.canvas.size(), rgba: read_texture(&self.gpu, encoder, self.canvas.picture(), 4) }
    }

    /// The textures, to ask about them.
    pub fn textures(&self) -> &Textures {
        &self.textures
    }
}

impl StageScene for DescentScene {
    type Pose = GlobePose;
    type Camera = DescentCamera;

    fn sampled(&self) -> Sampled {
        self.texture.into()
    }

    fn place(
        &self,
        camera: &DescentCamera,
        queue: &wgpu::Queue,
        textures: &Textures,
        pose: &GlobePose,
        picture: [u32; 2],
    ) {
        let Ok(shown) = textures.texture(self.texture) else { return };
        let [width, height, _] = shown.description().geometry.size();
        let view = picture[0] as f32 / picture[1] as f32;
        let GlobeGrid { mesh, anchor, clip_from_camera } = GlobeGrid::new(pose, [width, height], view);
        let texture = textures.shader_id(self.texture).unwrap_or(0);
        camera.uniform.set(queue, &DescentUniform { clip_from_camera, anchor, texture, unused: 0 });
        queue.write_buffer(&camera.vertices, 0, bytemuck::cast_slice(&mesh.vertices));
    }

    fn draw_wanted(
        &self,
        camera: &DescentCamera,
        pass: &mut wgpu::RenderPass<'_>,
        textures: &wgpu::BindGroup,
    ) {
        self.draw(pass, &self.wanted, camera, textures);
    }

    fn draw_picture(
        &self,
        camera: &DescentCamera,
        encoder: &mut wgpu::CommandEncoder,
        textures: &wgpu::BindGroup,
        target: &Target<'_>,
    ) {
        self.draw(&mut target.begin(encoder, BACKGROUND), &self.picture, camera, textures);
    }
}

impl DescentScene {
    fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        camera: &DescentCamera,
        texture: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, texture, &[]);
        pass.set_bind_group(1, &camera.uniform.group, &[]);
        pass.set_vertex_buffer(0, camera.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..GlobeGrid::index_count(), 0, 0..1);
    }
}
