//! Sampling and feedback functions on the GPU against their twins, over random and extreme inputs.

use bytemuck::{Pod, Zeroable};
use vastex_core::{
    AddressMode, Description, Geometry, GeometrySpec, Layer, LayerFormat, LevelRule, Slot, TexelPositions,
};
use vastex_wgpu::test_device::TestDevice;
use vastex_wgpu::{Atlas, FeedbackMode, Filter, Kind, PageSides, PoolTables, twins};

use crate::common::{Bindings, GPU, NUMBER, Random, World, params_of, read, storage};
use crate::test_text::TestText;
use crate::unlike::{Unlike, apart, whereabouts};

/// One call of the shader: by gradients, or at an explicit level.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Input {
    pub(crate) uv: [f32; 2],
    ddx: [f32; 2],
    ddy: [f32; 2],
    level: f32,
    at_level: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Output {
    pub(crate) color: [f32; 4],
    pub(crate) feedback: [u32; 4],
}

pub(crate) const HARNESS: &str = include_str!("wgsl/harness.wgsl");

/// The shader for one filter and one way to read a layer.
pub(crate) struct Harness<'a> {
    gpu: &'a TestDevice,
    filter: Filter,
    /// By which it samples, where that is not what the kind wants pages by.
    sampled_by: Filter,
    bindings: Bindings,
    pipeline: wgpu::ComputePipeline,
}

impl<'a> Harness<'a> {
    /// For a layer of a world; tiles do not fade in.
    pub(crate) fn new(gpu: &'a TestDevice, filter: Filter, world: &World, layer: usize) -> Harness<'a> {
        Harness::with_fade(gpu, filter, world, layer, false)
    }

    /// Where tiles fade in, or do not.
    pub(crate) fn with_fade(
        gpu: &'a TestDevice,
        filter: Filter,
        world: &World,
        layer: usize,
        fade: bool,
    ) -> Harness<'a> {
        Harness::of(gpu, world.kind(layer, filter), world.id, fade)
    }

