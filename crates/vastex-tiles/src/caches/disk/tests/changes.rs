//! What has changed: never served, never kept, in this run.

use super::*;
use std::task::{Context, Waker};
use vastex_core::Region;

/// The first page of level 0, with what its neighbours show of it.
fn corner() -> Region {
    Region::image(0..8, 0..8).on_levels(0..=0)
}

#[test]
fn what_has_changed_is_read_from_the_source_and_not_kept() {
    let disk = MemoryDisk::default();
    let tier = open(&disk, 1 << 20);
    let cache = cached(&tier);
    let elsewhere = page(5);
    for is_kept in [false, true] {
        assert!([page(0), elsewhere].into_iter().all(|pos| read(&cache, pos) == is_kept));
    }
    cache.changed(&corner());
    let before = tier.stats();
    block_on(cache.read(page(0))).unwrap();
    flush(&tier);
    let after = tier.stats();
    assert_eq!((after.hits, after.bytes_written), (before.hits, before.bytes_written));
    assert!(read(&cache, elsewhere), "nothing else is concerned");
    for x in 0..1000 {
        cache.changed(&Region::image(x..x + 1, 50..51));
    }
    assert!(cache.has_changed(page(0)) && lock(&cache.changed).len() <= 64);
}

#[test]
fn what_was_read_while_it_changed_is_not_kept() {
    let disk = MemoryDisk::default();
    let tier = open(&disk, 1 << 20);
    let slow = Faults::new(source(), |_, _| Some(Injection::Suspend(1)));
    let cache = DiskCache::new(slow, tier.clone(), key());
    let mut under_way = cache.read(page(0));
    let mut context = Context::from_waker(Waker::noop());
    assert!(under_way.as_mut().poll(&mut context).is_pending());
    cache.changed(&corner());
    assert!(under_way.as_mut().poll(&mut context).is_ready());
    flush(&tier);
    assert_eq!(tier.stats().tiles, 0);
}

#[test]
fn what_changed_while_it_waited_to_be_kept_is_not() {
    let disk = MemoryDisk::default();
    let tier = open(&disk, 1 << 20);
    let cache = cached(&tier);
    disk.stall(true);
    for n in [3, 0, 5] {
        block_on(cache.read(page(n))).unwrap();
    }
    cache.changed(&corner());
    disk.stall(false);
    flush(&tier);
    assert_eq!(tier.stats().tiles, 2);
    drop((cache, tier));
    assert_eq!(hits(&cached(&open(&disk, 1 << 20)), [3, 0, 5]), 2);
}
