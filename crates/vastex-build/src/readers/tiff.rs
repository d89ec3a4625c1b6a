//! TIFF and BigTIFF, 8 and 16 bits and floats, by strips or rows of tiles; uncompressed strips straight from the file.
//!
//! One strip or one row of tiles is held decoded. A compressed file of one strip is therefore held whole.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

use tiff::decoder::ifd::Value;
use tiff::decoder::{ChunkType, Decoder, Limits};
use tiff::tags::{ByteOrder, Tag};
use tiff::{ColorType, TiffError};

use super::ycbcr::rgb_from_ycbcr;
use super::{ImageHeader, PixelFormat, Profile, RowReader, Sample, buffered};
use crate::error::{InputFault, near_row};
use crate::notice::Notice;

/// Bytes that one tag of the header may have: the largest are colour profiles, and the list of the strips.
const MAX_TAG_BYTES: usize = 16 << 20;
const COMPRESSION_NONE: u16 = 1;
const COMPRESSION_JPEG: u16 = 7;
const WHITE_IS_ZERO: u16 = 0;
/// Values of SampleFormat.
const UNSIGNED: u16 = 1;
const FLOAT: u16 = 3;
const ASSOCIATED_ALPHA: u16 = 1;

/// A TIFF file, its first image.
pub(super) struct TiffReader {
    header: ImageHeader,
    chunks: Chunks,
    access: Access,
    next_row: u32,
}

/// How the image is cut into strips or tiles, and where they lie.
struct Chunks {
    /// Rows of a strip or tile.
    rows: u32,
    /// Tiles along a row; 1 for strips.
    columns: u32,
    offsets: Vec<u64>,
    lengths: Vec<u64>,
    file_len: u64,
    /// Bytes in the file for each byte handed out: 2 where samples are 64-bit floats.
    stored_scale: usize,
}

enum Access {
    /// Uncompressed strips whose samples need no change.
    Raw {
        file: File,
        position: u64,
    },
    Decoded {
        decoder: Box<Decoder<BufReader<File>>>,
        is_ycbcr: bool,
        band: Band,
    },
}

/// The rows of one strip, or of one row of tiles.
#[derive(Default)]
struct Band {
    first_row: u32,
    rows: Vec<u8>,
    tile: Vec<u8>,
}

impl TiffReader {
    pub(super) fn new(file: File) -> Result<TiffReader, InputFault> {
        let in_header = |e| fault(e, "in the header");
        let mut limits = Limits::default();
        limits.ifd_value_size = MAX_TAG_BYTES;
        let mut decoder = Decoder::new(buffered(file.try_clone()?)).map_err(in_header)?.with_limits(limits);
        let color = decoder.colortype().map_err(in_header)?;
        let tags = Tags::read(&mut decoder).map_err(in_header)?;
        let (format, is_ycbcr) = pixel_format(color, &tags)?;
        let (width, height) = decoder.dimensions().map_err(in_header)?;
        let mut header = ImageHeader::new(width.into(), height.into(), format)?;
        note(&mut header, &mut decoder, &tags)?;
        let strips = decoder.get_chunk_type() == ChunkType::Strip;
        let mut chunks = Chunks::read(&mut decoder, &file, &header, strips)?;
        if tags.bits == 64 {
            chunks.stored_scale = 2;
            header.notices.push(Notice::DoublesNarrowed);
        }
        let raw = strips
            && tags.compression == COMPRESSION_NONE
            && tags.predictor == 1
            && tags.photometric != WHITE_IS_ZERO
            && !is_ycbcr
            && tags.samples as usize * usize::from(tags.bits) == format.texel_bytes() * 8
            && (tags.bits == 8 || decoder.byte_order() == ByteOrder::LittleEndian);
        let access = if raw {
            // The decoder shares the file's position; from here on it is gone.
            Access::Raw { file, position: u64::MAX }
        } else {
            let band = u64::from(chunks.rows.min(height)).saturating_mul(header.row_bytes() as u64);
            // A band, one tile of it beside it, and what is being decoded.
            header.memory = band
                .saturating_mul(1 + chunks.stored_scale as u64)
                .saturating_add(*chunks.lengths.iter().max().unwrap_or(&0));
            if strips && chunks.rows >= height {
                header
                    .notices
                    .push(Notice::WholeImage { bytes: header.memory, why: "a compressed TIFF of one strip" });
            }
            let mut limits = Limits::unlimited();
            limits.ifd_value_size = 64 << 20;
            Access::Decoded {
                decoder: Box::new(decoder.with_limits(limits)),
                is_ycbcr,
                band: Band::default(),
            }
        };
        Ok(TiffReader { header, chunks, access, next_row: 0 })
    }
}

