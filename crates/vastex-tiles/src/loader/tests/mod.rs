//! Both loaders keep the same promises; what only threads can break is tested on threads.
//!
//! Nothing here waits without a limit: what does not come fails after [`DEADLINE`], which is far beyond what
//! any machine needs.

mod blocking;
mod frames;
mod ranks;
mod silence;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, mpsc};
use std::time::{Duration, Instant};

use proptest::prelude::*;
use vastex_core::{Description, Dims, Geometry, GeometrySpec, PageId, PagePos, TextureNumber};

use super::{Clock, LoadError, Loaded, Loader, LoaderSettings};
use crate::sources::PropertySource;
use crate::sources::{ReadFuture, TileSource};
use crate::testing::{FaultRates, Faults, Injection};

/// What takes longer than this never comes.
const DEADLINE: Duration = Duration::from_secs(120);

/// Looks every millisecond until there is something.
fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(start.elapsed() < DEADLINE, "{what}: nothing in {DEADLINE:?}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Does something that might never end, on a thread of its own.
fn in_time<T: Send + 'static>(what: &str, work: impl FnOnce() -> T + Send + 'static) -> T {
    let (done, end) = mpsc::channel();
    std::thread::spawn(move || drop(done.send(work())));
    end.recv_timeout(DEADLINE).unwrap_or_else(|error| panic!("{what}: {error}"))
}

/// A clock that stands still until it is told to go on.
#[derive(Default)]
pub(super) struct FakeClock(Mutex<Duration>);

impl FakeClock {
    fn pass(&self, time: Duration) {
        *self.0.lock().unwrap() += time;
    }
}

impl Clock for FakeClock {
    fn now(&self) -> Duration {
        *self.0.lock().unwrap()
    }
}

fn source() -> PropertySource {
    PropertySource::new(Geometry::new(GeometrySpec { page: 10, ..GeometrySpec::image(300, 300) }).unwrap())
}

fn texture(number: u16) -> TextureNumber {
    TextureNumber::new(number).unwrap()
}

fn page(x: u32) -> PageId {
    PageId::new(texture(0), Dims::D2, PagePos::new_2d(0, x % 30, x / 30)).unwrap()
}

/// A source whose reads wait until the gate is opened, and which notes what was read.
struct Gated {
    inner: PropertySource,
    open: Mutex<bool>,
    opened: Condvar,
    begun: Mutex<Vec<u32>>,
}

impl Gated {
    fn closed() -> Arc<Gated> {
        Arc::new(Gated {
            inner: source(),
            open: Mutex::default(),
            opened: Condvar::new(),
            begun: Mutex::default(),
        })
    }

    fn open(&self) {
        *self.open.lock().unwrap() = true;
        self.opened.notify_all();
    }

    fn wait_until_begun(&self, reads: usize) {
        until("reads begin", || (self.begun.lock().unwrap().len() >= reads).then_some(()));
    }
}

impl TileSource for Gated {
    fn description(&self) -> &Arc<Description> {
        self.inner.description()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        self.begun.lock().unwrap().push(pos.x);
        let waited = self.opened.wait_timeout_while(self.open.lock().unwrap(), DEADLINE, |open| !*open);
        assert!(*waited.unwrap().0, "nobody opens the gate");
        self.inner.read(pos)
    }
}

fn drain(loader: &mut Loader) -> BTreeMap<PageId, Vec<String>> {
    let mut ends: BTreeMap<PageId, Vec<String>> = BTreeMap::new();
    while let Some(Loaded { page, result }) = loader.wait() {
        ends.entry(page).or_default().push(match result {
            Ok(bytes) => bytes.len().to_string(),
            Err(error) => error.to_string(),
        });
    }
    ends
}

