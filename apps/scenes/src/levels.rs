//! Whole levels of a source, put together from its tiles.

use bytes::Bytes;
use vastex::source::{DecodeError, ReadError};
use vastex::{PagePos, TileSource};

/// Why a level could not be put together.
#[derive(Debug, thiserror::Error)]
pub enum LevelError {
    /// A tile could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A tile could not be decoded.
    #[error("{pos}: {error}")]
    Decode {
        /// The page.
        pos: PagePos,
        /// What is wrong with its tile.
        error: DecodeError,
    },
}

/// Layer number `layer` of a level of an image, decoded, row by row without padding, as large as the level of
/// [`vastex::Geometry::of_layer`]. Reads every tile of the level.
pub(crate) fn read_level(source: &dyn TileSource, layer: usize, level: u8) -> Result<Vec<u8>, LevelError> {
    let description = source.description();
    let (scale, texel) = (description.layers[layer].scale, description.layers[layer].format.texel_bytes());
    let shape = description.geometry.of_layer(scale);
    let size = shape.level(level).size;
    let mut image = vec![0; size[0] as usize * size[1] as usize * texel];
    let row_bytes = size[0] as usize * texel;
    let tile_row_bytes = shape.tile()[0] as usize * texel;
    let mut copy = |tile: &[u8], from: [u32; 3], to: [u32; 2], extent: [u32; 2]| {
        for y in 0..extent[1] {
            let source = (from[1] + y) as usize * tile_row_bytes + from[0] as usize * texel;
            let target = (to[1] + y) as usize * row_bytes + to[0] as usize * texel;
            let bytes = extent[0] as usize * texel;
            image[target..target + bytes].copy_from_slice(&tile[source..source + bytes]);
        }
    };
    if level >= shape.tail().first_level() {
        let tail = read_layer(source, layer, shape.tail_pos())?;
        copy(&tail, shape.tile_texel_from_tail_texel(level, [0; 3]), [0, 0], [size[0], size[1]]);
        return Ok(image);
    }
    for pos in shape.pages_of_level(level) {
        let tile = read_layer(source, layer, pos)?;
        let first = shape.level_texel_from_page(pos).map(|texel| texel as u32);
        let extent = [0, 1].map(|axis| shape.page()[axis].min(size[axis] - first[axis]));
        copy(&tile, shape.tile_texel_from_page_texel([0; 3]), [first[0], first[1]], extent);
    }
    Ok(image)
}

/// A layer's texels of the tile of a page. A local read never suspends, so waiting for it costs nothing.
fn read_layer(source: &dyn TileSource, layer: usize, pos: PagePos) -> Result<Bytes, LevelError> {
    let tile = pollster::block_on(source.read(pos))?;
    let bytes = tile.decode(source.description()).map_err(|error| LevelError::Decode { pos, error })?;
    Ok(vastex::source::decode_layer(source.description(), layer, &bytes))
}
