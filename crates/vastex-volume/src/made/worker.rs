//! Makes what is asked for, on a thread of the caller's.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};
use std::thread::{self, Thread};
use std::time::Duration;

use super::{Made, MadePos};
use crate::fault::SourceFault;

/// How often a thread that waits for another looks whether it is told to stop.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Lets the thread that makes something attend to other things.
pub(super) async fn pause() {
    let mut is_paused = false;
    std::future::poll_fn(|context| {
        if std::mem::replace(&mut is_paused, true) {
            return Poll::Ready(());
        }
        context.waker().wake_by_ref();
        Poll::Pending
    })
    .await;
}

/// Wakes the thread that makes something.
struct Signal {
    thread: Thread,
    is_woken: AtomicBool,
}

impl Wake for Signal {
    fn wake(self: Arc<Self>) {
        self.is_woken.store(true, Ordering::Release);
        self.thread.unpark();
    }
}

impl Made {
    /// Returns true if something is asked for, or being made.
    pub(crate) fn has_work(&self) -> bool {
        let state = self.lock();
        !state.asked.is_empty() || state.in_hand > 0
    }

    /// Makes what is asked for, the finest first, until nothing is left or `stop` is set, which is looked at
    /// before each brick of the finest made level. What was begun and not finished is asked for again.
    /// Returns at once where another thread works already: with two of them, each could wait for what the
    /// other has put aside.
    pub(crate) fn work(&self, stop: &AtomicBool) {
        let Ok(_alone) = self.working.try_lock() else { return };
        while !stop.load(Ordering::Relaxed)
            && let Some(task) = self.next(usize::MAX)
        {
            self.carry_out(task, stop);
        }
    }

    /// The next chunk that is asked for, of a level before this one. Those that are being made are left to
    /// who makes them: below a level that this thread makes, these are all that it could wait for in vain.
    fn next(&self, before: usize) -> Option<MadePos> {
        let mut state = self.lock();
        let task = state.asked.iter().copied().find(|(level, at)| {
            *level < before && !self.cache(*level).is_under_way(&self.key(*level, *at))
        })?;
        state.asked.remove(&task);
        state.in_hand += 1;
        Some(task)
    }

    fn carry_out(&self, task: MadePos, stop: &AtomicBool) {
        let is_done = self.follow(task, stop);
        let mut state = self.lock();
        state.in_hand -= 1;
        if !is_done {
            state.asked.insert(task);
        }
    }

    /// Makes a chunk. Returns true if it came to an end.
    fn follow(&self, task: MadePos, stop: &AtomicBool) -> bool {
        let (level, at) = task;
        let signal = Arc::new(Signal { thread: thread::current(), is_woken: AtomicBool::new(false) });
        let waker = Waker::from(signal.clone());
        let mut making = self.exact(level, at, true);
        loop {
            match making.as_mut().poll(&mut Context::from_waker(&waker)) {
                Poll::Ready(made) => {
                    made.map_or_else(|error| self.fault(SourceFault::Voxels(error)), drop);
                    return true;
                }
                Poll::Pending => {}
            }
            if stop.load(Ordering::Relaxed) {
                return false;
            }
            while let Some(finer) = self.next(level) {
                self.carry_out(finer, stop);
            }
            while !signal.is_woken.swap(false, Ordering::AcqRel) && !stop.load(Ordering::Relaxed) {
                thread::park_timeout(LOOK_EVERY);
            }
        }
    }
}
