//! What it takes to draw a volume inside a scene that is there already: mist over the ground of
//! `existing_renderer`, marched through in a pass of the application's own that stops at the scene's depth.
//!
//! What a host adds for the volume are 200 lines: `fog.wgsl`, which marches, `Fog` below, which has its
//! pipelines and tells it of the camera, and of `render` the dozen lines that name `mist`, `rays` or `fog`.
//! `existing_renderer` is the scene that was there, `over` plain wgpu for who draws over a picture, and
//! `mist` a made-up source, in the place of which a file has a `vastex_volume::VolumeSource`.
//!
//! `cargo run -p vastex --example fog -- [picture.png]`

use std::sync::Arc;

use glam::{Mat4, UVec3, Vec3};
use vastex::{
    BindingPlace, Event, Pace, Settings, TextureId, TextureSettings, Textures, ViewId, ViewSettings,
};

#[allow(dead_code, clippy::duplicate_mod, reason = "of what the examples have in common each uses its part")]
#[path = "../existing_renderer/main.rs"]
mod existing_renderer;
mod mist;
mod over;

use existing_renderer::common::headless::{self, Headless, PICTURE_FORMAT};
use existing_renderer::landscape::landscape;
use existing_renderer::{FIELD_OF_VIEW, GroundRenderer, SKY};

const PATIENCE_FRAMES: u64 = 2000;
/// Of the picture: a software driver takes about a second for a frame with mist.
const SIZE: [u32; 2] = [640, 360];
/// Where on its flight the camera of the ground stays.
const PART: f32 = 0.6;

#[expect(clippy::print_stdout, reason = "a program, and this is its result")]
fn main() -> anyhow::Result<()> {
    let output = std::env::args_os().nth(1).unwrap_or_else(|| "fog.png".into());
    let (pixels, frames) = render(SIZE, 12.0)?;
    headless::write_png(output.as_ref(), SIZE, &pixels)?;
    println!("{} after {frames} frames", output.display());
    Ok(())
}

/// The converged picture with mist of such a density, per length of the world, and the frames that it took.
pub(crate) fn render(size: [u32; 2], density: f32) -> anyhow::Result<(Vec<u8>, u64)> {
    let target = Headless::new(size)?;
    let (device, queue) = (&target.device, &target.queue);
    let settings = Settings {
        binding: BindingPlace { group: 1, first: 0 },
        pace: Pace::LockStep { latency_frames: 1 },
        ..Settings::default()
    };
    let mut textures = Textures::new(device, queue, settings)?;
    let ground = textures.add_blocking(Arc::new(landscape()?))?;
    let mist = Arc::new(mist::Mist::new()?);
    let mist = textures.preparer().read_blocking(mist, TextureSettings::default())?;
    let mist = textures.add_volume(mist)?;
    // A view of its own: each of its rays meets many bricks.
    let rays = textures.add_view(ViewSettings::default().with_bricks_of_a_ray(48))?;
    // The camera stays: every pixel is to have what it needs.
    textures.view_mut(rays)?.set_resting(true);

    let renderer = GroundRenderer::new(device, &textures, ground)?;
    let fog = Fog::new(device, &textures, mist, &target)?;
    renderer.look(queue, PART, size);
    fog.look(queue, &textures, (mist, rays), renderer.camera(PART, size), size, density)?;
    for frame in 0..PATIENCE_FRAMES {
        let mut encoder = device.create_command_encoder(&Default::default());
        textures.feedback(&mut encoder, size, |pass, groups| {
            renderer.draw(pass, &renderer.wanted, groups.get(ground));
        })?;
        textures.view_mut(rays)?.feedback(&mut encoder, size, |pass, groups| {
            fog.draw(pass, &fog.wanted, groups.get(mist));
        })?;
        textures.update()?;
        let mut pass = target.begin(&mut encoder, SKY);
        renderer.draw(&mut pass, &renderer.picture, textures.bind_group(ground).ok());
        drop(pass);
        let mut pass = over::begin_over(&target, &mut encoder);
        fog.draw(&mut pass, &fog.picture, textures.bind_group(mist).ok());
        drop(pass);
        queue.submit([encoder.finish()]);
        while let Some(event) = textures.poll_event() {
            match event {
                Event::Converged { .. } => return Ok((target.read()?, frame + 1)),
                Event::Failed { page, why, .. } => tracing::warn!(?page, "{why}"),
                _ => {}
            }
        }
    }
    anyhow::bail!("the view has not converged in {PATIENCE_FRAMES} frames: {:?}", textures.stats())
}

