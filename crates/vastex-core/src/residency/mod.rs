//! Residency: the state of every page, and which tile is in which slot.
//!
//! A page is in exactly one state. Pages without a record (`records`) are `Absent`.
//!
//! | from | to | when | costs |
//! |---|---|---|---|
//! | `Absent` | `Queued` | it enters the working set at the bias in force | a record |
//! | `Queued` | `Loading` | the loader takes it | a load, and a tile's bytes of the in-flight budget |
//! | `Queued` | `Absent` | it leaves the working set | |
//! | `Loading` | `Ready` | its bytes are here, and it is still wanted | |
//! | `Loading` | `Failed` | the source could not give it | |
//! | `Loading` | `Absent` | it was no longer wanted, and the loader has let go of it | |
//! | `Ready` | `Resident` | the upload budget allows it | a slot, an upload, perhaps an eviction; frees the in-flight bytes |
//! | `Ready` | `Absent` | it leaves the working set | the load, wasted |
//! | `Absent`, `Queued`, `Failed` | `Resident` | its content is in a slot already, as that of another page | |
//! | `Resident` | `Absent` | another page needs its slot | |
//! | `Failed` | `Queued` | its time has come, and it is wanted | |
//!
//! A page that has failed goes back to `Failed` where another would become `Absent`, so that its failures are not
//! forgotten until a load succeeds, or it is out of view for long (`failures`).
//!
//! A slot is chosen only when the bytes are here, so a load that fails leaks nothing. A page is not evicted while it
//! is in the working set at the bias in force, nor while a descendant of it is resident; a tail never. Since the working
//! set contains the ancestors of its pages and never fills the pool, a victim always exists. Pages of one content share a load
//! and a slot (`slots`); that has one more holder with each, and is free when the last is evicted.
//!
//! A texture that is removed takes its pages with it, whatever their state; only what the loader has stays `Loading`, called off
//! and unwanted, until that answers.
//!
//! Which pages are wanted, in which order, and which page gives up its slot (`victims`) is decided elsewhere; here the moves are made and counted.

pub(crate) mod failures;
pub(crate) mod flight;
pub(crate) mod foresight;
pub(crate) mod page_map;
pub(crate) mod rank;
pub(crate) mod records;
pub(crate) mod recovery;
pub(crate) mod refresh;
pub(crate) mod resize;
pub(crate) mod retention;
pub(crate) mod sharing;
pub(crate) mod slots;
pub(crate) mod stats;
pub(crate) mod victims;
pub(crate) mod waits;

use bytes::Bytes;
use std::collections::VecDeque;

use crate::pager::prediction::Expectation;
use crate::pager::tickets::Tickets;
use crate::residency::failures::Failures;
use crate::residency::flight::Flight;
use crate::residency::page_map::PageMap;
use crate::residency::rank::RankClass;
use crate::residency::records::{Cancel, RecordHint, Records, State};
use crate::residency::refresh::Refreshes;
use crate::residency::sharing::{ContentId, Sharing};
use crate::residency::slots::Holding;
use crate::residency::stats::Stats;
use crate::residency::victims::Victims;
use crate::residency::waits::Waits;
use crate::shader_constants::JITTER_CYCLE;
use crate::table::pool::{PoolId, Slot};
use crate::texture::page::{PageId, TextureId};
use crate::texture::textures::Textures;

/// Frames within which a tile loaded again after its eviction counts as reloaded.
const RELOAD_FRAMES: u64 = 60;
/// Frames that a tile which failed once waits before it is tried again; doubled at each further failure.
const FIRST_BACK_OFF: u64 = 2 * JITTER_CYCLE as u64;
/// How often the wait is doubled at most: about five minutes at 60 frames a second.
const DOUBLINGS: u32 = 9;

/// Pages that leave or get a slot in a frame for which there is memory from the beginning.
const MOVES: u32 = 1024;

/// Frames until a load is tried again after it and so many before it have failed.
pub(crate) fn back_off(failures: u32) -> u64 {
    FIRST_BACK_OFF << failures.min(DOUBLINGS)
}

