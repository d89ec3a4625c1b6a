//! Build, export, build: the texels come back, and each program sees every level in between.

use png::BitDepth::{Eight, Sixteen};
use png::ColorType;
use vastex_build::{ExportOptions, Layout, Notice, TileFormat};
use vastex_tiles::{Container, TileSource};

use crate::directories::pictures::{Picture, Sandbox, levels};
use crate::directories::programs;

fn png(layout: Layout) -> ExportOptions {
    ExportOptions { format: Some(TileFormat::Png), ..ExportOptions::new(layout) }
}

/// Every level of the two, and the format of the layer.
#[track_caller]
fn expect_same(sandbox: &Sandbox, exported: &str, container: &std::path::Path) {
    let again = sandbox.build(exported, "again.vastex");
    for (got, expected) in levels(&again).iter().zip(levels(container)) {
        got.expect(&expected);
    }
    let format = |path| Container::open_file(path).unwrap().description().layers[0].format;
    assert_eq!(format(again), format(container.to_owned()));
}

#[test]
fn deep_zoom_is_exact_at_any_size_and_overlap() {
    let cases = [
        ([1, 1], 254, 1),
        ([255, 1], 254, 1),
        ([1, 300], 16, 0),
        ([301, 199], 64, 3),
        ([256, 512], 256, 0),
        ([509, 254], 254, 1),
    ];
    for (size, tile, overlap) in cases {
        let sandbox = Sandbox::new();
        let container = sandbox.rgb(size);
        let options =
            ExportOptions { tile_size: Some(tile), overlap: Some(overlap), ..png(Layout::DeepZoom) };
        let report = sandbox.export(&container, "zoom", &options);
        assert_eq!((report.size, report.notices.as_slice()), (size, &[][..]));
        let stored = levels(&container);
        let seen = programs::deep_zoom(&sandbox.path("zoom/zoom.dzi"));
        assert_eq!((seen.len(), seen.len()), (stored.len(), report.levels as usize));
        seen.iter().rev().zip(&stored).for_each(|(got, expected)| got.expect(expected));
        expect_same(&sandbox, "zoom", &container);
        expect_same(&sandbox, "zoom/zoom.dzi", &container);
    }
}

#[test]
fn every_kind_of_texel_comes_back() {
    for layout in [Layout::DeepZoom, Layout::Prototype] {
        for (color, depth) in [
            (ColorType::Grayscale, Eight),
            (ColorType::GrayscaleAlpha, Eight),
            (ColorType::Rgba, Eight),
            (ColorType::Grayscale, Sixteen),
        ] {
            let sandbox = Sandbox::new();
            let container = sandbox.container([130, 71], color, depth);
            sandbox.export(&container, "tiles", &png(layout));
            expect_same(&sandbox, "tiles", &container);
        }
    }
}

#[test]
fn the_prototype_is_exact_at_any_size() {
    for size in [[1, 1], [512, 512], [513, 511]] {
        let sandbox = Sandbox::new();
        let container = sandbox.rgb(size);
        let report = sandbox.export(&container, "prototype", &png(Layout::Prototype));
        let stored = levels(&container);
        for lod in 0..report.levels {
            let expected = &stored[lod as usize];
            programs::prototype(&sandbox.path("prototype/pages"), lod, expected.size).expect(expected);
        }
        assert!(stored[report.levels as usize - 1].size.iter().all(|side| *side <= 512));
        expect_same(&sandbox, "prototype", &container);
        expect_same(&sandbox, "prototype/pages", &container);
    }
}

#[test]
fn pages_without_a_size_are_full() {
    let sandbox = Sandbox::new();
    let container = sandbox.rgb([600, 100]);
    sandbox.export(&container, "prototype", &png(Layout::Prototype));
    std::fs::remove_file(sandbox.path("prototype/size.txt")).unwrap();
    let again = levels(&sandbox.build("prototype", "again.vastex"));
    let original = &levels(&container)[0];
    assert_eq!(again[0].size, [1024, 512]);
    // What lies beyond the picture is the picture again in x, which wraps, and its edge in y.
    for (x, y) in [(0, 0), (599, 99), (600, 50), (1023, 511), (100, 400)] {
        assert_eq!(again[0].at(x, y), original.at(x % 600, y.min(99)));
    }
}

#[test]
fn one_tree_serves_gaia_sky_and_celestia_exactly_where_the_grid_holds_the_size() {
    for (layout, size, tile) in [
        (Layout::GaiaSky, [512, 256], 64),
        (Layout::Celestia, [512, 256], 128),
        (Layout::GaiaSky, [256, 128], 128),
    ] {
        let sandbox = Sandbox::new();
        let container = sandbox.rgb(size);
        let report =
            sandbox.export(&container, "earth", &ExportOptions { tile_size: Some(tile), ..png(layout) });
        assert!(report.notices.is_empty(), "{:?}", report.notices);
        let stored = levels(&container);
        let directory = sandbox.path("earth");
        for seen in
            [programs::gaia_sky(&directory, "earth", 0), programs::celestia(&directory.join("earth.ctx"))]
        {
            assert_eq!(seen.len(), report.levels as usize);
            seen.iter().rev().zip(&stored).for_each(|(got, expected)| got.expect(expected));
        }
        expect_same(&sandbox, "earth", &container);
        expect_same(&sandbox, "earth/earth.ctx", &container);
    }
}

