//! What 200 virtual textures in one scene cost the thread that draws them: recording feedback, `update`,
//! recording the picture.
//!
//! `cargo xtask bench textures`. A wall of quads, each with a texture of its own, of three kinds: colour in
//! pages of 128 texels, one channel in pages of 120, and small ones that are held whole; drawn one by one, or
//! all of a pool at once. Processor time of the calling thread, a frame; the adapter's work is not counted.

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a benchmark")]

use std::sync::Arc;
use std::time::Duration;

use vastex::source::{Codec, ReadFuture, Tile};
use vastex::{
    Description, Geometry, GeometrySpec, Layer, LayerFormat, PagePos, Settings, TextureId, Textures,
    TileSource,
};
use vastex_wgpu::test_device::TestDevice;

const PICTURE: [u32; 2] = [640, 360];
const TEXTURES: u32 = 200;
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const FRAMES: usize = 200;
const ROUNDS: usize = 5;

const SHADER: &str = "
struct Quad { @location(0) place: vec4<f32>, @location(1) zoom: f32, @location(2) texture: u32 }
struct Corner { @builtin(position) clip: vec4<f32>, @location(0) uv: vec2<f32>, @location(1) @interpolate(flat) texture: u32 }
fn corner(index: u32, quad: Quad) -> Corner {
    let at = vec2<f32>(f32(index & 1u), f32(index >> 1u));
    return Corner(vec4<f32>(quad.place.xy + at * quad.place.zw, 0.5, 1.0), at * quad.zoom, quad.texture);
}
@vertex fn place(@builtin(vertex_index) index: u32, quad: Quad) -> Corner { return corner(index, quad); }
@vertex fn place_feedback(@builtin(vertex_index) index: u32, quad: Quad) -> Corner {
    var placed = corner(index, quad);
    placed.clip = vastex_feedback_clip(0u, placed.clip);
    return placed;
}
@fragment fn shade(placed: Corner) -> @location(0) vec4<f32> { return vastex_sample(placed.texture, placed.uv); }
@fragment fn want(placed: Corner) -> @location(0) vec4<u32> { return vastex_feedback(placed.texture, 0u, placed.uv); }
";

/// Tiles of one value.
struct Plain(Arc<Description>);

impl Plain {
    fn new(side: u32, page: u32, format: LayerFormat) -> Arc<Plain> {
        let layers = vec![Layer::new("color", format)];
        let geometry = Geometry::new(GeometrySpec { page, ..GeometrySpec::image(side, side) }).unwrap();
        Arc::new(Plain(Arc::new(Description::new(geometry, layers))))
    }
}

impl TileSource for Plain {
    fn description(&self) -> &Arc<Description> {
        &self.0
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let bytes = vec![40 + 20 * pos.level + (pos.x % 7) as u8; self.0.tile_bytes()];
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes: bytes.into() }) })
    }
}

/// As the shader reads it.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Quad {
    place: [f32; 4],
    zoom: f32,
    texture: u32,
}

/// How the quads are drawn.
#[derive(Clone, Copy, PartialEq)]
enum Draws {
    /// One by one, each with its bind group, as a renderer does that sorts by material.
    Single,
    /// All of a pool at once, their textures named by the instances.
    OfPools,
}

struct World {
    gpu: TestDevice,
    textures: Textures,
    /// Sorted by kind, then by pool.
    order: Vec<TextureId>,
    /// Where each pool's begin, and the kind of it.
    runs: Vec<(std::ops::Range<u32>, usize)>,
    quads: wgpu::Buffer,
    pipelines: Vec<[wgpu::RenderPipeline; 2]>,
    colour: wgpu::TextureView,
    frame: u32,
}

/// Of one frame, on the calling thread.
#[derive(Clone, Copy, Default)]
struct Times {
    feedback: Duration,
    update: Duration,
    picture: Duration,
    submit: Duration,
}

