//! Residency: the state of every page, and which tile is in which slot.
//!
//! A page is in exactly one state. Pages without a record (`records`) are `Absent`.
//!
//! | from | to | when | costs |
//! |---|---|---|---|
//! | `Absent` | `Queued` | it enters the working set at the bias in force, or a prefetch or a prediction claims it | a record |
//! | `Queued` | `Loading` | its request is handed out; it may still wait in the loader's own queue | a load, and a tile's bytes of the in-flight budget |
//! | `Queued` | `Absent` | it leaves the working set | |
//! | `Loading` | `Ready` | its bytes are here, and it is still wanted | |
//! | `Loading` | `Failed` | the source could not give it | |
//! | `Loading` | `Absent` | it was called off, and the loader has answered, with or without its bytes | the load, wasted where the bytes came |
//! | `Loading` | `Queued` | it was called off, or its content has changed, and it is wanted again when the loader answers | |
//! | `Ready` | `Resident` | the upload budget allows it | a slot, an upload, perhaps an eviction; frees the in-flight bytes |
//! | `Ready` | `Absent` | it leaves the working set, or no slot can be had for it | the load, wasted |
//! | `Absent`, `Queued`, `Failed` | `Resident` | its content is in a slot already, as that of another page | |
//! | `Resident` | `Absent` | another page needs its slot | |
//! | `Failed` | `Queued` | its time has come, and it is wanted | |
//!
//! A page that has failed goes back to `Failed` where another would become `Absent`, so that its failures are
//! not forgotten until a load succeeds, or it is out of view for long (`failures`).
//!
//! A slot is chosen only when the bytes are here, so a load that fails leaks nothing. A page is not evicted
//! while it is in the working set at the bias in force, nor while a descendant of it is resident; a tail
//! never. Since the working set contains the ancestors of its pages and never fills the pool where the bias
//! is solved, there is a page out of view; one that may not go yet is waited for. Pages of one content share
//! a load and a slot (`slots`); that has one more holder with each, and is free when the last is evicted.
//!
//! A texture that is removed takes its pages with it, whatever their state; only what the loader has stays
//! `Loading`, called off and unwanted, until that answers.
//!
//! The pager decides which pages are wanted and in which order; `victims` chooses the page that gives up its
//! slot. This file makes the moves and counts them. To *call off* a load is to tell the loader that its tile
//! has no use any more.

#[cfg(feature = "checks")]
mod checks;
mod claimed;
pub(crate) mod failures;
pub(crate) mod flight;
pub(crate) mod foresight;
pub(crate) mod history;
pub(crate) mod loads;
pub(crate) mod lost_tiles;
mod moves;
pub(crate) mod page_map;
pub(crate) mod rank;
pub(crate) mod records;
pub(crate) mod refresh;
pub(crate) mod resize;
pub(crate) mod rest;
pub(crate) mod retention;
pub(crate) mod sharing;
pub(crate) mod slots;
pub(crate) mod stats;
pub(crate) mod time_to_sharp;
pub(crate) mod victims;

use std::collections::VecDeque;
use std::sync::Arc;

use bytes::Bytes;

use crate::residency::claimed::Claimed;
use crate::residency::failures::Failures;
use crate::residency::flight::Flight;
use crate::residency::moves::Moves;
use crate::residency::page_map::PageMap;
use crate::residency::records::{Cancel, Record, RecordHint, Records, State};
use crate::residency::refresh::Refreshes;
use crate::residency::rest::Rest;
use crate::residency::sharing::{ContentId, Sharing};
use crate::residency::slots::SlotUse;
use crate::residency::stats::Stats;
use crate::residency::time_to_sharp::RecentWaits;
use crate::residency::victims::Victims;
use crate::table::pool::Slot;
use crate::texture::page::{Dims, PageId, TextureNumber};
use crate::texture::page_contents::PageContents;
use crate::texture::textures::Textures;

/// Frames within which a tile loaded again after its eviction counts as reloaded.
const RELOAD_FRAMES: u64 = 60;

