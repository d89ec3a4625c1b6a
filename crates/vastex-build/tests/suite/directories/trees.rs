//! Planet trees as people have them: odd names, holes, coarse worlds with fine insets, tiles of many kinds.

use std::fs;
use std::path::Path;

use png::BitDepth::Eight;
use png::ColorType::{self, Grayscale, Rgb, Rgba};
use vastex_build::{BuildOptions, Notice, build};
use vastex_core::AddressMode;
use vastex_tiles::{Container, TileSource};

use crate::common::{texels, write_png};
use crate::directories::pictures::{Picture, Sandbox, levels};

const SIDE: u32 = 16;

fn tile(directory: &Path, name: &str, color: ColorType, seed: u32) -> Picture {
    let path = directory.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    write_png(&path, [SIDE; 2], color, Eight, &texels((SIDE * SIDE) as usize * color.samples(), seed));
    Picture::of_png(&path)
}

#[test]
fn names_may_be_any_that_the_program_takes() {
    let sandbox = Sandbox::new();
    let planet = sandbox.path("planet");
    let roots = [tile(&planet, "level00/tx_0_0.png", Rgb, 1), tile(&planet, "level00/tx-1-0.png", Rgb, 2)];
    let names = [
        "1/tx 0 0.png",
        "1/tx.1.0.png",
        "1/tx_2-0.png",
        "1/tx_3_0.png",
        "1/tx_0_1.png",
        "1/tx_1_1.png",
        "1/tx_2_1.png",
        "1/tx_3_1.png",
    ];
    let tiles: Vec<_> = (3..).zip(names).map(|(seed, name)| tile(&planet, name, Rgb, seed)).collect();
    fs::write(planet.join("readme.txt"), "tiles of a planet").unwrap();
    let read = levels(&sandbox.build("planet", "planet.vastex"));
    assert_eq!(read[0].size, [4 * SIDE, 2 * SIDE]);
    for y in 0..2 * SIDE {
        for x in 0..4 * SIDE {
            let expected = tiles[(y / SIDE * 4 + x / SIDE) as usize].at(x % SIDE, y % SIDE);
            assert_eq!(read[0].at(x, y), expected, "{x}, {y}");
        }
    }
    build(&[&planet], &sandbox.path("default.vastex"), &BuildOptions::default(), &()).unwrap();
    let container = Container::open_file(sandbox.path("default.vastex")).unwrap();
    let address = container.description().geometry.address();
    assert_eq!(address[..2], [AddressMode::Wrap, AddressMode::Clamp], "a planet is round");
    assert_ne!(read[1].at(0, 0), roots[0].at(0, 0), "coarser levels are made anew from the finest");
}

#[test]
fn misnamed_levels_are_taken_and_told() {
    let sandbox = Sandbox::new();
    let planet = sandbox.path("planet");
    for (level, directory) in ["level000", "level011"].iter().enumerate() {
        for column in 0..2 << level {
            for row in 0..1 << level {
                tile(&planet, &format!("{directory}/tx_{column}_{row}.png"), Rgb, column * 7 + row);
            }
        }
    }
    let header = vastex_build::open(&planet).unwrap().header().clone();
    assert_eq!((header.width, header.height), (4 * SIDE, 2 * SIDE));
    let misnamed = |name: &str, level| Notice::MisnamedLevel { name: name.into(), level };
    assert_eq!(header.notices, [misnamed("level000", 0), misnamed("level011", 1)]);
    assert!(header.notices[1].to_string().contains("level011"));
}

#[test]
fn the_ancestor_stands_in_for_a_missing_tile() {
    let sandbox = Sandbox::new();
    let planet = sandbox.path("planet");
    let roots = [tile(&planet, "level0/tx_0_0.png", Rgb, 1), tile(&planet, "level0/tx_1_0.png", Rgb, 2)];
    let middle = tile(&planet, "level1/tx_3_1.png", Rgb, 3);
    let fine = tile(&planet, "level3/tx_5_2.png", Rgb, 4);
    let header = vastex_build::open(&planet).unwrap().header().clone();
    assert_eq!(header.notices, [Notice::TilesFromAncestors { missing: 16 * 8 - 1, of: 16 * 8 }]);
    let read = levels(&sandbox.build("planet", "planet.vastex"));
    assert_eq!(read[0].size, [16 * SIDE, 8 * SIDE]);
    for y in 0..8 * SIDE {
        for x in 0..16 * SIDE {
            let expected = if (x / SIDE, y / SIDE) == (5, 2) {
                fine.at(x % SIDE, y % SIDE)
            } else if (x / (4 * SIDE), y / (4 * SIDE)) == (3, 1) {
                middle.at(x / 4 % SIDE, y / 4 % SIDE)
            } else {
                roots[(x / (8 * SIDE)) as usize].at(x / 8 % SIDE, y / 8 % SIDE)
            };
            assert_eq!(read[0].at(x, y), expected, "{x}, {y}");
        }
    }
    // Where an ancestor stood in, filtering makes it again.
    assert_eq!(read[3].at(SIDE + 3, 1), roots[1].at(3, 1));
}

#[test]
fn tiles_of_many_kinds_share_a_tree() {
    let sandbox = Sandbox::new();
    let planet = sandbox.path("planet");
    let tiles =
        [tile(&planet, "level0/tx_0_0.png", Grayscale, 1), tile(&planet, "level0/tx_1_0.png", Rgba, 2)];
    let read = levels(&sandbox.build("planet", "planet.vastex"));
    for (x, y) in [(0, 0), (15, 9), (16, 0), (31, 15)] {
        assert_eq!(read[0].at(x, y), tiles[(x / SIDE) as usize].at(x % SIDE, y));
    }
}

#[test]
fn a_context_may_begin_at_any_split_with_any_prefix() {
    let sandbox = Sandbox::new();
    let side = 64;
    for column in 0..4 {
        for row in 0..2 {
            let path = sandbox.path(&format!("tiles/level0/earth-{column}_{row}.png"));
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            write_png(&path, [side; 2], Grayscale, Eight, &[(column * 50 + row) as u8; 64 * 64]);
        }
    }
    let text = "# the earth\nVirtualTexture { ImageDirectory \"tiles\" BaseSplit 1 TileSize 64 TileType \"png\" TilePrefix \"earth-\" }\n";
    fs::write(sandbox.path("earth.ctx"), text).unwrap();
    let read = levels(&sandbox.build("earth.ctx", "earth.vastex"));
    assert_eq!(read[0].size, [256, 128]);
    assert_eq!(read[0].at(200, 100), [151, 151, 151, 255]);
}
