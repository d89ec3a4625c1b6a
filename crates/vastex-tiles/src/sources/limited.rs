//! A decorator that lets only so many reads of a source be under way at once. Reads are counted by
//! [`ReadLimit`].

use std::sync::Arc;

use vastex_core::{Description, PagePos};

use super::{ReadFuture, TileSource};
use crate::stores::ReadLimit;

/// A decorator that lets only so many reads of a source be under way at once; further reads wait, without a
/// thread.
///
/// It belongs behind caches, so that a tile in a cache waits for nothing:
/// `RamCache(DiskCache(LimitedSource(source)))`. The loader asks for the limit
/// ([`TileSource::read_limit`]) and begins no more reads than can go on, so that requests beyond the limit
/// stay in its order.
#[derive(Debug)]
pub struct LimitedSource<S> {
    source: S,
    limit: Arc<ReadLimit>,
}

impl<S: TileSource> LimitedSource<S> {
    /// Puts `limit` before `source`: at most as many reads at once as the limit allows all sources that share
    /// it.
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
    use std::task::{Context, Wake, Waker};

    use pollster::block_on;
    use proptest::prelude::*;
    use vastex_core::{Geometry, GeometrySpec};

    use super::*;
    use crate::PropertySource;
    use crate::testing::{Faults, Injection, conformance};

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
            // From here on only those are polled that were woken, as an executor does; the first poll counts
            // as a wake.
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
