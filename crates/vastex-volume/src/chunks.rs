//! What every kind of volume is read by: boxes of values, each decoded as a whole, in a regular grid.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

use bytes::Bytes;

use crate::fault::VolumeError;

/// Which axes of an array mean what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct AxisMap {
    pub(crate) x: usize,
    pub(crate) y: usize,
    pub(crate) z: Option<usize>,
    pub(crate) channel: Option<usize>,
    pub(crate) time: Option<usize>,
}

/// A regular grid of chunks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Grid {
    /// Values along each axis of the array.
    pub(crate) shape: Vec<u64>,
    /// Values of a chunk along each axis, at least 1.
    pub(crate) chunk: Vec<u64>,
    pub(crate) axes: AxisMap,
}

impl Grid {
    /// The array's axes of x, y and z.
    pub(crate) fn space(&self) -> [Option<usize>; 3] {
        [Some(self.axes.x), Some(self.axes.y), self.axes.z]
    }

    /// Values along x, y and z.
    pub(crate) fn size(&self) -> [u64; 3] {
        self.space().map(|axis| axis.map_or(1, |axis| self.shape[axis]))
    }

    /// Values of a chunk along x, y and z.
    pub(crate) fn chunk_size(&self) -> [u64; 3] {
        self.space().map(|axis| axis.map_or(1, |axis| self.chunk[axis]))
    }

    /// Values along the axis of channels, 1 where there is none.
    pub(crate) fn channels(&self) -> u64 {
        self.axes.channel.map_or(1, |axis| self.shape[axis])
    }

    /// Values along the axis of time, 1 where there is none.
    pub(crate) fn times(&self) -> u64 {
        self.axes.time.map_or(1, |axis| self.shape[axis])
    }

    /// The coordinates of the chunk at a place among the chunks of a channel and a time. Axes without a
    /// meaning are at 0.
    pub(crate) fn coords(&self, at: [u64; 3], channel: u64, time: u64) -> Vec<u64> {
        let mut coords = vec![0; self.shape.len()];
        self.put_place(&mut coords, at);
        for (axis, at) in [(self.axes.channel, channel), (self.axes.time, time)] {
            if let Some(axis) = axis {
                coords[axis] = at / self.chunk[axis];
            }
        }
        coords
    }

    /// Puts another place among the chunks into the coordinates of one.
    pub(crate) fn put_place(&self, coords: &mut [u64], at: [u64; 3]) {
        for (axis, at) in self.space().into_iter().zip(at) {
            if let Some(axis) = axis {
                coords[axis] = at;
            }
        }
    }

    /// Bytes from the first value of a chunk to that of a channel and a time in it.
    pub(crate) fn offset(&self, strides: &[usize], channel: u64, time: u64) -> usize {
        let part = |axis: Option<usize>, at: u64| {
            axis.map_or(0, |axis| (at % self.chunk[axis]) as usize * strides[axis])
        };
        part(self.axes.channel, channel) + part(self.axes.time, time)
    }
}

/// A decoded chunk, shared by whoever wants a part of it.
#[derive(Clone, Debug)]
pub(crate) struct Chunk(Arc<Parts>);

/// What a chunk has.
#[derive(Debug)]
pub(crate) struct Parts {
    /// The chunk's values, little-endian.
    pub(crate) bytes: Bytes,
    /// Bytes from a value to the next one along each axis of the array.
    pub(crate) strides: Arc<[usize]>,
    /// Bytes that were read for it: as they are stored, or of TIFF as they are decoded. 0 of what was made.
    pub(crate) stored: usize,
    /// The chunk's first and last values along x, side by side, where they are kept.
    pub(crate) ends: Option<[Vec<u8>; 2]>,
}

impl std::ops::Deref for Chunk {
    type Target = Parts;

    fn deref(&self) -> &Parts {
        &self.0
    }
}

impl Chunk {
    /// Values, how far apart they lie, and the bytes that were read for them.
    pub(crate) fn new(bytes: impl Into<Bytes>, strides: impl Into<Arc<[usize]>>, stored: usize) -> Chunk {
        Chunk(Arc::new(Parts { bytes: bytes.into(), strides: strides.into(), stored, ends: None }))
    }

    /// Keeps its first and last values along x side by side, `x` being the axis and `side` its values along
    /// it, of `width` bytes each: a border of one voxel then touches a run of memory, where it would touch
    /// one value in each row of the chunk. Only of chunks whose rows lie along x, and that nobody else has.
    pub(crate) fn with_ends(mut self, x: usize, side: u64, width: usize) -> Chunk {
        let row = usize::try_from(side).ok().and_then(|side| side.checked_mul(width)).unwrap_or(0);
        let are_rows = |(axis, stride): (usize, &usize)| match axis == x {
            true => *stride == width,
            false => stride.is_multiple_of(row),
        };
        // Of a few voxels the rows are no longer than what is kept.
        if side >= 8
            && row > 0
            && self.strides.iter().enumerate().all(are_rows)
            && let Some(parts) = Arc::get_mut(&mut self.0)
        {
            parts.ends = Some(match width {
                1 => ends_of::<1>(&parts.bytes, row),
                2 => ends_of::<2>(&parts.bytes, row),
                4 => ends_of::<4>(&parts.bytes, row),
                _ => ends_of::<8>(&parts.bytes, row),
            });
        }
        self
    }