impl RowReader for TiffReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let row_bytes = self.header.row_bytes();
        let mut rest = rows;
        while !rest.is_empty() {
            // As many rows as there are left in this strip or row of tiles.
            let in_chunk = self.chunks.rows - self.next_row % self.chunks.rows;
            let count = (rest.len() / row_bytes).min(in_chunk as usize);
            let (now, later) = std::mem::take(&mut rest).split_at_mut(count * row_bytes);
            match &mut self.access {
                Access::Raw { file, position } => {
                    self.chunks.check(self.next_row, &self.header)?;
                    read_raw(file, position, self.chunks.raw_offset(self.next_row, row_bytes), now)
                        .map_err(|e| fault(e.into(), &near_row(self.next_row, self.header.height)))?;
                }
                Access::Decoded { decoder, is_ycbcr, band } => {
                    let first_row = self.next_row - self.next_row % self.chunks.rows;
                    if band.rows.is_empty() || band.first_row != first_row {
                        band.read(first_row, decoder, &self.chunks, &self.header)?;
                        if *is_ycbcr {
                            rgb_from_ycbcr(&mut band.rows);
                        }
                    }
                    let start = (self.next_row - first_row) as usize * row_bytes;
                    now.copy_from_slice(&band.rows[start..start + now.len()]);
                }
            }
            self.next_row += count as u32;
            rest = later;
        }
        Ok(())
    }
}

impl Chunks {
    fn read(
        decoder: &mut Decoder<BufReader<File>>,
        file: &File,
        header: &ImageHeader,
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
        let count = u64::from(header.height.div_ceil(rows)) * u64::from(columns);
        if chunk_width == 0 || (offsets.len() as u64) < count || (lengths.len() as u64) < count {
            let why = format!("it lists {} strips or tiles of {count}", offsets.len().min(lengths.len()));
            return Err(InputFault::Damaged { place: "in the header".into(), why });
        }
        Ok(Chunks { rows, columns, offsets, lengths, file_len: file.metadata()?.len(), stored_scale: 1 })
    }

    /// Whether all that holds `row` lies within the file.
    fn check(&self, row: u32, header: &ImageHeader) -> Result<(), InputFault> {
        let first = (row / self.rows * self.columns) as usize;
        for chunk in first..first + self.columns as usize {
            let end = self.offsets[chunk].checked_add(self.lengths[chunk]);
            if end.is_none_or(|end| end > self.file_len) {
                return Err(InputFault::Truncated { place: near_row(row, header.height) });
            }
        }
        Ok(())
    }

    /// Where `row` lies in a file of uncompressed strips.
    fn raw_offset(&self, row: u32, row_bytes: usize) -> u64 {
        let in_strip = u64::from(row % self.rows) * row_bytes as u64;
        self.offsets[(row / self.rows) as usize].saturating_add(in_strip)
    }
}

fn read_raw(file: &mut File, position: &mut u64, offset: u64, rows: &mut [u8]) -> io::Result<()> {
    if *position != offset {
        file.seek(SeekFrom::Start(offset))?;
    }
    file.read_exact(rows)?;
    *position = offset + rows.len() as u64;
    Ok(())
}

