//! What stands for made levels until they are there: voxels of every n-th chunk of the stored level.

use bytes::Bytes;

use super::{Base, MadeLevel, SIDE};
use crate::chunks::Chunk;
use crate::fault::VolumeError;
use crate::volume::{Plane, VoxelBox};

/// Chunks that are read for it, and their bytes, and voxels that are kept of them.
const MOST_CHUNKS: u64 = 512;
const MOST_BYTES: u64 = 128 << 20;
const MOST_VOXELS: u64 = 1 << 20;

/// Which voxels of the stored level are looked at: those at these places along x, y and z.
pub(super) struct Plan {
    places: [Vec<u64>; 3],
}

/// The voxels at these places, x fastest.
pub(super) struct Preview {
    pub(super) plan: Plan,
    pub(super) array: Bytes,
}

impl Plan {
    /// Of one of `share` stored chunks at most, and of one at least.
    pub(super) fn of(base: &Base, share: u64) -> Plan {
        let about = base.volume.about();
        let level = &about.levels[base.level];
        let chunks: [u64; 3] = std::array::from_fn(|axis| level.size[axis].div_ceil(level.chunk[axis]));
        let bytes =
            level.chunk.iter().fold(about.dtype.bytes() as u64, |bytes, side| bytes.saturating_mul(*side));
        let most = (MOST_BYTES / bytes.max(1)).min(MOST_CHUNKS).min(product(chunks) / share).max(1);
        let mut picked = chunks;
        while product(picked) > most {
            // The axis with the most chunks gives half of them up.
            let axis = (0..3).max_by_key(|axis| picked[*axis]).unwrap_or(0);
            picked[axis] = picked[axis].div_ceil(2);
        }
        let mut every = 1;
        loop {
            let places =
                [0, 1, 2].map(|axis| places(level.size[axis], level.chunk[axis], picked[axis], every));
            if product([0, 1, 2].map(|axis| places[axis].len() as u64)) <= MOST_VOXELS {
                return Plan { places };
            }
            every *= 2;
        }
    }

    /// Reads the voxels, run by run along x.
    pub(super) async fn read(&self, plane: &Plane<'_>) -> Result<Chunk, VolumeError> {
        let [xs, ys, zs] = &self.places;
        let width = plane.width;
        let side = plane.grid.chunk_size();
        let mut values = vec![0; xs.len() * ys.len() * zs.len() * width];
        // The places in each chunk along x follow one another.
        let mut runs: Vec<&[u64]> = xs.chunk_by(|a, b| a / side[0] == b / side[0]).collect();
        let mut begin = 0;
        for run in &mut runs {
            let (Some(first), Some(last)) = (run.first(), run.last()) else { continue };
            let (y_runs, z_runs) = (
                ys.chunk_by(|a, b| a / side[1] == b / side[1]),
                zs.chunk_by(|a, b| a / side[2] == b / side[2]),
            );
            let y_runs: Vec<&[u64]> = y_runs.collect();
            let mut z_begin = 0;
            for z_run in z_runs {
                let mut y_begin = 0;
                for y_run in &y_runs {
                    // One box within one chunk, of which some voxels are taken.
                    let first = [*first, y_run[0], z_run[0]];
                    let last = [*last, y_run[y_run.len() - 1], z_run[z_run.len() - 1]];
                    let size: [u32; 3] = std::array::from_fn(|axis| (last[axis] - first[axis] + 1) as u32);
                    let of = VoxelBox { first: first.map(|at| at as i64), size };
                    let found = plane.read(&of).await?.values;
                    let at = |x: u64, y: u64, z: u64| {
                        let [x, y, z] = [x - first[0], y - first[1], z - first[2]].map(|n| n as usize);
                        ((z * size[1] as usize + y) * size[0] as usize + x) * width
                    };
                    for (k, z) in z_run.iter().enumerate() {
                        for (j, y) in y_run.iter().enumerate() {
                            for (i, x) in run.iter().enumerate() {
                                let to = ((z_begin + k) * ys.len() + y_begin + j) * xs.len() + begin + i;
                                values[to * width..][..width]
                                    .copy_from_slice(&found[at(*x, *y, *z)..][..width]);
                            }
                        }
                    }
                    y_begin += y_run.len();
                }
                z_begin += z_run.len();
            }
            begin += run.len();
        }
        Ok(Chunk::new(values, [0; 3], 0))
    }
}

impl Preview {
    /// A chunk of a level, each voxel the nearest that was looked at.
    pub(super) fn chunk(&self, base: &Base, level: &MadeLevel, at: [u64; 3]) -> Chunk {
        let width = base.volume.about().dtype.bytes();
        let size: [u64; 3] = std::array::from_fn(|axis| SIDE.min(level.grid.size()[axis] - at[axis] * SIDE));
        let nearest: [Vec<usize>; 3] = std::array::from_fn(|axis| {
            let scale = level.scale[axis];
            let middle = |n: u64| (at[axis] * SIDE + n).saturating_mul(scale).saturating_add(scale / 2);
            (0..size[axis]).map(|n| nearest(&self.plan.places[axis], middle(n))).collect()
        });
        let [across, down] = [0, 1].map(|axis| self.plan.places[axis].len());
        let mut values = Vec::with_capacity(size.iter().product::<u64>() as usize * width);
        for z in &nearest[2] {
            for y in &nearest[1] {
                for x in &nearest[0] {
                    let voxel = ((z * down + y) * across + x) * width;
                    values.extend_from_slice(&self.array[voxel..voxel + width]);
                }
            }
        }
        let strides = [size[0] * size[1], size[0], 1].map(|stride| stride as usize * width);
        Chunk::new(values, strides, 0)
    }
}

fn product(sides: [u64; 3]) -> u64 {
    sides.iter().fold(1, |product: u64, side| product.saturating_mul(*side))
}

/// Every so many voxels of so many chunks that lie evenly along an axis.
fn places(size: u64, chunk: u64, picked: u64, every: u64) -> Vec<u64> {
    let chunks = size.div_ceil(chunk);
    let of_chunk = |n: u64| {
        let begin = n * chunk;
        let end = (begin + chunk).min(size);
        // One at least, at the middle of what it stands for.
        (begin + (every / 2).min((end - begin) / 2)..end).step_by(every as usize)
    };
    (0..picked).flat_map(|n| of_chunk((2 * n + 1) * chunks / (2 * picked))).collect()
}

/// Which of some ascending places is nearest to one.
fn nearest(places: &[u64], at: u64) -> usize {
    let after = places.partition_point(|place| *place < at);
    match (after.checked_sub(1), places.get(after)) {
        (Some(before), Some(next)) if at - places[before] <= next - at => before,
        (Some(before), None) => before,
        _ => after,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_lie_evenly_and_ascend() {
        assert_eq!(places(10, 4, 3, 1), (0..10).collect::<Vec<_>>());
        assert_eq!(places(10, 4, 3, 4), [2, 6, 9]);
        assert_eq!(places(1000, 10, 2, 100), [255, 755]);
        assert_eq!(places(3, 1, 3, 8), [0, 1, 2]);
    }

    #[test]
    fn the_nearest_is_found() {
        let places = [2, 6, 9];
        assert_eq!([0, 2, 4, 5, 7, 8, 100].map(|at| nearest(&places, at)), [0, 0, 0, 1, 1, 2, 2]);
    }
}
