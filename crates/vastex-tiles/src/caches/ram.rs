//! The RAM tier: encoded tiles of a source, kept within a budget of bytes.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use rustc_hash::FxHashMap;
use vastex_core::{Description, PagePos, Region};

use crate::ground::sync::lock;
use crate::sources::{ReadFuture, TierStats, Tiers, TileSource};
use crate::tile::Tile;

/// The cost of keeping a tile besides its bytes, so that the budget holds for constant tiles too.
const ENTRY_BYTES: u64 = 128;

/// A decorator that keeps the most recently used tiles of a source in memory, still encoded, within a budget
/// of bytes that holds at every instant.
///
/// A hit costs a look-up under a lock. A tile larger than the whole budget is passed through; errors are not
/// kept.
pub struct RamCache<S> {
    source: S,
    budget: u64,
    held: Mutex<Held>,
}

impl<S> RamCache<S> {
    /// Puts a cache of at most `budget` bytes before `source`.
    pub fn new(source: S, budget: u64) -> RamCache<S> {
        RamCache { source, budget, held: Mutex::default() }
    }

    /// What the cache has done so far, and what it holds; each tile counts 128 bytes in addition to its own.
    pub fn stats(&self) -> TierStats {
        lock(&self.held).stats
    }
}

impl<S: TileSource> TileSource for RamCache<S> {
    fn behind(&self) -> Option<&dyn TileSource> {
        Some(&self.source)
    }

    fn description(&self) -> &Arc<Description> {
        self.source.description()
    }

    fn add_tiers(&self, tiers: &mut Tiers) {
        tiers.ram += self.stats();
        self.source.add_tiers(tiers);
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            let changes = {
                let mut held = lock(&self.held);
                if let Some(tile) = held.get(pos) {
                    return Ok(tile);
                }
                held.changes
            };
            let tile = self.source.read(pos).await?;
            let mut held = lock(&self.held);
            // What was read while something changed may be of before.
            if held.changes == changes {
                held.insert(pos, tile.clone(), self.budget);
            }
            Ok(tile)
        })
    }

    fn at_hand(&self, pos: PagePos) -> Option<Tile> {
        let held = lock(&self.held).tiles.get(&pos).map(|(tile, _)| tile.clone());
        held.or_else(|| self.source.at_hand(pos))
    }

    fn changed(&self, region: &Region) {
        // The source first, so that nothing old is read between the two.
        self.source.changed(region);
        let geometry = &self.description().geometry;
        let mut held = lock(&self.held);
        held.changes += 1;
        let concerned: Vec<_> =
            held.tiles.keys().copied().filter(|&pos| region.concerns(geometry, pos)).collect();
        concerned.into_iter().for_each(|pos| held.remove(pos));
    }
}

/// The tiles, and the order of their last uses.
#[derive(Default)]
struct Held {
    tiles: FxHashMap<PagePos, (Tile, u64)>,
    by_use: BTreeMap<u64, PagePos>,
    uses: u64,
    /// How many times content has changed.
    changes: u64,
    stats: TierStats,
}

impl Held {
    fn get(&mut self, pos: PagePos) -> Option<Tile> {
        let Some((tile, last_use)) = self.tiles.get_mut(&pos) else {
            self.stats.misses += 1;
            return None;
        };
        self.stats.hits += 1;
        self.stats.bytes_read += tile.bytes.len() as u64;
        self.uses += 1;
        self.by_use.remove(last_use);
        *last_use = self.uses;
        self.by_use.insert(self.uses, pos);
        Some(tile.clone())
    }

    fn insert(&mut self, pos: PagePos, tile: Tile, budget: u64) {
        let cost = cost(&tile);
        // Another thread may have read it at the same time.
        self.remove(pos);
        if cost > budget {
            return;
        }
        while self.stats.bytes + cost > budget {
            let Some((_, &oldest)) = self.by_use.first_key_value() else { return };
            self.remove(oldest);
            self.stats.evictions += 1;
        }
        self.uses += 1;
        self.by_use.insert(self.uses, pos);
        self.stats.bytes_written += tile.bytes.len() as u64;
        self.tiles.insert(pos, (tile, self.uses));
        self.stats.bytes += cost;
        self.stats.tiles += 1;
    }

    fn remove(&mut self, pos: PagePos) {
        if let Some((tile, last_use)) = self.tiles.remove(&pos) {
            self.by_use.remove(&last_use);
            self.stats.bytes -= cost(&tile);
            self.stats.tiles -= 1;
        }
    }
}