    pub(crate) fn of(gpu: &'a TestDevice, kind: Kind, id: u32, fade: bool) -> Harness<'a> {
        let bindings = Bindings::new(gpu, kind, FeedbackMode::Separate, fade);
        let pipeline = pipeline(gpu, &bindings.layout, &bindings.text(HARNESS, id));
        Harness { gpu, filter: kind.filter, sampled_by: kind.filter, bindings, pipeline }
    }

    /// Which calls what reads the nearest texel, whatever the kind's filter.
    fn nearest(gpu: &'a TestDevice, kind: Kind, id: u32) -> Harness<'a> {
        let bindings = Bindings::new(gpu, kind, FeedbackMode::Separate, false);
        let pipeline = pipeline(gpu, &bindings.layout, &bindings.text(&nearest_harness(), id));
        Harness { gpu, filter: kind.filter, sampled_by: Filter::Nearest, bindings, pipeline }
    }

    pub(crate) fn run(&self, world: &World, inputs: &[Input]) -> Vec<Output> {
        run(self.gpu, &self.pipeline, &self.bindings.group(self.gpu, world), inputs)
    }

    /// The same through other page tables.
    pub(crate) fn run_through(&self, tables: &PoolTables, world: &World, inputs: &[Input]) -> Vec<Output> {
        let gpu = self.gpu;
        let params = params_of(gpu, &[(world.number, world.record(tables))]);
        run(gpu, &self.pipeline, &self.bindings.group_through(gpu, tables, &params, world), inputs)
    }

    /// Compares GPU and twin over random and extreme inputs, at a mip bias of the pool in eighths.
    pub(crate) fn check(&self, world: &mut World, bias: u16, seed: u64) {
        world.pool.set_bias(&self.gpu.queue, bias);
        let inputs = inputs(&world.geometry, seed);
        let outputs = self.run(world, &inputs);
        let tile = |slot: Slot| world.tiles[&slot].as_slice();
        let texture = twins::Texture {
            filter: self.filter,
            rule: world.rule,
            pool_bias: bias,
            layer_scale: world.layer.scale,
            fades: world.pool.fades().map_or(&[], |fades| fades.shares()),
            ..twins::Texture::new(&world.geometry, &*world.image, NUMBER)
        };
        let sampled_by = twins::Texture { filter: self.sampled_by, ..texture };
        let twin = twins::Sampler { texture: sampled_by, format: world.layer.format, tile: &tile };
        let tolerance = tolerance(self.gpu, world.layer.format, self.sampled_by);
        let mut unlike = Unlike::of(format!(
            "{} of {} by {} {:?}",
            self.sampled_by,
            world.layer.format.name(),
            self.filter,
            world.geometry.spec()
        ));
        for (input, output) in inputs.iter().zip(&outputs) {
            let nearly = neighbourhood(&world.geometry, input);
            let difference = |twin: &twins::Sampler<'_>, &(uv, step): &([f32; 2], f32)| {
                apart(sampled(twin, &Input { uv, ..*input }, step), output.color)
            };
            let is_near =
                |twin: &twins::Sampler<'_>| nearly.iter().any(|at| difference(twin, at) <= tolerance);
            if !is_near(&twin) {
                unlike.note(|| {
                    let least = nearly.iter().map(|at| difference(&twin, at)).fold(f32::INFINITY, f32::min);
                    let place = |wanted| texture.place(input.uv, wanted);
                    format!(
                        "{input:?} gives {output:?}, not {:?}: {least:.3} steps off, {tolerance:.2} allowed\n{}",
                        sampled(&twin, input, 0.0),
                        whereabouts(world, &twin, place, is_near)
                    )
                });
            }
            let near_feedback = nearly.iter().any(|&(uv, step)| {
                let pixel = match input.at_level {
                    1 => texture.feedback_level(uv, input.level + step),
                    _ => twins::Texture { level_offset: step, ..texture }
                        .feedback_grad(uv, input.ddx, input.ddy),
                };
                pixel == output.feedback
            });
            if !near_feedback {
                unlike.note(|| format!("{input:?} gives {output:?}, which is other feedback"));
            }
        }
        unlike.check(inputs.len());
    }
}

/// The harness, calling what reads the nearest texel.
pub(crate) fn nearest_harness() -> String {
    HARNESS.replace("vastex_sample_", "vastex_sample_nearest_")
}

/// What the twin gives for an input, shifted by so much of a level.
fn sampled(twin: &twins::Sampler<'_>, input: &Input, step: f32) -> [f32; 4] {
    let shifted = |gradient: [f32; 2]| gradient.map(|g| g * step.exp2());
    match input.at_level {
        1 => twin.sample_level(input.uv, input.level + step),
        _ => twin.sample_grad(input.uv, shifted(input.ddx), shifted(input.ddy)),
    }
}

/// The pipeline of a shader that ends in the harness.
pub(crate) fn pipeline(
    gpu: &TestDevice,
    layout: &wgpu::BindGroupLayout,
    text: &TestText,
) -> wgpu::ComputePipeline {
    let device = &gpu.device;
    let storage = |read_only| wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only },
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let visibility = wgpu::ShaderStages::COMPUTE;
    let data = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[(0, true), (1, false)].map(|(binding, read_only)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: storage(read_only),
            count: None,
        }),
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(layout), Some(&data)],
        immediate_size: 0,
    });
    let module = text.module(device);
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: None,
        compilation_options: text.options(),
        cache: None,
    })
}

/// Calls the harness once for each input.
pub(crate) fn run<I: Pod, O: Pod>(
    gpu: &TestDevice,
    pipeline: &wgpu::ComputePipeline,
    group: &wgpu::BindGroup,
    inputs: &[I],
) -> Vec<O> {
    let sent = storage(gpu, bytemuck::cast_slice(inputs));
    let received = storage(gpu, &vec![0; inputs.len() * size_of::<O>()]);
    let data = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(1),
        entries: &[(0, &sent), (1, &received)]
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() }),
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.set_bind_group(1, &data, &[]);
    pass.dispatch_workgroups(inputs.len().div_ceil(64) as u32, 1, 1);
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
    read(gpu, &received)
}

