//! Rows of a TIFF file, for builds, from its strips or tiles decoded in order, several at once where there is
//! help. Any tile in any order, for what is shown in place, is `file/chunk`'s.
//!
//! Each thread that decodes has a decoder of its own on the same file. What comes of them is put together to
//! rows, in order, by the thread that reads.

use std::fs::File;
use std::io::BufReader;
use std::ops::Range;
use std::sync::Arc;
use std::vec;

use tiff::decoder::{Decoder, Limits};
use tiff::tags::Tag;

use super::file::TiffImage;
use super::samples::{COMPRESSION_NONE, Stored, most_from_a_byte, place_row};
use super::{Tags, fault};
use crate::image::ahead::{Ahead, Helpers, Spare};
use crate::image::fault::near_row;
use crate::image::positioned::Positioned;
use crate::image::{ImageHeader, InputFault, PixelFormat};

/// A value of PlanarConfiguration.
pub(super) const PLANAR: u16 = 2;
/// Bytes of neighbouring strips or tiles that one thread decodes at a time, at least.
const RUN_BYTES: u64 = 64 << 10;
/// Bytes that a decoder reads of the file at once.
const BUFFER_BYTES: usize = 256 << 10;
/// Bytes that a decoder holds of each entry of the lists of strips or tiles, at most.
const LIST_BYTES: u64 = 48;
/// Bytes that the decoder may take for one tag while rows are read, where the header was in order.
const MAX_TAG_BYTES: usize = 64 << 20;

pub(super) type TiffDecoder = Decoder<BufReader<Positioned>>;

/// A decoder, at the first image of a file.
pub(super) fn open_decoder(file: &Arc<File>) -> Result<TiffDecoder, InputFault> {
    let buffered = BufReader::with_capacity(BUFFER_BYTES, Positioned::new(file.clone()));
    Decoder::new(buffered).map_err(|e| fault(e, "in the header"))
}

/// How the image is cut into strips or tiles, and where they lie.
pub(super) struct Chunks {
    size: [u32; 2],
    format: PixelFormat,
    /// Rows of a strip or tile.
    pub(super) rows: u32,
    /// Texels along its rows, as far as they lie within the picture.
    width: u32,
    /// Tiles along a row; 1 for strips.
    columns: u32,
    offsets: Vec<u64>,
    lengths: Vec<u64>,
    file_len: u64,
    pub(super) stored: Stored,
    /// Planes, one after the other; 1 where channels are side by side.
    pub(super) planes: u32,
}

impl Chunks {
    pub(super) fn read(
        decoder: &mut TiffDecoder,
        file: &File,
        header: &ImageHeader,
        tags: &Tags,
        strips: bool,
    ) -> Result<Chunks, InputFault> {
        let (offsets, lengths) = match strips {
            true => (Tag::StripOffsets, Tag::StripByteCounts),
            false => (Tag::TileOffsets, Tag::TileByteCounts),
        };
        let mut list = |tag| decoder.get_tag_u64_vec(tag).map_err(|e| fault(e, "in the header"));
        let (offsets, lengths) = (list(offsets)?, list(lengths)?);
        let (chunk_width, rows) = decoder.chunk_dimensions();
        let columns = if strips { 1 } else { header.width.div_ceil(chunk_width.max(1)) };
        let rows = if rows == 0 { header.height } else { rows };
        let planes = if tags.planar == PLANAR { u32::from(tags.samples.max(1)) } else { 1 };
        let count = u64::from(header.height.div_ceil(rows)) * u64::from(columns) * u64::from(planes);
        if chunk_width == 0 || (offsets.len() as u64) < count || (lengths.len() as u64) < count {
            let why = format!("it lists {} strips or tiles of {count}", offsets.len().min(lengths.len()));
            return Err(InputFault::Damaged { place: "in the header".into(), why });
        }
        let stored = Stored::new(tags.sample_format, tags.bits);
        let (size, width) = ([header.width, header.height], chunk_width.min(header.width));
        let (format, file_len) = (header.format, file.metadata()?.len());
        let chunks =
            Chunks { size, format, rows, width, columns, offsets, lengths, file_len, stored, planes };
        // The first strip or tile lies within the picture, or the picture within it.
        let texels = u64::from(width) * u64::from(rows.min(header.height));
        let samples = if planes > 1 { 1 } else { u64::from(tags.samples) };
        let bytes = texels.saturating_mul(samples * u64::from(tags.bits)) / 8;
        // Of what is not compressed some writers state no length; strips of that are read as far as there are
        // any.
        let is_plain = tags.compression == COMPRESSION_NONE;
        let stored = if is_plain { chunks.file_len } else { chunks.lengths[0] };
        if !(is_plain && strips) && bytes > stored.saturating_mul(most_from_a_byte(tags.compression)) {
            let why = format!("its first strip or tile has {stored} bytes, which cannot hold {bytes}");
            return Err(InputFault::Damaged { place: "in the header".into(), why });
        }
        Ok(chunks)
    }

