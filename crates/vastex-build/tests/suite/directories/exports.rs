//! Exports of every kind of texel, at the texture's own size and resampled.

use std::cell::Cell;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use png::BitDepth::{Eight, Sixteen};
use png::{BitDepth, ColorType};
use twox_hash::XxHash3_64;
use vastex_build::{
    BuildOptions, ExportError, ExportOptions, LayerInput, Layout, Progress, TileFormat, build, export,
};
use vastex_core::LayerFormat;
use vastex_tiles::Container;

use super::pictures::{Picture, Sandbox};
use crate::common::{texels, write_png};

/// All tiles of a directory, by their names.
fn tiles(directory: &Path) -> Vec<(String, Picture)> {
    let mut found = Vec::new();
    let mut directories = vec![PathBuf::new()];
    while let Some(inside) = directories.pop() {
        for entry in fs::read_dir(directory.join(&inside)).unwrap() {
            let name = inside.join(entry.unwrap().file_name());
            let path = directory.join(&name);
            if path.is_dir() {
                directories.push(name);
            } else if path.extension().is_some_and(|e| e == "png") {
                found.push((name.to_str().unwrap().to_owned(), Picture::of_png(&path)));
            }
        }
    }
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found
}

fn hash(directory: &Path) -> u64 {
    let mut bytes = Vec::new();
    for (name, picture) in tiles(directory) {
        bytes.extend(name.as_bytes());
        bytes.extend(picture.size.map(u32::to_le_bytes).as_flattened());
        bytes.extend(picture.texels.iter().flatten().flat_map(|sample| sample.to_le_bytes()));
    }
    XxHash3_64::oneshot(&bytes)
}

fn png(layout: Layout) -> ExportOptions {
    ExportOptions { format: Some(TileFormat::Png), ..ExportOptions::new(layout) }
}

/// A container of noise with a layer of the format.
fn container(
    sandbox: &Sandbox,
    size: [u32; 2],
    color: ColorType,
    depth: BitDepth,
    format: LayerFormat,
) -> PathBuf {
    let bytes = color.samples() * if depth == Sixteen { 2 } else { 1 };
    write_png(
        &sandbox.path("image.png"),
        size,
        color,
        depth,
        &texels((size[0] * size[1]) as usize * bytes, 7),
    );
    let input = LayerInput { format: Some(format), ..sandbox.path("image.png").into() };
    let options = BuildOptions { page: 64, ..BuildOptions::default() };
    build(&[input], &sandbox.path("image.vastex"), &options, &()).unwrap();
    sandbox.path("image.vastex")
}

/// What every program shows of 8 bits was recorded once and stays so.
#[test]
fn texels_of_eight_bits_stay_as_they_are() {
    let kinds = [
        (ColorType::Grayscale, LayerFormat::R8),
        (ColorType::GrayscaleAlpha, LayerFormat::Rg8),
        (ColorType::Rgb, LayerFormat::Rgba8Srgb),
        (ColorType::Rgba, LayerFormat::Rgba8Srgb),
        (ColorType::Rgba, LayerFormat::Rgba8),
    ];
    let mut hashes = Vec::new();
    for (color, format) in kinds {
        let sandbox = Sandbox::new();
        let exact = container(&sandbox, [256, 128], color, Eight, format);
        for layout in [Layout::GaiaSky, Layout::Celestia, Layout::DeepZoom, Layout::Prototype] {
            sandbox.export(&exact, &format!("{layout:?}"), &png(layout));
            hashes.push(hash(&sandbox.path(&format!("{layout:?}"))));
        }
        let other = container(&sandbox, [300, 177], color, Eight, format);
        for (name, finest_level) in [("finer", None), ("coarser", Some(0))] {
            let options = ExportOptions { finest_level, tile_size: Some(64), ..png(Layout::GaiaSky) };
            sandbox.export(&other, name, &options);
            hashes.push(hash(&sandbox.path(name)));
        }
    }
    assert_eq!(hashes, RECORDED, "{hashes:#x?}");
}

