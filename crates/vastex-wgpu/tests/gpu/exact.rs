//! 16-bit data comes back exact: every texel of every level, to the last bit, on devices that filter it and
//! on those that do not.

use bytemuck::{Pod, Zeroable};
use vastex_core::{AddressMode, Description, Geometry, GeometrySpec, Layer, LayerFormat, PagePos};
use vastex_wgpu::test_device::TestDevice;
use vastex_wgpu::{Atlas, FeedbackMode, Filter};

use crate::common::{Bindings, GPU, World};
use crate::sampling::{pipeline, run};

/// A place, so many texels of level 0 after the beginning of a texel, at a level.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Input {
    anchor: [u32; 2],
    offset: [f32; 2],
    level: f32,
    unused: f32,
}

pub(crate) const HARNESS: &str = include_str!("wgsl/exact.wgsl");

/// Compares the middle of the texels of the levels finer than the tail with the bytes of their tiles.
fn check(gpu: &TestDevice, format: LayerFormat, atlas: Atlas, filter: Filter) {
    let address = [AddressMode::Mirror, AddressMode::Wrap, AddressMode::Clamp];
    let spec = GeometrySpec { page: 32, address, ..GeometrySpec::image(150, 90) };
    let geometry = Geometry::new(spec).unwrap();
    let description = Description::new(geometry.clone(), vec![Layer::new("a", format)]);
    let world = World::of(gpu, &description, 0, 1.0, 6);
    assert_eq!(world.pool.atlas(0), atlas);
    let bindings = Bindings::new(gpu, world.kind(0, filter), FeedbackMode::Separate, false);
    let pipeline = pipeline(gpu, &bindings.layout, &bindings.text(HARNESS, world.id));
    let group = bindings.group(gpu, &world);
    for level in 0..geometry.tail().first_level() {
        let [width, height, _] = geometry.level(level).size;
        let side = 1u32 << level;
        // The middle of a last one may lie beyond the edge.
        let is_inside = |texel: &[u32; 2]| (0..2).all(|a| texel[a] * side + side / 2 < geometry.size()[a]);
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        let texels: Vec<[u32; 2]> = texels.filter(is_inside).collect();
        // A step closer than the finest level the bicubic filter takes all of its sixteen taps.
        let closer = if level == 0 && filter == Filter::Bicubic { -1.0 } else { f32::from(level) };
        let input = |texel: &[u32; 2]| Input {
            anchor: texel.map(|at| at * side),
            offset: [0.5 * side as f32; 2],
            level: closer,
            unused: 0.0,
        };
        let inputs: Vec<Input> = texels.iter().map(input).collect();
        let found: Vec<[f32; 4]> = run(gpu, &pipeline, &group, &inputs);
        for (texel, found) in texels.iter().zip(found) {
            let page = texel.map(|at| at / 32);
            let entry = world.image.lookup(PagePos::new_2d(level, page[0], page[1]));
            assert_eq!(entry.level(), level);
            let [x, y] = [0, 1].map(|a| (texel[a] - 32 * page[a] + geometry.border()[a]) as usize);
            let first = (y * geometry.tile()[0] as usize + x) * format.texel_bytes();
            let bytes = &world.tiles[&entry.slot()][first..][..format.texel_bytes()];
            let is_exact = match format {
                LayerFormat::R32Float => found[0].to_le_bytes() == bytes,
                _ => bytes.chunks_exact(2).zip(found).all(|(word, found)| {
                    (found * 65535.0).round() as u32 == u32::from(u16::from_le_bytes([word[0], word[1]]))
                }),
            };
            assert!(is_exact, "{filter} {format:?} level {level} texel {texel:?}: {found:?}, not {bytes:?}");
        }
    }
}

#[test]
fn sixteen_bits_come_back_exact_where_the_device_does_not_filter_them() {
    let gpu = TestDevice::with_features(|_| wgpu::Features::empty());
    let atlases = [
        (LayerFormat::R16, Atlas::Uint16),
        (LayerFormat::Rgba16, Atlas::Uint16Rgba),
        (LayerFormat::R32Float, Atlas::Unfiltered),
    ];
    for (format, atlas) in atlases {
        for filter in Filter::KINDS {
            check(&gpu, format, atlas, filter);
        }
    }
}

/// The device's own filter weighs texels as finely as it sees fit, so only what takes one texel is exact.
#[test]
fn sixteen_bits_come_back_exact_where_the_device_filters_them() {
    for format in [LayerFormat::R16, LayerFormat::Rgba16] {
        check(&GPU, format, Atlas::Float, Filter::Nearest);
    }
}
