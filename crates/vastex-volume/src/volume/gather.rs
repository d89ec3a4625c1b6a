//! A box of voxels from the chunks that it overlaps: of each what it has of the box, in the order in which it
//! lies there, since chunks are further away than the box, which is being written. All of the box is written,
//! so nothing need be cleared before.
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
        Along::within(first, size, [0, last], chunk)
    }

    /// The same where nothing is taken of the level but the voxels from the first to the last of `own`, which
    /// lie in it: these are repeated.
    pub(super) fn within(first: i64, size: u32, own: [i64; 2], chunk: u64) -> Along {
        let end = first.saturating_add(i64::from(size) - 1);
        let (begin, end) = (first.clamp(own[0], own[1]), end.clamp(own[0], own[1]));
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

    /// Voxels of the box along the axis.
    fn size(&self) -> usize {
        self.before + self.runs.iter().map(|(_, count)| count).sum::<usize>() + self.after
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

/// What a box takes of one chunk.
struct Piece<'a> {
    /// From the first value of the chunk that it takes to the last one; `None` for an absent chunk.
    bytes: Option<&'a [u8]>,
    /// Bytes from a voxel of the chunk to the next one along y and z, and along x.
    row: usize,
    layer: usize,
    step: usize,
    /// Voxels.
    count: usize,
}

impl Gather<'_> {
    /// Writes the values of the box, all of them; `Err` has the place among the chunks of one that has too
    /// few bytes.
    pub(super) fn write(&self, values: &mut [u8]) -> Result<(), usize> {
        match self.fill.len() {
            1 => self.write_of::<1>(values),
            2 => self.write_of::<2>(values),
            4 => self.write_of::<4>(values),
            _ => self.write_of::<8>(values),
        }
    }

    fn write_of<const WIDTH: usize>(&self, values: &mut [u8]) -> Result<(), usize> {
        let [along_x, along_y, along_z] = self.axes;
        let row = along_x.size() * WIDTH;
        let layer = row * along_y.size();
        let mut nth_layer = along_z.before;
        let mut pieces = Vec::with_capacity(along_x.count());
        for (k, (_, layers)) in along_z.runs.iter().enumerate() {
            let mut nth_row = along_y.before;
            for (j, (_, rows)) in along_y.runs.iter().enumerate() {
                let to = Place { row, rows: *rows, layer, layers: *layers };
                let begin = nth_layer * layer + nth_row * row + along_x.before * WIDTH;
                pieces.clear();
                for i in 0..along_x.count() {
                    pieces.push(self.piece::<WIDTH>([i, j, k])?);
                }
                self.write_pieces::<WIDTH>(&pieces, &mut values[begin..], to);
                nth_row += rows;
            }
            nth_layer += layers;
        }
        let of_level = &mut values[along_z.before * layer..nth_layer * layer];
        repeat_ends(of_level, WIDTH, along_x, row / WIDTH);
        repeat_ends(of_level, row, along_y, along_y.size());
        repeat_ends(values, layer, along_z, along_z.size());
        Ok(())
    }

    /// Writes rows of the pieces beside each other along x. The ends of rows that are of chunks beside it, as
    /// borders are, are written with the piece that they belong to.
    fn write_pieces<const WIDTH: usize>(&self, pieces: &[Piece<'_>], mut to: &mut [u8], place: Place) {
        let is_end = |piece: &Piece<'_>| piece.is_end(WIDTH, place.rows);
        let is_run = |piece: &Piece<'_>| piece.is_run(WIDTH, place.rows);
        let mut rest = pieces;
        while let Some((first, after)) = rest.split_first() {
            let (before, piece, after) = match after.split_first() {
                Some((second, after)) if is_end(first) && is_run(second) => (Some(first), second, after),
                _ => (None, first, after),
            };
            let (behind, after) = match after.split_first() {
                Some((last, after)) if is_run(piece) && is_end(last) => (Some(last), after),
                _ => (None, after),
            };
            self.write_piece::<WIDTH>(piece, [before, behind], to, place);
            let written = [before, Some(piece), behind].into_iter().flatten().map(|piece| piece.count);
            to = &mut to[written.sum::<usize>() * WIDTH..];
            rest = after;
        }
    }

    /// Writes what a chunk has of the box, with what lies before and behind it in each row.
    fn write_piece<const WIDTH: usize>(
        &self,
        piece: &Piece<'_>,
        ends: [Option<&Piece<'_>>; 2],
        to: &mut [u8],
        place: Place,
    ) {
        let len = piece.count * WIDTH;
        if piece.bytes.is_none() {
            for to in to.chunks_mut(place.layer).take(place.layers) {
                to.chunks_mut(place.row).take(place.rows).for_each(|to| put_fill(self.fill, &mut to[..len]));
            }
            return;
        }
        let rows = Rows { piece, ends, place, len };
        match piece.count {
            1 => rows.each(to, put::<WIDTH>),
            _ if !piece.is_run(WIDTH, place.rows) => rows.each(to, |to, from| {
                for (x, to) in to[..len].as_chunks_mut::<WIDTH>().0.iter_mut().enumerate() {
                    put::<WIDTH>(to, &from[x * piece.step..]);
                }
            }),
            // Rows are short: of a length that is known here a copy is a few instructions.
            _ => {
                match len {
                    32 => rows.each_with_ends::<WIDTH>(to, put::<32>),
                    64 => rows.each_with_ends::<WIDTH>(to, put::<64>),
                    128 => rows.each_with_ends::<WIDTH>(to, put::<128>),
                    33..64 => rows
                        .each_with_ends::<WIDTH>(to, |to, from| put_ends::<32>(&mut to[..len], &from[..len])),
                    65..128 => rows
                        .each_with_ends::<WIDTH>(to, |to, from| put_ends::<64>(&mut to[..len], &from[..len])),
                    _ => rows.each_with_ends::<WIDTH>(to, |to, from| to[..len].copy_from_slice(&from[..len])),
                }
            }
        }
    }

    /// What the box takes of the chunk at a place among them, which has the bytes for it.
    fn piece<const WIDTH: usize>(&self, [i, j, k]: [usize; 3]) -> Result<Piece<'_>, usize> {
        let [along_x, along_y, along_z] = self.axes;
        let (first, count) = along_x.runs[i];
        let nth = (k * along_y.count() + j) * along_x.count() + i;
        let Some(chunk) = self.chunks.get(nth).and_then(Option::as_ref) else {
            return Ok(Piece { bytes: None, row: 0, layer: 0, step: WIDTH, count });
        };
        let space = self.grid.space();
        let [mut step, mut row, mut layer] = space.map(|axis| axis.map_or(0, |axis| chunk.strides[axis]));
        let mut offset = self.grid.offset(&chunk.strides, self.channel, self.time);
        let mut of = &chunk.bytes[..];
        let side = self.grid.chunk_size()[0] as usize;
        if let Some(ends) = chunk.ends.as_ref().filter(|_| count == 1)
            && let Some(end) = [0, side - 1].iter().position(|end| *end == first)
        {
            // Rows of one value, in which its place is that of the row.
            (of, step) = (&ends[end], 0);
            (offset, row, layer) = (offset / side, row / side, layer / side);
        }
        let place = |x: usize, y: usize, z: usize| offset + x * step + y * row + z * layer;
        let begin = place(first, along_y.runs[j].0, along_z.runs[k].0);
        let last = place(along_x.last_within(i), along_y.last_within(j), along_z.last_within(k));
        let bytes = of.get(begin..last + WIDTH).ok_or(nth)?;
        Ok(Piece { bytes: Some(bytes), row, layer, step, count })
    }
}

/// Rows of a box that a piece is written to: how many bytes they lie apart, and how many there are in a
/// layer; the same of layers.
#[derive(Clone, Copy)]
struct Place {
    row: usize,
    rows: usize,
    layer: usize,
    layers: usize,
}

/// Rows of a box, and what is written to them: of a chunk that is there `len` bytes, and before and behind
/// them one value each of others.
struct Rows<'a> {
    piece: &'a Piece<'a>,
    ends: [Option<&'a Piece<'a>>; 2],
    place: Place,
    len: usize,
}

