//! The loader without threads: reads go on whenever the loader is polled, as in a browser.

use std::future::Future;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use bytes::Bytes;
use vastex_core::{PageId, TextureId};

use super::clock::{Clock, SystemClock};
use super::queue::{Outcome, Queue, ReadId};
use super::{LoadError, Loaded, LoaderSettings, load};
use crate::sources::TileSource;

/// Only ever polled where it was made, so it need not be `Send`.
type Read = Pin<Box<dyn Future<Output = Result<Bytes, LoadError>>>>;

/// Reads and decodes tiles on the thread that polls it, best rank first, with a bounded number of reads of each source under
/// way.
///
/// A frame polls it until it has nothing to give. By then it has decoded for about [`LoaderSettings::decode_time`], and at least one
/// tile if any could be had; the rest waits for the next frame.
///
/// Every request ends exactly once: loaded, failed or cancelled. Where sources never suspend, the order in which requests
/// end is fixed.
pub struct LocalLoader {
    settings: LoaderSettings,
    clock: Arc<dyn Clock>,
    queue: Queue,
    running: Vec<(ReadId, Read)>,
    /// Those of `running` before this one were polled in this frame.
    polled: usize,
    /// When this frame ended its first read, if it has.
    decoding_since: Option<Duration>,
}

impl LocalLoader {
    /// A loader with the usual settings. Never fails; without threads their number has no meaning.
    pub fn new(_threads: usize) -> io::Result<LocalLoader> {
        LocalLoader::with(LoaderSettings::default(), Arc::new(SystemClock::new()))
    }

    /// A loader with these settings, for which time passes as `clock` says. Never fails.
    pub fn with(settings: LoaderSettings, clock: Arc<dyn Clock>) -> io::Result<LocalLoader> {
        let queue = Queue::new(LoaderSettings { threads: 1, ..settings });
        let (running, polled, decoding_since) = (Vec::new(), 0, None);
        Ok(LocalLoader { settings, clock, queue, running, polled, decoding_since })
    }

    /// Gives a texture its source, in place of the one it had; requests that were for that one are cancelled.
    pub fn add_source(&mut self, texture: TextureId, source: Arc<dyn TileSource>) {
        self.remove_source(texture);
        self.queue.add_source(texture, source);
    }

    /// Takes a texture's source away and cancels its requests.
    pub fn remove_source(&mut self, texture: TextureId) {
        self.queue.remove_source(texture);
        self.drop_called_off();
    }

    /// Asks for a page; the lowest rank is loaded first, the oldest request among equals.
    ///
    /// A page that is queued already gets the new rank, and one result. One that is being read stays as it is. A request of a
    /// source that does not answer fails at once.
    pub fn request(&mut self, page: PageId, rank: u64) {
        self.queue.request(page, rank, self.clock.now());
    }

    /// Gives a page that is queued another rank. One that is being read stays as it is, and nothing happens where the page is not
    /// requested or has ended already.
    pub fn rerank(&mut self, page: PageId, rank: u64) {
        self.queue.rerank(page, rank);
    }

    /// Calls a request off. It ends as [`LoadError::Cancelled`] at once; a read under way is dropped. Nothing happens
    /// where the page is not requested or has ended already.
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

    /// A request that has ended, if there is one and this frame's time allows it; nothing ends the frame. Never waits.
    pub fn poll(&mut self) -> Option<Loaded> {
        if let Some(loaded) = self.queue.poll() {
            return Some(loaded);
        }
        let now = self.clock.now();
        for read in self.queue.set_time(now) {
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

    /// Lets reads go on as far as they can, each once a frame, until one has ended. Says whether one has.
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

    /// The next request to end, or nothing where none is outstanding, or none can end before control goes back to the
    /// event loop.
    pub fn wait(&mut self) -> Option<Loaded> {
        /// Polls after which a read that still suspends is taken to wait for the event loop.
        const PATIENCE: usize = 1000;
        let outstanding = self.outstanding();
        (0..PATIENCE).take_while(|_| outstanding > 0).find_map(|_| self.poll())
    }

    /// Requests whose end has not been polled yet.
    pub fn outstanding(&self) -> usize {
        self.queue.outstanding()
    }
}
