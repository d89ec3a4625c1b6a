//! A cache in a real directory: slow sources, other processes, a directory that goes away.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::*;
use crate::caches::disk::DiskTierError;
use crate::{Loader, conformance};
use vastex_core::{Dims, PageId, TextureNumber};

const SLOW: Duration = Duration::from_millis(5);
/// Names the directory to a process that is to be killed.
const KILLED_IN: &str = "VASTEX_TEST_KILLED_IN";

#[test]
fn a_second_run_reads_nothing_from_the_slow_source() {
    let directory = tempfile::tempdir().unwrap();
    let texture = TextureNumber::new(0).unwrap();
    let mut loads = Vec::new();
    for expected in [40, 0] {
        let slow = Arc::new(Faults::new(source(), |_, _| Some(Injection::Delay(SLOW))));
        let tier = Arc::new(DiskTier::open(directory.path().join("made/here"), 1 << 20).unwrap());
        let mut loader = Loader::new(2).unwrap();
        loader.add_source(texture, Arc::new(DiskCache::new(slow.clone(), tier.clone(), key())));
        let start = Instant::now();
        (0..40).for_each(|n| loader.request(PageId::new(texture, Dims::D2, page(n)).unwrap(), n.into()));
        let mut loaded = Vec::new();
        while let Some(next) = loader.wait() {
            loaded.push((next.page, next.result.unwrap()));
        }
        loaded.sort();
        assert_eq!((slow.reads(), tier.stats().misses), (expected, expected));
        loads.push((loaded, start.elapsed()));
    }
    assert_eq!(loads[0].0, loads[1].0);
    assert!(loads[0].1 >= 20 * SLOW);
}

#[test]
fn a_cache_in_a_directory_conforms_and_says_what_its_files_say() {
    let directory = tempfile::tempdir().unwrap();
    for budget in [100 << 10, 30 << 10] {
        let tier = Arc::new(DiskTier::open(directory.path(), budget).unwrap());
        assert_eq!(conformance(&cached(&tier)), Ok(()));
        flush(&tier);
        let files = std::fs::read_dir(directory.path()).unwrap().map(|entry| entry.unwrap());
        let bytes: u64 = files.map(|entry| entry.metadata().unwrap().len()).sum();
        assert_eq!(tier.stats().bytes, bytes);
        assert!(bytes <= budget && tier.stats().failures == 0);
    }
}

#[test]
fn a_directory_belongs_to_one_at_a_time() {
    let directory = tempfile::tempdir().unwrap();
    let first = DiskTier::open(directory.path(), 1 << 20).unwrap();
    let refused = DiskTier::open(directory.path(), 1 << 20).unwrap_err();
    assert!(matches!(refused, DiskTierError::InUse { .. }));
    let message = refused.to_string();
    assert!(message.contains(directory.path().to_str().unwrap()) && message.contains("in use"), "{message}");
    drop(first);
    DiskTier::open(directory.path(), 1 << 20).unwrap();
}

#[test]
fn what_cannot_be_a_directory_is_refused_with_its_name() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    std::fs::write(&file, "x").unwrap();
    for path in [file.clone(), file.join("below")] {
        let message = DiskTier::open(&path, 1 << 20).unwrap_err().to_string();
        assert!(message.starts_with(path.to_str().unwrap()) && message.contains("name another"), "{message}");
    }
    assert_eq!(std::fs::read(&file).unwrap(), b"x");
}

#[test]
fn a_directory_that_goes_away_is_done_without() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("cache");
    let tier = Arc::new(DiskTier::open(&path, 64 << 10).unwrap());
    let cache = cached(&tier);
    hits(&cache, 0..100);
    std::fs::remove_dir_all(&path).unwrap();
    // Until new files are needed, the open ones serve; from then on the source does.
    hits(&cache, 0..169);
    hits(&cache, 0..169);
    assert!(tier.stats().failures > 0);
}

#[test]
fn sources_in_one_directory_keep_apart() {
    let directory = tempfile::tempdir().unwrap();
    let tier = Arc::new(DiskTier::open(directory.path(), 1 << 20).unwrap());
    let spec = GeometrySpec { page: 8, border: 1, ..GeometrySpec::image(99, 100) };
    let other_shape = PropertySource::new(Geometry::new(spec).unwrap());
    let caches: Vec<Box<dyn TileSource>> = vec![
        Box::new(DiskCache::new(source(), tier.clone(), key())),
        Box::new(DiskCache::new(source(), tier.clone(), SourceKey::of("another"))),
        Box::new(DiskCache::new(other_shape, tier.clone(), key())),
    ];
    for cache in &caches {
        block_on(cache.read(page(0))).unwrap();
    }
    flush(&tier);
    assert_eq!((tier.stats().misses, tier.stats().tiles), (3, 3));
    for cache in &caches {
        assert_eq!(conformance(&**cache), Ok(()));
    }
}

#[test]
fn a_process_killed_at_any_moment_leaves_nothing_wrong_and_no_lock() {
    let directory = tempfile::tempdir().unwrap();
    for kill in 0..12 {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "--ignored", "caches::disk::tests::directory::fill_until_killed"])
            .env(KILLED_IN, directory.path())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let start = Instant::now();
        while !directory.path().join("begun").exists() {
            assert!(start.elapsed() < DEADLINE, "it does not begin");
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(3 * kill));
        assert_eq!(child.try_wait().unwrap(), None, "it works until it is killed");
        child.kill().unwrap();
        child.wait().unwrap();
        std::fs::remove_file(directory.path().join("begun")).unwrap();
        let tier = Arc::new(DiskTier::open(directory.path(), 1 << 20).unwrap());
        let cache = cached(&tier);
        let found = tier.stats().tiles;
        assert!(found > 0);
        assert_eq!((0..169).filter(|&n| read(&cache, page(n))).count() as u64, found);
        assert_eq!(tier.stats().failures, 0);
    }
}

/// What the test above kills.
#[test]
#[ignore = "runs until it is killed; another test starts it"]
fn fill_until_killed() {
    let Some(directory) = std::env::var_os(KILLED_IN) else { return };
    let cache = cached(&Arc::new(DiskTier::open(&directory, 70 << 10).unwrap()));
    for n in 0u32..500_000 {
        read(&cache, page((n.wrapping_mul(0x9e37_79b1) >> 8) % 169));
        if n == 200 {
            std::fs::write(std::path::Path::new(&directory).join("begun"), "").unwrap();
        }
    }
}