/// For each kind the four layouts at its own size, and two sizes to which it is resampled.
const RECORDED: [u64; 30] = [
    0xe19691d183f7562b,
    0xe19691d183f7562b,
    0xfb558381cbec1789,
    0x3671431faec2805c,
    0x4e7893c8c4b6563a,
    0xd104c48341316250,
    0xaff6d7ff8b15f9d4,
    0xaff6d7ff8b15f9d4,
    0xb961d291b098e682,
    0x734bee6191892583,
    0xc3f640f2d8a6fab9,
    0x01ba0510e6b8cba1,
    0x01ff9002829dbc27,
    0x01ff9002829dbc27,
    0xdd5bb7cb65c1f233,
    0xd5f2d7201e223cfc,
    0xe0a847cb5234392e,
    0x237af2a9fffa88e4,
    0x39343bd37ea59f37,
    0x39343bd37ea59f37,
    0x90eb501f286ba026,
    0xb1c3dbf8f3b748f6,
    0x58db5aac70d07ca2,
    0x806108cff057bb9d,
    0x39343bd37ea59f37,
    0x39343bd37ea59f37,
    0x79df732d0e806832,
    0xb1c3dbf8f3b748f6,
    0x4cebe907035861ae,
    0xa36f2fe747e8c30c,
];

/// The sum over rows is what a naive walk gives: each texel of the finest level is a mean of those that it
/// covers.
fn sixteen_bits(name: &str, layout: Layout, color: ColorType, format: LayerFormat) {
    let sandbox = Sandbox::new();
    // A slope along x and another along y, light as it is: values of the whole range.
    let size = [300u32, 177];
    let ramp = |x: u32, y: u32, c: u32| (x * 200 + y * 30 + c * 11) as u16;
    let channels = color.samples() as u32;
    let words =
        (0..size[1]).flat_map(|y| (0..size[0]).flat_map(move |x| (0..channels).map(move |c| ramp(x, y, c))));
    let bytes: Vec<u8> = words.flat_map(u16::to_be_bytes).collect();
    write_png(&sandbox.path("image.png"), size, color, Sixteen, &bytes);
    // Normals are numbers, so they come into the layer as the file has them.
    let input = LayerInput { name: name.into(), format: Some(format), ..sandbox.path("image.png").into() };
    let options = BuildOptions { page: 64, filter: Some("box".parse().unwrap()), ..BuildOptions::default() };
    build(&[input], &sandbox.path("image.vastex"), &options, &()).unwrap();
    let options = ExportOptions { finest_level: Some(1), tile_size: Some(256), ..ExportOptions::new(layout) };
    let report = sandbox.export(&sandbox.path("image.vastex"), "out", &options);
    assert_eq!((report.size, report.format), ([1024, 512], TileFormat::Png));
    let tiles = tiles(&sandbox.path("out"));
    let finest: Vec<_> = tiles.iter().filter(|(name, _)| name.contains("level1")).collect();
    assert_eq!(finest.len(), 8);
    for (name, tile) in finest {
        let place = name.rsplit('/').next().unwrap().trim_start_matches("tx_").trim_end_matches(".png");
        let (column, row) = place.split_once('_').unwrap();
        let [left, top] = [column, row].map(|n| n.parse::<u32>().unwrap() * 256);
        for (x, y) in [(3, 7), (100, 100), (200, 250), (255, 0)] {
            // Inside the ramps: no edge of the picture and no seam of the globe.
            let at = [(left + x, 1024, size[0]), (top + y, 512, size[1])]
                .map(|(n, to, from)| (f64::from(n) + 0.5) * f64::from(from) / f64::from(to) - 0.5);
            if at[0] < 2.0 || at[1] < 2.0 || at[0] > 297.0 || at[1] > 174.0 {
                continue;
            }
            let got = tile.at(x, y);
            for c in 0..channels.min(3) {
                let expected = at[0] * 200.0 + at[1] * 30.0 + f64::from(c) * 11.0;
                let error = f64::from(got[c as usize]) - expected;
                assert!(error.abs() <= 1.5, "{name} {x},{y}: {got:?}, expected {expected}");
            }
        }
    }
    sandbox.build("out", "again.vastex");
}

