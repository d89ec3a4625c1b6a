//! The image of a whole planet that a generated one is made of, out of a texture that has it.

use vastex::source::{DecodeError, PlanetImage, ReadError};
use vastex::{LayerFormat, PagePos, TileSource};

/// Texels round the equator at most: of a larger texture a coarser level is taken.
const MOST: u32 = 4096;

/// Why a texture gives no image of a planet.
#[derive(Debug, thiserror::Error)]
pub enum PlanetImageError {
    /// Its first layer is no colour that is held as it is.
    #[error(
        "a planet is made of a first layer of rgba8 or rgba8-srgb, not {0}; build it with --compress none"
    )]
    Format(&'static str),
    /// A tile could not be had.
    #[error(transparent)]
    Tile(#[from] ReadError),
    /// A tile is damaged.
    #[error(transparent)]
    Damaged(#[from] DecodeError),
}

/// The finest level with 4096 texels or fewer round the equator. Reads each of its tiles.
pub fn planet_image(source: &dyn TileSource) -> Result<PlanetImage, PlanetImageError> {
    let description = source.description();
    let (geometry, layer) = (&description.geometry, &description.layers[0]);
    if !matches!(layer.format, LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb) {
        return Err(PlanetImageError::Format(layer.format.name()));
    }
    let fits = |level: &u8| geometry.level(*level).size[0] <= MOST;
    let level = (0..=geometry.coarsest()).find(fits).unwrap_or(geometry.coarsest());
    let [width, height, _] = geometry.level(level).size;
    let mut texels = vec![[0; 4]; width as usize * height as usize];
    let (page, tile_width) = (geometry.page(), geometry.tile()[0] as usize);
    let pages: Vec<PagePos> = match level < geometry.tail().first_level() {
        true => geometry.pages_of_level(level).collect(),
        false => vec![geometry.tail_pos()],
    };
    for pos in pages {
        let tile = pollster::block_on(source.read(pos))?.decode(description)?;
        let (first, size, inner) = match geometry.is_tail(pos) {
            true => ([0, 0], [width, height], geometry.tile_texel_from_tail_texel(level, [0; 3])),
            false => {
                let first = [pos.x * page[0], pos.y * page[1]];
                let size = [page[0].min(width - first[0]), page[1].min(height - first[1])];
                (first, size, geometry.tile_texel_from_page_texel([0; 3]))
            }
        };
        for y in 0..size[1] {
            let from = ((inner[1] + y) as usize * tile_width + inner[0] as usize) * 4;
            let row = tile[from..from + size[0] as usize * 4].as_chunks().0;
            let to = (first[1] + y) as usize * width as usize + first[0] as usize;
            texels[to..to + row.len()].copy_from_slice(row);
        }
    }
    Ok(PlanetImage { size: [width, height], texels })
}
