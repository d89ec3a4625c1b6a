//! A tile that is missing, made of its nearest ancestor's: each texel repeated over those that it covers.
//!
//! So the levels above such a tile are, filtered again, what they were. Which ancestor is the nearest, the
//! caller knows.

use vastex_core::{Box3, Geometry, PagePos};

/// The texels of the tile of `pos`, as those of `ancestor` show them, whose tile has `texels` of
/// `texel_bytes` each. An image's; `pos` is finer than the tail, `ancestor` covers it and may be the tail.
pub(crate) fn magnified(
    geometry: &Geometry,
    pos: PagePos,
    ancestor: PagePos,
    texels: &[u8],
    texel_bytes: usize,
) -> Vec<u8> {
    let Some((level, shown, offset)) = geometry.tile_boxes(ancestor).next() else { return Vec::new() };
    let tile = geometry.level_box_of_tile(pos);
    // For each texel of the tile along an axis, the texel of the ancestor's tile.
    let sources: [Vec<usize>; 2] = [0, 1].map(|axis| {
        let factor = geometry.level(level).scale[axis] / geometry.level(pos.level).scale[axis];
        let along = |i: u32| source_texel(tile, i, factor, shown, axis) + offset[axis] as usize;
        (0..tile.size[axis]).map(along).collect()
    });
    let side = geometry.tile()[0] as usize;
    let mut out = Vec::with_capacity(tile.size[0] as usize * tile.size[1] as usize * texel_bytes);
    for &y in &sources[1] {
        for &x in &sources[0] {
            out.extend_from_slice(&texels[(y * side + x) * texel_bytes..][..texel_bytes]);
        }
    }
    out
}

/// The texel of the box `shown` that covers texel `i` of the box `tile`, of a level that is finer by
/// `factor`.
fn source_texel(tile: Box3, i: u32, factor: u64, shown: Box3, axis: usize) -> usize {
    let covering = (tile.origin[axis] + i64::from(i)).div_euclid(factor as i64);
    (covering - shown.origin[axis]).clamp(0, i64::from(shown.size[axis]) - 1) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use pollster::block_on;
    use vastex_core::{Dims, GeometrySpec};
    use vastex_tiles::{PropertySource, TileSource};

    /// Every texel of the generated source says its own level and place.
    #[test]
    fn each_texel_shows_the_one_that_covers_it() {
        let spec = GeometrySpec { page: 24, border: 3, ..GeometrySpec::image(300, 221) };
        let source = PropertySource::new(Geometry::new(spec).unwrap());
        let geometry = &source.description().geometry;
        for pos in geometry.pages().skip(1) {
            for level in pos.level + 1..=geometry.tail().first_level() {
                let ancestor = geometry.ancestor(pos, level);
                let texels = block_on(source.read(ancestor)).unwrap().bytes;
                let made = magnified(geometry, pos, ancestor, &texels, 4);
                let shown = geometry.level_box_of_tile(pos);
                for (i, color) in made.chunks_exact(4).enumerate() {
                    let at = [i as i64 % 30 + shown.origin[0], i as i64 / 30 + shown.origin[1]];
                    let size = geometry.level(pos.level).size;
                    if (0..2).any(|a| !(0..i64::from(size[a])).contains(&at[a])) {
                        continue; // beyond the edge, where rounding up may show the border of the coarser level
                    }
                    let shift = level - pos.level;
                    let expected = [(at[0] >> shift) as u32, (at[1] >> shift) as u32, 0];
                    let color = [color[0], color[1], color[2], color[3]];
                    assert_eq!(PropertySource::texel_from_color(Dims::D2, color), (level, expected), "{pos}");
                }
            }
        }
    }
}
