//! Bricks with borders, put together of chunks that have none: chunk by chunk, so that each is decoded once
//! for all bricks that want it.
//!
//! A brick is a box of `side` voxels of a level, with `border` more on each side, so that a filter finds its
//! neighbours. Beyond the faces of the level its last voxels are repeated; absent chunks are the fill value.
//! Bricks whose payload lies in absent chunks alone hold nothing, and are told before anything is read.

use std::collections::BTreeMap;
use std::ops::Range;

use super::boxes::filled;
use super::cache::Had;
use super::last_used::Key;
use super::{LevelArray, Volume};
use crate::chunks::Chunk;
use crate::fault::{VolumeError, VolumeFault, damaged};

/// How bricks are cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BrickLayout {
    /// Voxels of payload along each side, 1 to 256.
    pub side: u32,
    /// Voxels of border on each side, 0 to 8.
    pub border: u32,
}

impl BrickLayout {
    /// Voxels along each side, the borders included.
    pub const fn outer(self) -> u32 {
        self.side + 2 * self.border
    }
}

/// A brick of a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BrickPos {
    /// The level; 0 is the finest that is stored.
    pub level: usize,
    /// The channel, from 0.
    pub channel: u64,
    /// The time, from 0.
    pub time: u64,
    /// The brick's place along x, y and z, in bricks.
    pub at: [u64; 3],
}

/// A brick that was put together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Brick {
    /// Values of `outer` voxels along each side, little-endian, x fastest. Voxels of the payload that lie
    /// beyond the level repeat its last ones, as borders do.
    pub values: Vec<u8>,
    /// True if no chunk of the brick's payload is stored, so that it holds the fill value alone; then
    /// `values` is empty.
    pub is_absent: bool,
}

/// What reading some bricks took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BrickWork {
    /// Chunks that were read and decoded, each once.
    pub chunks_decoded: u64,
    /// Chunks that were found absent.
    pub chunks_absent: u64,
    /// Chunks that were kept from before, or that another call was about to have.
    pub chunks_shared: u64,
    /// Copies of a part of a chunk into a brick.
    pub parts: u64,
}

/// Bytes of bricks that are put together at once.
const MOST_BYTES: u64 = 1 << 30;

/// A brick on its way.
struct Pending {
    pos: BrickPos,
    values: Vec<u8>,
    /// Chunks that it still waits for.
    waits: usize,
    /// True if a chunk of its payload is stored.
    has_payload: bool,
    /// True if a chunk could not be read, and the error was delivered.
    has_failed: bool,
}

