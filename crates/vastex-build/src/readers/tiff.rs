//! TIFF and BigTIFF, 8 and 16 bits, signed numbers and floats, by strips or rows of tiles; uncompressed strips straight from
//! the file.
//!
//! One strip or one row of tiles is held decoded, of all planes where channels lie in planes. A compressed file of one
//! strip is therefore held whole. Signed numbers stand for themselves, as floats; see [`super::ImageHeader::range`].

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

use tiff::decoder::ifd::Value;
use tiff::decoder::{ChunkType, Decoder, Limits};
use tiff::tags::{ByteOrder, Tag};
use tiff::{ColorType, TiffError};

use super::alpha::unpremultiply;
use super::tiff_samples::{
    COMPRESSION_JPEG, COMPRESSION_NONE, FLOAT, SIGNED, Stored, most_from_a_byte, place_row,
};
use super::ycbcr::rgb_from_ycbcr;
use super::{ImageHeader, PixelFormat, Profile, RowReader, Sample, buffered};
use crate::error::{InputFault, near_row};
use crate::notice::Notice;

/// Bytes that one tag of the header may have: the largest are colour profiles, and the list of the strips.
const MAX_TAG_BYTES: usize = 16 << 20;
const WHITE_IS_ZERO: u16 = 0;
/// A value of SampleFormat.
const UNSIGNED: u16 = 1;
const PLANAR: u16 = 2;
const ASSOCIATED_ALPHA: u16 = 1;

/// A TIFF file, its first image.
pub(super) struct TiffReader {
    header: ImageHeader,
    chunks: Chunks,
    access: Access,
    is_premultiplied: bool,
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
    stored: Stored,
    /// Planes, one after the other; 1 where channels are side by side.
    planes: u32,
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
    /// Whether a number was too large to stay exact.
    rounded: bool,
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
        let is_premultiplied = note(&mut header, &mut decoder, &tags)?;
        let strips = decoder.get_chunk_type() == ChunkType::Strip;
        let chunks = Chunks::read(&mut decoder, &file, &header, &tags, strips)?;
        header.notices.extend((chunks.stored == Stored::Double).then_some(Notice::DoublesNarrowed));
        let raw = strips
            && tags.compression == COMPRESSION_NONE
            && tags.predictor == 1
            && tags.photometric != WHITE_IS_ZERO
            && !is_ycbcr
            && chunks.planes == 1
            && chunks.stored == Stored::AsItIs
            && tags.samples as usize * usize::from(tags.bits) == format.texel_bytes() * 8
            && (tags.bits == 8 || decoder.byte_order() == ByteOrder::LittleEndian);
        let access = if raw {
            // The decoder shares the file's position; from here on it is gone.
            Access::Raw { file, position: u64::MAX }
        } else {
            let band = u64::from(chunks.rows.min(height)).saturating_mul(header.row_bytes() as u64);
            // A band, one tile of it beside it as it is stored, and what is being decoded.
            let sample = header.format.sample();
            let stored =
                band.div_ceil(sample.bytes() as u64).saturating_mul(chunks.stored.bytes(sample) as u64);
            header.memory =
                band.saturating_add(stored).saturating_add(*chunks.lengths.iter().max().unwrap_or(&0));
            if strips && chunks.rows >= height {
                let why = match tags.compression {
                    COMPRESSION_NONE => "a TIFF of one strip whose samples must be converted",
                    _ => "a compressed TIFF of one strip",
                };
                header.notices.push(Notice::WholeImage { bytes: header.memory, why });
            }
            let mut limits = Limits::unlimited();
            limits.ifd_value_size = 64 << 20;
            Access::Decoded {
                decoder: Box::new(decoder.with_limits(limits)),
                is_ycbcr,
                band: Band::default(),
            }
        };
        Ok(TiffReader { header, chunks, access, is_premultiplied, next_row: 0 })
    }
}

impl RowReader for TiffReader {
    fn header(&self) -> &ImageHeader {
        &self.header
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
        if self.is_premultiplied {
            unpremultiply(self.header.format, rows);
        }
        if let Access::Decoded { band, .. } = &mut self.access
            && self.next_row == self.header.height
            && std::mem::take(&mut band.rounded)
        {
            self.header.notices.push(Notice::IntegersRounded);
        }
        Ok(())
    }
}

