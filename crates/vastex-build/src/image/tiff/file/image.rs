//! What one directory says of its image: its size, how it is cut, what its samples are and how they are
//! compressed.

use std::sync::Arc;

use super::entry::{Directory, Entry};
use super::{TiffFile, about, codecs, damaged};
use crate::image::{ImageHeader, InputFault, Number, PixelFormat};

/// Tags.
pub(super) const WIDTH: u16 = 256;
pub(super) const HEIGHT: u16 = 257;
const BITS: u16 = 258;
const COMPRESSION: u16 = 259;
const PHOTOMETRIC: u16 = 262;
const FILL_ORDER: u16 = 266;
const COLOR_MAP: u16 = 320;
const STRIP_OFFSETS: u16 = 273;
pub(super) const ORIENTATION: u16 = 274;
const SAMPLES: u16 = 277;
const ROWS_PER_STRIP: u16 = 278;
const STRIP_LENGTHS: u16 = 279;
const PLANAR: u16 = 284;
const PREDICTOR: u16 = 317;
const TILE_WIDTH: u16 = 322;
const TILE_HEIGHT: u16 = 323;
pub(super) const TILE_OFFSETS: u16 = 324;
const TILE_LENGTHS: u16 = 325;
const INK_SET: u16 = 332;
const EXTRA_SAMPLES: u16 = 338;
const SAMPLE_FORMAT: u16 = 339;
const JPEG_TABLES: u16 = 347;
const ICC_PROFILE: u16 = 34675;

/// Values of PhotometricInterpretation.
pub(super) const WHITE_IS_ZERO: u64 = 0;
pub(super) const BLACK_IS_ZERO: u64 = 1;
pub(super) const RGB: u64 = 2;
pub(super) const PALETTE: u64 = 3;
pub(super) const MASK: u64 = 4;
pub(super) const INKS: u64 = 5;
pub(super) const YCBCR: u64 = 6;
/// Texels along a side of a tile, at least: TIFF has multiples of 16.
const LEAST_TILE: u32 = 16;
/// Samples that a texel may have.
const MOST_SAMPLES: u64 = 512;
/// Bytes that tables for JPEG and a colour profile may have.
const MOST_TABLE_BYTES: u64 = 1 << 20;
const MOST_PROFILE_BYTES: u64 = 16 << 20;
/// Bytes of the parts that one strip is taken for.
const CUT_BYTES: u64 = 1 << 20;
/// A value of InkSet: cyan, magenta, yellow and black.
const CMYK: u64 = 1;
/// Bits of a sample that chooses a colour of a palette, at most.
const MOST_PALETTE_BITS: u64 = 16;
/// What cannot be read can be converted to what can.
pub(super) const CONVERT: &str = "convert it to a TIFF of tiles, uncompressed, Deflate, LZW, Zstandard or JPEG, of grey, RGB, CMYK or a palette";

/// The bands of an image that are shown, where it has more than a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Pick {
    /// One, or those that are red, green and blue, counted from 0.
    pub(super) bands: Vec<u16>,
    /// True if somebody asked for them.
    pub(super) is_asked: bool,
}

/// An image of a file, whose strips are tiles of the image's whole width.
#[derive(Clone)]
pub(crate) struct TiffImage {
    pub(super) file: Arc<TiffFile>,
    /// Texels per row, and rows.
    pub(crate) size: [u32; 2],
    /// Columns and rows of a strip or tile; those of the last column and row of tiles reach beyond the image.
    pub(crate) chunk: [u32; 2],
    pub(crate) is_tiled: bool,
    /// True if its strips are parts of the one strip of a plane, which is not compressed.
    pub(super) is_cut: bool,
    /// Channels of a texel as it is stored, alpha and others included.
    pub(crate) samples: u16,
    pub(crate) number: Number,
    pub(super) bits: u64,
    pub(super) sample_format: u64,
    pub(crate) photometric: u64,
    pub(crate) compression: u64,
    pub(super) predictor: u64,
    /// True if the lowest bit of each byte comes first.
    pub(super) is_reversed: bool,
    /// Which inks the samples are of, where they are of inks.
    pub(super) inks: u64,
    /// True if each channel has strips or tiles of its own.
    pub(super) is_planar: bool,
    /// The bands that are shown, where they are others than the first ones as the file means them.
    pub(super) pick: Option<Pick>,
    /// What the samples beyond the colours are.
    pub(super) extra: Vec<u64>,
    pub(crate) orientation: u64,
    pub(super) offsets: Entry,
    /// Where it is missing, strips and tiles that are not compressed have the bytes that they need.
    pub(super) lengths: Option<Entry>,
    pub(super) tables: Arc<[u8]>,
    /// The colours that samples choose from; none where they are colours themselves.
    pub(super) palette: Arc<[[u8; 3]]>,
    /// What strips and tiles that are not stored consist of.
    pub(super) nodata: Option<f64>,
    pub(crate) profile: Option<Arc<[u8]>>,
    /// The directory, for messages.
    pub(super) place: String,
}