/// The same promises for both loaders.
macro_rules! promises {
    ($name:ident, $loader:path) => {
        mod $name {
            use super::*;
            use $loader as AnyLoader;

            fn loader(source: impl TileSource + 'static) -> AnyLoader {
                let mut loader = AnyLoader::new(2).unwrap();
                loader.add_source(texture(0), Arc::new(source));
                loader
            }

            #[test]
            fn tiles_come_decoded() {
                let mut loader = loader(source());
                (0..20).for_each(|x| loader.request(page(x), 0));
                let mut pages = Vec::new();
                while let Some(loaded) = loader.wait() {
                    assert_eq!(loaded.result.unwrap().len(), 18 * 18 * 4);
                    pages.push(loaded.page);
                }
                pages.sort();
                assert_eq!(pages, (0..20).map(page).collect::<Vec<_>>());
                assert_eq!(loader.outstanding(), 0);
                assert!(loader.poll().is_none());
            }

            #[test]
            fn failures_say_why() {
                let faults = [Injection::Fail, Injection::Corrupt, Injection::NoSuchTile];
                let mut loader = loader(Faults::new(source(), move |pos, _| faults.get(pos.x as usize).cloned()));
                let elsewhere = PageId::new(texture(7), Dims::D2, PagePos::new_2d(0, 0, 0)).unwrap();
                (0..3).for_each(|x| loader.request(page(x), 0));
                loader.request(elsewhere, 0);
                let mut ends = BTreeMap::new();
                while let Some(loaded) = loader.wait() {
                    ends.insert(loaded.page, loaded.result.unwrap_err().to_string());
                }
                let contains = |page, text: &str| assert!(ends[&page].contains(text), "{ends:?}");
                contains(page(0), "a planned failure");
                contains(page(1), "does not decode");
                contains(page(2), "no such tile");
                contains(elsewhere, "texture 7 has no source");
            }

            proptest! {
                #![proptest_config(ProptestConfig::with_cases(32))]

                #[test]
                fn every_request_ends_exactly_once(ops in prop::collection::vec((0u32..12, 0u8..8), 0..200), seed: u64) {
                    let rates = FaultRates { fail: 0.1, corrupt: 0.1, suspend: (0.4, 3), ..FaultRates::default() };
                    let mut loader = loader(Faults::seeded(source(), seed, rates));
                    // Requests and ends of each page; a request counts while none is open that could still be
                    // loaded.
                    let mut open = BTreeMap::<PageId, i32>::new();
                    let mut cancelled = BTreeMap::<PageId, bool>::new();
                    for (x, op) in ops {
                        let page = page(x);
                        match op {
                            0..=3 => {
                                let waiting = *open.entry(page).or_default();
                                if waiting == 0 || cancelled[&page] && waiting == 1 {
                                    *open.entry(page).or_default() += 1;
                                    cancelled.insert(page, false);
                                    loader.request(page, u64::from(op));
                                }
                            }
                            4 | 5 => {
                                if open.get(&page) == Some(&1) {
                                    loader.cancel(page);
                                    cancelled.insert(page, true);
                                }
                            }
                            _ => {
                                if let Some(loaded) = loader.poll() {
                                    *open.get_mut(&loaded.page).unwrap() -= 1;
                                }
                            }
                        }
                        prop_assert_eq!(loader.outstanding() as i32, open.values().sum::<i32>());
                    }
                    while let Some(loaded) = loader.wait() {
                        let open = open.get_mut(&loaded.page).unwrap();
                        *open -= 1;
                        prop_assert!(*open >= 0);
                    }
                    prop_assert!(open.values().all(|&open| open == 0), "{:?}", open);
                }
            }
        }
    };
}

promises!(on_threads, crate::Loader);
promises!(on_the_event_loop, crate::LocalLoader);

#[test]
fn the_best_rank_goes_first_even_if_it_changes() {
    let gated = Gated::closed();
    let mut loader = Loader::new(1).unwrap();
    loader.add_source(texture(0), gated.clone());
    loader.request(page(0), 0);
    gated.wait_until_begun(1);
    for (x, rank) in [(1, 30), (2, 20), (3, 10), (4, 20)] {
        loader.request(page(x), rank);
    }
    loader.request(page(1), 5);
    gated.open();
    assert_eq!(drain(&mut loader).len(), 5);
    assert_eq!(*gated.begun.lock().unwrap(), [0, 1, 3, 2, 4]);
}

