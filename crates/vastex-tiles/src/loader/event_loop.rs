//! The loader without threads: reads go on whenever the loader is polled, as in a browser.

use std::future::Future;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use bytes::Bytes;
use vastex_core::{PageId, TextureNumber};

use super::clock::{Clock, SystemClock};
use super::queue::{Outcome, Queue, ReadId};
use super::{LoadError, Loaded, LoaderSettings, load};
use crate::sources::TileSource;

/// A read is only polled on the thread that began it, so it need not be `Send`.
type Read = Pin<Box<dyn Future<Output = Result<Bytes, LoadError>>>>;

/// Reads and decodes tiles on the thread that polls it, best rank first, with a bounded number of reads of
/// each source under way.
///
/// Poll it in each frame until it returns `None`. By then it has decoded for about
/// [`LoaderSettings::decode_time`], and at least one tile if any could be had; the rest waits for the next
/// frame.
///
/// Every request ends exactly once: loaded, failed or cancelled. If sources never suspend, the order in which
/// requests end is fixed.
pub struct LocalLoader {
    settings: LoaderSettings,
    clock: Arc<dyn Clock>,
    queue: Queue,
    running: Vec<(ReadId, Read)>,
    /// How many of `running`, counted from the first, were polled in this frame.
    polled: usize,
    /// When the first read of this frame ended, or `None` if none has.
    decoding_since: Option<Duration>,
}

impl LocalLoader {
    /// A loader with the default settings. Never fails. The number of threads has no effect, since there are
    /// none.
    pub fn new(_threads: usize) -> io::Result<LocalLoader> {
        LocalLoader::with(LoaderSettings::default(), Arc::new(SystemClock::new()))
    }

    /// A loader with these settings, for which time passes as `clock` says. Never fails.
    pub fn with(settings: LoaderSettings, clock: Arc<dyn Clock>) -> io::Result<LocalLoader> {
        let queue = Queue::new(LoaderSettings { threads: 1, ..settings });
        let (running, polled, decoding_since) = (Vec::new(), 0, None);
        Ok(LocalLoader { settings, clock, queue, running, polled, decoding_since })
    }

    /// Gives a texture its source. Replaces the source that it had, whose requests are cancelled.
    pub fn add_source(&mut self, texture: TextureNumber, source: Arc<dyn TileSource>) {
        self.remove_source(texture);
        self.queue.add_source(texture, source);
    }

    /// Takes a texture's source away and cancels its requests.
    pub fn remove_source(&mut self, texture: TextureNumber) {
        self.queue.remove_source(texture);
        self.drop_called_off();
    }

    /// Asks for a page. The lowest rank is loaded first, and among equal ranks the oldest request.
    ///
    /// A page that is queued already gets the new rank, and one result. A page that is being read stays as it
    /// is. A request of a source that does not answer fails at once.
    pub fn request(&mut self, page: PageId, rank: u64) {
        self.queue.request(page, rank, self.clock.now());
    }

    /// Gives a queued page another rank. Has no effect if the page is being read, has ended, or was never
    /// requested.
    pub fn rerank(&mut self, page: PageId, rank: u64) {
        self.queue.rerank(page, rank);
    }

    /// Cancels a request, which ends as [`LoadError::Cancelled`] at once; a read under way is dropped. Has no
    /// effect if the page is not requested or its request has ended.
    pub fn cancel(&mut self, page: PageId) {
        self.queue.cancel(page);
        self.drop_called_off();
    }

    fn drop_called_off(&mut self) {
        let LocalLoader { queue, running, .. } = self;
        running.retain(|(read, _)| {
            let is_wanted = !queue.is_called_off(*read);
            if !is_wanted {
                queue.finish(*read, Outcome::Dropped);
            }
            is_wanted
        });
    }

    /// A request that has ended, or `None` if there is none, or none that this frame's time allows; `None`
    /// ends the frame. Never waits.
    pub fn poll(&mut self) -> Option<Loaded> {
        if let Some(loaded) = self.queue.poll() {
            return Some(loaded);
        }
        let now = self.clock.now();
        for read in self.queue.end_overdue(now) {
            self.running.retain(|(running, _)| *running != read);
            self.queue.finish(read, Outcome::Dropped);
        }
        let is_time_left =
            self.decoding_since.is_none_or(|since| now.saturating_sub(since) < self.settings.decode_time);
        if is_time_left && self.end_one() {
            self.decoding_since.get_or_insert(now);
        }
        let loaded = self.queue.poll();
        if loaded.is_none() {
            (self.polled, self.decoding_since) = (0, None);
        }
        loaded
    }

    /// Polls reads, each once a frame, until one has ended. Returns true if one has.
    fn end_one(&mut self) -> bool {
        // Whoever drives this polls again each frame, so nobody needs waking.
        let mut context = Context::from_waker(Waker::noop());
        loop {
            if self.polled >= self.running.len() {
                self.polled = self.running.len();
                let Some(job) = self.queue.start_next(self.clock.now()) else { return false };
                self.running.push((job.read, Box::pin(load(job.source, job.pos))));
            }
            let Some((id, read)) = self.running.get_mut(self.polled) else { return false };
            if let Poll::Ready(result) = read.as_mut().poll(&mut context) {
                let id = *id;
                drop(self.running.remove(self.polled));
                self.queue.finish(id, Outcome::Answered(result));
                return true;
            }
            self.polled += 1;
        }
    }

    /// The next request to end, or `None` if no request is outstanding, or if none can end before control
    /// goes back to the event loop.
    pub fn wait(&mut self) -> Option<Loaded> {
        /// After so many polls a read that still suspends is taken to wait for the event loop.
        const PATIENCE: usize = 1000;
        let outstanding = self.outstanding();
        (0..PATIENCE).take_while(|_| outstanding > 0).find_map(|_| self.poll())
    }

    /// The number of requests whose end has not been polled yet.
    pub fn outstanding(&self) -> usize {
        self.queue.outstanding()
    }
}
