//! What lies beside the levels in a tail's tile, up to whole blocks: the last texels of each level, repeated.

use vastex_core::{Geometry, LayerFormat};

/// Makes what lies beside the levels of a tail up to whole blocks of `format`, of whose decoded texels the
/// tile is.
pub(crate) fn extend_levels(geometry: &Geometry, format: LayerFormat, tile: &mut [u8]) {
    let texel = format.texel_bytes();
    for (_, shown, offset) in geometry.tile_boxes(geometry.tail_pos()) {
        let box_of = [0, 1].map(|a| (offset[a] as usize, shown.size[a] as usize));
        let tile_row = geometry.tile()[0] as usize * texel;
        extend_to_blocks(tile, tile_row, texel, format.block_side() as usize, box_of);
    }
}

/// Repeats the right and lower edge of a box up to whole blocks, so that what is not shown costs no quality.
/// `box_of` has its first texel and its size along x and y.
fn extend_to_blocks(
    tile: &mut [u8],
    tile_row: usize,
    texel: usize,
    side: usize,
    box_of: [(usize, usize); 2],
) {
    let [(left, width), (top, height)] = box_of;
    let [right, bottom] = [left + width, top + height];
    let end = right.next_multiple_of(side).min(tile_row / texel);
    for row in tile.chunks_exact_mut(tile_row).take(bottom).skip(top) {
        for x in right..end {
            row.copy_within((right - 1) * texel..right * texel, x * texel);
        }
    }
    let last = (bottom - 1) * tile_row;
    for y in bottom..bottom.next_multiple_of(side).min(tile.len() / tile_row) {
        tile.copy_within(last + left * texel..last + end * texel, y * tile_row + left * texel);
    }
}