/// Loads called off at once for which there is room from the start: that is seldom exceeded, so frames
/// allocate nothing for more of them.
const CANCELS: usize = 64;

/// The state of a page, as an application sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PageState {
    /// Not wanted, not here.
    Absent,
    /// Wanted; not yet asked for.
    Queued,
    /// The loader has it.
    Loading,
    /// The page's bytes are here and wait for the upload budget.
    Ready,
    /// The page's tile is in a slot.
    Resident(Slot),
    /// The source could not give the page; it is tried again from this frame on.
    Failed {
        /// The first frame in which it may be tried again.
        until: u64,
    },
}

/// The state of every page and slot, and the moves between states.
#[derive(Debug)]
pub(crate) struct Residency {
    records: Records,
    /// The tiles of pages that are `Ready`.
    ready: PageMap<Bytes>,
    /// What is in each slot.
    slots: Vec<SlotUse>,
    free: Vec<Slot>,
    /// Which pages have the same content.
    sharing: Sharing,
    /// What page tables have yet to be told of.
    moves: Moves,
    /// Which page gives up its slot next.
    victims: Victims,
    /// Resident pages whose content has changed.
    refreshes: Refreshes,
    /// Pages held against what is out of view.
    claimed: Claimed,
    failing: Failures,
    /// What is given up while views rest.
    rest: Rest,
    /// The frame in which a page was evicted, and the evictions in order.
    evicted_at: PageMap<u64>,
    evictions: VecDeque<(u64, PageId)>,
    /// The last frame in which a page had to leave its slot.
    last_evicted: u64,
    /// Counts the working sets worked out so far: the unit of all ages.
    round: u64,
    /// Slots that held a tail when the last one was.
    tails_at_round: u32,
    frame: u64,
    stats: Stats,
    /// Frames from the feedback that wanted a page to its tile being in a slot.
    waits: RecentWaits,
    /// Frames from the request of a tile to its being in a slot.
    arrivals: RecentWaits,
    tile_bytes: u64,
    /// Bytes that a tile takes from its request until it is in a slot.
    flight_bytes: u64,
    flight: Flight,
    /// Loads that are called off, and of which the loader is to be told.
    cancels: VecDeque<PageId>,
}

impl Residency {
    pub(crate) fn new(slots: u32, tile_bytes: u64) -> Residency {
        Residency {
            records: Records::default(),
            ready: PageMap::default(),
            slots: vec![SlotUse::FREE; slots as usize],
            free: (0..slots).rev().map(Slot::new).collect(),
            sharing: Sharing::default(),
            moves: Moves::new(slots),
            victims: Victims::default(),
            refreshes: Refreshes::default(),
            claimed: Claimed::default(),
            failing: Failures::default(),
            rest: Rest::default(),
            evicted_at: PageMap::default(),
            evictions: VecDeque::new(),
            last_evicted: 0,
            tails_at_round: 0,
            round: 1, // so that a new record, of round 0, is new in the first round that is told
            frame: 0,
            stats: Stats { slots, ..Stats::default() },
            waits: RecentWaits::default(),
            arrivals: RecentWaits::default(),
            tile_bytes,
            flight_bytes: tile_bytes,
            flight: Flight::default(),
            cancels: VecDeque::with_capacity(CANCELS),
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
        self.tails_at_round = self.stats.tails;
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

    /// The slot that the page's tile is in.
    pub(crate) fn slot_of(&self, page: PageId) -> Option<Slot> {
        self.records.slot_of(page)
    }

    /// The pages whose tiles are in slots, and the slot of each. Costs a visit of every record.
    pub(crate) fn resident(&self) -> impl Iterator<Item = (PageId, Slot)> + '_ {
        self.records.iter().filter_map(|record| match record.state {
            State::Resident(slot) => Some((record.page, slot)),
            _ => None,
        })
    }

    /// Pages of which anything is known.
    pub(crate) fn known(&self) -> usize {
        self.records.len()
    }

    /// The pages of which anything is known, in no order.
    pub(crate) fn known_pages(&self) -> impl Iterator<Item = PageId> + '_ {
        self.records.iter().map(|record| record.page)
    }

