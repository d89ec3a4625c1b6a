//! Sources whose reads block, as they say: the loader has a thread for each, and none that others need.

use std::sync::Barrier;

use super::*;
use crate::sources::LimitedSource;
use crate::stores::ReadLimit;

/// Reads that come back only when so many are under way together.
struct Together {
    inner: PropertySource,
    meet: Barrier,
    under_way: AtomicUsize,
    most: AtomicUsize,
}

impl TileSource for Together {
    fn description(&self) -> &Arc<Description> {
        self.inner.description()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            let under_way = self.under_way.fetch_add(1, Ordering::SeqCst) + 1;
            self.most.fetch_max(under_way, Ordering::SeqCst);
            self.meet.wait();
            self.under_way.fetch_sub(1, Ordering::SeqCst);
            self.inner.read(pos).await
        })
    }
}

/// No time passes here, so no read lends its place because it has taken long.
#[test]
fn as_many_reads_block_at_once_as_the_source_says_whatever_the_threads() {
    const READS: usize = 6;
    for threads in [1, 2, 8] {
        let settings = LoaderSettings { threads, reads_at_once: 2, ..LoaderSettings::default() };
        let mut loader = Loader::with(settings, Arc::new(FakeClock::default())).unwrap();
        let (under_way, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let together = Arc::new(Together { inner: source(), meet: Barrier::new(READS), under_way, most });
        let limit = ReadLimit::blocking(READS);
        loader.add_source(texture(0), Arc::new(LimitedSource::new(together.clone(), limit)));
        (0..4 * READS as u32).for_each(|x| loader.request(page(x), 0));
        let ends = in_time("all of them come back", move || drain(&mut loader));
        assert_eq!(ends.len(), 4 * READS);
        assert!(ends.values().flatten().all(|end| end == "1296"), "{ends:?}");
        assert_eq!(together.most.load(Ordering::SeqCst), READS);
    }
}

/// A limit that says nothing of blocking stands before the one that does: it says how many, and no more.
#[test]
fn reads_block_behind_another_limit_and_caches_as_well() {
    const READS: usize = 4;
    let settings = LoaderSettings { threads: 1, reads_at_once: 2, ..LoaderSettings::default() };
    let mut loader = Loader::with(settings, Arc::new(FakeClock::default())).unwrap();
    let (under_way, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let together = Arc::new(Together { inner: source(), meet: Barrier::new(READS), under_way, most });
    let blocking = LimitedSource::new(together.clone(), ReadLimit::blocking(2 * READS));
    let limited = LimitedSource::new(crate::RamCache::new(blocking, 1 << 20), ReadLimit::new(READS));
    assert!(limited.blocks() && !limited.read_limit().unwrap().is_blocking());
    loader.add_source(texture(0), Arc::new(limited));
    (0..2 * READS as u32).for_each(|x| loader.request(page(x), 0));
    let ends = in_time("all of them come back", move || drain(&mut loader));
    assert!(ends.len() == 2 * READS && ends.values().flatten().all(|end| end == "1296"), "{ends:?}");
    assert_eq!(together.most.load(Ordering::SeqCst), READS);
}

#[test]
fn reads_that_block_leave_the_threads_to_others() {
    let settings = LoaderSettings { threads: 1, ..LoaderSettings::default() };
    let mut loader = Loader::with(settings, Arc::new(FakeClock::default())).unwrap();
    let gated = Gated::closed();
    loader.add_source(texture(0), Arc::new(LimitedSource::new(gated.clone(), ReadLimit::blocking(3))));
    loader.add_source(texture(1), Arc::new(source()));
    (0..5).for_each(|x| loader.request(page(x), 0));
    gated.wait_until_begun(3);
    let other = PageId::new(texture(1), Dims::D2, PagePos::new_2d(0, 0, 0)).unwrap();
    loader.request(other, 1);
    let (end, mut loader) = in_time("the other is read", move || (loader.wait().unwrap(), loader));
    assert!(end.page == other && end.result.is_ok());
    gated.open();
    assert_eq!(in_time("all are read", move || drain(&mut loader)).len(), 5);
}
