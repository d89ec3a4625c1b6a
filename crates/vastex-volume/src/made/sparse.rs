//! Which chunks of made levels have nothing stored below them, and which are made of little.

use std::sync::{MutexGuard, PoisonError};

use super::{CHEAP_BYTES, Done, Made, MadePos, SIDE, is_small};
use crate::stored::{ChunkBox, StoredChunks};

/// Stored chunks that a larger chunk of a sparse level may be made of where it is asked for: each costs a
/// chunk of every level on the way.
const CHEAP_STORED: u64 = 16;
/// Of so many chunks one is stored in a part that is made also where nobody wants it as it is.
const SPARSE: u64 = 64;
/// Chunks of the finest made level that are counted one by one.
const MOST_COUNTED: usize = 1 << 23;

impl Made {
    /// Returns true if a chunk of a level is made where it is asked for: of few stored chunks, and of a small
    /// part of the base for whoever wants it as it is; else where next to nothing is stored below it.
    pub(super) fn is_cheap(&self, level: usize, at: [u64; 3], is_wanted: bool) -> bool {
        let size = self.base.volume.about().levels[self.base.level].size;
        let scale = self.levels[level].scale;
        let of = std::array::from_fn(|axis| SIDE.saturating_mul(scale[axis]).min(size[axis]));
        if is_wanted && is_small(self.base.volume.about(), self.base.level, Some(of)) {
            return true;
        }
        self.stored.as_ref().is_some_and(|stored| {
            let all = self.chunks_below(stored, level, at).map(|chunks| chunks.end - chunks.start);
            let all = all.into_iter().fold(1, u64::saturating_mul);
            let few = if is_wanted { CHEAP_STORED } else { CHEAP_STORED.min(all / SPARSE) };
            let most = (CHEAP_BYTES / stored.chunk_bytes(self.width()).max(1)).min(few);
            self.count_stored(stored, level, at, most + 1) <= most
        })
    }

    /// Returns true if nothing is stored of what a chunk is made of.
    pub(super) fn is_absent(&self, level: usize, at: [u64; 3]) -> bool {
        self.stored.as_ref().is_some_and(|stored| self.count_stored(stored, level, at, 1) == 0)
    }

    /// Stored chunks that a chunk is made of, no more than `most`.
    pub(super) fn count_stored(&self, stored: &StoredChunks, level: usize, at: [u64; 3], most: u64) -> u64 {
        let plane = (self.base.channel, self.base.time);
        stored.count(&self.chunks_below(stored, level, at), plane, most)
    }

    /// The chunks of the base, stored or not, that a chunk is made of.
    fn chunks_below(&self, stored: &StoredChunks, level: usize, at: [u64; 3]) -> ChunkBox {
        let size = self.base.volume.about().levels[self.base.level].size;
        let scale = self.levels[level].scale;
        stored.chunks_of(&std::array::from_fn(|axis| {
            let side = SIDE.saturating_mul(scale[axis]);
            let end = at[axis].saturating_add(1).saturating_mul(side).min(size[axis]);
            (at[axis] * side).min(size[axis])..end
        }))
    }

    /// Returns true if a chunk of the base is known not to be stored.
    pub(super) fn is_not_stored(&self, coords: &[u64]) -> bool {
        let at = self.base.volume.grid(self.base.level).space();
        let of = at.map(|axis| axis.map_or(0..1, |axis| coords[axis]..coords[axis] + 1));
        let plane = (self.base.channel, self.base.time);
        self.stored.as_ref().is_some_and(|stored| !stored.has_any(&of, plane))
    }

    /// Counts what a chunk covers of the finest made level as done, each once.
    pub(super) fn count_done(&self, level: usize, at: [u64; 3]) {
        let mut coarser: Vec<MadePos> = Vec::new();
        let mut pos = at;
        for (coarse, of) in self.levels.iter().enumerate().skip(level + 1) {
            pos = std::array::from_fn(|axis| pos[axis] / of.factor[axis]);
            coarser.push((coarse, pos));
        }
        if self.lock_done().has((level, at), &coarser) {
            return;
        }
        // Nobody waits for the lock while this is found out.
        let covered = self.count_finest(level, at);
        self.lock_done().add((level, at), &coarser, covered);
    }

    pub(super) fn lock_done(&self) -> MutexGuard<'_, Done> {
        self.done.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How many chunks of the finest made level that are not absent a chunk covers.
    fn count_finest(&self, level: usize, at: [u64; 3]) -> u64 {
        let size = self.base.volume.about().levels[self.base.level].size;
        let (finest, this) = (&self.levels[0], &self.levels[level]);
        let of = std::array::from_fn(|axis| {
            let chunks = this.scale[axis] / finest.scale[axis];
            at[axis].saturating_mul(chunks)..at[axis].saturating_add(1).saturating_mul(chunks)
        });
        let plane = (self.base.channel, self.base.time);
        count_within(self.stored.as_deref(), plane, size, finest.factor, &of)
    }
}

/// How many chunks of the finest made level that are not absent there are below a base of `size` voxels, of
/// which one of that level has `factor`. Where very many are stored, those that are absent count, too.
pub(crate) fn count_made(
    stored: Option<&StoredChunks>,
    plane: (u64, u64),
    size: [u64; 3],
    factor: [u64; 3],
) -> u64 {
    count_within(stored, plane, size, factor, &[0, 1, 2].map(|_| 0..u64::MAX))
}

/// The same of a box of these chunks alone, at the cost of the stored chunks below it.
fn count_within(
    stored: Option<&StoredChunks>,
    plane: (u64, u64),
    size: [u64; 3],
    factor: [u64; 3],
    of: &ChunkBox,
) -> u64 {
    let sides = factor.map(|factor| SIDE.saturating_mul(factor));
    let of: ChunkBox = std::array::from_fn(|axis| {
        let end = of[axis].end.min(size[axis].div_ceil(factor[axis]).div_ceil(SIDE));
        of[axis].start.min(end)..end
    });
    let counts = [0, 1, 2].map(|axis| of[axis].end - of[axis].start);
    let all = counts.iter().fold(1, |chunks: u64, count| chunks.saturating_mul(*count));
    let Some(stored) = stored else { return all };
    let below = stored.chunks_of(&std::array::from_fn(|axis| {
        of[axis].start.saturating_mul(sides[axis])..of[axis].end.saturating_mul(sides[axis]).min(size[axis])
    }));
    let mut found: Vec<u64> = Vec::new();
    let is_counted = stored.each_in(&below, plane, |chunks| {
        let voxels = stored.voxels_of(&chunks);
        let [xs, ys, zs] = [0, 1, 2].map(|axis| {
            let first = (voxels[axis].start / sides[axis]).max(of[axis].start);
            let after = voxels[axis].end.div_ceil(sides[axis]).min(of[axis].end);
            first - of[axis].start..after.saturating_sub(of[axis].start)
        });
        let more = [&xs, &ys, &zs]
            .iter()
            .fold(1_u64, |more, range| more.saturating_mul(range.end.saturating_sub(range.start)));
        if more > (MOST_COUNTED - found.len()) as u64 {
            return false;
        }
        for z in zs {
            for y in ys.clone() {
                found.extend(xs.clone().map(|x| (z * counts[1] + y) * counts[0] + x));
            }
        }
        true
    });
    found.sort_unstable();
    found.dedup();
    if is_counted && all < u64::MAX { found.len() as u64 } else { all }
}
