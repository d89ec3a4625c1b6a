//! TIFF and BigTIFF, 8 and 16 bits, signed numbers and floats, by strips or rows of tiles; uncompressed
//! strips straight from the file.
//!
//! One strip or one row of tiles is held decoded, of all planes where channels lie in planes ([`chunks`]),
//! and with help some more. Of one strip, and of strips that are very large, rows come as they are decoded
//! ([`streamed`]), unless they are JPEG 2000 or JPEGs of several scans. What is shown as something else than
//! it is stored, and bands, are [`bands`]'. Signed numbers stand for themselves,
//! as floats; see [`ImageHeader::range`]. LZW, JPEG, JPEG 2000 and Zstandard are decoded by [`file`], whose
//! business files are whose tiles are read in any order.

mod bands;
mod chunks;
pub(crate) mod file;
mod samples;
mod sparse;
mod sparse_tiles;
mod streamed;
mod ycbcr;

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::sync::Arc;

use tiff::decoder::ifd::Value;
use tiff::decoder::{ChunkType, Limits};
use tiff::tags::{ByteOrder, Tag};
use tiff::{ColorType, TiffError};

use crate::image::alpha::unpremultiply;
use crate::image::positioned::Positioned;
use crate::image::{Converted, Helpers, ImageHeader, InputFault, Notice, PixelFormat, Profile, RowReader};
use bands::BandsReader;
use chunks::{Chunks, PLANAR, ReadyRows, TiffDecoder, open_decoder};
use file::{TiffFile, TiffImage, codecs};
use samples::{COMPRESSION_JPEG, COMPRESSION_NONE, SIGNED, Stored};
use sparse::AnyRows;
use sparse_tiles::SparseTiles;
use streamed::StreamedRows;

/// Bytes that one tag of the header may have: the largest are colour profiles, and the list of the strips.
const MAX_TAG_BYTES: usize = 16 << 20;
const WHITE_IS_ZERO: u16 = 0;
const ASSOCIATED_ALPHA: u16 = 1;

/// Opens the first image of a TIFF file, or these bands of it, as in `5,4,3`.
pub(super) fn open(file: File, bands: Option<&str>) -> Result<Box<dyn RowReader>, InputFault> {
    let file = Arc::new(file);
    match TiffFile::first_image(file.clone(), bands) {
        Ok(image) if image.has_pick() || image.is_converted() => Ok(Box::new(BandsReader::new(image)?)),
        Err(fault) if bands.is_some() => Err(fault),
        // What is wrong with it, its reader knows better.
        first => Ok(Box::new(TiffReader::new(file, first)?)),
    }
}

/// Opens the first image of a TIFF file, or bands of it, at a share of its size; `None` where that is no
/// quicker than all of it.
pub(super) fn open_sparse(
    file: File,
    side: u32,
    bands: Option<&str>,
) -> Result<Option<Box<dyn RowReader>>, InputFault> {
    let file = Arc::new(file);
    let first = match TiffFile::first_image(file.clone(), bands) {
        Ok(image) if image.is_tiled => {
            let sparse = SparseTiles::new(image, side)?;
            return Ok(sparse.map(|reader| Box::new(reader) as Box<dyn RowReader>));
        }
        first => first,
    };
    let sparse = match first {
        Ok(image) if image.has_pick() || image.is_converted() => BandsReader::new(image)?.sparse(side),
        Err(fault) if bands.is_some() => return Err(fault),
        first => TiffReader::new(file, first)?.sparse(side),
    };
    Ok(sparse.map(|reader| Box::new(reader) as Box<dyn RowReader>))
}

/// A TIFF file, its first image.
pub(super) struct TiffReader {
    header: ImageHeader,
    chunks: Arc<Chunks>,
    access: Access,
    has_strips: bool,
    is_premultiplied: bool,
    next_row: u32,
}

enum Access {
    /// Uncompressed strips whose samples need no change.
    Raw(Positioned),
    /// Strips of which rows come as they are decoded.
    Streamed(Box<StreamedRows>),
    Decoded(Box<ReadyRows>),
}

