//! Bricks that come with repeated borders first, where their neighbours' chunks are not there yet, and whole
//! later.
//!
//! A border of one voxel touches up to 26 chunks beside a brick's own. Where most of what a brick wants are
//! such chunks, and they are not at hand, its own voxels are delivered with the last ones repeated in the
//! border; a little later the page is among what has changed, and is read again, whole. By then, as a rule,
//! the neighbours have come for themselves. Each load of a brick is so read twice at most.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rustc_hash::FxHashMap;
use vastex_core::{PagePos, Region};

use super::VolumeSource;
use crate::fault::VolumeError;
use crate::volume::{BoxValues, VoxelBox};

/// How long a brick stays with repeated borders, at least: it is to be seen meanwhile.
const STAYS: Duration = Duration::from_millis(300);
/// Bricks that wait to be read again, at most; where there are more, others come whole at first.
const MOST_EARLY: usize = 4096;

/// Which bricks were delivered early.
#[derive(Default)]
pub(super) struct Early(Mutex<FxHashMap<PagePos, Told>>);

/// What becomes of a brick that was delivered early.
enum Told {
    /// It is to be read again from this time on.
    At(Instant),
    /// That was said.
    Said,
}

impl Early {
    fn lock(&self) -> MutexGuard<'_, FxHashMap<PagePos, Told>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns true if a brick may come early: not if it has, since it is to be whole then.
    fn may_come(&self, pos: PagePos) -> bool {
        let mut early = self.lock();
        if early.len() >= MOST_EARLY {
            // Bricks that were evicted before they were read again are among these.
            early.retain(|_, told| matches!(told, Told::At(_)));
        }
        !early.contains_key(&pos) && early.len() < MOST_EARLY
    }

    /// A brick was read whole. One whose turn has not been told stays: somebody else may have it as it was.
    fn settle(&self, pos: PagePos) {
        let mut early = self.lock();
        if matches!(early.get(&pos), Some(Told::Said)) {
            early.remove(&pos);
        }
    }

    fn note(&self, pos: PagePos) {
        self.lock().insert(pos, Told::At(Instant::now() + STAYS));
    }

    /// Those that are to be read again by now.
    fn take_due(&self) -> Vec<PagePos> {
        let now = Instant::now();
        let mut due = Vec::new();
        for (pos, told) in self.lock().iter_mut() {
            if matches!(told, Told::At(at) if *at <= now) {
                *told = Told::Said;
                due.push(*pos);
            }
        }
        due.sort_unstable_by_key(|pos| (pos.level, pos.z, pos.y, pos.x));
        due
    }

    fn are_any_to_say(&self) -> bool {
        self.lock().values().any(|told| matches!(told, Told::At(_)))
    }
}

impl VolumeSource {
    /// Returns true if bricks with repeated borders are there, of which [`VolumeSource::take_changes`] will
    /// say that they are to be read again: what is seen is not what it will be.
    pub fn has_early_bricks(&self) -> bool {
        self.early.are_any_to_say()
    }

    /// The box of a page with repeated borders, where it comes early; `None` where it is to be read whole.
    pub(super) async fn read_early(
        &self,
        pos: PagePos,
        of: &VoxelBox,
    ) -> Result<Option<BoxValues>, VolumeError> {
        let (border, level) = (self.description.geometry.border(), self.levels.level(pos.level));
        if !self.options.borders_later || level.stored.is_none() || !self.early.may_come(pos) {
            return Ok(None);
        }
        let own = VoxelBox {
            first: std::array::from_fn(|axis| of.first[axis] + i64::from(border[axis])),
            size: std::array::from_fn(|axis| of.size[axis].saturating_sub(2 * border[axis]).max(1)),
        };
        let chunks = self.chunks(pos.level, true);
        let plane = chunks.plane(self.options.channel, self.options.time);
        let found = plane.read_within(of, &own).await?;
        if found.is_some() {
            self.early.note(pos);
        }
        Ok(found)
    }

    /// A page was read whole: if it is read again, it may come early once more. One that could not be read is
    /// not to come early in its place, so that its failures count.
    pub(super) fn settle_early(&self, pos: PagePos) {
        self.early.settle(pos);
    }