#[test]
fn sixteen_bits_are_resampled_to_a_grid() {
    for layout in [Layout::GaiaSky, Layout::Celestia] {
        sixteen_bits("normal", layout, ColorType::Rgb, LayerFormat::Rgba16);
        sixteen_bits("height", layout, ColorType::Grayscale, LayerFormat::R16);
    }
}

#[test]
fn light_of_sixteen_bits_comes_back_as_light() {
    let sandbox = Sandbox::new();
    let first = sandbox.container([130, 70], ColorType::Rgb, Sixteen);
    sandbox.export(&first, "zoom", &ExportOptions::new(Layout::DeepZoom));
    let second = sandbox.build("zoom", "again.vastex");
    let [before, after] = [first, second].map(|path| crate::common::tiles(&path));
    assert_eq!(before.0.layers[0].format, LayerFormat::Rgba16);
    assert!(before.1 == after.1);
}

#[test]
fn floats_are_refused_before_anything_is_made() {
    for format in [
        LayerFormat::R16Float,
        LayerFormat::R32Float,
        LayerFormat::Rgba16Float,
        #[cfg(feature = "bc")]
        LayerFormat::Bc6h,
    ] {
        let sandbox = Sandbox::new();
        let color = if format.channels() == 1 { ColorType::Grayscale } else { ColorType::Rgb };
        // As tall as a page: one row of tiles, and no level that halves.
        let path = container(&sandbox, [300, 60], color, Sixteen, format);
        let names = sandbox.names();
        let container = Container::open_file(path).unwrap();
        for layout in [Layout::GaiaSky, Layout::Celestia, Layout::DeepZoom, Layout::Prototype] {
            for tiles in [None, Some(TileFormat::Png), Some(TileFormat::Jpeg)] {
                let options = ExportOptions { format: tiles, ..ExportOptions::new(layout) };
                let error = export(&container, &sandbox.path("out"), &options, &()).unwrap_err();
                let ExportError::Options(why) = &error else { panic!("{error}") };
                assert!(why.contains(&format!("texels of {} are floats", format.name())), "{why}");
            }
        }
        assert_eq!(sandbox.names(), names);
    }
}

/// Stops when it was asked so often.
struct Patience(Cell<u32>);

impl Progress for Patience {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        self.0.set(self.0.get().saturating_sub(1));
        if self.0.get() == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn an_export_is_asked_whether_to_go_on_within_a_row_of_tiles_too() {
    let sandbox = Sandbox::new();
    let path = container(&sandbox, [64, 64 * 40], ColorType::Grayscale, Eight, LayerFormat::R8);
    let names = sandbox.names();
    let container = Container::open_file(path).unwrap();
    // One row of tiles, for which all rows of pages are read.
    let options = ExportOptions { finest_level: Some(0), tile_size: Some(64), ..png(Layout::GaiaSky) };
    for patience in [1, 5, 20] {
        let stopped = export(&container, &sandbox.path("out"), &options, &Patience(Cell::new(patience)));
        assert!(matches!(stopped, Err(ExportError::Cancelled)));
        assert_eq!(sandbox.names(), names);
    }
}

#[cfg(unix)]
#[test]
fn what_a_killed_export_left_goes_with_the_next() {
    let sandbox = Sandbox::new();
    let path = container(&sandbox, [64, 64], ColorType::Grayscale, Eight, LayerFormat::R8);
    for name in [".out.1-0.partial", ".out.99999-3.partial", ".other.1-0.partial"] {
        fs::create_dir_all(sandbox.path(name).join("level0")).unwrap();
        fs::write(sandbox.path(name).join("level0/tx_0_0.png"), b"left").unwrap();
    }
    sandbox.export(&path, "out", &png(Layout::DeepZoom));
    assert_eq!(sandbox.names(), [".other.1-0.partial", "image.png", "image.vastex", "out"]);
}
