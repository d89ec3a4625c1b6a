//! Rows of a TIFF file that come while a strip is decoded, from its first byte on: where the image is one
//! strip, or strips are so large that none should be held.
//!
//! Nothing is decoded ahead, and nothing held but a row and what the decoder must remember. Strips that are
//! decoded as a whole, several at once, are [`super::chunks`]'.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::sync::Arc;

use super::chunks::Chunks;
use super::file::{TiffImage, codecs};
use super::samples::place_row;
use crate::image::InputFault;
use crate::image::positioned::Positioned;

/// Bytes of a decoded strip, beyond which it is not held as a whole.
const MOST_HELD: u64 = 64 << 20;
/// Bytes that are read of the file at once.
const BUFFER_BYTES: usize = 256 << 10;

/// Rows of an image that a decoder of JPEG holds about.
const JPEG_ROWS: u64 = 64;

/// The bytes of a strip.
fn stored_strip(file: &Arc<File>, at: u64, len: u64) -> io::Result<BufReader<io::Take<Positioned>>> {
    let mut file = Positioned::new(file.clone());
    file.seek(SeekFrom::Start(at))?;
    Ok(BufReader::with_capacity(BUFFER_BYTES, file.take(len)))
}

/// The rows of a file whose strips are decoded as they are read.
pub(super) struct StreamedRows {
    image: TiffImage,
    chunks: Arc<Chunks>,
    file: Arc<File>,
    /// The strip of each plane that is being read; none where its first row comes next.
    strips: Vec<Strip>,
    next_row: u32,
    /// A row of a plane, as it is stored.
    stored: Vec<u8>,
    /// True if a number was too large to stay exact.
    pub(super) rounded: bool,
}

/// A strip that is being decoded.
struct Strip {
    decoder: Box<dyn Read + Send>,
    /// Bytes of it that were decoded.
    decoded: u64,
    /// True if the file ends before it.
    is_cut: bool,
}

impl StreamedRows {
    /// Returns true if an image has strips that can be decoded from the top, and are better not held. Looks
    /// at how each of them begins, where they are JPEG.
    pub(super) fn can_be_of(image: &TiffImage, chunks: &Chunks, file: &Arc<File>) -> bool {
        let is_large = chunks.rows >= image.size[1] || chunks.decoded_bytes() > MOST_HELD;
        let has_lengths = image.compression == codecs::NONE || chunks.are_all_stored();
        let has_rows = |strip: u32| {
            let (at, len) = chunks.stored(0, strip * chunks.rows);
            let stored = stored_strip(file, at, len);
            stored.is_ok_and(|stored| image.has_rows(stored, image.chunk_rows(strip)))
        };
        let is_jpeg = image.compression == codecs::JPEG;
        !image.is_tiled
            && is_large
            && has_lengths
            && (codecs::is_stream(image.compression) || is_jpeg)
            && chunks.is_of(image)
            && (!is_jpeg || (0..image.rows()).all(has_rows))
    }

    /// The rows of an image [of the kind](StreamedRows::can_be_of).
    pub(super) fn new(image: TiffImage, chunks: &Arc<Chunks>, file: &Arc<File>) -> StreamedRows {
        let stored = vec![0; chunks.stored_row(image.samples_of_chunk())];
        let (chunks, file) = (chunks.clone(), file.clone());
        StreamedRows { image, chunks, file, strips: Vec::new(), next_row: 0, stored, rounded: false }
    }

    /// Bytes that reading takes.
    pub(super) fn memory(&self) -> u64 {
        let window = match self.image.compression {
            codecs::JPEG => JPEG_ROWS * self.stored.len() as u64,
            other => codecs::window(other, self.chunks.decoded_bytes()),
        };
        let strip = window + BUFFER_BYTES as u64;
        u64::from(self.chunks.planes_read()) * strip + 2 * self.stored.len() as u64
    }

    /// Returns true if a row can be read without those before it.
    pub(super) fn is_plain(&self) -> bool {
        self.image.compression == codecs::NONE
    }

    /// The next row that is read is this one.
    pub(super) fn go_to(&mut self, row: u32) {
        if row != self.next_row {
            self.strips.clear();
            self.next_row = row;
        }
    }

    /// Fills `rows` with the next ones.
    pub(super) fn read(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        for row in rows.chunks_exact_mut(self.chunks.row_bytes()) {
            if self.strips.is_empty() {
                self.begin_strip()?;
            }
            self.read_row(row)?;
            self.next_row += 1;
            if self.next_row.is_multiple_of(self.chunks.rows) || self.next_row == self.image.size[1] {
                self.end_strip()?;
            }
        }
        Ok(())
    }