impl Band {
    fn read(
        &mut self,
        first_row: u32,
        decoder: &mut Decoder<BufReader<File>>,
        chunks: &Chunks,
        header: &ImageHeader,
    ) -> Result<(), InputFault> {
        chunks.check(first_row, header)?;
        let place = near_row(first_row, header.height);
        let (row_bytes, texel) = (header.row_bytes(), header.format.texel_bytes());
        let row_count = chunks.rows.min(header.height - first_row);
        self.first_row = first_row;
        self.rows.resize(row_count as usize * row_bytes, 0);
        let mut left = 0;
        for column in 0..chunks.columns {
            let chunk = first_row / chunks.rows * chunks.columns + column;
            let (width, height) = decoder.chunk_data_dimensions(chunk);
            let layout = decoder.image_chunk_buffer_layout(chunk).map_err(|e| fault(e, &place))?;
            let tile_row = width as usize * texel;
            let stored_row = tile_row * chunks.stored_scale;
            if height != row_count || layout.complete_len != stored_row * height as usize {
                return Err(InputFault::Damaged {
                    place,
                    why: "a strip or tile has an unexpected size".into(),
                });
            }
            let direct = chunks.columns == 1 && chunks.stored_scale == 1;
            let target = if direct { &mut self.rows } else { &mut self.tile };
            target.resize(layout.complete_len, 0);
            decoder.read_chunk_bytes(chunk, target).map_err(|e| fault(e, &place))?;
            if !direct {
                let stored = self.tile.chunks_exact(stored_row);
                for (row, tile) in self.rows.chunks_exact_mut(row_bytes).zip(stored) {
                    let to = &mut row[left..left + tile_row];
                    match chunks.stored_scale {
                        1 => to.copy_from_slice(tile),
                        _ => singles_from_doubles(to, tile),
                    }
                }
            }
            left += tile_row;
        }
        if cfg!(target_endian = "big") {
            self.rows.chunks_exact_mut(header.format.sample().bytes()).for_each(<[u8]>::reverse);
        }
        Ok(())
    }
}

/// The tags that decide how the image is read.
struct Tags {
    samples: u16,
    bits: u8,
    sample_format: u16,
    planar: u16,
    compression: u16,
    predictor: u16,
    photometric: u16,
}

impl Tags {
    fn read(decoder: &mut Decoder<BufReader<File>>) -> Result<Tags, TiffError> {
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

/// The texels as they will be handed out, and whether they are decoded as YCbCr.
fn pixel_format(color: ColorType, tags: &Tags) -> Result<(PixelFormat, bool), InputFault> {
    let unsupported = |what: String| InputFault::Unsupported {
        what,
        remedy: "convert it to grey, RGB or RGBA of 8 or 16 unsigned bits or of floats, interleaved",
    };
    if tags.planar != 1 && tags.samples > 1 {
        return Err(unsupported("channels in separate planes".into()));
    }
    let (channels, bits, is_ycbcr) = match color {
        ColorType::Gray(bits) => (PixelFormat::GREY8, bits, false),
        ColorType::GrayA(bits) => (PixelFormat::GREY_ALPHA8, bits, false),
        ColorType::Multiband { bit_depth, num_samples: 2 } if tags.photometric == 1 => {
            (PixelFormat::GREY_ALPHA8, bit_depth, false)
        }
        ColorType::RGB(bits) => (PixelFormat::RGB8, bits, false),
        ColorType::RGBA(bits) => (PixelFormat::RGBA8, bits, false),
        ColorType::YCbCr(8) if tags.compression == COMPRESSION_JPEG => (PixelFormat::RGB8, 8, true),
        other => return Err(unsupported(format!("texels of kind {other:?}"))),
    };
    let sample = match (tags.sample_format, bits) {
        (UNSIGNED, 8) => Sample::U8,
        (UNSIGNED, 16) => Sample::U16,
        (FLOAT, 16) => Sample::F16,
        (FLOAT, 32 | 64) => Sample::F32,
        (UNSIGNED, _) => return Err(unsupported(format!("samples of {bits} bits"))),
        (FLOAT, _) => return Err(unsupported(format!("floats of {bits} bits"))),
        _ => return Err(unsupported("samples that are signed or complex".into())),
    };
    Ok((channels.with_sample(sample), is_ycbcr))
}

/// 32-bit floats from 64-bit ones, both as the machine has them.
fn singles_from_doubles(singles: &mut [u8], doubles: &[u8]) {
    for (to, from) in singles.as_chunks_mut::<4>().0.iter_mut().zip(doubles.as_chunks::<8>().0) {
        *to = (f64::from_ne_bytes(*from) as f32).to_ne_bytes();
    }
}

/// Says what of the file is not followed.
fn note(
    header: &mut ImageHeader,
    decoder: &mut Decoder<BufReader<File>>,
    tags: &Tags,
) -> Result<(), InputFault> {
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
    Ok(())
}

fn fault(error: TiffError, place: &str) -> InputFault {
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
