//! Places in fixed point on the GPU against their twins: the folding alone up to 2^31 texels, and what is
//! sampled and wanted.

use std::collections::BTreeSet;

use bytemuck::{Pod, Zeroable};
use vastex_core::shader_constants::FIXED_REACH;
use vastex_core::{AddressMode, Description, Geometry, GeometrySpec, LayerFormat, PagePos, Slot};
use vastex_wgpu::test_device::TestDevice;
use vastex_wgpu::{FeedbackMode, Filter, TableKind, twins};

use crate::common::{Bindings, GPU, NUMBER, Random, World};
use crate::sampling::{Output, pipeline, run, tolerance};
use crate::unlike::{Unlike, apart, whereabouts};

const MODES: [AddressMode; 4] =
    [AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border];

/// One place along an axis, as the folding harness has it; `mode` counts [`MODES`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Fold {
    anchor: u32,
    offset: f32,
    size: u32,
    mode: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Folded {
    texel: u32,
    fraction: f32,
    direction: f32,
    unused: u32,
}

pub(crate) const FOLDING: &str = include_str!("wgsl/folding.wgsl");

fn folds(random: &mut Random) -> Vec<Fold> {
    const SIZES: [u32; 9] = [1, 2, 3, 100, 65_536, (1 << 30) + 1, (1 << 31) - 1, 1 << 31, 2_000_000_011];
    let reach = FIXED_REACH as f32;
    let mut folds = Vec::new();
    for mode in 0..4 {
        for size in SIZES {
            for anchor in [0, 1, size / 2, size - 1, size, u32::MAX] {
                for offset in [
                    0.0,
                    -0.0,
                    0.5,
                    -0.5,
                    1.0,
                    -1.0,
                    1e-30,
                    -1e-30,
                    size as f32,
                    -(size as f32),
                    reach,
                    -reach,
                    1e30,
                    -1e30,
                    f32::INFINITY,
                    f32::NEG_INFINITY,
                ] {
                    folds.push(Fold { anchor, offset, size, mode });
                }
            }
        }
        for n in 0..4000 {
            let size = match n % 3 {
                0 => SIZES[random.below(SIZES.len())],
                _ => (random.next() as u32 >> random.below(31)).clamp(1, 1 << 31),
            };
            let anchor = (random.next() % u64::from(size)) as u32;
            let far = [4.0, 1e3, 1e5, 1e7, 1.2e9][random.below(5)];
            folds.push(Fold { anchor, offset: random.between(-far, far), size, mode });
        }
    }
    folds
}

#[test]
fn places_fold_as_the_twin_folds_them_up_to_the_largest_texture() {
    let gpu = &*GPU;
    let world = World::new(gpu, &Geometry::new(GeometrySpec::image(8, 8)).unwrap(), LayerFormat::R8, 1.0, 1);
    let bindings = Bindings::new(gpu, world.kind(0, Filter::Nearest), FeedbackMode::Separate, false);
    // What names nothing of the texture binds nothing of it.
    let pipeline = pipeline(gpu, &bindings.layout, &bindings.text(FOLDING, world.id));
    let group = bindings.group(gpu, &world);
    let folds = folds(&mut Random(3));
    let outputs: Vec<Folded> = run(gpu, &pipeline, &group, &folds);
    for (fold, found) in folds.iter().zip(outputs) {
        let mode = MODES[fold.mode as usize];
        let expected = twins::folded_texel(fold.anchor, fold.offset, fold.size, mode);
        let found =
            twins::Coordinate { texel: found.texel, fraction: found.fraction, direction: found.direction };
        assert_eq!(found, expected, "{fold:?} {mode:?}");
        assert!(found.texel < fold.size);
    }
}

/// One call of the shader in fixed point: by gradients, or at an explicit level.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Input {
    anchor: [u32; 2],
    offset: [f32; 2],
    ddx: [f32; 2],
    ddy: [f32; 2],
    level: f32,
    at_level: u32,
}

pub(crate) const HARNESS: &str = include_str!("wgsl/fixed.wgsl");

