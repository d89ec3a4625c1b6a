//! What it takes to put a virtual texture into a renderer that is there already.
//!
//! The renderer draws a textured rectangle on the ground into a picture, without a window. Every line that is
//! there for Vastex says so; the rest, like what stands in `headless.rs` beside it, is any application's own.
//!
//! `cargo run -p vastex --example existing_renderer -- [image.vastex] [picture.png]`; without an image, a
//! landscape that is generated where it is looked at (`landscape.rs`, of `painted.rs`, a source of tiles of
//! one's own).

use std::sync::Arc;

use glam::camera::rh::{proj::directx::perspective, view::look_at_mat4};
use glam::{Mat4, Vec3, Vec4};
use vastex::{BindingPlace, Event, Pace, Settings, TextureId, Textures, TileSource};

#[allow(dead_code, clippy::duplicate_mod, reason = "of what the examples have in common each uses its part")]
#[path = "../common/mod.rs"]
pub(crate) mod common;
pub(crate) mod landscape;

use common::headless::{self, DEPTH_FORMAT, Headless, PICTURE_FORMAT};

/// From the bottom of the picture to its top, in radians.
pub(crate) const FIELD_OF_VIEW: f32 = 1.0;
pub(crate) const SKY: Vec4 = Vec4::new(0.46, 0.62, 0.82, 1.0);
const FLIGHT_FRAMES: u64 = 60;
const PATIENCE_FRAMES: u64 = 2000;

#[expect(clippy::print_stdout, reason = "a program, and this is its result")]
pub(crate) fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args_os().skip(1);
    let source: Arc<dyn TileSource> = match arguments.next() {
        Some(file) => vastex::open(file)?,
        None => Arc::new(landscape::landscape()?),
    };
    let output = arguments.next().unwrap_or_else(|| "existing_renderer.png".into());
    let (pixels, frames) = render(source, [1280, 720])?;
    headless::write_png(output.as_ref(), [1280, 720], &pixels)?;
    println!("{} after {frames} frames", output.display());
    Ok(())
}

/// Flies over the ground and stays until the picture is as sharp as it gets: its pixels, and how many frames
/// it took.
pub(crate) fn render(source: Arc<dyn TileSource>, size: [u32; 2]) -> anyhow::Result<(Vec<u8>, u64)> {
    let target = Headless::new(size)?;
    let (device, queue) = (&target.device, &target.queue);

    // Vastex: once. The pace makes a program without a window give the same pictures each time; a window
    // leaves it out.
    let settings = Settings {
        binding: BindingPlace { group: 1, first: 0 },
        pace: Pace::LockStep { latency_frames: 1 },
        ..Settings::default()
    };
    let mut textures = Textures::new(device, queue, settings)?;
    let ground = textures.add_blocking(source)?;

    let renderer = GroundRenderer::new(device, &textures, ground)?;
    for frame in 0..PATIENCE_FRAMES {
        renderer.look(queue, frame.min(FLIGHT_FRAMES) as f32 / FLIGHT_FRAMES as f32, size);
        let mut encoder = device.create_command_encoder(&Default::default());

        // Vastex: each frame, before the picture. What is wanted; what has arrived.
        textures.feedback(&mut encoder, size, |pass, groups| {
            renderer.draw(pass, &renderer.wanted, groups.get(ground));
        })?;
        textures.update()?;

        let mut pass = target.begin(&mut encoder, SKY);
        renderer.draw(&mut pass, &renderer.picture, textures.bind_group(ground).ok());
        drop(pass);
        queue.submit([encoder.finish()]);

        // Vastex: what an application may want to know.
        while let Some(event) = textures.poll_event() {
            match event {
                Event::Converged { .. } if frame > FLIGHT_FRAMES => return Ok((target.read()?, frame + 1)),
                Event::Failed { page, why, .. } => tracing::warn!(?page, "{why}"),
                _ => {}
            }
        }
    }
    anyhow::bail!("the view has not converged in {PATIENCE_FRAMES} frames: {:?}", textures.stats())
}

/// What the application draws, with a pipeline for the picture and one for the feedback pass.
pub(crate) struct GroundRenderer {
    half_extent: Vec4,
    /// Vastex: by which the shader knows the texture.
    pub(crate) texture: u32,
    camera: wgpu::Buffer,
    camera_group: wgpu::BindGroup,
    pub(crate) picture: wgpu::RenderPipeline,
    pub(crate) wanted: wgpu::RenderPipeline,
}

impl GroundRenderer {
    pub(crate) fn new(
        device: &wgpu::Device,
        textures: &Textures,
        ground: TextureId,
    ) -> Result<GroundRenderer, vastex::Error> {
        let (camera, camera_layout, camera_group) = headless::uniform(device, size_of::<[Vec4; 8]>() as u64);
        let kinds = textures.kinds(ground)?;
        // Vastex: its text after the application's shader, its bind group at the index given in the settings.
        let text = include_str!("ground.wgsl").to_owned() + &textures.wgsl(&kinds);
        let groups = [Some(&camera_layout), Some(&textures.bind_group_layout(&kinds))];
        let module = vastex::shader_module(device, Some("ground"), text);
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("ground"),
            bind_group_layouts: &groups,
            immediate_size: 0,
        });
        let pipeline = |entries, formats| {
            headless::pipeline(device, &layout, &module, &[], entries, headless::nearest(formats))
        };
        let [width, height, _] = textures.texture(ground)?.description().geometry.size();
        Ok(GroundRenderer {
            texture: textures.shader_id(ground)?,
            half_extent: Vec4::new(1.0, height as f32 / width as f32, 0.0, 0.0),
            camera,
            camera_group,
            picture: pipeline(["place", "shade"], [PICTURE_FORMAT, DEPTH_FORMAT]),
            // Vastex: the feedback pass has targets of its own.
            wanted: pipeline(
                ["place_feedback", "want"],
                [Textures::FEEDBACK_FORMAT, Textures::FEEDBACK_DEPTH_FORMAT],
            ),
        })
    }

    /// Where the camera is at a part, 0 to 1, of its flight northward and down, and what it sees.
    pub(crate) fn camera(&self, part: f32, [width, height]: [u32; 2]) -> (Vec3, Mat4) {
        let eye = Vec3::new(0.0, self.half_extent.y * (-0.9 + 0.5 * part), 0.3 - 0.24 * part);
        let view = look_at_mat4(eye, eye + Vec3::new(0.1, 1.0, -0.42), Vec3::Z);
        (eye, perspective(FIELD_OF_VIEW, width as f32 / height as f32, 0.002, 10.0) * view)
    }

    pub(crate) fn look(&self, queue: &wgpu::Queue, part: f32, size: [u32; 2]) {
        let (eye, clip_from_world) = self.camera(part, size);
        let [x, y, z, w] = clip_from_world.to_cols_array_2d().map(Vec4::from_array);
        let texture = Vec4::splat(f32::from_bits(self.texture)); // Vastex
        let uniform = [x, y, z, w, eye.extend(1.0), self.half_extent, SKY, texture];
        queue.write_buffer(&self.camera, 0, bytemuck::bytes_of(&uniform));
    }

    pub(crate) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        texture_group: Option<&wgpu::BindGroup>,
    ) {
        let Some(texture_group) = texture_group else { return };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.camera_group, &[]);
        pass.set_bind_group(1, texture_group, &[]); // Vastex
        pass.draw(0..4, 0..1);
    }
}