/// The state of a page, as an application sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PageState {
    /// Not wanted, not here.
    Absent,
    /// Wanted; not yet asked for.
    Queued,
    /// The loader has it.
    Loading,
    /// Its bytes are here and wait for the upload budget.
    Ready,
    /// Its tile is in a slot.
    Resident(Slot),
    /// Its source could not give it; it is tried again from this frame on.
    Failed {
        /// The first frame in which it may be tried again.
        until: u64,
    },
}

/// See the head of the file.
#[derive(Debug)]
pub(crate) struct Residency {
    pub(crate) records: Records,
    /// The tiles of pages that are `Ready`.
    ready: PageMap<Bytes>,
    /// What is in each slot.
    pub(crate) slots: Vec<Holding>,
    pub(crate) free: Vec<Slot>,
    /// Which pages have the same content.
    pub(crate) sharing: Sharing,
    /// Pages that have left their slots, and those that have come into one, since page tables were told.
    pub(crate) evicted: Vec<(PageId, Slot)>,
    pub(crate) settled: Vec<PageId>,
    /// Pages that had failed, and share a slot now.
    pub(crate) recovered: Vec<PageId>,
    /// Which of them goes next.
    pub(crate) victims: Victims,
    /// Resident pages whose content has changed.
    pub(crate) refreshes: Refreshes,
    /// What the application has asked for by hand.
    pub(crate) tickets: Tickets,
    /// What the view is expected to want.
    pub(crate) expected: Expectation,
    pub(crate) failing: Failures,
    pub(crate) evicted_at: PageMap<u64>,
    pub(crate) evictions: VecDeque<(u64, PageId)>,
    /// Counts the working sets worked out so far.
    pub(crate) round: u64,
    /// Slots that held a tail when the last one was.
    pub(crate) pinned_at_round: u32,
    pub(crate) frame: u64,
    pub(crate) stats: Stats,
    pub(crate) waits: Waits,
    /// Frames from the request of a tile to its being in a slot.
    pub(crate) arrivals: Waits,
    pub(crate) tile_bytes: u64,
    /// Bytes that a tile takes from its request until it is in a slot.
    pub(crate) flight_bytes: u64,
    pub(crate) flight: Flight,
}

impl Residency {
    pub(crate) fn new(pool: PoolId, slots: u32, tile_bytes: u64) -> Residency {
        Residency {
            records: Records::default(),
            ready: PageMap::default(),
            slots: vec![Holding::FREE; slots as usize],
            free: (0..slots).rev().map(Slot::new).collect(),
            sharing: Sharing::default(),
            // How many there are in a frame varies more than what is in the pool.
            evicted: Vec::with_capacity(slots.min(MOVES) as usize),
            settled: Vec::with_capacity(slots.min(MOVES) as usize),
            recovered: Vec::new(),
            victims: Victims::default(),
            refreshes: Refreshes::default(),
            tickets: Tickets::new(pool),
            expected: Expectation::default(),
            failing: Failures::default(),
            evicted_at: PageMap::default(),
            evictions: VecDeque::new(),
            pinned_at_round: 0,
            round: 1, // so that a new record, of round 0, is new in the first round that is told
            frame: 0,
            stats: Stats { slots, ..Stats::default() },
            waits: Waits::default(),
            arrivals: Waits::default(),
            tile_bytes,
            flight_bytes: tile_bytes,
            flight: Flight::default(),
        }
    }

    /// Sets the clock, and forgets evictions that a load can no longer undo in time.
    pub(crate) fn begin_frame(&mut self, frame: u64) {
        self.frame = frame;
        self.forget_failures();
        while let Some(&(at, page)) = self.evictions.front().filter(|(at, _)| at + RELOAD_FRAMES < frame) {
            self.evictions.pop_front();
            if self.evicted_at.get(page) == Some(&at) {
                self.evicted_at.remove(page);
            }
        }
    }