impl TiffImage {
    /// Reads what a directory says, but neither texels nor lists of strips and tiles.
    pub(super) fn read(file: &Arc<TiffFile>, directory: &Directory) -> Result<TiffImage, InputFault> {
        TiffImage::read_beside(file, directory, None)
    }

    /// Reads, as [`TiffImage::read`] does, an image that may be a level of another one: libvips says in the
    /// first directory alone that samples are signed or floats, so where it is not said, they are as the
    /// other's of as many bits.
    pub(super) fn read_beside(
        file: &Arc<TiffFile>,
        directory: &Directory,
        first: Option<&TiffImage>,
    ) -> Result<TiffImage, InputFault> {
        let place = directory.place.clone();
        let number = |tag, missing| Ok::<u64, InputFault>(directory.number(file, tag)?.unwrap_or(missing));
        let size = [number(WIDTH, 0)?, number(HEIGHT, 0)?];
        // Judges the size.
        let header = ImageHeader::new(size[0], size[1], PixelFormat::GREY8)?;
        let size = [header.width, header.height];
        let is_tiled = directory.entry(TILE_OFFSETS).is_some();
        let chunk = match is_tiled {
            true => [number(TILE_WIDTH, 0)?, number(TILE_HEIGHT, 0)?],
            false => [size[0].into(), number(ROWS_PER_STRIP, u64::MAX)?.min(size[1].into())],
        };
        let [Ok(chunk_width), Ok(chunk_height)] = chunk.map(u32::try_from) else {
            return Err(damaged(&place, format!("its tiles have {}x{} texels", chunk[0], chunk[1])));
        };
        if chunk_width == 0 || chunk_height == 0 {
            return Err(damaged(&place, "its strips or tiles have no texels"));
        }
        let is_small = |axis: usize| [chunk_width, chunk_height][axis] < size[axis].min(LEAST_TILE);
        if is_tiled && (is_small(0) || is_small(1)) {
            return Err(unsupported(format!("tiles of {chunk_width}x{chunk_height} texels")));
        }
        let samples = number(SAMPLES, 1)?;
        if samples == 0 || samples > MOST_SAMPLES {
            return Err(damaged(&place, format!("its texels have {samples} samples")));
        }
        let all_equal = |tag, missing| {
            let values = directory.numbers(file, tag, MOST_SAMPLES)?;
            let first = values.first().copied().unwrap_or(missing);
            if values.iter().any(|value| *value != first) {
                return Err(unsupported("channels that are stored differently".into()));
            }
            Ok(first)
        };
        let bits = all_equal(BITS, 1)?;
        let photometric = number(PHOTOMETRIC, BLACK_IS_ZERO)?;
        let unsaid = first.filter(|first| first.bits == bits).map_or(1, |first| first.sample_format);
        let sample_format = all_equal(SAMPLE_FORMAT, unsaid)?;
        let compression = number(COMPRESSION, codecs::NONE)?;
        let is_reversed = number(FILL_ORDER, 1)? == 2;
        // JPEG says by itself in which order its bits come.
        if is_reversed && ![codecs::FAX4, codecs::JPEG].contains(&compression) {
            return Err(unsupported("bytes whose lowest bit comes first".into()));
        }
        let (offsets, lengths) = match is_tiled {
            true => (TILE_OFFSETS, TILE_LENGTHS),
            false => (STRIP_OFFSETS, STRIP_LENGTHS),
        };
        let offsets = directory.entry(offsets).ok_or_else(|| damaged(&place, "it has no strips or tiles"))?;
        let tables = directory.raw(file, JPEG_TABLES, MOST_TABLE_BYTES)?.unwrap_or_default();
        let image = TiffImage {
            file: file.clone(),
            size,
            chunk: [chunk_width, chunk_height],
            is_tiled,
            is_cut: false,
            samples: samples as u16,
            number: number_of(sample_format, bits).ok_or_else(|| not_known(sample_format, bits))?,
            bits,
            sample_format,
            photometric,
            compression,
            is_reversed,
            predictor: number(PREDICTOR, 1)?,
            inks: number(INK_SET, CMYK)?,
            is_planar: samples > 1 && number(PLANAR, 1)? == 2,
            pick: None,
            extra: directory.numbers(file, EXTRA_SAMPLES, MOST_SAMPLES)?,
            orientation: number(ORIENTATION, 1)?,
            offsets: *offsets,
            lengths: directory.entry(lengths).copied(),
            tables: tables.into(),
            palette: match photometric {
                PALETTE => palette(file, directory, bits, first)?,
                _ => Arc::default(),
            },
            nodata: about::nodata(file, directory)?,
            profile: directory.raw(file, ICC_PROFILE, MOST_PROFILE_BYTES)?.map(Into::into),
            place,
        };
        image.check()?;
        Ok(image.pick_first())
    }

