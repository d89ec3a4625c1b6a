//! Decodes one strip or tile: read at its place, decompressed to exactly the bytes that it must have, put in
//! order.

use std::io::{BufRead, Read};

use super::image::{TiffImage, YCBCR};
use super::{codecs, damaged, fax4, jpeg2000, predictor};
use crate::image::jpeg::part;
use crate::image::jpeg::part_rows::{self, PartRows, PartShape};
use crate::image::tiff::samples::most_from_a_byte;
use crate::image::{InputFault, PixelFormat};

/// Bytes by which a stored strip or tile may be longer than it is decoded, and how many times as long.
const SPARE_STORED: u64 = 1 << 20;
const TIMES_STORED: u64 = 4;

/// Lengths of strips or tiles of which the longest is looked up, at most.
const MOST_LOOKED_UP: u64 = 1 << 16;

/// Values of Predictor.
const HORIZONTAL: u64 = 2;
const FLOATING: u64 = 3;

impl TiffImage {
    /// Rows of a strip or tile of that row: of the last strip as many as there are.
    pub(crate) fn chunk_rows(&self, row: u32) -> u32 {
        match self.is_tiled {
            true => self.chunk[1],
            false => self.chunk[1].min(self.size[1] - row * self.chunk[1]),
        }
    }

    /// A strip or tile as it is stored but decoded: rows of `chunk[0]` texels, channels side by side, samples
    /// little-endian. Colours of JPEG are RGB. `column` and `row` lie within the image. Takes
    /// [`TiffImage::bytes_to_show`] at most, which callers compare with what they may take.
    pub(crate) fn stored_chunk(&self, column: u32, row: u32) -> Result<Vec<u8>, InputFault> {
        if !self.is_planar {
            return self.plane_of_chunk(0, column, row);
        }
        let sample = self.number.bytes();
        let mut texels = vec![0; self.chunk_bytes() as usize];
        for plane in 0..self.planes() {
            let found = self.plane_of_chunk(plane, column, row)?;
            let first = plane as usize * sample;
            let targets = texels.chunks_exact_mut(self.texel_bytes());
            for (to, from) in targets.zip(found.chunks_exact(sample)) {
                to[first..first + sample].copy_from_slice(from);
            }
        }
        texels.truncate(self.chunk_rows(row) as usize * self.chunk[0] as usize * self.texel_bytes());
        Ok(texels)
    }

    /// Bytes that it takes, at most, to make texels of `format` of a strip or tile, the texels included.
    pub(in crate::image::tiff) fn bytes_to_show(&self, format: PixelFormat) -> u64 {
        let texels = u64::from(self.chunk[0]).saturating_mul(self.chunk[1].into());
        let packed = self.packed_row().saturating_mul(self.chunk[1].into());
        let plane = texels.saturating_mul((self.samples_of_chunk() * self.number.bytes()) as u64);
        // What decoders hold of all of it beside what they give out: coefficients, or floats.
        let within = match self.compression {
            codecs::JPEG => plane.saturating_mul(2),
            other if codecs::is_jpeg_2000(other) => plane.saturating_mul(8),
            _ => 0,
        };
        let unpacked = if self.has_few_bits() { plane } else { 0 };
        // Planes are put beside one another as they come.
        let beside = if self.is_planar { self.chunk_bytes() } else { 0 };
        let decoding = [self.longest(packed), packed, within, unpacked, beside];
        let picked = self.pick.as_ref().map_or(0, |pick| pick.bands.len() * self.number.bytes());
        let shown = if self.is_shown_as_stored(format) { 0 } else { format.texel_bytes() };
        let converting = [self.chunk_bytes(), texels.saturating_mul((picked + shown) as u64)];
        let [decoding, converting] =
            [&decoding[..], &converting].map(|all| all.iter().copied().fold(0u64, u64::saturating_add));
        decoding.max(converting)
    }

    /// Bytes of the longest strip or tile as it is stored, or of more, where one has so many once it is
    /// decompressed. What claims more than the file has is never read.
    fn longest(&self, packed: u64) -> u64 {
        if self.compression == codecs::NONE {
            return packed;
        }
        let most = packed.saturating_mul(TIMES_STORED).saturating_add(SPARE_STORED);
        let listed = self.lengths.filter(|list| list.count <= MOST_LOOKED_UP);
        let lengths = listed.and_then(|list| self.file.all_values(&list, &self.place).ok());
        let longest = lengths.and_then(|lengths| lengths.into_iter().max()).unwrap_or(most);
        longest.min(most).min(self.file.len())
    }

    /// One plane of a strip or tile, or all of it where channels lie side by side.
    pub(super) fn plane_of_chunk(&self, plane: u32, column: u32, row: u32) -> Result<Vec<u8>, InputFault> {
        let index = self.index(plane, column, row);
        let what = if self.is_tiled { "tile" } else { "strip" };
        let place = format!("{}, {what} {index}", self.place);
        let rows = self.chunk_rows(row);
        let wanted = self.packed_row() as usize * rows as usize;
        let (offset, len) = self.stored_at([plane, column, row], &place)?;
        let len = len.unwrap_or(wanted as u64);
        if (offset, len) == (0, 0) || (len == 0 && self.compression != codecs::NONE) {
            let texels = self.chunk[0] as usize * rows as usize;
            return Ok(self.not_stored(texels * self.samples_of_chunk() * self.number.bytes()));
        }
        // Of what is not compressed some writers state no length, or that of the whole file.
        let len = if self.compression == codecs::NONE { wanted as u64 } else { len };
        let most = (wanted as u64).saturating_mul(TIMES_STORED).saturating_add(SPARE_STORED);
        if len > most && len <= self.file.len() {
            return Err(damaged(&place, format!("it has {len} bytes for {wanted}")));
        }
        if wanted as u64 > len.saturating_mul(most_from_a_byte(self.compression as u16)) {
            return Err(damaged(&place, format!("it has {len} bytes, which cannot hold {wanted}")));
        }
        let stored = self.file.bytes(offset, len, &place)?;
        let decoded = self.decode(&stored, rows, wanted).map_err(|why| damaged(&place, why))?;
        Ok(if self.has_few_bits() { self.unpacked(&decoded) } else { decoded })
    }

