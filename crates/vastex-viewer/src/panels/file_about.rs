//! What a file says beside its texels: how large they are in the world, which bands and which other images
//! the file has.

use std::ffi::OsString;
use std::sync::Arc;

use super::{MapPlace, TexelSize};

/// The bands of a file that has more than a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileBands {
    /// The path of the file alone.
    pub file: OsString,
    /// What each band is called, its number first.
    pub names: Vec<String>,
    /// The bands that are shown, counted from 1: one, or three.
    pub shown: Vec<u16>,
}

/// What a file says beside its texels.
#[derive(Clone, Debug, Default)]
pub struct FileAbout {
    /// How large the texels are in the world, and how many times they were magnified: of TIFF of maps and
    /// slides.
    pub texel_size: Option<TexelSize>,
    /// Where the image lies in its own coordinate system: of GeoTIFF.
    pub map: Option<MapPlace>,
    /// The images of the file, the first one before the others, if there are others; each with its name and
    /// the path that opens it.
    pub images: Vec<(String, OsString)>,
    /// The bands of the file, if it has more than a picture.
    pub bands: Option<FileBands>,
    /// What is said of the file: a name and a value each.
    pub rows: Arc<[(String, String)]>,
    /// What the file's values were converted from, as in "from inks (CMYK)"; empty if they are those that it
    /// stores.
    pub converted: String,
    /// True if the file is a generated planet.
    pub is_generated: bool,
}
