//! Trees of planet tiles, two square roots side by side, as Gaia Sky and Celestia read them.
//!
//! Level `l` has `2 * 2^(base + l)` columns and half as many rows; level 0 is the coarsest, column 0 west,
//! row 0 north. Levels may be partial: where a tile is missing, its nearest ancestor's texels stand in, each
//! for a square of texels, so that filtering makes that ancestor again.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use vastex_core::{Geometry, PagePos, PageSet};

use super::tile::{Decoded, Piece, header_of, in_tile};
use super::{Grid, Texels, entries};
use crate::image::{InputFault, Notice, PixelFormat};

/// Levels that Gaia Sky reads; more than Celestia's.
const MAX_LEVELS: u32 = 15;

/// Share of the difference across a seam of stock tiles that bordered tiles may show where they should agree.
const BORDER_SHARE: u64 = 3;

/// The files of one level, by column and row.
pub(super) type Tiles = HashMap<(u32, u32), PathBuf>;

/// A tree of tiles of one size.
pub(super) struct Quadtree {
    levels: BTreeMap<u32, Tiles>,
    /// The grid of level 0 has `2 * 2^base` columns.
    base: u32,
    finest: u32,
    /// Texels per side of a file, and of the border within it.
    side: u32,
    border: u32,
}

impl Quadtree {
    /// A tree that was listed, whose tiles have so many texels per side. Every tile of level 0 must be there.
    pub(super) fn new(
        directory: &Path,
        levels: BTreeMap<u32, Tiles>,
        base: u32,
        sides: std::ops::RangeInclusive<u32>,
    ) -> Result<Quadtree, InputFault> {
        let (Some(roots), Some((&finest, _))) = (levels.get(&0), levels.last_key_value()) else {
            return Err(InputFault::Layout {
                why: "has no level 0, the root of the tree".into(),
                remedy: "add the coarsest tiles, which every program needs",
            });
        };
        for column in 0..2 << base {
            for row in 0..1 << base {
                if !roots.contains_key(&(column, row)) {
                    return Err(InputFault::Layout {
                        why: format!("lacks the root tile of column {column}, row {row} in level 0"),
                        remedy: "add it: what is missing elsewhere is taken from the roots",
                    });
                }
            }
        }
        for (level, tiles) in &levels {
            check_inside(base + level, tiles)?;
        }
        let first = &roots[&(0, 0)];
        let header = header_of(first)?;
        let side = header.width;
        if header.height != side || !side.is_power_of_two() || !sides.contains(&side) {
            let (low, high) = (sides.start(), sides.end());
            let why = format!(
                "has {side}x{} texels; a tile is a square of {low} to {high}, a power of two",
                header.height
            );
            return Err(in_tile(first, InputFault::layout(why, "cut the image anew")));
        }
        if u64::from(side) << (base + finest + 1) > 1 << 31 {
            let why = format!("has a level {finest} of more than 2^31 texels: {}", directory.display());
            return Err(InputFault::layout(why, "remove the finest levels"));
        }
        Ok(Quadtree { levels, base, finest, side, border: 0 })
    }

    /// Looks at the two roots: bordered tiles repeat each other's texels across a seam, stock ones do not.
    pub(super) fn find_border(&mut self, format: PixelFormat) -> Result<(), InputFault> {
        let mut roots = [Decoded::default(), Decoded::default()];
        for (column, root) in (0..).zip(&mut roots) {
            root.load(&self.piece_at(column, 0, 0), format)?;
        }
        let bytes = format.texel_bytes();
        let last = self.side - 1;
        let differ = |(a, x): (&Decoded, u32), (b, u): (&Decoded, u32)| -> u64 {
            let texels = (0..self.side).map(|y| (a.texel(x, y, bytes), b.texel(u, y, bytes)));
            texels.flat_map(|(a, b)| a.iter().zip(b)).map(|(a, b)| u64::from(a.abs_diff(*b))).sum()
        };
        let [west, east] = &roots;
        let seams = [(west, east), (east, west)];
        let stock: u64 = seams.iter().map(|(a, b)| 2 * differ((a, last), (b, 0))).sum();
        let bordered: u64 =
            seams.iter().map(|(a, b)| differ((a, last - 1), (b, 0)) + differ((a, last), (b, 1))).sum();
        self.border = u32::from(self.side > 2 && bordered.saturating_mul(BORDER_SHARE) < stock);
        Ok(())
    }

    /// As a grid of cells, with what is worth telling.
    pub(super) fn into_grid(self, mut notices: Vec<Notice>) -> (Box<dyn Grid>, Vec<Notice>) {
        let present = self.levels[&self.finest].len() as u64;
        let of = self.columns() * self.rows();
        let missing = of - present;
        if self.border > 0 {
            notices.push(Notice::BorderedTiles);
        }
        if missing > 0 {
            notices.push(Notice::TilesFromAncestors { missing, of });
        }
        (Box::new(self), notices)
    }

    /// The format that all tiles share, as far as a sample tells.
    pub(super) fn texels(&self) -> Result<Texels, InputFault> {
        let mut sample: Vec<&PathBuf> = self.levels[&0].values().collect();
        for tiles in self.levels.values() {
            sample.extend(tiles.values().step_by(tiles.len().div_ceil(16)));
        }
        super::shared_texels(sample.into_iter().map(PathBuf::as_path))
    }

