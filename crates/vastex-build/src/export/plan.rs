//! What is to be written: for each level of the target the grid of its tiles, and which texels each holds.

use std::ops::Range;
use std::path::PathBuf;

use vastex_core::{Geometry, PagePos, PageSet};
use vastex_tiles::TileSource;

use super::level_rows::{Rectangle, StoredLevel, Window};
use super::resample::Resampled;
use crate::image::Notice;
use crate::tile::LayerOf;

/// A whole directory.
#[derive(Debug, Default)]
pub(super) struct Plan {
    /// Texels of the finest level.
    pub(super) size: [u32; 2],
    pub(super) levels: Vec<LevelPlan>,
    /// Files that describe the tiles: where, and what they say.
    pub(super) texts: Vec<(PathBuf, String)>,
    pub(super) notices: Vec<Notice>,
}

/// How far tiles reach into their neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// So many texels, but never beyond the level.
    Inner(u32),
    /// So many texels always; what lies beyond the level is made by its edge.
    Border(u32),
}

/// The tiles of one level.
#[derive(Clone, Debug)]
pub(super) struct LevelPlan {
    /// Where its files go, from the target on.
    pub(super) directory: PathBuf,
    /// What a file's name begins with.
    pub(super) prefix: String,
    /// The level of the texture from which the texels come.
    pub(super) level: u8,
    /// Size of that level.
    pub(super) stored: [u32; 2],
    /// Size to which it is resampled, or that of the texture's level.
    pub(super) size: [u32; 2],
    pub(super) columns: Range<u32>,
    pub(super) rows: Range<u32>,
    /// The texel at which the first column and row begin.
    pub(super) origin: [u32; 2],
    /// Texels from one tile to the next.
    pub(super) step: u32,
    pub(super) reach: Reach,
    /// True if the last column's neighbour is the first.
    pub(super) wraps: bool,
    /// True if a tile may be left out where the texture has none of its own.
    pub(super) may_lack_tiles: bool,
}

/// The first level of one texel; a layer of a fraction of the resolution has several.
pub(super) fn coarsest(geometry: &Geometry) -> u8 {
    let single = geometry.levels().iter().position(|level| level.size == [1; 3]);
    single.map_or(geometry.coarsest(), |level| level as u8)
}

impl LevelPlan {
    /// All texels of a level as they are, in tiles of `step` texels.
    pub(super) fn of_level(geometry: &Geometry, level: u8, step: u32, reach: Reach) -> LevelPlan {
        let [width, height, _] = geometry.level(level).size;
        LevelPlan {
            directory: PathBuf::new(),
            prefix: String::new(),
            level,
            stored: [width, height],
            size: [width, height],
            columns: 0..width.div_ceil(step),
            rows: 0..height.div_ceil(step),
            origin: [0; 2],
            step,
            reach,
            wraps: false,
            may_lack_tiles: false,
        }
    }

    /// The texels of one tile.
    pub(super) fn rectangle(&self, column: u32, row: u32) -> Rectangle {
        let at = [column - self.columns.start, row - self.rows.start];
        let span = [0, 1].map(|axis| {
            let start = i64::from(self.origin[axis]) + i64::from(at[axis]) * i64::from(self.step);
            let end = start + i64::from(self.step);
            match self.reach {
                Reach::Inner(n) => {
                    ((start - i64::from(n)).max(0), (end + i64::from(n)).min(self.size[axis].into()))
                }
                Reach::Border(n) => (start - i64::from(n), end + i64::from(n)),
            }
        });
        Rectangle {
            origin: span.map(|(start, _)| start),
            size: span.map(|(start, end)| (end - start) as u32),
        }
    }

    /// Returns true if the texture has tiles of its own where a tile of this level lies.
    pub(super) fn has_texels(&self, column: u32, row: u32, geometry: &Geometry, present: &PageSet) -> bool {
        if geometry.tail().first_level() <= self.level {
            return true;
        }
        let at = [column - self.columns.start, row - self.rows.start];
        let pages = [0, 1].map(|axis| {
            let (size, stored) = (u64::from(self.size[axis]), u64::from(self.stored[axis]));
            let start = u64::from(self.origin[axis]) + u64::from(at[axis]) * u64::from(self.step);
            let end = (start + u64::from(self.step)).min(size);
            let page = u64::from(geometry.page()[axis]);
            (start * stored / size / page) as u32..(end * stored).div_ceil(size).div_ceil(page) as u32
        });
        let [columns, mut rows] = pages;
        rows.any(|y| columns.clone().any(|x| present.contains(PagePos::new_2d(self.level, x, y))))
    }

    /// The rows of the level that a row of tiles needs.
    pub(super) fn texel_rows(&self, row: u32) -> Range<u32> {
        let Rectangle { origin: [_, y], size: [_, height] } = self.rectangle(self.columns.start, row);
        let last = i64::from(self.size[1]) - 1;
        let inside = |y: i64| y.clamp(0, last) as u32;
        inside(y)..inside(y + i64::from(height) - 1) + 1
    }

    /// The name of a tile's file.
    pub(super) fn name(&self, column: u32, row: u32, extension: &str) -> String {
        format!("{}{column}_{row}.{extension}", self.prefix)
    }

    /// The rows of the level, from the top.
    pub(super) fn window<'a>(&self, source: &'a dyn TileSource, layer: &'a LayerOf) -> Window<'a> {
        let stored = Window::new(Box::new(StoredLevel::new(source, layer, self.level)));
        if self.size == self.stored {
            return stored;
        }
        Window::new(Box::new(Resampled::new(stored, layer.format(), self.size)))
    }
}
