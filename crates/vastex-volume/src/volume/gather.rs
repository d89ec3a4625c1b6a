//! A box of voxels from the chunks that it overlaps, in one pass: row after row as the box has them, each put
//! together of a run of every chunk along it. Nothing is written twice, and nothing is cleared before.
//!
//! Beyond the faces of the level its last voxels are repeated: along x in each row, then whole rows, then
//! whole layers.

use std::ops::RangeInclusive;

use crate::chunks::{Chunk, Grid};

/// A box of voxels along one axis, cut where chunks end.
pub(super) struct Along {
    /// The chunks that it overlaps.
    pub(super) chunks: RangeInclusive<u64>,
    /// Of each of them the first voxel that lies in the box, and how many do.
    runs: Vec<(usize, usize)>,
    /// How often the first voxel of the level is repeated before it, and the last one after it.
    before: usize,
    after: usize,
}

impl Along {
    /// Of `size` voxels from `first` on, of a level with `level` voxels in chunks of `chunk`. A box that lies
    /// outside has the voxel that is nearest to it.
    pub(super) fn new(first: i64, size: u32, level: u64, chunk: u64) -> Along {
        let last = i64::try_from(level).unwrap_or(i64::MAX).saturating_sub(1).max(0);
        let end = first.saturating_add(i64::from(size) - 1);
        let (begin, end) = (first.clamp(0, last), end.clamp(0, last));
        // Of a box that lies outside all but one voxel is repeated, on one side.
        let before = begin.saturating_sub(first).clamp(0, i64::from(size) - 1) as usize;
        let count = (end - begin + 1) as usize;
        let (begin, end) = (begin as u64, end as u64);
        let chunks = begin / chunk..=end / chunk;
        let run = |n: u64| {
            let (from, to) = (begin.max(n * chunk), end.min(n * chunk + (chunk - 1)));
            ((from - n * chunk) as usize, (to - from + 1) as usize)
        };
        Along {
            runs: chunks.clone().map(run).collect(),
            chunks,
            before,
            after: size as usize - before - count,
        }
    }

    /// How many chunks it overlaps.
    pub(super) fn count(&self) -> usize {
        self.runs.len()
    }

    /// The voxel that lies the furthest in the chunk at a place among them.
    fn last_within(&self, nth: usize) -> usize {
        self.runs.get(nth).map_or(0, |(first, count)| first + count - 1)
    }
}

/// The chunks that a box overlaps, x fastest, then y, then z; `None` for those that are absent.
pub(super) struct Gather<'a> {
    pub(super) axes: &'a [Along; 3],
    pub(super) chunks: &'a [Option<Chunk>],
    pub(super) grid: &'a Grid,
    pub(super) channel: u64,
    pub(super) time: u64,
    /// The bytes of the value of absent chunks.
    pub(super) fill: &'a [u8],
}

/// What a row of the box takes of one chunk.
struct Piece<'a> {
    /// From the chunk's first value that any row of these takes; `None` for an absent chunk.
    bytes: Option<&'a [u8]>,
    /// Bytes from a voxel of the chunk to the next one along y and z, and along x.
    row: usize,
    layer: usize,
    step: usize,
    /// Voxels.
    count: usize,
}

