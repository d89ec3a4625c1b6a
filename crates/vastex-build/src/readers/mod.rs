//! Image files and tile directories, read row by row from the top.
//!
//! [`open`] looks at a file's first bytes, not at its name (but for raw files, which have nothing else), and picks the reader. A reader tells size, texels and
//! what it will cost from the header alone, before it allocates anything that depends on them. What becomes of
//! the rows is [`crate::convert`]'s and [`crate::pyramid`]'s business.

mod ahead;
mod alpha;
mod color;
pub(crate) mod directory;
mod exif;
mod exr;
mod exr_blocks;
#[cfg(test)]
mod helped;
mod jpeg;
mod jpeg_errors;
mod jpeg_header;
mod mosaic;
mod open_files;
mod oriented;
mod pixel;
mod png;
mod positioned;
mod quiet;
mod raw;
mod scaled;
mod tiff;
mod tiff_chunks;
mod tiff_samples;
mod ycbcr;

use std::fs::File;
use std::io::{self, BufReader, Read, Seek};
use std::path::{Path, PathBuf};

use vastex_core::{Geometry, PageSet};

use crate::error::InputFault;
use crate::notice::Notice;

pub use ahead::Helpers;
#[cfg(test)]
pub(crate) use ahead::{Watch, tests::Meeting};
pub use color::{Profile, in_srgb};
pub use directory::source::DirectorySource;
pub use pixel::{PixelFormat, Sample};
pub(crate) use scaled::{Blend, Scaled};

/// What is known of an image from its header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageHeader {
    /// Texels per row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// What the texels are.
    pub format: PixelFormat,
    /// Whether the file says that its colours are linear, not sRGB-encoded.
    pub linear: bool,
    /// The least and the greatest number that the file's samples can be, where they are signed whole numbers, which rows hold as
    /// floats. A layer of whole numbers holds this range as 0 to 1.
    pub range: Option<[i64; 2]>,
    /// What the file says of its colours besides, which the rows do not follow; see [`in_srgb`].
    pub profile: Option<Profile>,
    /// How the rows are stored, as EXIF numbers it; 1, upright, once they are given out by [`open`].
    pub(crate) orientation: u16,
    /// Whether the first column is the last one's neighbour, as on a planet.
    pub wraps: bool,
    /// Bytes that the reader holds while it reads, besides what it is given to fill.
    pub memory: u64,
    /// The directory in which its tiles lie, if it has any.
    pub tile_directory: Option<PathBuf>,
    /// What the reader leaves out, and what it costs.
    pub notices: Vec<Notice>,
}

impl ImageHeader {
    pub(crate) fn new(width: u64, height: u64, format: PixelFormat) -> Result<ImageHeader, InputFault> {
        let (Ok(w), Ok(h)) = (u32::try_from(width), u32::try_from(height)) else {
            return Err(InputFault::Unsupported {
                what: format!("{width}x{height} texels"),
                remedy: "an image has at most 2^31 texels per side",
            });
        };
        if w == 0 || h == 0 {
            return Err(InputFault::NoTexels { width, height });
        }
        Ok(ImageHeader {
            width: w,
            height: h,
            format,
            linear: false,
            range: None,
            profile: None,
            orientation: 1,
            wraps: false,
            memory: 0,
            tile_directory: None,
            notices: Vec::new(),
        })
    }

    /// Bytes of one row.
    pub fn row_bytes(&self) -> usize {
        self.width as usize * self.format.texel_bytes()
    }

    /// Bytes of all rows.
    pub fn image_bytes(&self) -> u64 {
        (self.row_bytes() as u64).saturating_mul(u64::from(self.height))
    }

    /// Counts `bytes` as held for the whole time, and says why.
    fn hold_whole_image(&mut self, bytes: u64, why: &'static str) {
        self.memory = self.memory.saturating_add(bytes);
        self.notices.push(Notice::WholeImage { bytes, why });
    }

    /// Takes over what is new among the notices of the reader behind, of which `seen` were taken over already.
    fn add_notices_of(&mut self, inner: &ImageHeader, seen: &mut usize) {
        self.notices.extend(inner.notices.iter().skip(*seen).cloned());
        *seen = inner.notices.len();
    }
}

/// An image that is read once, from the top row to the bottom one.
pub trait RowReader: Send {
    /// What is known from the header.
    fn header(&self) -> &ImageHeader;

    /// The pages of a texture of that shape for which there are texels of their own; nothing where there are all. Where there
    /// are none, the rows repeat coarser ones.
    fn present(&self, geometry: &Geometry) -> Option<PageSet> {
        let _ = geometry;
        None
    }

    /// Takes a damaged picture for what can be made of it, where the decoder can go on, and tells of that with a notice; without
    /// this, damage is an error. To be asked for before the first row.
    fn tolerate(&mut self) {}

    /// Bytes that it holds besides, where helpers decode so many pieces of the image ahead of the rows.
    fn memory_ahead(&self, pieces: usize) -> u64 {
        let _ = pieces;
        0
    }