    /// A new working set is about to be told by [`Residency::want`].
    pub(crate) fn begin_round(&mut self) {
        self.round += 1;
        self.pinned_at_round = self.stats.pinned;
    }

    pub(crate) fn state(&self, page: PageId) -> PageState {
        let Some(record) = self.records.get(page) else { return PageState::Absent };
        match record.state {
            State::Absent => PageState::Absent,
            State::Queued => PageState::Queued,
            State::Loading(_) => PageState::Loading,
            State::Ready => PageState::Ready,
            State::Resident(slot) => PageState::Resident(slot),
            State::Failed => PageState::Failed { until: record.retry_at },
        }
    }

    pub(crate) fn slot_of(&self, page: PageId) -> Option<Slot> {
        match self.records.get(page)?.state {
            State::Resident(slot) => Some(slot),
            _ => None,
        }
    }

    /// Where the page's record is, if it has one, and whether its tile is in a slot.
    pub(crate) fn find(&self, page: PageId, hint: RecordHint) -> (RecordHint, bool) {
        match self.records.find(page, hint) {
            Some(found) => (found, matches!(self.records.at(found).state, State::Resident(_))),
            None => (RecordHint::default(), false),
        }
    }

    /// A slot that holds nothing.
    pub(crate) fn take_free_slot(&mut self) -> Option<Slot> {
        self.free.pop()
    }

    /// Puts a tail into a slot for good.
    pub(crate) fn pin(&mut self, page: PageId, slot: Slot) {
        let record = self.records.get_or_add(page, RecordHint::default());
        (record.state, record.wanted_round) = (State::Resident(slot), u64::MAX);
        self.put_in(slot, ContentId::NONE);
        self.stats.pinned += 1;
    }

    /// The page is in the working set of this round; its record may be where `hint` says. Says whether the page was not in the
    /// last round's.
    pub(crate) fn want(&mut self, page: PageId, content: ContentId, hint: RecordHint) -> bool {
        if let Some(content) = self.sharing.get_mut(content) {
            content.wanted_round = self.round;
        }
        let record = self.records.get_or_add(page, hint);
        let newly = record.wanted_round + 1 != self.round;
        record.wanted_round = self.round;
        record.since = if newly { self.frame } else { record.since };
        record.use_for(self.frame);
        newly
    }

    /// The page is held, but not in the working set.
    pub(crate) fn hold(&mut self, page: PageId) {
        self.records.get_or_add(page, RecordHint::default()).use_for(self.frame);
    }

    /// Whether a tile that comes for the page has a use: it is in the working set of this round, or a prefetch or a prediction
    /// holds it, or another page whose content it carries.
    pub(crate) fn has_use_for(&self, page: PageId, hint: RecordHint) -> bool {
        self.is_wanted(page, hint) || self.is_held(page) || self.carries_something_of_use(page)
    }

    /// Whether a prefetch or a prediction holds the page against what is out of view.
    pub(crate) fn is_held(&self, page: PageId) -> bool {
        self.tickets.holds(page) || self.expected.holds(page)
    }

    /// Whether the last load of the page's content failed; it stays so while that is tried again.
    pub(crate) fn has_failed(&self, page: PageId) -> bool {
        let page = self.sharing.carrier_of(page).unwrap_or(page);
        self.records.get(page).is_some_and(|record| record.failures > 0)
    }

    /// Whether the page is in the working set of this round; its record may be where `hint` says.
    pub(crate) fn is_wanted(&self, page: PageId, hint: RecordHint) -> bool {
        self.records.find(page, hint).is_some_and(|at| self.records.at(at).wanted_round >= self.round)
    }

    /// Whether a tile waits for a slot.
    pub(crate) fn has_ready(&self) -> bool {
        !self.ready.is_empty()
    }

    /// The page is not resident and has left the working set: it is dropped, or its load called off.
    pub(crate) fn unwant(&mut self, page: PageId) {
        let Some(record) = self.records.get_mut(page) else { return };
        match record.state {
            State::Queued => self.drop_page(page),
            State::Loading(Cancel::No) => record.state = State::Loading(Cancel::Due),
            State::Ready => {
                self.ready.remove(page);
                self.waste_one(page);
                self.drop_page(page);
            }
            State::Absent | State::Loading(_) | State::Resident(_) | State::Failed => {}
        }
    }

