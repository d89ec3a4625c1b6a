//! Which chunks of an array are stored, in 8 bytes each: as sorted numbers, in which every region of chunks
//! that is halved along one axis after the other is a run. So any box of chunks is looked up by going down
//! from the whole into what holds something, in steps as many as its sides have bits.

use std::ops::Range;

use crate::chunks::{ChunkList, Grid};

/// Runs so short are looked through one by one.
const FEW: usize = 4;

/// The stored chunks of an array, or the shards that hold some.
#[derive(Debug)]
pub(crate) struct StoredChunks {
    grid: Grid,
    /// Chunks of a cell along each axis: 1, or as many as a shard has.
    cell: Vec<u64>,
    /// The axis that each bit of a number is of, and which bit of the coordinate it is, the highest first.
    bits: Vec<(usize, u32)>,
    /// In order, each once.
    numbers: Vec<u64>,
}

/// A box of chunks: along x, y and z.
pub(crate) type ChunkBox = [Range<u64>; 3];

impl StoredChunks {
    /// `None` where a number would have more than 64 bits.
    pub(crate) fn new(grid: &Grid, list: &ChunkList) -> Option<StoredChunks> {
        let cells = |axis: usize| grid.shape[axis].div_ceil(grid.chunk[axis]).div_ceil(list.cell[axis]);
        let bits_of = |axis: usize| u64::BITS - (cells(axis) - 1).leading_zeros();
        let space: Vec<usize> = grid.space().into_iter().flatten().collect();
        let others = (0..grid.shape.len()).filter(|axis| !space.contains(axis));
        // Channels and times first: who asks, asks for one of each.
        let mut bits: Vec<(usize, u32)> =
            others.flat_map(|axis| (0..bits_of(axis)).rev().map(move |bit| (axis, bit))).collect();
        for bit in (0..u64::BITS).rev() {
            bits.extend(space.iter().filter(|axis| bit < bits_of(**axis)).map(|axis| (*axis, bit)));
        }
        if bits.len() > u64::BITS as usize {
            return None;
        }
        let number = |coords: &[u32]| {
            bits.iter().fold(0, |number, (axis, bit)| number << 1 | u64::from(coords[*axis] >> bit & 1))
        };
        let mut numbers: Vec<u64> = list.iter().map(number).collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers.shrink_to_fit();
        Some(StoredChunks { grid: grid.clone(), cell: list.cell.clone(), bits, numbers })
    }

    /// Returns true if all chunks are stored, or all shards there, so that none is known to be absent.
    pub(crate) fn are_all(&self) -> bool {
        let sides = self.grid.shape.iter().zip(&self.grid.chunk).zip(&self.cell);
        let cells = sides.map(|((side, chunk), cell)| side.div_ceil(*chunk).div_ceil(*cell));
        cells.fold(1, u64::saturating_mul) == self.numbers.len() as u64
    }

    /// How many chunks of a box are stored, of a channel and a time; no more than `most` are counted. Where
    /// it is only known which shards hold some, all of these count.
    pub(crate) fn count(&self, of: &ChunkBox, plane: (u64, u64), most: u64) -> u64 {
        let cells = self.cells(of, plane);
        let mut counted = 0;
        let per_cell: u64 = self.cell.iter().product();
        self.visit(&self.numbers, 0, &mut self.whole(), &cells, &mut |numbers| {
            counted += numbers.len() as u64 * per_cell;
            counted < most
        });
        counted.min(most)
    }

    /// Returns true if a chunk of a box may be stored, of a channel and a time.
    pub(crate) fn has_any(&self, of: &ChunkBox, plane: (u64, u64)) -> bool {
        self.count(of, plane, 1) > 0
    }

    /// Hands out the boxes of chunks that may be stored, of a channel and a time, each of one chunk or of a
    /// shard, until `found` returns false. Returns whether these were all.
    pub(crate) fn each(&self, plane: (u64, u64), found: impl FnMut(ChunkBox) -> bool) -> bool {
        self.each_in(&[0, 1, 2].map(|_| 0..u64::MAX), plane, found)
    }

