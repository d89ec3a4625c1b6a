//! Disks that are full, read-only or gone: the source answers, and the cache goes on when it can.

use super::*;
use crate::caches::disk::write_queue::FIRST_PAUSE;
use crate::tile::{Codec, Tile};
use memory_disk::Troubles;

#[test]
fn on_a_full_disk_older_tiles_give_way() {
    for keeps_torn in [false, true] {
        let disk = MemoryDisk::default();
        disk.set(Troubles { capacity: Some(150 << 10), keeps_torn, ..Troubles::default() });
        let cache = cached(&open(&disk, 1 << 30));
        for round in 0..20 {
            hits(&cache, 0..169);
            assert_eq!(hits(&cache, 160..169), 9, "round {round}");
            disk.set(Troubles { capacity: Some((150 - round) << 10), keeps_torn, ..Troubles::default() });
        }
        assert!(cache.tier.stats().bytes <= 150 << 10);
    }
}

#[test]
fn where_files_may_not_be_long_there_are_more_of_them() {
    let disk = MemoryDisk::default();
    disk.set(Troubles { longest_file: Some(4100), ..Troubles::default() });
    let cache = cached(&open(&disk, 1 << 20));
    assert_eq!([hits(&cache, 0..100), hits(&cache, 0..100)], [0, 100]);
    assert_eq!((disk.files().len(), cache.tier.stats().failures), (2 * 10, 0));
}

#[test]
fn a_disk_without_any_room_is_left_alone_for_longer_and_longer() {
    let disk = MemoryDisk::default();
    disk.set(Troubles { capacity: Some(0), ..Troubles::default() });
    let cache = cached(&open(&disk, 1 << 20));
    assert_eq!(hits(&cache, (0..1000).map(|n| n % 169)), 0);
    let stats = cache.tier.stats();
    // At once, and after 64, 128, 256 and 512 tiles.
    assert_eq!((stats.failures, stats.tiles, stats.bytes), (5, 0, 0));
    disk.set(Troubles::default());
    hits(&cache, (0..1200).map(|n| n % 169));
    assert_eq!(hits(&cache, 0..169), 169, "there is room again");
}

#[test]
fn a_disk_that_becomes_read_only_serves_what_it_has() {
    for budget in [1 << 20, 20 * ENTRY] {
        let disk = MemoryDisk::default();
        let cache = cached(&open(&disk, budget));
        hits(&cache, 0..20);
        disk.set(Troubles { read_only: true, ..Troubles::default() });
        assert_eq!((hits(&cache, 0..40), hits(&cache, 0..20)), (20, 20));
        assert_eq!((cache.tier.stats().failures, cache.tier.stats().tiles), (1, 20));
        disk.set(Troubles::default());
        hits(&cache, 40..40 + FIRST_PAUSE);
        assert_eq!((hits(&cache, 168..169), hits(&cache, 168..169)), (0, 1), "it is written again");
        assert_eq!(cache.tier.stats().failures, 1);
        assert!(disk.most_bytes() <= budget);
    }
}

#[test]
fn files_that_vanish_are_done_without() {
    let disk = MemoryDisk::default();
    let cache = cached(&open(&disk, 64 << 10));
    hits(&cache, 0..141);
    disk.remove_all();
    hits(&cache, 0..169);
    assert_eq!(hits(&cache, 160..169), 9);
    assert_eq!(cache.tier.stats().failures, 0);
}

#[test]
fn what_does_not_decode_and_errors_are_not_kept() {
    let tier = open(&MemoryDisk::default(), 1 << 20);
    let plan = |_, attempt| match attempt {
        0 => Some(Injection::Fail),
        1 => Some(Injection::Corrupt),
        2 => Some(Injection::Replace(Tile { codec: Codec::Lz4, bytes: vec![7; 30].into() })),
        _ => None,
    };
    let faults = Arc::new(Faults::new(source(), plan));
    let cache = DiskCache::new(faults.clone(), tier.clone(), key());
    for _ in 0..6 {
        drop(block_on(cache.read(page(0))));
        flush(&tier);
    }
    assert_eq!((faults.reads(), tier.stats().hits), (4, 2));
    assert_eq!(block_on(cache.read(page(0))).unwrap(), block_on(source().read(page(0))).unwrap());
}