impl Rows<'_> {
    /// Hands out each row with what the chunk has of it.
    #[inline(always)]
    fn each(&self, to: &mut [u8], mut put: impl FnMut(&mut [u8], &[u8])) {
        let place = self.place;
        for (z, to) in to.chunks_mut(place.layer).take(place.layers).enumerate() {
            let mut from = self.piece.rows_of(z);
            for to in to.chunks_mut(place.row).take(place.rows) {
                put(to, from.next());
            }
        }
    }

    /// The same where its values lie side by side, and writes the values before and behind.
    #[inline(always)]
    fn each_with_ends<const WIDTH: usize>(&self, to: &mut [u8], mut put_row: impl FnMut(&mut [u8], &[u8])) {
        let (place, len) = (self.place, self.len);
        let [before, behind] = self.ends.map(|end| if end.is_some() { WIDTH } else { 0 });
        for (z, to) in to.chunks_mut(place.layer).take(place.layers).enumerate() {
            let end = (place.rows - 1) * place.row + before + len + behind;
            let to = to[..end].chunks_mut(place.row).zip(self.piece.chunks_of(z, len));
            match self.ends {
                [None, None] => to.for_each(|(to, from)| put_row(to, from)),
                [Some(before), None] => to.zip(before.chunks_of(z, WIDTH)).for_each(|((to, from), first)| {
                    put::<WIDTH>(to, first);
                    put_row(&mut to[WIDTH..], from);
                }),
                [None, Some(behind)] => to.zip(behind.chunks_of(z, WIDTH)).for_each(|((to, from), last)| {
                    put_row(to, from);
                    put::<WIDTH>(&mut to[len..], last);
                }),
                [Some(before), Some(behind)] => {
                    let ends = before.chunks_of(z, WIDTH).zip(behind.chunks_of(z, WIDTH));
                    to.zip(ends).for_each(|((to, from), (first, last))| {
                        put::<WIDTH>(to, first);
                        put_row(&mut to[WIDTH..], from);
                        put::<WIDTH>(&mut to[WIDTH + len..], last);
                    });
                }
            }
        }
    }
}

