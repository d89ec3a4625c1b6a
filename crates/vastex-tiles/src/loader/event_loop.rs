//! The loader without threads: reads go on whenever the loader is polled, as in a browser.

use std::future::Future;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};

use bytes::Bytes;
use vastex_core::{PageId, TextureId};

use super::queue::Queue;
use super::{LoadError, Loaded, load};
use crate::source::TileSource;

/// Only ever polled where it was made, so it need not be `Send`.
type Read = Pin<Box<dyn Future<Output = Result<Bytes, LoadError>>>>;

/// Reads and decodes tiles on the thread that polls it, best rank first, with a bounded number of reads under way.
///
/// Every request ends exactly once: loaded, failed or cancelled. Where sources never suspend, the order in which requests
/// end is fixed.
pub struct LocalLoader {
    queue: Queue,
    running: Vec<(PageId, Read)>,
    limit: usize,
}

impl LocalLoader {
    /// A loader with so many reads under way at most (at least 1). Never fails.
    pub fn new(reads: usize) -> io::Result<LocalLoader> {
        Ok(LocalLoader { queue: Queue::default(), running: Vec::new(), limit: reads.max(1) })
    }

    /// Gives a texture its source, in place of the one it had; requests that were for that one are cancelled.
    pub fn add_source(&mut self, texture: TextureId, source: Arc<dyn TileSource>) {
        self.queue.add_source(texture, source);
        self.drop_called_off();
    }

    /// Takes a texture's source away and cancels its requests.
    pub fn remove_source(&mut self, texture: TextureId) {
        self.queue.remove_source(texture);
        self.drop_called_off();
    }

    /// Asks for a page; the lowest rank is loaded first, the oldest request among equals.
    ///
    /// A page that is queued already gets the new rank, and one result. One that is being read stays as it is.
    pub fn request(&mut self, page: PageId, rank: u64) {
        self.queue.request(page, rank);
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
        running.retain(|(page, _)| {
            let called_off = queue.is_called_off(*page);
            if called_off {
                queue.finish(*page, Err(LoadError::Cancelled));
            }
            !called_off
        });
    }

    /// Lets every read go on as far as it can; a request that has ended, if there is one. Never waits.
    pub fn poll(&mut self) -> Option<Loaded> {
        while self.running.len() < self.limit
            && let Some(job) = self.queue.start_next()
        {
            self.running.push((job.page, Box::pin(load(job.source, job.pos))));
        }
        let LocalLoader { queue, running, .. } = self;
        // Whoever drives this polls again each frame, so nobody needs waking.
        let mut context = Context::from_waker(Waker::noop());
        running.retain_mut(|(page, read)| match read.as_mut().poll(&mut context) {
            Poll::Ready(result) => {
                queue.finish(*page, result);
                false
            }
            Poll::Pending => true,
        });
        queue.poll()
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
