//! Lanes: the sources that share a limit of reads, their requests, and how they have answered.
//!
//! A lane may have so many reads at once. It is *silent* when so many have gone overdue since it last
//! answered, when so many that are overdue have not returned, or, while the loader is crowded, when one such
//! read has not. The requests of a silent lane fail at once, so that they keep nothing from others. One read
//! at a time tries whether the lane answers again: after a pause of a second, and twice as long after each
//! such read in vain, up to about a minute. Any read that answers, however late, ends the silence.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use rustc_hash::FxHashMap;
use vastex_core::PageId;

use crate::stores::ReadLimit;

/// Where a queued request stands: by rank, and by arrival among equals.
pub(super) type Turn = (u64, u64);

/// Names a lane; never reused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct LaneId(u64);

/// With so many reads that have lent their places, sources share what there is: each may have its part of so
/// many under way, one at least. Each such read is a thread.
#[cfg(not(target_family = "wasm"))]
pub(super) const CROWD: usize = 256;

/// Who has not answered is asked again after this, and after twice as long each time, up to the longest.
pub(super) const FIRST_PAUSE: Duration = Duration::from_secs(1);
pub(super) const LONGEST_PAUSE: Duration = Duration::from_secs(64);

struct Lane {
    /// Reads that may be under way at once, where the lane is not on trial.
    most: usize,
    /// Set until a read answers, for a source that came in the place of one whose reads had not come back:
    /// it may be as dead, and each of its reads a thread more.
    is_on_trial: bool,
    /// Set when a read answers, until one is overdue.
    is_proven: bool,
    /// Reads under way that have no place.
    lent: usize,
    queued: BTreeMap<Turn, PageId>,
    /// Reads that were begun and have not come back, overdue ones included.
    under_way: usize,
    overdue: usize,
    /// Reads that went overdue since a read last answered.
    unanswered: usize,
    /// When a silent lane is asked again.
    ask_at: Duration,
    pause: Duration,
    sources: usize,
    /// Kept alive, so that no other limit gets its address.
    limit: Option<Arc<ReadLimit>>,
}

impl Lane {
    /// Reads that may be under way at once.
    fn most(&self) -> usize {
        if self.is_on_trial { 1 } else { self.most }
    }

    /// The turn of the request that would be begun next, or `None` if none may be.
    fn head(&self) -> Option<Turn> {
        let (&turn, _) = self.queued.first_key_value()?;
        (self.under_way < self.most()).then_some(turn)
    }

    fn is_silent(&self, is_crowded: bool) -> bool {
        self.unanswered >= self.most() || self.overdue >= self.most() || is_crowded && self.overdue > 0
    }
}

#[derive(Default)]
pub(super) struct Lanes {
    lanes: FxHashMap<LaneId, Lane>,
    /// The lane of each limit that sources share, by the limit's address.
    shared: FxHashMap<usize, LaneId>,
    /// The heads of all lanes that have one.
    heads: BTreeSet<(Turn, LaneId)>,
    made: u64,
    /// Set while so many reads have lent their places that lanes share them.
    is_crowded: bool,
    /// Lanes of which reads have lent their places.
    lending: usize,
}

impl Lanes {
    /// The lane of a new source: that of `limit`, or a lane of its own with at most `most` reads at once,
    /// which is on trial if so wished.
    pub(super) fn enter(&mut self, limit: Option<&Arc<ReadLimit>>, most: usize, is_on_trial: bool) -> LaneId {
        let address = limit.map(|limit| Arc::as_ptr(limit).addr());
        let known = address.and_then(|address| self.shared.get(&address).copied());
        let id = known.unwrap_or_else(|| {
            self.made += 1;
            let lane = Lane {
                most: limit.map_or(most, |limit| limit.reads()).max(1),
                is_on_trial,
                is_proven: false,
                lent: 0,
                queued: BTreeMap::new(),
                under_way: 0,
                overdue: 0,
                unanswered: 0,
                ask_at: Duration::ZERO,
                pause: FIRST_PAUSE,
                sources: 0,
                limit: limit.cloned(),
            };
            self.lanes.insert(LaneId(self.made), lane);
            address.map(|address| self.shared.insert(address, LaneId(self.made)));
            LaneId(self.made)
        });
        self.change(id, |lane| lane.sources += 1);
        id
    }

    /// Removes a source, whose requests have ended.
    pub(super) fn leave(&mut self, id: LaneId) {
        self.change(id, |lane| lane.sources -= 1);
    }

    /// Changes a lane and updates what depends on it: its head, and its removal when nothing needs it.
    fn change<R>(&mut self, id: LaneId, change: impl FnOnce(&mut Lane) -> R) -> Option<R> {
        let lane = self.lanes.get_mut(&id)?;
        let before = lane.head();
        let result = change(lane);
        let after = lane.head();
        if before != after {
            before.map(|turn| self.heads.remove(&(turn, id)));
            after.map(|turn| self.heads.insert((turn, id)));
        }
        if lane.sources == 0 && lane.under_way == 0 && lane.queued.is_empty() {
            let limit = self.lanes.remove(&id).and_then(|lane| lane.limit);
            limit.map(|limit| self.shared.remove(&Arc::as_ptr(&limit).addr()));
        }
        Some(result)
    }

