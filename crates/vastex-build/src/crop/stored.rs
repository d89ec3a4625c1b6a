//! What regions are cut from: one level, any rectangle of it.

use super::CropError;
use crate::image::Number;
use crate::image::stored_as::StoredAs;
use crate::progress::Progress;

/// One level of something, as it is stored.
pub(super) trait Stored {
    /// Columns and rows, at least 1 each.
    fn size(&self) -> [u32; 2];

    /// What its numbers are.
    fn number(&self) -> Number;

    /// Numbers of a texel, at least 1.
    fn channels(&self) -> u16;

    /// What the numbers of a texel stand for.
    fn stored_as(&self) -> StoredAs {
        StoredAs::ByCount
    }

    /// Rows that are read together without decoding anything twice, from a row on, at least 1.
    fn rows_together(&self, row: u32) -> u32;

    /// Says what a person should know before anything is read.
    fn tell(&self, progress: &dyn Progress) {
        let _ = progress;
    }

    /// Does a part of what must be done before a row can be read, and returns true if that was the last. Asks
    /// `progress` where that takes long.
    fn approach(&mut self, row: u32, progress: &dyn Progress) -> Result<bool, CropError> {
        let _ = (row, progress);
        Ok(true)
    }

    /// Fills `texels` with rows of a rectangle, which lies within the level: each call below the one before,
    /// the first where [`Stored::approach`] has come to. Asks `progress` where that takes long.
    fn read(
        &mut self,
        first: [u32; 2],
        size: [u32; 2],
        texels: &mut [u8],
        progress: &dyn Progress,
    ) -> Result<(), CropError>;
}

/// Rows from one that lies at `row` up to the end of its cell.
pub(super) fn up_to_next(row: u32, cell: u32) -> u32 {
    cell - row % cell
}

/// One cell of a level and the part of it that lies in a rectangle.
pub(super) struct Part {
    /// The cell's column and row.
    pub(super) cell: [u32; 2],
    /// The part's first texel, in the cell and in the rectangle.
    pub(super) within: [u32; 2],
    pub(super) to: [u32; 2],
    pub(super) size: [u32; 2],
}

/// The cells that a rectangle overlaps, row by row.
pub(super) fn parts(first: [u32; 2], size: [u32; 2], cell: [u32; 2]) -> Vec<Part> {
    let range = |axis: usize| first[axis] / cell[axis]..=(first[axis] + size[axis] - 1) / cell[axis];
    let part = |cell_at: [u32; 2]| {
        let begin = [0, 1].map(|axis| first[axis].max(cell_at[axis] * cell[axis]));
        let end = [0, 1].map(|axis| {
            (u64::from(first[axis]) + u64::from(size[axis]))
                .min((u64::from(cell_at[axis]) + 1) * u64::from(cell[axis])) as u32
        });
        Part {
            cell: cell_at,
            within: [0, 1].map(|axis| begin[axis] - cell_at[axis] * cell[axis]),
            to: [0, 1].map(|axis| begin[axis] - first[axis]),
            size: [0, 1].map(|axis| end[axis] - begin[axis]),
        }
    };
    range(1).flat_map(|row| range(0).map(move |column| [column, row])).map(part).collect()
}

/// Copies a part out of a cell's rows of `stride` texels into a rectangle's rows of `width` texels.
pub(super) fn copy(
    part: &Part,
    cell: &[u8],
    stride: usize,
    origin: [u32; 2],
    texels: &mut [u8],
    width: u32,
    texel: usize,
) {
    let bytes = part.size[0] as usize * texel;
    for row in 0..part.size[1] as usize {
        let from = (origin[1] + part.within[1]) as usize + row;
        let from = (from * stride + (origin[0] + part.within[0]) as usize) * texel;
        let to = ((part.to[1] as usize + row) * width as usize + part.to[0] as usize) * texel;
        texels[to..to + bytes].copy_from_slice(&cell[from..from + bytes]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_a_rectangle_once() {
        let (first, size, cell) = ([5, 13], [21, 9], [8, 4]);
        let mut seen = vec![0; 21 * 9];
        for part in parts(first, size, cell) {
            for y in 0..part.size[1] {
                for x in 0..part.size[0] {
                    let in_level = [0, 1].map(|axis| part.cell[axis] * cell[axis] + part.within[axis]);
                    assert_eq!([in_level[0] + x, in_level[1] + y], [5 + part.to[0] + x, 13 + part.to[1] + y]);
                    seen[((part.to[1] + y) * 21 + part.to[0] + x) as usize] += 1;
                }
            }
        }
        assert!(seen.iter().all(|count| *count == 1));
    }
}
