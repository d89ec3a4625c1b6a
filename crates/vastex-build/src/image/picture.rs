//! Opens one image file, by its first bytes and not by its name; only raw files, which have no first bytes of
//! their own, are known by the description beside them.

use std::io::{self, Read, Seek};
use std::path::{Path, PathBuf};

use vastex_tiles::{raw_description, raw_file};

use super::fault::InputFault;
use super::file::open_file;
use super::header::RowReader;
use super::shrunk::Shrunk;
use super::stored_as::StoredAs;
use super::{exr, jpeg, oriented, png, raw, tiff};

/// Opens an image by its first bytes, or a raw one by the description beside it.
pub(super) fn open_file_of_texels(path: &Path) -> Result<Box<dyn RowReader>, InputFault> {
    match raw_file(path) {
        Some(found) => Ok(Box::new(raw::RawReader::new(&found)?)),
        None => open_image(path),
    }
}

/// The files that [`open_file_of_texels`] reads.
pub(super) fn files_of_texels(path: &Path) -> Vec<PathBuf> {
    match raw_file(path) {
        Some(found) => vec![raw_description(&found), found],
        None => vec![path.to_owned()],
    }
}

/// Returns true if a file begins as a text does.
pub(super) fn is_text_file(path: &Path) -> bool {
    let mut start = Vec::with_capacity(64);
    let read = open_file(path).ok().map(|file| file.take(64).read_to_end(&mut start));
    read.is_some_and(|read| read.is_ok()) && !start.is_empty() && is_text(&start)
}

/// Opens an image by its first bytes, and turns it upright.
pub(super) fn open_image(path: &Path) -> Result<Box<dyn RowReader>, InputFault> {
    open_as_stored(path).map(oriented::upright)
}

/// Opens an image at a share of its size, and turns it upright; `None` if that is not quicker.
pub(super) fn open_reduced_picture(path: &Path, side: u32) -> Result<Option<Box<dyn RowReader>>, InputFault> {
    let mut file = open_file(path)?;
    let mut magic = Vec::with_capacity(4);
    (&mut file).take(4).read_to_end(&mut magic)?;
    file.seek(io::SeekFrom::Start(0))?;
    let reduced: Option<Box<dyn RowReader>> = match magic.as_slice() {
        [0xff, 0xd8, 0xff, ..] => jpeg::JpegReader::new(file)?.reduced(side),
        [0x89, b'P', b'N', b'G'] => {
            png::PngReader::new(file)?.reduced(side).map(|reader| Box::new(reader) as Box<dyn RowReader>)
        }
        [b'I', b'I', 42 | 43, 0] | [b'M', b'M', 0, 42 | 43] => tiff::open_sparse(file, side, None)?,
        _ => None,
    };
    Ok(reduced.map(oriented::upright))
}

/// Opens an image that is stored turned, or bands of it, at a share of its size that has no more bytes than
/// `most`, and turns that upright; `None` of other images, and where the rows as they are stored take more
/// than `memory`.
pub(super) fn open_shrunk_picture(
    path: &Path,
    bands: Option<&str>,
    [most, memory]: [u64; 2],
) -> Result<Option<Box<dyn RowReader>>, InputFault> {
    let stored = match bands {
        Some(bands) => tiff::open(open_file(path)?, Some(bands))?,
        None => open_as_stored(path)?,
    };
    if !oriented::is_turned(stored.header()) {
        return Ok(None);
    }
    let shrunk = Shrunk::new(stored, most);
    let can_be = shrunk.header().memory <= memory;
    Ok(can_be.then(|| oriented::upright(Box::new(shrunk))))
}

/// Rows of what is stored, and what they are.
type Stored = (Box<dyn RowReader>, StoredAs);

/// Opens an image whose samples are something else as they are stored than as they are shown, and turns it
/// upright, with what they are; `None` of other images.
pub(super) fn open_stored_picture(path: &Path) -> Result<Option<Stored>, InputFault> {
    if raw_file(path).is_some() {
        return Ok(None);
    }
    let mut file = open_file(path)?;
    let mut magic = Vec::with_capacity(4);
    (&mut file).take(4).read_to_end(&mut magic)?;
    file.seek(io::SeekFrom::Start(0))?;
    let found: Option<Stored> = match magic.as_slice() {
        [0xff, 0xd8, 0xff, ..] => {
            jpeg::JpegReader::new(file)?.of_inks().map(|(reader, of)| (Box::new(reader) as _, of))
        }
        [0x89, b'P', b'N', b'G'] => {
            png::PngReader::as_stored(file)?.map(|(reader, of)| (Box::new(reader) as _, of))
        }
        _ => None,
    };
    Ok(found.map(|(reader, of)| (oriented::upright(reader), of)))
}

/// Opens bands of a TIFF file at a share of its size, and turns them upright; `None` if that is not quicker.
pub(super) fn open_reduced_bands(
    path: &Path,
    bands: &str,
    side: u32,
) -> Result<Option<Box<dyn RowReader>>, InputFault> {
    let reduced = tiff::open_sparse(open_file(path)?, side, Some(bands))?;
    Ok(reduced.map(oriented::upright))
}

/// Opens bands of a TIFF file, as in `5,4,3`, and turns them upright.
pub(super) fn open_bands(path: &Path, bands: &str) -> Result<Box<dyn RowReader>, InputFault> {
    tiff::open(open_file(path)?, Some(bands)).map(oriented::upright)
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
        [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => tiff::open(file, None),
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

fn is_text(bytes: &[u8]) -> bool {
    let valid = match std::str::from_utf8(bytes) {
        Ok(_) => true,
        Err(e) => e.error_len().is_none() && e.valid_up_to() > 0,
    };
    valid && !bytes.iter().any(|&b| b < 9 || (14..32).contains(&b))
}
