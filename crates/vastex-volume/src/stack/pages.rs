//! The pages of a TIFF file, and their strips or tiles as chunks.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tiff::decoder::ifd::Value;
use tiff::decoder::{Decoder, DecodingSampleType, Limits};
use tiff::tags::{CompressionMethod, PhotometricInterpretation, PlanarConfiguration, Tag};
use tiff::{ColorType, TiffResult};
use vastex_tiles::read_advice;

use super::about::{PageOrder, PageTags, says_stack};
use crate::chunks::{AxisMap, Chunk, ChunkFuture, ChunkSource, Grid, Presence, PresenceFuture};
use crate::fault::{VolumeError, VolumeFault, damaged, unsupported};
use crate::flat::Layout;
use crate::values::{DType, swap_bytes};

/// Pages that are looked at.
const MOST_PAGES: u64 = 1 << 20;
/// Bytes of a strip or a tile, decoded.
const MOST_CHUNK: usize = 1 << 30;
/// Decoders that are kept, so that threads do not wait for each other.
const MOST_DECODERS: usize = 16;

/// Bytes of directories and of what they lead to that are read to find out what a file's pages are: the
/// places of strips and tiles take eight bytes or sixteen for each of them.
const MOST_DIRECTORIES: u64 = 256 << 20;
/// Pages up to which one is sought that is like the first, to find out whether a file is a stack: some
/// microscopes put a small picture beside each page.
const FIRST_PAGES: u64 = 4;

type FileDecoder = Decoder<Counted>;

/// A file of which so many bytes are read at most.
struct Counted {
    file: BufReader<File>,
    left: u64,
}

impl Read for Counted {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.file.read(buffer)?;
        self.left = self.left.checked_sub(read as u64).ok_or_else(|| {
            io::Error::other(format!("its directories lead to more than {MOST_DIRECTORIES} bytes"))
        })?;
        Ok(read)
    }
}

impl Seek for Counted {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// What all pages of a stack have in common.
#[derive(Clone, Debug, PartialEq)]
struct Page {
    size: (u32, u32),
    chunk: (u32, u32),
    color: ColorType,
    dtype: DType,
    samples: u16,
}

/// The pages of a stack.
pub(super) struct Pages {
    path: PathBuf,
    page: Page,
    /// The pages' places among the file's directories.
    places: Vec<usize>,
    description: String,
    tags: PageTags,
    /// Where the values begin if the file has one directory for many pages, as ImageJ writes large stacks.
    run: Option<(u64, u64)>,
    is_big_endian: bool,
}

/// Returns true if a file is TIFF with several pages of one size, or with one that stands for many.
pub(crate) fn is_stack(path: &Path) -> bool {
    let mut start = [0; 4];
    let is_tiff = File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok()
        && [&b"II\x2a\0"[..], b"II\x2b\0", b"MM\0\x2a", b"MM\0\x2b"].contains(&&start[..]);
    is_tiff && Pages::open_first(path, FIRST_PAGES, &mut Vec::new()).is_ok_and(|pages| pages.count() > 1)
}

/// Returns true if a file is TIFF with several pages of colours, of which nothing says that they are a stack.
pub(crate) fn are_pictures(path: &Path) -> bool {
    is_stack(path)
        && Pages::open_first(path, FIRST_PAGES, &mut Vec::new())
            .is_ok_and(|pages| pages.has_colors() && !says_stack(&pages.description) && pages.run.is_none())
}

/// A decoder that reads so many bytes at most.
fn decoder(path: &Path, left: u64) -> TiffResult<FileDecoder> {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MOST_CHUNK;
    limits.intermediate_buffer_size = MOST_CHUNK;
    limits.ifd_value_size = 64 << 20;
    Ok(Decoder::new(Counted { file: BufReader::new(File::open(path)?), left })?.with_limits(limits))
}

fn page_of(decoder: &mut FileDecoder) -> TiffResult<Result<Page, String>> {
    let size = decoder.dimensions()?;
    let color = decoder.colortype()?;
    let is_planar = decoder
        .find_tag_unsigned::<u16>(Tag::PlanarConfiguration)?
        .is_some_and(|planar| planar == PlanarConfiguration::Planar.to_u16());
    let samples = color.num_samples();
    if samples > 1 && is_planar {
        return Ok(Err(
            "has a plane for each of its colours, which is not read; write them side by side".into()
        ));
    }
    let photometric = decoder.find_tag_unsigned::<u16>(Tag::PhotometricInterpretation)?;
    // The decoder turns white-is-zero round, which is not what is stored.
    if photometric == Some(PhotometricInterpretation::WhiteIsZero.to_u16()) {
        return Ok(Err(
            "is stored with white as 0, which is not read exactly; write it with black as 0".into()
        ));
    }
    let sample = decoder.image_chunk_buffer_layout(0)?.sample_type;
    let dtype = match sample {
        Some(DecodingSampleType::U8) => DType::U8,
        Some(DecodingSampleType::U16) => DType::U16,
        Some(DecodingSampleType::U32) => DType::U32,
        Some(DecodingSampleType::U64) => DType::U64,
        Some(DecodingSampleType::I8) => DType::I8,
        Some(DecodingSampleType::I16) => DType::I16,
        Some(DecodingSampleType::I32) => DType::I32,
        Some(DecodingSampleType::I64) => DType::I64,
        Some(DecodingSampleType::F16) => DType::F16,
        Some(DecodingSampleType::F32) => DType::F32,
        Some(DecodingSampleType::F64) => DType::F64,
        _ => return Ok(Err(format!("has values of {color:?}, which are not read"))),
    };
    if usize::from(color.bit_depth()) != 8 * dtype.bytes() {
        return Ok(Err(format!(
            "has values of {} bits, of which 8, 16, 32 and 64 are read",
            color.bit_depth()
        )));
    }
    let chunk = decoder.chunk_dimensions();
    Ok(Ok(Page { size, chunk, color, dtype, samples }))
}

impl Pages {
    pub(super) fn open(path: &Path, oddities: &mut Vec<String>) -> Result<Pages, VolumeError> {
        Pages::open_first(path, MOST_PAGES, oddities)
    }