impl Gather<'_> {
    /// Appends the values of the box; `Err` has the place among the chunks of one that has too few bytes.
    /// There is room for all.
    pub(super) fn append(&self, values: &mut Vec<u8>) -> Result<(), usize> {
        match self.fill.len() {
            1 => self.append_of::<1>(values),
            2 => self.append_of::<2>(values),
            4 => self.append_of::<4>(values),
            _ => self.append_of::<8>(values),
        }
    }

    fn append_of<const WIDTH: usize>(&self, values: &mut Vec<u8>) -> Result<(), usize> {
        let [_, along_y, along_z] = self.axes;
        for (k, (_, layers)) in along_z.runs.iter().enumerate() {
            let pieces = (0..along_y.count())
                .map(|j| self.pieces::<WIDTH>(j, k))
                .collect::<Result<Vec<_>, usize>>()?;
            for z in 0..*layers {
                let begin = values.len();
                for (j, (_, rows)) in along_y.runs.iter().enumerate() {
                    for y in 0..*rows {
                        let row = values.len();
                        self.append_row::<WIDTH>(&pieces[j], y, z, values);
                        let is_first = j == 0 && y == 0;
                        let is_last = j + 1 == along_y.count() && y + 1 == *rows;
                        let more = if is_first { along_y.before } else { 0 }
                            + if is_last { along_y.after } else { 0 };
                        repeat(values, row, more);
                    }
                }
                let is_first = k == 0 && z == 0;
                let is_last = k + 1 == along_z.count() && z + 1 == *layers;
                let more =
                    if is_first { along_z.before } else { 0 } + if is_last { along_z.after } else { 0 };
                repeat(values, begin, more);
            }
        }
        Ok(())
    }

    /// What rows take of the chunks at a place along y and z, all of which have the bytes for it.
    fn pieces<const WIDTH: usize>(&self, j: usize, k: usize) -> Result<Vec<Piece<'_>>, usize> {
        let [along_x, along_y, along_z] = self.axes;
        let space = self.grid.space();
        let piece = |(i, (first, count)): (usize, &(usize, usize))| {
            let nth = (k * along_y.count() + j) * along_x.count() + i;
            let Some(chunk) = self.chunks.get(nth).and_then(Option::as_ref) else {
                return Ok(Piece { bytes: None, row: 0, layer: 0, step: WIDTH, count: *count });
            };
            let [step, row, layer] = space.map(|axis| axis.map_or(0, |axis| chunk.strides[axis]));
            let place = |x: usize, y: usize, z: usize| {
                let offset = self.grid.offset(&chunk.strides, self.channel, self.time);
                offset + x * step + y * row + z * layer
            };
            let first = place(*first, along_y.runs[j].0, along_z.runs[k].0);
            let last = place(along_x.last_within(i), along_y.last_within(j), along_z.last_within(k));
            let bytes = chunk.bytes.get(first..last + WIDTH).ok_or(nth)?;
            Ok(Piece { bytes: Some(bytes), row, layer, step, count: *count })
        };
        along_x.runs.iter().enumerate().map(piece).collect()
    }

    fn append_row<const WIDTH: usize>(&self, pieces: &[Piece<'_>], y: usize, z: usize, values: &mut Vec<u8>) {
        let along_x = &self.axes[0];
        let begin = values.len();
        if along_x.before > 0 {
            // The first voxel stands for those before it.
            let first = &pieces[0];
            let at = y * first.row + z * first.layer;
            let value = first.bytes.map_or(self.fill, |bytes| &bytes[at..at + WIDTH]);
            (0..along_x.before).for_each(|_| values.extend_from_slice(value));
        }
        for piece in pieces {
            let Some(bytes) = piece.bytes else {
                put_fill::<WIDTH>(self.fill, piece.count, values);
                continue;
            };
            let from = &bytes[y * piece.row + z * piece.layer..];
            match piece.step == WIDTH {
                true if piece.count == 1 => put::<WIDTH>(from, values),
                true => put_run(&from[..piece.count * WIDTH], values),
                false => (0..piece.count).for_each(|x| put::<WIDTH>(&from[x * piece.step..], values)),
            }
        }
        debug_assert!(values.len() > begin);
        repeat(values, values.len() - WIDTH, along_x.after);
    }
}

/// Appends the first value of these.
fn put<const WIDTH: usize>(from: &[u8], values: &mut Vec<u8>) {
    if let Some(value) = from.first_chunk::<WIDTH>() {
        values.extend_from_slice(value);
    }
}

/// Appends bytes, most of them in pieces whose length is known where this is compiled: rows are short.
fn put_run(from: &[u8], values: &mut Vec<u8>) {
    let (blocks, rest) = from.as_chunks::<64>();
    blocks.iter().for_each(|block| values.extend_from_slice(block));
    if !rest.is_empty() {
        values.extend_from_slice(rest);
    }
}

fn put_fill<const WIDTH: usize>(fill: &[u8], count: usize, values: &mut Vec<u8>) {
    match fill.iter().all(|byte| *byte == fill[0]) {
        true => values.resize(values.len() + count * WIDTH, fill[0]),
        false => (0..count).for_each(|_| values.extend_from_slice(fill)),
    }
}

