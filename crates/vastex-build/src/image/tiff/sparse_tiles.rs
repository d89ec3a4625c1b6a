//! A TIFF file of tiles at a share of its size, from some of its tiles: a quick first picture of an image
//! that has no coarser levels.
//!
//! Of every few columns and rows of tiles one is decoded, so few that this stays quick, several at once; the
//! texels between them are those of the nearest.

use std::cmp::Reverse;

use super::file::{TiffImage, codecs};
use crate::image::{ImageHeader, InputFault, PixelFormat, RowReader};
use crate::threads;

/// Bytes of tiles that are decoded, by all threads together, at most. That many are some tenths of a second.
const DECODED: u64 = 96 << 20;
/// How many times as long as others JPEG 2000 takes, about.
const JPEG_2000_TIMES: u64 = 16;
/// Tiles that are read, at most: on some disks each takes a while to find.
const MOST_TILES: u64 = 1024;
/// Tiles of which fewer are too few for a picture, unless they are all.
const LEAST_TILES: u64 = 8;

/// Rows of an image of tiles, one of every few.
pub(super) struct SparseTiles {
    image: TiffImage,
    format: PixelFormat,
    header: ImageHeader,
    /// Rows and columns of the image for one of these.
    step: u32,
    /// Of so many columns and of so many rows of tiles one is decoded.
    every: [u32; 2],
    next_row: u32,
    /// Rows of these that are put together, and the first of them.
    held: Vec<u8>,
    first_held: u32,
}

impl SparseTiles {
    /// An image of tiles at a share of its size, the longer side about `side` texels or somewhat more; `None`
    /// where it is not much larger, and where tiles are so large that too few can be decoded.
    pub(super) fn new(image: TiffImage, side: u32) -> Result<Option<SparseTiles>, InputFault> {
        let orientation = image.orientation as u16;
        let image = image.upright();
        let [width, height] = image.size;
        let step = width.max(height) / side.max(1);
        if step < 2 || !image.is_tiled {
            return Ok(None);
        }
        let mut header = image.header()?;
        header.orientation = orientation;
        let format = header.format;
        let Some(every) = every(&image) else { return Ok(None) };
        (header.width, header.height) = (width.div_ceil(step), height.div_ceil(step));
        Ok(Some(SparseTiles {
            image,
            format,
            header,
            step,
            every,
            next_row: 0,
            held: Vec::new(),
            first_held: 0,
        }))
    }

    /// The texel that is shown, along an axis, by the texel of these at a place: its tile, and where in that.
    fn source(&self, axis: usize, at: u32) -> [u32; 2] {
        let (side, tile) = (self.image.size[axis], self.image.chunk[axis]);
        let middle = u64::from(at) * u64::from(self.step) + u64::from(self.step) / 2;
        let middle = middle.min(u64::from(side) - 1) as u32;
        let number = middle / tile;
        let every = self.every[axis];
        let decoded = (number - number % every + every / 2).min((side - 1) / tile);
        // In the tile that is decoded the texel that is nearest.
        let first = decoded * tile;
        let last = first + (tile - 1).min(side - 1 - first);
        [decoded, middle.clamp(first, last) - first]
    }

    /// Puts together the rows whose texels are of the same tiles as those of a row, from that one on.
    fn hold(&mut self, row: u32) -> Result<(), InputFault> {
        let [tile_row, _] = self.source(1, row);
        let rows: Vec<usize> = (row..self.header.height)
            .map(|row| self.source(1, row))
            .take_while(|[tile, _]| *tile == tile_row)
            .map(|[_, within]| within as usize)
            .collect();
        let columns: Vec<[u32; 2]> = (0..self.header.width).map(|column| self.source(0, column)).collect();
        let cells: Vec<&[[u32; 2]]> = columns.chunk_by(|[one, _], [next, _]| one == next).collect();
        let texel = self.format.texel_bytes();
        // What is shown of a tile: of each row its texels, side by side.
        let shown = |cell: &[[u32; 2]]| -> Result<Vec<u8>, InputFault> {
            let tile = self.image.chunk_texels(cell[0][0], tile_row, self.format)?;
            let mut shown = Vec::with_capacity(rows.len() * cell.len() * texel);
            for row in &rows {
                for [_, within] in cell {
                    let at = (row * self.image.chunk[0] as usize + *within as usize) * texel;
                    shown.extend_from_slice(&tile[at..at + texel]);
                }
            }
            Ok(shown)
        };
        let parts = threads::try_map(cells.iter().copied(), shown)?;
        self.held.clear();
        self.held.resize(rows.len() * self.header.width as usize * texel, 0);
        self.first_held = row;
        let (mut first, row_bytes) = (0, self.header.row_bytes());
        for (cell, part) in cells.iter().zip(parts) {
            let bytes = cell.len() * texel;
            for (to, from) in self.held.chunks_exact_mut(row_bytes).zip(part.chunks_exact(bytes)) {
                to[first..first + bytes].copy_from_slice(from);
            }
            first += bytes;
        }
        Ok(())
    }
}