    /// The number of a strip or tile among those that the file lists.
    fn index(&self, plane: u32, column: u32, row: u32) -> u64 {
        let [columns, rows] = [self.columns(), self.rows()].map(u64::from);
        u64::from(plane) * columns * rows + u64::from(row) * columns + u64::from(column)
    }

    /// Where a strip or tile of a plane, a column and a row lies in the file, and how many bytes it has where
    /// the file says so.
    pub(super) fn stored_at(
        &self,
        [plane, column, row]: [u32; 3],
        place: &str,
    ) -> Result<(u64, Option<u64>), InputFault> {
        let listed = if self.is_cut { plane.into() } else { self.index(plane, column, row) };
        let offset = self.file.value(&self.offsets, listed, place)?;
        let len = self.lengths.as_ref().map(|list| self.file.value(list, listed, place)).transpose()?;
        let within = u64::from(row) * u64::from(self.chunk[1]) * self.packed_row();
        Ok((offset.saturating_add(if self.is_cut { within } else { 0 }), len))
    }

    /// What a strip of so many rows is, where strips are JPEG.
    fn part_shape(&self, rows: u32) -> PartShape {
        let channels = self.samples_of_chunk();
        let is_ycbcr = self.photometric == YCBCR && channels == 3;
        let size = [self.chunk[0], rows];
        PartShape { size, most_rows: self.chunk[1], channels: channels as u8, is_ycbcr }
    }

    /// Returns true if the rows of a strip of so many come while it is decoded.
    pub(in crate::image::tiff) fn has_rows(&self, mut stored: impl BufRead, rows: u32) -> bool {
        match self.compression {
            codecs::JPEG => part_rows::has_rows(&self.tables, &mut stored, &self.part_shape(rows)),
            codecs::FAX4 => true,
            other => codecs::is_stream(other),
        }
    }

    /// A strip of so many rows, decompressed as it is read, where [`TiffImage::has_rows`]; else says what is
    /// wrong with it.
    pub(in crate::image::tiff) fn rows_of(
        &self,
        stored: impl BufRead + Send + 'static,
        rows: u32,
    ) -> Result<Box<dyn Read + Send>, String> {
        match self.compression {
            codecs::JPEG => Ok(Box::new(PartRows::new(&self.tables, stored, &self.part_shape(rows))?)),
            codecs::FAX4 => {
                Ok(Box::new(fax4::FaxRows::new(stored, [self.chunk[0], rows], self.is_reversed)?))
            }
            other => codecs::reader(other, stored),
        }
    }

    fn decode(&self, stored: &[u8], rows: u32, wanted: usize) -> Result<Vec<u8>, String> {
        let size = [self.chunk[0], rows];
        let channels = self.samples_of_chunk();
        match self.compression {
            codecs::JPEG => {
                let PartShape { most_rows, channels, is_ycbcr, .. } = self.part_shape(rows);
                return part::decode(&self.tables, stored, size, most_rows, channels, is_ycbcr);
            }
            _ if codecs::is_jpeg_2000(self.compression) => {
                let is_said = match self.compression {
                    codecs::APERIO_YCBCR => true,
                    codecs::APERIO_RGB => false,
                    _ => self.photometric == YCBCR,
                };
                let is_ycbcr = channels == 3 && is_said;
                return jpeg2000::decode(stored, size, channels, self.number.bytes(), is_ycbcr);
            }
            codecs::FAX4 => return fax4::decode(stored, size, self.is_reversed),
            _ => {}
        }
        let row_bytes = self.packed_row() as usize;
        // Some writers fill up the last strip.
        let spare = (self.chunk[1] - rows) as usize * row_bytes;
        let mut bytes = vec![0; wanted];
        codecs::decode(self.compression, stored, &mut bytes, spare)?;
        bytes.chunks_exact_mut(row_bytes).for_each(|row| self.put_in_order(row));
        Ok(bytes)
    }

    /// Undoes what was done to a row of a strip or tile, of all its channels or of one, before it was
    /// compressed: samples are little-endian afterwards.
    pub(super) fn put_in_order(&self, row: &mut [u8]) {
        // Their decoders know of pixels: libtiff does not follow a predictor there either.
        if matches!(self.compression, codecs::JPEG | codecs::FAX4) {
            return;
        }
        let (channels, sample) = (self.samples_of_chunk(), self.number.bytes());
        // Without compression nothing is predicted, whatever the tag says.
        let predictor = if self.compression == codecs::NONE { 1 } else { self.predictor };
        match predictor {
            FLOATING => predictor::floating(row, channels, sample),
            _ => predictor::in_order(row, sample, self.file.is_big_endian),
        }
        if predictor == HORIZONTAL {
            predictor::horizontal(row, channels, sample);
        }
    }

    /// What stands in the place of a strip or tile that a sparse file leaves out, as GDAL has it.
    fn not_stored(&self, bytes: usize) -> Vec<u8> {
        let value = self.number.of(self.nodata.unwrap_or(0.0));
        let mut texels = vec![0; bytes];
        texels.chunks_exact_mut(value.len()).for_each(|sample| sample.copy_from_slice(&value));
        texels
    }
}