fn cost(tile: &Tile) -> u64 {
    tile.bytes.len() as u64 + ENTRY_BYTES
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance;
    use crate::sources::PropertySource;
    use crate::testing::{Faults, Injection};
    use pollster::block_on;
    use proptest::prelude::*;
    use std::task::{Context, Waker};
    use vastex_core::{Geometry, GeometrySpec};

    /// Tiles of 400 bytes.
    fn source() -> PropertySource {
        let spec = GeometrySpec { page: 8, border: 1, ..GeometrySpec::image(100, 100) };
        PropertySource::new(Geometry::new(spec).unwrap())
    }

    const TILE: u64 = 400 + ENTRY_BYTES;

    #[test]
    fn a_cache_conforms_at_every_budget() {
        for budget in [0, TILE - 1, TILE, 10 * TILE, u64::MAX] {
            assert_eq!(conformance(&RamCache::new(source(), budget)), Ok(()), "{budget}");
        }
    }

    #[test]
    fn the_tile_used_longest_ago_goes_first() {
        let cache = RamCache::new(source(), 2 * TILE);
        let [a, b, c] = [0, 1, 2].map(|x| PagePos::new_2d(0, x, 0));
        for pos in [a, b, a, c, a, b] {
            block_on(cache.read(pos)).unwrap();
        }
        let held = TierStats {
            tiles: 2,
            bytes: 2 * TILE,
            bytes_read: 2 * 400,
            bytes_written: 4 * 400,
            ..TierStats::default()
        };
        let expected = TierStats { hits: 2, misses: 4, evictions: 2, ..held };
        assert_eq!(cache.stats(), expected);
    }

    #[test]
    fn a_tile_beyond_the_budget_is_passed_through() {
        let cache = RamCache::new(source(), TILE - 1);
        block_on(cache.read(PagePos::new_2d(0, 0, 0))).unwrap();
        assert_eq!(cache.stats(), TierStats { misses: 1, ..TierStats::default() });
    }

    #[test]
    fn what_is_at_hand_is_what_is_held_and_counts_as_no_use() {
        let cache = Arc::new(RamCache::new(RamCache::new(source(), TILE), 2 * TILE));
        let [a, b, c] = [0, 1, 2].map(|x| PagePos::new_2d(0, x, 0));
        assert_eq!(cache.at_hand(a), None, "nothing is read for it");
        for pos in [a, b, c] {
            block_on(cache.read(pos)).unwrap();
        }
        let stats = cache.stats();
        assert_eq!(cache.at_hand(a), None, "it was evicted from both");
        assert_eq!(cache.at_hand(b), Some(block_on(source().read(b)).unwrap()));
        assert_eq!(cache.stats(), stats);
        block_on(cache.read(a)).unwrap();
        assert_eq!(cache.at_hand(b), None, "asking has not made it younger");
        assert!(cache.at_hand(a).is_some());
    }

    #[test]
    fn what_has_changed_is_read_anew_and_nothing_else() {
        let cache = RamCache::new(source(), u64::MAX);
        let [a, b] = [0, 9].map(|x| PagePos::new_2d(0, x, 0));
        let read = |pos| block_on(cache.read(pos)).unwrap();
        [a, b].into_iter().for_each(|pos| drop(read(pos)));
        cache.changed(&Region::image(0..1, 0..1).on_levels(0..=0));
        assert_eq!(cache.stats().tiles, 1);
        [a, b].into_iter().for_each(|pos| drop(read(pos)));
        assert_eq!((cache.stats().hits, cache.stats().misses), (1, 3));
        // The border of the page beside it holds the texel too.
        cache.changed(&Region::image(72..73, 0..1).on_levels(0..=0));
        assert_eq!(cache.stats().tiles, 1);
    }

    #[test]
    fn a_read_that_was_under_way_when_something_changed_is_not_kept() {
        let faults = Faults::new(source(), |_, _| Some(Injection::Suspend(1)));
        let cache = RamCache::new(faults, u64::MAX);
        let pos = PagePos::new_2d(0, 0, 0);
        let mut read = cache.read(pos);
        let mut context = Context::from_waker(Waker::noop());
        assert!(read.as_mut().poll(&mut context).is_pending());
        cache.changed(&Region::whole());
        assert!(read.as_mut().poll(&mut context).is_ready());
        assert_eq!(cache.stats().tiles, 0);
        block_on(cache.read(pos)).unwrap();
        assert_eq!(cache.stats().tiles, 1);
    }

    #[test]
    fn errors_are_not_kept() {
        let faults = Faults::new(source(), |_, attempt| (attempt == 0).then_some(Injection::Fail));
        let cache = RamCache::new(faults, u64::MAX);
        let outcomes = [(); 3].map(|()| block_on(cache.read(PagePos::new_2d(0, 0, 0))).is_ok());
        assert_eq!(outcomes, [false, true, true]);
        assert_eq!((cache.stats().hits, cache.stats().misses), (1, 2));
    }

    #[test]
    fn the_budget_holds_while_threads_read() {
        let cache = RamCache::new(source(), 5 * TILE + 17);
        std::thread::scope(|scope| {
            for thread in 0..4 {
                let cache = &cache;
                scope.spawn(move || {
                    for n in 0..500 {
                        let pos = PagePos::new_2d(0, (n * (thread + 3)) % 13, n % 3);
                        block_on(cache.read(pos)).unwrap();
                        assert!(cache.stats().bytes <= 5 * TILE + 17);
                    }
                });
            }
        });
        let stats = cache.stats();
        assert_eq!((stats.hits + stats.misses, stats.tiles), (2000, 5));
    }

    proptest! {
        #[test]
        fn what_is_held_is_what_is_counted(budget in 0..20 * TILE, reads in prop::collection::vec((0u32..6, 0u32..6), 0..200)) {
            let cache = RamCache::new(source(), budget);
            for (x, y) in reads {
                block_on(cache.read(PagePos::new_2d(0, x, y))).unwrap();
                let held = lock(&cache.held);
                prop_assert!(held.stats.bytes <= budget);
                prop_assert_eq!(held.stats.bytes, held.tiles.values().map(|(tile, _)| cost(tile)).sum::<u64>());
                prop_assert_eq!((held.stats.tiles as usize, held.by_use.len()), (held.tiles.len(), held.tiles.len()));
            }
        }
    }
}
