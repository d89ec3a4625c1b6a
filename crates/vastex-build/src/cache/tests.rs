//! What a cache keeps, and what it does not: with real images, several programs as threads, and a build that
//! is stopped.

use std::cell::Cell;
use std::fs;
use std::ops::ControlFlow;
use std::sync::Barrier;
use std::time::{Duration, UNIX_EPOCH};

use tempfile::TempDir;
use vastex_tiles::{Compression, ends_within};

use super::*;

const PLENTY: u64 = 1 << 30;
/// Longer than any test takes on any machine.
const PATIENCE: Duration = Duration::from_secs(300);

/// A directory with an image in it, and one for a cache beside it.
struct Place {
    directory: TempDir,
}

impl Place {
    fn new() -> Place {
        Place { directory: tempfile::tempdir().unwrap() }
    }

    /// Noise, so that no tile is like another or small.
    fn write(&self, name: &str, side: u32, seed: u32) -> PathBuf {
        let mut state = seed.wrapping_mul(0x9e37_79b9) | 1;
        let next = || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state as u8
        };
        let texels: Vec<u8> = std::iter::repeat_with(next).take((side * side * 4) as usize).collect();
        let path = self.directory.path().join(name);
        let mut encoder = png::Encoder::new(File::create(&path).unwrap(), side, side);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_compression(png::Compression::NoCompression);
        encoder.write_header().unwrap().write_image_data(&texels).unwrap();
        path
    }

    fn cache(&self, budget: u64) -> BuildCache {
        BuildCache::new(self.directory.path().join("cache"), budget)
    }

    /// What lies in the cache: containers and all files but locks.
    fn count(&self) -> [usize; 2] {
        let entries = fs::read_dir(self.directory.path().join("cache"));
        let mut names: Vec<_> =
            entries.into_iter().flatten().map(|entry| entry.unwrap().file_name()).collect();
        names.retain(|name| !name.to_string_lossy().ends_with(".lock"));
        let is_container = |name: &&std::ffi::OsString| !name.to_string_lossy().starts_with('.');
        [names.iter().filter(is_container).count(), names.len()]
    }
}

fn options() -> BuildOptions {
    BuildOptions { compression: Compression::None, threads: 1, ..BuildOptions::default() }
}

fn is_built(cache: &BuildCache, image: &Path) -> bool {
    cache.open(image, &options(), &()).unwrap().built.is_some()
}

#[test]
fn an_image_is_built_once_and_anew_when_it_changes() {
    let place = Place::new();
    let (cache, image) = (place.cache(PLENTY), place.write("a.png", 200, 1));
    assert!(is_built(&cache, &image) && !is_built(&cache, &image));
    let container = cache.open(&image, &options(), &()).unwrap().container;
    assert_eq!(container.info().description.geometry.size(), [200, 200, 1]);
    let later = fs::metadata(&image).unwrap().modified().unwrap() + Duration::from_secs(1);
    File::options().write(true).open(&image).unwrap().set_modified(later).unwrap();
    assert!(is_built(&cache, &image) && !is_built(&cache, &image), "another time");
    // As long as before, and of the same time.
    place.write("a.png", 200, 2);
    File::options().write(true).open(&image).unwrap().set_modified(later).unwrap();
    assert!(is_built(&cache, &image), "other bytes");
    let wrapped = BuildOptions { address: [vastex_core::AddressMode::Wrap; 2], ..options() };
    assert!(cache.open(&image, &wrapped, &()).unwrap().built.is_some(), "another option");
    // Only what belongs to the cache lies in it, and nothing beside the image.
    assert_eq!((place.count(), fs::read_dir(place.directory.path()).unwrap().count()), ([4, 4], 2));
}

