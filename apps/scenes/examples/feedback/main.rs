//! What feedback costs in each of its ways, beside the main pass: a table for docs/feedback.md.
//!
//! `cargo run -p vastex-scenes --example feedback` flies over scenes whose pages are generated. Times are from a submission to its end,
//! the least of several: of a software driver the processor time of the whole process, which a busy machine disturbs less, else wall
//! time. Only their ratios in one run say something.

#![expect(clippy::print_stdout, reason = "an example tells what it does")]

use std::sync::Arc;

use anyhow::Result;
use vastex::{BindGroups, FeedbackWay, Filter, Geometry, GeometrySpec, Settings, Textures};
use vastex_scenes::{Drawn, Gpu, Look, Path, PictureTarget, Scene, SceneRenderer, Tiling, depth_view};
use vastex_tiles::PropertySource;

const PICTURE: [u32; 2] = [1280, 720];
/// Frames of the path, every so many of its 300.
const STEP: u64 = 60;
/// Times that each frame is drawn, of which the shortest counts.
const TRIES: u32 = 3;

fn main() -> Result<()> {
    let gpu = Gpu::headless()?;
    println!("On {}, {}x{}, trilinear.\n", gpu.adapter_name(), PICTURE[0], PICTURE[1]);
    println!(
        "| scene | way | main pass [ms] | feedback, of it [%] | pages | read back [B] | of 12 B a page |"
    );
    println!("|---|---|---|---|---|---|---|");
    for scene in [Scene::Plane, Scene::Globe] {
        // The main pass of a shader that tells nothing is what the others are measured by.
        let mut plain = Stage::new(&gpu, scene, FeedbackWay::Separate)?;
        for way in FeedbackWay::ALL {
            let mut stage = Stage::new(&gpu, scene, way)?;
            let (mut main, mut more, mut pages, mut bytes, mut ratios) =
                (vec![], vec![], vec![], vec![], vec![]);
            for frame in (0..300).step_by(STEP as usize) {
                let cost = stage.frame(frame, &mut plain)?;
                main.push(cost.main);
                more.push(cost.feedback / cost.main);
                pages.push(cost.pages as f64);
                bytes.push(cost.bytes as f64);
                ratios.push(cost.bytes as f64 / (12 * cost.pages.max(1)) as f64);
            }
            println!(
                "| {} | {} | {:.1} | {:.1} | {} | {} | {:.2} |",
                scene.name(),
                way.name(),
                1e3 * median(main),
                1e2 * median(more),
                median(pages),
                median(bytes),
                median(ratios)
            );
        }
    }
    Ok(())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// What a frame took, in seconds, and brought back.
struct Cost {
    main: f64,
    feedback: f64,
    pages: u64,
    bytes: u64,
}

/// A scene with a generated texture, drawn in one way.
struct Stage<'a> {
    gpu: &'a Gpu,
    scene: Scene,
    textures: Textures,
    renderer: SceneRenderer,
    colour: wgpu::TextureView,
    depth: wgpu::TextureView,
}

impl<'a> Stage<'a> {
    fn new(gpu: &'a Gpu, scene: Scene, way: FeedbackWay) -> Result<Stage<'a>> {
        let (device, queue) = (&gpu.device, &gpu.queue);
        let pace = vastex::Pace::LockStep { latency_frames: 1 };
        let settings =
            Settings { feedback: Some(way), filter: Filter::Trilinear, pace, ..Settings::default() };
        let mut textures = Textures::new(device, queue, settings)?;
        let geometry = Geometry::new(GeometrySpec::image(65536, 32768))?;
        let texture = textures.add(Arc::new(PropertySource::new(geometry)))?;
        let look = Look::new(&textures.description(texture).layers[0], None);
        let format = look.picture_format();
        let drawn = Drawn { scene, layer: texture.into(), look, relief: None, tiling: Tiling::default() };
        let renderer = SceneRenderer::new(device, queue, &textures, drawn, format);
        let colour = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d { width: PICTURE[0], height: PICTURE[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let (colour, depth) = (colour.create_view(&Default::default()), depth_view(device, PICTURE));
        Ok(Stage { gpu, scene, textures, renderer, colour, depth })
    }

    /// Draws a frame of the path again and again with its feedback, and beside it without, from the same texture.
    fn frame(&mut self, frame: u64, plain: &mut Stage<'_>) -> Result<Cost> {
        let pose = Path::Fly.pose(self.scene, 2.0, frame);
        self.renderer.set_pose(&self.gpu.queue, &self.textures, &pose, PICTURE);
        plain.renderer.set_pose(&self.gpu.queue, &plain.textures, &pose, PICTURE);
        let before = self.textures.stats().feedback_bytes_read;
        self.textures.record_trace();
        let (mut with, mut without) = (f64::MAX, f64::MAX);
        for _ in 0..TRIES {
            with = with.min(self.draw(true)?);
            without = without.min(plain.draw(false)?);
        }
        let trace = self.textures.take_trace()?;
        let frames = trace.iter().flat_map(|trace| trace.frames());
        let (pages, count) =
            frames.fold((0, 0u64), |(pages, count), frame| (pages + frame.len() as u64, count + 1));
        let bytes = self.textures.stats().feedback_bytes_read - before;
        let each = |total: u64| total / count.max(1);
        Ok(Cost { main: without, feedback: with - without, pages: each(pages), bytes: each(bytes) })
    }

    /// Seconds that the GPU takes for the main pass, with feedback or without.
    fn draw(&mut self, with_feedback: bool) -> Result<f64> {
        let Stage { renderer, colour, depth, textures, gpu, .. } = self;
        let sampled = renderer.sampled();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        textures.update(&mut encoder)?;
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        let begin = now(gpu);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let target = PictureTarget { colour, depth };
        let picture = |encoder: &mut wgpu::CommandEncoder, groups: &BindGroups| {
            renderer.draw_picture_of(renderer.eye(), encoder, &groups[sampled], &target);
        };
        if with_feedback {
            textures.feedback(&mut encoder, PICTURE, |pass, groups| {
                renderer.draw_wanted(pass, &groups[sampled]);
            })?;
            textures.main_pass(&mut encoder, PICTURE, picture)?;
        } else {
            renderer.draw_picture(&mut encoder, textures, &target);
        }
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(now(gpu) - begin)
    }
}

/// Seconds since some beginning.
#[cfg(target_os = "linux")]
fn now(gpu: &Gpu) -> f64 {
    let clock = match gpu.adapter.get_info().device_type {
        wgpu::DeviceType::Cpu => rustix::time::ClockId::ProcessCPUTime,
        _ => rustix::time::ClockId::Monotonic,
    };
    let time = rustix::time::clock_gettime(clock);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Seconds since some beginning.
#[cfg(not(target_os = "linux"))]
fn now(_: &Gpu) -> f64 {
    static BEGIN: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    BEGIN.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
}
