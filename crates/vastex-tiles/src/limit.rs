//! How many reads of a source may be under way at once: a decorator, which sources may share.

use std::collections::BTreeMap;
use std::future::poll_fn;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Poll, Waker};

use vastex_core::{Description, PagePos};

use crate::source::{ReadFuture, TileSource};

/// At most so many reads at once, of all [`LimitedSource`]s that have it.
///
/// Sources that lie in one place (a server, a network drive, a disk that seeks) should share one, since a place that does not
/// answer one of them answers none.
#[derive(Debug)]
pub struct ReadLimit {
    reads: usize,
    is_blocking: bool,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    under_way: usize,
    /// Reads that wait, in the order in which they came.
    waiting: BTreeMap<u64, Waker>,
    came: u64,
}

impl ReadLimit {
    /// A limit of so many reads, at least 1.
    pub fn new(reads: usize) -> Arc<ReadLimit> {
        Arc::new(ReadLimit { reads: reads.max(1), is_blocking: false, state: Mutex::default() })
    }

    /// The same for reads that block their threads, as those past the system's cache do: a loader then has as many threads for them,
    /// beside those that it is told to have. These threads decode what they have read, too, so as many tiles may be decoded at once as
    /// reads come back together. That holds behind other limits as well ([`TileSource::blocks`]). While 256 of a
    /// loader's reads block or wait, a source begins one only where it has none under way.
    pub fn blocking(reads: usize) -> Arc<ReadLimit> {
        Arc::new(ReadLimit { reads: reads.max(1), is_blocking: true, state: Mutex::default() })
    }

    /// Reads that may be under way at once.
    pub fn reads(&self) -> usize {
        self.reads
    }

    /// Whether it is one of reads that block their threads; see [`ReadLimit::blocking`].
    pub fn is_blocking(&self) -> bool {
        self.is_blocking
    }

    /// Reads that are under way now.
    pub fn under_way(&self) -> usize {
        self.state().under_way
    }

    /// Nothing that is done behind the lock can panic half-way.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until a read may begin. It ends when the permit is dropped.
    pub(crate) async fn permit(&self) -> Permit<'_> {
        let mut waiting = Waiting { limit: self, number: None };
        poll_fn(|context| {
            let mut state = self.state();
            if state.under_way < self.reads {
                state.under_way += 1;
                waiting.leave(&mut state);
                return Poll::Ready(Permit(self));
            }
            let number = *waiting.number.get_or_insert_with(|| {
                state.came += 1;
                state.came
            });
            state.waiting.insert(number, context.waker().clone());
            Poll::Pending
        })
        .await
    }

    /// Wakes the read that has waited longest, if one could begin now.
    fn wake_next(&self) {
        let state = self.state();
        let next = state.waiting.values().next().filter(|_| state.under_way < self.reads).cloned();
        drop(state);
        // Outside the lock, which whoever wakes up asks for.
        next.into_iter().for_each(Waker::wake);
    }
}

/// A place among those that wait; it is given up when the read begins or is dropped.
struct Waiting<'a> {
    limit: &'a ReadLimit,
    number: Option<u64>,
}

impl Waiting<'_> {
    fn leave(&mut self, state: &mut State) {
        self.number.take().map(|number| state.waiting.remove(&number));
    }
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        let limit = self.limit;
        self.leave(&mut limit.state());
        // It may have been the one that was woken, or there is room for another, too.
        limit.wake_next();
    }
}

/// A read that is under way, until this is dropped.
pub(crate) struct Permit<'a>(&'a ReadLimit);

impl Drop for Permit<'_> {
    fn drop(&mut self) {
        self.0.state().under_way -= 1;
        self.0.wake_next();
    }
}

/// A decorator that lets only so many reads of a source be under way at once; the others wait, without a thread.
///
/// It belongs behind caches, so that what they have waits for nothing: `RamCache(DiskCache(LimitedSource(source)))`. The
/// [`Loader`](crate::Loader) knows of it ([`TileSource::read_limit`]) and begins no more reads than can go on, so that those which
/// wait stay in its order.
#[derive(Debug)]
pub struct LimitedSource<S> {
    source: S,
    limit: Arc<ReadLimit>,
}

impl<S: TileSource> LimitedSource<S> {
    /// `source`, with at most as many reads at once as `limit` allows all those that share it.
    pub fn new(source: S, limit: Arc<ReadLimit>) -> LimitedSource<S> {
        LimitedSource { source, limit }
    }
}

impl<S: TileSource> TileSource for LimitedSource<S> {
    fn behind(&self) -> Option<&dyn TileSource> {
        Some(&self.source)
    }

