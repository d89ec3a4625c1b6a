//! Rows of an image of strips that come while a strip is decoded, from its first byte on: where the image is
//! one strip, or strips are so large that none should be held.
//!
//! Nothing is decoded ahead, and nothing held but a row and what decoders must remember. Rows are given out
//! as they are stored; what is shown of them is the business of whoever reads.

use std::io::{self, BufReader, Read, Seek, SeekFrom};

use super::{TiffImage, codecs, damaged};
use crate::image::InputFault;
use crate::image::fault::near_row;
use crate::image::positioned::Positioned;
use crate::image::tiff::samples::most_from_a_byte;

/// Bytes of a decoded strip, beyond which it is not held as a whole.
const MOST_HELD: u64 = 64 << 20;
/// Bytes that are read of the file at once.
const BUFFER_BYTES: u64 = 256 << 10;
/// Rows of an image that a decoder of JPEG holds about.
const JPEG_ROWS: u64 = 64;
/// Strips that are looked up before the first row, at most.
const MOST_LOOKED_UP: u64 = 1 << 22;

/// The rows of an image whose strips are decoded as they are read, from the top down.
pub(crate) struct StripRows {
    image: TiffImage,
    /// The planes that are read; the first alone where channels lie side by side.
    planes: Vec<u32>,
    /// The samples of a texel that are given out where channels lie side by side; `None` for all of them.
    bands: Option<Vec<u16>>,
    /// The strip of each plane that is being read; none where its first row comes next.
    strips: Vec<Strip>,
    next_row: u32,
    /// True if rows are gone to one by one.
    is_sparse: bool,
    /// A row of a plane, decompressed but as it was before that.
    packed: Vec<u8>,
}

/// A strip that is being decoded.
struct Strip {
    decoder: Box<dyn Read + Send>,
    /// Bytes of it that were decoded.
    decoded: u64,
    /// True if the file ends before it.
    is_cut: bool,
}

impl TiffImage {
    /// Returns true if all of its rows come while its strips are decoded. Looks at how each of them begins,
    /// where they are JPEG.
    pub(crate) fn has_streams(&self) -> bool {
        let is_known =
            codecs::is_stream(self.compression) || matches!(self.compression, codecs::JPEG | codecs::FAX4);
        let begins_well = |plane: u32, strip: u32| {
            let stored = self.stored_strip(plane, strip);
            stored.is_ok_and(|stored| self.has_rows(stored, self.chunk_rows(strip)))
        };
        !self.is_tiled
            && is_known
            && self.are_all_stored()
            && (self.compression != codecs::JPEG
                || (0..self.planes()).all(|plane| (0..self.rows()).all(|strip| begins_well(plane, strip))))
    }

    /// Returns true if its strips, where it has any, are better not held.
    pub(in crate::image::tiff) fn has_large_strips(&self) -> bool {
        !self.is_tiled && (self.chunk[1] >= self.size[1] || self.chunk_bytes() > MOST_HELD)
    }

    /// Returns true if a row of its strips can be read without those before it.
    pub(crate) fn is_plain(&self) -> bool {
        self.compression == codecs::NONE
    }

    /// Returns true if none of its strips is left out of the file.
    fn are_all_stored(&self) -> bool {
        let longest = self.lengths.iter().map(|list| list.count).fold(self.offsets.count, u64::max);
        if longest > MOST_LOOKED_UP {
            return false;
        }
        let all = |list| self.file.all_values(list, &self.place).ok();
        let (offsets, lengths) = (all(&self.offsets), self.lengths.as_ref().map(all));
        // Of what is not compressed some writers state no length.
        let has_length = |len: &u64| self.is_plain() || *len > 0;
        offsets.is_some_and(|offsets| offsets.iter().all(|at| *at > 0))
            && lengths.is_none_or(|lengths| lengths.is_some_and(|lengths| lengths.iter().all(has_length)))
    }

    /// The bytes of a strip, as they are stored.
    fn stored_strip(&self, plane: u32, strip: u32) -> Result<BufReader<io::Take<Positioned>>, InputFault> {
        let (at, len) = self.stored_at([plane, 0, strip], &self.place)?;
        Ok(self.read_from(at, len.unwrap_or(u64::MAX))?)
    }