    /// Back to `Absent`, or, where loads have failed before, to a state that remembers it.
    pub(crate) fn drop_page(&mut self, page: PageId) {
        match self.records.get_mut(page) {
            Some(record) if record.failures > 0 => record.state = State::Failed,
            Some(record) if record.below > 0 => {
                (record.state, record.wanted_round) = (State::Absent, 0);
                self.sharing.lay_down(page);
            }
            _ => {
                self.records.remove(page);
                self.sharing.lay_down(page);
            }
        }
    }

    /// `Queued -> Loading`, asked for with this rank.
    pub(crate) fn begin_load(&mut self, page: PageId, rank: u64) -> bool {
        let Some(record) = self.records.get_mut(page).filter(|r| r.state == State::Queued) else {
            return false;
        };
        record.state = State::Loading(Cancel::No);
        (record.asked_at, record.rank) = (self.frame, RankClass::of(rank));
        if let Some(content) = self.sharing.content_of(page) {
            content.carrier = page;
        }
        self.enter_flight(page.texture());
        if RankClass::of(rank).is_for_view() {
            self.fly_for_view(page);
        }
        true
    }

    /// Hands out a cancellation that is due.
    pub(crate) fn send_cancel(&mut self, page: PageId) -> bool {
        let Some(record) = self.records.get_mut(page) else { return false };
        let due = record.state == State::Loading(Cancel::Due);
        if due {
            record.state = State::Loading(Cancel::Sent);
        }
        due
    }

    /// `Loading -> Ready`, or `Absent` where the page is no longer wanted. Says whether it is `Ready`.
    pub(crate) fn loaded(&mut self, page: PageId, bytes: Bytes) -> bool {
        let wanted = self.has_use_for(page, RecordHint::default());
        let is_stale = self.refreshes.take_stale(page);
        let Some(record) = self.records.get_mut(page) else { return false };
        if !matches!(record.state, State::Loading(_)) {
            return self.refresh_loaded(page, &bytes);
        }
        if wanted && !is_stale {
            record.state = State::Ready;
            self.ready.insert(page, bytes);
            self.flight.note_answer(page.texture(), self.frame);
            return true;
        }
        record.state = State::Queued;
        self.waste_one(page);
        if !wanted {
            self.drop_page(page);
        }
        false
    }

    /// `Loading -> Failed`. Says whether this is the first failure in a row.
    pub(crate) fn load_failed(&mut self, page: PageId) -> bool {
        let frame = self.frame;
        self.refreshes.take_stale(page);
        let Some(record) = self.records.get_mut(page) else { return false };
        if !matches!(record.state, State::Loading(_)) {
            return self.refresh_failed(page).unwrap_or(false);
        }
        let wait = back_off(u32::from(record.failures));
        record.failures = record.failures.saturating_add(1);
        record.retry_at = frame + wait;
        record.state = State::Failed;
        let (failures, retry_at) = (record.failures, record.retry_at);
        let first = failures == 1;
        self.failing.note(page, failures, frame, retry_at);
        self.stats.failures += 1;
        self.leave_flight(page);
        first
    }

    /// The loader has let go of a load: `Loading -> Absent`, or `Queued` where the page is wanted again.
    pub(crate) fn load_cancelled(&mut self, page: PageId) {
        let wanted = self.has_use_for(page, RecordHint::default());
        self.refreshes.take_stale(page);
        let Some(record) = self.records.get_mut(page) else { return };
        if !matches!(record.state, State::Loading(_)) {
            self.refresh_cancelled(page);
            return;
        }
        record.state = State::Queued;
        self.stats.cancelled += 1;
        self.leave_flight(page);
        if !wanted {
            self.drop_page(page);
        }
    }

