//! The loader on threads.
//!
//! A thread carries out one read at a time, to its end: as many reads are under way as threads are busy, and
//! no source has threads of its own. Reads that are *at work* have places, of which there are as many as the
//! settings say. A read that waits for something else *lends* its place: from the beginning if its source
//! says that reads block ([`TileSource::blocks`]), as reads past the system's cache do; at once if it
//! suspends; and after [`PATIENCE`] if it blocks its thread. Another thread then has the place, and is made
//! if need be. So what other reads may do does not depend on when, or if ever, a read comes back.
//!
//! Time passes when the loader is polled. A read that is overdue by then has lost its request and its place,
//! and its thread is told to drop it: at once if the read is suspended, else when it comes back. Nobody waits
//! for that: no thread is ever joined.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::task::{Context, Poll, Wake, Waker};
use std::thread::{self, Thread};
use std::time::Duration;
use std::{io, mem};

use vastex_core::{PageId, TextureNumber};

use super::clock::{Clock, SystemClock};
use super::lanes::CROWD;
use super::queue::{Job, Outcome, Queue, ReadId};
use super::{LoadError, Loaded, LoaderSettings, load};
use crate::ground::sync::{lock, wait_at_most};
use crate::sources::TileSource;

/// How long a read may block its thread before it lends its place. A disk that seeks answers much sooner.
const PATIENCE: Duration = Duration::from_millis(250);
/// How often the clock is looked at, at most.
const LOOK_EVERY: Duration = Duration::from_millis(5);
/// How long a thread that is one too many waits for work before it ends.
const LINGER: Duration = Duration::from_secs(10);
/// The most places that are ever lent: each is a thread.
const MOST_LENT: usize = 4096;

/// Reads and decodes tiles on threads, best rank first.
///
/// A source that is slow or does not answer delays only itself: its reads take places of their own, up to the
/// source's limit, and end as [`LoadError::Overdue`]; see [`LoaderSettings`].
///
/// Every request ends exactly once: loaded, failed or cancelled. When the end of a request has been polled,
/// its source is no longer in use for it, unless the read was overdue. Dropping the loader waits for nothing:
/// each thread ends by itself when its read under way ends, and keeps that read's source until then.
pub struct Loader {
    shared: Arc<Shared>,
}

struct Shared {
    settings: LoaderSettings,
    clock: Arc<dyn Clock>,
    state: Mutex<State>,
    /// Signalled when there may be something to start.
    work: Condvar,
    /// Signalled when a request has ended.
    ended: Condvar,
}

struct State {
    queue: Queue,
    /// Reads that were begun and have not come back; each has a thread.
    reads: BTreeMap<ReadId, Busy>,
    /// Threads that there are, whatever they do.
    threads: usize,
    /// Places lent, by so many of the reads.
    lent: usize,
    looked: Duration,
    /// Set once the lack of further threads was logged.
    has_logged: bool,
    stopping: bool,
}

/// A thread with a read.
struct Busy {
    signal: Arc<Signal>,
    has_lent: bool,
}

/// What wakes the thread of a read.
struct Signal {
    thread: Thread,
    is_woken: AtomicBool,
    /// Nobody wants the read any more.
    is_dropped: AtomicBool,
}

impl Wake for Signal {
    fn wake(self: Arc<Self>) {
        self.is_woken.store(true, Ordering::Release);
        self.thread.unpark();
    }
}

impl Signal {
    fn drop_read(&self) {
        self.is_dropped.store(true, Ordering::Release);
        self.thread.unpark();
    }

    /// Waits until the read may go on. Returns false if the read is no longer wanted.
    fn wait(&self) -> bool {
        while !self.is_dropped.load(Ordering::Acquire) {
            if self.is_woken.swap(false, Ordering::AcqRel) {
                return true;
            }
            thread::park();
        }
        false
    }
}

impl Shared {
    /// Locks the state. Sources run outside the lock, and their panics are caught, so that the state is
    /// always whole.
    fn lock(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }
}

impl Loader {
    /// A loader with at most `threads` reads at work at once (at least 1). Fails if the system gives no
    /// thread.
    pub fn new(threads: usize) -> io::Result<Loader> {
        let settings = LoaderSettings { threads, ..LoaderSettings::default() };
        Loader::with(settings, Arc::new(SystemClock::new()))
    }

