//! Boxes of voxels put together of chunks, wherever the boxes lie: beyond the faces of a level its last
//! voxels are repeated, absent chunks are the fill value.

use std::future::Future;

use bytes::Bytes;

use super::cache::Had;
use super::gather::{Along, Gather};
use super::{LevelArray, Volume};
use crate::chunks::{Chunk, ChunkFuture, ChunkSource, Grid, PresenceFuture};
use crate::fault::{VolumeError, VolumeFault, damaged};
use crate::spare::Spare;

/// Bytes of chunks that are held at once, so that a box is put together of them in one pass; where there are
/// more, one is copied after the other.
pub(super) const MOST_AT_ONCE: u64 = 64 << 20;

/// The values of one channel at one time of a level, as chunks that are shared by all who read them.
#[derive(Clone, Copy)]
pub(crate) struct Plane<'a> {
    pub(crate) chunks: &'a dyn ChunkSource,
    pub(crate) grid: &'a Grid,
    /// Bytes of a value.
    pub(crate) width: usize,
    pub(crate) channel: u64,
    pub(crate) time: u64,
    /// What errors name.
    pub(crate) path: &'a str,
    /// Memory for the values, where it comes back.
    pub(crate) spare: Option<&'a Spare>,
}

/// A box of voxels that may lie outside of its level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct VoxelBox {
    pub(crate) first: [i64; 3],
    /// Voxels along x, y and z, at least 1 each.
    pub(crate) size: [u32; 3],
}

/// What a box holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BoxValues {
    /// Little-endian, x fastest, then y, then z.
    pub(crate) values: Vec<u8>,
    /// True if no chunk of it is stored, so that it holds the fill value alone.
    pub(crate) is_absent: bool,
}

