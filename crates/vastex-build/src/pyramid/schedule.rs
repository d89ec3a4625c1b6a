//! Rows of pages of one level: in which order they are cut, and which rows each of them needs.
//!
//! Bands are cut from the top as soon as their last row is there. Where the vertical edge wraps, the first
//! band needs the level's last rows and so is cut last (with others, where they show rows that are made
//! last), and the last bands need the level's first rows, which are held until then. Where the edge mirrors,
//! the last band looks back one band further.

use vastex_core::{AddressMode, Geometry, PagePos, fold, is_border_color};

use super::rows::RowOrder;

/// The bands of one level finer than the tail.
pub(crate) struct Schedule<'a> {
    geometry: &'a Geometry,
    level: u8,
    order: RowOrder,
    /// Bands at the top that are cut last.
    late: u32,
    /// Bands cut so far.
    cut: u32,
    /// Rows that must be filled before the next band can be cut.
    next_needs: u32,
}

impl<'a> Schedule<'a> {
    /// `order` is that in which the level's rows are made, `late` at least [`late_bands`].
    pub(crate) fn new(geometry: &'a Geometry, level: u8, order: RowOrder, late: u32) -> Schedule<'a> {
        let mut bands = Schedule { geometry, level, order, late, cut: 0, next_needs: 0 };
        bands.next_needs = bands.rows_needed();
        bands
    }

    /// Rows at the top of the level that must be kept to its end.
    pub(crate) fn head_rows(geometry: &Geometry, level: u8, late: u32) -> u32 {
        let shown = u64::from(late) * u64::from(geometry.page()[1]) + u64::from(geometry.border()[1]);
        match geometry.address()[1] {
            AddressMode::Wrap => shown.min(geometry.level(level).size[1].into()) as u32,
            AddressMode::Clamp | AddressMode::Mirror | AddressMode::Border => 0,
        }
    }

    /// Returns true if there is a next band, and `filled` rows are enough for it.
    pub(crate) fn is_ready(&self, filled: u32) -> bool {
        self.cut < self.count() && filled >= self.next_needs
    }

    /// The band that comes next, if `filled` rows are enough for it; it counts as cut from here on.
    pub(crate) fn next(&mut self, filled: u32) -> Option<u32> {
        if !self.is_ready(filled) {
            return None;
        }
        let band = self.band_at(self.cut);
        self.cut += 1;
        self.next_needs = self.rows_needed();
        Some(band)
    }

    /// The rows of the level along a tile of a band, from the tile's first row to its last; `None` if the
    /// border colour stands.
    pub(crate) fn rows(geometry: &Geometry, level: u8, band: u32) -> impl Iterator<Item = Option<u32>> {
        let (mode, height) = (geometry.address()[1], geometry.level(level).size[1]);
        let rows = geometry.level_box_of_tile(PagePos::new_2d(level, 0, band));
        (0..i64::from(rows.size[1])).map(move |i| row_at(mode, rows.origin[1] + i, height))
    }

    /// The first row, but for the head, that a band still to be cut needs.
    pub(crate) fn keep_from(&self) -> u32 {
        let (count, head) = (self.count(), Schedule::head_rows(self.geometry, self.level, self.late));
        // Bands in between need later rows than the next one; only those at the edges look back.
        let edges = count.saturating_sub(self.late + 3)..count;
        [self.cut, self.cut + 1]
            .into_iter()
            .chain(edges)
            .filter(|turn| (self.cut..count).contains(turn))
            .flat_map(|turn| Schedule::rows(self.geometry, self.level, self.band_at(turn)))
            .flatten()
            .filter(|&row| row >= head)
            .min()
            .unwrap_or(u32::MAX)
    }

    fn count(&self) -> u32 {
        self.geometry.level(self.level).pages[1]
    }

    fn band_at(&self, turn: u32) -> u32 {
        ((u64::from(turn) + u64::from(self.late)) % u64::from(self.count())) as u32
    }

    fn rows_needed(&self) -> u32 {
        if self.cut == self.count() {
            return u32::MAX;
        }
        let rows = Schedule::rows(self.geometry, self.level, self.band_at(self.cut)).flatten();
        rows.map(|row| self.order.rank(row) + 1).max().unwrap_or(0)
    }
}

/// The row inside the level that stands at `y`; `None` if the border colour does.
pub(crate) fn row_at(mode: AddressMode, y: i64, height: u32) -> Option<u32> {
    (!is_border_color(mode, y, height)).then(|| fold(mode, y, height))
}

/// Bands at the top that can only be cut when a level is complete, where up to `first` of its rows are made
/// last.
pub(crate) fn late_bands(geometry: &Geometry, first: u32) -> u32 {
    match geometry.address()[1] {
        AddressMode::Wrap => (first + geometry.border()[1]).div_ceil(geometry.page()[1]).max(1),
        AddressMode::Clamp | AddressMode::Mirror | AddressMode::Border => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use vastex_core::GeometrySpec;

    fn image(height: u32, page: u32, border: u32, mode: AddressMode) -> Geometry {
        let spec = GeometrySpec { page, border, address: [mode; 3], ..GeometrySpec::image(5000, height) };
        Geometry::new(spec).unwrap()
    }

    #[test]
    fn where_the_edge_wraps_the_first_band_comes_last() {
        for (mode, order) in [
            (AddressMode::Clamp, [(0, 36), (1, 68), (2, 100), (3, 100)]),
            (AddressMode::Wrap, [(1, 68), (2, 100), (3, 100), (0, 100)]),
        ] {
            let geometry = image(100, 32, 4, mode);
            let mut bands = Schedule::new(&geometry, 0, RowOrder::from_top(100), late_bands(&geometry, 0));
            for (band, needs) in order {
                assert_eq!(bands.next(needs - 1), None);
                assert_eq!(bands.next(needs), Some(band));
            }
            assert_eq!(bands.next(u32::MAX), None);
        }
    }

    proptest! {
        #[test]
        fn no_band_needs_a_row_that_may_be_forgotten(
            height in 1u32..700, page in 8u32..60, share in 0u32..100, first in 0u32..6, more in 0u32..2,
            mode in prop::sample::select(vec![
                AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border,
            ]),
        ) {
            let geometry = image(height, page, 1 + (page / 2 - 1) * share / 100, mode);
            let first = if mode == AddressMode::Wrap && first < height { first } else { 0 };
            let order = RowOrder { height, first };
            let late = late_bands(&geometry, first) + if mode == AddressMode::Wrap { more } else { 0 };
            let mut bands = Schedule::new(&geometry, 0, order, late);
            let head = Schedule::head_rows(&geometry, 0, late);
            let (mut keep, mut cut) = (bands.keep_from(), 0);
            for filled in 1..=height {
                while let Some(band) = bands.next(filled) {
                    for row in Schedule::rows(&geometry, 0, band).flatten() {
                        prop_assert!(
                            order.rank(row) < filled && (row < head || row >= keep),
                            "band {} row {}", band, row
                        );
                    }
                    cut += 1;
                }
                prop_assert!(bands.keep_from() >= keep);
                keep = bands.keep_from();
            }
            prop_assert_eq!(cut, geometry.level(0).pages[1]);
        }
    }
}