/// How far a colour may be from the twin's, in steps of 1/255: the sum of what weights, the decoding of sRGB
/// and that of blocks leave open (docs/draw-checks.md, "What a GPU may differ by").
///
/// By a software driver as well the weights of texels have 8 bits along each axis, sRGB is off by up to half
/// a step, and blocks by up to two, but those of BC7 and BC6H, which are exact. BC6H has values up to 65504.
pub(crate) fn tolerance(gpu: &TestDevice, format: LayerFormat, filter: Filter) -> f32 {
    use LayerFormat::{Bc6h, Bc7, Bc7Srgb};
    let is_processor = gpu.is_processor();
    let weights = match filter {
        Filter::Nearest => 0.0,
        Filter::Bilinear | Filter::Trilinear | Filter::Anisotropic(_) | Filter::Bicubic => 2.0,
    };
    let (half_step, slope) = match (format.is_srgb(), is_processor) {
        (true, true) => (0.5, 1.0),
        (true, false) => (1.14, 2.28),
        (false, _) => (if filter == Filter::Nearest { 0.01 } else { 0.5 }, 1.0),
    };
    let blocks = if is_processor { 2.0 } else { 9.0 * slope };
    match format {
        Bc6h => (weights + half_step) * 65504.0,
        _ if format.is_compressed() && !matches!(format, Bc7 | Bc7Srgb) => weights + half_step + blocks,
        _ => weights + half_step,
    }
}

/// The input, and inputs so near to it that the GPU's arithmetic may not tell them apart: shifted by up to
/// 1/500 of a texel and 1/5000 of a level. The tiles are noise, so a shift of that size shows only across an
/// edge.
fn neighbourhood(geometry: &Geometry, input: &Input) -> Vec<([f32; 2], f32)> {
    let shift = |a: usize, n: f32| {
        input.uv[a] + n * (input.uv[a].abs() * 2.0 * f32::EPSILON + 0.002 / geometry.size()[a] as f32)
    };
    let mut near = vec![(input.uv, 0.0)];
    for level in [0.0, -2e-4, 2e-4] {
        for (x, y) in [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)] {
            near.push(([shift(0, x), shift(1, y)], level));
        }
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            near.push(([shift(0, x), shift(1, y)], level));
        }
    }
    near
}

/// Calls of chance and of extremes.
pub(crate) fn inputs(geometry: &Geometry, seed: u64) -> Vec<Input> {
    const UV: [f32; 13] = [0.0, -0.0, 1.0, 0.5, 0.25, 0.999_999_9, 1e-7, -1e-7, -0.3, 1.7, -2.0, 3.25, 2.0];
    const GRADIENTS: [f32; 8] = [0.0, 1e-30, 1e30, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 0.125];
    let mut random = Random(seed);
    let size = geometry.size().map(|side| side as f32);
    let mut inputs = Vec::new();
    for u in UV {
        for v in UV {
            let level = random.between(-1.0, f32::from(geometry.coarsest()) + 1.0);
            inputs.push(Input { uv: [u, v], level, at_level: 1, ..Input::zeroed() });
        }
    }
    for _ in 0..400 {
        let mut gradient = || GRADIENTS[random.below(GRADIENTS.len())];
        let (ddx, ddy) = ([gradient(), gradient()], [gradient(), gradient()]);
        inputs.push(Input { uv: [random.unit(), random.unit()], ddx, ddy, ..Input::zeroed() });
    }
    for n in 0..1500 {
        let mut gradient = || {
            let texels = random.between(-1.5, f32::from(geometry.coarsest()) + 0.5).exp2();
            [0, 1].map(|a| random.between(-1.0, 1.0) * texels / size[a])
        };
        let (ddx, ddy) = (gradient(), gradient());
        let uv = [random.between(-1.2, 2.2), random.between(-1.2, 2.2)];
        let level = random.between(0.0, f32::from(geometry.coarsest()));
        inputs.push(Input { uv, ddx, ddy, level, at_level: n % 2 });
    }
    inputs
}

