//! A generated source for tests: every texel's colour is its own level and position.
//!
//! A picture drawn from it can be checked texel by texel: a colour names the texel that it came from.
//! Borders, edges and the tail are laid out as in every other source, so that a wrong texel shows.
//!
//! | channel | image | volume |
//! |---|---|---|
//! | red | x, bits 0 to 7 | x, bits 0 to 7 |
//! | green | y, bits 0 to 7 | y, bits 0 to 7 |
//! | blue | x, bits 8 to 11; above them y, bits 8 to 11 | z, bits 0 to 7 |
//! | alpha | 255 - level | 255 - level |
//!
//! Texels are told apart in images up to 4096 and volumes up to 256 texels per side; beyond that positions
//! repeat.

use std::sync::Arc;

use vastex_core::{Box3, Description, Dims, Geometry, LayerFormat, PagePos};

use super::{ReadError, ReadFuture, TileSource};
use crate::tile::{Codec, Tile};

/// A source of one RGBA8 layer in which the colour of a texel is its own level and position.
#[derive(Clone, Debug)]
pub struct PropertySource {
    description: Arc<Description>,
}

impl PropertySource {
    /// The source for a texture of this shape.
    pub fn new(geometry: Geometry) -> PropertySource {
        PropertySource { description: Arc::new(Description::one_layer(geometry, LayerFormat::Rgba8)) }
    }

    /// The colour of a texel inside its level.
    ///
    /// ```
    /// use vastex_core::Dims;
    /// use vastex_tiles::PropertySource;
    /// let color = PropertySource::color_from_texel(Dims::D2, 3, [0x312, 0x456, 0]);
    /// assert_eq!(color, [0x12, 0x56, 0x43, 252]);
    /// assert_eq!(PropertySource::texel_from_color(Dims::D2, color), (3, [0x312, 0x456, 0]));
    /// ```
    pub fn color_from_texel(dims: Dims, level: u8, texel: [u32; 3]) -> [u8; 4] {
        let [x, y, z] = texel;
        let blue = match dims {
            Dims::D2 => (x >> 8 & 15) | (y >> 8 & 15) << 4,
            Dims::D3 => z,
        };
        [x as u8, y as u8, blue as u8, 255 - level]
    }

    /// Level and position of the texel that has this colour, modulo what the channels hold.
    pub fn texel_from_color(dims: Dims, color: [u8; 4]) -> (u8, [u32; 3]) {
        let [x, y, blue] = [color[0], color[1], color[2]].map(u32::from);
        let texel = match dims {
            Dims::D2 => [x | (blue & 15) << 8, y | (blue >> 4) << 8, 0],
            Dims::D3 => [x, y, blue],
        };
        (255 - color[3], texel)
    }

    fn tile(&self, pos: PagePos) -> Option<Tile> {
        let geometry = &self.description.geometry;
        if !geometry.contains(pos) {
            return None;
        }
        let mut texels = vec![0; self.description.tile_bytes()];
        for (level, level_box, offset) in geometry.tile_boxes(pos) {
            fill(geometry, level, level_box, offset, &mut texels);
        }
        Some(Tile { codec: Codec::Raw, bytes: texels.into() })
    }
}

/// Writes the texels that the address modes give for `level_box` into a tile, from `offset` on.
fn fill(geometry: &Geometry, level: u8, level_box: Box3, offset: [u32; 3], texels: &mut [u8]) {
    let [width, height, _] = geometry.tile().map(|n| n as usize);
    let [nx, ny, nz] = level_box.size;
    for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
        let row = ((offset[2] + z) as usize * height + (offset[1] + y) as usize) * width + offset[0] as usize;
        for (x, color) in (0..nx).zip(texels[row * 4..].chunks_exact_mut(4)) {
            let level_texel = std::array::from_fn(|a| level_box.origin[a] + i64::from([x, y, z][a]));
            let inside = geometry.fold_texel(level, level_texel);
            color.copy_from_slice(&PropertySource::color_from_texel(geometry.dims(), level, inside));
        }
    }
}

/// Tiles are generated when they are read, faster than they could be kept, and every page has a tile.
impl TileSource for PropertySource {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move { self.tile(pos).ok_or(ReadError::NoSuchTile { pos }) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use vastex_core::{AddressMode, GeometrySpec};

    proptest! {
        #[test]
        fn a_color_names_its_texel(x in 0u32..4096, y in 0u32..4096, level in 0u8..32) {
            let color = PropertySource::color_from_texel(Dims::D2, level, [x, y, 0]);
            prop_assert_eq!(PropertySource::texel_from_color(Dims::D2, color), (level, [x, y, 0]));
            let texel = [x % 256, y % 256, (x ^ y) % 256];
            let color = PropertySource::color_from_texel(Dims::D3, level, texel);
            prop_assert_eq!(PropertySource::texel_from_color(Dims::D3, color), (level, texel));
        }
    }

    #[test]
    fn a_border_beyond_the_edge_says_what_the_address_mode_says() {
        let address = [AddressMode::Wrap, AddressMode::Mirror, AddressMode::Clamp];
        let spec = GeometrySpec { page: 10, border: 2, address, ..GeometrySpec::image(35, 25) };
        let source = PropertySource::new(Geometry::new(spec).unwrap());
        let tile = source.tile(PagePos::new_2d(0, 0, 0)).unwrap();
        let at = |x: usize, y: usize| {
            let color = *tile.bytes[(y * 14 + x) * 4..].first_chunk().unwrap();
            PropertySource::texel_from_color(Dims::D2, color)
        };
        assert_eq!(at(2, 2), (0, [0, 0, 0]));
        assert_eq!(at(0, 0), (0, [33, 1, 0]));
        assert_eq!(at(13, 13), (0, [11, 11, 0]));
    }
}