    fn read_from(&self, at: u64, len: u64) -> io::Result<BufReader<io::Take<Positioned>>> {
        let mut file = Positioned::new(self.file.file.clone());
        file.seek(SeekFrom::Start(at))?;
        Ok(BufReader::with_capacity(len.clamp(1, BUFFER_BYTES) as usize, file.take(len)))
    }
}

impl StripRows {
    /// The rows of an image that [has them](TiffImage::has_streams), of these bands, counted from 0, or of
    /// all. Nothing is allocated before the first row.
    pub(crate) fn new(image: TiffImage, bands: Option<&[u16]>) -> StripRows {
        let planes = match (image.is_planar, bands) {
            (false, _) => vec![0],
            (true, Some(bands)) => bands.iter().copied().map(u32::from).collect(),
            (true, None) => (0..image.planes()).collect(),
        };
        let bands = bands.filter(|_| !image.is_planar).map(<[u16]>::to_vec);
        StripRows { bands, ..StripRows::of_planes(image, planes) }
    }

    /// The rows of some planes of an image, which whoever reads [fills](StripRows::fill) one by one.
    pub(in crate::image::tiff) fn of_planes(image: TiffImage, planes: Vec<u32>) -> StripRows {
        let (strips, packed) = (Vec::new(), Vec::new());
        StripRows { image, planes, bands: None, strips, next_row: 0, is_sparse: false, packed }
    }

    pub(crate) fn image(&self) -> &TiffImage {
        &self.image
    }

    /// Planes that are read.
    pub(in crate::image::tiff) fn planes(&self) -> usize {
        self.planes.len()
    }

    pub(crate) fn next_row(&self) -> u32 {
        self.next_row
    }

    /// Bytes that reading takes, a row that is given out not counted.
    pub(in crate::image::tiff) fn memory(&self) -> u64 {
        let row = self.image.packed_row();
        let window = match self.image.compression {
            codecs::JPEG => JPEG_ROWS.saturating_mul(row),
            other => codecs::window(other, row.saturating_mul(self.image.chunk[1].into())),
        };
        let strips = (self.planes.len() as u64).saturating_mul(window.saturating_add(BUFFER_BYTES));
        strips.saturating_add(row.saturating_mul(2))
    }

    /// The next row that is read is this one.
    pub(crate) fn go_to(&mut self, row: u32) {
        if row != self.next_row {
            self.strips.clear();
            self.next_row = row;
        }
    }

    /// Rows are gone to one by one from now on, so that none behind them is worth reading.
    pub(in crate::image::tiff) fn be_sparse(&mut self) {
        self.is_sparse = true;
    }

    /// Reads the next row: the samples of the bands, or of all of them, side by side and little-endian, each
    /// of a byte where they have fewer bits.
    pub(crate) fn read_row(&mut self) -> Result<Vec<u8>, InputFault> {
        let row = self.read_next();
        if row.is_err() {
            self.forget();
        }
        row
    }

    /// Forgets the strips that are being read, as after an error: some planes may be ahead of others.
    pub(in crate::image::tiff) fn forget(&mut self) {
        self.strips.clear();
    }

    fn read_next(&mut self) -> Result<Vec<u8>, InputFault> {
        self.begin()?;
        let sample = self.image.number.bytes();
        let stride = self.planes.len() * sample;
        let mut texels = Vec::new();
        for plane in 0..self.planes.len() {
            let mut packed = std::mem::take(&mut self.packed);
            packed.resize(self.image.packed_row() as usize, 0);
            self.fill(plane, &mut packed)?;
            self.image.put_in_order(&mut packed);
            let unpacked = self.image.has_few_bits().then(|| self.image.unpacked(&packed));
            let samples = unpacked.as_ref().unwrap_or(&packed);
            match (&self.bands, self.image.is_planar) {
                (_, true) => {
                    texels.resize(self.image.size[0] as usize * stride, 0);
                    for (to, from) in texels.chunks_exact_mut(stride).zip(samples.chunks_exact(sample)) {
                        to[plane * sample..][..sample].copy_from_slice(from);
                    }
                }
                (Some(bands), _) => texels = self.image.samples_of_bands(samples, bands),
                (None, _) => texels.extend_from_slice(samples),
            }
            self.packed = packed;
        }
        self.end()?;
        Ok(texels)
    }

