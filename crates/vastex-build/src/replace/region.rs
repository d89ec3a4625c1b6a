//! What an image changes of a level: texels, and the pages that it covers any of.

use std::ops::Range;
use std::path::Path;

use vastex_core::{AddressMode, Geometry, PagePos};

use super::spans::{Axis, Spans};

/// An image, and where it goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed<'a> {
    pub(crate) image: &'a Path,
    /// Number of the layer.
    pub(crate) layer: usize,
    /// The level whose texels it has.
    pub(crate) level: u8,
    /// Column and row of that level of the layer at which it begins.
    pub(crate) at: [u32; 2],
}

/// Columns, or rows, of an image and of the level on which they lie.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Strip {
    /// The first one of the image.
    pub(super) from: u32,
    pub(super) to: Range<u32>,
}

/// Where `len` columns or rows of an image lie, from `at` on, in a level of `size`: across a wrapping edge
/// they go on at 0. `None` if they reach beyond the level, or round it onto themselves.
pub(super) fn strips(at: u32, len: u32, size: u32, mode: AddressMode) -> Option<Vec<Strip>> {
    let end = at.checked_add(len).filter(|_| at < size && len <= size)?;
    if end <= size {
        return Some(vec![Strip { from: 0, to: at..end }]);
    }
    let beyond = Strip { from: size - at, to: 0..end - size };
    (mode == AddressMode::Wrap).then(|| vec![Strip { from: 0, to: at..size }, beyond])
}

/// What an image changes of one level.
#[derive(Clone, Debug)]
pub(super) struct Region {
    /// Columns and rows of the texels that change.
    pub(super) changed: [Spans; 2],
    /// Columns and rows of the texels that cover any of the image. A wide filter changes more, at a wrapping
    /// edge elsewhere.
    covered: [Spans; 2],
}

impl Region {
    /// An image on its own level.
    pub(super) fn new(strips: &[Vec<Strip>; 2]) -> Region {
        let covered = [0, 1].map(|a| Spans::new(strips[a].iter().map(|strip| strip.to.clone())));
        Region { changed: covered.clone(), covered }
    }

    /// What the image changes of the next level; `axes` are those of this one.
    pub(super) fn coarser(&self, axes: [Axis; 2]) -> Region {
        Region {
            changed: [0, 1].map(|a| axes[a].coarser(&self.changed[a])),
            covered: [0, 1].map(|a| self.covered[a].in_units(2)),
        }
    }

    /// The pages of its level that show any of the image within their payload.
    pub(super) fn pages(&self, geometry: &Geometry, level: u8) -> PageBox {
        let [columns, rows] = [0, 1].map(|a| self.covered[a].in_units(geometry.page()[a]));
        PageBox { level, columns, rows }
    }
}

/// Pages of one level: columns times rows.
#[derive(Clone, Debug)]
pub(super) struct PageBox {
    level: u8,
    pub(super) columns: Spans,
    pub(super) rows: Spans,
}

impl PageBox {
    pub(super) fn contains(&self, pos: PagePos) -> bool {
        pos.level == self.level && self.columns.contains(pos.x) && self.rows.contains(pos.y)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = PagePos> + '_ {
        self.rows
            .texels()
            .flat_map(move |y| self.columns.texels().map(move |x| PagePos::new_2d(self.level, x, y)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_wrapping_edge_is_crossed() {
        let strip = |from, to| Strip { from, to };
        assert_eq!(strips(90, 20, 100, AddressMode::Wrap), Some(vec![strip(0, 90..100), strip(10, 0..10)]));
        assert_eq!(strips(90, 10, 100, AddressMode::Wrap), Some(vec![strip(0, 90..100)]));
        assert_eq!(strips(30, 100, 100, AddressMode::Wrap), Some(vec![strip(0, 30..100), strip(70, 0..30)]));
        for (at, len) in [(30, 101), (100, 1), (u32::MAX, 1), (1, u32::MAX)] {
            assert_eq!(strips(at, len, 100, AddressMode::Wrap), None, "{at} {len}");
        }
        for mode in [AddressMode::Clamp, AddressMode::Mirror, AddressMode::Border] {
            assert_eq!(strips(90, 20, 100, mode), None);
            assert_eq!(strips(0, 100, 100, mode), Some(vec![strip(0, 0..100)]));
        }
    }
}
