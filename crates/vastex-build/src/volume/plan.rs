//! How a volume is passed over: block by block, each with as many levels as come out of it whole, then the
//! level that is left, in the same way.
//!
//! A *round* reads blocks of its base level and makes the levels from there to its top one in memory. What
//! comes after the top is kept whole, as the base of the next round: after three halvings that is 1/512 of
//! the volume. So memory depends on the size of a block and not on that of the volume.

use super::levels::Level;

/// What is passed over.
#[derive(Clone, Copy)]
pub(super) struct Shape<'a> {
    pub(super) levels: &'a [Level],
    /// How many of the levels, from the finest on, are handed over block by block.
    pub(super) by_block: usize,
    /// Voxels of a level that are written at once along each axis: blocks hold whole ones.
    pub(super) quantum: &'a dyn Fn(usize) -> [u64; 3],
    /// Voxels around what is written that are needed for it.
    pub(super) border: u64,
    /// Bytes of a value.
    pub(super) width: u64,
    /// Voxels of the volume that are decoded at once.
    pub(super) chunk: [u64; 3],
}

/// A pass over a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Round {
    /// The level that is read.
    pub(super) base: usize,
    /// The last level that is made of a block.
    pub(super) top: usize,
    /// Voxels of the base level in a block; the last ones along an axis may have less.
    pub(super) block: [u64; 3],
    /// Voxels of the base level around a block that are read with it.
    pub(super) halo: [u64; 3],
}

/// How often chunks may be decoded before larger blocks are taken. With borders it is twice or so; what
/// counts is that planes are not decoded for each of the many blocks that they cross.
const MOST_DECODED: f64 = 3.0;

impl Shape<'_> {
    /// The rounds of a volume. Blocks have at most `usual` bytes, or up to `most` where chunks would be
    /// decoded again and again otherwise, or where what is written at once is that large; `None` if even that
    /// does not do.
    pub(super) fn rounds(&self, usual: u64, most: u64) -> Option<Vec<Round>> {
        let mut rounds: Vec<Round> = Vec::new();
        let mut base = 0;
        while base < self.by_block {
            // What is left by a round is at hand in blocks of any shape.
            let chunk = if base == 0 { self.chunk } else { [1; 3] };
            let mut best: Option<(f64, Round)> = None;
            for limit in [usual, most] {
                for top in (base..self.by_block).rev() {
                    let Some(round) = self.round(base, top, chunk, limit) else { continue };
                    let decoded = self.decoded(&round, chunk);
                    if best.is_none_or(|(least, _)| decoded < 0.9 * least) {
                        best = Some((decoded, round));
                    }
                }
                if best.is_some_and(|(decoded, _)| decoded <= MOST_DECODED) {
                    break;
                }
            }
            let (_, round) = best?;
            base = round.top + 1;
            rounds.push(round);
        }
        Some(rounds)
    }

    /// Voxels of the base level along one of a level.
    fn ratio(&self, base: usize, level: usize, axis: usize) -> u64 {
        self.levels[level].scale[axis] / self.levels[base].scale[axis]
    }

    /// The round with the largest block of at most so many bytes.
    fn round(&self, base: usize, top: usize, chunk: [u64; 3], limit: u64) -> Option<Round> {
        let size = self.levels[base].size;
        let next = (top + 1).min(self.levels.len() - 1);
        // Pieces of all levels are whole in it, and so is every voxel of the next level. What is one piece
        // along an axis is there only when the whole axis is.
        let unit: [u64; 3] = std::array::from_fn(|axis| {
            let aligned = self.ratio(base, next, axis);
            let mut unit = aligned;
            for level in base..=top {
                let quantum = (self.quantum)(level)[axis];
                if quantum >= self.levels[level].size[axis] {
                    return size[axis].next_multiple_of(aligned);
                }
                unit = common_multiple(unit, quantum.saturating_mul(self.ratio(base, level, axis)));
            }
            unit
        });
        let halo = std::array::from_fn(|axis| self.border * self.ratio(base, top, axis));
        let mut round = Round { base, top, block: unit, halo };
        if self.bytes(&round) > limit {
            return None;
        }
        for target in [chunk, size] {
            for axis in 0..3 {
                while round.block[axis] < target[axis].min(size[axis]) {
                    let mut larger = round;
                    larger.block[axis] += unit[axis];
                    if self.bytes(&larger) > limit {
                        break;
                    }
                    round = larger;
                }
            }
        }
        Some(round)
    }

    /// Bytes that a block has, with what is around it.
    fn bytes(&self, round: &Round) -> u64 {
        let size = self.levels[round.base].size;
        let side = |axis: usize| round.block[axis].saturating_add(2 * round.halo[axis]).min(size[axis]);
        (0..3).fold(self.width, |bytes, axis| bytes.saturating_mul(side(axis)))
    }

    /// How often a chunk is decoded, on average, if none is kept.
    fn decoded(&self, round: &Round, chunk: [u64; 3]) -> f64 {
        let size = self.levels[round.base].size;
        let along = |axis: usize| {
            let (side, block, halo) = (size[axis], round.block[axis], round.halo[axis]);
            let (blocks, chunks) = (side.div_ceil(block), side.div_ceil(chunk[axis]));
            if blocks == 1 {
                return 1.0;
            }
            // The first blocks stand for the others.
            let looked = blocks.min(64);
            let touched = |n: u64| {
                let begin = (n * block).saturating_sub(halo) / chunk[axis];
                ((n + 1) * block + halo).min(side).div_ceil(chunk[axis]) - begin
            };
            let touched: u64 = (0..looked).map(touched).sum();
            touched as f64 * blocks as f64 / looked as f64 / chunks as f64
        };
        (0..3).map(along).product()
    }
}

