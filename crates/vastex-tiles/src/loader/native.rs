//! The loader on threads.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::{io, thread};

use bytes::Bytes;
use vastex_core::{PageId, TextureId};

use super::queue::{Job, Queue};
use super::{LoadError, Loaded, load};
use crate::source::TileSource;

/// Reads and decodes tiles on a bounded number of threads, best rank first.
///
/// A thread waits for the read that it has under way: where a source can have several in flight, as a
/// [`DirectStore`](crate::DirectStore) can, as many are as there are threads.
///
/// Every request ends exactly once: loaded, failed or cancelled. Dropping the loader waits for the reads under way and
/// ends its threads.
pub struct Loader {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    /// Signalled when there may be something to start.
    work: Condvar,
    /// Signalled when a request has ended.
    ended: Condvar,
}

#[derive(Default)]
struct State {
    queue: Queue,
    stopping: bool,
}

impl Shared {
    /// Sources run outside the lock, and their panics are caught; so nothing is ever half done behind it.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Loader {
    /// A loader with so many threads (at least 1), each of which has one tile under way. Fails where the system gives
    /// no thread.
    pub fn new(threads: usize) -> io::Result<Loader> {
        let mut loader = Loader { shared: Arc::default(), threads: Vec::new() };
        for n in 0..threads.max(1) {
            let shared = loader.shared.clone();
            let thread = thread::Builder::new().name(format!("vastex load {n}")).spawn(move || work(&shared));
            loader.threads.push(thread?);
        }
        Ok(loader)
    }

    /// Gives a texture its source, in place of the one it had; requests that were for that one are cancelled.
    pub fn add_source(&mut self, texture: TextureId, source: Arc<dyn TileSource>) {
        self.shared.lock().queue.add_source(texture, source);
        self.shared.ended.notify_all();
    }

    /// Takes a texture's source away and cancels its requests.
    pub fn remove_source(&mut self, texture: TextureId) {
        self.shared.lock().queue.remove_source(texture);
        self.shared.ended.notify_all();
    }

    /// Asks for a page; the lowest rank is loaded first, the oldest request among equals.
    ///
    /// A page that is queued already gets the new rank, and one result. One that is being read stays as it is.
    pub fn request(&mut self, page: PageId, rank: u64) {
        self.shared.lock().queue.request(page, rank);
        self.shared.work.notify_one();
    }

    /// Gives a page that is queued another rank. One that is being read stays as it is, and nothing happens where the page is not
    /// requested or has ended already, so that what ends meanwhile is not read twice.
    pub fn rerank(&mut self, page: PageId, rank: u64) {
        self.shared.lock().queue.rerank(page, rank);
    }

    /// Calls a request off. It ends as [`LoadError::Cancelled`]: at once if it was not begun, else when its read ends,
    /// whose result is dropped. Nothing happens where the page is not requested or has ended already.
    pub fn cancel(&mut self, page: PageId) {
        self.shared.lock().queue.cancel(page);
        self.shared.ended.notify_all();
    }

    /// A request that has ended, if there is one. Never waits.
    pub fn poll(&mut self) -> Option<Loaded> {
        self.shared.lock().queue.poll()
    }

    /// The next request to end; waits for it. Nothing where no request is outstanding.
    ///
    /// With several threads the order in which requests end is not fixed.
    pub fn wait(&mut self) -> Option<Loaded> {
        let mut state = self.shared.lock();
        loop {
            if let Some(loaded) = state.queue.poll() {
                return Some(loaded);
            }
            if state.queue.is_idle() {
                return None;
            }
            state = self.shared.ended.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Requests whose end has not been polled yet.
    pub fn outstanding(&self) -> usize {
        self.shared.lock().queue.outstanding()
    }
}

impl Drop for Loader {
    fn drop(&mut self) {
        self.shared.lock().stopping = true;
        self.shared.work.notify_all();
        for thread in self.threads.drain(..) {
            if thread.join().is_err() {
                tracing::error!("a loader thread panicked");
            }
        }
    }
}

/// What each thread does until the loader is dropped.
fn work(shared: &Shared) {
    while let Some(job) = next_job(shared) {
        let page = job.page;
        let result = run(job);
        shared.lock().queue.finish(page, result);
        shared.ended.notify_all();
    }
}

fn next_job(shared: &Shared) -> Option<Job> {
    let mut state = shared.lock();
    loop {
        if state.stopping {
            return None;
        }
        if let Some(job) = state.queue.start_next() {
            return Some(job);
        }
        // Requests without a source may just have ended.
        shared.ended.notify_all();
        state = shared.work.wait(state).unwrap_or_else(PoisonError::into_inner);
    }
}

fn run(job: Job) -> Result<Bytes, LoadError> {
    let Job { pos, source, .. } = job;
    // A source is not used after a panic of this read other than through its own locks, which know of it.
    catch_unwind(AssertUnwindSafe(|| pollster::block_on(load(source, pos)))).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let message = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
        Err(LoadError::Panicked { pos, message })
    })
}