    fn description(&self) -> &Arc<Description> {
        self.source.description()
    }

    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        Some(&self.limit)
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            let _permit = self.limit.permit().await;
            self.source.read(pos).await
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::task::{Context, Wake};

    use pollster::block_on;
    use proptest::prelude::*;
    use vastex_core::{Geometry, GeometrySpec};

    use super::*;
    use crate::conformance;
    use crate::faults::{Faults, Injection};
    use crate::property::PropertySource;

    fn source() -> PropertySource {
        let spec = GeometrySpec { page: 8, border: 1, ..GeometrySpec::image(100, 100) };
        PropertySource::new(Geometry::new(spec).unwrap())
    }

    fn page(x: u32) -> PagePos {
        PagePos::new_2d(0, x % 13, x / 13)
    }

    /// Counts how often it is woken.
    #[derive(Default)]
    struct Woken(AtomicUsize);

    impl Wake for Woken {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Ordering::SeqCst);
        }
    }

    #[test]
    fn a_limit_changes_no_tile() {
        assert_eq!(conformance(&LimitedSource::new(source(), ReadLimit::new(1))), Ok(()));
        assert_eq!(ReadLimit::new(0).reads(), 1);
    }

    #[test]
    fn sources_that_share_a_limit_take_turns_in_the_order_they_came() {
        let limit = ReadLimit::new(2);
        let slow = || Faults::new(source(), |_, _| Some(Injection::Suspend(1)));
        let sources = [slow(), slow()].map(|slow| LimitedSource::new(slow, limit.clone()));
        let wakers = [(); 5].map(|()| Arc::new(Woken::default()));
        let mut reads: Vec<_> = (0..5).map(|n| Some(sources[n % 2].read(page(n as u32)))).collect();
        let mut poll = |n: usize| {
            let waker = Waker::from(wakers[n].clone());
            let ready = reads[n].as_mut().unwrap().as_mut().poll(&mut Context::from_waker(&waker)).is_ready();
            if ready {
                reads[n] = None;
            }
            ready
        };
        assert!((0..5).all(|n| !poll(n)));
        let begun = || [sources[0].source.reads(), sources[1].source.reads()];
        assert_eq!((begun(), limit.under_way()), ([1, 1], 2));
        assert!(poll(1) && wakers[2].0.load(Ordering::SeqCst) == 1, "the first that waits is woken");
        assert!(!poll(2) && !poll(3), "there is room for one alone");
        assert_eq!(begun(), [2, 1]);
        assert!(poll(0) && poll(2));
        assert!(!poll(4) && !poll(3) && poll(4) && poll(3));
        assert_eq!(limit.under_way(), 0);
    }

    proptest! {
        /// Polls and drops in any order: never more at once than may be, and whoever is woken last can go on.
        #[test]
        fn no_wake_is_lost_and_no_permit_either(most in 1usize..4, steps in prop::collection::vec((0usize..8, any::<bool>()), 0..60)) {
            let limit = ReadLimit::new(most);
            let slow = Faults::new(source(), |_, _| Some(Injection::Suspend(2)));
            let limited = LimitedSource::new(slow, limit.clone());
            let wakers: Vec<_> = (0..8).map(|_| Arc::new(Woken::default())).collect();
            let mut reads: Vec<_> = (0..8).map(|n| Some(limited.read(page(n)))).collect();
            for (n, is_dropped) in steps {
                let waker = Waker::from(wakers[n].clone());
                let ready = |read: &mut ReadFuture<'_>| read.as_mut().poll(&mut Context::from_waker(&waker)).is_ready();
                if is_dropped || reads[n].as_mut().is_some_and(ready) {
                    reads[n] = None;
                }
                prop_assert!(limit.under_way() <= most);
            }
            // From here on only those are polled that were woken, as an executor does; the first poll counts as a wake.
            for waker in &wakers {
                waker.0.fetch_add(1, Ordering::SeqCst);
            }
            while let Some(n) = (0..8).find(|&n| reads[n].is_some() && wakers[n].0.swap(0, Ordering::SeqCst) > 0) {
                let waker = Waker::from(wakers[n].clone());
                if reads[n].as_mut().unwrap().as_mut().poll(&mut Context::from_waker(&waker)).is_ready() {
                    reads[n] = None;
                }
            }
            prop_assert!(reads.iter().all(Option::is_none), "every read ends");
            prop_assert_eq!(limit.under_way(), 0);
            block_on(limited.read(page(20))).unwrap();
        }
    }
}
