//! The tile of the tail: every level of it with its border, at the place that core gives it; zero in between,
//! but for the rest of a box's last blocks.

use vastex_core::{Geometry, LayerFormat};

use super::Pyramid;
use super::schedule::row_at;
use crate::tile::tail::extend_levels;

/// The texels of the tail's tile. Every row must have been pushed.
pub(crate) fn tail_texels(geometry: &Geometry, format: LayerFormat, pyramid: &Pyramid<'_>) -> Vec<u8> {
    let texel = format.texel_bytes();
    let tile_row = geometry.tile()[0] as usize * texel;
    let mut tile = vec![0; tile_row * geometry.tile()[1] as usize];
    for (level, source, offset) in geometry.tile_boxes(geometry.tail_pos()) {
        let (address, height) = (geometry.address()[1], geometry.level(level).size[1]);
        for y in 0..source.size[1] {
            let row = pyramid.tail_row(level, row_at(address, source.origin[1] + i64::from(y), height));
            let start = (offset[1] + y) as usize * tile_row + offset[0] as usize * texel;
            tile[start..start + row.len()].copy_from_slice(row);
        }
    }
    extend_levels(geometry, format, &mut tile);
    tile
}