    /// Bytes of the strip of a plane that holds the next row.
    fn strip_bytes(&self) -> u64 {
        let strip = self.next_row / self.chunks.rows;
        u64::from(self.image.chunk_rows(strip)) * self.stored.len() as u64
    }

    /// Begins to read the strip that holds the next row, from there on.
    fn begin_strip(&mut self) -> Result<(), InputFault> {
        let (row, all) = (self.next_row, self.strip_bytes());
        let before = u64::from(row % self.chunks.rows) * self.stored.len() as u64;
        for plane in 0..self.chunks.planes_read() {
            let (mut at, mut len) = self.chunks.stored(plane, row);
            if self.is_plain() {
                // Some writers state no length, or that of the whole file.
                (at, len) = (at.saturating_add(before), all - before);
            }
            let is_cut = at.checked_add(len).is_none_or(|end| end > self.chunks.file_len());
            let rows = self.image.chunk_rows(row / self.chunks.rows);
            let decoder = self.image.rows_of(stored_strip(&self.file, at, len)?, rows);
            let decoder = decoder.map_err(|why| match is_cut {
                true => InputFault::Truncated { place: self.chunks.place(row) },
                false => self.damaged(why),
            })?;
            let mut strip = Strip { decoder, decoded: before, is_cut };
            if !self.is_plain() && before > 0 {
                let passed = io::copy(&mut (&mut strip.decoder).take(before), &mut io::sink());
                if passed.is_err() || passed.is_ok_and(|passed| passed < before) {
                    return Err(self.damaged("its data ends or makes no sense before this row".into()));
                }
            }
            self.strips.push(strip);
        }
        Ok(())
    }

    /// Reads the next row, of all planes.
    fn read_row(&mut self, row: &mut [u8]) -> Result<(), InputFault> {
        let format = self.chunks.format();
        let (texel, sample) = (format.texel_bytes(), format.sample());
        let (unit, stored_unit) = self.chunks.unit();
        let stored_texel = self.image.samples_of_chunk() * self.image.number.bytes();
        let is_row = self.chunks.are_rows() && stored_unit == stored_texel;
        for plane in 0..self.strips.len() {
            if is_row {
                self.fill(plane, row)?;
                self.image.shown_row(row);
                continue;
            }
            let mut stored = std::mem::take(&mut self.stored);
            let filled = self.fill(plane, &mut stored);
            self.stored = stored;
            filled?;
            self.image.shown_row(&mut self.stored);
            if cfg!(target_endian = "big") {
                self.stored.chunks_exact_mut(self.image.number.bytes()).for_each(<[u8]>::reverse);
            }
            let texels = row.chunks_exact_mut(texel).zip(self.stored.chunks_exact(stored_texel));
            for (to, from) in texels {
                let to = [&mut to[plane * unit..][..unit]];
                self.rounded |= place_row(to.into_iter(), &from[..stored_unit], self.chunks.stored, sample);
            }
        }
        if cfg!(target_endian = "big") && !is_row {
            row.chunks_exact_mut(sample.bytes()).for_each(<[u8]>::reverse);
        }
        Ok(())
    }

    /// Decodes the next row of a plane.
    fn fill(&mut self, plane: usize, row: &mut [u8]) -> Result<(), InputFault> {
        let all = self.strip_bytes();
        let strip = &mut self.strips[plane];
        let why = match codecs::fill(&mut *strip.decoder, row) {
            Ok(filled) if filled == row.len() => {
                strip.decoded += filled as u64;
                return Ok(());
            }
            Ok(filled) => codecs::too_little(strip.decoded + filled as u64, all),
            Err((filled, error)) => codecs::after(strip.decoded + filled as u64, all, &error),
        };
        // What is plain and ends too early does so with the file.
        match strip.is_cut || self.is_plain() {
            true => Err(InputFault::Truncated { place: self.chunks.place(self.next_row) }),
            false => Err(self.damaged(why)),
        }
    }

    /// The last row of a strip was read: nothing may follow, but for what fills the last strip up.
    fn end_strip(&mut self) -> Result<(), InputFault> {
        let row = self.next_row - 1;
        let strip = row / self.chunks.rows;
        let rows = self.image.chunk_rows(strip);
        let spare = u64::from(self.image.chunk[1] - rows) * self.stored.len() as u64;
        let wanted = u64::from(rows) * self.stored.len() as u64;
        for mut strip in self.strips.drain(..) {
            codecs::check_end(&mut *strip.decoder, wanted, spare)
                .map_err(|why| InputFault::Damaged { place: self.chunks.place(row), why })?;
        }
        Ok(())
    }

    fn damaged(&self, why: String) -> InputFault {
        InputFault::Damaged { place: self.chunks.place(self.next_row), why }
    }
}