impl Volume {
    /// Reads bricks, and delivers each as soon as it is whole. Chunks are read in the order in which the
    /// bricks that are named want them, each once, whatever the number of bricks, channels and times that it
    /// serves; those that are kept from before, or that another call has begun with, are not read again.
    /// Takes the memory of all bricks named, beside the chunks that are kept; a call whose bricks take more
    /// than 1 GiB is refused, as is one that names a brick which is not there. A brick that wants a chunk
    /// which cannot be read is delivered as that error, and the others are read all the same.
    pub async fn read_bricks(
        &self,
        layout: BrickLayout,
        wanted: &[BrickPos],
        deliver: &mut (dyn FnMut(BrickPos, Result<Brick, VolumeError>) + Send),
    ) -> Result<BrickWork, VolumeError> {
        self.check_bricks(layout, wanted)?;
        let width = self.about.dtype.bytes();
        let outer = layout.outer() as usize;
        let mut pending: Vec<Pending> = Vec::new();
        let mut order: Vec<Key> = Vec::new();
        let mut wants: BTreeMap<Key, Vec<usize>> = BTreeMap::new();
        for (n, pos) in wanted.iter().enumerate() {
            let array = &self.arrays[pos.level];
            let places = chunks_of(array, layout, pos);
            for place in &places {
                let key = (pos.level, array.grid.coords(*place, pos.channel, pos.time));
                let bricks = wants.entry(key.clone()).or_insert_with(|| {
                    order.push(key);
                    Vec::new()
                });
                bricks.push(n);
            }
            let values = filled(&array.source.fill()[..width], outer.pow(3)).ok_or_else(|| {
                VolumeFault::TooLarge("there is no memory for the bricks; name fewer at once".into())
                    .at(&self.about.path)
            })?;
            pending.push(Pending {
                pos: *pos,
                values,
                waits: places.len(),
                has_payload: false,
                has_failed: false,
            });
        }
        let mut work = BrickWork::default();
        for key in order {
            let array = &self.arrays[key.0];
            let mut bricks = wants.remove(&key).unwrap_or_default();
            bricks.retain(|n| !pending[*n].has_failed);
            if bricks.is_empty() {
                continue;
            }
            let (chunk, had) = self.shared(key.0).chunk(&key.1).await;
            match (&chunk, had) {
                (Ok(_), Had::Shared) => work.chunks_shared += 1,
                (Ok(Some(_)), Had::Read) => work.chunks_decoded += 1,
                (Ok(None), Had::Read) => work.chunks_absent += 1,
                (Err(_), _) => {}
            }
            for n in bricks {
                let brick = &mut pending[n];
                let copied = match &chunk {
                    Ok(Some(chunk)) => self.copy_into(array, layout, &key.1, chunk, brick).map(|()| 1),
                    Ok(None) => Ok(0),
                    Err(error) => Err(error.clone()),
                };
                match copied {
                    Ok(parts) => work.parts += parts,
                    Err(error) => {
                        brick.has_failed = true;
                        brick.values = Vec::new();
                        deliver(brick.pos, Err(error));
                        continue;
                    }
                }
                brick.waits -= 1;
                if brick.waits == 0 {
                    let mut values = std::mem::take(&mut brick.values);
                    if brick.has_payload {
                        repeat_edges(array, layout, &brick.pos, width, &mut values);
                    } else {
                        values = Vec::new();
                    }
                    deliver(brick.pos, Ok(Brick { values, is_absent: !brick.has_payload }));
                }
            }
        }
        Ok(work)
    }

    fn check_bricks(&self, layout: BrickLayout, wanted: &[BrickPos]) -> Result<(), VolumeError> {
        let refuse = |why: String| VolumeFault::Request(why).at(&self.about.path);
        if !(1..=256).contains(&layout.side) || layout.border > 8 {
            return Err(refuse("bricks have 1 to 256 voxels a side, and borders of up to 8".into()));
        }
        let bytes = u64::from(layout.outer()).pow(3) * self.about.dtype.bytes() as u64;
        if bytes.saturating_mul(wanted.len() as u64) > MOST_BYTES {
            return Err(refuse(format!(
                "{} bricks take more than {MOST_BYTES} bytes; name fewer at once",
                wanted.len()
            )));
        }
        for pos in wanted {
            let is_there = self.about.levels.get(pos.level).is_some_and(|level| {
                (0..3).all(|axis| pos.at[axis] < level.size[axis].div_ceil(layout.side.into()))
            });
            if !is_there || pos.channel >= self.about.channels || pos.time >= self.about.times {
                return Err(refuse(format!("there is no brick {pos:?}")));
            }
        }
        Ok(())
    }