    /// The first `most` pages of a file.
    fn open_first(path: &Path, most: u64, oddities: &mut Vec<String>) -> Result<Pages, VolumeError> {
        let at = |fault: VolumeFault| fault.at(path.display().to_string());
        let wrong = |error: tiff::TiffError| at(damaged(format!("is no sound TIFF: {error}; copy it anew")));
        let mut decoder = decoder(path, MOST_DIRECTORIES).map_err(wrong)?;
        let page = page_of(&mut decoder).map_err(wrong)?.map_err(|why| at(unsupported(why)))?;
        let description = decoder.get_tag_ascii_string(Tag::ImageDescription).unwrap_or_default();
        let tags = tags_of(&mut decoder, &page);
        let is_big_endian = decoder.byte_order() == tiff::tags::ByteOrder::BigEndian;
        let run = run_of(&mut decoder, &description, &page);
        let mut places = vec![0];
        let (mut place, mut left_out) = (0, 0);
        while decoder.more_images() {
            place += 1;
            if place as u64 == most {
                oddities.push(format!("has more than {most} pages; the others are left out"));
                break;
            }
            match decoder.next_image().and_then(|()| page_of(&mut decoder)) {
                Ok(Ok(other)) if other == page => places.push(place),
                Ok(_) => left_out += 1,
                Err(error) => {
                    oddities.push(format!("the pages from {place} on cannot be read: {error}"));
                    break;
                }
            }
        }
        if left_out > 0 {
            oddities.push(format!(
                "{left_out} pages have another size or other values than the first one, and are left out"
            ));
        }
        let len = std::fs::metadata(path).map_err(|error| at(VolumeFault::Read(read_advice(&error))))?.len();
        let page_bytes = u64::from(page.size.0) * u64::from(page.size.1) * page.dtype.bytes() as u64;
        let run = run.filter(|_| places.len() == 1).and_then(|(offset, count)| {
            let fit = len.saturating_sub(offset) / page_bytes.max(1);
            if fit < count {
                oddities.push(format!(
                    "ImageJ's description says that {count} pages lie in it, and it is long enough for {fit}; those are read"
                ));
            }
            Some((offset, count.min(fit))).filter(|(_, count)| *count > 1)
        });
        Ok(Pages { path: path.into(), page, places, description, tags, run, is_big_endian })
    }

    pub(super) fn count(&self) -> u64 {
        self.run.map_or(self.places.len() as u64, |(_, count)| count)
    }

