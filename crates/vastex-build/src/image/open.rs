//! Opens whatever lies at a path as rows: an image, a mosaic, or a tile directory.

use std::path::{Path, PathBuf};

use super::fault::InputFault;
use super::header::RowReader;
use super::picture::{files_of_texels, open_file_of_texels, open_smaller_picture};
use super::{grids, mosaic};

/// An open image, and all that is read for its rows.
pub(crate) struct Opened {
    pub(crate) reader: Box<dyn RowReader>,
    /// Every file, descriptions included, and every directory of tiles; none twice.
    pub(crate) files: Vec<PathBuf>,
}

/// Opens an image by its first bytes, or a tile directory by what is in it. The rows are upright, and their
/// colours as they are stored: [`crate::in_srgb`] converts them. Reads headers and lists of files and, to see
/// whether tiles have borders, the roots of a planet.
pub fn open(path: &Path) -> Result<Box<dyn RowReader>, InputFault> {
    open_with_files(path).map(|opened| opened.reader)
}

/// Opens an image at half of its size, a quarter or an eighth, rounded up, so that it has about `side` texels along its longer
/// axis or more; nothing where that is no quicker than to read it whole. The rows are as [`open`] gives them out: upright,
/// and their colours as they are stored.
///
/// JPEG files that can be read by rows are: 10,800 x 5,400 texels take about a third of the time. Their texels are
/// those that libjpeg makes of each block of 8x8, so they differ a little from any mean of the image's.
pub fn open_smaller(path: &Path, side: u32) -> Result<Option<Box<dyn RowReader>>, InputFault> {
    if !std::fs::metadata(path)?.is_file() {
        return Ok(None);
    }
    open_smaller_picture(path, side)
}

/// Opens an image as [`open`] does, and says which files it is made of.
pub(crate) fn open_with_files(path: &Path) -> Result<Opened, InputFault> {
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