/// The shapes that every filter is tried with.
pub(crate) fn shapes() -> Vec<Geometry> {
    use AddressMode::{Clamp, Mirror, Wrap};
    let mut shapes = Vec::new();
    for (n, (width, height)) in [(1000, 777), (777, 1000), (1, 1), (2100, 37)].into_iter().enumerate() {
        for (page, border) in [(128, 4), (254, 1)] {
            let address = [[Clamp, Clamp, Clamp], [Wrap, Mirror, Clamp], [Mirror, Wrap, Clamp]][n % 3];
            let spec = GeometrySpec { page, border, address, ..GeometrySpec::image(width, height) };
            shapes.push(Geometry::new(spec).unwrap());
        }
    }
    let odd = GeometrySpec { page: 24, border: 2, ..GeometrySpec::image(700, 500) };
    shapes.push(Geometry::with_factors(odd, &[[3, 2, 1], [2, 3, 1], [1, 4, 1], [200, 200, 1]]).unwrap());
    shapes
}

#[test]
fn every_filter_agrees_with_its_twin_on_every_shape() {
    let shapes = shapes();
    for (n, geometry) in shapes.iter().enumerate() {
        let mut world = World::new(&GPU, geometry, LayerFormat::Rgba8, [0.3, 0.8][n % 2], n as u64 + 5);
        for filter in Filter::KINDS {
            let harness = Harness::new(&GPU, filter, &world, 0);
            harness.check(&mut world, [0, 11, 3][n % 3], n as u64 + 77);
        }
    }
}

#[test]
fn calls_for_the_nearest_texel_agree_with_their_twin_in_every_kind() {
    for (n, geometry) in shapes().iter().enumerate().step_by(3) {
        let mut world = World::new(&GPU, geometry, LayerFormat::Rgba8, 0.5, n as u64 + 9);
        // Others want pages of two levels or along an axis, where these show one texel.
        for filter in [Filter::Nearest, Filter::Bilinear] {
            let harness = Harness::nearest(&GPU, world.kind(0, filter), world.id);
            harness.check(&mut world, 0, n as u64 + 31);
        }
    }
}

fn image(page: u32, border: u32, layers: &[Layer]) -> Description {
    let spec = GeometrySpec {
        page,
        border,
        tail_align: Description::tail_align(layers),
        ..GeometrySpec::image(500, 300)
    };
    Description::new(Geometry::new(spec).unwrap(), layers.to_vec())
}

#[test]
fn every_format_of_texels_agrees_with_its_twin() {
    every_format_agrees_with_its_twin(|format| !format.is_compressed());
}

/// SwiftShader fails here: in a compute shader it reads blocks as what they are not.
#[test]
fn every_format_of_blocks_agrees_with_its_twin() {
    every_format_agrees_with_its_twin(LayerFormat::is_compressed);
}

