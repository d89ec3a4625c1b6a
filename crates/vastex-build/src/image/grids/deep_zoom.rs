//! Deep Zoom: a `.dzi` file that tells size, tile size and overlap of the tiles in `<name>_files/<level>/`.

use std::path::{Path, PathBuf};

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::tile::Piece;
use super::{Grid, Source, entries, shared_texels};
use crate::image::InputFault;

/// Texels per side that a tile may have, its overlaps included.
const MAX_SIDE: u32 = 16384;

/// What a `.dzi` file says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Manifest {
    size: [u32; 2],
    tile: u32,
    overlap: u32,
    extension: String,
}

/// The levels of an image, in `tiles/<number>`; the number of the finest is the largest.
struct DeepZoom {
    manifest: Manifest,
    tiles: PathBuf,
    finest: u32,
    levels: u32,
}

/// The one `.dzi` file in a directory; an error where there are several.
pub(super) fn find(directory: &Path) -> Result<Option<PathBuf>, InputFault> {
    let is_manifest = |path: &PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("dzi"));
    let mut found: Vec<_> = entries(directory)?.into_iter().filter(is_manifest).collect();
    match found.len() {
        0 => Ok(None),
        1 => Ok(found.pop()),
        n => Err(InputFault::Layout {
            why: format!("is a directory of {n} Deep Zoom images"),
            remedy: "name one of the .dzi files in it",
        }),
    }
}

/// Returns true if a text is a `.dzi` file.
pub(super) fn is_manifest(text: &str) -> bool {
    text.trim_start_matches('\u{feff}').trim_start().starts_with('<')
        && text.contains("Image")
        && text.contains("TileSize")
}

/// Reads the manifest `text`, the content of the file `path`, and looks at the first and the last tile.
pub(super) fn open(path: &Path, text: &str) -> Result<Source, InputFault> {
    let manifest = parse(text)?;
    let [width, height] = manifest.size;
    let finest = width.max(height).next_power_of_two().trailing_zeros();
    let mut tiles = path.with_extension("").into_os_string();
    tiles.push("_files");
    let tiles = PathBuf::from(tiles);
    let levels = (0..=finest).take_while(|level| tiles.join((finest - level).to_string()).is_dir()).count();
    if levels == 0 {
        let why =
            format!("lacks the directory of its finest level, {}", tiles.join(finest.to_string()).display());
        return Err(InputFault::Layout {
            why,
            remedy: "copy the whole image, or correct its Width and Height",
        });
    }
    let grid = DeepZoom { manifest, tiles, finest, levels: levels as u32 };
    let last = grid.counts().map(|n| n - 1);
    let sample = [[0, 0], last].map(|[column, row]| grid.piece(0, column, row).path);
    let texels = shared_texels(sample.iter().map(PathBuf::as_path))?;
    let (directory, grid) = (grid.tiles.clone(), Box::new(grid));
    Ok(Source { grid, directory, texels, wraps: false, notices: Vec::new() })
}

impl DeepZoom {
    fn counts(&self) -> [u32; 2] {
        self.manifest.size.map(|n| n.div_ceil(self.manifest.tile))
    }
}

impl Grid for DeepZoom {
    fn size(&self) -> [u64; 2] {
        self.manifest.size.map(u64::from)
    }

    fn cell(&self) -> u32 {
        self.manifest.tile
    }

    fn levels(&self) -> u32 {
        self.levels
    }

    fn piece(&self, level: u32, column: u32, row: u32) -> Piece {
        let Manifest { size, tile, overlap, extension } = &self.manifest;
        let size = size.map(|n| u64::from(n).div_ceil(1 << level));
        // Overlap texels stand on inner sides only.
        let first = [column, row].map(|n| if n == 0 { 0 } else { *overlap });
        let end =
            |axis: usize, n: u32| (u64::from(n + 1) * u64::from(*tile) + u64::from(*overlap)).min(size[axis]);
        let start = |n: u32, first: u32| u64::from(n) * u64::from(*tile) - u64::from(first);
        let side = |axis: usize, n: u32| (end(axis, n) - start(n, first[axis])) as u32;
        Piece {
            path: self
                .tiles
                .join((self.finest - level).to_string())
                .join(format!("{column}_{row}.{extension}")),
            size: [side(0, column), side(1, row)],
            first,
            within: [0; 2],
            shift: 0,
        }
    }
}