fn main() {
    let mut world = World::new();
    for _ in 0..120 {
        world.frame(0.0, Draws::OfPools);
    }
    println!(
        "## {TEXTURES} textures of three kinds, in {} pools, in {} draws\n",
        world.runs.len(),
        world.runs.len()
    );
    println!(
        "| view | draws | feedback us | update us | picture us | submit us | all us |\n|---|---|---|---|---|---|---|"
    );
    for (view, speed) in [("still", 0.0), ("moving", 0.002)] {
        for (name, draws) in [("one by one", Draws::Single), ("of pools", Draws::OfPools)] {
            let (all, t) =
                (0..ROUNDS).map(|_| world.round(speed, draws)).min_by_key(|(all, _)| *all).unwrap();
            let us = |time: Duration| time.as_secs_f64() * 1e6;
            println!(
                "| {view} | {name} | {:.0} | {:.0} | {:.0} | {:.0} | {:.0} |",
                us(t.feedback),
                us(t.update),
                us(t.picture),
                us(t.submit),
                us(all)
            );
        }
    }
}

impl World {
    fn new() -> World {
        let gpu = TestDevice::new();
        let settings = Settings { whole_bytes: 200_000, picture: PICTURE, ..Settings::default() };
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
        let device = &gpu.device;
        let mut order = Vec::new();
        for nth in 0..TEXTURES {
            let source = match nth % 3 {
                0 => Plain::new(2048, 128, LayerFormat::Rgba8),
                1 => Plain::new(1500, 120, LayerFormat::R8),
                _ => Plain::new(128, 128, LayerFormat::Rgba8),
            };
            order.push((nth as usize % 3, textures.add_blocking(source).unwrap()));
        }
        order.sort_by_key(|&(kind, texture)| {
            (kind, textures.texture(texture).unwrap().pool().map(|pool| pool.number()))
        });
        let mut runs: Vec<(std::ops::Range<u32>, usize)> = Vec::new();
        for (nth, &(kind, texture)) in (0u32..).zip(&order) {
            let is_same = |before: TextureId| {
                textures.bind_group(before).unwrap() == textures.bind_group(texture).unwrap()
            };
            match runs.last_mut() {
                Some((run, of)) if *of == kind && is_same(order[run.start as usize].1) => run.end = nth + 1,
                _ => runs.push((nth..nth + 1, kind)),
            }
        }
        let pipelines = (0..3)
            .map(|kind| pipelines(device, &textures, order.iter().find(|(of, _)| *of == kind).unwrap().1))
            .collect();
        let quads = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(TEXTURES) * size_of::<Quad>() as u64,
            usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let colour = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: PICTURE[0], height: PICTURE[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let colour = colour.create_view(&Default::default());
        let order = order.into_iter().map(|(_, texture)| texture).collect();
        World { gpu, textures, order, runs, quads, pipelines, colour, frame: 0 }
    }

    /// The medians of some frames, and their sum.
    fn round(&mut self, speed: f32, draws: Draws) -> (Duration, Times) {
        let times: Vec<Times> = (0..FRAMES).map(|_| self.frame(speed, draws)).collect();
        let median = |of: fn(&Times) -> Duration| {
            let mut all: Vec<Duration> = times.iter().map(of).collect();
            all.sort_unstable();
            all[FRAMES / 2]
        };
        let times = Times {
            feedback: median(|t| t.feedback),
            update: median(|t| t.update),
            picture: median(|t| t.picture),
            submit: median(|t| t.submit),
        };
        (times.feedback + times.update + times.picture + times.submit, times)
    }

    fn frame(&mut self, speed: f32, draws: Draws) -> Times {
        self.frame += 1;
        let zoom = 0.6 + 0.3 * (self.frame as f32 * speed).sin();
        let quad = |(nth, texture): (u32, &TextureId)| {
            let (column, row) = ((nth % 20) as f32, (nth / 20) as f32);
            let place = [column / 10.0 - 1.0, row / 5.0 - 1.0, 0.095, 0.19];
            Quad { place, zoom, texture: self.textures.shader_id(*texture).unwrap() }
        };
        let quads: Vec<Quad> = (0..).zip(&self.order).map(quad).collect();
        self.gpu.queue.write_buffer(&self.quads, 0, bytemuck::cast_slice(&quads));
        self.gpu.queue.submit([]);
        self.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let mut times = Times::default();
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let start = thread_time();
        let World { textures, order, runs, quads, pipelines, .. } = self;
        let scene = Scene { order, runs, quads, pipelines };
        let recorded = textures.feedback(&mut encoder, PICTURE, |pass, groups| {
            scene.draw(pass, 1, draws, |texture| groups.get(texture));
        });
        recorded.unwrap();
        times.feedback = thread_time() - start;
        let start = thread_time();
        textures.update().unwrap();
        times.update = thread_time() - start;
        let start = thread_time();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.colour,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations::default(),
            })],
            ..Default::default()
        });
        scene.draw(&mut pass, 0, draws, |texture| textures.bind_group(texture).ok());
        drop(pass);
        let commands = encoder.finish();
        times.picture = thread_time() - start;
        let start = thread_time();
        self.gpu.queue.submit([commands]);
        times.submit = thread_time() - start;
        while self.textures.poll_event().is_some() {}
        times
    }
}