/// By the filter that most use, and by another in turn: most formats are read in the same way, and by every
/// filter elsewhere.
fn every_format_agrees_with_its_twin(is_tried: impl Fn(LayerFormat) -> bool) {
    const MOST_USED: usize = 2;
    assert_eq!(Filter::KINDS[MOST_USED], Filter::Trilinear);
    let mut harnesses: Vec<(Kind, [Harness<'_>; 5])> = Vec::new();
    let formats = LayerFormat::ALL.into_iter().enumerate().filter(|(_, format)| is_tried(*format));
    for (n, format) in formats {
        let mut world = World::of(&GPU, &image(64, 4, &[Layer::new("a", format)]), 0, 0.5, n as u64 + 21);
        let kind = world.kind(0, Filter::Nearest);
        if harnesses.iter().all(|(of, _)| *of != kind) {
            harnesses.push((kind, Filter::KINDS.map(|filter| Harness::new(&GPU, filter, &world, 0))));
        }
        for (_, harnesses) in harnesses.iter().filter(|(of, _)| *of == kind) {
            for nth in [MOST_USED, [0, 1, 3, 4][n % 4]] {
                harnesses[nth].check(&mut world, 0, n as u64);
            }
        }
    }
}

#[test]
fn values_that_a_device_does_not_filter_stay_exact() {
    let gpu = TestDevice::with_features(|_| wgpu::Features::empty());
    let atlases = [
        (LayerFormat::R16, Atlas::Uint16),
        (LayerFormat::Rgba16, Atlas::Uint16Rgba),
        (LayerFormat::R32Float, Atlas::Unfiltered),
    ];
    for (format, atlas) in atlases {
        let mut world = World::of(&gpu, &image(64, 4, &[Layer::new("a", format)]), 0, 0.5, 3);
        assert_eq!(world.pool.atlas(0), atlas);
        for filter in Filter::KINDS {
            Harness::new(&gpu, filter, &world, 0).check(&mut world, 4, 8);
        }
    }
}

#[test]
fn layers_at_a_fraction_of_the_resolution_share_the_slots() {
    let layers = [
        Layer::new("color", LayerFormat::Rgba8Srgb),
        Layer { scale: 2, ..Layer::new("height", LayerFormat::R16) },
        Layer { scale: 4, ..Layer::new("mask", LayerFormat::Bc4) },
        Layer { scale: 2, ..Layer::new("normal", LayerFormat::Bc5) },
        Layer { scale: 4, ..Layer::new("depth", LayerFormat::R32Float) },
    ];
    let description = image(64, 16, &layers);
    for (index, _) in layers.iter().enumerate() {
        let mut world = World::of(&GPU, &description, index, 0.5, index as u64);
        for filter in Filter::KINDS {
            Harness::new(&GPU, filter, &world, index).check(&mut world, 5, 9);
        }
    }
}

#[test]
fn texels_that_keep_their_positions_and_border_colours_agree_with_the_twin() {
    for (positions, address) in [
        (TexelPositions::Kept, AddressMode::Clamp),
        (TexelPositions::Kept, AddressMode::Wrap),
        (TexelPositions::Kept, AddressMode::Border),
        (TexelPositions::Centered, AddressMode::Border),
    ] {
        let spec =
            GeometrySpec { page: 40, positions, address: [address; 3], ..GeometrySpec::image(500, 300) };
        let geometry = Geometry::new(spec).unwrap();
        let mut world = World::new(&GPU, &geometry, LayerFormat::Rgba8, 0.5, 6);
        for filter in Filter::KINDS {
            Harness::new(&GPU, filter, &world, 0).check(&mut world, 2, 10);
        }
    }
}

#[test]
fn the_levels_of_a_texture_may_be_clamped_and_biased() {
    let geometry = Geometry::new(GeometrySpec { page: 32, ..GeometrySpec::image(500, 390) }).unwrap();
    let mut world = World::new(&GPU, &geometry, LayerFormat::Rgba8, 0.5, 5);
    // As one that knows nothing of pages.
    let kind = Kind { pages: PageSides::Any, ..world.kind(0, Filter::Trilinear) };
    let harness = Harness::of(&GPU, kind, world.id, false);
    let rules = [(1.75, 0, 9), (-0.625, 0, 9), (0.0, 2, 9), (0.0, 0, 1), (0.3, 1, 3), (-32.0, 3, 3)];
    for (seed, (bias, finest, coarsest)) in (0..).zip(rules) {
        world.set_rule(&GPU, LevelRule { bias, finest, coarsest });
        harness.check(&mut world, 8 * (seed as u16 % 2), seed);
    }
}