/// Of how many columns and of how many rows of tiles one is decoded; `None` if there are too few of them.
fn every(image: &TiffImage) -> Option<[u32; 2]> {
    let times = if codecs::is_jpeg_2000(image.compression) { JPEG_2000_TIMES } else { 1 };
    let most = (DECODED / image.chunk_bytes().saturating_mul(times).max(1)).min(MOST_TILES);
    every_of([image.columns(), image.rows()], image.chunk, most)
}

/// The same of so many columns and rows of tiles of a size, of which at most so many are decoded: those that
/// are decoded lie as near to each other as they can, and of as many ways to that the one with most tiles is
/// taken.
fn every_of([columns, rows]: [u32; 2], tile: [u32; 2], most: u64) -> Option<[u32; 2]> {
    let count =
        |[across, down]: [u32; 2]| u64::from(columns.div_ceil(across)) * u64::from(rows.div_ceil(down));
    let ways = (1..=most.min(columns.into())).map(|decoded| {
        let across = columns.div_ceil(decoded as u32);
        let rows_of_them = most / u64::from(columns.div_ceil(across));
        [across, u64::from(rows).div_ceil(rows_of_them) as u32]
    });
    let farthest = |every: [u32; 2]| (0..2).map(|axis| u64::from(every[axis]) * u64::from(tile[axis])).max();
    let every = ways.min_by_key(|every| (farthest(*every), Reverse(count(*every))))?;
    (every == [1, 1] || count(every) >= LEAST_TILES).then_some(every)
}

impl RowReader for SparseTiles {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let row_bytes = self.header.row_bytes();
        for to in rows.chunks_exact_mut(row_bytes) {
            let in_held = (self.next_row - self.first_held) as usize * row_bytes;
            if self.held.len() <= in_held {
                self.hold(self.next_row)?;
            }
            let in_held = (self.next_row - self.first_held) as usize * row_bytes;
            to.copy_from_slice(&self.held[in_held..in_held + row_bytes]);
            self.next_row += 1;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As many as tiles of 1024x1024 texels leave, of RGB in 8 and in 16 bits.
    #[test]
    fn every_grid_of_tiles_has_a_quick_picture() {
        let count = |[columns, rows]: [u32; 2], every: [u32; 2]| {
            u64::from(columns.div_ceil(every[0]) * rows.div_ceil(every[1]))
        };
        for most in [16, 24, 32] {
            for grid in (1..=58).flat_map(|columns| (1..=58).map(move |rows| [columns, rows])) {
                let every = every_of(grid, [256; 2], most).unwrap_or_else(|| panic!("{grid:?} of {most}"));
                let decoded = count(grid, every);
                assert!(decoded <= most, "{grid:?}: {decoded} of {most}");
                let [near, far] = [every[0].min(every[1]), every[0].max(every[1])];
                let is_narrow = grid[0].min(grid[1]) < 2 * far;
                assert!(far <= 2 * near || is_narrow, "{grid:?}: of {every:?} one");
            }
        }
        assert_eq!(every_of([4, 8], [256; 2], 32), Some([1, 1]));
        assert_eq!(every_of([33, 33], [256; 2], 32), Some([7, 6]));
        assert_eq!(every_of([8, 32], [512, 128], 64), Some([1, 4]), "as near across as down");
        // Of few tiles all are decoded, or there are too few.
        assert_eq!(every_of([2, 2], [4096; 2], 4), Some([1, 1]));
        assert_eq!(every_of([3, 3], [4096; 2], 4), None);
        assert_eq!(every_of([3, 3], [4096; 2], 0), None);
    }
}