    /// This image, the one strip of a plane taken for several where that is possible without decoding it.
    pub(crate) fn cut(mut self) -> TiffImage {
        let row_bytes = self.packed_row();
        self.is_cut = !self.is_tiled
            && self.compression == codecs::NONE
            && self.chunk[1] >= self.size[1]
            && row_bytes < CUT_BYTES;
        if self.is_cut {
            self.chunk[1] = ((CUT_BYTES / row_bytes) as u32).min(self.size[1]);
        }
        self
    }

    /// Refuses what cannot be decoded, and lists that do not have all strips or tiles.
    fn check(&self) -> Result<(), InputFault> {
        let count = u64::from(self.columns()) * u64::from(self.rows()) * u64::from(self.planes());
        let listed = self.lengths.as_ref().map_or(self.offsets.count, |list| list.count);
        let listed = listed.min(self.offsets.count);
        if listed < count {
            let why = format!("it lists {listed} strips or tiles of {count}");
            return Err(damaged(&self.place, why));
        }
        if self.lengths.is_none() && self.compression != codecs::NONE {
            return Err(damaged(&self.place, "it does not say how long its strips or tiles are"));
        }
        let (bits, samples) = (self.bits, self.samples_of_chunk());
        let is_float = matches!(self.number, Number::F16 | Number::F32 | Number::F64);
        let is_jpeg_2000 = codecs::is_jpeg_2000(self.compression);
        if self.photometric == INKS && self.inks != CMYK {
            return Err(unsupported("inks other than cyan, magenta, yellow and black".into()));
        }
        match self.compression {
            _ if self.has_few_bits() && (is_jpeg_2000 || self.compression == codecs::JPEG) => {
                let name = codecs::name(self.compression);
                return Err(unsupported(format!("{name} of samples of {bits} bits")));
            }
            codecs::JPEG if self.number != Number::U8 || ![1, 3, 4].contains(&samples) => {
                return Err(unsupported(format!("JPEG of {samples} samples of {bits} bits")));
            }
            _ if is_jpeg_2000 && ![Number::U8, Number::U16].contains(&self.number) => {
                return Err(unsupported(format!("JPEG 2000 of {bits} bits")));
            }
            codecs::FAX4 if bits != 1 || samples != 1 => {
                return Err(unsupported(format!("fax of {samples} samples of {bits} bits")));
            }
            codecs::NONE | codecs::JPEG | codecs::FAX4 => {}
            _ if is_jpeg_2000 => {}
            codecs::DEFLATE | codecs::OLD_DEFLATE | codecs::LZW | codecs::ZSTD | codecs::PACKBITS => {
                let is_known =
                    matches!(self.predictor, 1 | 2) && !(self.predictor == 2 && self.has_few_bits());
                if !is_known && (self.predictor != 3 || !is_float) {
                    let predictor = self.predictor;
                    return Err(unsupported(format!("predictor {predictor} of samples of {bits} bits")));
                }
            }
            other => return Err(unsupported(format!("a TIFF compressed by {}", codecs::name(other)))),
        }
        let is_encoded = self.compression == codecs::JPEG || is_jpeg_2000;
        if self.photometric == YCBCR && is_encoded && (samples, self.number) != (3, Number::U8) {
            return Err(unsupported(format!("YCbCr of {samples} samples of {bits} bits in a strip or tile")));
        }
        // Elsewhere colours may have a lower resolution than what is beside them.
        if self.photometric == YCBCR && self.compression != codecs::JPEG && !is_jpeg_2000 {
            return Err(unsupported("YCbCr that is not JPEG".into()));
        }
        Ok(())
    }