    fn columns(&self) -> u64 {
        2 << (self.base + self.finest)
    }

    fn rows(&self) -> u64 {
        1 << (self.base + self.finest)
    }

    fn payload(&self) -> u32 {
        self.side - 2 * self.border
    }

    /// Where a cell of `level` comes from: its own tile, or the nearest ancestor's.
    fn piece_at(&self, column: u32, row: u32, level: u32) -> Piece {
        let payload = u64::from(self.payload());
        let found = (0..=level).find_map(|shift| {
            let tiles = self.levels.get(&(level - shift))?;
            Some((shift, tiles.get(&(column >> shift, row >> shift))?))
        });
        // The roots were found to be there.
        let (shift, path) = found.map_or((0, PathBuf::new()), |(shift, path)| (shift, path.clone()));
        let within = [column, row].map(|n| u64::from(n & ((1 << shift) - 1)) * payload);
        Piece { path, size: [self.side; 2], first: [self.border; 2], within, shift }
    }
}

impl Grid for Quadtree {
    fn size(&self) -> [u64; 2] {
        [self.columns(), self.rows()].map(|n| n * u64::from(self.payload()))
    }

    fn cell(&self) -> u32 {
        self.payload()
    }

    fn levels(&self) -> u32 {
        self.finest + 1
    }

    fn present(&self, geometry: &Geometry) -> Option<PageSet> {
        if self.levels[&self.finest].len() as u64 == self.columns() * self.rows() {
            return None;
        }
        let mut set = PageSet::new(geometry);
        let (page, payload) = (geometry.page(), u64::from(self.payload()));
        for (level, tiles) in &self.levels {
            // The levels of a texture are numbered from the finest.
            let ours = (self.finest - level) as u8;
            if ours >= geometry.tail().first_level() {
                continue;
            }
            for &(column, row) in tiles.keys() {
                let along = |n: u32, axis: usize| {
                    let (first, end) = (u64::from(n) * payload, u64::from(n + 1) * payload);
                    (first / u64::from(page[axis])) as u32..end.div_ceil(u64::from(page[axis])) as u32
                };
                for y in along(row, 1) {
                    along(column, 0).for_each(|x| set.insert(geometry, PagePos::new_2d(ours, x, y)));
                }
            }
        }
        Some(set)
    }

    fn piece(&self, level: u32, column: u32, row: u32) -> Piece {
        self.piece_at(column, row, self.finest - level)
    }
}

/// The number of a level's directory, and whether its name is one that a tool wrote by mistake: `level055`
/// for `level05`.
pub(super) fn level_number(name: &str) -> Option<(u32, bool)> {
    let digits = name.strip_prefix("level").unwrap_or(name);
    if digits.is_empty() || !digits.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    if digits.len() <= 2 {
        return Some((digits.parse().ok()?, false));
    }
    // Two digits with zeros, and the number once more behind them.
    let (padded, again) = digits.split_at_checked(2)?;
    let number: u32 = padded.parse().ok()?;
    (name.starts_with("level") && again == number.to_string()).then_some((number, true))
}

/// The directories of levels in `directory`, by number, and whether any was misnamed.
pub(super) fn level_directories(
    directory: &Path,
) -> Result<(BTreeMap<u32, PathBuf>, Vec<Notice>), InputFault> {
    let (mut levels, mut notices) = (BTreeMap::new(), Vec::new());
    for path in entries(directory)? {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_number = super::number(name.strip_prefix("level").unwrap_or(&name)).is_some();
        if !is_number || !path.is_dir() {
            continue;
        }
        let Some((level, misnamed)) = level_number(&name) else {
            notices.push(Notice::IgnoredLevel(name.into_owned()));
            continue;
        };
        if level >= MAX_LEVELS {
            let why = format!("has a directory '{name}'; levels are numbered 0 to {}", MAX_LEVELS - 1);
            return Err(InputFault::layout(why, "remove or rename it"));
        }
        if misnamed {
            notices.push(Notice::MisnamedLevel { name: name.to_string(), level });
        }
        if let Some(other) = levels.insert(level, path.clone()) {
            let other = other.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let why = format!("has two directories for level {level}: '{other}' and '{name}'");
            return Err(InputFault::layout(why, "remove one of them"));
        }
    }
    Ok((levels, notices))
}

fn check_inside(depth: u32, tiles: &Tiles) -> Result<(), InputFault> {
    let (columns, rows) = (2u32 << depth, 1u32 << depth);
    match tiles.iter().find(|((column, row), _)| *column >= columns || *row >= rows) {
        None => Ok(()),
        Some((_, path)) => {
            let why = format!("lies outside its level's grid of {columns}x{rows} tiles");
            Err(in_tile(path, InputFault::layout(why, "move it to the level where it belongs, or remove it")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_levels() {
        for (name, level) in [("level0", 0), ("level00", 0), ("7", 7), ("07", 7), ("level12", 12)] {
            assert_eq!(level_number(name), Some((level, false)), "{name}");
        }
        assert_eq!(level_number("level055"), Some((5, true)));
        assert_eq!(level_number("level1111"), Some((11, true)));
        for name in ["", "level", "level056", "levels0", "055", "level-1", "level0a", "level123456"] {
            assert_eq!(level_number(name), None, "{name}");
        }
    }
}