impl Plane<'_> {
    /// The values of a box. Takes the memory of the box, and of up to 64 MiB of chunks beside those that are
    /// kept.
    pub(crate) async fn read(&self, of: &VoxelBox) -> Result<BoxValues, VolumeError> {
        let (level, side) = (self.grid.size(), self.grid.chunk_size());
        let axes =
            std::array::from_fn(|axis| Along::new(of.first[axis], of.size[axis], level[axis], side[axis]));
        let chunk = self.grid.chunk.iter().fold(self.width as u64, |bytes, side| bytes.saturating_mul(*side));
        let bytes = axes.iter().fold(chunk, |bytes, axis| bytes.saturating_mul(axis.count() as u64));
        match bytes <= MOST_AT_ONCE {
            true => self.gather(of, &axes).await,
            false => self.read_by_chunks(of).await,
        }
    }

    fn no_memory(&self, of: &VoxelBox) -> VolumeError {
        let [width, height, depth] = of.size;
        let why =
            format!("there is no memory for a box of {width}x{height}x{depth} voxels; read it in parts");
        VolumeFault::TooLarge(why).at(self.path)
    }

    /// The values of a box in one pass, of all the chunks that it overlaps.
    pub(super) async fn gather(&self, of: &VoxelBox, axes: &[Along; 3]) -> Result<BoxValues, VolumeError> {
        let count = of.size.iter().try_fold(1_usize, |count, side| count.checked_mul(*side as usize));
        let bytes =
            count.and_then(|count| count.checked_mul(self.width)).ok_or_else(|| self.no_memory(of))?;
        let chunks = self.chunks_of(axes).await?;
        let fill = &self.chunks.fill()[..self.width];
        if chunks.iter().all(Option::is_none) {
            let values = count.and_then(|count| filled(fill, count)).ok_or_else(|| self.no_memory(of))?;
            return Ok(BoxValues { values, is_absent: true });
        }
        let mut values = self.spare.map_or_else(Vec::new, |spare| spare.take(bytes));
        values.try_reserve_exact(bytes - values.len()).map_err(|_| self.no_memory(of))?;
        values.resize(bytes, 0);
        let (channel, time) = (self.channel, self.time);
        let gather = Gather { axes, chunks: &chunks, grid: self.grid, channel, time, fill };
        gather.write(&mut values).map_err(|nth| {
            let [across, down] = [0, 1].map(|axis| axes[axis].count());
            let at = [nth % across, nth / across % down, nth / across / down];
            let at: [u64; 3] = std::array::from_fn(|axis| axes[axis].chunks.start() + at[axis] as u64);
            self.too_small(at)
        })?;
        Ok(BoxValues { values, is_absent: false })
    }

    /// Chunks, x fastest, then y, then z. Those that others are about to have are waited for at the end, the
    /// last one first: then those before it are there, as a rule, and one wait is enough.
    async fn chunks_of(&self, axes: &[Along; 3]) -> Result<Vec<Option<Chunk>>, VolumeError> {
        let (all, rank) = self.places(axes);
        let found = self.chunks.at_hand(&all, rank);
        let coords = |nth: usize| &all[nth * rank..(nth + 1) * rank];
        let missing: Vec<usize> = (0..found.len()).filter(|nth| found[*nth].is_none()).collect();
        let mut chunks: Vec<Option<Chunk>> = found.into_iter().map(Option::flatten).collect();
        let mut with_others = Vec::new();
        for nth in missing {
            match self.chunks.is_under_way(coords(nth)) {
                true => with_others.push(nth),
                false => chunks[nth] = self.chunks.read(coords(nth)).await?,
            }
        }
        for nth in with_others.into_iter().rev() {
            chunks[nth] = self.chunks.read(coords(nth)).await?;
        }
        Ok(chunks)
    }

    fn too_small(&self, at: [u64; 3]) -> VolumeError {
        let [x, y, z] = at;
        damaged(format!(
            "the chunk at {x},{y},{z} is smaller than its array says; it is damaged, or of another array"
        ))
        .at(self.path)
    }

    /// The values of a box whose chunks are too many to hold at once.
    async fn read_by_chunks(&self, of: &VoxelBox) -> Result<BoxValues, VolumeError> {
        let size = of.size.map(|side| side as usize);
        let level = self.grid.size();
        let count = size.iter().try_fold(1_usize, |count, side| count.checked_mul(*side));
        let mut values = count.and_then(|count| filled(&self.chunks.fill()[..self.width], count));
        let values = values.as_mut().ok_or_else(|| self.no_memory(of))?;
        // The voxels of the level that the box has; at least the one that is nearest to it.
        let inside = [0, 1, 2].map(|axis| {
            let last = level[axis] as i64 - 1;
            let end = of.first[axis].saturating_add(i64::from(of.size[axis]) - 1);
            (of.first[axis].clamp(0, last), end.clamp(0, last) + 1)
        });
        let part = Part {
            at: inside.map(|(begin, _)| begin as u64),
            size: inside.map(|(begin, end)| (end - begin) as u64),
        };
        let place = [0, 1, 2].map(|axis| {
            (inside[axis].0.saturating_sub(of.first[axis])).clamp(0, of.size[axis] as i64 - 1) as usize
        });
        let has_stored = self.copy(&part, values, size, place).await?;
        if has_stored {
            for (axis, (begin, count)) in place.into_iter().zip(part.size).enumerate() {
                repeat(values, size, self.width, axis, begin, count as usize);
            }
        }
        Ok(BoxValues { values: std::mem::take(values), is_absent: !has_stored })
    }

    /// Copies a part of the level to a place in a box of values. Returns true if a chunk of it is stored.
    async fn copy(
        &self,
        part: &Part,
        values: &mut [u8],
        size: [usize; 3],
        place: [usize; 3],
    ) -> Result<bool, VolumeError> {
        let side = self.grid.chunk_size();
        let range =
            |axis: usize| part.at[axis] / side[axis]..=(part.at[axis] + part.size[axis] - 1) / side[axis];
        let mut has_stored = false;
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let at = [x, y, z];
                    let coords = self.grid.coords(at, self.channel, self.time);
                    let Some(chunk) = self.chunks.read(&coords).await? else { continue };
                    has_stored = true;
                    let common = Common::of(part, side, at, place);
                    self.copy_chunk(&chunk, &common, values, size).ok_or_else(|| self.too_small(at))?;
                }
            }
        }
        Ok(has_stored)
    }

    /// Copies what a chunk and a box have in common; `None` if the chunk has not the bytes.
    fn copy_chunk(
        &self,
        chunk: &Chunk,
        common: &Common,
        values: &mut [u8],
        [to_width, to_height, _]: [usize; 3],
    ) -> Option<()> {
        let strides = self.grid.space().map(|axis| axis.map_or(0, |axis| chunk.strides[axis]));
        let offset = self.grid.offset(&chunk.strides, self.channel, self.time);
        let from = |x: usize, y: usize, z: usize| {
            offset
                + (common.within[0] + x) * strides[0]
                + (common.within[1] + y) * strides[1]
                + (common.within[2] + z) * strides[2]
        };
        let (width, row) = (self.width, common.size[0] * self.width);
        for z in 0..common.size[2] {
            for y in 0..common.size[1] {
                let to = ((common.to[2] + z) * to_height + common.to[1] + y) * to_width + common.to[0];
                let to = values.get_mut(to * width..)?.get_mut(..row)?;
                if strides[0] == width {
                    to.copy_from_slice(chunk.bytes.get(from(0, y, z)..)?.get(..row)?);
                    continue;
                }
                for (x, value) in to.chunks_exact_mut(width).enumerate() {
                    value.copy_from_slice(chunk.bytes.get(from(x, y, z)..)?.get(..width)?);
                }
            }
        }
        Some(())
    }
}