    /// Bytes of memory that it takes.
    pub(crate) fn cost(&self) -> usize {
        self.bytes.len() + self.ends.as_ref().map_or(0, |ends| ends[0].len() + ends[1].len())
    }
}

fn ends_of<const WIDTH: usize>(bytes: &[u8], row: usize) -> [Vec<u8>; 2] {
    let rows = bytes.len() / row;
    let mut ends = [0, 1].map(|_| vec![0; rows * WIDTH]);
    let [firsts, lasts] = &mut ends;
    let ends_of_rows = firsts.as_chunks_mut::<WIDTH>().0.iter_mut().zip(lasts.as_chunks_mut::<WIDTH>().0);
    for (row, (to_first, to_last)) in bytes.chunks_exact(row).zip(ends_of_rows) {
        if let (Some(first), Some(last)) = (row.first_chunk::<WIDTH>(), row.last_chunk::<WIDTH>()) {
            (*to_first, *to_last) = (*first, *last);
        }
    }
    ends
}

/// Which chunks of an array are stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Presence {
    /// All of them.
    All,
    /// These chunks alone.
    These(ChunkList),
    /// Finding out takes more than was allowed.
    Unknown,
}

/// Chunks of an array, or cells of as many chunks along each axis, as shards are.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct ChunkList {
    /// The coordinates of one cell after the other, along all axes.
    pub(crate) coords: Vec<u32>,
    /// Chunks of a cell along each axis.
    pub(crate) cell: Vec<u64>,
}

impl ChunkList {
    /// An empty list of an array of so many axes.
    pub(crate) fn new(axes: usize) -> ChunkList {
        ChunkList { coords: Vec::new(), cell: vec![1; axes] }
    }

    /// Adds a cell, of coordinates below 2^32, where the list takes up to `most` bytes then. Returns whether
    /// it does.
    pub(crate) fn add(&mut self, coords: &[u64], most: usize) -> bool {
        let has_room = (self.coords.len() + coords.len()) * size_of::<u32>() <= most;
        if has_room {
            self.coords.extend(coords.iter().map(|at| *at as u32));
        }
        has_room
    }

    /// The coordinates of each cell.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &[u32]> {
        self.coords.chunks_exact(self.cell.len().max(1))
    }

    /// Returns true if it has chunks, and not shards of which it is not known what they hold.
    pub(crate) fn is_of_chunks(&self) -> bool {
        self.cell.iter().all(|count| *count == 1)
    }
}

/// A chunk on its way; `None` if it is absent.
pub(crate) type ChunkFuture<'a> =
    Pin<Box<dyn Future<Output = Result<Option<Chunk>, VolumeError>> + Send + 'a>>;
/// A count on its way.
pub(crate) type PresenceFuture<'a> = Pin<Box<dyn Future<Output = Result<Presence, VolumeError>> + Send + 'a>>;

/// Keys that are in memory, and entries in indices of shards, that are looked at for one key that a directory
/// lists.
pub(crate) const LOOKS_FOR_A_KEY: usize = 16;
/// Bytes that a list of chunks takes at most: 89 million chunks of three axes, 53 million of five.
pub(crate) const MOST_LISTED: usize = 1 << 30;

/// The chunks of an array. Shared by threads.
pub(crate) trait ChunkSource: Send + Sync {
    /// Reads and decodes the chunk at coordinates within the grid.
    fn read<'a>(&'a self, coords: &'a [u64]) -> ChunkFuture<'a>;

    /// The chunks that can be had without reading anything, of those at coordinates that lie one after the
    /// other, `axes` each; `None` within of those that are known to be absent.
    fn at_hand(&self, coords: &[u64], axes: usize) -> Vec<Option<Option<Chunk>>> {
        vec![None; coords.len() / axes]
    }

    /// Returns true if another is about to have a chunk.
    fn is_under_way(&self, _coords: &[u64]) -> bool {
        false
    }

    /// The value of absent chunks, little-endian, in as many bytes as a value has.
    fn fill(&self) -> [u8; 8];

    /// Which chunks are stored: unknown where a directory has more than `most` keys, what is in memory
    /// already, as an archive's keys are, [`LOOKS_FOR_A_KEY`] times as many, or the list were larger than
    /// [`MOST_LISTED`]. Of shards all indices are read, if these are at most a 64th of `most`, have at most
    /// [`LOOKS_FOR_A_KEY`] times as many entries, stored or not, and at most 512 bytes for each of `most` are
    /// read or inflated for them; else, and where the list of chunks were larger than [`MOST_LISTED`], the
    /// list is of the shards that are there. Of a shard whose index cannot be read all chunks count as
    /// stored.
    fn presence(&self, most: usize) -> PresenceFuture<'_>;
}
