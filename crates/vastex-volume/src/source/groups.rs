//! Bricks that are put together at once, where chunks are large: of planes of 2048x2048 voxels a brick wants
//! 66, more than are kept, and its neighbours want the same ones.
//!
//! So where the chunks that one brick wants are many bytes, a box of bricks beside each other is read as one,
//! and kept for a while in their place: its bricks are cut out of it.

use vastex_core::{Geometry, PagePos, VoxelLevel};

use crate::volume::VoxelBox;

/// Bytes of chunks that a brick may want before it is read with others.
const MOST_OF_ONE: u64 = 64 << 20;
/// Bytes of bricks that are read at once.
const MOST_AT_ONCE: u64 = 64 << 20;

/// Bricks along each axis that are read at once.
pub(super) type Group = [u32; 3];
/// Each brick by itself.
pub(super) const ALONE: Group = [1; 3];

/// How a level with chunks of such sides is read, of values of `width` bytes.
pub(super) fn plan(geometry: &Geometry, level: u8, chunk: [u64; 3], size: [u64; 3], width: u64) -> Group {
    let tile = geometry.tile().map(u64::from);
    let product = |sides: [u64; 3]| sides.iter().fold(width, |bytes: u64, side| bytes.saturating_mul(*side));
    let wanted = |axis: usize| {
        let along = (tile[axis] - 1).div_ceil(chunk[axis]).min(size[axis].div_ceil(chunk[axis]) - 1) + 1;
        along.saturating_mul(chunk[axis])
    };
    if product([0, 1, 2].map(wanted)) <= MOST_OF_ONE {
        return ALONE;
    }
    let (page, pages) = (geometry.page().map(u64::from), geometry.level(level).pages);
    let mut group = ALONE;
    loop {
        // The axis along which chunks reach the furthest beyond the box.
        let reach = |axis: usize| chunk[axis] as f64 / (u64::from(group[axis]) * page[axis]) as f64;
        let may_grow = |axis: &usize| reach(*axis) > 1.0 && group[*axis] < pages[*axis];
        let Some(axis) = (0..3).filter(may_grow).max_by(|a, b| reach(*a).total_cmp(&reach(*b))) else {
            return group;
        };
        let mut larger = group;
        larger[axis] += 1;
        let sides = std::array::from_fn(|axis| u64::from(larger[axis] - 1) * page[axis] + tile[axis]);
        if product(sides) > MOST_AT_ONCE {
            return group;
        }
        group = larger;
    }
}

/// The box of the group that a page is in, and where in it the page's tile begins.
pub(super) fn box_of(
    geometry: &Geometry,
    level: &VoxelLevel,
    pos: PagePos,
    group: Group,
) -> (VoxelBox, [usize; 3]) {
    let (coords, pages, tile) = (pos.coords(), geometry.level(pos.level).pages, geometry.tile());
    let begin: [u32; 3] = std::array::from_fn(|axis| coords[axis] / group[axis] * group[axis]);
    let last = std::array::from_fn(|axis| (begin[axis] + group[axis]).min(pages[axis]) - 1);
    let (first, end, own) = (level.first_voxel(begin), level.first_voxel(last), level.first_voxel(coords));
    let size = std::array::from_fn(|axis| (end[axis] - first[axis]) as u32 + tile[axis]);
    (VoxelBox { first, size }, std::array::from_fn(|axis| (own[axis] - first[axis]) as usize))
}

/// Cuts a tile out of a box of values.
pub(super) fn cut(
    values: &[u8],
    [width, height, _]: [usize; 3],
    place: [usize; 3],
    tile: [usize; 3],
    value: usize,
) -> Vec<u8> {
    let mut cut = Vec::with_capacity(tile.iter().product::<usize>() * value);
    for z in 0..tile[2] {
        for y in 0..tile[1] {
            let first = ((place[2] + z) * height + place[1] + y) * width + place[0];
            cut.extend_from_slice(&values[first * value..][..tile[0] * value]);
        }
    }
    cut
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use pollster::block_on;
    use vastex_core::{StoredLevel, VoxelLevels};
    use vastex_tiles::TileSource;

    use super::*;
    use crate::{Opened, VolumeOptions, VolumeSource, open};

    fn planned(size: [u64; 3], chunk: [u64; 3]) -> Group {
        let level = StoredLevel { size, scale: [1.0; 3], origin: [0.0; 3] };
        let (geometry, _) = VoxelLevels::new(&[level], 64, 1).unwrap();
        plan(&geometry, 0, chunk, size, 2)
    }

    #[test]
    fn planes_are_read_for_many_bricks_and_cubes_for_one() {
        assert_eq!(planned([4000, 4000, 4000], [64, 64, 64]), ALONE);
        assert_eq!(planned([4000, 4000, 4000], [128, 128, 128]), ALONE);
        assert_eq!(planned([512, 512, 900], [512, 512, 1]), ALONE);
        let [x, y, z] = planned([2048, 2048, 900], [2048, 2048, 1]);
        assert!(z == 1 && x * y > 80 && x.abs_diff(y) <= 1, "{x}x{y}x{z}");
        // No more than there are, and more along the longer side.
        let [x, y, z] = planned([200, 9000, 900], [200, 9000, 1]);
        assert!(x <= 4 && y > 20 && x * y > 80 && z == 1, "{x}x{y}x{z}");
        // Thick chunks along all axes.
        assert_eq!(planned([2000, 2000, 2000], [500, 500, 500]), [5, 5, 5]);
    }

    #[test]
    fn bricks_are_the_same_however_they_are_read() {
        let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
        for name in ["v04-center.zip", "v05-shards.zip", "ome-zarr-py-05.zip"] {
            let Opened::Volume(volume) = open(&fixtures.join(name)).unwrap() else { panic!() };
            let options = VolumeOptions { brick: 8, ..VolumeOptions::default() };
            let mut source = VolumeSource::open(Arc::from(volume), &options).unwrap();
            let pages: Vec<_> = source.description.geometry.pages().collect();
            let read = |source: &VolumeSource| -> Vec<_> {
                pages.iter().map(|pos| block_on(source.read(*pos)).unwrap()).collect()
            };
            let alone = read(&source);
            assert!(source.groups.iter().all(|group| *group == ALONE));
            source.groups.fill([3, 2, 2]);
            assert!(read(&source) == alone, "{name}");
        }
    }
}
