//! PNG of every colour type and depth, by rows; interlaced files through the whole image, and a first picture
//! of them through their first pass.
//!
//! Palettes and samples of fewer than 8 bits are expanded, transparent colours become alpha; but who wants
//! them as they are stored gets the numbers and the palette ([`PngReader::as_stored`]).

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::sync::Arc;

use png::{BitDepth, ColorType, Decoder, DecodingError, Info, Limits, Reader, Transformations};

use super::beginning::Watched;
use super::exif;
use super::file::buffered;
use super::stored_as::{Palette, StoredAs, unpacked};
use crate::image::fault::near_row;
use crate::image::{
    Beginning, Converted, ImageHeader, InputFault, Notice, PixelFormat, Profile, RowReader, Sample,
};

/// The encoding gamma of light, times 100,000, as PNG stores it.
const LINEAR_GAMMA: u32 = 100_000;
/// The code points of sRGB: those of BT.709's primaries, and of its own curve.
const SRGB_CODE_POINTS: (u8, u8) = (1, 13);

/// Memory that the decoder may take for a row as it is stored.
const ROW_BYTES: u64 = 1 << 30;
/// What it may take besides: for a profile, and for the chunk in which that is compressed.
const PROFILE_BYTES: u64 = 32 << 20;
/// Bytes of a profile that are too few to count.
const USUAL_PROFILE_BYTES: u64 = 64 << 10;
/// Bytes that a texel has at most.
const TEXEL_BYTES: u64 = 8;
/// Chunks before the picture among which a profile is looked for.
const MAX_CHUNKS: u32 = 10_000;

/// Of so many texels across and down the first pass of an interlaced image has one.
const FIRST_PASS: u32 = 8;

/// A PNG file.
pub(super) struct PngReader {
    header: ImageHeader,
    reader: Reader<Watched<BufReader<File>>>,
    interlaced: bool,
    /// Of an interlaced image.
    beginning: Arc<Beginning>,
    /// True if the rows are those of the first pass alone.
    is_first_pass: bool,
    /// Where samples of fewer bits than a byte are handed out as they are stored: their bits, and a row of
    /// them.
    packed: Option<(u8, Vec<u8>)>,
    /// All rows of an interlaced image, once the first is asked for.
    image: Vec<u8>,
    next_row: u32,
}

impl PngReader {
    pub(super) fn new(file: File) -> Result<PngReader, InputFault> {
        PngReader::open(file, Transformations::EXPAND)
    }

    /// An image whose samples are numbers of a palette, or have fewer bits than a byte, with those samples as
    /// they are stored, a byte each, and what they are; `None` of other images.
    pub(super) fn as_stored(file: File) -> Result<Option<(PngReader, StoredAs)>, InputFault> {
        let mut reader = PngReader::open(file, Transformations::IDENTITY)?;
        let info = reader.reader.info();
        let bits = info.bit_depth as u8;
        let of = match info.color_type {
            ColorType::Indexed => {
                let colors = info.palette.as_deref().unwrap_or_default().as_chunks().0;
                let alphas = info.trns.as_deref().unwrap_or_default();
                StoredAs::Palette(Palette { colors: colors.into(), alphas: alphas.into() })
            }
            ColorType::Grayscale if bits < 8 => StoredAs::Grey { bits, is_white_zero: false },
            _ => return Ok(None),
        };
        let packed = reader.reader.output_line_size(info.width).filter(|_| bits < 8);
        reader.packed = packed.map(|bytes| (bits, vec![0; bytes]));
        Ok(Some((reader, of)))
    }