    /// Lets others help to decode, where the image can be decoded in pieces. Rows and faults are the same. To be called before
    /// the first row.
    fn take_help(&mut self, helpers: &Helpers) {
        let _ = helpers;
    }

    /// Fills `rows` with the next rows, tightly packed. Its length is a whole number of rows and no more than are
    /// left. The last row is only given out when the file is whole. After an error the reader is of no further use.
    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault>;
}

/// An open image, and all that is read for its rows.
pub(crate) struct Opened {
    pub(crate) reader: Box<dyn RowReader>,
    /// Every file, descriptions included, and every directory of tiles; none twice.
    pub(crate) files: Vec<PathBuf>,
}

/// Opens an image by its first bytes, or a tile directory by what is in it. The rows are upright, and their colours as
/// they are stored: [`in_srgb`] converts them. Reads headers and lists of files and, to see
/// whether tiles have borders, the roots of a planet.
pub fn open(path: &Path) -> Result<Box<dyn RowReader>, InputFault> {
    open_with_files(path).map(|opened| opened.reader)
}

/// Opens an image as [`open`] does, and says which files it is made of.
pub(crate) fn open_with_files(path: &Path) -> Result<Opened, InputFault> {
    if std::fs::metadata(path)?.is_dir() {
        return Ok(of_directory(path, directory::open_directory(path)?));
    }
    match open_file_of_texels(path) {
        Err(InputFault::Text) => match mosaic::open(path)? {
            Some(mosaic) => Ok(Opened { files: mosaic.files(path), reader: Box::new(mosaic) }),
            None => directory::open_description(path)?
                .map(|reader| of_directory(path, reader))
                .ok_or(InputFault::Text),
        },
        opened => Ok(Opened { reader: opened?, files: files_of_texels(path) }),
    }
}

/// The rows of a tile directory, which `path` is or describes.
fn of_directory(path: &Path, reader: Box<dyn RowReader>) -> Opened {
    let mut files = vec![path.to_owned()];
    files.extend(reader.header().tile_directory.clone().filter(|directory| directory != path));
    Opened { reader, files }
}

/// Opens an image by its first bytes, or a raw one by the description beside it.
fn open_file_of_texels(path: &Path) -> Result<Box<dyn RowReader>, InputFault> {
    match raw::find(path) {
        Some(found) => Ok(Box::new(raw::RawReader::new(&found)?)),
        None => open_image(path),
    }
}

/// The files that [`open_file_of_texels`] reads.
fn files_of_texels(path: &Path) -> Vec<PathBuf> {
    match raw::find(path) {
        Some(found) => vec![raw::description_of(&found), found],
        None => vec![path.to_owned()],
    }
}

/// Opens an image by its first bytes, and turns it upright.
fn open_image(path: &Path) -> Result<Box<dyn RowReader>, InputFault> {
    open_as_stored(path).map(oriented::upright)
}

fn open_as_stored(path: &Path) -> Result<Box<dyn RowReader>, InputFault> {
    let mut file = open_file(path)?;
    let mut magic = Vec::with_capacity(64);
    (&mut file).take(64).read_to_end(&mut magic)?;
    file.seek(io::SeekFrom::Start(0))?;
    match magic.as_slice() {
        [] => Err(InputFault::Empty),
        [0xff, 0xd8, 0xff, ..] => Ok(Box::new(jpeg::JpegReader::new(file)?)),
        [0x89, b'P', b'N', b'G', ..] => Ok(Box::new(png::PngReader::new(file)?)),
        [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => {
            Ok(Box::new(tiff::TiffReader::new(file)?))
        }
        [0x76, 0x2f, 0x31, 0x01, ..] => Ok(Box::new(exr::ExrReader::new(file)?)),
        [0x89, b'V', b'T', b'X', b'P', b'A', b'R', b'T', ..] => Err(InputFault::Part),
        [0x89, b'V', b'T', b'X', ..] => Err(InputFault::Container),
        bytes if is_text(bytes) => Err(InputFault::Text),
        bytes => {
            let hex: Vec<_> = bytes.iter().take(8).map(|b| format!("{b:02x}")).collect();
            Err(InputFault::UnknownFormat(hex.join(" ")))
        }
    }
}

/// Opens a file for reading, unless it is something else.
fn open_file(path: &Path) -> Result<File, InputFault> {
    // Looked at before it is opened: opening a pipe would wait for a writer.
    match std::fs::metadata(path)? {
        found if found.is_dir() => Err(InputFault::Directory),
        found if !found.is_file() => Err(InputFault::NotAFile),
        _ => Ok(File::open(path)?),
    }
}

fn is_text(bytes: &[u8]) -> bool {
    let valid = match std::str::from_utf8(bytes) {
        Ok(_) => true,
        Err(e) => e.error_len().is_none() && e.valid_up_to() > 0,
    };
    valid && !bytes.iter().any(|&b| b < 9 || (14..32).contains(&b))
}

/// A buffered file with few system calls per row.
fn buffered(file: File) -> BufReader<File> {
    BufReader::with_capacity(256 << 10, file)
}