    /// The file that it is in.
    pub(crate) fn file(&self) -> &Arc<TiffFile> {
        &self.file
    }

    /// Tiles along a row; 1 for strips.
    pub(crate) fn columns(&self) -> u32 {
        self.size[0].div_ceil(self.chunk[0])
    }

    /// Strips, or rows of tiles.
    pub(crate) fn rows(&self) -> u32 {
        self.size[1].div_ceil(self.chunk[1])
    }

    /// Strips or tiles that a place of the image has: one, or one for each channel.
    pub(super) fn planes(&self) -> u32 {
        if self.is_planar { u32::from(self.samples) } else { 1 }
    }

    /// Samples of a texel that lie side by side in a strip or tile.
    pub(in crate::image::tiff) fn samples_of_chunk(&self) -> usize {
        if self.is_planar { 1 } else { self.samples.into() }
    }

    /// Returns true if a sample has fewer bits than a byte, so that several are packed into one. They are
    /// unpacked, and as they are otherwise, wherever texels are spoken of.
    pub(super) fn has_few_bits(&self) -> bool {
        self.bits < 8
    }

    /// Bytes of a row of a strip or tile, or of a plane of one, as it is before compression.
    pub(super) fn packed_row(&self) -> u64 {
        let samples = u64::from(self.chunk[0]) * self.samples_of_chunk() as u64;
        match self.has_few_bits() {
            true => (samples * self.bits).div_ceil(8),
            false => samples * self.number.bytes() as u64,
        }
    }

    /// Bytes of a texel as it is stored.
    pub(crate) fn texel_bytes(&self) -> usize {
        usize::from(self.samples) * self.number.bytes()
    }

    /// Bytes of one decoded strip or tile, of all its channels.
    pub(crate) fn chunk_bytes(&self) -> u64 {
        let texels = u64::from(self.chunk[0]) * u64::from(self.chunk[1]);
        texels.saturating_mul(self.texel_bytes() as u64)
    }

    /// What its compression is called.
    pub(crate) fn compression_name(&self) -> String {
        codecs::name(self.compression)
    }

    /// Refuses strips or tiles of more bytes than `most`, of which single ones are asked for, with a remedy.
    pub(crate) fn check_chunk(&self, most: u64, remedy: &'static str) -> Result<(), InputFault> {
        let bytes = self.chunk_bytes();
        if bytes > most {
            let what = if self.is_tiled { "tiles" } else { "strips" };
            let (mib, most) = (bytes.div_ceil(1 << 20), most >> 20);
            let what = format!("{what} of {mib} MiB each, more than the {most} MiB that are decoded at once");
            return Err(InputFault::Unsupported { what, remedy });
        }
        Ok(())
    }
}

pub(super) fn unsupported(what: String) -> InputFault {
    InputFault::Unsupported { what, remedy: CONVERT }
}

/// How samples are handed out: of fewer bits than a byte, each as a byte.
fn number_of(sample_format: u64, bits: u64) -> Option<Number> {
    let is_few = matches!(bits, 1 | 2 | 4);
    Number::new(sample_format, if is_few { 8 } else { bits })
        .filter(|number| !is_few || *number == Number::U8)
}

/// The colours of a palette: all of red, then of green, then of blue. Old files have 8 bits of each, others
/// 16. A level that has none has that of the first image.
fn palette(
    file: &Arc<TiffFile>,
    directory: &Directory,
    bits: u64,
    first: Option<&TiffImage>,
) -> Result<Arc<[[u8; 3]]>, InputFault> {
    let count = 1usize << bits.min(MOST_PALETTE_BITS);
    let values = directory.numbers(file, COLOR_MAP, 3 << MOST_PALETTE_BITS)?;
    match first {
        Some(first) if values.is_empty() => return Ok(first.palette.clone()),
        _ if values.len() < 3 * count => {
            let why = format!("its palette has {} numbers of {}", values.len(), 3 * count);
            return Err(damaged(&directory.place, why));
        }
        _ => {}
    }
    let shift = if values.iter().all(|value| *value < 256) { 0 } else { 8 };
    let color = |n: usize| [0, 1, 2].map(|channel| (values[channel * count + n] >> shift) as u8);
    Ok((0..count).map(color).collect())
}

fn not_known(sample_format: u64, bits: u64) -> InputFault {
    unsupported(match sample_format {
        1 | 2 => format!("samples of {bits} bits"),
        3 => format!("floats of {bits} bits"),
        _ => "samples that are complex or of no known kind".into(),
    })
}
