//! A TIFF file by its directories: any strip or tile of any of its images, in any order, by any number of
//! threads.
//!
//! [`TiffFile`] reads at places of its own and has no state, so nothing is locked. [`entry`] has the values
//! of a directory, which are read when they are asked for; [`walk`] finds the directories, [`image`] what
//! one of them says of its image, [`chunk`] decodes a strip or tile by [`codecs`], [`fax4`], [`jpeg2000`]
//! and [`predictor`], [`strip_rows`] strips from the top down; [`converted`] makes colours of palettes, inks
//! and bits. What a file says of its place on the Earth or of its pixels' size is in [`about`]. Whatever a
//! file claims is compared with its length before anything is allocated for it.

pub(crate) mod about;
mod bands;
mod chunk;
pub(crate) mod codecs;
mod converted;
mod entry;
mod fax4;
mod image;
mod jpeg2000;
mod predictor;
pub(crate) mod pyramid;
mod shown;
pub(crate) mod strip_rows;
mod walk;

use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

use vastex_tiles::{StoreCounter, StoreStats};

use crate::image::InputFault;
use crate::image::file::open_file;
use crate::image::positioned::read_exact_at;

pub(crate) use image::TiffImage;

/// A TIFF file, classic or Big, of either byte order.
pub(crate) struct TiffFile {
    file: Arc<File>,
    len: u64,
    is_big_endian: bool,
    /// True if offsets have 64 bits.
    is_big: bool,
    /// Where the first directory lies.
    first: u64,
    /// What was read.
    reads: StoreCounter,
}

impl TiffFile {
    /// Opens a file; `None` if its first bytes are not those of TIFF.
    pub(crate) fn open(path: &Path) -> Result<Option<Arc<TiffFile>>, InputFault> {
        TiffFile::of(Arc::new(open_file(path)?)).map(|file| file.map(Arc::new))
    }

    /// As [`TiffFile::open`], of a file that is open already.
    pub(crate) fn of(file: Arc<File>) -> Result<Option<TiffFile>, InputFault> {
        let len = file.metadata()?.len();
        let mut start = [0; 16];
        let found = len.min(16) as usize;
        read_exact_at(&file, &mut start[..found], 0)?;
        let (is_big_endian, is_big) = match start {
            [b'I', b'I', 42, 0, ..] => (false, false),
            [b'M', b'M', 0, 42, ..] => (true, false),
            [b'I', b'I', 43, 0, ..] => (false, true),
            [b'M', b'M', 0, 43, ..] => (true, true),
            _ => return Ok(None),
        };
        let mut file =
            TiffFile { file, len, is_big_endian, is_big, first: 0, reads: StoreCounter::default() };
        if is_big && (file.whole(&start[4..6]), file.whole(&start[6..8])) != (8, 0) {
            return Err(damaged("in the header", "its offsets have no 8 bytes"));
        }
        file.first = if is_big { file.whole(&start[8..16]) } else { file.whole(&start[4..8]) };
        Ok(Some(file))
    }

    /// The first image of a file that is known to be one of TIFF, or of these bands of it.
    pub(crate) fn first_image(file: Arc<File>, bands: Option<&str>) -> Result<TiffImage, InputFault> {
        let file =
            TiffFile::of(file)?.ok_or_else(|| damaged("in the header", "it does not begin as TIFF does"))?;
        let directory = file.directory(file.first)?;
        let image = TiffImage::read(&Arc::new(file), &directory)?;
        match bands {
            Some(bands) => image.pick(bands),
            None => Ok(image),
        }
    }

    /// Bytes of the file.
    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    /// What was read of it since it was opened.
    pub(crate) fn reads(&self) -> StoreStats {
        self.reads.stats()
    }

    /// A whole number of up to 8 bytes, in the file's order.
    fn whole(&self, bytes: &[u8]) -> u64 {
        let add = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        match self.is_big_endian {
            true => bytes.iter().fold(0, add),
            false => bytes.iter().rev().fold(0, add),
        }
    }

    /// `count` bytes from `at` on. Nothing is allocated where they do not lie within the file.
    fn bytes(&self, at: u64, count: u64, place: &str) -> Result<Vec<u8>, InputFault> {
        let truncated = || InputFault::Truncated { place: place.into() };
        if at.checked_add(count).is_none_or(|end| end > self.len) {
            return Err(truncated());
        }
        let mut bytes = vec![0; usize::try_from(count).map_err(|_| truncated())?];
        self.fill(&mut bytes, at, place)?;
        Ok(bytes)
    }

    fn fill(&self, bytes: &mut [u8], at: u64, place: &str) -> Result<(), InputFault> {
        self.reads.note(bytes.len() as u64);
        read_exact_at(&self.file, bytes, at).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => InputFault::Truncated { place: place.into() },
            _ => InputFault::Io(error),
        })
    }
}

fn damaged(place: &str, why: impl Into<String>) -> InputFault {
    InputFault::Damaged { place: place.into(), why: why.into() }
}