#[test]
fn bordered_tiles_are_written_and_recognised() {
    let sandbox = Sandbox::new();
    let container = sandbox.rgb([240, 120]);
    let options = ExportOptions { tile_size: Some(32), overlap: Some(1), ..png(Layout::GaiaSky) };
    let report = sandbox.export(&container, "earth", &options);
    assert!(report.notices.is_empty(), "{:?}", report.notices);
    let seen = programs::gaia_sky(&sandbox.path("earth"), "earth", 1);
    seen.iter().rev().zip(&levels(&container)).for_each(|(got, expected)| got.expect(expected));
    assert!(!sandbox.path("earth/earth.ctx").exists(), "Celestia knows no borders");
    expect_same(&sandbox, "earth", &container);
    let header = vastex_build::open(&sandbox.path("earth")).unwrap().header().clone();
    assert_eq!(header.notices, [Notice::BorderedTiles]);
}

#[test]
fn another_size_is_resampled_to_the_grid_and_said_so() {
    let sandbox = Sandbox::new();
    // A slope in x, level in y: easy to foresee at any size.
    let texels: Vec<u8> = (0..100 * 300).map(|i| (i % 300 / 2) as u8).collect();
    crate::common::write_png(&sandbox.path("image.png"), [300, 100], ColorType::Grayscale, Eight, &texels);
    let container = sandbox.build("image.png", "image.vastex");
    let options = ExportOptions { tile_size: Some(64), ..png(Layout::GaiaSky) };
    let report = sandbox.export(&container, "earth", &options);
    assert_eq!(report.notices, [Notice::ResampledToGrid { from: [300, 100], to: [512, 256] }]);
    let seen = programs::gaia_sky(&sandbox.path("earth"), "earth", 0);
    assert_eq!(seen.iter().map(|level| level.size[0]).collect::<Vec<_>>(), [128, 256, 512]);
    for level in &seen {
        let scale = 300.0 / f64::from(level.size[0]);
        for x in level.size[0] / 10..level.size[0] * 9 / 10 {
            let expected = ((f64::from(x) + 0.5) * scale - 0.5) / 2.0;
            let got = f64::from(level.at(x, level.size[1] / 2)[0]);
            assert!((got - expected).abs() < 1.5, "{x} of {}: {got}, expected {expected}", level.size[0]);
        }
    }
    let finest = ExportOptions { finest_level: Some(1), ..options };
    assert_eq!(sandbox.export(&container, "coarse", &finest).size, [256, 128]);
}

#[test]
fn a_part_of_a_planet_is_a_part_of_its_tree() {
    let sandbox = Sandbox::new();
    let container = sandbox.rgb([1024, 512]);
    let whole = ExportOptions { tile_size: Some(64), ..png(Layout::GaiaSky) };
    sandbox.export(&container, "whole", &whole);
    // Columns 5 to 11 and rows 2 to 5 of level 3.
    let (first, count) = ([5, 2], [7, 4]);
    let planet = &levels(&container)[0];
    let mut cut = Picture::new(count.map(|n| n * 64));
    for y in 0..cut.size[1] {
        for x in 0..cut.size[0] {
            cut.set(x, y, planet.at(first[0] * 64 + x, first[1] * 64 + y));
        }
    }
    let bytes: Vec<u8> = cut.texels.iter().flat_map(|&[r, g, b, _]| [r as u8, g as u8, b as u8]).collect();
    crate::common::write_png(&sandbox.path("part.png"), cut.size, ColorType::Rgb, Eight, &bytes);
    let part = sandbox.build("part.png", "part.vastex");
    let options = ExportOptions { finest_level: Some(3), first_tile: Some(first), ..whole };
    let report = sandbox.export(&part, "part", &options);
    assert_eq!((report.levels, report.notices), (2, vec![Notice::PartEndsAtLevel(2)]));
    let mut seen = 0;
    for level in 0..=3 {
        for column in 0..2 << level {
            for row in 0..1 << level {
                let name = format!("level{level}/tx_{column}_{row}.png");
                let path = sandbox.path("part").join(&name);
                // A tile is there if the part covers it wholly.
                let scale = 1 << (3 - level);
                let covers = |n: u32, axis: usize| {
                    n * scale >= first[axis] && (n + 1) * scale <= first[axis] + count[axis]
                };
                assert_eq!(path.exists(), covers(column, 0) && covers(row, 1), "{name}");
                if path.exists() {
                    Picture::of_png(&path).expect(&Picture::of_png(&sandbox.path("whole").join(&name)));
                    seen += 1;
                }
            }
        }
    }
    assert_eq!(seen, report.tiles);
}

#[test]
fn jpeg_tiles_are_near_and_build_again() {
    let sandbox = Sandbox::new();
    let data = crate::common::files::smooth([512, 256], 3);
    crate::common::write_png(&sandbox.path("image.png"), [512, 256], ColorType::Rgb, Eight, &data);
    let container = sandbox.build("image.png", "image.vastex");
    for (layout, name) in [(Layout::GaiaSky, "earth"), (Layout::DeepZoom, "zoom")] {
        // Red and blue are 10 steps apart on average, so that a swap shows.
        let sizes = [(50, 6.0), (95, 3.0)].map(|(quality, most)| {
            let options = ExportOptions { quality, ..ExportOptions::new(layout) };
            let target = format!("{name}{quality}");
            let report = sandbox.export(&container, &target, &options);
            assert_eq!(report.format, TileFormat::Jpeg);
            let [again, before] =
                [sandbox.build(&target, "again.vastex"), container.clone()].map(|path| levels(&path));
            let (again, before) = (&again[0].texels, &before[0].texels);
            for channel in 0..3 {
                let differences = again.iter().zip(before).map(|(a, b)| a[channel].abs_diff(b[channel]));
                let mean = differences.map(f64::from).sum::<f64>() / before.len() as f64;
                assert!(mean < most, "channel {channel} at quality {quality}: {mean}");
            }
            report.bytes
        });
        assert!(sizes[0] < sizes[1], "{sizes:?}");
    }
}
