//! Bytes that change on the disk, and programs that are killed: nothing wrong is ever served.

use super::*;
use memory_disk::Troubles;

#[test]
fn a_flipped_bit_anywhere_costs_one_entry_at_most() {
    let disk = MemoryDisk::default();
    hits(&cached(&open(&disk, 1 << 20)), 0..3);
    let files = disk.files();
    assert_eq!(files.values().map(Vec::len).sum::<usize>(), 3 * ENTRY as usize);
    for (name, bytes) in &files {
        for bit in 0..8 * bytes.len() {
            let disk = MemoryDisk::of(&files);
            disk.flip(name, bit / 8, 1 << (bit % 8));
            let cache = cached(&open(&disk, 1 << 20));
            assert_eq!(hits(&cache, 0..3), 2, "bit {bit} of {name}");
            assert_eq!(hits(&cache, 0..3), 3, "it is kept anew");
        }
    }
}

#[test]
fn bytes_that_change_while_the_cache_is_open_are_read_from_the_source() {
    for at in 0..3 * 400 {
        let disk = MemoryDisk::default();
        let cache = cached(&open(&disk, 1 << 20));
        hits(&cache, 0..3);
        let tiles = disk.files().into_keys().find(|name| name.ends_with(".tiles")).unwrap();
        disk.flip(&tiles, at, 1);
        assert_eq!([hits(&cache, 0..3), hits(&cache, 0..3)], [2, 3], "byte {at}");
        assert_eq!((cache.tier.stats().failures, cache.tier.stats().tiles), (1, 3));
    }
}

/// Files cut off anywhere, as a loss of power may leave them, and what is then written to them.
#[test]
fn files_that_are_cut_off_lose_what_they_lose_and_grow_again() {
    let disk = MemoryDisk::default();
    hits(&cached(&open(&disk, 1 << 20)), 0..3);
    let files = disk.files();
    for (name, bytes) in &files {
        for len in 0..bytes.len() {
            let mut cut = files.clone();
            cut.insert(name.clone(), bytes[..len].to_vec());
            let disk = MemoryDisk::of(&cut);
            let whole = len / (bytes.len() / 3);
            assert_eq!(hits(&cached(&open(&disk, 1 << 20)), 0..5), whole, "{len} bytes of {name}");
            let again = cached(&open(&disk, 1 << 20));
            assert_eq!(hits(&again, 0..5), 5, "{len} bytes of {name}, a run later");
        }
    }
}

#[test]
fn half_a_segment_and_files_of_others_are_no_obstacle() {
    let disk = MemoryDisk::default();
    hits(&cached(&open(&disk, 1 << 20)), 0..3);
    let whole = disk.files();
    for lost in whole.keys() {
        let mut files = whole.clone();
        files.remove(lost);
        files.insert("notes.heads".into(), vec![1; 100]);
        let disk = MemoryDisk::of(&files);
        assert_eq!(hits(&cached(&open(&disk, 1 << 20)), 0..3), 0);
        assert_eq!(disk.files()["notes.heads"], [1; 100]);
        assert_eq!(hits(&cached(&open(&disk, 1 << 20)), 0..3), 3);
    }
}

/// Killed at every change of the disk, with nothing, a part and all of it done. The budget forces segments to
/// be given up on the way, and tiles that were used to be copied.
#[test]
fn a_program_killed_at_any_write_leaves_nothing_wrong() {
    let run = |disk: &MemoryDisk| {
        let cache = cached(&open(disk, 64 << 10));
        hits(&cache, (0..160).chain(100..110).chain(0..20));
    };
    let disk = MemoryDisk::default();
    run(&disk);
    let changes = disk.changes();
    assert!(changes > 300, "{changes}");
    for killed in 0..changes {
        for sixteenths in [0, 7, 15] {
            let disk = MemoryDisk::default();
            disk.set(Troubles { killed_after: Some((killed, sixteenths)), ..Troubles::default() });
            run(&disk);
            assert!(disk.most_bytes() <= 64 << 10);
            let cache = cached(&open(&MemoryDisk::of(&disk.files()), 1 << 20));
            let found = cache.tier.stats().tiles;
            assert_eq!(hits(&cache, 0..160) as u64, found, "killed at {killed}");
            assert_eq!(cache.tier.stats().failures, 0);
        }
    }
}
