//! What the caller says of a layer: its name, the image that it is made of, its format and its filter.

use std::path::{Path, PathBuf};

use vastex_core::LayerFormat;

use super::filter::LayerFilter;

/// An image, and the layer that is made of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerInput {
    /// The layer's name, which tells it from the others of its texture.
    pub name: String,
    /// The image, or a tile directory.
    pub path: PathBuf,
    /// The format of the layer. `None` picks the one that holds the image best.
    pub format: Option<LayerFormat>,
    /// How the layer's levels are made. `None` takes [`crate::BuildOptions::filter`]; if that is `None` too,
    /// the filter that suits the layer's name and format.
    pub filter: Option<LayerFilter>,
}

/// The layer `color`, in the format that holds the image best.
impl<P: AsRef<Path>> From<P> for LayerInput {
    fn from(path: P) -> LayerInput {
        LayerInput { name: "color".into(), path: path.as_ref().into(), format: None, filter: None }
    }
}
