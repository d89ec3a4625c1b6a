//! Twin of brick.wgsl and of the blend of taps_3d.wgsl: what lies at a place of a volume, in `f64` where the
//! shaders have an anchor.

use vastex_core::{Geometry, LayerFormat, PagePos, VoxelLevels};

use super::sample::decode;

/// A volume, as far as it takes to find the voxels around a place in the tiles of its bricks.
#[derive(Clone, Copy, Debug)]
pub struct Bricks<'a> {
    /// The volume's shape.
    pub geometry: &'a Geometry,
    /// Where the volume's voxels lie, if they are not its texels.
    pub voxels: Option<&'a VoxelLevels>,
    /// The format of its one layer.
    pub format: LayerFormat,
}

impl Bricks<'_> {
    /// The page of a level that covers a place, in voxels of level 0; outside of the volume the nearest one.
    pub fn page(&self, place: [f64; 3], level: u8) -> PagePos {
        let geometry = self.geometry;
        if level >= geometry.tail().first_level() {
            return geometry.tail_pos();
        }
        let (size, scale, page) = (geometry.size(), geometry.level(level).scale, geometry.page());
        let [x, y, z] = std::array::from_fn(|a| {
            let texel = place[a].floor().clamp(0.0, f64::from(size[a] - 1)) as u64;
            (texel / scale[a] / u64::from(page[a])) as u32
        });
        PagePos { level, x, y, z }
    }

    /// `vastex_brick_exact`: what lies at a place at a level, in the tile of its page: blended of the eight
    /// voxels around it.
    pub fn blended(&self, place: [f64; 3], level: u8, tile: &[u8]) -> [f32; 4] {
        let centred = self.place_in_tile(place, level).map(|at| at - 0.5);
        let first = centred.map(|at| at.floor() as usize);
        let mut sum = [0.0f32; 4];
        for corner in 0..8 {
            let of = |a: usize| corner >> a & 1;
            let weight: f64 = (0..3)
                .map(|a| {
                    let share = centred[a].fract();
                    if of(a) == 1 { share } else { 1.0 - share }
                })
                .product();
            // Beyond the last voxel of a tile nothing counts.
            if weight > 0.0 {
                let voxel = self.voxel(tile, [0, 1, 2].map(|a| first[a] + of(a)));
                sum = std::array::from_fn(|c| sum[c] + weight as f32 * voxel[c]);
            }
        }
        sum
    }

    /// `vastex_brick_nearest`: the voxel of a level in which a place lies, in the tile of its page.
    pub fn nearest(&self, place: [f64; 3], level: u8, tile: &[u8]) -> [f32; 4] {
        self.voxel(tile, self.place_in_tile(place, level).map(|at| at as usize))
    }

    /// Where a place lies in the tile of its page, between the middles of the tile's first and last voxels.
    fn place_in_tile(&self, place: [f64; 3], level: u8) -> [f64; 3] {
        let geometry = self.geometry;
        let page = self.page(place, level);
        let scale = geometry.level(level).scale;
        let (border, begin) = (geometry.border(), geometry.sample_offset(level));
        let of_level = self.voxels.map(|voxels| (voxels.level(0), voxels.level(level)));
        let at = match of_level {
            Some((finest, level)) => level.voxel_from_world(finest.world_from_voxel(place)),
            None => std::array::from_fn(|a| place[a] / scale[a] as f64 + begin[a]),
        };
        let is_tail = geometry.is_tail(page);
        let coords = if is_tail { [0; 3] } else { [page.x, page.y, page.z] };
        let sides = geometry.page();
        std::array::from_fn(|a| {
            let first_voxel = match of_level {
                Some((_, level)) => level.first_voxel(coords)[a],
                None => i64::from(coords[a]) * i64::from(sides[a]) - i64::from(border[a]),
            };
            let (low, extent) = match is_tail {
                true => (geometry.tail().offset(level)[a], geometry.level(level).size[a]),
                false => (0, sides[a]),
            };
            let high = f64::from(low) + f64::from(extent + 2 * border[a]);
            (at[a] - first_voxel as f64 + f64::from(low)).clamp(f64::from(low) + 0.5, high - 0.5)
        })
    }

    fn voxel(&self, tile: &[u8], [x, y, z]: [usize; 3]) -> [f32; 4] {
        let [width, height, _] = self.geometry.tile().map(|side| side as usize);
        let bytes = self.format.texel_bytes();
        let first = ((z * height + y) * width + x) * bytes;
        tile.get(first..first + bytes).map_or([0.0; 4], |bytes| decode(self.format, bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex_core::{GeometrySpec, StoredLevel};

    /// The tile of a page whose voxels have their numbers along x, in voxels of the level.
    fn tile(bricks: &Bricks<'_>, pos: PagePos) -> Vec<u8> {
        let geometry = bricks.geometry;
        let [width, height, depth] = geometry.tile().map(|side| side as usize);
        let mut tile = vec![0; width * height * depth * 4];
        for (level, level_box, offset) in geometry.tile_boxes(pos) {
            let coords = if geometry.is_tail(pos) { [0; 3] } else { [pos.x, pos.y, pos.z] };
            let first = bricks.voxels.map_or(level_box.origin, |v| v.level(level).first_voxel(coords));
            let [nx, ny, nz] = level_box.size.map(|n| n as usize);
            for (z, y, x) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x))))
            {
                let last = i64::from(geometry.level(level).size[0]) - 1;
                let value = (first[0] + x as i64).clamp(0, last) as f32;
                let [tx, ty, tz] = offset.map(|n| n as usize);
                let to = (((tz + z) * height + ty + y) * width + tx + x) * 4;
                tile[to..to + 4].copy_from_slice(&value.to_le_bytes());
            }
        }
        tile
    }

    #[test]
    fn places_are_found_in_bricks_and_tails_of_any_ratio() {
        let stored = |size, scale, origin| StoredLevel { size, scale, origin };
        let levels = [
            stored([145, 60, 50], [1.0; 3], [0.0; 3]),
            stored([48, 60, 20], [145.0 / 48.0, 1.0, 2.5], [0.25, 0.0, 0.0]),
        ];
        let (unaligned, voxels) = VoxelLevels::new(&levels, 16, 1).unwrap();
        let plain = GeometrySpec { page: 16, border: 1, ..GeometrySpec::volume([145, 60, 50]) };
        let plain = Geometry::new(plain).unwrap();
        for (geometry, voxels) in [(&plain, None), (&unaligned, Some(&voxels))] {
            let bricks = Bricks { geometry, voxels, format: LayerFormat::R32Float };
            for level in 0..=geometry.coarsest() {
                let (scale, origin) = match voxels {
                    Some(voxels) => (voxels.level(level).scale[0], voxels.level(level).origin[0]),
                    None => (geometry.level(level).scale[0] as f64, 0.0),
                };
                let last = f64::from(geometry.level(level).size[0]) - 1.0;
                for x in [0.0, 0.6, 15.9, 16.0, 16.1, 31.5, 99.3, 144.9] {
                    let place = [x, 33.3, 20.2];
                    let tile = tile(&bricks, bricks.page(place, level));
                    let at = (x - origin) / scale;
                    let blended = f64::from(bricks.blended(place, level, &tile)[0]);
                    assert!(
                        (blended - (at - 0.5).clamp(0.0, last)).abs() < 1e-3,
                        "{x} at {level}: {blended}"
                    );
                    let nearest = f64::from(bricks.nearest(place, level, &tile)[0]);
                    assert_eq!(nearest, at.floor().clamp(0.0, last), "{x} at {level}");
                }
            }
        }
    }
}
