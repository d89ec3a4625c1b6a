//! How many reads of one place may be under way at once. Stores and sources that lie in one place share a
//! limit.

use std::collections::BTreeMap;
use std::future::poll_fn;
use std::sync::{Arc, Mutex};
use std::task::{Poll, Waker};

use crate::ground::sync::lock;

/// A bound on the reads under way at once, over all stores and [`LimitedSource`](crate::LimitedSource)s that
/// share it.
///
/// Sources that lie in one place (a server, a network drive, a disk that seeks) should share one limit, since
/// a place that does not answer one source answers none.
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
    /// A limit of `reads` reads at once, at least 1.
    pub fn new(reads: usize) -> Arc<ReadLimit> {
        Arc::new(ReadLimit { reads: reads.max(1), is_blocking: false, state: Mutex::default() })
    }

    /// A limit for reads that block their threads, as reads past the system's cache do: a loader then has
    /// `reads` threads for them, in addition to the threads that it is told to have, also if other limits
    /// stand before this one ([`TileSource::blocks`](crate::TileSource::blocks)). These threads also decode
    /// what they have read, so that up to `reads` tiles may be decoded at once. While 256 of a loader's reads
    /// block or wait, each source has its part of 256 under way, one at least.
    pub fn blocking(reads: usize) -> Arc<ReadLimit> {
        Arc::new(ReadLimit { reads: reads.max(1), is_blocking: true, state: Mutex::default() })
    }

    /// Reads that may be under way at once.
    pub fn reads(&self) -> usize {
        self.reads
    }

    /// Returns true if the limit is one of reads that block their threads, made by [`ReadLimit::blocking`].
    pub fn is_blocking(&self) -> bool {
        self.is_blocking
    }

    /// The number of reads that are under way now.
    pub fn under_way(&self) -> usize {
        lock(&self.state).under_way
    }

    /// Waits until a read may begin. The read counts as ended when the permit is dropped.
    pub(crate) async fn permit(&self) -> Permit<'_> {
        let mut waiting = Waiting { limit: self, number: None };
        poll_fn(|context| {
            let mut state = lock(&self.state);
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
        let state = lock(&self.state);
        let next = state.waiting.values().next().filter(|_| state.under_way < self.reads).cloned();
        drop(state);
        // Outside the lock, which whoever wakes up asks for.
        next.into_iter().for_each(Waker::wake);
    }
}

/// A turn among the reads that wait, given up when the read begins or is dropped.
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
        self.leave(&mut lock(&limit.state));
        // It may have been the one that was woken, or there is room for another, too.
        limit.wake_next();
    }
}

/// Counts a read as under way until it is dropped.
pub(crate) struct Permit<'a>(&'a ReadLimit);

impl Drop for Permit<'_> {
    fn drop(&mut self) {
        lock(&self.0.state).under_way -= 1;
        self.0.wake_next();
    }
}
