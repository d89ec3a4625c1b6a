//! How many bricks a volume has, and how many of them hold nothing but the fill value, as far as that is known without reading values.

use rustc_hash::FxHashSet;

use super::{LevelArray, Volume};
use crate::chunks::Presence;
use crate::fault::VolumeError;

/// Voxels along each side of a brick.
pub const BRICK: u64 = 64;

/// Keys that are listed, or chunks in indices of shards, where a count is not asked for in earnest.
const AT_HAND: usize = 1 << 16;
/// The same where it is.
const MOST_COUNTED: usize = 1 << 26;
/// Bricks that are told apart at most.
const MOST_BRICKS: usize = 1 << 25;

/// Bricks of all stored levels, channels and times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BrickCount {
    /// How many there are.
    pub bricks: u64,
    /// How many have no stored chunk; nothing where finding out takes more than was allowed.
    pub absent: Option<u64>,
}

impl Volume {
    /// Counts bricks of 64x64x64 voxels. Listings and indices of shards are read up to some ten thousand chunks a level; `thorough`
    /// reads them whatever their number, up to some ten millions.
    pub async fn count_bricks(&self, thorough: bool) -> Result<BrickCount, VolumeError> {
        let most = if thorough { MOST_COUNTED } else { AT_HAND };
        let mut count = BrickCount { bricks: 0, absent: Some(0) };
        for array in &self.arrays {
            let all = bricks_of(array);
            count.bricks = count.bricks.saturating_add(all);
            let absent = match count.absent {
                None => None,
                Some(before) => match array.source.presence(most).await? {
                    Presence::All => Some(before),
                    Presence::Unknown => None,
                    Presence::These(chunks) => present(array, &chunks)
                        .map(|present| before.saturating_add(all.saturating_sub(present))),
                },
            };
            count.absent = absent;
        }
        Ok(count)
    }
}

/// Bricks of a level, with all of its channels and times.
fn bricks_of(array: &LevelArray) -> u64 {
    let space = array.grid.size().map(|side| side.div_ceil(BRICK));
    let counts = [space[0], space[1], space[2], array.grid.channels(), array.grid.times()];
    counts.iter().fold(1, |product: u64, count| product.saturating_mul(*count))
}

/// Bricks that overlap one of these chunks; nothing where they are too many to be told apart.
fn present(array: &LevelArray, chunks: &[Vec<u64>]) -> Option<u64> {
    let grid = &array.grid;
    let axes = [Some(grid.axes.x), Some(grid.axes.y), grid.axes.z, grid.axes.channel, grid.axes.time];
    let mut bricks: FxHashSet<[u64; 5]> = FxHashSet::default();
    // Axes without a meaning are read at 0.
    let is_read =
        |coords: &&Vec<u64>| (0..coords.len()).all(|axis| axes.contains(&Some(axis)) || coords[axis] == 0);
    for coords in chunks.iter().filter(is_read) {
        let range = |n: usize| match axes[n] {
            None => 0..1,
            Some(axis) => {
                let side = if n < 3 { BRICK } else { 1 };
                let begin = coords[axis] * grid.chunk[axis];
                let end = (begin + grid.chunk[axis]).min(grid.shape[axis]);
                begin / side..end.div_ceil(side)
            }
        };
        let more = (0..5).try_fold(1_usize, |product, n| {
            product.checked_mul(usize::try_from(range(n).end - range(n).start).ok()?)
        });
        if more.is_none_or(|more| more > MOST_BRICKS) {
            return None;
        }
        for time in range(4) {
            for channel in range(3) {
                for z in range(2) {
                    for y in range(1) {
                        bricks.extend(range(0).map(|x| [x, y, z, channel, time]));
                    }
                }
            }
        }
        if bricks.len() > MOST_BRICKS {
            return None;
        }
    }
    Some(bricks.len() as u64)
}