    /// Pages in the page's slot, itself included; 0 where it is in none.
    pub(crate) fn pages_in_slot_of(&self, page: PageId) -> u32 {
        self.slot_of(page).map_or(0, |slot| self.slots[slot.index() as usize].pages)
    }

    /// What is counted and measured so far.
    pub(crate) fn stats(&self) -> &Stats {
        &self.stats
    }

    /// Slots of the pool, as of the last [`Residency::set_slots`].
    pub(crate) fn slot_count(&self) -> u32 {
        self.stats.slots
    }

    /// Bytes of a tile.
    pub(crate) fn tile_bytes(&self) -> u64 {
        self.tile_bytes
    }

    /// Slots that hold a tail.
    pub(crate) fn tails(&self) -> u32 {
        self.stats.tails
    }

    /// The frame that has begun.
    pub(crate) fn frame(&self) -> u64 {
        self.frame
    }

    /// The last frame in which a page had to leave its slot.
    pub(crate) fn last_evicted(&self) -> u64 {
        self.last_evicted
    }

    /// Which pages have the same content.
    pub(crate) fn sharing(&self) -> &Sharing {
        &self.sharing
    }

    /// Resident pages whose content has changed.
    pub(crate) fn refreshes(&self) -> &Refreshes {
        &self.refreshes
    }

    /// Frames from the feedback that wanted a page to its tile being in a slot.
    pub(crate) fn waits(&self) -> &RecentWaits {
        &self.waits
    }

    /// Frames from the request of a tile to its being in a slot.
    pub(crate) fn arrivals(&self) -> &RecentWaits {
        &self.arrivals
    }

    /// Takes note of what the view wants at the bias in force, ancestors included; `cut` where it has jumped.
    pub(crate) fn observe_view(
        &mut self,
        pages: impl Iterator<Item = PageId>,
        cut: bool,
        textures: &Textures,
    ) {
        self.victims.retention.observe(pages, cut, textures);
    }

    /// A texture says which of its pages are the same.
    pub(crate) fn add_contents(&mut self, texture: TextureNumber, dims: Dims, contents: Arc<PageContents>) {
        self.sharing.add(texture, dims, contents);
    }

    /// The page is like no other from now on.
    pub(crate) fn leave_content(&mut self, page: PageId) {
        self.sharing.leave(page);
    }

    /// A plan of what comes after the view begins.
    pub(crate) fn begin_plan(&mut self) {
        self.sharing.plan += 1;
    }

    /// Page tables begin anew: they are not told of what has moved so far.
    pub(crate) fn forget_table_changes(&mut self) {
        self.moves.forget_tables();
    }

    /// Where the page's record is, if it has one, and whether its tile is in a slot.
    pub(crate) fn find(&self, page: PageId, hint: RecordHint) -> (RecordHint, bool) {
        match self.records.find(page, hint) {
            Some(found) => (found, matches!(self.records.at(found).state, State::Resident(_))),
            None => (RecordHint::default(), false),
        }
    }

    /// Puts a tail into a slot for good.
    pub(crate) fn put_tail(&mut self, page: PageId, slot: Slot) {
        let record = self.records.get_or_add(page, RecordHint::default());
        (record.state, record.wanted_round) = (State::Resident(slot), Record::TAIL);
        self.put_in(slot, ContentId::NONE);
        self.stats.tails += 1;
    }

    /// The page is in the working set of this round; its record may be where `hint` says. Returns true if the
    /// page was not in the last round's.
    pub(crate) fn want(&mut self, page: PageId, content: ContentId, hint: RecordHint) -> bool {
        if let Some(content) = self.sharing.get_mut(content) {
            content.wanted_round = self.round;
        }
        let record = self.records.get_or_add(page, hint);
        let newly = record.wanted_round + 1 != self.round;
        (record.wanted_round, record.was_wanted) = (self.round, true);
        record.since = if newly { self.frame } else { record.since };
        record.use_for(self.frame);
        newly
    }