    /// A loader with these settings, for which time passes as `clock` says. Fails if the system gives no
    /// thread.
    pub fn with(settings: LoaderSettings, clock: Arc<dyn Clock>) -> io::Result<Loader> {
        let settings = LoaderSettings { threads: settings.threads.max(1), ..settings };
        let state = State {
            queue: Queue::new(settings),
            reads: BTreeMap::new(),
            threads: 0,
            lent: 0,
            looked: clock.now(),
            has_logged: false,
            stopping: false,
        };
        let (state, work, ended) = (Mutex::new(state), Condvar::new(), Condvar::new());
        let loader = Loader { shared: Arc::new(Shared { settings, clock, state, work, ended }) };
        let mut state = loader.shared.lock();
        (0..settings.threads).try_for_each(|_| loader.shared.add_thread(&mut state))?;
        drop(state);
        Ok(loader)
    }

    /// Gives a texture its source. Replaces the source that it had, whose requests are cancelled.
    pub fn add_source(&mut self, texture: TextureNumber, source: Arc<dyn TileSource>) {
        let mut state = self.shared.lock();
        let gone = state.queue.add_source(texture, source);
        self.shared.ended.notify_all();
        drop(state);
        // Outside the lock: what goes with a source is the source's business.
        drop(gone);
    }

    /// Takes a texture's source away and cancels its requests.
    pub fn remove_source(&mut self, texture: TextureNumber) {
        let mut state = self.shared.lock();
        let gone = state.queue.remove_source(texture);
        self.shared.ended.notify_all();
        drop(state);
        drop(gone);
    }

    /// Asks for a page. The lowest rank is loaded first, and among equal ranks the oldest request.
    ///
    /// A page that is queued already gets the new rank, and one result. A page that is being read stays as it
    /// is. A request of a source that does not answer fails at once.
    pub fn request(&mut self, page: PageId, rank: u64) {
        let now = self.shared.clock.now();
        let mut state = self.shared.lock();
        state.queue.request(page, rank, now);
        self.shared.staff(&mut state);
        self.shared.work.notify_one();
    }

    /// Gives a queued page another rank. Has no effect if the page is being read, has ended, or was never
    /// requested, so that a tile that comes meanwhile is not read twice.
    pub fn rerank(&mut self, page: PageId, rank: u64) {
        self.shared.lock().queue.rerank(page, rank);
    }

    /// Cancels a request, which ends as [`LoadError::Cancelled`]: at once if it was not begun, soon if its
    /// read is suspended, else when the read ends, whose result is dropped. Has no effect if the page is not
    /// requested or its request has ended.
    pub fn cancel(&mut self, page: PageId) {
        let mut state = self.shared.lock();
        if let Some(read) = state.queue.cancel(page) {
            state.drop_read(read);
        }
        self.shared.ended.notify_all();
    }

    /// A request that has ended, or `None` if there is none. Never waits for a read.
    pub fn poll(&mut self) -> Option<Loaded> {
        let mut state = self.shared.lock();
        self.shared.look_at_clock(&mut state);
        state.queue.poll()
    }

    /// The next request to end, or `None` if no request is outstanding. Waits for it, but no longer than a
    /// read may take.
    ///
    /// With several threads the order in which requests end is not fixed.
    pub fn wait(&mut self) -> Option<Loaded> {
        let mut state = self.shared.lock();
        loop {
            self.shared.look_at_clock(&mut state);
            if let Some(loaded) = state.queue.poll() {
                return Some(loaded);
            }
            if state.queue.is_idle() {
                return None;
            }
            state = wait_at_most(&self.shared.ended, state, PATIENCE).0;
        }
    }

    /// The number of requests whose end has not been polled yet.
    pub fn outstanding(&self) -> usize {
        self.shared.lock().queue.outstanding()
    }
}

impl Drop for Loader {
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        state.stopping = true;
        state.reads.values().for_each(|busy| busy.signal.drop_read());
        let queue = mem::replace(&mut state.queue, Queue::new(self.shared.settings));
        drop(state);
        self.shared.work.notify_all();
        // The sources, outside the lock.
        drop(queue);
    }
}

impl State {
    fn drop_read(&self, read: ReadId) {
        if let Some(busy) = self.reads.get(&read) {
            busy.signal.drop_read();
        }
    }

    /// Returns true if a read may be begun: there is a place, and something to do.
    fn can_start(&self, places: usize) -> bool {
        self.reads.len() < places + self.lent && self.queue.has_next()
    }

