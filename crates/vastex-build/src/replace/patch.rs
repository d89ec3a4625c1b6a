//! The texels of one level that a replacement holds: those that change, and around them those of which the
//! next level is made.

use std::ops::Range;

use super::spans::{Axis, Run, Spans};
use crate::texels::filter::Filter;
use crate::threads;

/// Texels of one level: some columns of some rows.
pub(super) struct Patch {
    pub(super) columns: Spans,
    pub(super) rows: Spans,
    texel: usize,
    bytes: Vec<u8>,
}

impl Patch {
    /// Black texels of `texel` bytes.
    pub(super) fn new([columns, rows]: [Spans; 2], texel: usize) -> Patch {
        let bytes = vec![0; columns.count() * rows.count() * texel];
        Patch { columns, rows, texel, bytes }
    }

    /// Bytes of a patch of so many texels.
    pub(super) fn bytes_of([columns, rows]: &[Spans; 2], texel: usize) -> u64 {
        (columns.count() as u64).saturating_mul(rows.count() as u64).saturating_mul(texel as u64)
    }

    fn row_bytes(&self) -> usize {
        self.columns.count() * self.texel
    }

    /// Where a range of one row lies, whose texels are all here.
    fn place(&self, y: u32, columns: &Range<u32>) -> Range<usize> {
        let found = self.rows.index_of(y).zip(self.columns.index_of(columns.start));
        let (row, column) = found.unwrap_or_default();
        debug_assert!(found.is_some(), "row {y}, columns {columns:?}");
        let start = row * self.row_bytes() + column * self.texel;
        start..start + columns.len() * self.texel
    }

    /// The texels of a range of one row, all of which are here, to be filled.
    pub(super) fn row_mut(&mut self, y: u32, columns: &Range<u32>) -> &mut [u8] {
        let place = self.place(y, columns);
        &mut self.bytes[place]
    }

    /// Makes the texels `changed` from those of the finer level, whose axes are `axes`. `color` is a texel of
    /// the border colour.
    pub(super) fn filter_from(
        &mut self,
        finer: &Patch,
        axes: [Axis; 2],
        changed: &[Spans; 2],
        filter: &Filter,
        color: &[u8],
    ) {
        let (row_bytes, texel) = (self.row_bytes(), self.texel);
        let (columns, rows) = (&self.columns, &self.rows);
        // For each range of columns, where its sources lie in a row of the finer patch.
        let sources = |range: &Range<u32>| {
            let source = |texel| axes[0].inside(texel).and_then(|texel| finer.columns.index_of(texel));
            (range.clone(), filter.reach.of_run(range).map(source).collect::<Vec<_>>())
        };
        let ranges: Vec<_> = changed[0].ranges().iter().map(sources).collect();
        let make = |(y, row): (u32, &mut [u8])| {
            for (range, sources) in &ranges {
                let fine_rows = filter.reach.of(y).map(|y| match axes[1].inside(y) {
                    Some(y) => finer.gather(y, sources, color),
                    None => color.repeat(sources.len()),
                });
                let fine_rows: Vec<Vec<u8>> = fine_rows.collect();
                let fine_rows: Vec<&[u8]> = fine_rows.iter().map(Vec::as_slice).collect();
                let start = columns.index_of(range.start).unwrap_or_default() * texel;
                filter.row(&mut row[start..start + range.len() * texel], &fine_rows);
            }
        };
        let rows = rows.texels().zip(self.bytes.chunks_exact_mut(row_bytes));
        threads::map(rows.filter(|(y, _)| changed[1].contains(*y)), 1, make);
    }

    /// Of one row the texels at these places, or the border colour.
    fn gather(&self, y: u32, places: &[Option<usize>], color: &[u8]) -> Vec<u8> {
        let start = self.rows.index_of(y).unwrap_or_default() * self.row_bytes();
        let row = &self.bytes[start..start + self.row_bytes()];
        let mut texels = Vec::with_capacity(places.len() * self.texel);
        for place in places {
            texels.extend_from_slice(place.map_or(color, |place| &row[place * self.texel..][..self.texel]));
        }
        texels
    }

    /// Copies what changes into a box of a tile: `at` is where it begins, in texels, `side` the tile's width.
    pub(super) fn paste(&self, tile: &mut [u8], side: usize, at: [usize; 2], runs: &[Vec<Run>; 2]) {
        let (row_bytes, texel) = (self.row_bytes(), self.texel);
        for rows in &runs[1] {
            for y in 0..rows.len {
                let from_row = &self.bytes[(rows.from + y) * row_bytes..][..row_bytes];
                let to_row = &mut tile[(at[1] + rows.to + y) * side * texel..][..side * texel];
                for run in &runs[0] {
                    let len = run.len * texel;
                    let from = &from_row[run.from * texel..][..len];
                    to_row[(at[0] + run.to) * texel..][..len].copy_from_slice(from);
                }
            }
        }
    }
}