/// What draws the mist, and what asks for its bricks.
struct Fog {
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
    depth: wgpu::BindGroup,
    picture: wgpu::RenderPipeline,
    wanted: wgpu::RenderPipeline,
}

/// `Fog` of fog.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct FogUniform {
    world_from_clip: Mat4,
    eye: Vec3,
    growth: f32,
    low: Vec3,
    voxel: f32,
    anchor: UVec3,
    volume: u32,
    colour: Vec3,
    density: f32,
    size: [f32; 2],
    view: u32,
    unused: u32,
}

impl Fog {
    fn new(
        device: &wgpu::Device,
        textures: &Textures,
        mist: TextureId,
        target: &Headless,
    ) -> anyhow::Result<Fog> {
        let kinds = textures.kinds(mist)?;
        let (uniform, camera_layout, group) = headless::uniform(device, size_of::<FogUniform>() as u64);
        let (depth_layout, depth) = over::depth_group(target);
        let text = include_str!("fog.wgsl").to_owned() + &textures.wgsl(&kinds);
        let module = vastex::shader_module(device, Some("fog"), text);
        let vastex_layout = textures.bind_group_layout(&kinds);
        let pipeline = |groups: &[Option<&wgpu::BindGroupLayout>], entries, targets| {
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("fog"),
                bind_group_layouts: groups,
                immediate_size: 0,
            });
            headless::pipeline(device, &layout, &module, &[], entries, targets)
        };
        let groups = [Some(&camera_layout), Some(&vastex_layout), Some(&depth_layout)];
        let feedback = over::instead([Textures::FEEDBACK_FORMAT, Textures::FEEDBACK_DEPTH_FORMAT]);
        Ok(Fog {
            picture: pipeline(&groups, ["place", "shade"], over::over(PICTURE_FORMAT)),
            wanted: pipeline(&groups, ["place_feedback", "want"], feedback),
            uniform,
            group,
            depth,
        })
    }

    /// Tells the shaders of the camera of the ground, and where the mist lies: over all of the ground.
    fn look(
        &self,
        queue: &wgpu::Queue,
        textures: &Textures,
        (mist, rays): (TextureId, ViewId),
        (eye, clip_from_world): (Vec3, Mat4),
        [width, height]: [u32; 2],
        density: f32,
    ) -> anyhow::Result<()> {
        let (low, voxel) = (Vec3::new(-1.0, -1.0, 0.0), 2.0 / mist::SIZE[0] as f32);
        let uniform = FogUniform {
            world_from_clip: clip_from_world.inverse(),
            eye,
            growth: 2.0 * (0.5 * FIELD_OF_VIEW).tan() / height as f32,
            low,
            voxel,
            // What is near the camera is exact however large the volume is.
            anchor: ((eye - low) / voxel).max(Vec3::ZERO).as_uvec3().min(UVec3::from_array(mist::SIZE) - 1),
            volume: textures.shader_id(mist)?,
            colour: Vec3::new(0.8, 0.83, 0.86),
            density,
            size: [width, height].map(|side| side as f32),
            view: textures.view(rays)?.number(),
            unused: 0,
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        Ok(())
    }

    fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        mist: Option<&wgpu::BindGroup>,
    ) {
        let Some(mist) = mist else { return };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_bind_group(1, mist, &[]);
        pass.set_bind_group(2, &self.depth, &[]);
        pass.draw(0..4, 0..1);
    }
}