/// Calls of chance and of extremes, around these texels.
fn inputs(geometry: &Geometry, spots: &[[u32; 2]], random: &mut Random) -> Vec<Input> {
    const GRADIENTS: [f32; 8] = [0.0, 1e-30, 1e30, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 0.125];
    let coarsest = f32::from(geometry.coarsest());
    let mut inputs = Vec::new();
    for n in 0..1500 {
        let spot = spots[random.below(spots.len())];
        let anchor = spot.map(|texel| texel.saturating_add_signed(random.below(64) as i32 - 32));
        let far = [3.0, 300.0, 60_000.0][random.below(3)];
        let offset = [random.between(-far, far), random.between(-far, far)];
        let mut gradient = || match random.below(8) {
            0 => [0, 1].map(|_| GRADIENTS[random.below(GRADIENTS.len())]),
            _ => {
                let texels = random.between(-1.5, coarsest + 0.5).exp2();
                [0, 1].map(|_| random.between(-1.0, 1.0) * texels)
            }
        };
        let (ddx, ddy) = (gradient(), gradient());
        let level = random.between(-1.0, coarsest + 1.0);
        inputs.push(Input { anchor, offset, ddx, ddy, level, at_level: n % 2 });
    }
    inputs
}

/// Compares GPU and twin over random inputs; what is near an edge may lie on either side of it.
fn check(gpu: &TestDevice, world: &World, spots: &[[u32; 2]], filter: Filter, seed: u64) {
    let bindings = Bindings::new(gpu, world.kind(0, filter), FeedbackMode::Separate, false);
    let pipeline = pipeline(gpu, &bindings.layout, &bindings.text(HARNESS, world.id));
    let group = bindings.group(gpu, world);
    let inputs = inputs(&world.geometry, spots, &mut Random(seed));
    let outputs: Vec<Output> = run(gpu, &pipeline, &group, &inputs);
    let tile = |slot: Slot| world.tiles[&slot].as_slice();
    let texture = twins::Texture { filter, ..twins::Texture::new(&world.geometry, &*world.image, NUMBER) };
    let twin = twins::Sampler { texture, format: world.layer.format, tile: &tile };
    let tolerance = tolerance(gpu, world.layer.format, filter);
    let coarsest = f32::from(world.geometry.coarsest());
    let lambda_of = |dx: [f32; 2], dy: [f32; 2]| {
        [dx, dy].iter().flatten().map(|texels| texels.abs()).fold(0.0, f32::max).log2()
    };
    let mut unlike = Unlike::of(format!("{filter} {:?}", world.geometry.spec()));
    for (input, output) in inputs.iter().zip(&outputs) {
        let near = |twin: &twins::Sampler<'_>, level: f32, [x, y]: [f32; 2]| {
            let Input { anchor, offset, ddx, ddy, .. } = *input;
            // Where a texel is that of a coarse level, so is what the arithmetic of f32 does not tell apart.
            let lambda = if input.at_level == 1 { input.level } else { lambda_of(ddx, ddy) };
            let far = 0.002 + 2e-5 * lambda.clamp(0.0, coarsest).exp2();
            let shift = |at: f32, n: f32| at + n * (far + at.abs() * 2.0 * f32::EPSILON);
            let offset = [shift(offset[0], x), shift(offset[1], y)];
            match input.at_level {
                1 => (
                    twin.sample_fixed_level(anchor, offset, input.level + level),
                    texture.feedback_fixed_level(anchor, offset, input.level + level),
                ),
                _ => {
                    let nearly = |gradient: [f32; 2]| gradient.map(|texels| texels * level.exp2());
                    (
                        twin.sample_fixed_grad(anchor, offset, nearly(ddx), nearly(ddy)),
                        texture.feedback_fixed_grad(anchor, offset, nearly(ddx), nearly(ddy)),
                    )
                }
            }
        };
        let steps = [0.0, -1.0, 1.0];
        let shifts = || steps.into_iter().flat_map(|x| steps.map(|y| [x, y]));
        let nearly = || [0.0, -2e-4, 2e-4].into_iter().flat_map(|level| shifts().map(move |at| (level, at)));
        let is_feedback = nearly().any(|(level, at)| near(&twin, level, at).1 == output.feedback);
        let off = |twin: &twins::Sampler<'_>, (level, at)| apart(near(twin, level, at).0, output.color);
        let is_color = |twin: &twins::Sampler<'_>| nearly().any(|at| off(twin, at) <= tolerance);
        if !is_color(&twin) || !is_feedback {
            unlike.note(|| {
                let texel = [0, 1].map(|a| input.anchor[a].saturating_add_signed(input.offset[a] as i32));
                format!(
                    "{input:?} gives {output:?}, not {:?}: {:.3} steps off, {tolerance:.2} allowed\n{}",
                    near(&twin, 0.0, [0.0; 2]),
                    nearly().map(|at| off(&twin, at)).fold(f32::INFINITY, f32::min),
                    whereabouts(world, &twin, |wanted| texture.place_of_texel(texel, wanted), is_color)
                )
            });
        }
    }
    unlike.check(inputs.len());
}