    /// The page is held, but not in the working set.
    pub(crate) fn hold(&mut self, page: PageId) {
        self.records.get_or_add(page, RecordHint::default()).use_for(self.frame);
    }

    /// Returns true if a tile that comes for the page has a use: it is in the working set of this round, or a
    /// prefetch or a prediction holds it, or another page of the content that it represents.
    pub(crate) fn has_use_for(&self, page: PageId, hint: RecordHint) -> bool {
        self.is_wanted(page, hint) || self.is_claimed(page) || self.represents_something_of_use(page)
    }

    /// Returns true if the last load of the page's content failed; it stays so while that is tried again.
    pub(crate) fn has_failed(&self, page: PageId) -> bool {
        let page = self.sharing.representative_of(page).unwrap_or(page);
        self.records.get(page).is_some_and(|record| record.failures > 0)
    }

    /// Returns true if a load has failed that is not forgotten yet.
    pub(crate) fn remembers_failures(&self) -> bool {
        !self.failing.is_empty()
    }

    /// Returns true if the page is in the working set of this round; its record may be where `hint` says.
    pub(crate) fn is_wanted(&self, page: PageId, hint: RecordHint) -> bool {
        self.records.find(page, hint).is_some_and(|at| self.records.at(at).wanted_round >= self.round)
    }

    /// Returns true if the page is in the working set of this round.
    pub(crate) fn is_in_view(&self, page: PageId) -> bool {
        self.is_wanted(page, RecordHint::default())
    }

    /// Returns true if a tile waits for a slot.
    pub(crate) fn has_ready(&self) -> bool {
        !self.ready.is_empty()
    }

    /// The page is not resident and has left the working set: it is dropped, or its load called off.
    pub(crate) fn leave_working_set(&mut self, page: PageId) {
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

    /// The page is not resident, and its load is worth nothing: it is dropped, or its load called off.
    pub(crate) fn call_off(&mut self, page: PageId) {
        self.leave_working_set(page);
        if self.state(page) == PageState::Loading {
            self.cancels.push_back(page);
        }
    }

    /// A load that the loader should call off; each comes once.
    pub(crate) fn poll_cancel(&mut self) -> Option<PageId> {
        while let Some(page) = self.cancels.pop_front() {
            if self.send_cancel(page) {
                return Some(page);
            }
        }
        None
    }

    /// Back to `Absent`, or, where loads have failed before, to a state that remembers it.
    pub(crate) fn drop_page(&mut self, page: PageId) {
        match self.records.get_mut(page) {
            Some(record) if record.failures > 0 => record.state = State::Failed,
            Some(record) if record.below > 0 => {
                (record.state, record.wanted_round) = (State::Absent, 0);
                self.sharing.release_representative(page);
            }
            _ => {
                self.records.remove(page);
                self.sharing.release_representative(page);
            }
        }
    }

    /// Forgets everything of a texture, its tail too, but the loads that the loader has: they are called off.
    /// Gives how many.
    pub(crate) fn forget(&mut self, texture: TextureNumber) -> u32 {
        let is_other = |page: &PageId| page.texture() != texture;
        let (mut loads, mut ready, mut for_view, mut tails, mut left) = (Vec::new(), 0, 0, 0, Vec::new());
        self.records.retain(|record| {
            let is_tail = record.is_tail();
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
                    tails += u32::from(is_tail);
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
        self.stats.tails -= tails;
        self.moves.forget(texture);
        self.claimed.forget(texture);
        self.evicted_at.retain(|page, _| is_other(&page));
        self.evictions.retain(|(_, page)| is_other(page));
        self.victims.clear();
        self.victims.retention.forget(texture);
        loads.sort_unstable();
        let under_way = loads.len() as u32;
        self.cancels.extend(loads);
        under_way
    }
}
