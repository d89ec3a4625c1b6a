//! Opens whatever lies at a path as rows: an image, a mosaic, or a tile directory.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use vastex_tiles::raw_file;

use super::fault::InputFault;
use super::header::RowReader;
use super::picture::{
    files_of_texels, is_text_file, open_bands, open_file_of_texels, open_reduced_bands, open_reduced_picture,
    open_shrunk_picture, open_stored_picture,
};
use super::stored_as::StoredAs;
use super::tiff::file::pyramid::{bands_in_path, image_in_file, without_first};
use super::{grids, mosaic};

/// An open image, and all that is read for its rows.
pub(crate) struct Opened {
    pub(crate) reader: Box<dyn RowReader>,
    /// Every file, descriptions included, and every directory of tiles; none twice.
    pub(crate) files: Vec<PathBuf>,
}

/// Opens an image by its first bytes, or a tile directory by what is in it; or bands of a TIFF file, as in
/// `landsat.tif:bands=5,4,3`. The rows are upright, and their colours as they are stored: [`crate::in_srgb`]
/// converts them. Reads headers and lists of files and, to see whether tiles have borders, the roots of a
/// planet.
pub fn open(path: &Path) -> Result<Box<dyn RowReader>, InputFault> {
    open_while(path, &unwatched)
}

/// Opens an image as [`open`] does as long as `go_on`, which is asked before each piece of a mosaic, does not
/// break it off ([`InputFault::BrokenOff`]): a mosaic may have many.
pub fn open_while(
    path: &Path,
    go_on: &dyn Fn() -> ControlFlow<()>,
) -> Result<Box<dyn RowReader>, InputFault> {
    open_with_files_while(path, go_on).map(|opened| opened.reader)
}

/// For those who open all that there is.
fn unwatched() -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Opens an image at a share of its size, where that is much quicker than to read all of it: a first picture
/// of what may be large. `None` where there is no such way, for directories, and where the share would be
/// small: where its longer side had fewer than `side` texels, or where only one share can be had, half as
/// many. The rows are as [`open`] gives them out: upright, and their colours as they are stored.
///
/// - JPEG by rows: an eighth, a quarter or a half, rounded up, the smallest that will do. libjpeg makes fewer
///   texels of each block of 8x8, which at an eighth takes about half of the time of the whole image; they
///   differ a little from the mean of the image's texels.
/// - Progressive JPEG: an eighth, from the means of the blocks, which stand at the beginning of the file.
///   That reads some hundredths of it, of a smooth picture up to a fifth, and holds no more than a sample for
///   each block. The means may be without their lowest bit.
/// - Sequential JPEG whose components come one after the other: an eighth, from the means of the blocks, for
///   which all of the file is read.
/// - Interlaced PNG: an eighth, the texels of its first pass.
/// - TIFF of strips, and bands of one: some texels of some rows, those between them left out. Where rows are
///   compressed, at most half of the strips are decoded, and no more than 96 MiB of them; so rows may be of
///   the nearest strip that is. `None` where that leaves fewer than 32 strips, as in a file of one: rows of
///   that come as they are decoded.
/// - TIFF of tiles, and bands of one: some texels of all tiles, or of every few columns and rows of tiles, so
///   that no more than 1024 tiles and 96 MiB are decoded (6 MiB of JPEG 2000), by several threads; texels
///   between them are of the nearest tile that is. `None` where that leaves fewer than 8 tiles.
///
/// Fails where [`open`] does. A file that is damaged may fail while rows are read; those before are sound.
pub fn open_reduced(path: &Path, side: u32) -> Result<Option<Box<dyn RowReader>>, InputFault> {
    let path = without_first(path);
    if let Some((file, bands)) = bands_in_path(path) {
        return open_reduced_bands(file, bands, side);
    }
    if !std::fs::metadata(path)?.is_file() {
        return Ok(None);
    }
    open_reduced_picture(path, side)
}