/// The least number that both divide.
fn common_multiple(a: u64, b: u64) -> u64 {
    let (mut divisor, mut rest) = (a, b);
    while rest > 0 {
        (divisor, rest) = (rest, divisor % rest);
    }
    (a / divisor.max(1)).saturating_mul(b)
}

impl Round {
    /// The first voxels of the blocks of a level of so many voxels: x fastest, then y, then z.
    pub(super) fn blocks(&self, size: [u64; 3]) -> impl Iterator<Item = [u64; 3]> + use<> {
        let block = self.block;
        let counts: [u64; 3] = std::array::from_fn(|axis| size[axis].div_ceil(block[axis]));
        (0..counts.iter().product()).map(move |n| {
            let place = [n % counts[0], n / counts[0] % counts[1], n / counts[0] / counts[1]];
            std::array::from_fn(|axis| place[axis] * block[axis])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::levels::levels;
    use super::*;

    const MIB: u64 = 1 << 20;

    fn rounds(size: [u64; 3], quantum: u64, border: u64, chunk: [u64; 3]) -> Vec<Round> {
        let levels = levels(size, [1.0; 3], false, |size| size.iter().all(|side| *side <= 64)).unwrap();
        let quanta = |level: usize| levels[level].size.map(|side| side.min(quantum));
        let shape =
            Shape { levels: &levels, by_block: levels.len(), quantum: &quanta, border, width: 2, chunk };
        let rounds = shape.rounds(192 * MIB, 1024 * MIB).unwrap();
        assert_eq!((rounds[0].base, rounds.last().unwrap().top), (0, levels.len() - 1));
        assert!(rounds.windows(2).all(|pair| pair[1].base == pair[0].top + 1));
        for round in &rounds {
            assert!(shape.bytes(round) <= 1024 * MIB, "{round:?}");
            for level in round.base..=round.top {
                for axis in 0..3 {
                    let block = round.block[axis];
                    let piece = quanta(level)[axis] * shape.ratio(round.base, level, axis);
                    assert!(
                        block >= levels[round.base].size[axis] || block % piece == 0,
                        "{round:?} {level}"
                    );
                }
            }
        }
        rounds
    }

    #[test]
    fn what_is_small_is_one_block() {
        let all = rounds([197, 233, 189], 64, 0, [197, 233, 11]);
        assert_eq!((all.len(), all[0].top), (1, 2));
        assert!((0..3).all(|axis| all[0].block[axis] >= [197, 233, 189][axis]));
    }

    #[test]
    fn what_is_large_is_cut_where_pieces_of_all_levels_end() {
        let all = rounds([40_000, 30_000, 2_000], 64, 0, [64; 3]);
        assert!(all.len() > 1 && all[0].top == 2, "{all:?}");
        let bordered = rounds([40_000, 30_000, 2_000], 64, 1, [64; 3]);
        assert_eq!(bordered[0].halo, [4; 3]);
        // Sides that are no powers of two, odd ones too.
        rounds([4000, 3000, 2000], 48, 0, [100, 50, 7]);
        rounds([4000, 3000, 2000], 33, 1, [100, 50, 7]);
    }

    #[test]
    fn planes_are_decoded_a_few_times_at_most() {
        let all = rounds([2048, 2048, 500], 64, 0, [2048, 2048, 1]);
        let block = all[0].block;
        assert!(block[0] >= 2048, "{all:?}");
        let of_a_plane = 2048_u64.div_ceil(block[1]);
        assert!(of_a_plane as f64 <= MOST_DECODED, "{all:?}");
        let places: Vec<_> = all[0].blocks([2048, 2048, 500]).collect();
        assert_eq!(places[0], [0; 3]);
        assert_eq!(places.len() as u64, of_a_plane * 500_u64.div_ceil(block[2]));
    }

    #[test]
    fn pieces_that_no_block_can_hold_are_refused() {
        let levels =
            levels([10_000; 3], [1.0; 3], false, |size| size.iter().all(|side| *side <= 64)).unwrap();
        let quanta = |_: usize| [4096; 3];
        let shape = Shape {
            levels: &levels,
            by_block: levels.len(),
            quantum: &quanta,
            border: 0,
            width: 2,
            chunk: [64; 3],
        };
        assert_eq!(shape.rounds(192 * MIB, 1024 * MIB), None);
    }
}
