//! Disks that are slow, or stop in the middle: what is read is delivered all the same.

use std::sync::mpsc;
use std::thread;
use std::time::Instant;

use super::*;
use memory_disk::Troubles;

/// Does something that must not wait for the disk.
fn in_time<T: Send + 'static>(what: &str, work: impl FnOnce() -> T + Send + 'static) -> T {
    let (done, end) = mpsc::channel();
    thread::spawn(move || drop(done.send(work())));
    end.recv_timeout(DEADLINE).unwrap_or_else(|error| panic!("{what}: {error}"))
}

fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < DEADLINE, "{what}");
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_disk_that_stops_in_the_middle_of_a_write_holds_up_no_reader() {
    let disk = MemoryDisk::default();
    let tier = open(&disk, 1 << 20);
    let cache = Arc::new(cached(&tier));
    hits(&cache, 0..20);
    disk.stall(true);
    let reader = cache.clone();
    let found = in_time("tiles are read", move || {
        let before = reader.tier.stats().hits;
        for n in 0..169 {
            assert_eq!(block_on(reader.read(page(n))).unwrap(), block_on(source().read(page(n))).unwrap());
        }
        reader.tier.stats().hits - before
    });
    assert_eq!(found, 20, "what is kept is served, the rest comes from the source");
    wait_until("something is written", || disk.waited() > 0);
    assert!(!tier.flush(Duration::from_millis(1)), "it waits to be kept");
    disk.stall(false);
    flush(&tier);
    assert_eq!((tier.stats().tiles, hits(&cache, 0..169)), (169, 169));
}

/// The budget is one segment of 141 entries: the next one gives it up, and copies what was used.
#[test]
fn making_room_holds_up_no_reader() {
    let disk = MemoryDisk::default();
    let tier = open(&disk, 64 << 10);
    let cache = Arc::new(cached(&tier));
    hits(&cache, (0..141).chain(30..60));
    disk.stall(true);
    block_on(cache.read(page(141))).unwrap();
    wait_until("room is made", || disk.waited() > 0);
    let reader = cache.clone();
    in_time("tiles are read", move || {
        for n in (30..60).chain(142..169) {
            assert_eq!(block_on(reader.read(page(n))).unwrap(), block_on(source().read(page(n))).unwrap());
        }
    });
    disk.stall(false);
    flush(&tier);
    assert_eq!(hits(&cache, 141..169), 28);
    assert!(disk.most_bytes() <= 64 << 10);
}

#[test]
fn what_waits_to_be_kept_is_bounded() {
    let disk = MemoryDisk::default();
    let tier = open_with(&disk, 1 << 20, 10 * 400 + 399);
    let cache = cached(&tier);
    disk.stall(true);
    block_on(cache.read(page(0))).unwrap();
    wait_until("the first is written", || disk.waited() > 0);
    (1..169).for_each(|n| drop(block_on(cache.read(page(n))).unwrap()));
    assert_eq!(tier.stats().skipped, 168 - 10);
    disk.stall(false);
    flush(&tier);
    let stats = tier.stats();
    assert_eq!((stats.tiles, stats.failures), (11, 0));
    assert_eq!(hits(&cache, 0..169), 11);
    assert_eq!(hits(&cache, 0..169), 169);
}

#[test]
fn dropping_a_tier_keeps_what_waits() {
    let disk = MemoryDisk::default();
    {
        let cache = cached(&open(&disk, 1 << 20));
        (0..169).for_each(|n| drop(block_on(cache.read(page(n))).unwrap()));
    }
    assert_eq!(open(&disk, 1 << 20).stats().tiles, 169);
}

#[test]
fn dropping_a_tier_does_not_wait_for_a_disk_that_stopped() {
    let disk = MemoryDisk::default();
    let cache = cached(&open(&disk, 1 << 20));
    disk.stall(true);
    (0..169).for_each(|n| drop(block_on(cache.read(page(n))).unwrap()));
    wait_until("something is written", || disk.waited() > 0);
    in_time("the tier is dropped", move || drop(cache));
    disk.stall(false);
    // The write that was under way ends, or does not; all else is given up.
    disk.set(Troubles { read_only: true, ..Troubles::default() });
    assert!(open(&MemoryDisk::of(&disk.files()), 1 << 20).stats().tiles <= 1);
}