    fn open(mut file: File, how: Transformations) -> Result<PngReader, InputFault> {
        let width = check_size(&mut file)?;
        let has_profile = has_profile(&mut file)?;
        let limit = (u64::from(width) * TEXEL_BYTES).min(ROW_BYTES) + PROFILE_BYTES;
        let limits = Limits { bytes: usize::try_from(limit).unwrap_or(usize::MAX) };
        let beginning = Arc::new(Beginning::default());
        let len = file.metadata()?.len();
        let source = Watched::new(buffered(file), len, beginning.clone());
        let mut decoder = Decoder::new_with_limits(source, limits);
        decoder.set_transformations(how);
        decoder.set_ignore_text_chunk(true);
        let reader = decoder.read_info().map_err(|e| fault(e, "in the header".into()))?;
        // The decoder takes a palette for whole colours.
        if reader.info().palette.as_ref().is_some_and(|palette| !palette.len().is_multiple_of(3)) {
            let why = "its palette ends within a colour".into();
            return Err(InputFault::Damaged { place: "in the header".into(), why });
        }
        let (color, depth) = reader.output_color_type();
        let channels = match color {
            ColorType::Grayscale | ColorType::Indexed => PixelFormat::GREY8,
            ColorType::GrayscaleAlpha => PixelFormat::GREY_ALPHA8,
            ColorType::Rgb => PixelFormat::RGB8,
            ColorType::Rgba => PixelFormat::RGBA8,
        };
        let sample = if depth == BitDepth::Sixteen { Sample::U16 } else { Sample::U8 };
        let format = channels.with_sample(sample);
        let info = reader.info();
        let mut header = ImageHeader::new(info.width.into(), info.height.into(), format)?;
        // The decoder keeps a window of the deflate stream and two rows.
        let profile_len = info.icc_profile.as_ref().map_or(0, |profile| profile.len() as u64);
        let large_profile = profile_len.saturating_sub(USUAL_PROFILE_BYTES);
        header.memory = (256 << 10) + 4 * header.row_bytes() as u64 + 2 * large_profile;
        note(&mut header, info, has_profile);
        // Without the transformation numbers of a palette stay, and few bits.
        header.converted.extend(match (info.color_type, info.bit_depth as u8) {
            _ if how == Transformations::IDENTITY => None,
            (ColorType::Indexed, _) => Some(Converted::Palette),
            (_, bits @ 1..8) => Some(Converted::FewBits(bits)),
            _ => None,
        });
        let interlaced = info.interlaced;
        if interlaced {
            header.hold_whole_image(header.image_bytes(), "an interlaced PNG");
        }
        // What was taken of the header is no part of it.
        beginning.note(0, 1);
        let is_first_pass = false;
        let (packed, image) = (None, Vec::new());
        Ok(PngReader { header, reader, interlaced, beginning, is_first_pass, packed, image, next_row: 0 })
    }

    /// The first pass of an interlaced image, which has one of 64 texels and comes first in the file, if its
    /// longer side has half of `side` texels or more; `None` of other images.
    pub(super) fn reduced(mut self, side: u32) -> Option<PngReader> {
        let [width, height] = [self.header.width, self.header.height].map(|side| side.div_ceil(FIRST_PASS));
        if !self.interlaced || width.max(height) < side / 2 {
            return None;
        }
        self.header.memory = self.header.memory.saturating_sub(self.header.image_bytes());
        self.header.notices.retain(|notice| !matches!(notice, Notice::WholeImage { .. }));
        (self.header.width, self.header.height) = (width, height);
        (self.interlaced, self.is_first_pass) = (false, true);
        Some(self)
    }

    fn read_interlaced(&mut self, rows: &mut [u8]) -> Result<(), DecodingError> {
        if self.image.is_empty() {
            let len =
                usize::try_from(self.header.image_bytes()).map_err(|_| DecodingError::LimitsExceeded)?;
            self.image = vec![0; len];
            match &self.packed {
                None => {
                    self.reader.next_frame(&mut self.image)?;
                }
                Some((bits, row)) => {
                    let mut stored = vec![0; row.len() * self.header.height as usize];
                    self.reader.next_frame(&mut stored)?;
                    let rows = self.image.chunks_exact_mut(self.header.width as usize);
                    rows.zip(stored.chunks_exact(row.len())).for_each(|(to, row)| unpacked(row, *bits, to));
                }
            }
        }
        let start = self.next_row as usize * self.header.row_bytes();
        rows.copy_from_slice(&self.image[start..start + rows.len()]);
        self.next_row += (rows.len() / self.header.row_bytes()) as u32;
        Ok(())
    }

    fn read_by_row(&mut self, rows: &mut [u8]) -> Result<(), DecodingError> {
        for row in rows.chunks_exact_mut(self.header.row_bytes()) {
            match &mut self.packed {
                None => drop(self.reader.read_row(row)?),
                Some((bits, stored)) => {
                    self.reader.read_row(stored)?;
                    unpacked(stored, *bits, row);
                }
            }
            self.next_row += 1;
        }
        Ok(())
    }

    fn read(&mut self, rows: &mut [u8]) -> Result<(), DecodingError> {
        if self.interlaced {
            self.read_interlaced(rows)?;
        } else {
            self.read_by_row(rows)?;
        }
        if self.next_row == self.header.height {
            self.image = Vec::new();
            if !self.is_first_pass {
                self.reader.finish()?;
            }
        }
        Ok(())
    }
}