#[test]
fn what_is_sampled_and_wanted_in_fixed_point_agrees_with_the_twin() {
    for (n, address) in MODES.into_iter().enumerate() {
        for (m, size) in [[1000, 777], [2100, 37], [1, 1]].into_iter().enumerate() {
            let spec = GeometrySpec {
                page: [128, 40][(n + m) % 2],
                address: [address, MODES[(n + m) % 4], address],
                ..GeometrySpec::image(size[0], size[1])
            };
            let geometry = Geometry::new(spec).unwrap();
            let (share, seed) = ([0.4, 0.9][m % 2], (3 * n + m) as u64);
            let world = World::new(&GPU, &geometry, LayerFormat::Rgba8, share, seed);
            let spots = [[0, 0], [size[0] - 1, size[1] - 1], [size[0] / 2, size[1] / 3]];
            for filter in Filter::KINDS {
                check(&GPU, &world, &spots, filter, (n + 7 * m) as u64 + 1);
            }
        }
    }
}

/// Pages of every level at and beside these texels, some of them missing.
fn pages_around(geometry: &Geometry, spots: &[[u32; 2]], random: &mut Random) -> Vec<PagePos> {
    let mut pages = BTreeSet::new();
    for level in 0..geometry.tail().first_level() {
        let (scale, page) = (geometry.level(level).scale, geometry.page());
        for spot in spots {
            let at = [0, 1].map(|a| (u64::from(spot[a]) / scale[a] / u64::from(page[a])) as u32);
            for (x, y) in (-1..=1).flat_map(|x| (-1..=1).map(move |y| (x, y))) {
                let pos = PagePos::new_2d(level, at[0].wrapping_add_signed(x), at[1].wrapping_add_signed(y));
                if geometry.contains(pos) && random.unit() < 0.6 {
                    pages.insert(pos);
                }
            }
        }
    }
    pages.into_iter().collect()
}

/// The largest texture, through a hashed table: around its corners and some places in it.
#[test]
fn the_largest_texture_is_sampled_to_the_texel() {
    let last = (1 << 31) - 1;
    let spots = [[0, 0], [last, last], [last, 0], [1_234_567_891, 987_654_321], [3, 1 << 30]];
    for (n, address) in MODES.into_iter().enumerate() {
        let spec = GeometrySpec { address: [address; 3], ..GeometrySpec::image(1 << 31, 1 << 31) };
        let geometry = Geometry::new(spec).unwrap();
        let resident = pages_around(&geometry, &spots, &mut Random(n as u64 + 40));
        let description = Description::one_layer(geometry, LayerFormat::R8);
        let world = World::with(&GPU, &description, 0, resident, TableKind::Hashed, 77);
        assert!(world.tables.hash_table().is_some_and(|table| table.len() > 300));
        for filter in Filter::KINDS {
            check(&GPU, &world, &spots, filter, n as u64);
        }
    }
}
