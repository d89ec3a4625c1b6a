//! A surface that closes on itself, its uv computed in the shader, shows no seam where uv jumps, and wants
//! nothing coarse there.

use vastex_core::{AddressMode, Geometry, GeometrySpec, LayerFormat, PageId};
use vastex_wgpu::{FeedbackMode, Filter};

use crate::common::{Bindings, GPU, World};
use crate::drawing::{self, Drawing, SIDE};

/// A disc whose uv is the angle, which jumps on the left, and the distance from the pole near its middle, so
/// that a seam is within blocks of four pixels. `other_side` takes the gradients there from an angle that
/// jumps on the right.
pub(crate) const DISC: &str = include_str!("wgsl/disc.wgsl");

/// A pixel: its colour, and the level that it wants in eighths.
type Pixel = ([f32; 4], u32);

fn drawn(world: &World, filter: Filter, entry: &'static str) -> Vec<Pixel> {
    let bindings = Bindings::new(&GPU, world.kind(0, filter), FeedbackMode::Separate, false);
    let group = bindings.group(&GPU, world);
    let (colors, wanted) = drawing::drawn(
        &GPU,
        &Drawing {
            text: bindings.text(DISC, world.id),
            entries: ["corner", entry],
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            vertices: 4,
            layout: &bindings.layout,
            group: &group,
            inputs: None,
        },
    );
    let level = |[low, high, eighth, _]: [u32; 4]| {
        let page = PageId::from_bits(u64::from(high) << 32 | u64::from(low)).unwrap();
        8 * u32::from(page.pos(vastex_core::Dims::D2).level) + eighth
    };
    colors.into_iter().zip(wanted.into_iter().map(level)).collect()
}

/// Pixels that are not alike, but for those at the pole, where half of all angles meet in a block of four
/// pixels.
fn unlike(a: &[Pixel], b: &[Pixel]) -> usize {
    let is_at_pole = |n: usize| {
        let [x, y] = [n as u32 % SIDE, n as u32 / SIDE].map(|at| at.abs_diff(SIDE / 2));
        x <= 3 && y <= 3
    };
    let is_unlike = |(a, b): (&Pixel, &Pixel)| {
        let color = a.0.iter().zip(&b.0).any(|(a, b)| (a - b).abs() > 0.02);
        color || a.1.abs_diff(b.1) > 1
    };
    a.iter().zip(b).enumerate().filter(|&(n, pair)| !is_at_pole(n) && is_unlike(pair)).count()
}

#[test]
fn where_uv_jumps_there_is_no_seam() {
    let spec = GeometrySpec {
        page: 64,
        address: [AddressMode::Wrap, AddressMode::Clamp, AddressMode::Clamp],
        ..GeometrySpec::image(1024, 512)
    };
    let world = World::new(&GPU, &Geometry::new(spec).unwrap(), LayerFormat::Rgba8, 1.0, 8);
    for filter in Filter::KINDS {
        let [wrapped, plain, other] =
            ["wrapped", "plain", "other_side"].map(|entry| drawn(&world, filter, entry));
        assert_eq!(unlike(&wrapped, &other), 0, "{filter}");
        // The jump would be seen along the whole of the seam.
        assert!(unlike(&plain, &other) >= SIDE as usize / 4, "{filter}: {}", unlike(&plain, &other));
    }
}