impl RowReader for PngReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn beginning(&self) -> Option<Arc<Beginning>> {
        self.interlaced.then(|| self.beginning.clone())
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        if rows.len() as u64 > u64::from(self.header.height - self.next_row) * self.header.row_bytes() as u64
        {
            let place = near_row(self.next_row, self.header.height);
            return Err(InputFault::Damaged { place, why: "it has no more rows".into() });
        }
        self.read(rows).map_err(|e| fault(e, near_row(self.next_row, self.header.height)))?;
        if self.reader.output_color_type().1 == BitDepth::Sixteen {
            for sample in rows.as_chunks_mut::<2>().0 {
                sample.reverse();
            }
        }
        Ok(())
    }
}

/// Refuses an image without texels; of anything else that is wrong with the header the decoder tells. Gives
/// the width, as far as there is one, and goes back to the start.
fn check_size(file: &mut File) -> Result<u32, InputFault> {
    let mut start = Vec::with_capacity(24);
    file.by_ref().take(24).read_to_end(&mut start)?;
    file.rewind()?;
    if let [.., w3, w2, w1, w0, h3, h2, h1, h0] = start[..]
        && start.len() == 24
    {
        let (width, height) = (u32::from_be_bytes([w3, w2, w1, w0]), u32::from_be_bytes([h3, h2, h1, h0]));
        if width == 0 || height == 0 {
            return Err(InputFault::NoTexels { width: width.into(), height: height.into() });
        }
        return Ok(width);
    }
    Ok(0)
}

/// Returns true if there is a profile before the picture: of one that it cannot read, the decoder says
/// nothing. Goes back to the start.
fn has_profile(file: &mut File) -> Result<bool, InputFault> {
    const SIGNATURE_BYTES: u64 = 8;
    let mut at = SIGNATURE_BYTES;
    let mut found = false;
    for _ in 0..MAX_CHUNKS {
        let mut start = Vec::with_capacity(8);
        file.seek(SeekFrom::Start(at))?;
        file.by_ref().take(8).read_to_end(&mut start)?;
        let &[l3, l2, l1, l0, ref kind @ ..] = &start[..] else { break };
        found |= kind == b"iCCP";
        if found || kind == b"IDAT" {
            break;
        }
        // The length, the kind and a checksum besides what the chunk holds.
        at += 12 + u64::from(u32::from_be_bytes([l3, l2, l1, l0]));
    }
    file.rewind()?;
    Ok(found)
}

/// What the file says of its colours, unless that is sRGB in so many words: of several chunks, the one that
/// counts.
fn profile(info: &Info<'_>, has_profile: bool) -> Option<Profile> {
    if let Some(points) = info.coding_independent_code_points {
        let (primaries, transfer) = (points.color_primaries, points.transfer_function);
        let is_plain = points.is_video_full_range_image && points.matrix_coefficients == 0;
        let is_srgb = (primaries, transfer) == SRGB_CODE_POINTS && is_plain;
        return (!is_srgb).then(|| Profile::code_points(primaries, transfer, is_plain));
    }
    if let Some(bytes) = &info.icc_profile {
        return Some(Profile::icc(bytes.as_ref()));
    }
    if has_profile {
        // Damaged, or too large to be one.
        return Some(Profile::icc([]));
    }
    if info.srgb.is_some() {
        return None;
    }
    let chromaticities = info.chrm_chunk.map(|points| {
        [points.white, points.red, points.green, points.blue].map(|(x, y)| [x.into_scaled(), y.into_scaled()])
    });
    Profile::curve(info.gama_chunk.map(|gamma| gamma.into_scaled()), chromaticities)
}

/// Says what of the header is not followed.
fn note(header: &mut ImageHeader, info: &Info<'_>, has_profile: bool) {
    header.profile = profile(info, has_profile);
    if info.coding_independent_code_points.is_none() && !has_profile && info.srgb.is_none() {
        let is_light = info.gama_chunk.is_some_and(|gamma| gamma.into_scaled() == LINEAR_GAMMA);
        header.linear = is_light && header.format.channels() > 1;
    }
    header.orientation = info.exif_metadata.as_deref().and_then(exif::orientation).unwrap_or(1);
    header.notices.extend(info.animation_control.map(|_| Notice::FurtherImagesIgnored));
}

fn fault(error: DecodingError, place: String) -> InputFault {
    match error {
        DecodingError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            InputFault::Truncated { place }
        }
        DecodingError::IoError(e) => InputFault::Io(e),
        DecodingError::LimitsExceeded => InputFault::Unsupported {
            what: "an image of a size that no memory holds".to_owned(),
            remedy: "check that it is what its header says, or split it",
        },
        other => InputFault::Damaged { place, why: other.to_string() },
    }
}