/// Appends what lies from a place on so many times more.
fn repeat(values: &mut Vec<u8>, from: usize, times: usize) {
    let end = values.len();
    (0..times).for_each(|_| values.extend_from_within(from..end));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chunks::AxisMap;

    /// The value of a voxel of a level, of two channels.
    fn value(at: [u64; 3], channel: u64) -> u32 {
        (at[0] + 100 * at[1] + 10_000 * at[2] + 1_000_000 * channel) as u32
    }

    const LEVEL: [u64; 3] = [11, 9, 7];
    const CHUNK: [u64; 3] = [4, 3, 5];

    /// Chunks of both channels, in an order of axes in which x is not the fastest where `is_turned`.
    fn chunk(at: [u64; 3], width: usize, is_turned: bool) -> Chunk {
        let [cx, cy, cz] = CHUNK;
        // Strides along c, z, y and x.
        let strides = match is_turned {
            false => [cx * cy * cz, cx * cy, cx, 1],
            true => [1, 2, 2 * cz, 2 * cz * cy],
        };
        let strides = strides.map(|stride| stride as usize * width);
        let mut bytes = vec![0; 2 * (cx * cy * cz) as usize * width];
        for (c, z, y, x) in (0..2).flat_map(|c| {
            (0..cz).flat_map(move |z| (0..cy).flat_map(move |y| (0..cx).map(move |x| (c, z, y, x))))
        }) {
            let voxel = [at[0] * cx + x, at[1] * cy + y, at[2] * cz + z];
            let place =
                [c, z, y, x].iter().zip(strides).map(|(n, stride)| *n as usize * stride).sum::<usize>();
            bytes[place..place + width].copy_from_slice(&u64::from(value(voxel, c)).to_le_bytes()[..width]);
        }
        Chunk { bytes: bytes.into(), strides: strides.into(), stored: 0 }
    }

    fn grid() -> Grid {
        let [x, y, z] = LEVEL;
        let [cx, cy, cz] = CHUNK;
        Grid {
            shape: vec![2, z, y, x],
            chunk: vec![2, cz, cy, cx],
            axes: AxisMap { x: 3, y: 2, z: Some(1), channel: Some(0), time: None },
        }
    }

    #[test]
    fn a_box_anywhere_has_the_nearest_voxels() {
        let grid = grid();
        let is_absent = |at: [u64; 3]| at == [1, 1, 0] || at == [2, 0, 1];
        for (n, (first, size)) in [
            ([0, 0, 0], [11, 9, 7]),
            ([-1, -1, -1], [13, 11, 9]),
            ([-2, 3, 4], [6, 9, 1]),
            ([3, 2, 4], [6, 5, 2]),
            ([10, 8, 6], [5, 4, 3]),
            ([-9, -9, -9], [3, 2, 4]),
            ([50, 60, 70], [2, 3, 2]),
            ([5, -3, 2], [1, 20, 30]),
        ]
        .into_iter()
        .enumerate()
        {
            let width = [1, 2, 4, 8][n % 4];
            let axes = std::array::from_fn(|a| Along::new(first[a], size[a], LEVEL[a], CHUNK[a]));
            let mut chunks: Vec<Option<Chunk>> = Vec::new();
            let [along_x, along_y, along_z]: &[Along; 3] = &axes;
            for z in along_z.chunks.clone() {
                for y in along_y.chunks.clone() {
                    let at = along_x.chunks.clone().map(|x| [x, y, z]);
                    chunks.extend(at.map(|at| (!is_absent(at)).then(|| chunk(at, width, n % 3 == 1))));
                }
            }
            let channel = n as u64 % 2;
            let fill = [7, 0, 0, 1, 0, 0, 0, 2];
            let gather =
                Gather { axes: &axes, chunks: &chunks, grid: &grid, channel, time: 0, fill: &fill[..width] };
            let mut values = Vec::new();
            gather.append(&mut values).unwrap();
            let mut expected = Vec::new();
            for (k, j, i) in (0..size[2])
                .flat_map(|k| (0..size[1]).flat_map(move |j| (0..size[0]).map(move |i| (k, j, i))))
            {
                let at = [0, 1, 2]
                    .map(|a| (first[a] + i64::from([i, j, k][a])).clamp(0, LEVEL[a] as i64 - 1) as u64);
                let of: [u64; 3] = std::array::from_fn(|a| at[a] / CHUNK[a]);
                let stored = u64::from(value(at, channel)).to_le_bytes();
                expected.extend_from_slice(if is_absent(of) { &fill[..width] } else { &stored[..width] });
            }
            assert!(values == expected, "{first:?} {size:?} of {width} bytes");
        }
    }

    #[test]
    fn a_chunk_that_is_too_small_is_named() {
        let grid = grid();
        let axes = std::array::from_fn(|a| Along::new(0, 8, LEVEL[a], CHUNK[a]));
        let mut chunks: Vec<Option<Chunk>> = (0..2 * 3 * 2).map(|_| Some(chunk([0; 3], 2, false))).collect();
        let whole = chunk([0; 3], 2, false);
        chunks[3] = Some(Chunk { bytes: whole.bytes.slice(..whole.bytes.len() / 2), ..whole });
        let gather =
            |channel| Gather { axes: &axes, chunks: &chunks, grid: &grid, channel, time: 0, fill: &[0; 2] };
        assert_eq!(gather(1).append(&mut Vec::new()), Err(3));
        assert_eq!(gather(0).append(&mut Vec::new()), Ok(()));
    }
}
