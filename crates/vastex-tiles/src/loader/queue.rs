//! The requests of a loader: their order, their states, their results.
//!
//! | state | entered by | left by |
//! |---|---|---|
//! | queued | a request | its turn; `cancel`, which ends it at once; the silence of its lane |
//! | running | its turn | the end of the read, or its being overdue |
//! | running, called off | `cancel` | the same; its result is dropped |
//! | finished | any end | being polled |
//!
//! A page that is requested again while a called-off read of it still runs is queued again after that. A
//! request ends when its read is overdue; the read itself is under way, and counts in its lane, until it
//! comes back.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use rustc_hash::FxHashMap;
use vastex_core::{PageId, PagePos, TextureNumber};

use super::lanes::{FIRST_PAUSE, LONGEST_PAUSE, LaneId, Lanes, Turn};
use super::{LoadError, Loaded, LoaderSettings};
use crate::sources::TileSource;

/// A source that comes in the place of others whose reads have not come back may begin a read while less than
/// so many times the reads of one source have not. Beyond that it is tried with one read after a pause, which
/// doubles.
const TRIALS: usize = 2;

/// Names a read that was begun; later ones have larger numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ReadId(u64);

enum State {
    Queued(Turn),
    Running { read: ReadId, called_off: bool, again: Option<u64> },
}

/// A read to be carried out.
pub(super) struct Job {
    pub(super) read: ReadId,
    pub(super) pos: PagePos,
    pub(super) source: Arc<dyn TileSource>,
}

/// What has become of a read.
pub(super) enum Outcome {
    /// The source has answered.
    Answered(Result<Bytes, LoadError>),
    /// The read was dropped before the source had answered.
    Dropped,
}

/// A read that has not come back.
struct Read {
    page: PageId,
    pos: PagePos,
    lane: LaneId,
    begun: Duration,
    is_overdue: bool,
    has_lent: bool,
}

struct Source {
    source: Arc<dyn TileSource>,
    lane: LaneId,
    /// True if reads of the source block their threads ([`TileSource::blocks`]).
    #[cfg(not(target_family = "wasm"))]
    blocks: bool,
}

pub(super) struct Queue {
    settings: LoaderSettings,
    sources: FxHashMap<TextureNumber, Source>,
    lanes: Lanes,
    /// Of textures whose sources are beyond trial, when one is tried again and the pause after that.
    tries: FxHashMap<TextureNumber, (Duration, Duration)>,
    states: FxHashMap<PageId, State>,
    /// The reads under way, in the order in which they were begun.
    reads: BTreeMap<ReadId, Read>,
    begun: u64,
    arrivals: u64,
    finished: VecDeque<Loaded>,
    /// The time that was set last.
    now: Duration,
}

impl Queue {
    pub(super) fn new(settings: LoaderSettings) -> Queue {
        Queue {
            settings,
            sources: FxHashMap::default(),
            lanes: Lanes::default(),
            tries: FxHashMap::default(),
            states: FxHashMap::default(),
            reads: BTreeMap::new(),
            begun: 0,
            arrivals: 0,
            finished: VecDeque::new(),
            now: Duration::ZERO,
        }
    }

    /// Gives a texture its source, and returns the one that it had before, to be dropped where no lock is
    /// held.
    pub(super) fn add_source(
        &mut self,
        texture: TextureNumber,
        source: Arc<dyn TileSource>,
    ) -> Option<Arc<dyn TileSource>> {
        let before = self.remove_source(texture);
        let is_on_trial = self.under_way_of(texture) > 0;
        let lane = self.lanes.enter(source.read_limit(), self.reads_at_once(), is_on_trial);
        #[cfg(not(target_family = "wasm"))]
        let blocks = source.blocks();
        let source = Source {
            source,
            lane,
            #[cfg(not(target_family = "wasm"))]
            blocks,
        };
        self.sources.insert(texture, source);
        before
    }

    /// Reads of one source that may be under way at once, where it has no limit of its own.
    fn reads_at_once(&self) -> usize {
        self.settings.reads_at_once.max(self.settings.threads)
    }

    /// The reads of a texture that have not come back, also those of sources that it had before.
    fn under_way_of(&self, texture: TextureNumber) -> usize {
        self.reads.values().filter(|read| read.page.texture() == texture).count()
    }