#[derive(Clone, Copy)]
struct Scene<'a> {
    order: &'a [TextureId],
    runs: &'a [(std::ops::Range<u32>, usize)],
    quads: &'a wgpu::Buffer,
    pipelines: &'a [[wgpu::RenderPipeline; 2]],
}

impl Scene<'_> {
    fn draw<'g>(
        self,
        pass: &mut wgpu::RenderPass<'_>,
        which: usize,
        draws: Draws,
        group: impl Fn(TextureId) -> Option<&'g wgpu::BindGroup>,
    ) {
        pass.set_vertex_buffer(0, self.quads.slice(..));
        for (run, kind) in self.runs {
            pass.set_pipeline(&self.pipelines[*kind][which]);
            if draws == Draws::OfPools {
                pass.set_bind_group(0, group(self.order[run.start as usize]), &[]);
                pass.draw(0..4, run.clone());
                continue;
            }
            for nth in run.clone() {
                pass.set_bind_group(0, group(self.order[nth as usize]), &[]);
                pass.draw(0..4, nth..nth + 1);
            }
        }
    }
}

fn pipelines(device: &wgpu::Device, textures: &Textures, texture: TextureId) -> [wgpu::RenderPipeline; 2] {
    let kinds = textures.kinds(texture).unwrap();
    let module = vastex_wgpu::shader_module(device, None, SHADER.to_owned() + &textures.wgsl(&kinds));
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&textures.bind_group_layout(&kinds))],
        immediate_size: 0,
    });
    let depth = wgpu::DepthStencilState {
        format: Textures::FEEDBACK_DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(wgpu::CompareFunction::Less),
        stencil: Default::default(),
        bias: Default::default(),
    };
    let passes = [
        ("place", "shade", FORMAT, None),
        ("place_feedback", "want", Textures::FEEDBACK_FORMAT, Some(depth)),
    ];
    passes.map(|(place, shade, format, depth_stencil)| {
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(place),
                compilation_options: Default::default(),
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: size_of::<Quad>() as u64,
                    step_mode: wgpu::VertexStepMode::Instance,
                    attributes: &wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32, 2 => Uint32],
                })],
            },
            primitive: wgpu::PrimitiveState {
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                ..Default::default()
            },
            depth_stencil,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(shade),
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    })
}

/// Processor time of this thread.
#[cfg(target_os = "linux")]
fn thread_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// Where the system does not tell it, the time that passes.
#[cfg(not(target_os = "linux"))]
fn thread_time() -> Duration {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed()
}
