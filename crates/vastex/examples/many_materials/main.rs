//! Many materials: 200 virtual textures in one scene, some of them small and held whole, drawn with one
//! pipeline for each kind and one bind group for each pool. Which texture an instance shows is an id among
//! its data.
//!
//! `cargo run -p vastex --example many_materials -- [picture.png]`

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec4;
use vastex::{
    Event, Kinds, Pace, PoolId, PoolSettings, Settings, TableChoice, TextureId, TextureSettings, Textures,
};

#[allow(dead_code, clippy::duplicate_mod, reason = "of what the examples have in common each uses its part")]
#[path = "../common/mod.rs"]
pub(crate) mod common;
pub(crate) mod plain;

use common::headless::{self, DEPTH_FORMAT, Headless, PICTURE_FORMAT};

pub(crate) const TEXTURES: usize = 200;
/// Rectangles beside one another.
const COLUMNS: usize = 20;
const PATIENCE_FRAMES: u64 = 2000;

/// What came of it.
pub(crate) struct Drawn {
    pub(crate) pixels: Vec<u8>,
    pub(crate) kinds: usize,
    pub(crate) pools: usize,
    /// Of the last frame's picture.
    pub(crate) bind_groups_set: usize,
    /// That the processor takes for a frame once everything is there: feedback, update and picture.
    pub(crate) frame_time: Duration,
}

#[expect(clippy::print_stdout, reason = "a program, and this is its result")]
pub(crate) fn main() -> anyhow::Result<()> {
    let output = std::env::args_os().nth(1).unwrap_or_else(|| "many_materials.png".into());
    let size = [1280, 640];
    let drawn = draw(size)?;
    headless::write_png(output.as_ref(), size, &drawn.pixels)?;
    let Drawn { kinds, pools, bind_groups_set, frame_time, .. } = drawn;
    println!(
        "{TEXTURES} textures of {kinds} kinds in {pools} pools: {bind_groups_set} bind groups set, {frame_time:?} a frame"
    );
    Ok(())
}

/// An instance, as the shader reads it.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Rectangle {
    place: [f32; 4],
    uv: [f32; 4],
    texture: u32,
}

impl Rectangle {
    /// That of a texture, whose id is this.
    pub(crate) fn new(nth: usize, id: u32) -> Rectangle {
        let [x, y] = [nth % COLUMNS, nth / COLUMNS].map(|at| at as f32);
        let [width, height] = [2.0 / COLUMNS as f32, 2.0 / TEXTURES.div_ceil(COLUMNS) as f32];
        let place = [x * width - 1.0, 1.0 - y * height, (x + 1.0) * width - 1.0, 1.0 - (y + 1.0) * height];
        Rectangle { place, uv: uv_of(nth), texture: id }
    }

    /// How a buffer has them.
    pub(crate) const LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: size_of::<Rectangle>() as u64,
        step_mode: wgpu::VertexStepMode::Instance,
        attributes: &wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x4, 2 => Uint32],
    };
}

/// The part of its image that the rectangle of a texture shows: its left and top, and its right and bottom.
pub(crate) fn uv_of(nth: usize) -> [f32; 4] {
    match nth % 4 {
        3 => [0.0, 0.0, 1.0, 1.0],
        _ => [0.31, 0.42, 0.39, 0.5],
    }
}

/// Adds the textures: of every four one with pages whose sides are powers of two, one with others, one with a
/// hashed page table, and one that is held whole.
fn add(textures: &mut Textures) -> anyhow::Result<Vec<TextureId>> {
    let mut ids = Vec::new();
    for nth in 0..TEXTURES {
        let page_table = if nth % 4 == 2 { TableChoice::Hashed } else { TableChoice::BySize };
        let settings = TextureSettings { page_table, ..Default::default() };
        let source = Arc::new(plain::image(nth)?);
        let prepared = textures.preparer().read_blocking(source, settings)?;
        ids.push(textures.add(prepared)?);
    }
    Ok(ids)
}

/// The instances of one pool, which one draw call draws.
struct Batch {
    instances: wgpu::Buffer,
    count: u32,
    /// One of the pool's textures, whose bind group is that of all.
    texture: TextureId,
    /// Place of its kind's pipelines.
    kind: usize,
}

