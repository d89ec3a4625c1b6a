//! How many bytes there are, and which tiles give way.

use super::*;
use crate::conformance;
use crate::sources::TierStats;

#[test]
fn a_cache_conforms_at_every_budget() {
    for budget in [0, ENTRY - 1, ENTRY, 10 * ENTRY, 300 * ENTRY, u64::MAX] {
        let disk = MemoryDisk::default();
        for _ in 0..2 {
            let tier = open(&disk, budget);
            assert_eq!(conformance(&cached(&tier)), Ok(()), "{budget}");
            flush(&tier);
            assert!(disk.most_bytes() <= budget);
        }
    }
}

#[test]
fn every_read_is_counted() {
    let disk = MemoryDisk::default();
    let cache = cached(&open(&disk, 1 << 20));
    assert_eq!([hits(&cache, 0..10), hits(&cache, 5..15)], [0, 5]);
    let held = TierStats { tiles: 15, bytes: 15 * ENTRY, ..TierStats::default() };
    let expected = TierStats { hits: 5, misses: 15, bytes_read: 5 * 400, bytes_written: 15 * 400, ..held };
    assert_eq!(cache.tier.stats(), expected);
    assert_eq!(cache.source.reads(), 15);
    assert_eq!(open(&disk, 1 << 20).stats(), held, "a later run begins to count anew");
}

#[test]
fn sources_are_counted_one_by_one_and_together() {
    let tier = open(&MemoryDisk::default(), 100 << 10);
    let caches = [1, 2].map(|n: u8| DiskCache::new(source(), tier.clone(), SourceKey::of([n])));
    for (cache, pages) in caches.iter().zip([0..169, 100..169]) {
        for n in pages.clone().chain(pages) {
            block_on(cache.read(page(n))).unwrap();
            flush(&tier);
        }
    }
    let [first, second] = caches.each_ref().map(DiskCache::stats);
    assert_eq!((first.hits + first.misses, second.hits + second.misses), (2 * 169, 2 * 69));
    assert!(first.evictions > 0 && second.hits > 0);
    assert_eq!(second.bytes, second.tiles * ENTRY);
    // No entry is dead: none was damaged, and none written twice at once.
    assert_eq!(first + second, tier.stats());
}

#[test]
fn the_budget_holds_at_every_instant_and_when_it_shrinks() {
    let disk = MemoryDisk::default();
    for budget in [200 << 10, 130 << 10, 70 << 10, 64 << 10, 10 * ENTRY, ENTRY, ENTRY - 1, 0] {
        let tier = open(&disk, budget);
        let bytes = |disk: &MemoryDisk| disk.files().values().map(|file| file.len() as u64).sum::<u64>();
        assert!(bytes(&disk) <= budget, "{budget} when opened");
        disk.most_bytes();
        let cache = cached(&tier);
        for n in 0..1000 {
            read(&cache, page(n * 7 % 169));
            assert_eq!(tier.stats().bytes, bytes(&disk));
        }
        assert!(disk.most_bytes() <= budget, "{budget}");
    }
}

/// Segments of 64 KiB hold 141 entries each.
#[test]
fn what_was_read_again_outlives_what_was_not() {
    let cache = cached(&open(&MemoryDisk::default(), 64 << 10));
    hits(&cache, 0..141);
    assert_eq!(hits(&cache, 30..60), 30);
    assert_eq!(hits(&cache, 141..142), 0);
    let stats = cache.tier.stats();
    assert_eq!((stats.evictions, stats.tiles), (111, 31));
    assert_eq!((hits(&cache, 30..60), hits(&cache, 0..30)), (30, 0));
}

#[test]
fn when_all_was_read_again_half_of_it_stays() {
    let cache = cached(&open(&MemoryDisk::default(), 64 << 10));
    for _ in 0..2 {
        hits(&cache, 0..141);
    }
    hits(&cache, 141..142);
    assert_eq!(cache.tier.stats().tiles, 70 + 1);
}

#[test]
fn the_budget_holds_while_threads_read() {
    let disk = MemoryDisk::default();
    let cache = cached(&open(&disk, 64 << 10));
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let cache = &cache;
            scope.spawn(move || {
                for n in 0..1000 {
                    let pos = page(n * (thread + 3) % 169);
                    let tile = block_on(cache.read(pos)).unwrap();
                    assert_eq!(tile, block_on(source().read(pos)).unwrap(), "{pos}");
                }
            });
        }
    });
    flush(&cache.tier);
    let stats = cache.tier.stats();
    assert_eq!((stats.hits + stats.misses, stats.failures, stats.skipped), (4000, 0, 0));
    assert!(stats.evictions > 0 && disk.most_bytes() <= 64 << 10);
}

/// As many small segments as only trouble leaves: each is an open file.
#[test]
fn segments_that_are_too_many_are_given_up() {
    let disk = MemoryDisk::default();
    hits(&cached(&open(&disk, 1 << 20)), 0..1);
    let [heads, tiles] = disk.files().into_values().collect::<Vec<_>>().try_into().unwrap();
    let copies = (0..200).flat_map(|n| {
        [(format!("{n:016x}.heads"), heads.clone()), (format!("{n:016x}.tiles"), tiles.clone())]
    });
    let disk = MemoryDisk::of(&copies.collect());
    let cache = cached(&open(&disk, 1 << 20));
    assert_eq!((disk.files().len(), hits(&cache, 0..1)), (2 * 128, 1));
}