#[test]
fn what_is_cancelled_is_not_begun_or_its_result_is_dropped() {
    let gated = Gated::closed();
    let mut loader = Loader::new(1).unwrap();
    loader.add_source(texture(0), gated.clone());
    (0..3).for_each(|x| loader.request(page(x), u64::from(x)));
    gated.wait_until_begun(1);
    loader.cancel(page(0));
    loader.cancel(page(1));
    loader.cancel(page(9));
    let ended = loader.poll().unwrap();
    assert!(ended.page == page(1) && matches!(ended.result, Err(LoadError::Cancelled)));
    assert!(loader.poll().is_none(), "a read under way ends when it ends");
    assert_eq!(loader.outstanding(), 2);
    // Asked for again while the called-off read still runs: both end.
    loader.request(page(0), 9);
    gated.open();
    let ends = drain(&mut loader);
    assert_eq!(ends[&page(0)], ["cancelled", "1296"]);
    assert_eq!(ends[&page(2)], ["1296"]);
    assert_eq!(*gated.begun.lock().unwrap(), [0, 2, 0]);
}

#[test]
fn a_texture_that_goes_takes_its_requests_along() {
    let gated = Gated::closed();
    let mut loader = Loader::new(1).unwrap();
    loader.add_source(texture(0), gated.clone());
    (0..5).for_each(|x| loader.request(page(x), 0));
    gated.wait_until_begun(1);
    loader.remove_source(texture(0));
    gated.open();
    let ends = drain(&mut loader);
    assert!(ends.len() == 5 && ends.values().all(|ends| *ends == ["cancelled"]), "{ends:?}");
    loader.request(page(0), 0);
    assert_eq!(drain(&mut loader)[&page(0)], ["texture 0 has no source"]);
}

#[test]
fn a_source_that_panics_fails_and_the_loader_goes_on() {
    let panics = Faults::new(source(), |pos, _| (pos.x % 2 == 0).then_some(Injection::Panic));
    let mut loader = Loader::new(1).unwrap();
    loader.add_source(texture(0), Arc::new(panics));
    (0..6).for_each(|x| loader.request(page(x), 0));
    let ends = drain(&mut loader);
    assert_eq!(ends[&page(2)], ["level 0 page 2,0: its source panicked: a planned panic"]);
    assert_eq!(ends[&page(3)], ["1296"]);
}

/// Counts how many reads are under way at once.
struct Counting(PropertySource, AtomicUsize, AtomicUsize);

impl TileSource for Counting {
    fn description(&self) -> &Arc<Description> {
        self.0.description()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let now = self.1.fetch_add(1, Ordering::SeqCst) + 1;
        self.2.fetch_max(now, Ordering::SeqCst);
        std::thread::sleep(Duration::from_millis(2));
        self.1.fetch_sub(1, Ordering::SeqCst);
        self.0.read(pos)
    }
}

#[test]
fn so_many_reads_are_under_way_and_no_more() {
    let counting = Arc::new(Counting(source(), AtomicUsize::new(0), AtomicUsize::new(0)));
    // No time passes, so that none is slow on a slow machine.
    let settings = LoaderSettings { threads: 3, ..LoaderSettings::default() };
    let mut loader = Loader::with(settings, Arc::new(FakeClock::default())).unwrap();
    loader.add_source(texture(0), counting.clone());
    (0..40).for_each(|x| loader.request(page(x), 0));
    assert_eq!(drain(&mut loader).len(), 40);
    let most = counting.2.load(Ordering::SeqCst);
    assert!((2..=3).contains(&most), "{most}");
}

#[test]
fn threads_end_with_the_loader() {
    let source = Arc::new(source());
    let mut loader = Loader::new(4).unwrap();
    loader.add_source(texture(0), source.clone());
    (0..100).for_each(|x| loader.request(page(x), 0));
    drop(loader);
    until("reads under way end", || (Arc::strong_count(&source) == 1).then_some(()));
}

#[test]
fn a_source_is_free_when_its_last_request_has_ended() {
    let source = Arc::new(source());
    for _ in 0..50 {
        let mut loader = Loader::new(4).unwrap();
        loader.add_source(texture(0), source.clone());
        (0..20).for_each(|x| loader.request(page(x), 0));
        assert_eq!(drain(&mut loader).len(), 20);
        drop(loader);
        assert_eq!(Arc::strong_count(&source), 1);
    }
}