/// Draws until everything is as sharp as it gets.
pub(crate) fn draw(size: [u32; 2]) -> anyhow::Result<Drawn> {
    let target = Headless::new(size)?;
    let (device, queue) = (&target.device, &target.queue);
    let settings = Settings {
        pools: PoolSettings::of_bytes(16 << 20),
        whole_bytes: 1 << 20,
        pace: Pace::LockStep { latency_frames: 1 },
        ..Settings::default()
    };
    let mut textures = Textures::new(device, queue, settings)?;
    let ids = add(&mut textures)?;
    let mut kinds: Vec<Kinds> = Vec::new();
    let mut by_pool: BTreeMap<PoolId, (TextureId, usize, Vec<Rectangle>)> = BTreeMap::new();
    for (nth, &texture) in ids.iter().enumerate() {
        let kind = textures.kinds(texture)?;
        let place_of_kind = kinds.iter().position(|known| *known == kind).unwrap_or_else(|| {
            kinds.push(kind);
            kinds.len() - 1
        });
        let rectangle = Rectangle::new(nth, textures.shader_id(texture)?);
        let Some(pool) = textures.texture(texture)?.pool() else { anyhow::bail!("a texture without a pool") };
        by_pool.entry(pool).or_insert_with(|| (texture, place_of_kind, Vec::new())).2.push(rectangle);
    }
    let pipelines: Vec<[wgpu::RenderPipeline; 2]> =
        kinds.iter().map(|kind| pipelines(device, &textures, kind)).collect();
    let batches: Vec<Batch> = by_pool.into_values().map(|batch| filled(device, queue, batch)).collect();

    let mut at_rest = None;
    for _ in 0..PATIENCE_FRAMES {
        let begun = Instant::now();
        let mut encoder = device.create_command_encoder(&Default::default());
        textures.feedback(&mut encoder, size, |pass, groups| {
            draw_all(pass, &batches, |kind| &pipelines[kind][1], |texture| groups.get(texture));
        })?;
        textures.update()?;
        let mut pass = target.begin(&mut encoder, Vec4::ZERO);
        let group = |texture| textures.bind_group(texture).ok();
        let bind_groups_set = draw_all(&mut pass, &batches, |kind| &pipelines[kind][0], group);
        drop(pass);
        let frame_time = begun.elapsed();
        queue.submit([encoder.finish()]);
        if let Some(pixels) = at_rest.take() {
            let (kinds, pools) = (kinds.len(), batches.len());
            return Ok(Drawn { pixels, kinds, pools, bind_groups_set, frame_time });
        }
        while let Some(event) = textures.poll_event() {
            if let Event::Converged { .. } = event {
                at_rest = Some(target.read()?);
            }
        }
    }
    anyhow::bail!("the view has not converged in {PATIENCE_FRAMES} frames: {:?}", textures.stats())
}

/// Draws every batch in two draws, as a renderer has several in a pool, and says how many bind groups were
/// set.
fn draw_all<'a>(
    pass: &mut wgpu::RenderPass<'_>,
    batches: &'a [Batch],
    pipeline: impl Fn(usize) -> &'a wgpu::RenderPipeline,
    group: impl Fn(TextureId) -> Option<&'a wgpu::BindGroup>,
) -> usize {
    let mut bind_groups_set = 0;
    for batch in batches {
        pass.set_pipeline(pipeline(batch.kind));
        pass.set_bind_group(0, group(batch.texture), &[]);
        bind_groups_set += 1;
        pass.set_vertex_buffer(0, batch.instances.slice(..));
        let half = batch.count / 2;
        for part in [0..half, half..batch.count] {
            pass.draw(0..4, part);
        }
    }
    bind_groups_set
}

fn filled(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    (texture, kind, rectangles): (TextureId, usize, Vec<Rectangle>),
) -> Batch {
    let (count, instances) = (rectangles.len() as u32, instances(device, queue, &rectangles));
    Batch { instances, count, texture, kind }
}

/// A buffer of rectangles.
pub(crate) fn instances(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    rectangles: &[Rectangle],
) -> wgpu::Buffer {
    let bytes: &[u8] = bytemuck::cast_slice(rectangles);
    let instances = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("instances"),
        size: bytes.len() as u64,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&instances, 0, bytes);
    instances
}

/// Of a kind: for the picture, and for the feedback pass.
fn pipelines(device: &wgpu::Device, textures: &Textures, kinds: &Kinds) -> [wgpu::RenderPipeline; 2] {
    let text = include_str!("materials.wgsl").to_owned() + &textures.wgsl(kinds);
    let module = vastex::shader_module(device, Some("materials"), text);
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("materials"),
        bind_group_layouts: &[Some(&textures.bind_group_layout(kinds))],
        immediate_size: 0,
    });
    let pipeline = |entries, formats| {
        let targets = headless::nearest(formats);
        headless::pipeline(device, &layout, &module, &[Some(Rectangle::LAYOUT)], entries, targets)
    };
    [
        pipeline(["place", "shade"], [PICTURE_FORMAT, DEPTH_FORMAT]),
        pipeline(["place_feedback", "want"], [Textures::FEEDBACK_FORMAT, Textures::FEEDBACK_DEPTH_FORMAT]),
    ]
}
