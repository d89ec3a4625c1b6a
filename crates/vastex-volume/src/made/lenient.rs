//! Stored chunks for what must not fail: levels that are made, and the coarsest ones, without which nothing
//! is shown. Where a chunk cannot be read, voxels of the next finer level stand for it, or of a finer one for
//! these, of the finest level those of the next coarser one, else the fill value. How many chunks that stand
//! for others are looked for further down is bounded.

use std::future::Future;
use std::pin::Pin;

use super::{CHEAP_BYTES, MOST_SEARCHED, Made};
use crate::chunks::{Chunk, ChunkFuture, ChunkSource, PresenceFuture};
use crate::fault::SourceFault;
use crate::volume::{Plane, Shared, VoxelBox};

/// The chunks of a stored level, of which those that cannot be read are reported and stood for. What is known
/// to be absent is not looked for.
pub(crate) struct Lenient<'a> {
    made: &'a Made,
    shared: Shared<'a>,
    /// The stored level.
    level: usize,
    /// How many levels finer it is than the one that its chunks stand for; 0 if they stand for themselves.
    below: usize,
}

impl Made {
    /// The chunks of a stored level, which are those of `shared`.
    pub(crate) fn lenient<'a>(&'a self, shared: Shared<'a>, level: usize) -> Lenient<'a> {
        Lenient { made: self, shared, level, below: 0 }
    }

    /// Those that levels are made of.
    pub(super) fn lenient_base(&self) -> Lenient<'_> {
        self.lenient(self.base.volume.shared(self.base.level), self.base.level)
    }
}

impl<'a> Lenient<'a> {
    /// The values of the channel and the time.
    pub(crate) fn plane(&'a self) -> Plane<'a> {
        let base = &self.made.base;
        self.shared.plane_of(self, base.channel, base.time)
    }

    /// Returns true if something is to be looked for that stands for a chunk which cannot be read: of chunks
    /// that stand for others, the first few.
    fn may_be_stood_for(&self, coords: &[u64]) -> bool {
        if self.below == 0 {
            return true;
        }
        // The next coarser level is what the finest one stands for already.
        if self.level == 0 {
            return false;
        }
        let mut state = self.made.lock();
        let place = (self.level, coords.to_vec());
        state.searched.contains(&place)
            || state.searched.len() < MOST_SEARCHED && state.searched.insert(place)
    }

    /// What stands for a chunk that cannot be read: of each of its voxels the one of the next finer level
    /// that its middle lies in, and of the finest level that of the next coarser one. `None` where there is
    /// no such level, or too much of it would have to be read.
    fn stand_in<'b>(&'b self, coords: &'b [u64]) -> Pin<Box<dyn Future<Output = Option<Chunk>> + Send + 'b>> {
        Box::pin(async move {
            let base = &self.made.base;
            let volume = &base.volume;
            let finer = self.level.checked_sub(1);
            let (levels, other) = (&volume.about().levels, finer.unwrap_or(self.level + 1));
            let (of, from) = (levels.get(self.level)?, levels.get(other)?);
            let grid = volume.grid(self.level);
            let side = grid.chunk_size();
            let at = grid.space().map(|axis| axis.map_or(0, |axis| coords[axis]));
            // Where each voxel's middle lies along an axis, in voxels of the finer level.
            let places: [Vec<u64>; 3] = std::array::from_fn(|axis| {
                let first = at[axis].saturating_mul(side[axis]);
                let end = first.saturating_add(side[axis]).min(of.size[axis]);
                let place = |voxel: u64| {
                    let world = of.origin[axis] + (voxel as f64 + 0.5) * of.scale[axis];
                    let voxel = ((world - from.origin[axis]) / from.scale[axis]).floor();
                    voxel.clamp(0.0, (from.size[axis] - 1) as f64) as u64
                };
                (first..end).map(place).collect()
            });
            let first: [u64; 3] = [*places[0].first()?, *places[1].first()?, *places[2].first()?];
            let size: [u64; 3] =
                std::array::from_fn(|axis| places[axis].last().map_or(1, |last| last - first[axis] + 1));
            let width = self.made.width();
            let bytes = size.iter().fold(width as u64, |bytes, side| bytes.saturating_mul(*side));
            if bytes > CHEAP_BYTES {
                return None;
            }
            let read = VoxelBox { first: first.map(|at| at as i64), size: size.map(|side| side as u32) };
            let (shared, plane) = (volume.shared(other), (base.channel, base.time));
            let found = match finer {
                Some(finer) => {
                    let standing = Lenient { made: self.made, shared, level: finer, below: self.below + 1 };
                    standing.plane().read(&read).await
                }
                // As it is: what stands for the coarser one is the finer one.
                None => shared.plane(plane.0, plane.1).read(&read).await,
            };
            let found = found.ok()?.values;
            let mut values = Vec::with_capacity(places.iter().map(Vec::len).product::<usize>() * width);
            for z in &places[2] {
                for y in &places[1] {
                    let row = ((z - first[2]) * size[1] + y - first[1]) * size[0];
                    for x in &places[0] {
                        let voxel = (row + x - first[0]) as usize * width;
                        values.extend_from_slice(found.get(voxel..voxel + width)?);
                    }
                }
            }
            // All channels and times of the chunk are this one: nobody asks for another.
            let mut strides = vec![0; grid.shape.len()];
            let of_space = [width, width * places[0].len(), width * places[0].len() * places[1].len()];
            for (axis, stride) in grid.space().into_iter().zip(of_space) {
                axis.iter().for_each(|axis| strides[*axis] = stride);
            }
            Some(Chunk::new(values, strides, 0))
        })
    }
}

impl ChunkSource for Lenient<'_> {
    fn read<'a>(&'a self, coords: &'a [u64]) -> ChunkFuture<'a> {
        Box::pin(async move {
            if self.level == self.made.base.level && self.made.is_not_stored(coords) {
                return Ok(None);
            }
            match self.shared.read(coords).await {
                Ok(chunk) => Ok(chunk),
                Err(error) => {
                    self.made.fault(SourceFault::Voxels(error));
                    Ok(if self.may_be_stood_for(coords) { self.stand_in(coords).await } else { None })
                }
            }
        })
    }

    fn at_hand(&self, coords: &[u64], axes: usize) -> Vec<Option<Option<Chunk>>> {
        self.shared.at_hand(coords, axes)
    }

    fn is_under_way(&self, coords: &[u64]) -> bool {
        self.shared.is_under_way(coords)
    }

    fn fill(&self) -> [u8; 8] {
        self.shared.fill()
    }

    fn presence(&self, most: usize) -> PresenceFuture<'_> {
        self.shared.presence(most)
    }
}
