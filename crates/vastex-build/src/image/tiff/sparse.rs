//! A TIFF file of strips at a share of its size, from some of its strips: a quick first picture of an image
//! that may be large.
//!
//! Of every few rows one is read, and of its texels every few; where strips must be decoded to read a row,
//! only so many strips are that this stays quick, and the rows between them are those of the nearest.

use super::{Access, TiffReader};
use crate::image::{ImageHeader, InputFault, RowReader};

/// Bytes of rows that are decoded, at most. That many are some tenths of a second of one core.
const DECODED: u64 = 96 << 20;
/// Bytes that reading may take, a row included: a first picture is asked for of any file, however wide.
const MOST_MEMORY: u64 = 256 << 20;
/// Strips of which fewer are too few for a picture.
const LEAST_BANDS: u64 = 32;

/// Rows that may be read in any order.
pub(in crate::image) trait AnyRows: RowReader {
    /// The next row that is read is this one. To be called where there is no help.
    fn go_to(&mut self, row: u32);
}

/// How a row of strips is come to.
#[derive(Clone, Copy, Debug)]
pub(super) enum Strips {
    /// By itself, where it lies.
    Plain,
    /// By decoding its strip, of so many rows, which has so many bytes then.
    Decoded { rows: u32, bytes: u64 },
}

/// Rows of an image, one of every few.
pub(in crate::image) struct SparseReader {
    reader: Box<dyn AnyRows>,
    header: ImageHeader,
    /// Rows and columns of the image for one of these.
    step: u32,
    /// Rows of a strip.
    rows: u32,
    /// Of so many strips one is decoded; 0 where rows are read without that.
    every: u32,
    next_row: u32,
    row: Vec<u8>,
}

impl TiffReader {
    /// The image at a share of its size, as [`SparseReader::new`] has it.
    pub(in crate::image) fn sparse(self, side: u32) -> Option<SparseReader> {
        if !self.has_strips {
            return None;
        }
        let strips = match &self.access {
            Access::Raw(_) => Strips::Plain,
            Access::Streamed(rows) if rows.is_plain() => Strips::Plain,
            // Rows come as soon as they are decoded.
            Access::Streamed(_) => return None,
            Access::Decoded(_) => {
                let rows = self.chunks.rows.clamp(1, self.header.height);
                let bytes = u64::from(rows).saturating_mul(self.header.row_bytes() as u64);
                Strips::Decoded { rows, bytes }
            }
        };
        SparseReader::new(Box::new(self), strips, side)
    }
}

/// Of how many strips one is decoded, for one row in every `step`; `None` if there are too few of them.
fn every(rows: u32, bytes: u64, [step, height]: [u32; 2]) -> Option<u32> {
    let bands = u64::from(height.div_ceil(rows));
    // No more than there are rows for.
    let wanted = u64::from(height.div_ceil(step)).min(bands);
    let most = DECODED / bytes.max(1);
    // All of a file of which nearly all strips are wanted comes as quickly by itself.
    let read = wanted.min(most).min(bands / 2);
    (read >= LEAST_BANDS).then(|| if read == wanted { 1 } else { bands.div_ceil(read) as u32 })
}

impl SparseReader {
    /// An image at a share of its size, the longer side about `side` texels or somewhat more; `None` where
    /// that is no quicker than to read all of it: in images that are not much larger, and where strips are so
    /// long that too few can be decoded; and where a row is so long that it takes too much memory.
    pub(super) fn new(reader: Box<dyn AnyRows>, strips: Strips, side: u32) -> Option<SparseReader> {
        let mut header = reader.header().clone();
        let step = header.width.max(header.height) / side.max(1);
        let row_bytes = header.row_bytes();
        if step < 2 || header.memory.saturating_add(row_bytes as u64) > MOST_MEMORY {
            return None;
        }
        let (rows, every) = match strips {
            Strips::Plain => (1, 0),
            Strips::Decoded { rows, bytes } => (rows, every(rows, bytes, [step, header.height])?),
        };
        (header.width, header.height) = (header.width.div_ceil(step), header.height.div_ceil(step));
        Some(SparseReader { reader, header, step, rows, every, next_row: 0, row: vec![0; row_bytes] })
    }

    /// The row of the image that is shown as a row.
    fn source(&self, row: u32) -> u32 {
        let height = self.reader.header().height;
        let middle =
            (u64::from(row) * u64::from(self.step) + u64::from(self.step) / 2).min(u64::from(height) - 1);
        if self.every == 0 {
            return middle as u32;
        }
        let rows = self.rows;
        let strip = middle as u32 / rows;
        let last = (height - 1) / rows;
        let decoded = (strip - strip % self.every + self.every / 2).min(last);
        // In the strip that is decoded the row that is nearest.
        let first = decoded * rows;
        (middle as u32).clamp(first, (first + rows - 1).min(height - 1))
    }
}

impl RowReader for SparseReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let texel = self.header.format.texel_bytes();
        let mut shown = None;
        for row in rows.chunks_exact_mut(self.header.row_bytes()) {
            let source = self.source(self.next_row);
            if shown != Some(source) {
                self.reader.go_to(source);
                self.reader.read_rows(&mut self.row)?;
                shown = Some(source);
            }
            let last = self.reader.header().width - 1;
            for (column, to) in (0..).zip(row.chunks_exact_mut(texel)) {
                let from = (column * self.step + self.step / 2).min(last) as usize * texel;
                to.copy_from_slice(&self.row[from..from + texel]);
            }
            self.next_row += 1;
        }
        Ok(())
    }
}
