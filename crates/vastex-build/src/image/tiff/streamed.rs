//! Rows of a TIFF file that come while a strip is decoded, as the samples that are shown: those of
//! [`StripRows`], for files that need nothing else. Strips that are decoded as a whole, several at once, are
//! [`super::chunks`]'.

use std::sync::Arc;

use super::chunks::Chunks;
use super::file::TiffImage;
use super::file::strip_rows::StripRows;
use super::samples::place_row;
use crate::image::InputFault;

/// The rows of a file whose strips are decoded as they are read.
pub(super) struct StreamedRows {
    rows: StripRows,
    chunks: Arc<Chunks>,
    /// A row of a plane, as it is stored.
    stored: Vec<u8>,
    /// True if a number was too large to stay exact.
    pub(super) rounded: bool,
}

impl StreamedRows {
    /// Returns true if an image has strips that can be decoded from the top, and are better not held. Looks
    /// at how each of them begins, where they are JPEG.
    pub(super) fn can_be_of(image: &TiffImage, chunks: &Chunks) -> bool {
        image.has_large_strips() && chunks.is_of(image) && image.has_streams()
    }

    /// The rows of an image [of the kind](StreamedRows::can_be_of).
    pub(super) fn new(image: TiffImage, chunks: &Arc<Chunks>) -> StreamedRows {
        let rows = StripRows::of_planes(image, (0..chunks.planes_read()).collect());
        StreamedRows { rows, chunks: chunks.clone(), stored: Vec::new(), rounded: false }
    }

    /// Bytes that reading takes.
    pub(super) fn memory(&self) -> u64 {
        self.rows.memory()
    }

    /// Returns true if a row can be read without those before it.
    pub(super) fn is_plain(&self) -> bool {
        self.rows.image().is_plain()
    }

    /// The next row that is read is this one.
    pub(super) fn go_to(&mut self, row: u32) {
        self.rows.be_sparse();
        self.rows.go_to(row);
    }

    /// Fills `rows` with the next ones.
    pub(super) fn read(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        for row in rows.chunks_exact_mut(self.chunks.row_bytes()) {
            if let Err(fault) = self.read_next(row) {
                self.rows.forget();
                return Err(fault);
            }
        }
        Ok(())
    }

    fn read_next(&mut self, row: &mut [u8]) -> Result<(), InputFault> {
        self.rows.begin()?;
        self.read_row(row)?;
        self.rows.end()
    }

    /// Reads the next row, of all planes.
    fn read_row(&mut self, row: &mut [u8]) -> Result<(), InputFault> {
        let format = self.chunks.format();
        let (texel, sample) = (format.texel_bytes(), format.sample());
        let (unit, stored_unit) = self.chunks.unit();
        let stored_sample = self.rows.image().number.bytes();
        let stored_texel = self.rows.image().samples_of_chunk() * stored_sample;
        let is_row = self.chunks.are_rows() && stored_unit == stored_texel;
        for plane in 0..self.rows.planes() {
            if is_row {
                self.rows.fill(plane, row)?;
                self.rows.image().shown_row(row);
                continue;
            }
            self.stored.resize(self.chunks.stored_row(self.rows.image().samples_of_chunk()), 0);
            self.rows.fill(plane, &mut self.stored)?;
            self.rows.image().shown_row(&mut self.stored);
            if cfg!(target_endian = "big") {
                self.stored.chunks_exact_mut(stored_sample).for_each(<[u8]>::reverse);
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
}
