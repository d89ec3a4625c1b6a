//! An image as it was opened: its tiles, and the size of the whole.

use std::sync::Arc;

use vastex::TileSource;

/// Where the tiles of an image come from.
#[derive(Clone)]
pub struct SceneImage {
    /// What is sampled.
    pub tiles: Arc<dyn TileSource>,
    /// Columns and rows of the image, of which the tiles may have fewer.
    pub size: [u32; 2],
}

impl From<Arc<dyn TileSource>> for SceneImage {
    fn from(tiles: Arc<dyn TileSource>) -> SceneImage {
        let [width, height, _] = tiles.description().geometry.size();
        SceneImage { tiles, size: [width, height] }
    }
}