/// A part of a level, within it.
#[derive(Clone, Copy, Debug)]
struct Part {
    at: [u64; 3],
    size: [u64; 3],
}

/// What a chunk and a part of a level have in common.
struct Common {
    /// The first voxel, in the chunk and in the box.
    within: [usize; 3],
    to: [usize; 3],
    size: [usize; 3],
}

impl Common {
    fn of(part: &Part, side: [u64; 3], chunk: [u64; 3], place: [usize; 3]) -> Common {
        let begin: [u64; 3] = std::array::from_fn(|axis| part.at[axis].max(chunk[axis] * side[axis]));
        let end: [u64; 3] =
            std::array::from_fn(|axis| (part.at[axis] + part.size[axis]).min((chunk[axis] + 1) * side[axis]));
        Common {
            within: std::array::from_fn(|axis| (begin[axis] - chunk[axis] * side[axis]) as usize),
            to: std::array::from_fn(|axis| place[axis] + (begin[axis] - part.at[axis]) as usize),
            size: std::array::from_fn(|axis| (end[axis] - begin[axis]) as usize),
        }
    }
}

/// So many times one value; `None` where there is no memory for it.
pub(crate) fn filled(value: &[u8], count: usize) -> Option<Vec<u8>> {
    let bytes = count.checked_mul(value.len())?;
    if value.iter().all(|byte| *byte == 0) {
        // Memory that the system hands over is zero already.
        let mut reserved = Vec::<u8>::new();
        reserved.try_reserve_exact(bytes).ok()?;
        drop(reserved);
        return Some(vec![0; bytes]);
    }
    let mut values = Vec::new();
    values.try_reserve_exact(bytes).ok()?;
    values.extend_from_slice(value);
    while values.len() < bytes {
        values.extend_from_within(..values.len().min(bytes - values.len()));
    }
    values.truncate(bytes);
    Some(values)
}

/// Copies a box of values to a place in a larger one.
pub(crate) fn paste(
    part: &[u8],
    [width, height, _]: [usize; 3],
    values: &mut [u8],
    to: [usize; 3],
    place: [usize; 3],
    value: usize,
) {
    for (n, row) in part.chunks_exact(width * value).enumerate() {
        let (y, z) = (n % height, n / height);
        let first = ((place[2] + z) * to[1] + place[1] + y) * to[0] + place[0];
        values[first * value..][..row.len()].copy_from_slice(row);
    }
}

/// Repeats the first and the last of `count` voxels from `begin` on along an axis of a box.
fn repeat(values: &mut [u8], size: [usize; 3], width: usize, axis: usize, begin: usize, count: usize) {
    // Runs of so many bytes lie side by side along the axis.
    let run = width * size[..axis].iter().product::<usize>();
    let end = begin + count;
    for line in values.chunks_exact_mut(run * size[axis]) {
        for n in 0..begin {
            line.copy_within(begin * run..(begin + 1) * run, n * run);
        }
        for n in end..size[axis] {
            line.copy_within((end - 1) * run..end * run, n * run);
        }
    }
}

/// The chunks of a stored level of a volume, each read once for all who want it.
#[derive(Clone, Copy)]
pub(crate) struct Shared<'a> {
    volume: &'a Volume,
    level: usize,
    /// True if the ends of chunks are kept side by side, for borders.
    has_ends: bool,
}

impl<'a> Shared<'a> {
    fn array(&self) -> &'a LevelArray {
        &self.volume.arrays[self.level]
    }

    /// A chunk, and how it was had.
    pub(super) async fn chunk(&self, coords: &[u64]) -> (Result<Option<Chunk>, VolumeError>, Had) {
        let array = self.array();
        let read = async {
            let _turn = self.volume.decoding.pass(array.chunk_bytes()).await;
            let chunk = array.source.read(coords).await?;
            let side = array.grid.chunk_size()[0];
            let with_ends = |chunk: Chunk| match self.has_ends {
                true => chunk.with_ends(array.grid.axes.x, side, array.dtype.bytes()),
                false => chunk,
            };
            Ok(chunk.map(with_ends))
        };
        self.volume.cache.get((self.level, coords.to_vec()), read).await
    }

    /// A channel and a time, which exist.
    pub(crate) fn plane(&'a self, channel: u64, time: u64) -> Plane<'a> {
        self.plane_of(self, channel, time)
    }

    /// The same by chunks that another hands out in their place.
    pub(crate) fn plane_of(&self, chunks: &'a dyn ChunkSource, channel: u64, time: u64) -> Plane<'a> {
        let about = &self.volume.about;
        Plane {
            chunks,
            grid: &self.array().grid,
            width: about.dtype.bytes(),
            channel,
            time,
            path: &about.path,
            spare: None,
        }
    }
}

impl ChunkSource for Shared<'_> {
    fn read<'a>(&'a self, coords: &'a [u64]) -> ChunkFuture<'a> {
        Box::pin(async move { self.chunk(coords).await.0 })
    }

    fn at_hand(&self, coords: &[u64], axes: usize) -> Vec<Option<Option<Chunk>>> {
        self.volume.cache.share(self.level, coords, axes)
    }

    fn is_under_way(&self, coords: &[u64]) -> bool {
        self.volume.cache.is_under_way(&(self.level, coords.to_vec()))
    }

    fn fill(&self) -> [u8; 8] {
        self.array().source.fill()
    }

    fn presence(&self, most: usize) -> PresenceFuture<'_> {
        self.array().source.presence(most)
    }
}