impl TiffReader {
    /// Of a file and its first image, as far as that could be read.
    fn new(file: Arc<File>, first: Result<TiffImage, InputFault>) -> Result<TiffReader, InputFault> {
        let in_header = |e| fault(e, "in the header");
        let mut limits = Limits::default();
        limits.ifd_value_size = MAX_TAG_BYTES;
        let mut decoder = open_decoder(&file)?.with_limits(limits);
        let color = decoder.colortype().map_err(in_header)?;
        let tags = Tags::read(&mut decoder).map_err(in_header)?;
        let format = pixel_format(color, &tags)?;
        let (width, height) = decoder.dimensions().map_err(in_header)?;
        let mut header = ImageHeader::new(width.into(), height.into(), format)?;
        let is_premultiplied = note(&mut header, &mut decoder, &tags)?;
        // What this reader cannot make sense of says nothing of it.
        header.nodata = first.as_ref().ok().and_then(TiffImage::shown_nodata);
        let strips = decoder.get_chunk_type() == ChunkType::Strip;
        let chunks = Chunks::read(&mut decoder, &file, &header, &tags, strips)?;
        header.notices.extend((chunks.stored == Stored::Double).then_some(Notice::DoublesNarrowed));
        header.converted =
            Converted::all(chunks.stored.converted(), tags.photometric == WHITE_IS_ZERO, is_premultiplied);
        let raw = strips
            && tags.compression == COMPRESSION_NONE
            && tags.photometric != WHITE_IS_ZERO
            && chunks.planes == 1
            && chunks.stored == Stored::AsItIs
            && tags.samples as usize * usize::from(tags.bits) == format.texel_bytes() * 8
            && (tags.bits == 8 || decoder.byte_order() == ByteOrder::LittleEndian);
        let chunks = Arc::new(chunks);
        let access = match first {
            _ if raw => Access::Raw(Positioned::new(file)),
            Ok(image) if StreamedRows::can_be_of(&image, &chunks) => {
                let rows = StreamedRows::new(image, &chunks);
                header.memory = rows.memory();
                Access::Streamed(Box::new(rows))
            }
            first => {
                let band = u64::from(chunks.rows.min(height)).saturating_mul(header.row_bytes() as u64);
                // A band, one tile of it beside it as it is stored, and what is being decoded.
                let sample = header.format.sample();
                let stored =
                    band.div_ceil(sample.bytes() as u64).saturating_mul(chunks.stored.bytes(sample) as u64);
                header.memory = band.saturating_add(stored).saturating_add(chunks.longest());
                if strips && chunks.rows >= height {
                    let why = match tags.compression {
                        COMPRESSION_NONE => "a TIFF of one strip whose samples must be converted",
                        _ => "a compressed TIFF of one strip",
                    };
                    header.notices.push(Notice::WholeImage { bytes: header.memory, why });
                }
                // What the decoder at hand decodes otherwise, or not at all. It follows predictors of what is
                // not compressed, too.
                let compression = u64::from(tags.compression);
                let is_own = matches!(compression, codecs::LZW | codecs::JPEG | codecs::ZSTD)
                    || codecs::is_jpeg_2000(compression)
                    || compression == codecs::NONE && tags.predictor != 1;
                let own = match first {
                    Ok(image) if is_own => Some(image),
                    Err(fault) if is_own => return Err(fault),
                    _ => None,
                };
                Access::Decoded(Box::new(ReadyRows::new(chunks.clone(), file, decoder, own)))
            }
        };
        Ok(TiffReader { header, chunks, access, has_strips: strips, is_premultiplied, next_row: 0 })
    }
}

impl AnyRows for TiffReader {
    fn go_to(&mut self, row: u32) {
        self.next_row = row;
        match &mut self.access {
            Access::Raw(_) => {}
            Access::Streamed(rows) => rows.go_to(row),
            Access::Decoded(bands) => bands.go_to(row),
        }
    }
}

impl RowReader for TiffReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn memory_ahead(&self, pieces: usize) -> u64 {
        match &self.access {
            Access::Raw(_) | Access::Streamed(_) => 0,
            Access::Decoded(bands) => bands.memory_ahead(pieces),
        }
    }

    fn take_help(&mut self, helpers: &Helpers) {
        if let Access::Decoded(bands) = &mut self.access {
            bands.take_help(helpers);
        }
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let row_bytes = self.header.row_bytes();
        let mut rest = &mut *rows;
        while !rest.is_empty() {
            // As many rows as there are left in this strip or row of tiles.
            let in_chunk = self.chunks.rows - self.next_row % self.chunks.rows;
            let count = (rest.len() / row_bytes).min(in_chunk as usize);
            let (now, later) = std::mem::take(&mut rest).split_at_mut(count * row_bytes);
            match &mut self.access {
                Access::Raw(file) => {
                    read_raw(file, self.chunks.raw_offset(self.next_row, row_bytes), now)
                        .map_err(|e| fault(e.into(), &self.chunks.place(self.next_row)))?;
                }
                Access::Streamed(rows) => rows.read(now)?,
                Access::Decoded(bands) => bands.read(self.next_row, now)?,
            }
            self.next_row += count as u32;
            rest = later;
        }
        if self.is_premultiplied {
            unpremultiply(self.header.format, rows);
        }
        let rounded = match &mut self.access {
            Access::Raw(_) => return Ok(()),
            Access::Streamed(rows) => &mut rows.rounded,
            Access::Decoded(bands) => &mut bands.rounded,
        };
        if self.next_row == self.header.height && std::mem::take(rounded) {
            self.header.notices.push(Notice::IntegersRounded);
        }
        Ok(())
    }
}

fn read_raw(file: &mut Positioned, offset: u64, rows: &mut [u8]) -> io::Result<()> {
    file.seek(SeekFrom::Start(offset))?;
    file.read_exact(rows)
}