    fn copy_into(
        &self,
        array: &LevelArray,
        layout: BrickLayout,
        coords: &[u64],
        chunk: &Chunk,
        brick: &mut Pending,
    ) -> Result<(), VolumeError> {
        let width = self.about.dtype.bytes();
        let side = array.grid.chunk_size();
        let place = array.grid.space().map(|axis| axis.map_or(0, |axis| coords[axis]));
        let strides = array.grid.space().map(|axis| axis.map_or(0, |axis| chunk.strides[axis]));
        let offset = array.grid.offset(&chunk.strides, brick.pos.channel, brick.pos.time);
        let inner: [Range<u64>; 3] = std::array::from_fn(|axis| covered(array, layout, &brick.pos, axis));
        // What the chunk and the brick have in common, in voxels of the level.
        let common: [Range<u64>; 3] = std::array::from_fn(|axis| {
            let begin = place[axis] * side[axis];
            inner[axis].start.max(begin)..inner[axis].end.min(begin + side[axis])
        });
        let first = |axis: usize| {
            i128::from(brick.pos.at[axis]) * i128::from(layout.side) - i128::from(layout.border)
        };
        let to = |axis: usize, voxel: u64| (i128::from(voxel) - first(axis)) as usize;
        let within = |axis: usize, voxel: u64| (voxel - place[axis] * side[axis]) as usize * strides[axis];
        let outer = layout.outer() as usize;
        let count = (common[0].end - common[0].start) as usize;
        let short = || {
            damaged(format!(
                "the chunk at {coords:?} of level {} is smaller than its array says",
                brick.pos.level
            ))
            .at(&self.about.path)
        };
        for z in common[2].clone() {
            for y in common[1].clone() {
                let from = offset + within(0, common[0].start) + within(1, y) + within(2, z);
                let row = ((to(2, z) * outer + to(1, y)) * outer + to(0, common[0].start)) * width;
                let row = &mut brick.values[row..row + count * width];
                if strides[0] == width {
                    let values = chunk.bytes.get(from..).and_then(|bytes| bytes.get(..row.len()));
                    row.copy_from_slice(values.ok_or_else(short)?);
                    continue;
                }
                for (x, value) in row.chunks_exact_mut(width).enumerate() {
                    let values =
                        chunk.bytes.get(from + x * strides[0]..).and_then(|bytes| bytes.get(..width));
                    value.copy_from_slice(values.ok_or_else(short)?);
                }
            }
        }
        let is_payload = (0..3).all(|axis| {
            let begin = brick.pos.at[axis] * u64::from(layout.side);
            common[axis].start < begin + u64::from(layout.side) && common[axis].end > begin
        });
        brick.has_payload |= is_payload;
        Ok(())
    }
}

/// The voxels of the level that a brick has along an axis, its borders included.
fn covered(array: &LevelArray, layout: BrickLayout, pos: &BrickPos, axis: usize) -> Range<u64> {
    let begin = pos.at[axis] * u64::from(layout.side);
    let end = (begin + u64::from(layout.side + layout.border)).min(array.grid.size()[axis]);
    begin.saturating_sub(layout.border.into())..end
}

/// The places of the chunks that a brick overlaps with its borders, those of its payload among them.
fn chunks_of(array: &LevelArray, layout: BrickLayout, pos: &BrickPos) -> Vec<[u64; 3]> {
    let side = array.grid.chunk_size();
    let range = |axis: usize| {
        let covered = covered(array, layout, pos, axis);
        covered.start / side[axis]..covered.end.div_ceil(side[axis])
    };
    let mut places = Vec::new();
    for z in range(2) {
        for y in range(1) {
            places.extend(range(0).map(|x| [x, y, z]));
        }
    }
    places
}

/// Repeats the first and the last voxels of the level beyond its faces: along x, then y, then z, so that
/// corners follow.
fn repeat_edges(array: &LevelArray, layout: BrickLayout, pos: &BrickPos, width: usize, values: &mut [u8]) {
    let outer = layout.outer() as usize;
    for axis in 0..3 {
        let covered = covered(array, layout, pos, axis);
        let first = i128::from(pos.at[axis]) * i128::from(layout.side) - i128::from(layout.border);
        let begin = (i128::from(covered.start) - first) as usize;
        let end = (i128::from(covered.end) - first) as usize;
        // Runs of so many bytes lie side by side along the axis.
        let run = width * outer.pow(axis as u32);
        for line in values.chunks_exact_mut(run * outer) {
            for n in 0..begin {
                line.copy_within(begin * run..(begin + 1) * run, n * run);
            }
            for n in end..outer {
                line.copy_within((end - 1) * run..end * run, n * run);
            }
        }
    }
}
