//! Reads boxes of a volume with as many threads as there are, and goes on beyond damaged chunks where that is
//! asked for.

use std::sync::{Mutex, PoisonError};

use pollster::block_on;
use vastex_volume::{Volume, VolumeError, VolumeRegion};

use super::block::Block;
use super::error::VolumeBuildError;
use super::sink::Stop;
use crate::threads;

/// Damaged chunks that are named.
const MOST_NAMED: usize = 20;

/// Reads the finest level of a volume.
pub(super) struct Reading<'a> {
    volume: &'a Volume,
    /// True if chunks that cannot be read become the fill value.
    is_tolerant: bool,
    stop: &'a Stop,
    fill: Vec<u8>,
    damage: Mutex<Damage>,
}

/// Which chunks could not be read.
#[derive(Default)]
pub(super) struct Damage {
    /// Of the first ones, what was wrong.
    pub(super) named: Vec<String>,
    /// Boxes that were filled, all in all.
    pub(super) count: u64,
}

impl<'a> Reading<'a> {
    /// Reads until `stop` is set.
    pub(super) fn new(volume: &'a Volume, is_tolerant: bool, stop: &'a Stop) -> Reading<'a> {
        Reading { volume, is_tolerant, stop, fill: volume.fill(), damage: Mutex::default() }
    }

    /// What could not be read so far.
    pub(super) fn into_damage(self) -> Damage {
        self.damage.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// A box of the finest level of a channel and a time; `inner` is what of it is a part of its own.
    pub(super) fn read(
        &self,
        [channel, time]: [u64; 2],
        at: [u64; 3],
        size: [u64; 3],
        inner: [[u64; 3]; 2],
    ) -> Result<Block, VolumeBuildError> {
        let about = self.volume.about();
        let chunk = about.levels[0].chunk;
        let width = about.dtype.bytes();
        let sides = size.map(|side| side as usize);
        let mut values = vec![0; sides.iter().product::<usize>() * width];
        let of_z = cuts(at[2], size[2], chunk[2]);
        // Where there are few layers of chunks, each is shared by several threads.
        let of_y = match of_z.len() < 4 * rayon::current_num_threads() {
            true => cuts(at[1], size[1], chunk[1]),
            false => vec![(at[1], size[1])],
        };
        let parts: Vec<_> = of_z.iter().flat_map(|z| of_y.iter().map(move |y| (*y, *z))).collect();
        for parts in parts.chunks(4 * rayon::current_num_threads()) {
            let read = threads::try_map(parts.iter().copied(), |((y, height), (z, depth))| {
                self.stop.check()?;
                let region = VolumeRegion {
                    level: 0,
                    channel,
                    time,
                    at: [at[0], y, z],
                    size: [size[0], height, depth],
                };
                Ok::<_, VolumeBuildError>((region, self.read_region(region)?))
            })?;
            for (region, part) in read {
                let layer = (region.size[0] * region.size[1]) as usize * width;
                let [_, y, z] = std::array::from_fn(|axis| (region.at[axis] - at[axis]) as usize);
                for (n, layer) in part.chunks_exact(layer).enumerate() {
                    let to = ((z + n) * sides[1] + y) * sides[0] * width;
                    values[to..to + layer.len()].copy_from_slice(layer);
                }
            }
        }
        Ok(Block { at, size: sides, values, inner })
    }

    fn read_region(&self, region: VolumeRegion) -> Result<Vec<u8>, VolumeError> {
        match block_on(self.volume.read(&region)) {
            Err(_) if self.is_tolerant => self.read_around_damage(region),
            read => read,
        }
    }

    /// Reads a box chunk by chunk; what cannot be read is the fill value.
    fn read_around_damage(&self, region: VolumeRegion) -> Result<Vec<u8>, VolumeError> {
        self.volume.check(&region)?;
        let width = self.fill.len();
        let chunk = self.volume.about().levels[0].chunk;
        let [sides_x, sides_y, sides_z] = region.size.map(|side| side as usize);
        let mut values = self.fill.repeat(sides_x * sides_y * sides_z);
        let along = |axis: usize| cuts(region.at[axis], region.size[axis], chunk[axis]);
        for (z, depth) in along(2) {
            for (y, height) in along(1) {
                for (x, across) in along(0) {
                    let part = VolumeRegion { at: [x, y, z], size: [across, height, depth], ..region };
                    let read = match block_on(self.volume.read(&part)) {
                        Ok(read) => read,
                        Err(error) => {
                            self.note(&error);
                            continue;
                        }
                    };
                    for (n, row) in read.chunks_exact(across as usize * width).enumerate() {
                        let (row_y, row_z) = (n % height as usize, n / height as usize);
                        let to_y = (y - region.at[1]) as usize + row_y;
                        let to_z = (z - region.at[2]) as usize + row_z;
                        let to = (to_z * sides_y + to_y) * sides_x + (x - region.at[0]) as usize;
                        values[to * width..][..row.len()].copy_from_slice(row);
                    }
                }
            }
        }
        Ok(values)
    }

    fn note(&self, error: &VolumeError) {
        let mut damage = self.damage.lock().unwrap_or_else(PoisonError::into_inner);
        let error = error.to_string();
        if damage.named.contains(&error) {
            return;
        }
        damage.count += 1;
        if damage.named.len() < MOST_NAMED {
            damage.named.push(error);
        }
    }
}

/// A side in parts that end where chunks do: where each begins, and how long it is.
fn cuts(at: u64, len: u64, chunk: u64) -> Vec<(u64, u64)> {
    let mut parts = Vec::new();
    let mut begin = at;
    while begin < at + len {
        let end = ((begin / chunk + 1) * chunk).min(at + len);
        parts.push((begin, end - begin));
        begin = end;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chunks are not read once nobody wants them.
    #[test]
    fn reading_ends_between_chunks() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/volumes/head.zip");
        let vastex_volume::Opened::Volume(volume) = vastex_volume::open(&path).unwrap() else { panic!() };
        let (stop, size) = (Stop::default(), volume.about().size());
        let reading = Reading::new(&volume, false, &stop);
        stop.set();
        let ended = reading.read([0, 0], [0; 3], size, [[0; 3], size]);
        assert!(matches!(ended, Err(VolumeBuildError::Cancelled)));
        assert_eq!(volume.chunk_work().decoded, 0);
    }

    #[test]
    fn parts_end_where_chunks_do() {
        assert_eq!(cuts(3, 20, 8), [(3, 5), (8, 8), (16, 7)]);
        assert_eq!(cuts(8, 8, 8), [(8, 8)]);
        assert_eq!(cuts(0, 5, 100), [(0, 5)]);
    }
}