#[test]
fn what_was_not_opened_for_longest_goes_where_there_is_too_much() {
    let place = Place::new();
    let images = ["a.png", "b.png", "c.png"].map(|name| place.write(name, 200, 3));
    let cache = place.cache(PLENTY);
    let long_ago = |n: u64| SystemTime::now() - Duration::from_secs(1000 * n);
    let [a, b] = [0, 1].map(|n| {
        assert!(is_built(&cache, &images[n]));
        let paths = fs::read_dir(cache.directory()).unwrap().map(|entry| entry.unwrap().path());
        let containers = paths.filter(|path| path.extension().is_some_and(|ending| ending == "vastex"));
        containers.max_by_key(|path| fs::metadata(path).unwrap().created().unwrap_or(UNIX_EPOCH)).unwrap()
    });
    for (path, n) in [(&a, 2), (&b, 1)] {
        let times = FileTimes::new().set_accessed(long_ago(n)).set_modified(long_ago(n));
        File::options().write(true).open(path).unwrap().set_times(times).unwrap();
    }
    fs::write(cache.directory().join("notes.txt"), [0; 100]).unwrap();
    assert!(!is_built(&cache, &images[0]), "opened now: the other one is older");
    let two = fs::metadata(&a).unwrap().len() * 5 / 2;
    let small = place.cache(two);
    assert!(is_built(&small, &images[2]));
    assert_eq!((a.exists(), b.exists(), place.count()[0]), (true, false, 3), "two, and a file of somebody's");
    // What is opened stays, however small the budget.
    assert!(is_built(&place.cache(0), &images[1]));
    assert_eq!(place.count()[0], 2);
}

#[test]
fn a_damaged_container_is_built_anew() {
    let place = Place::new();
    let (cache, image) = (place.cache(PLENTY), place.write("a.png", 100, 4));
    assert!(is_built(&cache, &image));
    let mut paths = fs::read_dir(cache.directory()).unwrap().map(|entry| entry.unwrap().path());
    let container = paths.find(|path| path.extension().is_some_and(|ending| ending == "vastex")).unwrap();
    fs::write(&container, b"nothing of the kind").unwrap();
    assert!(is_built(&cache, &image) && !is_built(&cache, &image));
}

/// Stops a build after some rows.
struct StopsAt(Cell<u64>);