    /// Bytes of the longest as it is stored. One that claims more than the file has is never read.
    pub(super) fn longest(&self) -> u64 {
        self.lengths.iter().max().map_or(0, |longest| self.file_len.min(*longest))
    }

    /// The number of a strip or tile, of a plane and a column, that holds `row`.
    fn number(&self, plane: u32, row: u32, column: u32) -> u32 {
        let per_plane = u64::from(self.size[1].div_ceil(self.rows)) * u64::from(self.columns);
        plane * per_plane as u32 + row / self.rows * self.columns + column
    }

    /// Checks that all that holds `row` lies within the file.
    pub(super) fn check(&self, row: u32) -> Result<(), InputFault> {
        for plane in 0..self.planes {
            for column in 0..self.columns {
                let chunk = self.number(plane, row, column) as usize;
                let end = self.offsets[chunk].checked_add(self.lengths[chunk]);
                if end.is_none_or(|end| end > self.file_len) {
                    return Err(InputFault::Truncated { place: self.place(row) });
                }
            }
        }
        Ok(())
    }

    /// Where `row` lies in a file of uncompressed strips.
    pub(super) fn raw_offset(&self, row: u32, row_bytes: usize) -> u64 {
        let in_strip = u64::from(row % self.rows) * row_bytes as u64;
        self.offsets[(row / self.rows) as usize].saturating_add(in_strip)
    }

    /// Returns true if `image` says the same of how the image is cut and what its texels are.
    pub(super) fn is_of(&self, image: &TiffImage) -> bool {
        let rows = self.rows.min(self.size[1]);
        let is_alike = image.pixel_format().is_ok_and(|format| format == self.format);
        image.size == self.size && image.chunk == [self.size[0], rows] && is_alike
    }

    pub(super) fn format(&self) -> PixelFormat {
        self.format
    }

    /// Bytes of a row of the picture.
    pub(super) fn row_bytes(&self) -> usize {
        self.size[0] as usize * self.format.texel_bytes()
    }

    /// Bytes of a row of one plane as it is stored, where a texel has so many samples in it.
    pub(super) fn stored_row(&self, samples: usize) -> usize {
        self.size[0] as usize * samples * self.stored.bytes(self.format.sample())
    }

    /// A row, for messages.
    pub(super) fn place(&self, row: u32) -> String {
        near_row(row, self.size[1])
    }

    /// Planes that are part of the picture; what lies in others is passed over.
    pub(super) fn planes_read(&self) -> u32 {
        self.planes.min(self.format.channels().into())
    }

    /// Bytes of what lies side by side in a plane, a texel or one sample of it: as it is given out, and as it
    /// is stored.
    pub(super) fn unit(&self) -> (usize, usize) {
        let sample = self.format.sample();
        match self.planes {
            1 => (self.format.texel_bytes(), usize::from(self.format.channels()) * self.stored.bytes(sample)),
            _ => (sample.bytes(), self.stored.bytes(sample)),
        }
    }

    /// Returns true if what is decoded are the rows.
    pub(super) fn are_rows(&self) -> bool {
        self.columns == 1 && self.planes == 1 && self.stored == Stored::AsItIs
    }

    /// Strips or tiles that are read.
    fn count(&self) -> u64 {
        let bands = u64::from(self.size[1].div_ceil(self.rows));
        bands * u64::from(self.planes_read()) * u64::from(self.columns)
    }

    /// The first row, the plane and the number of the strip or tile that is read after `n` others: band by
    /// band, and in each plane by plane.
    fn nth(&self, n: u64) -> (u32, u32, u32) {
        let (columns, planes) = (u64::from(self.columns), u64::from(self.planes_read()));
        let (band, plane, column) = (n / (columns * planes), n / columns % planes, n % columns);
        let (first_row, plane) = (band as u32 * self.rows, plane as u32);
        (first_row, plane, self.number(plane, first_row, column as u32))
    }

    /// Bytes of one that is decoded, at most.
    pub(super) fn decoded_bytes(&self) -> u64 {
        let texels = u64::from(self.width) * u64::from(self.rows.min(self.size[1]));
        texels.saturating_mul(self.unit().1 as u64)
    }

    /// How many are decoded at a time.
    fn run(&self) -> u64 {
        (RUN_BYTES / self.decoded_bytes().max(1)).max(1)
    }
}

/// A strip or tile, decoded, and how many texels its rows have.
struct Chunk {
    bytes: Vec<u8>,
    width: usize,
}