    /// Why a lane on trial may begin no read, if it may not: so many of the texture have not come back that
    /// one more would be a thread too many. Whoever gives a texture sources that never answer, one after the
    /// other, would have a thread for each. Now and then one may all the same, since a number is given again,
    /// and its next texture may lie where all is well.
    fn is_beyond_trial(&mut self, texture: TextureNumber, lane: LaneId) -> Option<usize> {
        if !self.lanes.is_on_trial(lane) {
            return None;
        }
        let reads = self.under_way_of(texture);
        if reads < TRIALS * self.reads_at_once() {
            self.tries.remove(&texture);
            return None;
        }
        let now = self.now;
        let (ask_at, pause) = self.tries.entry(texture).or_insert((now + FIRST_PAUSE, 2 * FIRST_PAUSE));
        if now < *ask_at {
            return Some(reads);
        }
        (*ask_at, *pause) = (now + *pause, (2 * *pause).min(LONGEST_PAUSE));
        None
    }

    /// Cancels every request of the texture. Reads under way keep the source until they end.
    pub(super) fn remove_source(&mut self, texture: TextureNumber) -> Option<Arc<dyn TileSource>> {
        let mut pages: Vec<_> =
            self.states.keys().copied().filter(|page| page.texture() == texture).collect();
        pages.sort_unstable();
        for page in pages {
            self.cancel(page);
        }
        let Source { source, lane, .. } = self.sources.remove(&texture)?;
        self.lanes.leave(lane);
        Some(source)
    }

    /// Queues a page, or changes its rank if it is queued already. A page that is being read stays as it is.
    pub(super) fn request(&mut self, page: PageId, rank: u64, now: Duration) {
        self.now = self.now.max(now);
        match self.states.get_mut(&page) {
            None => self.enqueue(page, rank),
            Some(State::Queued(_)) => self.rerank(page, rank),
            Some(State::Running { called_off: true, again, .. }) => *again = Some(rank),
            Some(State::Running { called_off: false, .. }) => {}
        }
    }

    /// Changes the rank of a queued page. A page that is being read, has ended or was never requested stays
    /// as it is.
    pub(super) fn rerank(&mut self, page: PageId, rank: u64) {
        if let Some(State::Queued(turn)) = self.states.get_mut(&page) {
            let before = *turn;
            turn.0 = rank;
            let after = *turn;
            if let Some(Source { lane, .. }) = self.sources.get(&page.texture()) {
                self.lanes.unqueue(*lane, before);
                self.lanes.queue(*lane, after, page);
            }
        }
    }

    /// Queues a page, or ends its request at once if it can only fail.
    fn enqueue(&mut self, page: PageId, rank: u64) {
        let Some(Source { source, lane, .. }) = self.sources.get(&page.texture()) else {
            return self.end(page, Err(LoadError::NoSource { texture: page.texture().number() }));
        };
        let (lane, dims) = (*lane, source.description().geometry.dims());
        let silent = self.lanes.admits(lane, self.now).err();
        if let Some(reads) = silent.or_else(|| self.is_beyond_trial(page.texture(), lane)) {
            let pos = page.pos(dims);
            return self.end(page, Err(self.silent(pos, reads)));
        }
        let turn = (rank, self.arrivals);
        self.arrivals += 1;
        self.lanes.queue(lane, turn, page);
        self.states.insert(page, State::Queued(turn));
    }

    fn silent(&self, pos: PagePos, reads: usize) -> LoadError {
        LoadError::SourceSilent { pos, reads, time_out: self.settings.time_out }
    }

    /// Cancels a request. Returns the read that may be dropped, if one is under way.
    pub(super) fn cancel(&mut self, page: PageId) -> Option<ReadId> {
        match self.states.get_mut(&page)? {
            State::Queued(turn) => {
                let turn = *turn;
                if let Some(Source { lane, .. }) = self.sources.get(&page.texture()) {
                    self.lanes.unqueue(*lane, turn);
                }
                self.states.remove(&page);
                self.end(page, Err(LoadError::Cancelled));
                None
            }
            State::Running { called_off: called_off @ false, read, .. } => {
                *called_off = true;
                Some(*read)
            }
            State::Running { again, .. } => {
                if again.take().is_some() {
                    self.end(page, Err(LoadError::Cancelled));
                }
                None
            }
        }
    }

