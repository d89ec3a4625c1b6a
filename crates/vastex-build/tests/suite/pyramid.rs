//! What is built, against the slow way: every texel of every tile.

use crate::common::{build_file, check_against_naive, texels, tiles, write_png};
use png::{BitDepth, ColorType};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use vastex_build::BuildOptions;
use vastex_core::AddressMode::{self, Clamp, Mirror, Wrap};
use vastex_core::LayerFormat;
use vastex_tiles::Compression;

#[derive(Clone, Copy, Debug)]
struct Case {
    size: [u32; 2],
    color: ColorType,
    depth: BitDepth,
    options: (u32, u32, [AddressMode; 2], bool),
}

fn check(case: Case, threads: usize) {
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("in.png");
    let bytes = case.depth as usize / 8 * case.color.samples();
    let texels = texels(bytes * (case.size[0] * case.size[1]) as usize, case.size[0] * 31 + case.size[1]);
    write_png(&input, case.size, case.color, case.depth, &texels);
    let (page, border, address, linear) = case.options;
    let compression = Compression::None;
    let options = BuildOptions { page, border, address, linear, threads, compression, ..Default::default() };
    let (output, report) = build_file(&input, &options);
    assert_eq!(report.size, case.size);
    check_against_naive(&output, linear, &layer_texels(case, &texels));
}

/// The texels of level 0, from those of a PNG.
fn layer_texels(case: Case, png: &[u8]) -> Vec<u8> {
    let eight = |be: &[u8]| (f64::from(u16::from_be_bytes([be[0], be[1]])) / 257.0).round() as u8;
    let narrow: Vec<u8> = match (case.depth, case.color) {
        (BitDepth::Sixteen, ColorType::Grayscale) => {
            return png.chunks(2).flat_map(|be| [be[1], be[0]]).collect();
        }
        (BitDepth::Sixteen, _) => png.chunks(2).map(eight).collect(),
        _ => png.to_vec(),
    };
    match case.color {
        ColorType::Rgb => narrow.chunks(3).flat_map(|t| [t[0], t[1], t[2], 255]).collect(),
        _ => narrow,
    }
}

fn any_case() -> impl Strategy<Value = Case> {
    let side = || prop_oneof![1u32..12, 12u32..200, 200u32..420];
    let color = prop::sample::select(vec![
        ColorType::Grayscale,
        ColorType::GrayscaleAlpha,
        ColorType::Rgb,
        ColorType::Rgba,
    ]);
    let address = || prop::sample::select(vec![Clamp, Wrap, Mirror]);
    let page = prop_oneof![8u32..40, 40u32..140];
    (side(), side(), color, any::<bool>(), (page, 0.0f64..1.0), address(), address(), any::<bool>()).prop_map(
        |(w, h, color, deep, (page, share), x, y, linear)| {
            let border = 1 + (f64::from(page / 2 - 1) * share) as u32;
            // Colour of 16 bits becomes light, which `layers` checks.
            let deep = deep && color == ColorType::Grayscale;
            let depth = if deep { BitDepth::Sixteen } else { BitDepth::Eight };
            Case { size: [w, h], color, depth, options: (page, border, [x, y], linear) }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, rng_seed: RngSeed::Fixed(3), failure_persistence: None, ..Default::default() })]

    #[test]
    fn every_tile_is_what_the_slow_way_makes(case in any_case()) {
        check(case, 2);
    }
}

#[test]
fn shapes_at_the_edge() {
    for size in [[1, 1], [1, 1000], [1000, 1], [129, 128], [128, 129], [7, 2000], [512, 384], [300, 9]] {
        for mode in [Clamp, Wrap, Mirror] {
            let options = (32, 4, [mode; 2], true);
            check(Case { size, color: ColorType::Rgba, depth: BitDepth::Eight, options }, 2);
        }
    }
}

#[test]
fn formats_become_the_layers_that_hold_them() {
    let dir = tempfile::tempdir().unwrap();
    for (color, depth, format) in [
        (ColorType::Grayscale, BitDepth::Eight, LayerFormat::R8),
        (ColorType::Grayscale, BitDepth::Sixteen, LayerFormat::R16),
        (ColorType::GrayscaleAlpha, BitDepth::Eight, LayerFormat::Rg8),
        (ColorType::GrayscaleAlpha, BitDepth::Sixteen, LayerFormat::Rgba16),
        (ColorType::Rgb, BitDepth::Eight, LayerFormat::Rgba8Srgb),
        (ColorType::Rgba, BitDepth::Sixteen, LayerFormat::Rgba16),
    ] {
        let input = dir.path().join("in.png");
        let bytes = depth as usize / 8 * color.samples() * 30 * 20;
        write_png(&input, [30, 20], color, depth, &texels(bytes, 1));
        let (output, report) = build_file(&input, &BuildOptions::default());
        assert_eq!((report.layers[0].layer.format, tiles(&output).0.layers[0].format), (format, format));
    }
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("in.png");
    write_png(&input, [1500, 700], ColorType::Rgb, BitDepth::Eight, &texels(1500 * 700 * 3, 5));
    for address in [[Clamp; 2], [Wrap; 2]] {
        let built = [1, 2, 5].map(|threads| {
            let options = BuildOptions { threads, address, page: 60, ..Default::default() };
            std::fs::read(build_file(&input, &options).0).unwrap()
        });
        assert!(built[0] == built[1] && built[0] == built[2]);
    }
}

#[test]
fn memory_does_not_grow_with_the_height() {
    let dir = tempfile::tempdir().unwrap();
    for address in [Clamp, Wrap, Mirror] {
        let held = [4_000u32, 30_000].map(|height| {
            let input = dir.path().join("in.png");
            write_png(
                &input,
                [64, height],
                ColorType::Grayscale,
                BitDepth::Eight,
                &texels(64 * height as usize, 9),
            );
            let options = BuildOptions { page: 16, address: [address; 2], ..Default::default() };
            let report = build_file(&input, &options).1;
            assert!(report.row_bytes_held <= report.memory);
            report.row_bytes_held
        });
        // Three to four more levels, of one tile's rows each.
        assert!(held[1] < held[0] + held[0] / 2, "{address:?}: {held:?}");
        assert!(held[1] < 64 * 4_000, "{address:?}: {held:?}");
    }
}
