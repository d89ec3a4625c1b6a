//! Readers as the programs have them, written from the layouts' descriptions; they share nothing with the
//! exporter.
//!
//! Each gives the pictures of its levels, and fails where the program would not find or not take a tile.

use std::path::{Path, PathBuf};

use crate::directories::pictures::Picture;

/// The levels of a tree of square tiles, coarsest first, by what Gaia Sky looks for:
/// `level<N>/tx_<column>_<row>.<ext>`.
pub(crate) fn gaia_sky(directory: &Path, name: &str, border: u32) -> Vec<Picture> {
    let manifest = std::fs::read_to_string(directory.join(format!("{name}.json"))).unwrap();
    assert!(manifest.contains(&format!("\"location\": \"$data/{name}\"")), "{manifest}");
    let side: u32 = number_behind(&manifest, "\"tileSize\": ");
    assert!(side.is_power_of_two() && (4..=1024).contains(&side));
    assert_eq!(manifest.matches(['{', '[']).count(), manifest.matches(['}', ']']).count());
    let count = (0..15).take_while(|level| directory.join(format!("level{level}")).is_dir()).count() as u32;
    let tile = |level: u32, column: u32, row: u32| {
        let stem = directory.join(format!("level{level}")).join(format!("tx_{column}_{row}.png"));
        let tile = Picture::of_png(&stem);
        assert_eq!(tile.size, [side; 2]);
        tile
    };
    (0..count).map(|level| tree_level(level, side, border, &|c, r| tile(level, c, r))).collect()
}

/// The same, by what Celestia looks for.
pub(crate) fn celestia(context: &Path) -> Vec<Picture> {
    let text = std::fs::read_to_string(context).unwrap();
    let words: Vec<&str> = text.split_whitespace().map(|word| word.trim_matches('"')).collect();
    assert_eq!((words[0], words[1], *words.last().unwrap()), ("VirtualTexture", "{", "}"));
    let value = |key: &str| words[words.iter().position(|word| *word == key).unwrap() + 1];
    let (split, side): (u32, u32) = (value("BaseSplit").parse().unwrap(), value("TileSize").parse().unwrap());
    assert!(split <= 17 && side >= 64 && side.is_power_of_two());
    let images = context.parent().unwrap().join(value("ImageDirectory"));
    let tile = |level: u32, u: u32, v: u32| {
        let name = format!("{}{u}_{v}.{}", value("TilePrefix"), value("TileType"));
        let tile = Picture::of_png(&images.join(format!("level{level}")).join(name));
        assert!(tile.size.iter().all(|side| side.is_power_of_two()));
        tile
    };
    let count = (0..13).take_while(|level| images.join(format!("level{level}")).is_dir()).count() as u32;
    (0..count).map(|level| tree_level(level + split, side, 0, &|u, v| tile(level, u, v))).collect()
}

/// Puts tiles side by side. A border must repeat what lies beside it, around the globe but not over the
/// poles.
fn tree_level(depth: u32, side: u32, border: u32, tile: &dyn Fn(u32, u32) -> Picture) -> Picture {
    let (columns, rows, payload) = (2 << depth, 1 << depth, side - 2 * border);
    let mut level = Picture::new([columns * payload, rows * payload]);
    let tiles: Vec<_> =
        (0..rows).flat_map(|r| (0..columns).map(move |c| (c, r))).map(|(c, r)| (c, r, tile(c, r))).collect();
    for (column, row, tile) in &tiles {
        for y in 0..payload {
            for x in 0..payload {
                level.set(column * payload + x, row * payload + y, tile.at(border + x, border + y));
            }
        }
    }
    let [width, height] = level.size.map(i64::from);
    for (column, row, tile) in &tiles {
        for y in 0..side {
            for x in 0..side {
                let u = i64::from(column * payload + x) - i64::from(border);
                let v = i64::from(row * payload + y) - i64::from(border);
                let expected = level.at(u.rem_euclid(width) as u32, v.clamp(0, height - 1) as u32);
                assert_eq!(tile.at(x, y), expected, "tile {column}, {row} at {x}, {y}");
            }
        }
    }
    level
}

/// The levels of a Deep Zoom image, coarsest first.
pub(crate) fn deep_zoom(manifest: &Path) -> Vec<Picture> {
    let text = std::fs::read_to_string(manifest).unwrap();
    let number = |name: &str| -> u32 { number_behind(&text, &format!(" {name}=\"")) };
    let (tile, overlap) = (number("TileSize"), number("Overlap"));
    let full = [number("Width"), number("Height")];
    assert!(text.contains(" Format=\"png\"") && text.contains("http://schemas.microsoft.com/deepzoom/2008"));
    let mut files = PathBuf::from(manifest);
    files.set_file_name(format!("{}_files", manifest.file_stem().unwrap().to_str().unwrap()));
    let finest = (0..).find(|level| 1u32 << level >= full[0].max(full[1])).unwrap();
    assert!(!files.join((finest + 1).to_string()).exists());
    let level = |number: u32| {
        let size = full.map(|n| n.div_ceil(1 << (finest - number)));
        let mut level = Picture::new(size);
        for row in 0..size[1].div_ceil(tile) {
            for column in 0..size[0].div_ceil(tile) {
                let picture =
                    Picture::of_png(&files.join(number.to_string()).join(format!("{column}_{row}.png")));
                let start = [column, row].map(|n| (n * tile).saturating_sub(overlap));
                let end = [0, 1].map(|a| size[a].min(([column, row][a] + 1) * tile + overlap));
                assert_eq!(picture.size, [end[0] - start[0], end[1] - start[1]], "{number}: {column}, {row}");
                for y in 0..picture.size[1] {
                    for x in 0..picture.size[0] {
                        let (u, v) = (start[0] + x, start[1] + y);
                        let is_own = u / tile == column && v / tile == row;
                        if is_own {
                            level.set(u, v, picture.at(x, y));
                        }
                    }
                }
            }
        }
        level
    };
    (0..=finest).map(level).collect()
}

/// One level of the prototype's pages, without what is beyond the picture, which has `size` texels at that
/// level.
pub(crate) fn prototype(pages: &Path, lod: u32, size: [u32; 2]) -> Picture {
    let mut level = Picture::new(size);
    for y in 0..size[1].div_ceil(512) {
        for x in 0..size[0].div_ceil(512) {
            let page = Picture::of_png(&pages.join(format!("{lod}_{x}_{y}.png")));
            assert_eq!(page.size, [516; 2]);
            for v in 0..512.min(size[1] - 512 * y) {
                for u in 0..512.min(size[0] - 512 * x) {
                    level.set(512 * x + u, 512 * y + v, page.at(2 + u, 2 + v));
                }
            }
        }
    }
    level
}

fn number_behind(text: &str, key: &str) -> u32 {
    let start = text.find(key).unwrap_or_else(|| panic!("no {key} in {text}")) + key.len();
    text[start..].split(|c: char| !c.is_ascii_digit()).next().unwrap().parse().unwrap()
}
