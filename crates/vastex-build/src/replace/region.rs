//! What an image changes of a level: texels, and the pages that it covers any of.

use std::ops::Range;
use std::path::Path;

use vastex_core::{Geometry, PagePos};

use super::spans::{Axis, Spans};

/// An image, and where it goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed<'a> {
    pub(crate) image: &'a Path,
    /// The level whose texels it has.
    pub(crate) level: u8,
    /// Column and row of that level at which it begins.
    pub(crate) at: [u32; 2],
}

/// What an image changes of one level.
pub(crate) struct Region {
    /// Columns and rows of the texels that change.
    pub(super) changed: [Spans; 2],
    /// Columns and rows of the texels that cover any of the image. A wide filter changes more, at a wrapping edge elsewhere.
    covered: [Range<u32>; 2],
}

impl Region {
    /// An image of `size` texels at `at`, on its own level; nothing where it reaches beyond the `level`'s texels.
    pub(super) fn new(at: [u32; 2], size: [u32; 2], level: [u32; 2]) -> Option<Region> {
        let end = [0, 1].map(|a| at[a].checked_add(size[a]).filter(|&end| end <= level[a]));
        let covered = [at[0]..end[0]?, at[1]..end[1]?];
        Some(Region { changed: covered.clone().map(Spans::one), covered })
    }

    /// What the image changes of the next level; `axes` are those of this one.
    pub(super) fn coarser(&self, axes: [Axis; 2]) -> Region {
        Region {
            changed: [0, 1].map(|a| axes[a].coarser(&self.changed[a])),
            covered: self.covered.clone().map(|texels| texels.start / 2..texels.end.div_ceil(2)),
        }
    }

    /// The pages of its level that show any of the image within their payload.
    pub(super) fn pages(&self, geometry: &Geometry, level: u8) -> PageBox {
        let [x, y, _] = geometry.page();
        let pages = |texels: &Range<u32>, page: u32| texels.start / page..texels.end.div_ceil(page);
        PageBox { level, columns: pages(&self.covered[0], x), rows: pages(&self.covered[1], y) }
    }
}

/// Pages of one level, in columns and rows.
#[derive(Clone, Debug)]
pub(super) struct PageBox {
    level: u8,
    pub(super) columns: Range<u32>,
    pub(super) rows: Range<u32>,
}

impl PageBox {
    pub(super) fn contains(&self, pos: PagePos) -> bool {
        pos.level == self.level && self.columns.contains(&pos.x) && self.rows.contains(&pos.y)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = PagePos> + '_ {
        self.rows
            .clone()
            .flat_map(move |y| self.columns.clone().map(move |x| PagePos::new_2d(self.level, x, y)))
    }
}
