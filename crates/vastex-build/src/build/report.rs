//! What a build tells when it is done.

use std::path::PathBuf;

use vastex_core::Layer;

use crate::image::Notice;
use crate::texels::filter::LayerFilter;

/// What was built.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BuildReport {
    /// Size of level 0 in texels.
    pub size: [u32; 2],
    /// Levels, the tail's included.
    pub levels: u32,
    /// What was made of each image, in the order of the inputs.
    pub layers: Vec<LayerReport>,
    /// Texels that were read: those of the largest image and of all insets.
    pub texels: u64,
    /// Tiles, the tail counted as one.
    pub tiles: u64,
    /// Tiles of one colour, of which the container keeps the colour only.
    pub constant_tiles: u64,
    /// Tiles whose bytes are those of an earlier one.
    pub shared_tiles: u64,
    /// Pages that have no tile.
    pub absent_tiles: u64,
    /// Tiles that an interrupted build had made.
    pub resumed_tiles: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Bytes of rows that were held at once.
    pub row_bytes_held: u64,
    /// Bytes of memory that the build could at most have taken, as estimated from the headers.
    pub memory: u64,
    /// Notices of insets, each with the inset's image. Insets that an interrupted build had put in have none
    /// here.
    pub insets: Vec<(PathBuf, Notice)>,
}

impl BuildReport {
    /// The notices of all layers and all insets.
    pub fn notices(&self) -> impl Iterator<Item = &Notice> {
        let of_insets = self.insets.iter().map(|(_, notice)| notice);
        self.layers.iter().flat_map(|layer| &layer.notices).chain(of_insets)
    }
}

/// What was made of an image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerReport {
    /// The image.
    pub path: PathBuf,
    /// Name, format and share of the resolution.
    pub layer: Layer,
    /// The filter that made its levels.
    pub filter: LayerFilter,
    /// Notes on what was left out of the image, and what reading it cost.
    pub notices: Vec<Notice>,
}
