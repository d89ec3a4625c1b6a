//! Where a label of a number is: all voxels of a level are looked at, block by block, so that stored chunks
//! are decoded once and no more of them is kept than a block lies in.

use std::ops::Range;

use anyhow::Result;
use glam::DVec3;
use pollster::block_on;
use vastex::VoxelLevel;
use vastex_volume::{SliceAxis, VolumeSource};

use super::LabelsBelow;
use super::labels::at;

/// Voxels of the finest level in which a label is looked for.
const MOST_VOXELS: u64 = 1 << 30;
/// Voxels along the sides of a block, at least, and of one of its layers at most.
const LEAST_SIDE: u64 = 256;
const MOST_LAYER: u64 = 1 << 24;
/// Voxels along the sides of chunks of levels that are made.
const MADE_CHUNK: [u64; 3] = [64; 3];

/// A place that a label lies at: of the coarsest level that has it, in the layer of the block that has most
/// of it. `None` where no level of up to a milliard voxels has it, or once `is_over` says that nobody waits
/// for it any more, which is asked before each layer of a block.
pub(crate) fn find(labels: &LabelsBelow, label: i128, is_over: impl Fn() -> bool) -> Result<Option<DVec3>> {
    // The bytes that are compared are all of its bits only where it is one of what values can be.
    let bounds = labels.0.volume().about().dtype.bounds();
    if bounds.is_none_or(|(least, most)| !(least..=most).contains(&label)) {
        return Ok(None);
    }
    let levels = labels.0.levels().levels();
    for (nth, level) in levels.iter().enumerate().rev() {
        let voxels = level.size.iter().fold(1, |voxels: u64, side| voxels.saturating_mul(u64::from(*side)));
        if voxels > MOST_VOXELS || is_over() {
            return Ok(None);
        }
        // A coarse voxel stands for finer ones of which most have the label.
        if let Some(place) = find_in(labels, label, (nth, level), &is_over)?
            && at(labels, place)? == Some(label)
        {
            return Ok(Some(place));
        }
    }
    Ok(None)
}

fn find_in(
    (source, of): &LabelsBelow,
    label: i128,
    (nth, level): (usize, &VoxelLevel),
    is_over: &impl Fn() -> bool,
) -> Result<Option<DVec3>> {
    let width = source.volume().about().dtype.bytes();
    let bytes = &label.to_le_bytes()[..width];
    let finest = source.levels().level(0);
    let mut most: Option<(usize, DVec3)> = None;
    for [columns, rows, planes] in blocks(level.size, chunk_of(source, level)) {
        let size = [columns.end - columns.start, rows.end - rows.start];
        for plane in planes {
            if is_over() {
                return Ok(None);
            }
            let middle = level.world_from_voxel([0.5, 0.5, f64::from(plane) + 0.5]);
            let index = finest.voxel_from_world(middle)[2].max(0.0) as u32;
            let index = index.min(finest.size[2].saturating_sub(1));
            let slice = source.slice(nth as u8, SliceAxis::Z, index, [columns.start, rows.start], size);
            let slice = block_on(slice)?;
            let has = |value: &(usize, &[u8])| value.1 == bytes;
            let count = slice.chunks_exact(width).enumerate().filter(has).count();
            if count == 0 || most.is_some_and(|(before, _)| before >= count) {
                continue;
            }
            // One in the middle of them, which surely is one.
            let middle = slice.chunks_exact(width).enumerate().filter(has).nth(count / 2);
            let at = middle.map_or(0, |(at, _)| at as u32);
            let (x, y) = (columns.start + at % size[0], rows.start + at / size[0]);
            let world = level.world_from_voxel([x, y, plane].map(|at| f64::from(at) + 0.5));
            let voxel = DVec3::from_array(finest.voxel_from_world(world));
            most = Some((count, DVec3::from_array(of.begin) + voxel * of.of.voxel));
        }
    }
    Ok(most.map(|(_, place)| place))
}

/// Voxels of a chunk of a level.
fn chunk_of(source: &VolumeSource, level: &VoxelLevel) -> [u64; 3] {
    let stored = level.stored.and_then(|stored| source.volume().about().levels.get(usize::from(stored)));
    stored.map_or(MADE_CHUNK, |stored| stored.chunk)
}

/// Blocks that together are a level, each as deep as its chunks and with sides of whole chunks, unless these
/// are so large that a layer would be.
fn blocks(size: [u32; 3], chunk: [u64; 3]) -> impl Iterator<Item = [Range<u32>; 3]> {
    let chunk = chunk.map(|side| side.max(1));
    let mut sides = [0, 1].map(|axis: usize| LEAST_SIDE.div_ceil(chunk[axis]).saturating_mul(chunk[axis]));
    sides[0] = sides[0].min(u64::from(size[0])).min(MOST_LAYER);
    sides[1] = sides[1].min((MOST_LAYER / sides[0].max(1)).max(1));
    let (columns, rows) = (parts(size[0], sides[0]), parts(size[1], sides[1]));
    parts(size[2], chunk[2]).flat_map(move |planes| {
        let columns = columns.clone();
        rows.clone().flat_map(move |rows| {
            let planes = planes.clone();
            columns.clone().map(move |columns| [columns, rows.clone(), planes.clone()])
        })
    })
}

fn parts(size: u32, side: u64) -> impl Iterator<Item = Range<u32>> + Clone {
    let side = u32::try_from(side).unwrap_or(u32::MAX).max(1);
    (0..size).step_by(side as usize).map(move |begin| begin..begin.saturating_add(side).min(size))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_whole_chunks_and_together_the_level() {
        for (size, chunk) in [
            ([1000, 700, 90], [100, 300, 64]),
            ([5, 4, 3], [64, 64, 64]),
            ([100_000, 50_000, 2], [100_000, 50_000, 1]),
            ([70_000, 3, 9], [1, 1, 1 << 40]),
            ([1, 1, 1], [0, 0, 0]),
        ] {
            let blocks: Vec<_> = blocks(size, chunk).collect();
            let voxels = |block: &[Range<u32>; 3], axes: usize| -> u64 {
                block.iter().take(axes).map(|side| u64::from(side.end - side.start)).product()
            };
            let sum: u64 = blocks.iter().map(|block| voxels(block, 3)).sum();
            assert_eq!(sum, size.iter().map(|side| u64::from(*side)).product::<u64>(), "{size:?}");
            assert!(blocks.iter().all(|block| voxels(block, 2) <= MOST_LAYER), "{size:?}");
        }
        assert_eq!(blocks([1000, 700, 90], [100, 300, 64]).next(), Some([0..300, 0..300, 0..64]));
    }
}