    /// Begins to read the strip that holds the next row, from there on, where it is not being read. Fails
    /// where the file has too few bytes for that row, so that nobody makes room for it.
    pub(in crate::image::tiff) fn begin(&mut self) -> Result<(), InputFault> {
        if !self.strips.is_empty() {
            return Ok(());
        }
        let row = self.next_row;
        let strip = row / self.image.chunk[1];
        let (row_bytes, all) = (self.image.packed_row(), self.strip_bytes());
        let before = u64::from(row % self.image.chunk[1]) * row_bytes;
        let mut strips = Vec::with_capacity(self.planes.len());
        for plane in &self.planes {
            let place = self.place();
            let (mut at, len) = self.image.stored_at([*plane, 0, strip], &place)?;
            let mut len = len.unwrap_or(all);
            if self.image.is_plain() {
                // Some writers state no length, or that of the whole file.
                let rest = if self.is_sparse { row_bytes } else { all - before };
                (at, len) = (at.saturating_add(before), rest);
            } else if all > len.saturating_mul(most_from_a_byte(self.image.compression as u16)) {
                return Err(damaged(&place, format!("a strip has {len} bytes, which cannot hold {all}")));
            }
            let there = self.image.file.len().saturating_sub(at).min(len);
            let most = match self.image.is_plain() {
                true => there,
                false => there.saturating_mul(most_from_a_byte(self.image.compression as u16)),
            };
            if row_bytes > most {
                return Err(InputFault::Truncated { place });
            }
            let is_cut = at.checked_add(len).is_none_or(|end| end > self.image.file.len());
            let stored = self.image.read_from(at, len)?;
            let decoder = self.image.rows_of(stored, self.image.chunk_rows(strip));
            let mut decoder = decoder.map_err(|why| match is_cut {
                true => InputFault::Truncated { place: place.clone() },
                false => damaged(&place, why),
            })?;
            if !self.image.is_plain() && before > 0 {
                let passed = io::copy(&mut (&mut decoder).take(before), &mut io::sink());
                if passed.is_err() || passed.is_ok_and(|passed| passed < before) {
                    return Err(damaged(&place, "its data ends or makes no sense before this row"));
                }
            }
            strips.push(Strip { decoder, decoded: before, is_cut });
        }
        self.strips = strips;
        Ok(())
    }

    /// Decodes the next row of one of the planes that are read, once the strip is begun: as it was before it
    /// was compressed.
    pub(in crate::image::tiff) fn fill(&mut self, plane: usize, row: &mut [u8]) -> Result<(), InputFault> {
        let (all, place) = (self.strip_bytes(), self.place());
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
        match strip.is_cut || self.image.is_plain() {
            true => Err(InputFault::Truncated { place }),
            false => Err(damaged(&place, why)),
        }
    }

    /// Ends a row, of which all planes were read. Where it is the last one of a strip, nothing may follow,
    /// but for what fills the last strip up.
    pub(in crate::image::tiff) fn end(&mut self) -> Result<(), InputFault> {
        let place = self.place();
        let strip = self.next_row / self.image.chunk[1];
        let next = self.next_row + 1;
        if self.is_sparse && self.image.is_plain() {
            self.strips.clear();
            self.next_row = next;
            return Ok(());
        }
        if !next.is_multiple_of(self.image.chunk[1]) && next < self.image.size[1] {
            self.next_row = next;
            return Ok(());
        }
        let rows = self.image.chunk_rows(strip);
        let [wanted, spare] =
            [rows, self.image.chunk[1] - rows].map(|rows| u64::from(rows) * self.image.packed_row());
        for mut strip in self.strips.drain(..) {
            codecs::check_end(&mut *strip.decoder, wanted, spare).map_err(|why| damaged(&place, why))?;
        }
        self.next_row = next;
        Ok(())
    }

    /// Bytes of the strip of a plane that holds the next row.
    fn strip_bytes(&self) -> u64 {
        let strip = self.next_row / self.image.chunk[1];
        u64::from(self.image.chunk_rows(strip)) * self.image.packed_row()
    }

    /// The next row, for messages.
    fn place(&self) -> String {
        near_row(self.next_row, self.image.size[1])
    }
}
