//! A part of a level in memory: cut into what is written, and halved.

use vastex_volume::{DType, Reduction, reduce_into};

use crate::threads;

/// A part of a level, with what was read around it.
#[derive(Debug)]
pub(super) struct Block {
    /// The first voxel that is there.
    pub(super) at: [u64; 3],
    /// Voxels that are there, along x, y and z.
    pub(super) size: [usize; 3],
    /// The voxels' values, little-endian, x fastest, then y, then z.
    pub(super) values: Vec<u8>,
    /// The voxels of the part itself: the first, and the one past the last.
    pub(super) inner: [[u64; 3]; 2],
}

/// What stands for voxels that are not there.
#[derive(Clone, Copy)]
pub(super) enum Beyond<'a> {
    /// The nearest one that is.
    Nearest,
    /// A value.
    Fill(&'a [u8]),
}

impl Block {
    /// A box of voxels of the level, which may begin before its first one and end behind its last one.
    pub(super) fn cut(&self, first: [i64; 3], size: [usize; 3], width: usize, beyond: Beyond<'_>) -> Vec<u8> {
        let mut output = Vec::with_capacity(size.iter().product::<usize>() * width);
        let last = |axis: usize| self.size[axis] as i64 - 1;
        let begin: [i64; 3] = std::array::from_fn(|axis| first[axis] - self.at[axis] as i64);
        // Voxels of a row that lie before those that are there, among them, and behind them.
        let before = (-begin[0]).clamp(0, size[0] as i64) as usize;
        let behind = (begin[0] + size[0] as i64 - 1 - last(0)).clamp(0, (size[0] - before) as i64) as usize;
        let among = size[0] - before - behind;
        let is_there = |axis: usize, at: i64| (0..=last(axis)).contains(&at);
        for z in begin[2]..begin[2] + size[2] as i64 {
            for y in begin[1]..begin[1] + size[1] as i64 {
                if let Beyond::Fill(fill) = beyond
                    && !(is_there(1, y) && is_there(2, z))
                {
                    repeat(fill, size[0], &mut output);
                    continue;
                }
                let (y, z) = (y.clamp(0, last(1)) as usize, z.clamp(0, last(2)) as usize);
                let row = (z * self.size[1] + y) * self.size[0] * width;
                let row = &self.values[row..row + self.size[0] * width];
                let (left, right) = match beyond {
                    Beyond::Nearest => (&row[..width], &row[row.len() - width..]),
                    Beyond::Fill(fill) => (fill, fill),
                };
                repeat(left, before, &mut output);
                let from = (begin[0] + before as i64).clamp(0, self.size[0] as i64) as usize * width;
                output.extend_from_slice(&row[from..from + among * width]);
                repeat(right, behind, &mut output);
            }
        }
        output
    }

    /// The part without what was read around it.
    pub(super) fn into_inner(self, width: usize) -> Block {
        let [begin, end] = self.inner;
        let size = std::array::from_fn(|axis| (end[axis] - begin[axis]) as usize);
        if (self.at, self.size) == (begin, size) {
            return self;
        }
        let values = self.cut(begin.map(|at| at as i64), size, width, Beyond::Nearest);
        Block { at: begin, size, values, inner: self.inner }
    }

    /// The part of the next coarser level that this one makes, by the threads of the pool that the caller
    /// runs in. `factor` is 1 or 2 along each axis, and `at` a multiple of it.
    pub(super) fn halved(&self, dtype: DType, rule: Reduction, factor: [u64; 3]) -> Block {
        let factor = factor.map(|factor| factor as usize);
        let size = vastex_volume::reduced_size(self.size, factor);
        let width = dtype.bytes();
        let (plane, coarse_plane) = (self.size[0] * self.size[1] * width, size[0] * size[1] * width);
        let mut values = vec![0; coarse_plane * size[2]];
        let layers = self.values.chunks(plane * factor[2]).zip(values.chunks_mut(coarse_plane));
        threads::map(layers, 1, |(fine, coarse)| {
            let fine_size = [self.size[0], self.size[1], fine.len() / plane];
            // The lengths are those of the sizes, so it is always done.
            reduce_into(dtype, rule, fine, fine_size, factor, coarse)
        });
        let coarse = |at: [u64; 3], round_up: u64| {
            std::array::from_fn(|axis| {
                let factor = factor[axis] as u64;
                (at[axis] + round_up * (factor - 1)) / factor
            })
        };
        Block {
            at: coarse(self.at, 0),
            size,
            values,
            inner: [coarse(self.inner[0], 0), coarse(self.inner[1], 1)],
        }
    }
}

fn repeat(value: &[u8], times: usize, output: &mut Vec<u8>) {
    for _ in 0..times {
        output.extend_from_slice(value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Voxels 10 to 13, 20 to 22 and 30 to 31 of a level, each with a value that tells its place.
    fn block() -> Block {
        let mut values = Vec::new();
        for z in 0..2_u16 {
            for y in 0..3 {
                values.extend((0..4).flat_map(|x| (100 * z + 10 * y + x).to_le_bytes()));
            }
        }
        Block { at: [10, 20, 30], size: [4, 3, 2], values, inner: [[11, 20, 30], [13, 22, 32]] }
    }

    fn numbers(bytes: &[u8]) -> Vec<u16> {
        bytes.as_chunks::<2>().0.iter().map(|bytes| u16::from_le_bytes(*bytes)).collect()
    }

    #[test]
    fn what_is_not_there_is_the_nearest_or_a_value() {
        let block = block();
        let cut = |first, size, beyond| numbers(&block.cut(first, size, 2, beyond));
        assert_eq!(cut([11, 21, 31], [2, 1, 1], Beyond::Nearest), [111, 112]);
        assert_eq!(cut([8, 22, 30], [8, 1, 1], Beyond::Nearest), [20, 20, 20, 21, 22, 23, 23, 23]);
        assert_eq!(cut([9, 20, 30], [3, 1, 1], Beyond::Fill(&[7, 0])), [7, 0, 1]);
        assert_eq!(cut([12, 22, 31], [3, 2, 1], Beyond::Fill(&[7, 0])), [122, 123, 7, 7, 7, 7]);
        assert_eq!(cut([0, 0, 40], [2, 1, 1], Beyond::Nearest), [100, 100]);
        assert_eq!(cut([20, 20, 30], [2, 1, 1], Beyond::Nearest), [3, 3]);
        assert_eq!(cut([20, 20, 30], [2, 1, 1], Beyond::Fill(&[7, 0])), [7, 7]);
    }

    #[test]
    fn a_part_is_halved_where_it_lies() {
        let coarse = block().halved(DType::U16, Reduction::Max, [2, 2, 1]);
        assert_eq!(
            (coarse.at, coarse.size, coarse.inner),
            ([5, 10, 30], [2, 2, 2], [[5, 10, 30], [7, 11, 32]])
        );
        assert_eq!(numbers(&coarse.values), [11, 13, 21, 23, 111, 113, 121, 123]);
        let inner = block().into_inner(2);
        assert_eq!((inner.at, inner.size), ([11, 20, 30], [2, 2, 2]));
        assert_eq!(numbers(&inner.values), [1, 2, 11, 12, 101, 102, 111, 112]);
    }
}