type Run = Vec<Result<Chunk, InputFault>>;

/// What decodes, on as many threads as there are.
struct Decoding {
    chunks: Arc<Chunks>,
    file: Arc<File>,
    /// The image by our own reader, which decodes what the decoders do not, JPEG as libjpeg does, and LZW
    /// that has no end.
    own: Option<TiffImage>,
    decoders: Spare<TiffDecoder>,
    buffers: Spare<Vec<u8>>,
}

impl Decoding {
    /// Decodes some, the next ones after `run.start` others, up to the first that is damaged.
    fn run(&self, run: Range<u64>) -> Run {
        let mut decoded = Vec::new();
        if let Some(own) = &self.own {
            for n in run {
                decoded.push(self.decode_own(own, n));
                if decoded.last().is_some_and(Result::is_err) {
                    break;
                }
            }
            return decoded;
        }
        let opened = self.decoders.take().map_or_else(|| open_decoder(&self.file).map(unlimited), Ok);
        let mut decoder = match opened {
            Ok(decoder) => decoder,
            Err(fault) => return vec![Err(fault)],
        };
        for n in run {
            decoded.push(self.decode(&mut decoder, n));
            if decoded.last().is_some_and(Result::is_err) {
                return decoded;
            }
        }
        self.decoders.give(decoder);
        decoded
    }

    /// What was read may be decoded into again, where the decoder is one that is handed its memory.
    fn give(&self, bytes: Vec<u8>) {
        if self.own.is_none() {
            self.buffers.give(bytes);
        }
    }

    fn decode_own(&self, own: &TiffImage, n: u64) -> Result<Chunk, InputFault> {
        let chunks = &*self.chunks;
        let (first_row, plane, number) = chunks.nth(n);
        let column = number % chunks.columns;
        let part = own.shown_part(plane, column, first_row / chunks.rows, chunks.format);
        // Who reads rows is told of rows.
        let bytes = part.map_err(|fault| match fault {
            InputFault::Damaged { why, .. } => InputFault::Damaged { place: chunks.place(first_row), why },
            InputFault::Truncated { .. } => InputFault::Truncated { place: chunks.place(first_row) },
            fault => fault,
        })?;
        let width = chunks.width.min(chunks.size[0] - column * chunks.width);
        Ok(Chunk { bytes, width: width as usize })
    }

    fn decode(&self, decoder: &mut TiffDecoder, n: u64) -> Result<Chunk, InputFault> {
        let chunks = &*self.chunks;
        let (first_row, plane, number) = chunks.nth(n);
        let place = || chunks.place(first_row);
        let row_count = chunks.rows.min(chunks.size[1] - first_row);
        let (width, height) = decoder.chunk_data_dimensions(number);
        let layout = decoder.image_chunk_buffer_layout(number).map_err(|e| fault(e, &place()))?;
        let stored_row = width as usize * chunks.unit().1;
        // The decoder counts what pads the last rows of later planes among their rows.
        let is_expected = height == row_count || (plane > 0 && height > row_count);
        if !is_expected || layout.complete_len != stored_row * height as usize {
            let why = "a strip or tile has an unexpected size".into();
            return Err(InputFault::Damaged { place: place(), why });
        }
        let mut bytes = self.buffers.take().unwrap_or_default();
        bytes.resize(layout.complete_len, 0);
        decoder.read_chunk_bytes(number, &mut bytes).map_err(|e| fault(e, &place()))?;
        Ok(Chunk { bytes, width: width as usize })
    }
}

/// A decoder whose file's header was looked at, so that it may take what it needs.
fn unlimited(decoder: TiffDecoder) -> TiffDecoder {
    let mut limits = Limits::unlimited();
    limits.ifd_value_size = MAX_TAG_BYTES;
    decoder.with_limits(limits)
}

/// The rows of a file that must be decoded: those of one strip or of one row of tiles are there.
pub(super) struct ReadyRows {
    decoding: Arc<Decoding>,
    ahead: Ahead<Run>,
    /// Strips or tiles that somebody was asked for.
    asked: u64,
    /// Strips are gone to one by one, so that none beside them is worth decoding.
    is_sparse: bool,
    /// Chunks that are decoded and whose turn it is.
    ready: vec::IntoIter<Result<Chunk, InputFault>>,
    first_row: u32,
    rows: Vec<u8>,
    /// True if a number was too large to stay exact.
    pub(super) rounded: bool,
}