/// What a chunk has from one row on.
struct RowsOf<'a> {
    rest: &'a [u8],
    apart: usize,
}

impl<'a> RowsOf<'a> {
    /// From the next row on; nothing after the last one.
    #[inline(always)]
    fn next(&mut self) -> &'a [u8] {
        let row = self.rest;
        self.rest = row.get(self.apart..).unwrap_or_default();
        row
    }
}

impl Piece<'_> {
    /// Returns true if its values lie side by side, and its rows one after the other.
    fn is_run(&self, width: usize, rows: usize) -> bool {
        self.count > 1 && self.step == width && self.has_rows(width, rows)
    }

    /// Returns true if it is one value of each row, and the rows lie one after the other.
    fn is_end(&self, width: usize, rows: usize) -> bool {
        self.count == 1 && self.has_rows(width, rows)
    }

    fn has_rows(&self, width: usize, rows: usize) -> bool {
        self.bytes.is_some() && (rows == 1 || self.row >= self.count * width)
    }

    /// The piece's rows in a layer, of `len` bytes at least, which lie one after the other.
    #[inline(always)]
    fn chunks_of(&self, layer: usize, len: usize) -> std::slice::Chunks<'_, u8> {
        self.rows_of(layer).rest.chunks(self.row.max(len))
    }

    /// What it has of the layer.
    #[inline(always)]
    fn rows_of(&self, layer: usize) -> RowsOf<'_> {
        let rest = self.bytes.and_then(|bytes| bytes.get(layer * self.layer..)).unwrap_or_default();
        RowsOf { rest, apart: self.row }
    }
}

/// Copies the first bytes.
#[inline(always)]
fn put<const LEN: usize>(to: &mut [u8], from: &[u8]) {
    if let (Some(to), Some(from)) = (to.first_chunk_mut::<LEN>(), from.first_chunk::<LEN>()) {
        *to = *from;
    }
}

/// Copies `LEN` bytes or more, and less than twice as many: the first and the last ones, which overlap.
fn put_ends<const LEN: usize>(to: &mut [u8], from: &[u8]) {
    put::<LEN>(to, from);
    if let (Some(to), Some(from)) = (to.last_chunk_mut::<LEN>(), from.last_chunk::<LEN>()) {
        *to = *from;
    }
}

fn put_fill(fill: &[u8], to: &mut [u8]) {
    match fill.iter().all(|byte| *byte == fill[0]) {
        true => to.fill(fill[0]),
        false => to.chunks_exact_mut(fill.len()).for_each(|to| to.copy_from_slice(fill)),
    }
}

/// Repeats the first and the last one of what the level has along an axis, which are `unit` bytes each, of
/// lines of `size` of them.
fn repeat_ends(values: &mut [u8], unit: usize, along: &Along, size: usize) {
    if along.before == 0 && along.after == 0 {
        return;
    }
    let end = size - along.after;
    for line in values.chunks_exact_mut(unit * size) {
        for n in 0..along.before {
            line.copy_within(along.before * unit..(along.before + 1) * unit, n * unit);
        }
        for n in end..size {
            line.copy_within((end - 1) * unit..end * unit, n * unit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chunks::AxisMap;

    /// The value of a voxel of a level, of two channels.
    fn value(at: [u64; 3], channel: u64) -> u32 {
        (at[0] + 100 * at[1] + 10_000 * at[2] + 1_000_000 * channel) as u32
    }

    const LEVEL: [u64; 3] = [19, 9, 7];
    const CHUNK: [u64; 3] = [8, 3, 5];

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
        Chunk::new(bytes, strides, 0)
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
            ([0, 0, 0], [19, 9, 7]),
            ([-1, -1, -1], [21, 11, 9]),
            ([7, -1, 4], [10, 4, 3]),
            ([16, 2, 2], [1, 4, 4]),
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
                    chunks.extend(at.map(|at| {
                        (!is_absent(at)).then(|| chunk(at, width, n % 3 == 1).with_ends(3, CHUNK[0], width))
                    }));
                }
            }
            let channel = n as u64 % 2;
            let fill = [7, 0, 0, 1, 0, 0, 0, 2];
            let gather =
                Gather { axes: &axes, chunks: &chunks, grid: &grid, channel, time: 0, fill: &fill[..width] };
            // What lies there before is no matter.
            let mut values = vec![0xcc; size.iter().product::<u32>() as usize * width];
            gather.write(&mut values).unwrap();
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
        let half = whole.bytes.slice(..whole.bytes.len() / 2);
        chunks[3] = Some(Chunk::new(half, whole.strides.clone(), 0));
        let gather =
            |channel| Gather { axes: &axes, chunks: &chunks, grid: &grid, channel, time: 0, fill: &[0; 2] };
        let mut values = vec![0; 2 * 8 * 8 * 8];
        assert_eq!((gather(1).write(&mut values), gather(0).write(&mut values)), (Err(3), Ok(())));
    }
}
