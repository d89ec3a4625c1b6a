//! What `vastex_inspect` tells of a place is what the page table leads to there.

use bytemuck::{Pod, Zeroable};
use vastex_core::{Description, Geometry, GeometrySpec, LayerFormat, PagePos};
use vastex_wgpu::{FeedbackMode, Filter, TableKind, twins};

use crate::common::{Bindings, GPU, NUMBER, Random, World};
use crate::sampling::{pipeline, run};

/// A place, and texels of level 0 along one pixel there.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Input {
    uv: [f32; 2],
    step: f32,
    unused: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Output {
    wanted: f32,
    level: f32,
    shown: u32,
    of_page: u32,
    page: [u32; 2],
    page_texel: [f32; 2],
}

pub(crate) const HARNESS: &str = include_str!("wgsl/inspect.wgsl");

#[test]
fn places_are_what_the_page_table_says() {
    let gpu = &*GPU;
    let mut seen_coarser = 0;
    for (spec, bias) in [(GeometrySpec::image(1000, 777), 0), (GeometrySpec::image(3000, 200), 12)] {
        let geometry = Geometry::new(GeometrySpec { page: 32, ..spec }).unwrap();
        let mut world = World::new(gpu, &geometry, LayerFormat::Rgba8, 0.4, 11);
        world.pool.set_bias(&gpu.queue, bias);
        let bindings = Bindings::new(gpu, world.kind(0, Filter::Bilinear), FeedbackMode::Separate, false);
        let pipeline = pipeline(gpu, &bindings.layout, &bindings.text(HARNESS, world.id));
        let group = bindings.group(gpu, &world);
        let mut random = Random(99);
        // A little into a level, so that rounding of a logarithm changes nothing.
        let inputs: Vec<Input> = (0..2000)
            .map(|_| Input {
                uv: [random.unit(), random.unit()],
                step: ((random.below(12) as f32 - 1.0) + 0.3).exp2(),
                unused: 0.0,
            })
            .collect();
        let outputs: Vec<Output> = run(gpu, &pipeline, &group, &inputs);
        let twin =
            twins::Texture { pool_bias: bias, ..twins::Texture::new(&geometry, &*world.image, NUMBER) };
        for (input, output) in inputs.iter().zip(&outputs) {
            let lambda = input.step.log2();
            let (wanted, level) = (twin.unbiased_level(lambda), twin.level(lambda));
            assert!(
                (output.wanted - wanted).abs() < 1e-3 && (output.level - level).abs() < 1e-3,
                "{input:?} {output:?}"
            );
            let place = twin.place(input.uv, level as u8);
            assert_eq!(output.shown, u32::from(place.level), "{input:?} {output:?}");
            seen_coarser += u32::from(output.shown > level as u32);
            let at = geometry.level(place.level);
            let texel = [0, 1].map(|a| input.uv[a] * geometry.size()[a] as f32 / at.scale[a] as f32);
            let from_first = [0, 1].map(|a| output.page[a] as f32 * 32.0 + output.page_texel[a]);
            let is_near = from_first.iter().zip(texel).all(|(found, texel)| (found - texel).abs() < 1e-2);
            assert!(is_near, "{input:?} {output:?}");
            if place.level < geometry.tail().first_level() {
                assert!(output.page_texel.iter().all(|texel| (0.0..=32.01).contains(texel)), "{output:?}");
                assert_eq!(output.of_page, output.shown, "a resident page leads to itself");
            }
        }
    }
    assert!(seen_coarser > 100, "nothing was missing, so little was tried");
}

/// Of 2^22 texels a 32-bit uv tells every fourth one, so functions that take one want level 2 at least;
/// through either kind of table.
#[test]
fn a_uv_wants_no_level_finer_than_it_can_tell() {
    let gpu = &*GPU;
    for (bits, finest) in [(22, 2.0), (20, 0.0)] {
        let geometry = Geometry::new(GeometrySpec::image(1 << bits, 100)).unwrap();
        let description = Description::one_layer(geometry.clone(), LayerFormat::R8);
        for kind in [TableKind::Direct, TableKind::Hashed] {
            let resident = vec![PagePos::new_2d(2, 5, 0), PagePos::new_2d(0, 20, 0)];
            let world = World::with(gpu, &description, 0, resident, kind, 5);
            let bindings = Bindings::new(gpu, world.kind(0, Filter::Bilinear), FeedbackMode::Separate, false);
            let pipeline = pipeline(gpu, &bindings.layout, &bindings.text(HARNESS, world.id));
            let group = bindings.group(gpu, &world);
            // In the middle of page 20 of level 0, which is page 5 of level 2.
            let uv = [(20.5 * 128.0) / (1u32 << bits) as f32, 0.5];
            let inputs = [0.01, 0.5, 2.5, 4.0, 9.0].map(|step| Input { uv, step, unused: 0.0 });
            let outputs: Vec<Output> = run(gpu, &pipeline, &group, &inputs);
            for (input, output) in inputs.iter().zip(&outputs) {
                let wanted = input.step.log2().max(finest);
                assert!((output.wanted - wanted).abs() < 1e-3, "2^{bits}, {kind:?}: {input:?} {output:?}");
            }
            assert_eq!(outputs[0].shown, finest as u32, "2^{bits}, {kind:?}: {:?}", outputs[0]);
        }
    }
}