    /// Returns true if a read may be begun.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn has_next(&self) -> bool {
        self.lanes.has_next()
    }

    /// Begins the read of the request whose turn it is, among those whose lane has room.
    pub(super) fn start_next(&mut self, now: Duration) -> Option<Job> {
        self.now = self.now.max(now);
        let (lane, page) = self.lanes.begin_next()?;
        let Source { source, .. } = self.sources.get(&page.texture())?;
        let (source, pos) = (source.clone(), page.pos(source.description().geometry.dims()));
        self.begun += 1;
        let read = ReadId(self.begun);
        self.reads
            .insert(read, Read { page, pos, lane, begun: self.now, is_overdue: false, has_lent: false });
        self.states.insert(page, State::Running { read, called_off: false, again: None });
        Some(Job { read, pos, source })
    }

    /// Ends a read that has come back, and its request with it, unless the read was overdue and the request
    /// has ended before.
    pub(super) fn finish(&mut self, read: ReadId, outcome: Outcome) {
        let Some(Read { page, lane, is_overdue, has_lent, .. }) = self.reads.remove(&read) else { return };
        self.lanes.end(lane, is_overdue, has_lent, matches!(outcome, Outcome::Answered(_)));
        if !is_overdue {
            let result = match outcome {
                Outcome::Answered(result) => result,
                Outcome::Dropped => Err(LoadError::Cancelled),
            };
            self.end_running(page, result);
        }
    }

    fn end_running(&mut self, page: PageId, result: Result<Bytes, LoadError>) {
        let Some(State::Running { called_off, again, .. }) = self.states.remove(&page) else { return };
        self.end(page, if called_off { Err(LoadError::Cancelled) } else { result });
        if let Some(rank) = again {
            self.enqueue(page, rank);
        }
    }

    fn end(&mut self, page: PageId, result: Result<Bytes, LoadError>) {
        self.finished.push_back(Loaded { page, result });
    }

    /// Sets the time. Returns the reads that have become overdue, each once: their requests have ended, and
    /// they may be dropped.
    pub(super) fn end_overdue(&mut self, now: Duration) -> Vec<ReadId> {
        self.now = self.now.max(now);
        let now = self.now;
        let due = |read: &Read| now.saturating_sub(read.begun) >= self.settings.time_out;
        let overdue: Vec<_> = self
            .reads
            .iter()
            .take_while(|(_, read)| read.is_overdue || due(read))
            .filter(|(_, read)| !read.is_overdue)
            .map(|(id, read)| (*id, read.page, read.pos, read.lane))
            .collect();
        for &(id, page, pos, lane) in &overdue {
            self.reads.entry(id).and_modify(|read| read.is_overdue = true);
            let (failing, reads) = self.lanes.overdue(lane, now);
            self.end_running(page, Err(LoadError::Overdue { pos, time_out: self.settings.time_out }));
            failing.into_iter().for_each(|page| self.fail_queued(page, reads));
        }
        overdue.into_iter().map(|(id, ..)| id).collect()
    }

    /// Sets that so many reads have lent their places that lanes share them.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn set_crowded(&mut self, is_crowded: bool) {
        for (page, reads) in self.lanes.set_crowded(is_crowded) {
            self.fail_queued(page, reads);
        }
    }

    /// Ends a request that its lane has given up.
    fn fail_queued(&mut self, page: PageId, reads: usize) {
        let Some(Source { source, .. }) = self.sources.get(&page.texture()) else { return };
        let pos = page.pos(source.description().geometry.dims());
        if matches!(self.states.get(&page), Some(State::Queued(_))) {
            self.states.remove(&page);
            self.end(page, Err(self.silent(pos, reads)));
        }
    }

    /// Reads that were begun so long ago and have not come back.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn begun_before(&self, age: Duration) -> impl Iterator<Item = ReadId> + '_ {
        let old = move |read: &&Read| self.now.saturating_sub(read.begun) >= age;
        self.reads.iter().take_while(move |(_, read)| old(read)).map(|(id, _)| *id)
    }

    /// Returns true if a read that was just begun is one of those that block their threads, as its source
    /// says.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn is_blocking(&self, read: ReadId) -> bool {
        let source = self.reads.get(&read).and_then(|read| self.sources.get(&read.page.texture()));
        source.is_some_and(|source| source.blocks)
    }

    /// Counts a read that has lent its place.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn lend(&mut self, read: ReadId) {
        if let Some(read) = self.reads.get_mut(&read)
            && !std::mem::replace(&mut read.has_lent, true)
        {
            self.lanes.lend(read.lane);
        }
    }

    pub(super) fn poll(&mut self) -> Option<Loaded> {
        self.finished.pop_front()
    }

    /// The number of requests that have not been polled yet.
    pub(super) fn outstanding(&self) -> usize {
        let again =
            self.states.values().filter(|state| matches!(state, State::Running { again: Some(_), .. }));
        self.states.len() + again.count() + self.finished.len()
    }

    /// Returns true if no request is queued or running.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn is_idle(&self) -> bool {
        self.states.is_empty()
    }

    /// Returns true if a read that has not come back was called off.
    pub(super) fn is_called_off(&self, read: ReadId) -> bool {
        let state = self.reads.get(&read).and_then(|read| self.states.get(&read.page));
        matches!(state, Some(State::Running { called_off: true, read: running, .. }) if *running == read)
    }
}
