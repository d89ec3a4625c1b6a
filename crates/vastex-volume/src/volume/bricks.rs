//! How many bricks a volume has, and how many of them hold nothing but the fill value, as far as that is
//! known without reading values.

use rustc_hash::FxHashSet;

use super::{LevelArray, Volume};
use crate::chunks::{ChunkList, Presence};
use crate::fault::VolumeError;

/// Voxels along each side of a brick.
pub const BRICK: u64 = 64;

/// Keys of directories that are listed for a level where somebody waits: a quarter of a second, as a rule.
pub(crate) const KEYS_AT_HAND: usize = 1 << 18;

/// What may be looked at for one level.
#[derive(Clone, Copy)]
struct Effort {
    /// Keys of a directory that are listed; of what else is looked at as `ChunkSource::presence` says.
    keys: usize,
    /// Bricks that are marked, those included that were marked before.
    marks: u64,
    /// Bricks of a level up to which each has a bit; beyond that, those that are marked are kept by their
    /// numbers.
    bits: u64,
}

const AT_HAND: Effort = Effort { keys: KEYS_AT_HAND, marks: 1 << 24, bits: 1 << 26 };
const THOROUGH: Effort = Effort { keys: 1 << 26, marks: 1 << 34, bits: 1 << 31 };
/// Numbers of bricks that are kept at most.
const MOST_NUMBERS: usize = 1 << 24;

/// Bricks of all stored levels, channels and times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BrickCount {
    /// How many there are.
    pub bricks: u64,
    /// How many have no stored chunk; `None` if finding that out takes more than was allowed.
    pub absent: Option<u64>,
}

impl Volume {
    /// Counts bricks of 64x64x64 voxels, and those that are absent as far as this goes: of each level up to
    /// 262,144 keys of a directory are listed, or 4 million of an archive, and up to 4096 indices of shards
    /// are read, of 4 million chunks and 128 MiB, and up to 16 million bricks may be there. `thorough` goes
    /// up to 256 times as many of each, and to 17 billion bricks, or 16 million of a level of more than 2
    /// billion. In any case a list of stored chunks takes up to 1 GiB (53 million chunks of five axes).
    pub async fn count_bricks(&self, thorough: bool) -> Result<BrickCount, VolumeError> {
        let effort = if thorough { THOROUGH } else { AT_HAND };
        let mut count = BrickCount { bricks: 0, absent: Some(0) };
        for array in &self.arrays {
            let all = bricks_of(array);
            count.bricks = count.bricks.saturating_add(all);
            count.absent = match count.absent {
                None => None,
                Some(before) => match array.source.presence(effort.keys).await? {
                    Presence::All => Some(before),
                    Presence::Unknown => None,
                    Presence::These(chunks) if !chunks.is_of_chunks() => None,
                    Presence::These(chunks) => present(array, &chunks, effort)
                        .map(|present| before.saturating_add(all.saturating_sub(present))),
                },
            };
        }
        Ok(count)
    }
}

/// Bricks of a level along x, y, z, channels and times.
fn counts(array: &LevelArray) -> [u64; 5] {
    let [x, y, z] = array.grid.size().map(|side| side.div_ceil(BRICK));
    [x, y, z, array.grid.channels(), array.grid.times()]
}

/// Bricks of a level, with all of its channels and times.
fn bricks_of(array: &LevelArray) -> u64 {
    counts(array).iter().fold(1, |product: u64, count| product.saturating_mul(*count))
}

/// Which bricks are marked, by their numbers.
enum Marks {
    Bits(Vec<u64>),
    Numbers(FxHashSet<u64>),
}

impl Marks {
    fn mark(&mut self, brick: u64) {
        match self {
            Marks::Bits(words) => words[(brick / 64) as usize] |= 1 << (brick % 64),
            Marks::Numbers(numbers) => drop(numbers.insert(brick)),
        }
    }

    fn count(&self) -> u64 {
        match self {
            Marks::Bits(words) => words.iter().map(|word| u64::from(word.count_ones())).sum(),
            Marks::Numbers(numbers) => numbers.len() as u64,
        }
    }

    fn is_full(&self) -> bool {
        matches!(self, Marks::Numbers(numbers) if numbers.len() > MOST_NUMBERS)
    }
}

/// Bricks that overlap one of these chunks; `None` if that takes more than was allowed.
fn present(array: &LevelArray, chunks: &ChunkList, effort: Effort) -> Option<u64> {
    let grid = &array.grid;
    let axes = [Some(grid.axes.x), Some(grid.axes.y), grid.axes.z, grid.axes.channel, grid.axes.time];
    let all = bricks_of(array);
    if all == u64::MAX {
        return None;
    }
    let mut marks = match all <= effort.bits {
        true => Marks::Bits(vec![0; all.div_ceil(64) as usize]),
        false => Marks::Numbers(FxHashSet::default()),
    };
    let counts = counts(array);
    let mut marked: u64 = 0;
    // Axes without a meaning are read at 0.
    let is_read =
        |coords: &&[u32]| (0..coords.len()).all(|axis| axes.contains(&Some(axis)) || coords[axis] == 0);
    for coords in chunks.iter().filter(is_read) {
        let range = |n: usize| match axes[n] {
            None => 0..1,
            Some(axis) => {
                let side = if n < 3 { BRICK } else { 1 };
                let begin = u64::from(coords[axis]) * grid.chunk[axis];
                let end = (begin + grid.chunk[axis]).min(grid.shape[axis]);
                begin / side..end.div_ceil(side)
            }
        };
        let more = (0..5).fold(1_u64, |product, n| product.saturating_mul(range(n).end - range(n).start));
        marked = marked.saturating_add(more);
        if marked > effort.marks || marks.is_full() {
            return None;
        }
        for time in range(4) {
            for channel in range(3) {
                for z in range(2) {
                    for y in range(1) {
                        let row = ((time * counts[3] + channel) * counts[2] + z) * counts[1] + y;
                        range(0).for_each(|x| marks.mark(row * counts[0] + x));
                    }
                }
            }
        }
    }
    Some(marks.count())
}