/// Opens an image that is stored turned, of which [`open`] would hold all, at half of its size, a quarter and
/// so on, so that it has no more bytes than `most`: of every few rows and columns one, the others decoded and
/// left out. The rows are as [`open`] gives them out. `None` of images that are stored upright, of raw files
/// and directories, and where the rows as they are stored take more bytes than `memory`.
pub fn open_shrunk(path: &Path, most: u64, memory: u64) -> Result<Option<Box<dyn RowReader>>, InputFault> {
    let path = without_first(path);
    if let Some((file, bands)) = bands_in_path(path) {
        return open_shrunk_picture(file, Some(bands), [most, memory]);
    }
    if !std::fs::metadata(path)?.is_file() || raw_file(path).is_some() {
        return Ok(None);
    }
    open_shrunk_picture(path, None, [most, memory])
}

/// Opens an image as [`open`] does, but that the numbers of a palette, samples of few bits and inks stay as
/// the file stores them, and says what they are then.
pub(crate) fn open_stored(path: &Path) -> Result<(Box<dyn RowReader>, StoredAs), InputFault> {
    let path = without_first(path);
    if std::fs::metadata(path).is_ok_and(|found| found.is_file())
        && let Some(stored) = open_stored_picture(path)?
    {
        return Ok(stored);
    }
    Ok((open(path)?, StoredAs::ByCount))
}

/// Opens an image as [`open_while`] does, and says which files it is made of.
pub(crate) fn open_with_files_while(
    path: &Path,
    go_on: &dyn Fn() -> ControlFlow<()>,
) -> Result<Opened, InputFault> {
    let path = without_first(path);
    if let Some((file, bands)) = bands_in_path(path) {
        return Ok(Opened { reader: open_bands(file, bands)?, files: vec![file.to_owned()] });
    }
    if std::fs::metadata(path)?.is_dir() {
        return Ok(of_directory(path, grids::open_directory(path)?));
    }
    match open_file_of_texels(path) {
        Err(InputFault::Text) => match mosaic::open(path, go_on)? {
            Some(mosaic) => Ok(Opened { files: mosaic.files(path), reader: Box::new(mosaic) }),
            None => grids::open_description(path)?
                .map(|reader| of_directory(path, reader))
                .ok_or(InputFault::Text),
        },
        opened => Ok(Opened { reader: opened?, files: files_of_texels(path) }),
    }
}

/// Returns all that [`open`] reads of a path, so that nothing is written there: the file that the path means,
/// with the description of a raw file, all pieces of a mosaic, or the directory of tiles that a text
/// describes; or a directory, of which all files are meant. The path itself where nothing lies there or it
/// cannot be read. Opens texts and directories as [`open`] does, of other files the first bytes alone.
pub fn files_of_image(path: &Path) -> Vec<PathBuf> {
    let file = image_in_file(path).map_or(path, |(file, _)| file);
    if file.is_dir() {
        let source = grids::look_at_directory(file).ok();
        return files_of_directory(file, source.map(|source| source.directory));
    }
    if !is_text_file(file) || raw_file(file).is_some() {
        return files_of_texels(file);
    }
    match mosaic::open(file, &unwatched) {
        Ok(Some(mosaic)) => mosaic.files(file),
        Ok(None) => {
            let source = grids::look_at_description(file).ok().flatten();
            files_of_directory(file, source.map(|source| source.directory))
        }
        Err(_) => vec![file.to_owned()],
    }
}

/// The rows of a tile directory, which `path` is or describes.
fn of_directory(path: &Path, reader: Box<dyn RowReader>) -> Opened {
    let files = files_of_directory(path, reader.header().tile_directory.clone());
    Opened { reader, files }
}

/// What is read of a tile directory, which `path` is or describes, and what lies beside it.
fn files_of_directory(path: &Path, directory: Option<PathBuf>) -> Vec<PathBuf> {
    let mut files = vec![path.to_owned()];
    files.extend(directory.as_deref().and_then(grids::size_file).filter(|size| size.is_file()));
    files.extend(directory.filter(|directory| directory != path));
    files
}