    /// The parts of level 0 below bricks that are to be read again whole.
    pub(super) fn take_early(&self) -> Vec<Region> {
        let geometry = &self.description.geometry;
        let region = |pos: PagePos| {
            let (factor, page) = (geometry.level(pos.level).scale, geometry.page());
            let coords = pos.coords();
            // Well within the page, so that those beside it are left as they are.
            let texels = std::array::from_fn(|axis| {
                let side = u64::from(page[axis]) * factor[axis];
                let middle = u64::from(coords[axis]) * side + side / 2;
                let last = u64::from(geometry.size()[axis]).saturating_sub(1);
                let first = u64::from(coords[axis]) * side;
                let middle = if middle > last { first.min(last) } else { middle };
                let middle = u32::try_from(middle).unwrap_or(u32::MAX - 1);
                middle..middle + 1
            });
            Region { texels, levels: pos.level..=pos.level }
        };
        self.early.take_due().into_iter().map(region).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::{Arc, Mutex};

    use pollster::block_on;
    use vastex_tiles::TileSource;

    use super::super::VolumeOptions;
    use super::super::huge::{CHUNK, slow};
    use super::*;

    /// A channel of it, in bricks of one chunk.
    fn source(takes: Duration, borders_later: bool) -> VolumeSource {
        let options = VolumeOptions { brick: CHUNK as u32, borders_later, ..VolumeOptions::default() };
        VolumeSource::open(slow(17, takes), &options).unwrap()
    }

    fn texels(source: &VolumeSource, pos: PagePos) -> Vec<u16> {
        let tile = block_on(source.read(pos)).unwrap().decode(source.description()).unwrap();
        tile.as_chunks::<2>().0.iter().map(|texel| u16::from_le_bytes(*texel)).collect()
    }

    /// What has changed once bricks have stayed long enough.
    fn changes(source: &VolumeSource) -> Vec<Region> {
        let begun = Instant::now();
        while source.has_early_bricks() {
            let changes = source.take_changes();
            if !changes.is_empty() {
                return changes;
            }
            assert!(begun.elapsed() < Duration::from_secs(60), "nothing has changed");
            std::thread::sleep(Duration::from_millis(10));
        }
        Vec::new()
    }

    #[test]
    fn a_brick_comes_with_repeated_borders_and_whole_when_it_is_read_again() {
        let (early, whole) = (source(Duration::ZERO, true), source(Duration::ZERO, false));
        let side = CHUNK as usize + 2;
        for pos in [PagePos::at(0, [40, 50, 60]), PagePos::at(0, [0, 3, 3124]), PagePos::at(3, [7, 0, 9])] {
            let expected = texels(&whole, pos);
            assert!(whole.take_changes().is_empty() && !whole.has_early_bricks());
            let before = early.volume().chunk_work().decoded;
            let first = texels(&early, pos);
            assert_eq!(early.volume().chunk_work().decoded, before + 1, "{pos}: its own chunk");
            assert!(first != expected && first.len() == side.pow(3), "{pos}: borders are repeated");
            for (n, texel) in first.iter().enumerate() {
                let at = [n % side, n / side % side, n / side / side];
                // The nearest voxel of its own.
                let own = at.map(|at| at.clamp(1, side - 2));
                let from = (own[2] * side + own[1]) * side + own[0];
                assert_eq!(*texel, expected[from], "{pos}, {at:?}");
            }
            let changed = changes(&early);
            let [Region { texels: [x, y, z], levels }] = &changed[..] else { panic!("{changed:?}") };
            assert_eq!(*levels, pos.level..=pos.level);
            for (along, at) in [x, y, z].into_iter().zip(pos.coords()) {
                let page = (along.start / (CHUNK as u32)) >> pos.level;
                assert_eq!((page, along.end - along.start), (at, 1), "{pos}: {changed:?}");
            }
            assert!(!early.has_early_bricks());
            assert_eq!(texels(&early, pos), expected, "{pos}");
            // What is at hand comes whole at once.
            assert_eq!(texels(&early, pos), expected, "{pos}");
            assert!(!early.has_early_bricks() && early.take_changes().is_empty());
        }
    }

    /// The bricks of a cube, from its middle on, and how long four threads take until so many of them are
    /// there, and how many chunks were decoded then.
    fn play(source: &Arc<VolumeSource>, many: usize) -> (Duration, u64) {
        const SIDE: i64 = 5;
        let mut bricks: Vec<[i64; 3]> = (0..SIDE.pow(3))
            .map(|n| [n % SIDE, n / SIDE % SIDE, n / SIDE / SIDE].map(|at| at - SIDE / 2))
            .collect();
        bricks.sort_by_key(|at| at.iter().map(|at| at * at).sum::<i64>());
        let (next, done, begun) = (AtomicUsize::new(0), Mutex::new((0, None)), Instant::now());
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    while let Some(at) = bricks.get(next.fetch_add(1, Ordering::Relaxed)) {
                        block_on(source.read(PagePos::at(0, at.map(|at| (at + 1000) as u32)))).unwrap();
                        let mut done = done.lock().unwrap();
                        done.0 += 1;
                        if done.0 == many {
                            done.1 = Some((begun.elapsed(), source.volume().chunk_work().decoded));
                        }
                    }
                });
            }
        });
        done.into_inner().unwrap().1.unwrap()
    }

    /// Of chunks that take their time the first bricks are there much sooner, and none is decoded twice.
    #[test]
    fn the_first_bricks_do_not_wait_for_what_is_beside_them() {
        let takes = Duration::from_millis(4);
        let mut told = Vec::new();
        for borders_later in [false, true] {
            let source = Arc::new(source(takes, borders_later));
            let before = source.volume().chunk_work().decoded;
            let (time, decoded) = play(&source, 27);
            let decoded = decoded - before;
            println!("borders later: {borders_later}: 27 bricks after {time:?}, {decoded} chunks");
            told.push(decoded);
            while borders_later && source.has_early_bricks() {
                changes(&source);
            }
            // All of them again: whole now, of the chunks in and around the cube.
            play(&source, 125);
            assert_eq!(source.volume().chunk_work().decoded - before, 343);
        }
        assert!(told[0] >= 100 && told[1] <= 45, "{told:?} chunks");
    }
}