impl Volume {
    /// A box that many want parts of, as `read` reads it, or as it was kept: of a level as the caller counts
    /// them, a channel and a time. `None` if no chunk of it is stored.
    pub(crate) async fn shared_box(
        &self,
        level: usize,
        (channel, time): (u64, u64),
        of: &VoxelBox,
        read: impl Future<Output = Result<BoxValues, VolumeError>>,
    ) -> Result<Option<Bytes>, VolumeError> {
        let mut key = vec![channel, time];
        key.extend(of.first.map(|first| first as u64));
        key.extend(of.size.map(u64::from));
        let read = async {
            let found = read.await?;
            let chunk = Chunk::new(found.values, [], 0);
            Ok((!found.is_absent).then_some(chunk))
        };
        let (outcome, _) = self.boxes.get((level, key), read).await;
        Ok(outcome?.map(|chunk| chunk.bytes.clone()))
    }

    /// The values of a stored chunk of a channel and a time, by its place among the chunks along x, y and z:
    /// little-endian, in the order in which the file has them, with all channels and times that lie in it;
    /// `None` if it is absent. It is read and decoded whatever is kept, neither kept itself nor counted.
    pub async fn read_chunk(
        &self,
        level: usize,
        (channel, time): (u64, u64),
        at: [u64; 3],
    ) -> Result<Option<Bytes>, VolumeError> {
        self.check_plane(channel, time)?;
        let refuse = |why: String| VolumeFault::Request(why).at(&self.about.path);
        let array = self.arrays.get(level).ok_or_else(|| {
            refuse(format!("there is no level {level}; levels 0 to {} are stored", self.arrays.len() - 1))
        })?;
        let counts: [u64; 3] =
            std::array::from_fn(|axis| array.grid.size()[axis].div_ceil(array.grid.chunk_size()[axis]));
        if (0..3).any(|axis| at[axis] >= counts[axis]) {
            let ([x, y, z], [nx, ny, nz]) = (at, counts);
            return Err(refuse(format!(
                "there is no chunk {x},{y},{z} of level {level}; there are {nx}x{ny}x{nz}"
            )));
        }
        let _turn = self.decoding.pass(array.chunk_bytes()).await;
        let chunk = array.source.read(&array.grid.coords(at, channel, time)).await?;
        Ok(chunk.map(|chunk| chunk.bytes.clone()))
    }

    /// The chunks of a stored level that exists.
    pub(crate) fn shared(&self, level: usize) -> Shared<'_> {
        Shared { volume: self, level, has_ends: false }
    }

    /// The same for somebody who wants bricks with borders.
    pub(crate) fn shared_for_bricks(&self, level: usize) -> Shared<'_> {
        Shared { volume: self, level, has_ends: true }
    }

    /// How a stored level that exists is cut into chunks.
    pub(crate) fn grid(&self, level: usize) -> &Grid {
        &self.arrays[level].grid
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_fill_any_length() {
        for (value, count) in [(&[1, 2, 3][..], 7), (&[0, 0][..], 5), (&[9][..], 1), (&[4, 5, 6, 7][..], 64)]
        {
            let found = filled(value, count).unwrap();
            assert_eq!(found, value.iter().copied().cycle().take(count * value.len()).collect::<Vec<u8>>());
        }
        assert!(filled(&[1; 8], usize::MAX / 4).is_none());
        assert!(filled(&[0; 8], usize::MAX / 16).is_none());
    }

    #[test]
    fn ends_are_repeated_along_each_axis() {
        let mut values = vec![0, 0, 7, 8, 0];
        repeat(&mut values, [5, 1, 1], 1, 0, 2, 2);
        assert_eq!(values, [7, 7, 7, 8, 8]);
        let mut values = vec![0, 0, 1, 2, 0, 0];
        repeat(&mut values, [2, 3, 1], 1, 1, 1, 1);
        assert_eq!(values, [1, 2, 1, 2, 1, 2]);
    }
}
