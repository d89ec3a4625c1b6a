//! Whole levels of a source, put together from its tiles.

use vastex::{DecodeError, PagePos, ReadError, TileSource};

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

/// The first layer of a level of an image, row by row without padding. Reads every tile of the level.
pub(crate) fn read_level(source: &dyn TileSource, level: u8) -> Result<Vec<u8>, LevelError> {
    let description = source.description();
    let (geometry, texel) = (&description.geometry, description.layers[0].format.texel_bytes());
    let size = geometry.level(level).size;
    let mut image = vec![0; size[0] as usize * size[1] as usize * texel];
    let row_bytes = size[0] as usize * texel;
    let tile_row_bytes = geometry.tile()[0] as usize * texel;
    let mut copy = |tile: &[u8], from: [u32; 3], to: [u32; 2], extent: [u32; 2]| {
        for y in 0..extent[1] {
            let source = (from[1] + y) as usize * tile_row_bytes + from[0] as usize * texel;
            let target = (to[1] + y) as usize * row_bytes + to[0] as usize * texel;
            let bytes = extent[0] as usize * texel;
            image[target..target + bytes].copy_from_slice(&tile[source..source + bytes]);
        }
    };
    if level >= geometry.tail().first_level() {
        let tail = read_tile(source, geometry.tail_pos())?;
        copy(tail.as_ref(), geometry.tile_texel_from_tail_texel(level, [0; 3]), [0, 0], [size[0], size[1]]);
        return Ok(image);
    }
    for pos in geometry.pages_of_level(level) {
        let tile = read_tile(source, pos)?;
        let first = geometry.level_texel_from_page(pos).map(|texel| texel as u32);
        let extent = [0, 1].map(|axis| geometry.page()[axis].min(size[axis] - first[axis]));
        copy(tile.as_ref(), geometry.tile_texel_from_page_texel([0; 3]), [first[0], first[1]], extent);
    }
    Ok(image)
}

/// The decoded tile of a page. A local read never suspends, so waiting for it costs nothing.
pub(crate) fn read_tile(
    source: &dyn TileSource,
    pos: PagePos,
) -> Result<impl AsRef<[u8]> + use<>, LevelError> {
    let tile = pollster::block_on(source.read(pos))?;
    tile.decode(source.description()).map_err(|error| LevelError::Decode { pos, error })
}