    /// Lends the place of a read to another, if it has one and there may be one thread more. A crowd does not
    /// keep it: a read that never comes back would keep the place for ever.
    fn lend(&mut self, read: ReadId) {
        if self.lent < MOST_LENT
            && let Some(busy) = self.reads.get_mut(&read)
            && !mem::replace(&mut busy.has_lent, true)
        {
            self.lent += 1;
            self.queue.lend(read);
            self.queue.set_crowded(self.lent >= CROWD);
        }
    }
}

impl Shared {
    /// Starts one more thread.
    fn add_thread(self: &Arc<Self>, state: &mut State) -> io::Result<()> {
        let shared = self.clone();
        thread::Builder::new().name("vastex load".into()).spawn(move || work(&shared))?;
        state.threads += 1;
        Ok(())
    }

    /// Sees to it that a thread begins what may be begun: makes one more thread if all are busy, which does
    /// the same once it has a read.
    fn staff(self: &Arc<Self>, state: &mut State) {
        // A thread without a read looks for one before it rests.
        if state.threads == state.reads.len()
            && state.can_start(self.settings.threads)
            && let Err(error) = self.add_thread(state)
            && !mem::replace(&mut state.has_logged, true)
        {
            tracing::warn!("no further thread to load tiles with, for reads that wait: {error}");
        }
    }

    /// Gives up reads that are overdue by now, and lends the places of those that block their threads.
    fn look_at_clock(self: &Arc<Self>, state: &mut State) {
        let now = self.clock.now();
        if now.saturating_sub(state.looked) < LOOK_EVERY {
            return;
        }
        state.looked = now;
        for read in state.queue.end_overdue(now) {
            state.drop_read(read);
        }
        let slow: Vec<_> = state.queue.begun_before(PATIENCE.min(self.settings.time_out)).collect();
        slow.into_iter().for_each(|read| state.lend(read));
        self.staff(state);
        self.work.notify_all();
    }
}

/// What each thread does until the loader is dropped, or it is one too many.
fn work(shared: &Arc<Shared>) {
    while let Some((job, signal)) = next_job(shared) {
        let read = job.read;
        let outcome = run(shared, job, &signal);
        let mut state = shared.lock();
        if let Some(Busy { has_lent: true, .. }) = state.reads.remove(&read) {
            state.lent -= 1;
            let is_crowded = state.lent >= CROWD;
            state.queue.set_crowded(is_crowded);
        }
        state.queue.finish(read, outcome);
        shared.ended.notify_all();
        // The place is free, or there may be others that wait for room in the lane.
        shared.work.notify_one();
    }
}

fn next_job(shared: &Arc<Shared>) -> Option<(Job, Arc<Signal>)> {
    let mut state = shared.lock();
    loop {
        if state.stopping {
            return None;
        }
        let job = match state.can_start(shared.settings.threads) {
            true => state.queue.start_next(shared.clock.now()),
            false => None,
        };
        if let Some(job) = job {
            let signal = Arc::new(Signal {
                thread: thread::current(),
                is_woken: AtomicBool::new(false),
                is_dropped: AtomicBool::new(false),
            });
            state.reads.insert(job.read, Busy { signal: signal.clone(), has_lent: false });
            if state.queue.is_blocking(job.read) {
                state.lend(job.read);
            }
            // There may be more to begin than threads were woken or made for.
            shared.staff(&mut state);
            return Some((job, signal));
        }
        let (locked, has_timed_out) = wait_at_most(&shared.work, state, LINGER);
        state = locked;
        if has_timed_out && state.threads - state.lent > shared.settings.threads {
            state.threads -= 1;
            return None;
        }
    }
}

fn run(shared: &Arc<Shared>, job: Job, signal: &Arc<Signal>) -> Outcome {
    let Job { read, pos, source } = job;
    // A source is not used after a panic of this read other than through its own locks, which know of it.
    catch_unwind(AssertUnwindSafe(|| {
        let mut load = pin!(load(source, pos));
        let waker = Waker::from(signal.clone());
        let mut context = Context::from_waker(&waker);
        loop {
            if let Poll::Ready(result) = load.as_mut().poll(&mut context) {
                return Outcome::Answered(result);
            }
            {
                let mut state = shared.lock();
                state.lend(read);
                shared.staff(&mut state);
            }
            shared.work.notify_one();
            if !signal.wait() {
                return Outcome::Dropped;
            }
        }
    }))
    .unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let message = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
        Outcome::Answered(Err(LoadError::Panicked { pos, message }))
    })
}
