//! Opens whatever lies at a path as rows: an image, a mosaic, or a tile directory.

use std::path::{Path, PathBuf};

use super::fault::InputFault;
use super::header::RowReader;
use super::picture::{files_of_texels, open_bands, open_file_of_texels, open_reduced_picture};
use super::tiff::file::pyramid::bands_in_path;
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
    open_with_files(path).map(|opened| opened.reader)
}

/// Opens a JPEG file that can be read by rows at an eighth of its size, a quarter or a half, rounded up: the
/// smallest of them whose longer side is about `side` texels or more; or a TIFF file of strips at a share of
/// its size. `None` for every other format, for directories, and where even a half would be smaller. The rows
/// are as [`open`] gives them out: upright, and their colours as they are stored.
///
/// Of a TIFF file some texels are taken of some rows, those between them left out. Where rows are compressed,
/// at most half of the strips are decoded, and no more than 96 MiB of them; so rows may be of the nearest
/// strip that is. `None` where that leaves fewer than 32 strips, as in a file of one.
///
/// libjpeg makes fewer texels of each block of 8x8, which at an eighth takes about half of the time of the
/// whole image; they differ a little from the mean of the image's texels. Fails where [`open`] does.
pub fn open_reduced(path: &Path, side: u32) -> Result<Option<Box<dyn RowReader>>, InputFault> {
    if bands_in_path(path).is_some() || !std::fs::metadata(path)?.is_file() {
        return Ok(None);
    }
    open_reduced_picture(path, side)
}

/// Opens an image as [`open`] does, and says which files it is made of.
pub(crate) fn open_with_files(path: &Path) -> Result<Opened, InputFault> {
    if let Some((file, bands)) = bands_in_path(path) {
        return Ok(Opened { reader: open_bands(file, bands)?, files: vec![file.to_owned()] });
    }
    if std::fs::metadata(path)?.is_dir() {
        return Ok(of_directory(path, grids::open_directory(path)?));
    }
    match open_file_of_texels(path) {
        Err(InputFault::Text) => match mosaic::open(path)? {
            Some(mosaic) => Ok(Opened { files: mosaic.files(path), reader: Box::new(mosaic) }),
            None => grids::open_description(path)?
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
