//! Rows of pages of one level: in which order they are cut, and which rows each of them needs.
//!
//! Bands are cut from the top as soon as their last row is there. Where the vertical edge wraps, the first band
//! needs the level's last rows and so is cut last, and the last bands need the level's first rows, which are held
//! until then. Where the edge mirrors, the last band looks back one band further.

use vastex_core::{AddressMode, Geometry, PagePos, fold};

/// The bands of one level finer than the tail.
pub(crate) struct Bands<'a> {
    geometry: &'a Geometry,
    level: u8,
    /// Bands cut so far.
    cut: u32,
    /// Rows that must be filled before the next band can be cut.
    next_needs: u32,
}

impl<'a> Bands<'a> {
    pub(crate) fn new(geometry: &'a Geometry, level: u8) -> Bands<'a> {
        let mut bands = Bands { geometry, level, cut: 0, next_needs: 0 };
        bands.next_needs = bands.rows_needed();
        bands
    }

    /// Rows at the top of the level that must be kept to its end.
    pub(crate) fn head_rows(geometry: &Geometry, level: u8) -> u32 {
        match geometry.address()[1] {
            AddressMode::Wrap => geometry.level(level).size[1].min(geometry.page()[1] + geometry.border()[1]),
            AddressMode::Clamp | AddressMode::Mirror | AddressMode::Border => 0,
        }
    }

    /// The band that comes next, if `filled` rows are enough for it; it counts as cut from here on.
    pub(crate) fn next(&mut self, filled: u32) -> Option<u32> {
        if self.cut == self.count() || filled < self.next_needs {
            return None;
        }
        let band = self.band_at(self.cut);
        self.cut += 1;
        self.next_needs = self.rows_needed();
        Some(band)
    }

    /// The rows of the level along a tile of a band, from the tile's first row to its last.
    pub(crate) fn rows(geometry: &Geometry, level: u8, band: u32) -> impl Iterator<Item = u32> {
        let (mode, height) = (geometry.address()[1], geometry.level(level).size[1]);
        let rows = geometry.level_box_of_tile(PagePos::new_2d(level, 0, band));
        (0..i64::from(rows.size[1])).map(move |i| fold(mode, rows.origin[1] + i, height))
    }

    /// The first row, but for the head, that a band still to be cut needs.
    pub(crate) fn keep_from(&self) -> u32 {
        let (count, head) = (self.count(), Bands::head_rows(self.geometry, self.level));
        // Bands in between need later rows than the next one; only those at the edges look back.
        [self.cut, self.cut + 1, count.saturating_sub(3), count.saturating_sub(2), count.saturating_sub(1)]
            .into_iter()
            .filter(|turn| (self.cut..count).contains(turn))
            .flat_map(|turn| Bands::rows(self.geometry, self.level, self.band_at(turn)))
            .filter(|&row| row >= head)
            .min()
            .unwrap_or(u32::MAX)
    }

    fn count(&self) -> u32 {
        self.geometry.level(self.level).pages[1]
    }

    fn band_at(&self, turn: u32) -> u32 {
        match self.geometry.address()[1] {
            AddressMode::Wrap => (turn + 1) % self.count(),
            AddressMode::Clamp | AddressMode::Mirror | AddressMode::Border => turn,
        }
    }

    fn rows_needed(&self) -> u32 {
        if self.cut == self.count() {
            return u32::MAX;
        }
        let last = Bands::rows(self.geometry, self.level, self.band_at(self.cut)).max();
        last.map_or(0, |row| row + 1)
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
            let mut bands = Bands::new(&geometry, 0);
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
            height in 1u32..700, page in 8u32..60, share in 0u32..100,
            mode in prop::sample::select(vec![AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror]),
        ) {
            let geometry = image(height, page, 1 + (page / 2 - 1) * share / 100, mode);
            let mut bands = Bands::new(&geometry, 0);
            let head = Bands::head_rows(&geometry, 0);
            let (mut keep, mut cut) = (bands.keep_from(), 0);
            for filled in 1..=height {
                while let Some(band) = bands.next(filled) {
                    for row in Bands::rows(&geometry, 0, band) {
                        prop_assert!(row < filled && (row < head || row >= keep), "band {} row {}", band, row);
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