    /// The same of those that a box of chunks touches.
    pub(crate) fn each_in(
        &self,
        of: &ChunkBox,
        plane: (u64, u64),
        mut found: impl FnMut(ChunkBox) -> bool,
    ) -> bool {
        let space = self.grid.space();
        let of_cell = |coords: [u64; 8]| -> ChunkBox {
            space.map(|axis| {
                axis.map_or(0..1, |axis| coords[axis] * self.cell[axis]..(coords[axis] + 1) * self.cell[axis])
            })
        };
        let cells = self.cells(of, plane);
        self.visit(&self.numbers, 0, &mut self.whole(), &cells, &mut |numbers| {
            numbers.iter().all(|number| found(of_cell(self.coords(*number))))
        })
    }

    /// The voxels of a box, as the chunks that they lie in: along x, y and z.
    pub(crate) fn chunks_of(&self, voxels: &[Range<u64>; 3]) -> ChunkBox {
        let side = self.grid.chunk_size();
        std::array::from_fn(|axis| voxels[axis].start / side[axis]..voxels[axis].end.div_ceil(side[axis]))
    }

    /// The voxels of a box of chunks, along x, y and z, which may reach over the edge.
    pub(crate) fn voxels_of(&self, of: &ChunkBox) -> [Range<u64>; 3] {
        let side = self.grid.chunk_size();
        std::array::from_fn(|axis| of[axis].start * side[axis]..of[axis].end * side[axis])
    }

    /// Bytes of a chunk of which values have so many.
    pub(crate) fn chunk_bytes(&self, width: usize) -> u64 {
        self.grid.chunk.iter().fold(width as u64, |bytes, side| bytes.saturating_mul(*side))
    }

    /// The cells that all numbers may have, along each axis.
    fn whole(&self) -> Vec<Range<u64>> {
        let mut all: Vec<Range<u64>> = vec![0..1; self.grid.shape.len()];
        for (axis, bit) in &self.bits {
            all[*axis].end = all[*axis].end.max(2 << bit);
        }
        all
    }

    /// The cells of all axes that a box of chunks of a plane touches. Axes without a meaning are at 0.
    fn cells(&self, of: &ChunkBox, (channel, time): (u64, u64)) -> Vec<Range<u64>> {
        let at = self.grid.coords([0; 3], channel, time);
        let mut cells: Vec<Range<u64>> =
            at.iter().zip(&self.cell).map(|(at, cell)| at / cell..at / cell + 1).collect();
        for (axis, range) in self.grid.space().into_iter().zip(of) {
            if let Some(axis) = axis {
                cells[axis] = range.start / self.cell[axis]..range.end.div_ceil(self.cell[axis]);
            }
        }
        cells
    }

    /// Hands out runs of numbers whose cells lie within `of`, until `found` returns false. `numbers` are
    /// those of the cells in `node`, which is what `depth` bits leave of the whole. Returns false at that
    /// end.
    fn visit(
        &self,
        numbers: &[u64],
        depth: usize,
        node: &mut [Range<u64>],
        of: &[Range<u64>],
        found: &mut dyn FnMut(&[u64]) -> bool,
    ) -> bool {
        let is_apart = |(node, of): (&Range<u64>, &Range<u64>)| node.end <= of.start || of.end <= node.start;
        if numbers.is_empty() || node.iter().zip(of).any(is_apart) {
            return true;
        }
        if node.iter().zip(of).all(|(node, of)| of.start <= node.start && node.end <= of.end) {
            return found(numbers);
        }
        let Some((axis, _)) = self.bits.get(depth).copied().filter(|_| numbers.len() > FEW) else {
            let is_within =
                |number: &&[u64]| self.coords(number[0]).iter().zip(of).all(|(at, of)| of.contains(at));
            return numbers.chunks(1).filter(is_within).all(found);
        };
        let bit = self.bits.len() - 1 - depth;
        let split = numbers.partition_point(|number| number >> bit & 1 == 0);
        let (whole, middle) = (node[axis].clone(), node[axis].start.midpoint(node[axis].end));
        for (numbers, half) in
            [(&numbers[..split], whole.start..middle), (&numbers[split..], middle..whole.end)]
        {
            node[axis] = half;
            if !self.visit(numbers, depth + 1, node, of, found) {
                return false;
            }
        }
        node[axis] = whole;
        true
    }

