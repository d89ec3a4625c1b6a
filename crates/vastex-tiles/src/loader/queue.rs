//! What the loader knows of its requests: their order, their states, their results.
//!
//! | state | entered by | left by |
//! |---|---|---|
//! | queued | a request | its turn; `cancel`, which ends it at once |
//! | running | its turn | the end of the read |
//! | running, called off | `cancel` | the end of the read, whose result is dropped |
//! | finished | any end | being polled |
//!
//! A page that is requested again while a called-off read of it still runs is queued again after that.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use bytes::Bytes;
use rustc_hash::FxHashMap;
use vastex_core::{PageId, PagePos, TextureId};

use super::{LoadError, Loaded};
use crate::source::TileSource;

/// Where a queued request stands: by rank, and by arrival among equals.
type Turn = (u64, u64);

enum State {
    Queued(Turn),
    Running { called_off: bool, again: Option<u64> },
}

/// A read to be started.
pub(super) struct Job {
    pub(super) page: PageId,
    pub(super) pos: PagePos,
    pub(super) source: Arc<dyn TileSource>,
}

#[derive(Default)]
pub(super) struct Queue {
    sources: FxHashMap<TextureId, Arc<dyn TileSource>>,
    states: FxHashMap<PageId, State>,
    turns: BTreeMap<Turn, PageId>,
    arrivals: u64,
    finished: VecDeque<Loaded>,
}

impl Queue {
    pub(super) fn add_source(&mut self, texture: TextureId, source: Arc<dyn TileSource>) {
        self.remove_source(texture);
        self.sources.insert(texture, source);
    }

    /// Cancels every request of the texture. Reads under way keep the source until they end.
    pub(super) fn remove_source(&mut self, texture: TextureId) {
        self.sources.remove(&texture);
        let mut pages: Vec<_> =
            self.states.keys().copied().filter(|page| page.texture() == texture).collect();
        pages.sort_unstable();
        for page in pages {
            self.cancel(page);
        }
    }

    /// Queues a page, or moves it where it is queued already; one that is running stays as it is.
    pub(super) fn request(&mut self, page: PageId, rank: u64) {
        match self.states.get_mut(&page) {
            None => self.enqueue(page, rank),
            Some(State::Queued(_)) => self.rerank(page, rank),
            Some(State::Running { called_off: true, again }) => *again = Some(rank),
            Some(State::Running { called_off: false, .. }) => {}
        }
    }

    /// Moves a page where it is queued; one that is running, has ended or was never requested stays as it is.
    pub(super) fn rerank(&mut self, page: PageId, rank: u64) {
        if let Some(State::Queued(turn)) = self.states.get_mut(&page) {
            self.turns.remove(turn);
            turn.0 = rank;
            self.turns.insert(*turn, page);
        }
    }

    fn enqueue(&mut self, page: PageId, rank: u64) {
        let turn = (rank, self.arrivals);
        self.arrivals += 1;
        self.turns.insert(turn, page);
        self.states.insert(page, State::Queued(turn));
    }

    pub(super) fn cancel(&mut self, page: PageId) {
        match self.states.get_mut(&page) {
            Some(State::Queued(turn)) => {
                self.turns.remove(turn);
                self.states.remove(&page);
                self.end(page, Err(LoadError::Cancelled));
            }
            Some(State::Running { called_off: called_off @ false, .. }) => *called_off = true,
            Some(State::Running { again, .. }) => {
                let waiting = again.take();
                if waiting.is_some() {
                    self.end(page, Err(LoadError::Cancelled));
                }
            }
            None => {}
        }
    }

    /// Takes the next request in its turn; those without a source end here.
    pub(super) fn start_next(&mut self) -> Option<Job> {
        while let Some((_, page)) = self.turns.pop_first() {
            let Some(source) = self.sources.get(&page.texture()) else {
                self.states.remove(&page);
                self.end(page, Err(LoadError::NoSource { texture: page.texture().number() }));
                continue;
            };
            let pos = page.pos(source.description().geometry.dims());
            self.states.insert(page, State::Running { called_off: false, again: None });
            return Some(Job { page, pos, source: source.clone() });
        }
        None
    }

    /// Ends a read that was started.
    pub(super) fn finish(&mut self, page: PageId, result: Result<Bytes, LoadError>) {
        let Some(State::Running { called_off, again }) = self.states.remove(&page) else { return };
        self.end(page, if called_off { Err(LoadError::Cancelled) } else { result });
        if let Some(rank) = again {
            self.enqueue(page, rank);
        }
    }

    fn end(&mut self, page: PageId, result: Result<Bytes, LoadError>) {
        self.finished.push_back(Loaded { page, result });
    }

    pub(super) fn poll(&mut self) -> Option<Loaded> {
        self.finished.pop_front()
    }

    /// Requests that have not been polled yet.
    pub(super) fn outstanding(&self) -> usize {
        let again =
            self.states.values().filter(|state| matches!(state, State::Running { again: Some(_), .. }));
        self.states.len() + again.count() + self.finished.len()
    }

    /// Whether nothing is queued or running.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn is_idle(&self) -> bool {
        self.states.is_empty()
    }

    /// Whether a read that is running was called off.
    pub(super) fn is_called_off(&self, page: PageId) -> bool {
        matches!(self.states.get(&page), Some(State::Running { called_off: true, .. }))
    }
}