    pub(super) fn description(&self) -> &str {
        &self.description
    }

    pub(super) fn tags(&self) -> &PageTags {
        &self.tags
    }

    /// Returns true if each page has red, green and blue of its own.
    pub(super) fn has_colors(&self) -> bool {
        matches!(self.page.color, ColorType::RGB(_) | ColorType::RGBA(_))
    }

    pub(super) fn dtype(&self) -> DType {
        self.page.dtype
    }

    /// The chunks of a stack whose pages have such axes, the slowest first.
    pub(super) fn grid(&self, pages: [u64; 3], order: PageOrder) -> Grid {
        let Page { size, chunk, samples, .. } = &self.page;
        // Colours within a page are channels where its pages are none.
        let is_colored = *samples > 1;
        let axes = AxisMap {
            x: 4,
            y: 3,
            z: Some(order.place('Z')),
            channel: Some(if is_colored { 5 } else { order.place('C') }),
            time: Some(order.place('T')),
        };
        let [a, b, c] = pages;
        Grid {
            shape: vec![a, b, c, size.1.into(), size.0.into(), (*samples).into()],
            chunk: vec![1, 1, 1, u64::from(chunk.1).max(1), u64::from(chunk.0).max(1), (*samples).into()],
            axes,
        }
    }

    /// Where all values lie in one run, if they do.
    pub(super) fn one_run(&self, grid: &Grid) -> Option<Layout> {
        let (offset, _) = self.run?;
        let layout = Layout {
            offset,
            dtype: self.page.dtype,
            is_big_endian: self.is_big_endian,
            shape: grid.shape.clone(),
        };
        let len = std::fs::metadata(&self.path).ok()?.len();
        layout.bytes().filter(|bytes| offset.saturating_add(*bytes) <= len).map(|_| layout)
    }

    pub(super) fn source(self, grid: &Grid) -> PageChunks {
        PageChunks { grid: grid.clone(), pages: self, decoders: Mutex::new(Vec::new()) }
    }
}

/// What tags say of pixels. What cannot be read of them says nothing.
fn tags_of(decoder: &mut FileDecoder, page: &Page) -> PageTags {
    let pixels = [Tag::XResolution, Tag::YResolution].map(|tag| match decoder.find_tag(tag).ok()?? {
        Value::Rational(count, of) => Some(f64::from(count) / f64::from(of)),
        Value::Float(pixels) => Some(f64::from(pixels)),
        Value::Double(pixels) => Some(pixels),
        _ => None,
    });
    let pixels = pixels.map(|pixels| pixels.filter(|pixels| pixels.is_normal() && *pixels > 0.0));
    let unit = match decoder.find_tag_unsigned::<u16>(Tag::ResolutionUnit) {
        Ok(Some(1)) => None,
        Ok(Some(3)) => Some("centimeter"),
        // What the specification takes where it is not said.
        _ => Some("inch"),
    };
    PageTags { samples: page.samples.into(), pixels, unit }
}

/// Where the values of many pages begin that have one directory, and how many pages they are.
fn run_of(decoder: &mut FileDecoder, description: &str, page: &Page) -> Option<(u64, u64)> {
    if !description.starts_with("ImageJ=") {
        return None;
    }
    let count =
        description.lines().find_map(|line| line.strip_prefix("images="))?.trim().parse::<u64>().ok()?;
    let compression = decoder.find_tag_unsigned::<u16>(Tag::Compression).ok()?.unwrap_or(1);
    let offsets = decoder.get_tag_u64_vec(Tag::StripOffsets).ok()?;
    let is_plain = compression == CompressionMethod::None.to_u16() && offsets.len() == 1 && page.samples == 1;
    (is_plain && count > 1).then(|| (offsets[0], count))
}

/// Strips or tiles of pages.
pub(super) struct PageChunks {
    grid: Grid,
    pages: Pages,
    decoders: Mutex<Vec<FileDecoder>>,
}

impl PageChunks {
    fn read_now(&self, coords: &[u64]) -> Result<Chunk, VolumeError> {
        let shape = &self.grid.shape;
        let page = ((coords[0] * shape[1] + coords[1]) * shape[2] + coords[2]) as usize;
        let at = |fault: VolumeFault| fault.at(format!("{}, page {page}", self.pages.path.display()));
        let wrong =
            |error: tiff::TiffError| at(damaged(format!("cannot be decoded: {error}; copy the file anew")));
        let kept = self.decoders.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut decoder = match kept {
            Some(decoder) => decoder,
            None => decoder(&self.pages.path, u64::MAX).map_err(wrong)?,
        };
        let place = self.pages.places.get(page).copied().unwrap_or(usize::MAX);
        decoder.seek_to_image(place).map_err(wrong)?;
        let across = shape[4].div_ceil(self.grid.chunk[4]);
        let index = u32::try_from(coords[3] * across + coords[4]).unwrap_or(u32::MAX);
        let len = decoder.image_chunk_buffer_layout(index).map_err(wrong)?.len;
        let sides = [3, 4].map(|axis| {
            self.grid.chunk[axis].min(shape[axis] - coords[axis] * self.grid.chunk[axis]) as usize
        });
        let samples = usize::from(self.pages.page.samples);
        let width = self.pages.page.dtype.bytes();
        let expected = sides[0] * sides[1] * samples * width;
        if len != expected || len > MOST_CHUNK {
            return Err(at(damaged(format!(
                "has a strip or tile of {len} bytes where {expected} are right; copy the file anew"
            ))));
        }
        let mut bytes = vec![0; len];
        decoder.read_chunk_bytes(index, &mut bytes).map_err(wrong)?;
        let mut decoders = self.decoders.lock().unwrap_or_else(PoisonError::into_inner);
        if decoders.len() < MOST_DECODERS {
            decoders.push(decoder);
        }
        if cfg!(target_endian = "big") {
            swap_bytes(&mut bytes, width);
        }
        let strides = [0, 0, 0, sides[1] * samples * width, samples * width, width];
        Ok(Chunk::new(bytes, strides, len))
    }
}

impl ChunkSource for PageChunks {
    fn read<'a>(&'a self, coords: &'a [u64]) -> ChunkFuture<'a> {
        Box::pin(async move { self.read_now(coords).map(Some) })
    }