/// The tags that decide how the image is read.
pub(super) struct Tags {
    pub(super) samples: u16,
    pub(super) bits: u8,
    pub(super) sample_format: u16,
    pub(super) planar: u16,
    pub(super) compression: u16,
    predictor: u16,
    photometric: u16,
}

impl Tags {
    fn read(decoder: &mut TiffDecoder) -> Result<Tags, TiffError> {
        let mut tag = |tag, default| {
            // Of several equal values, one per sample, the first.
            let found = decoder.find_tag_unsigned_vec::<u16>(tag)?;
            Ok::<_, TiffError>(found.and_then(|v| v.first().copied()).unwrap_or(default))
        };
        Ok(Tags {
            samples: tag(Tag::SamplesPerPixel, 1)?,
            bits: u8::try_from(tag(Tag::BitsPerSample, 1)?).unwrap_or(u8::MAX),
            sample_format: tag(Tag::SampleFormat, 1)?,
            planar: tag(Tag::PlanarConfiguration, 1)?,
            compression: tag(Tag::Compression, COMPRESSION_NONE)?,
            predictor: tag(Tag::Predictor, 1)?,
            photometric: tag(Tag::PhotometricInterpretation, 1)?,
        })
    }
}

/// The texels as they will be handed out; YCbCr comes as RGB.
fn pixel_format(color: ColorType, tags: &Tags) -> Result<PixelFormat, InputFault> {
    let unsupported = |what: String| InputFault::Unsupported {
        what,
        remedy: "convert it to grey, RGB or RGBA of 8 or 16 bits, of signed numbers or of floats",
    };
    if tags.planar == PLANAR && tags.compression == COMPRESSION_JPEG {
        return Err(unsupported("channels in separate planes, as JPEG".into()));
    }
    let is_jpeg = tags.compression == COMPRESSION_JPEG || codecs::is_jpeg_2000(tags.compression.into());
    let (channels, bits) = match color {
        ColorType::Gray(bits) => (PixelFormat::GREY8, bits),
        ColorType::GrayA(bits) => (PixelFormat::GREY_ALPHA8, bits),
        ColorType::Multiband { bit_depth, num_samples: 2 } if tags.photometric == 1 => {
            (PixelFormat::GREY_ALPHA8, bit_depth)
        }
        ColorType::RGB(bits) => (PixelFormat::RGB8, bits),
        ColorType::RGBA(bits) => (PixelFormat::RGBA8, bits),
        ColorType::YCbCr(8) if is_jpeg => (PixelFormat::RGB8, 8),
        other => return Err(unsupported(format!("texels of kind {other:?}"))),
    };
    let sample = samples::sample_of(tags.sample_format, bits.into()).map_err(unsupported)?;
    Ok(channels.with_sample(sample))
}

/// Says what of the file is not followed, and whether its colours are multiplied by alpha.
fn note(header: &mut ImageHeader, decoder: &mut TiffDecoder, tags: &Tags) -> Result<bool, InputFault> {
    let in_header = |e| fault(e, "in the header");
    let orientation = decoder.find_tag_unsigned::<u16>(Tag::Orientation).map_err(in_header)?;
    header.orientation = orientation.unwrap_or(1);
    header.profile = match decoder.find_tag(Tag::IccProfile).map(|tag| tag.map(Value::into_u8_vec)) {
        Ok(None) => None,
        Ok(Some(Ok(bytes))) => Some(Profile::icc(bytes)),
        // What cannot be read of it is told of like any other damage to it.
        Ok(Some(Err(_))) | Err(_) => Some(Profile::icc([])),
    };
    let extra = decoder.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples).map_err(in_header)?;
    let premultiplied =
        matches!(tags.samples, 2 | 4) && extra.is_some_and(|e| e.first() == Some(&ASSOCIATED_ALPHA));
    header.notices.extend(premultiplied.then_some(Notice::PremultipliedAlpha));
    header.notices.extend(decoder.more_images().then_some(Notice::FurtherImagesIgnored));
    if tags.sample_format == SIGNED {
        let most = (1i64 << (tags.bits.clamp(1, 64) - 1)) - 1;
        header.range = Some([-most - 1, most]);
    }
    Ok(premultiplied)
}

pub(super) fn fault(error: TiffError, place: &str) -> InputFault {
    match error {
        TiffError::IoError(e) if e.kind() == io::ErrorKind::UnexpectedEof => {
            InputFault::Truncated { place: place.into() }
        }
        TiffError::IoError(e) => InputFault::Damaged { place: place.into(), why: e.to_string() },
        TiffError::LimitsExceeded => InputFault::Unsupported {
            what: "more strips or tiles than can be listed".into(),
            remedy: "convert it to larger ones",
        },
        TiffError::UnsupportedError(e) => InputFault::Unsupported {
            what: format!("a kind of TIFF that is not known ({e})"),
            remedy: "convert it to a TIFF of strips or tiles, uncompressed, LZW, deflate or JPEG",
        },
        other => InputFault::Damaged { place: place.into(), why: other.to_string() },
    }
}
