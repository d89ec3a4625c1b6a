//! Tiles of sources that make their texels: which parts of which levels one holds.

use vastex::{Geometry, PagePos};
use vastex_core::Box3;

/// Calls `fill` with each level that a tile holds, the part of the level, and where that lies in the tile.
pub fn parts_of_tile(geometry: &Geometry, pos: PagePos, mut fill: impl FnMut(u8, Box3, [u32; 3])) {
    if !geometry.is_tail(pos) {
        return fill(pos.level, geometry.level_box_of_tile(pos), [0; 3]);
    }
    for level in geometry.tail().first_level()..=geometry.coarsest() {
        fill(level, geometry.level_box_of_tail(level), geometry.tail().offset(level));
    }
}
