//! Every store gives exactly the bytes that are asked for, or says why not.

use std::path::Path;
use std::task::{Context, Waker};

use pollster::block_on;

use super::*;

/// Bytes that tell where they lie.
fn pattern(len: usize) -> Vec<u8> {
    (0..len as u64).map(|n| (n.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 56) as u8).collect()
}

fn check(store: &dyn Store, bytes: &[u8]) {
    let len = bytes.len();
    assert_eq!((store.len(), store.is_empty()), (len as u64, false));
    let inside = [(0, len), (1, 2), (len, 0), (len - 1, 1), (len / 2, len / 3)];
    for (offset, len) in inside {
        assert_eq!(block_on(store.read(offset as u64, len)).unwrap(), bytes[offset..offset + len]);
    }
    for (offset, len) in [(0, len + 1), (len, 1), (usize::MAX, 1)] {
        let error = block_on(store.read(offset as u64, len)).unwrap_err();
        assert!(error.to_string().contains(store.name()), "{error}");
    }
}

#[test]
fn stores_give_exactly_the_range() {
    let dir = tempfile::tempdir().unwrap();
    // Up to and beyond a block, a buffer, and several buffers.
    for len in [4, 4095, 4096, 4097, 1 << 20, (5 << 20) + 123] {
        let (path, bytes) = (dir.path().join(len.to_string()), pattern(len));
        std::fs::write(&path, &bytes).unwrap();
        check(&MemoryStore::new("memory", bytes.clone()), &bytes);
        check(&FileStore::open(&path).unwrap(), &bytes);
        for depth in [0, 1, 8, usize::MAX] {
            let store = DirectStore::open(&path, depth).unwrap();
            let direct = store.is_direct();
            check(&store, &bytes);
            assert_eq!(store.is_direct(), direct, "a range that does not exist is no refusal");
        }
    }
}

#[test]
fn direct_reads_of_any_range_at_once_from_many_threads() {
    let dir = tempfile::tempdir().unwrap();
    let (path, bytes) = (dir.path().join("bytes"), pattern(300_000));
    std::fs::write(&path, &bytes).unwrap();
    let store = DirectStore::open(&path, 4).unwrap();
    std::thread::scope(|scope| {
        for thread in 0..12u64 {
            let (store, bytes) = (&store, &bytes);
            scope.spawn(move || {
                for n in 0..200 {
                    let random = crate::ground::hash::seeded(thread, &u64::to_le_bytes(n));
                    let offset = random as usize % bytes.len();
                    let len = (random >> 32) as usize % (bytes.len() - offset).min(20_000);
                    assert_eq!(
                        block_on(store.read(offset as u64, len)).unwrap(),
                        bytes[offset..offset + len]
                    );
                }
            });
        }
    });
}

#[test]
fn direct_reads_that_are_dropped_hinder_no_other() {
    let dir = tempfile::tempdir().unwrap();
    let (path, bytes) = (dir.path().join("bytes"), pattern(2 << 20));
    std::fs::write(&path, &bytes).unwrap();
    let store = DirectStore::open(&path, 2).unwrap();
    let mut context = Context::from_waker(Waker::noop());
    for round in 0..50 {
        let mut reads: Vec<_> = (0..20).map(|n| store.read(n * 100_000, 1000)).collect();
        // Some are dropped unpolled, some queued, some under way, some done.
        for read in reads.iter_mut().skip(5) {
            let _ = read.as_mut().poll(&mut context);
        }
        reads.truncate(20 - round % 20);
        drop(reads);
        assert_eq!(block_on(store.read(77, 5000)).unwrap(), bytes[77..5077]);
    }
}

#[test]
fn no_more_direct_reads_are_under_way_than_the_store_says() {
    let dir = tempfile::tempdir().unwrap();
    let (path, bytes) = (dir.path().join("bytes"), pattern(20_000));
    std::fs::write(&path, &bytes).unwrap();
    assert!(FileStore::open(&path).unwrap().read_limit().is_none());
    for (depth, reads) in [(0, 1), (3, 3), (usize::MAX, 64)] {
        let store = DirectStore::open(&path, depth).unwrap();
        let Some(limit) = store.read_limit() else {
            assert!(!store.is_direct());
            eprintln!("SKIPPED: no file is read directly in {}", dir.path().display());
            return;
        };
        assert_eq!((limit.reads(), limit.is_blocking()), (reads, true));
        let permits: Vec<_> = (0..reads).map(|_| block_on(limit.permit())).collect();
        let mut read = store.read(77, 5000);
        assert!(read.as_mut().poll(&mut Context::from_waker(Waker::noop())).is_pending());
        drop(permits);
        assert_eq!(block_on(read).unwrap(), bytes[77..5077]);
        assert_eq!(limit.under_way(), 0);
    }
}

#[test]
fn a_file_that_shrinks_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let open_both = |path: &Path| -> [Box<dyn Store>; 2] {
        [Box::new(FileStore::open(path).unwrap()), Box::new(DirectStore::open(path, 2).unwrap())]
    };
    for (len, left) in [(100, 50), (100_000, 50_000), (100_000, 49_152)] {
        let path = dir.path().join("bytes");
        std::fs::write(&path, pattern(len)).unwrap();
        let stores = open_both(&path);
        std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(left).unwrap();
        for store in stores {
            let direct = store.is_direct();
            let error = block_on(store.read(left - 10, 20)).unwrap_err().to_string();
            assert!(error.contains("shorter"), "{error}");
            assert_eq!(
                block_on(store.read(left - 10, 10)).unwrap(),
                pattern(len)[left as usize - 10..left as usize]
            );
            assert_eq!(store.is_direct(), direct);
        }
    }
}

#[test]
fn what_is_no_readable_file_is_refused_with_the_remedy() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |path: &Path| {
        let errors = [FileStore::open(path).unwrap_err(), DirectStore::open(path, 8).unwrap_err()];
        assert_eq!(errors[0], errors[1]);
        errors[0].to_string()
    };
    assert!(refused(dir.path()).ends_with("this is a directory; name a file in it"));
    assert!(refused(&dir.path().join("none")).ends_with("there is no such file; check the path"));
    let empty = dir.path().join("empty");
    std::fs::write(&empty, []).unwrap();
    assert!(refused(&empty).contains("is empty"));
}

/// Files of the system itself are made when they are read: there is no disk behind them, and direct reads are
/// refused.
#[test]
#[cfg(target_os = "linux")]
fn where_the_file_system_refuses_direct_reads_they_are_buffered() {
    let path = Path::new("/sys/devices/system/cpu/online");
    if !path.exists() {
        eprintln!("SKIPPED: there is no {} to be refused at", path.display());
        return;
    }
    let store = DirectStore::open(path, 8).unwrap();
    assert!(!store.is_direct() && store.block_bytes().is_none());
    assert_eq!(block_on(store.read(0, 1)).unwrap(), std::fs::read(path).unwrap()[..1]);
}

/// Whether a file system in memory reads directly depends on the kernel; that it gives the bytes does not.
#[test]
#[cfg(target_os = "linux")]
fn files_in_memory_are_read_whether_directly_or_not() {
    let Ok(dir) = tempfile::tempdir_in("/dev/shm") else {
        eprintln!("SKIPPED: nothing can be written to /dev/shm");
        return;
    };
    let (path, bytes) = (dir.path().join("bytes"), pattern(50_000));
    std::fs::write(&path, &bytes).unwrap();
    check(&DirectStore::open(&path, 8).unwrap(), &bytes);
}
