//! A TIFF file of tiles at a share of its size, from some of its tiles: a quick first picture of an image
//! that has no coarser levels.
//!
//! Of every few columns and rows of tiles one is decoded, so few that this stays quick, several at once; the
//! texels between them are those of the nearest.

use std::panic::resume_unwind;
use std::thread;

use super::file::{TiffImage, codecs};
use crate::image::{ImageHeader, InputFault, PixelFormat, RowReader};

/// Bytes of tiles that a thread decodes, at most. That many are some tenths of a second.
const DECODED: u64 = 96 << 20;
/// How many times as long as others JPEG 2000 takes, about.
const JPEG_2000_TIMES: u64 = 16;
/// Tiles that are read, at most: on some disks each takes a while to find.
const MOST_TILES: u64 = 1024;
/// Tiles of which fewer are too few for a picture, unless they are all.
const LEAST_TILES: u64 = 32;
/// Threads that decode, at most.
const MOST_THREADS: usize = 4;

/// Rows of an image of tiles, one of every few.
pub(super) struct SparseTiles {
    image: TiffImage,
    format: PixelFormat,
    header: ImageHeader,
    /// Rows and columns of the image for one of these.
    step: u32,
    /// Of so many columns and of so many rows of tiles one is decoded.
    every: u32,
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
        let decoded = (number - number % self.every + self.every / 2).min((side - 1) / tile);
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
        let parts = each_made(cells.len(), &|n| shown(cells[n]));
        self.held.clear();
        self.held.resize(rows.len() * self.header.width as usize * texel, 0);
        self.first_held = row;
        let (mut first, row_bytes) = (0, self.header.row_bytes());
        for (cell, part) in cells.iter().zip(parts) {
            let (part, bytes) = (part?, cell.len() * texel);
            for (to, from) in self.held.chunks_exact_mut(row_bytes).zip(part.chunks_exact(bytes)) {
                to[first..first + bytes].copy_from_slice(from);
            }
            first += bytes;
        }
        Ok(())
    }
}

/// What `make` makes of each of so many, in their order, several at once.
fn each_made<R: Send>(count: usize, make: &(dyn Fn(usize) -> R + Sync)) -> Vec<R> {
    let threads = thread::available_parallelism().map_or(1, usize::from).min(MOST_THREADS).min(count);
    if threads < 2 {
        return (0..count).map(make).collect();
    }
    let made: Vec<Vec<R>> = thread::scope(|scope| {
        let share = |first: usize| (first..count).step_by(threads).map(make).collect();
        // What no thread can be started for, this one makes.
        let begin = |first: usize| {
            thread::Builder::new().spawn_scoped(scope, move || share(first)).map_err(|_| first)
        };
        let begun: Vec<_> = (1..threads).map(begin).collect();
        let own = share(0);
        let rest = begun.into_iter().map(|share_of| match share_of {
            Ok(thread) => thread.join().unwrap_or_else(|panic| resume_unwind(panic)),
            Err(first) => share(first),
        });
        std::iter::once(own).chain(rest).collect()
    });
    let mut shares: Vec<_> = made.into_iter().map(Vec::into_iter).collect();
    (0..count).filter_map(|n| shares[n % threads].next()).collect()
}

/// Of how many columns, and of how many rows of tiles one is decoded; `None` if there are too few of them.
fn every(image: &TiffImage) -> Option<u32> {
    let times = if codecs::is_jpeg_2000(image.compression) { JPEG_2000_TIMES } else { 1 };
    let most = (DECODED / image.chunk_bytes().saturating_mul(times).max(1)).min(MOST_TILES);
    let decoded =
        |every: u32| [image.columns(), image.rows()].map(|n| u64::from(n.div_ceil(every))).iter().product();
    let every = (1..=image.columns().max(image.rows())).find(|every| decoded(*every) <= most)?;
    let count: u64 = decoded(every);
    (every == 1 || count >= LEAST_TILES).then_some(every)
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
