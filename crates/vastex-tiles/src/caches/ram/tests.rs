//! Checks of the RAM tier: what one cache keeps, and what several caches leave each other.

use std::collections::BTreeMap;

use super::kept::ENTRY_BYTES;
use super::*;
use crate::conformance;
use crate::sources::PropertySource;
use crate::testing::{Faults, Injection};
use pollster::block_on;
use proptest::prelude::*;
use std::task::{Context, Waker};
use vastex_core::shader_constants::JITTER_CYCLE;
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

/// Caches that share a budget of so many tiles.
fn shared<const N: usize>(tiles: u64) -> (Arc<RamBudget>, [RamCache<PropertySource>; N]) {
    let budget = RamBudget::new(tiles * TILE);
    let caches = std::array::from_fn(|_| RamCache::within(source(), budget.clone()));
    (budget, caches)
}

/// Pages of level 0, of which the source has 169.
fn page(n: u32) -> PagePos {
    PagePos::new_2d(0, n % 13, n / 13)
}

fn read(cache: &RamCache<PropertySource>, pages: impl Iterator<Item = u32>) {
    pages.for_each(|n| drop(block_on(cache.read(page(n))).unwrap()));
}

#[test]
fn of_all_sources_the_tile_used_longest_ago_goes_first() {
    let (budget, [a, b, c]) = shared(30);
    read(&a, 0..10);
    read(&b, 0..10);
    read(&a, 0..5);
    // A cycle later nobody's tiles are in use.
    (0..JITTER_CYCLE).for_each(|_| budget.begin_frame());
    read(&c, 0..15);
    assert_eq!([&a, &b, &c].map(|cache| cache.stats().tiles), [5, 10, 15], "those that were read once");
    read(&c, 15..25);
    assert_eq!([&a, &b, &c].map(|cache| cache.stats().tiles), [5, 0, 25]);
    read(&c, 25..40);
    assert_eq!(
        [&a, &b, &c].map(|cache| cache.stats().tiles),
        [0, 0, 30],
        "one may have all that others leave"
    );
    assert_eq!([&a, &b, &c].map(|cache| cache.stats().evictions), [10, 10, 10]);
    assert_eq!((budget.held_bytes(), budget.bytes()), (30 * TILE, 30 * TILE));
}

#[test]
fn a_flood_leaves_the_others_half_of_what_they_use() {
    let (budget, [used, flood]) = shared(60);
    let mut misses = Vec::new();
    for frame in 0..4 * JITTER_CYCLE {
        budget.begin_frame();
        // Forty tiles once in a cycle, as a view that pans to and fro.
        if frame % JITTER_CYCLE == 0 {
            let before = used.stats().misses;
            match misses.len() % 2 {
                0 => read(&used, 0..40),
                _ => read(&used, (0..40).rev()),
            }
            misses.push(used.stats().misses - before);
        }
        read(&flood, 0..169);
        assert!(used.stats().tiles >= 20, "frame {frame}: {:?}", used.stats());
        assert_eq!(budget.held_bytes(), 60 * TILE, "frame {frame}");
    }
    assert_eq!(misses, [40, 20, 20, 20]);
    // What is no longer used is the flood's.
    (0..JITTER_CYCLE).for_each(|_| budget.begin_frame());
    read(&flood, 0..169);
    assert_eq!((used.stats().tiles, flood.stats().tiles), (0, 60));
    // And the other way round: what the flood holds gives way.
    read(&used, 0..20);
    assert_eq!(used.stats().tiles, 20);
}

#[test]
fn a_cache_that_is_dropped_gives_its_room_back() {
    let (budget, [a, b]) = shared(20);
    read(&a, 0..20);
    read(&b, 0..5);
    assert_eq!((a.stats().tiles, b.stats().tiles), (15, 5));
    drop(a);
    assert_eq!(budget.held_bytes(), 5 * TILE);
    read(&b, 0..40);
    assert_eq!((b.stats().tiles, b.stats().evictions), (20, 20));
    lock(&budget.kept).check();
}

#[test]
fn what_changes_in_one_source_changes_in_no_other() {
    let (_, [a, b]) = shared(20);
    [&a, &b].into_iter().for_each(|cache| read(cache, 0..9));
    a.changed(&Region::whole());
    assert_eq!((a.stats().tiles, b.stats().tiles), (0, 9));
}

proptest! {
    #[test]
    fn what_is_held_is_what_is_counted(budget in 0..20 * TILE, reads in prop::collection::vec((0u32..6, 0u32..6), 0..200)) {
        let cache = RamCache::new(source(), budget);
        for (x, y) in reads {
            block_on(cache.read(PagePos::new_2d(0, x, y))).unwrap();
            prop_assert!(cache.stats().bytes <= budget);
            lock(&cache.budget.kept).check();
        }
    }

    /// What each cache has taken of the tiles that the others used in the last cycle is at most half of
    /// those, as a list of all uses tells it.
    #[test]
    fn nobody_takes_more_than_half(
        tiles in 1u64..30,
        steps in prop::collection::vec((0usize..4, 0u32..25, 1u32..25, any::<bool>()), 1..120),
    ) {
        let (budget, caches) = shared::<3>(tiles);
        let caches = &caches;
        let held = |owner: usize| (0..50).filter(move |&n| caches[owner].at_hand(page(n)).is_some());
        let (mut frame, mut last_use, mut taken) = (0u32, BTreeMap::new(), Vec::new());
        for (who, first, count, is_frame) in steps {
            if is_frame {
                budget.begin_frame();
                frame += 1;
            }
            let Some(cache) = caches.get(who) else { continue };
            for n in first..first + count {
                let others = || (0..3).filter(|&owner| owner != who);
                let before: Vec<_> = others().flat_map(|owner| held(owner).map(move |n| (owner, n))).collect();
                read(cache, n..n + 1);
                last_use.insert((who, n), frame);
                let is_recent = |used: u32| used + JITTER_CYCLE > frame;
                for (owner, n) in before {
                    let used = last_use[&(owner, n)];
                    if caches[owner].at_hand(page(n)).is_none() && is_recent(used) {
                        taken.push((who, used));
                    }
                }
                let taken = taken.iter().filter(|&&(taker, used)| taker == who && is_recent(used)).count();
                let used = last_use.iter().filter(|&(&(owner, _), &used)| owner != who && is_recent(used)).count();
                prop_assert!(2 * taken <= used, "{taken} of {used}");
            }
            lock(&budget.kept).check();
        }
    }
}
