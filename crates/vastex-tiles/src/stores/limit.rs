//! How many reads of one place may be under way at once. Stores and sources in one place share a limit.

use std::collections::BTreeMap;
use std::future::poll_fn;
use std::sync::{Arc, Mutex};
use std::task::{Poll, Waker};

use crate::ground::sync::lock;

/// At most so many reads at once, of all stores and [`LimitedSource`](crate::LimitedSource)s that have it.
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
    /// reads come back together. That holds behind other limits as well ([`TileSource::blocks`](crate::TileSource::blocks)). While 256 of a
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
        lock(&self.state).under_way
    }

    /// Waits until a read may begin. It ends when the permit is dropped.
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
        self.leave(&mut lock(&limit.state));
        // It may have been the one that was woken, or there is room for another, too.
        limit.wake_next();
    }
}

/// A read that is under way, until this is dropped.
pub(crate) struct Permit<'a>(&'a ReadLimit);

impl Drop for Permit<'_> {
    fn drop(&mut self) {
        lock(&self.0.state).under_way -= 1;
        self.0.wake_next();
    }
}