    /// Forgets everything of a texture, its tail too, but the loads that the loader has: they are called off, and returned.
    pub(crate) fn forget(&mut self, texture: TextureId) -> Vec<PageId> {
        let is_other = |page: &PageId| page.texture() != texture;
        let (mut loads, mut ready, mut for_view, mut tails, mut left) = (Vec::new(), 0, 0, 0, Vec::new());
        self.records.retain(|record| {
            match &mut record.state {
                _ if is_other(&record.page) => return true,
                State::Loading(cancel) => {
                    if *cancel == Cancel::No {
                        *cancel = Cancel::Due;
                    }
                    (record.wanted_round, record.failures, record.below) = (0, 0, 0);
                    loads.push(record.page);
                    return true;
                }
                State::Ready => {
                    ready += 1;
                    for_view += u32::from(record.for_view);
                }
                State::Resident(slot) => {
                    tails += u32::from(record.wanted_round == u64::MAX);
                    left.push(*slot);
                }
                State::Absent | State::Queued | State::Failed => {}
            }
            false
        });
        self.ready.retain(|page, _| is_other(&page));
        for slot in left {
            if self.take_out(slot) {
                self.free.push(slot);
            }
        }
        self.sharing.remove(texture);
        let (refreshing, refreshed) = self.refreshes.forget(texture);
        for &page in &refreshing {
            self.records.get_or_add(page, RecordHint::default()).state = State::Loading(Cancel::Due);
        }
        loads.extend(refreshing);
        self.stats.wasted += u64::from(ready + refreshed);
        self.leave_flight_of(texture, ready + refreshed, for_view);
        self.stats.pinned -= tails;
        self.evicted_at.retain(|page, _| is_other(&page));
        self.evictions.retain(|(_, page)| is_other(page));
        self.victims.clear();
        self.victims.retention.forget(texture);
        loads.sort_unstable();
        loads
    }

    /// The tile of a page that waited for a slot is out of date.
    pub(crate) fn discard_ready(&mut self, page: PageId) {
        self.ready.remove(page);
        self.waste_one(page);
    }

    /// `Ready -> Resident`, into a slot of [`Residency::take_slot`]; gives the tile's bytes, and whether the page had
    /// failed before.
    pub(crate) fn settle(&mut self, page: PageId, slot: Slot, textures: &Textures) -> Option<(Bytes, bool)> {
        let bytes = self.ready.remove(page)?;
        let content = self.sharing.of(page);
        let was_evicted = match self.sharing.get_mut(content) {
            Some(content) => {
                content.carrier = PageId::NONE;
                content.evicted_at.take().is_some_and(|at| at + RELOAD_FRAMES >= self.frame)
            }
            None => self.evicted_at.remove(page).is_some(),
        };
        self.put_in(slot, content);
        let asked_at = self.records.get_mut(page).map_or(self.frame, |record| record.asked_at);
        self.arrivals.note(self.frame - asked_at);
        let recovered = self.become_resident(page, slot, textures);
        self.settled.push(page);
        self.leave_flight(page);
        self.stats.loaded += 1;
        self.stats.uploaded_bytes += self.tile_bytes;
        self.stats.reloaded += u64::from(was_evicted);
        Some((bytes, recovered))
    }

    /// The page's tile is in a slot now. Says whether it had failed before.
    pub(crate) fn become_resident(&mut self, page: PageId, slot: Slot, textures: &Textures) -> bool {
        let record = self.records.get_or_add(page, RecordHint::default());
        record.state = State::Resident(slot);
        record.settled_at = self.frame;
        let recovered = std::mem::take(&mut record.failures) > 0;
        if record.wanted_round >= self.round {
            let waited = self.frame - record.since;
            self.waits.note(waited);
            self.stats.waited_frames += waited;
        } else {
            // What a prefetch has brought is as good as what was in view a moment ago.
            record.wanted_round = self.round - 1;
        }
        for ancestor in textures.ancestors(page) {
            self.records.get_or_add(ancestor, RecordHint::default()).below += 1;
        }
        recovered
    }
}