fn parse(text: &str) -> Result<Manifest, InputFault> {
    let mut reader = Reader::from_str(text);
    let mut manifest = Manifest::default();
    loop {
        match reader.read_event() {
            Ok(Event::Start(element) | Event::Empty(element)) => match element.local_name().as_ref() {
                b"Image" => {
                    manifest.tile = number(&element, "TileSize")?;
                    manifest.overlap = number(&element, "Overlap")?;
                    manifest.extension = attribute(&element, "Format")?;
                }
                b"Size" => manifest.size = [number(&element, "Width")?, number(&element, "Height")?],
                _ => {}
            },
            Ok(Event::Eof) => break,
            Ok(_) => {}
            Err(error) => return Err(wrong(format!("is no XML: {error}"))),
        }
    }
    let Manifest { size, tile, overlap, extension } = &manifest;
    if extension.is_empty() || size.contains(&0) || size.iter().any(|n| *n > 1 << 31) {
        return Err(wrong("lacks an Image with a Format, or a Size of 1 to 2^31 texels".into()));
    }
    if extension.contains(['/', '\\', '.']) {
        return Err(wrong(format!("has the Format '{}', which is no file ending", extension.escape_debug())));
    }
    if *tile == 0 || *overlap > *tile || tile.saturating_add(overlap.saturating_mul(2)) > MAX_SIDE {
        return Err(wrong(format!(
            "has tiles of {tile} texels with an overlap of {overlap}; a tile has 1 to {MAX_SIDE}, an overlap no more than it"
        )));
    }
    Ok(manifest)
}

fn number(element: &BytesStart<'_>, name: &str) -> Result<u32, InputFault> {
    let text = attribute(element, name)?;
    text.trim().parse().map_err(|_| {
        let text = text.escape_debug();
        wrong(format!("has the {name} '{text}', which is no number of texels"))
    })
}

fn attribute(element: &BytesStart<'_>, name: &str) -> Result<String, InputFault> {
    let found = element.try_get_attribute(name).map_err(|error| wrong(format!("is no XML: {error}")))?;
    let found = found.ok_or_else(|| wrong(format!("has no {name}")))?;
    Ok(String::from_utf8_lossy(&found.value).into_owned())
}

fn wrong(why: String) -> InputFault {
    InputFault::layout(why, "correct the .dzi file, or make the image anew")
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "<?xml version=\"1.0\"?>\n<!-- <Image/> -->\n<dz:Image TileSize='254' xmlns:dz='urn:x' Overlap=\"1\" Format=\"png\"><dz:Size Height=\"200\" Width=\"300\"/></dz:Image>";

    #[test]
    fn a_manifest_in_any_order_and_namespace() {
        let manifest = Manifest { size: [300, 200], tile: 254, overlap: 1, extension: "png".into() };
        assert!(is_manifest(GOOD));
        assert_eq!(parse(GOOD).unwrap(), manifest);
        let grid = DeepZoom { manifest, tiles: "zoom_files".into(), finest: 9, levels: 10 };
        assert_eq!(grid.counts(), [2, 1]);
        assert_eq!((grid.piece(0, 0, 0).size, grid.piece(0, 0, 0).first), ([255, 200], [0, 0]));
        assert_eq!((grid.piece(0, 1, 0).size, grid.piece(0, 1, 0).first), ([47, 200], [1, 0]));
        let coarser = grid.piece(1, 0, 0);
        assert_eq!((coarser.path, coarser.size), ("zoom_files/8/0_0.png".into(), [150, 100]));
    }

    #[test]
    fn broken_manifests_say_what_is_wrong() {
        for (from, to, says) in [
            ("254", "0", "tiles of 0 texels"),
            ("254", "99999", "tiles of 99999 texels"),
            ("254", "-1", "TileSize '-1'"),
            ("TileSize", "Tile", "has no TileSize"),
            ("'254'", "'254", "no XML"),
            ("\"1\" ", "\"999\" ", "overlap of 999"),
            ("\"png\"", "\"../png\"", "no file ending"),
            ("\"300\"", "\"0\"", "lacks"),
            ("\"300\"", "\"99999999999\"", "no number"),
            ("Size ", "Seize ", "lacks"),
        ] {
            let text = GOOD.replace(from, to);
            let error = parse(&text).unwrap_err().to_string();
            assert!(error.contains(says), "{to}: {error}");
        }
        let largest = GOOD.replace("'254'", "'4294967295'").replace("\"1\" ", "\"4294967295\" ");
        assert!(parse(&largest).unwrap_err().to_string().contains("tiles of 4294967295 texels"));
    }
}