    fn fill(&self) -> [u8; 8] {
        [0; 8]
    }

    fn presence(&self, _: usize) -> PresenceFuture<'_> {
        Box::pin(async { Ok(Presence::All) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes two pages of red, green and blue, and what the first one says.
    fn colored(path: &Path, says: Option<&str>) {
        let mut encoder = tiff::encoder::TiffEncoder::new(File::create(path).unwrap()).unwrap();
        for page in 0..2 {
            let mut image = encoder.new_image::<tiff::encoder::colortype::RGB16>(5, 4).unwrap();
            if let Some(says) = says {
                image.encoder().write_tag(Tag::ImageDescription, says).unwrap();
            }
            image.write_data(&[page; 60]).unwrap();
        }
    }

    #[test]
    fn pages_of_colours_are_pictures_unless_something_calls_them_a_stack() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("pages.tif");
        for (says, are) in [
            (None, true),
            (Some("scanned on a Monday"), true),
            (Some("ImageJ=1.54f\nimages=2\nslices=2\n"), false),
            (Some("<?xml version=\"1.0\"?><OME xmlns=\"x\"/>"), false),
        ] {
            colored(&path, says);
            assert!(is_stack(&path), "{says:?}");
            assert_eq!(crate::open::are_pictures(&path), are, "{says:?}");
            let crate::Opened::Volume(volume) = crate::open(&path).unwrap() else { panic!("no volume") };
            let told: Vec<_> =
                volume.about().channel_info.iter().map(|channel| (channel.color, channel.window)).collect();
            let whole = Some([0.0, 65535.0]);
            let codes = [[255, 0, 0], [0, 255, 0], [0, 0, 255]].map(|color| (Some(color), whole));
            assert_eq!(told, codes, "{says:?}");
            let source = crate::VolumeSource::open(volume.into(), &crate::VolumeOptions::default()).unwrap();
            assert_eq!(pollster::block_on(source.usual_window()).unwrap(), [0.0, 65535.0]);
        }
        assert!(!are_pictures(&Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/layers.tif")));
    }

    #[test]
    fn directories_are_read_up_to_a_number_of_bytes() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/layers.tif");
        let error = decoder(&path, 64).err().unwrap().to_string();
        assert!(error.contains("more than"), "{error}");
        assert!(decoder(&path, MOST_DIRECTORIES).is_ok());
    }
}