impl Chunks {
    fn read(
        decoder: &mut Decoder<BufReader<File>>,
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
        let chunks =
            Chunks { rows, columns, offsets, lengths, file_len: file.metadata()?.len(), stored, planes };
        // The first strip or tile lies within the picture, or the picture within it.
        let texels = u64::from(chunk_width.min(header.width)) * u64::from(rows.min(header.height));
        let samples = if planes > 1 { 1 } else { u64::from(tags.samples) };
        let bytes = texels.saturating_mul(samples * u64::from(tags.bits)) / 8;
        // Of what is not compressed some writers state no length; strips of that are read as far as there are any.
        let is_plain = tags.compression == COMPRESSION_NONE;
        let stored = if is_plain { chunks.file_len } else { chunks.lengths[0] };
        if !(is_plain && strips) && bytes > stored.saturating_mul(most_from_a_byte(tags.compression)) {
            let why = format!("its first strip or tile has {stored} bytes, which cannot hold {bytes}");
            return Err(InputFault::Damaged { place: "in the header".into(), why });
        }
        Ok(chunks)
    }

    /// Strips or tiles of one plane.
    fn count_per_plane(&self, header: &ImageHeader) -> u64 {
        u64::from(header.height.div_ceil(self.rows)) * u64::from(self.columns)
    }

    /// The number of a strip or tile, of a plane and a column, that holds `row`.
    fn number(&self, plane: u32, row: u32, column: u32, header: &ImageHeader) -> u32 {
        let per_plane = self.count_per_plane(header) as u32;
        plane * per_plane + row / self.rows * self.columns + column
    }

    /// Whether all that holds `row` lies within the file.
    fn check(&self, row: u32, header: &ImageHeader) -> Result<(), InputFault> {
        for plane in 0..self.planes {
            for column in 0..self.columns {
                let chunk = self.number(plane, row, column, header) as usize;
                let end = self.offsets[chunk].checked_add(self.lengths[chunk]);
                if end.is_none_or(|end| end > self.file_len) {
                    return Err(InputFault::Truncated { place: near_row(row, header.height) });
                }
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
        let (sample, planes) = (header.format.sample(), chunks.planes as usize);
        // What lies side by side in a plane: a texel, or one sample of it.
        let (unit, stored_unit) = match planes {
            1 => (texel, usize::from(header.format.channels()) * chunks.stored.bytes(sample)),
            _ => (sample.bytes(), chunks.stored.bytes(sample)),
        };
        let row_count = chunks.rows.min(header.height - first_row);
        self.first_row = first_row;
        self.rows.resize(row_count as usize * row_bytes, 0);
        // Planes of samples that are no part of the picture are passed over.
        for plane in 0..chunks.planes.min(header.format.channels().into()) {
            let mut left = 0;
            for column in 0..chunks.columns {
                let chunk = chunks.number(plane, first_row, column, header);
                let (width, height) = decoder.chunk_data_dimensions(chunk);
                let layout = decoder.image_chunk_buffer_layout(chunk).map_err(|e| fault(e, &place))?;
                let stored_row = width as usize * stored_unit;
                // The decoder counts what pads the last rows of later planes among their rows.
                let is_expected = height == row_count || (plane > 0 && height > row_count);
                if !is_expected || layout.complete_len != stored_row * height as usize {
                    return Err(InputFault::Damaged {
                        place,
                        why: "a strip or tile has an unexpected size".into(),
                    });
                }
                let direct = chunks.columns == 1 && planes == 1 && chunks.stored == Stored::AsItIs;
                let target = if direct { &mut self.rows } else { &mut self.tile };
                target.resize(layout.complete_len, 0);
                decoder.read_chunk_bytes(chunk, target).map_err(|e| fault(e, &place))?;
                let tile_row = width as usize * texel;
                if !direct {
                    let stored = self.tile.chunks_exact(stored_row.max(1));
                    for (row, tile) in self.rows.chunks_exact_mut(row_bytes).zip(stored) {
                        let texels = row[left..left + tile_row].chunks_exact_mut(texel);
                        let to = texels.map(|texel| &mut texel[plane as usize * unit..][..unit]);
                        self.rounded |= place_row(to, tile, chunks.stored, sample);
                    }
                }
                left += tile_row;
            }
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
        remedy: "convert it to grey, RGB or RGBA of 8 or 16 bits, of signed numbers or of floats",
    };
    if tags.planar == PLANAR && tags.compression == COMPRESSION_JPEG {
        return Err(unsupported("channels in separate planes, as JPEG".into()));
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
        (SIGNED, 8) => Sample::F16,
        (SIGNED, 16 | 32) => Sample::F32,
        (FLOAT, 16) => Sample::F16,
        (FLOAT, 32 | 64) => Sample::F32,
        (UNSIGNED | SIGNED, _) => return Err(unsupported(format!("samples of {bits} bits"))),
        (FLOAT, _) => return Err(unsupported(format!("floats of {bits} bits"))),
        _ => return Err(unsupported("samples that are complex or of no known kind".into())),
    };
    Ok((channels.with_sample(sample), is_ycbcr))
}

/// Says what of the file is not followed, and whether its colours are multiplied by alpha.
fn note(
    header: &mut ImageHeader,
    decoder: &mut Decoder<BufReader<File>>,
    tags: &Tags,
) -> Result<bool, InputFault> {
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