impl Progress for StopsAt {
    fn advance(&self, rows: u64, _: u64, _: u64) -> ControlFlow<()> {
        if rows >= self.0.get() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn a_build_that_was_stopped_goes_on() {
    let place = Place::new();
    let (cache, image) = (place.cache(PLENTY), place.write("a.png", 2000, 5));
    let stopped = cache.open(&image, &options(), &StopsAt(Cell::new(1700)));
    assert!(matches!(stopped, Err(CacheError::Build(BuildError::Cancelled))), "{stopped:?}");
    assert_eq!(place.count()[0], 0);
    let built = cache.open(&image, &options(), &()).unwrap().built.unwrap();
    assert!(built.resumed_tiles > 100, "{}", built.resumed_tiles);
    assert_eq!(place.count(), [1, 1]);
}

#[test]
fn programs_that_want_the_same_image_build_it_once() {
    let at_once = || {
        let place = Place::new();
        let (cache, image) = (place.cache(PLENTY), place.write("a.png", 1500, 6));
        let begin = Barrier::new(4);
        let built = std::thread::scope(|scope| {
            let open = || {
                begin.wait();
                cache.open(&image, &options(), &()).unwrap().built.is_some()
            };
            let threads = [0; 4].map(|_| scope.spawn(open));
            threads.map(|thread| thread.join().unwrap())
        });
        (built, place.count())
    };
    // Each waits until the one that has the lock is done.
    let (built, count) = ends_within(PATIENCE, at_once).unwrap();
    assert_eq!(built.into_iter().filter(|&built| built).count(), 1, "{built:?}");
    assert_eq!(count, [1, 1]);
}

#[test]
fn of_what_is_no_image_nothing_stays() {
    let place = Place::new();
    let (cache, image) = (place.cache(PLENTY), place.write("a.png", 300, 7));
    let bytes = fs::read(&image).unwrap();
    fs::write(&image, &bytes[..bytes.len() / 2]).unwrap();
    let refused = cache.open(&image, &options(), &()).unwrap_err().to_string();
    assert!(refused.contains("a.png") && refused.contains("truncated"), "{refused}");
    assert_eq!(place.count(), [0, 0]);
    let nowhere = BuildCache::new(image.join("cache"), PLENTY);
    let whole = place.write("b.png", 10, 8);
    let refused = nowhere.open(&whole, &options(), &()).unwrap_err();
    assert!(matches!(refused, CacheError::Unusable { .. }), "{refused}");
}

/// Waits for another program, and stops waiting after some looks.
struct Waits(Cell<u32>);

impl Progress for Waits {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        panic!("nothing is built here")
    }

    fn wait(&self) -> ControlFlow<()> {
        self.0.set(self.0.get() + 1);
        if self.0.get() > 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn what_another_program_makes_is_waited_for_and_never_removed() {
    let place = Place::new();
    let (cache, image) = (place.cache(PLENTY), place.write("a.png", 2000, 9));
    let _ = cache.open(&image, &options(), &StopsAt(Cell::new(1700)));
    let unfinished = place.count();
    let mut paths = fs::read_dir(cache.directory()).unwrap().map(|entry| entry.unwrap().path());
    let lock = paths.find(|path| path.to_string_lossy().ends_with(".lock")).unwrap();
    let lock = File::options().append(true).open(lock).unwrap();
    lock.lock().unwrap();
    let waits = Waits(Cell::new(0));
    let stopped = cache.open(&image, &options(), &waits);
    assert!(matches!(stopped, Err(CacheError::Build(BuildError::Cancelled))), "{stopped:?}");
    assert_eq!(waits.0.get(), 4);
    // However small the budget of another image.
    let other = place.write("b.png", 50, 10);
    assert!(is_built(&place.cache(0), &other));
    assert_eq!(place.count(), [1, unfinished[1] + 1]);
    drop(lock);
    // Nobody is at it any more: what was left goes, its journal too.
    assert!(is_built(&place.cache(0), &place.write("c.png", 50, 11)));
    assert_eq!(place.count(), [1, 1]);
}

/// Locks that lie in the cache.
#[cfg(unix)]
fn locks(cache: &BuildCache) -> Vec<PathBuf> {
    let paths = fs::read_dir(cache.directory()).unwrap().map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|ending| ending == "lock")).collect()
}

#[cfg(unix)]
#[test]
fn of_locks_those_stay_that_somebody_holds() {
    let place = Place::new();
    let cache = place.cache(PLENTY);
    assert!(is_built(&cache, &place.write("a.png", 20, 15)));
    assert!(locks(&cache).is_empty(), "nobody builds any more");
    let lie = |name: &str| {
        let path = cache.directory().join(name);
        fs::write(&path, b"").unwrap();
        path
    };
    let keys = ["0", "1"].map(|digit| digit.repeat(32));
    let [held, left] = keys.map(|key| lie(&format!(".{key}.vastex.lock")));
    let others = [lie("somebody.lock"), lie(".short.vastex.lock")];
    let lock = File::options().append(true).open(&held).unwrap();
    lock.lock().unwrap();
    assert!(is_built(&cache, &place.write("b.png", 20, 16)));
    assert_eq!(
        (held.exists(), left.exists(), others.iter().all(|other| other.exists())),
        (true, false, true)
    );
    drop(lock);
    assert!(is_built(&cache, &place.write("c.png", 20, 17)));
    assert!(!held.exists());
}

/// One program has opened a lock's file, and another removes that before the first one has the lock.
#[cfg(unix)]
#[test]
fn a_lock_that_was_removed_keeps_nobody_out_and_two_never_have_it_at_once() {
    use std::sync::atomic::{AtomicBool, Ordering};

    let place = Place::new();
    let directory = place.directory.path();
    let name = room::name_of(7);
    let (is_held, is_over) = (AtomicBool::new(false), AtomicBool::new(false));
    let take = || {
        let mut taken = 0;
        while taken < 100 {
            let Lock::Ours(lock) = room::lock(directory, &name).unwrap() else { continue };
            assert!(!is_held.swap(true, Ordering::SeqCst), "two have it at once");
            std::thread::yield_now();
            is_held.store(false, Ordering::SeqCst);
            drop(lock);
            taken += 1;
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !is_over.load(Ordering::SeqCst) {
                room::make(directory, PLENTY, "");
            }
        });
        let takers = [0; 2].map(|_| scope.spawn(take));
        let taken = takers.map(|taker| taker.join().is_ok());
        is_over.store(true, Ordering::SeqCst);
        assert_eq!(taken, [true; 2]);
    });
    room::make(directory, PLENTY, "");
    assert_eq!(fs::read_dir(directory).unwrap().count(), 0);
}

#[test]
fn a_mask_is_part_of_the_image() {
    let place = Place::new();
    let (cache, image) = (place.cache(PLENTY), place.write("a.png", 300, 12));
    let masked =
        |mask: &str, seed: u32| BuildOptions { mask: Some(place.write(mask, 300, seed)), ..options() };
    let is_built = |options: &BuildOptions| cache.open(&image, options, &()).unwrap().built.is_some();
    let (one, other) = (masked("one.png", 13), masked("other.png", 14));
    assert!(is_built(&one) && is_built(&other) && !is_built(&one));
}