    /// Ok if a request may be queued now; otherwise the number of reads that have had no answer.
    pub(super) fn admits(&self, id: LaneId, now: Duration) -> Result<(), usize> {
        let Some(lane) = self.lanes.get(&id).filter(|lane| lane.is_silent(self.is_crowded)) else {
            return Ok(());
        };
        let nothing_is_awaited = lane.queued.is_empty() && lane.under_way == lane.overdue;
        let may_begin = lane.under_way < if self.is_crowded { 1 } else { lane.most() };
        match nothing_is_awaited && may_begin && now >= lane.ask_at {
            true => Ok(()),
            false => Err(lane.unanswered.max(lane.overdue)),
        }
    }

    pub(super) fn queue(&mut self, id: LaneId, turn: Turn, page: PageId) {
        self.change(id, |lane| lane.queued.insert(turn, page));
    }

    pub(super) fn unqueue(&mut self, id: LaneId, turn: Turn) {
        self.change(id, |lane| lane.queued.remove(&turn));
    }

    fn next(&self) -> Option<LaneId> {
        let may_begin =
            |id: &LaneId| !self.is_crowded || self.lanes.get(id).is_some_and(|l| self.has_part(l));
        self.heads.iter().map(|(_, id)| *id).find(may_begin)
    }

    /// Returns true if a lane may begin a read in a crowd: it has less than its part of the places that are
    /// lent, or it answers so soon that it has lent none.
    fn has_part(&self, lane: &Lane) -> bool {
        #[cfg(not(target_family = "wasm"))]
        let part = (CROWD / self.lending.max(1)).max(1);
        #[cfg(target_family = "wasm")]
        let part = 1;
        lane.under_way < part || lane.is_proven && lane.lent == 0
    }

    /// Returns true if no read of the lane has answered yet, and it came in the place of one that had not
    /// answered either.
    pub(super) fn is_on_trial(&self, id: LaneId) -> bool {
        self.lanes.get(&id).is_some_and(|lane| lane.is_on_trial)
    }

    /// A read of the lane has lent its place.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn lend(&mut self, id: LaneId) {
        let lent = self.change(id, |lane| {
            lane.lent += 1;
            lane.lent
        });
        self.lending += usize::from(lent == Some(1));
    }

    /// Returns true if a read may be begun.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn has_next(&self) -> bool {
        self.next().is_some()
    }

    /// Begins the read of the request whose turn it is.
    pub(super) fn begin_next(&mut self) -> Option<(LaneId, PageId)> {
        let id = self.next()?;
        let first = self.change(id, |lane| {
            lane.under_way += 1;
            lane.queued.pop_first()
        });
        first.flatten().map(|(_, page)| (id, page))
    }

    /// Ends a read that has come back. It has `answered` unless it was given up and dropped.
    pub(super) fn end(&mut self, id: LaneId, was_overdue: bool, had_lent: bool, answered: bool) {
        let lent = self.change(id, |lane| {
            lane.under_way -= 1;
            lane.overdue -= usize::from(was_overdue);
            lane.lent -= usize::from(had_lent);
            if answered {
                (lane.unanswered, lane.pause) = (0, FIRST_PAUSE);
                (lane.is_on_trial, lane.is_proven) = (false, true);
            }
            lane.lent
        });
        self.lending -= usize::from(had_lent && lent == Some(0));
    }

    /// Counts a read that has not come back as overdue. If the lane is silent now, returns the requests that
    /// fail with it, and the number of reads that have had no answer.
    pub(super) fn overdue(&mut self, id: LaneId, now: Duration) -> (Vec<PageId>, usize) {
        let is_crowded = self.is_crowded;
        let failing = self.change(id, |lane| {
            (lane.overdue, lane.unanswered) = (lane.overdue + 1, lane.unanswered + 1);
            lane.is_proven = false;
            if !lane.is_silent(is_crowded) {
                return (Vec::new(), 0);
            }
            lane.ask_at = now + lane.pause;
            lane.pause = (2 * lane.pause).min(LONGEST_PAUSE);
            let failing = std::mem::take(&mut lane.queued).into_values().collect();
            (failing, lane.unanswered.max(lane.overdue))
        });
        failing.unwrap_or_default()
    }

    /// Sets that so many reads have lent their places that lanes share them. Returns the requests
    /// that fail by that, those of lanes with overdue reads, each with the number of these reads.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn set_crowded(&mut self, is_crowded: bool) -> Vec<(PageId, usize)> {
        if std::mem::replace(&mut self.is_crowded, is_crowded) == is_crowded || !is_crowded {
            return Vec::new();
        }
        let owing = self.lanes.iter().filter(|(_, lane)| lane.overdue > 0 && !lane.queued.is_empty());
        let mut owing: Vec<LaneId> = owing.map(|(id, _)| *id).collect();
        owing.sort_unstable();
        let failing = owing.into_iter().filter_map(|id| {
            self.change(id, |lane| {
                let owed = lane.overdue;
                std::mem::take(&mut lane.queued).into_values().map(move |page| (page, owed))
            })
        });
        failing.flatten().collect()
    }
}