    /// The cell of a number, along all axes.
    fn coords(&self, number: u64) -> [u64; 8] {
        let mut coords = [0; 8];
        for (nth, (axis, bit)) in self.bits.iter().rev().enumerate() {
            coords[*axis] |= (number >> nth & 1) << bit;
        }
        coords
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chunks::AxisMap;

    fn grid(shape: [u64; 5], chunk: [u64; 5]) -> Grid {
        let axes = AxisMap { x: 4, y: 3, z: Some(2), channel: Some(1), time: Some(0) };
        Grid { shape: shape.into(), chunk: chunk.into(), axes }
    }

    fn list(cell: [u64; 5], all: &[[u32; 5]]) -> ChunkList {
        ChunkList { coords: all.concat(), cell: cell.into() }
    }

    #[test]
    fn boxes_hold_what_was_said() {
        let mut seed = 1_u64;
        let mut below = |most: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % most
        };
        let mut hits = 0;
        for _ in 0..2000 {
            let counts = [0; 5].map(|_| 1 + below(8));
            let cell = [0; 5].map(|_| 1 + below(2));
            let chunk = [2, 1, 3, 4, 5];
            let shape = std::array::from_fn(|axis| counts[axis] * cell[axis] * chunk[axis]);
            let of: ChunkBox = [0; 3].map(|_| {
                let begin = below(9);
                begin..begin + 1 + below(9)
            });
            let plane = (below(3), below(5));
            let mut all: Vec<[u32; 5]> =
                (0..below(300)).map(|_| counts.map(|count| below(count) as u32)).collect();
            let stored = StoredChunks::new(&grid(shape, chunk), &list(cell, &all)).unwrap();
            all.sort_unstable();
            all.dedup();
            // By looking at each.
            let lies_in = |coords: &&[u32; 5]| {
                let cells = |axis: usize| {
                    let at = u64::from(coords[axis]) * cell[axis];
                    at..at + cell[axis]
                };
                let space = (0..3).all(|axis| {
                    let cells = cells(4 - axis);
                    cells.start < of[axis].end && of[axis].start < cells.end
                });
                space && cells(1).contains(&plane.0) && cells(0).contains(&(plane.1 / 2))
            };
            let cells = cell.iter().product::<u64>();
            let expected = all.iter().filter(lies_in).count() as u64 * cells;
            assert_eq!(stored.count(&of, plane, u64::MAX), expected);
            assert_eq!(stored.count(&of, plane, 2), expected.min(2));
            assert_eq!(stored.has_any(&of, plane), expected > 0);
            let touches = |found: &&ChunkBox| {
                (0..3).all(|axis| found[axis].start < of[axis].end && of[axis].start < found[axis].end)
            };
            let mut boxes = Vec::new();
            assert!(stored.each(plane, |found| {
                boxes.push(found);
                true
            }));
            assert_eq!(boxes.iter().filter(touches).count() as u64 * cells, expected);
            let mut within = Vec::new();
            assert!(stored.each_in(&of, plane, |found| {
                within.push(found);
                true
            }));
            assert!(within.iter().all(|found| touches(&found)) && within.len() as u64 * cells == expected);
            all.retain(|coords| coords.iter().zip(counts).all(|(at, count)| u64::from(*at) < count));
            assert_eq!(stored.are_all(), all.len() as u64 == counts.iter().product::<u64>());
            hits += u32::from(expected > 0);
        }
        assert!((50..1950).contains(&hits), "{hits}");
    }

    #[test]
    fn huge_grids_are_looked_up_in_few_steps() {
        let side = 1 << 19;
        let of = grid([1, 1, side, side, side], [1; 5]);
        let all: Vec<[u32; 5]> = (0..1000).map(|n| [0, 0, n * 500, n * 7 % 1000, 524_287 - n]).collect();
        let stored = StoredChunks::new(&of, &list([1; 5], &all)).unwrap();
        let (at, mut found) = (|n: u64| n..n + 1, 0);
        for n in 0..1000_u64 {
            let near = [524_287 - n, n * 7 % 1000, n * 500];
            found += stored.count(&near.map(at), (0, 0), u64::MAX);
            assert!(!stored.has_any(&[at(near[0]), at(near[1]), at(near[2] + 1)], (0, 0)));
        }
        assert_eq!((found, stored.count(&[0..side, 0..side, 0..side], (0, 0), u64::MAX)), (1000, 1000));
        let too_many = grid([1, 1 << 20, 1 << 20, 1 << 20, 1 << 20], [1; 5]);
        assert!(StoredChunks::new(&too_many, &list([1; 5], &[])).is_none());
    }
}