impl ReadyRows {
    /// `decoder` is at the first image of the file.
    pub(super) fn new(
        chunks: Arc<Chunks>,
        file: Arc<File>,
        decoder: TiffDecoder,
        own: Option<TiffImage>,
    ) -> ReadyRows {
        let lists = LIST_BYTES * chunks.offsets.len() as u64;
        let decoded = chunks.decoded_bytes().saturating_add(RUN_BYTES);
        // What is decoded, what that is made of, and a decoder.
        let bytes = decoded.saturating_add(chunks.longest()).saturating_add(lists + BUFFER_BYTES as u64);
        let ahead = Ahead::new(chunks.count().div_ceil(chunks.run()), bytes);
        let (decoders, buffers) = (Spare::default(), Spare::default());
        decoders.give(unlimited(decoder));
        let decoding = Arc::new(Decoding { chunks, file, own, decoders, buffers });
        let (rows, ready) = (Vec::new(), Vec::new().into_iter());
        ReadyRows { decoding, ahead, asked: 0, is_sparse: false, ready, first_row: 0, rows, rounded: false }
    }

    pub(super) fn memory_ahead(&self, pieces: usize) -> u64 {
        self.ahead.memory(pieces)
    }

    pub(super) fn take_help(&mut self, helpers: &Helpers) {
        self.ahead.take_help(helpers);
    }

    /// Fills `rows` with those from `row` on, all of which lie in one strip or row of tiles: the last one's,
    /// or the next one.
    pub(super) fn read(&mut self, row: u32, rows: &mut [u8]) -> Result<(), InputFault> {
        let chunks = self.decoding.chunks.clone();
        let first_row = row - row % chunks.rows;
        if self.rows.is_empty() || self.first_row != first_row {
            chunks.check(first_row)?;
            self.load(&chunks, first_row)?;
        }
        let row_bytes = chunks.size[0] as usize * chunks.format.texel_bytes();
        rows.copy_from_slice(&self.rows[(row - first_row) as usize * row_bytes..][..rows.len()]);
        Ok(())
    }

    /// The next rows that are read lie in the strip or row of tiles that holds `row`. To be called where
    /// there is no help, which would be ahead of it.
    pub(super) fn go_to(&mut self, row: u32) {
        let chunks = &self.decoding.chunks;
        let band = row / chunks.rows;
        if self.rows.is_empty() || self.first_row != band * chunks.rows {
            let bands = chunks.size[1].div_ceil(chunks.rows).max(1);
            self.asked = u64::from(band) * (chunks.count() / u64::from(bands));
            self.ready = Vec::new().into_iter();
            self.is_sparse = true;
        }
    }

    fn load(&mut self, chunks: &Chunks, first_row: u32) -> Result<(), InputFault> {
        let (texel, sample) = (chunks.format.texel_bytes(), chunks.format.sample());
        let (unit, stored_unit) = chunks.unit();
        let row_bytes = chunks.size[0] as usize * texel;
        let row_count = chunks.rows.min(chunks.size[1] - first_row) as usize;
        self.first_row = first_row;
        if chunks.are_rows() {
            let decoded = self.next(first_row)?.bytes;
            self.decoding.give(std::mem::replace(&mut self.rows, decoded));
        } else {
            self.rows.resize(row_count * row_bytes, 0);
            for plane in 0..chunks.planes_read() {
                let mut left = 0;
                for _ in 0..chunks.columns {
                    let Chunk { bytes, width } = self.next(first_row)?;
                    let tile_row = width * texel;
                    let stored = bytes.chunks_exact((width * stored_unit).max(1));
                    for (row, tile) in self.rows.chunks_exact_mut(row_bytes).zip(stored) {
                        let texels = row[left..left + tile_row].chunks_exact_mut(texel);
                        let to = texels.map(|texel| &mut texel[plane as usize * unit..][..unit]);
                        self.rounded |= place_row(to, tile, chunks.stored, sample);
                    }
                    left += tile_row;
                    self.decoding.give(bytes);
                }
            }
        }
        if cfg!(target_endian = "big") {
            self.rows.chunks_exact_mut(sample.bytes()).for_each(<[u8]>::reverse);
        }
        Ok(())
    }

    /// The next strip or tile, of the band that begins with `first_row`.
    fn next(&mut self, first_row: u32) -> Result<Chunk, InputFault> {
        loop {
            if let Some(chunk) = self.ready.next() {
                return chunk;
            }
            let chunks = &self.decoding.chunks;
            // What is asked for without the rows between needs one row of chunks.
            let run = if self.is_sparse { 1 } else { chunks.run() };
            let count = chunks.count();
            while self.ahead.has_room() && self.asked < count {
                let run = self.asked..count.min(self.asked + run);
                self.asked = run.end;
                let decoding = self.decoding.clone();
                self.ahead.push(move || decoding.run(run));
            }
            let Some(run) = self.ahead.next() else {
                let why = "it has no more strips or tiles".into();
                return Err(InputFault::Damaged { place: self.decoding.chunks.place(first_row), why });
            };
            self.ready = run.into_iter();
        }
    }
}
