//! What a pool gives up while its views rest, so that no tile comes into a slot twice in that time.
//!
//! A page whose tile came while the views rest, and that had to make room since, is *given up*: until they
//! move it is no part of the working set, and the mip bias is at least so large that nobody misses it
//! (`pager/rest`). Until it is known what the views want at rest none of these pages makes room, and an
//! upload that finds no other waits; after that they go after all that was there before, the finest first.
//! Tiles that several pages may have are not given up, since too many places might miss one, nor is what
//! makes room for a page that no view wants.

use crate::residency::Residency;
use crate::residency::page_map::PageMap;
use crate::residency::records::{Record, State};
use crate::texture::page::PageId;

/// Pages that are known to be given up at most; what is given up beyond them may come again.
const MOST_GIVEN_UP: usize = 1 << 16;

/// What a pool gives up while its views rest.
#[derive(Debug, Default)]
pub(crate) struct Rest {
    /// The frame from which on they do.
    since: Option<u64>,
    /// What has come since then stays whatever happens.
    keeps_all: bool,
    given_up: PageMap<()>,
}

impl Rest {
    /// Returns true if the page's tile came while the views rest, and one of them has wanted it.
    pub(super) fn has_brought(&self, record: &Record) -> bool {
        self.since.is_some_and(|since| record.settled_at >= since && record.was_wanted)
    }

    /// Returns true if a page may not make room yet.
    pub(super) fn keeps(&self, record: &Record) -> bool {
        self.keeps_all && self.has_brought(record)
    }

    /// A page that is like no other makes room.
    pub(super) fn note_evicted(&mut self, record: &Record) {
        if self.has_brought(record) && self.given_up.len() < MOST_GIVEN_UP {
            self.given_up.insert(record.page, ());
        }
    }
}

impl Residency {
    /// The views rest from this frame on, or do not: what was given up may come again.
    pub(crate) fn begin_rest(&mut self, rests: bool) {
        let since = rests.then_some(self.frame);
        self.rest = Rest { since, keeps_all: rests, given_up: PageMap::default() };
    }

    /// Sets whether all that has come since the views rest stays whatever happens.
    pub(crate) fn keep_all_of_rest(&mut self, keeps_all: bool) {
        self.rest.keeps_all = keeps_all;
    }

    /// Returns true if what has come since the views rest stays whatever happens.
    pub(crate) fn keeps_all_of_rest(&self) -> bool {
        self.rest.keeps_all
    }

    /// How many slots make no room for what the views want, of pages out of view: those that share theirs
    /// left out. Costs a visit of every page that has a state, where any may stay.
    pub(crate) fn kept_from_views(&self) -> u32 {
        self.kept_out_of_view(|record| self.rest.keeps(record))
    }

    /// How many make no room for what the application asks for, with pages above others, and without those
    /// that it holds.
    pub(crate) fn kept_from_claims(&self) -> u32 {
        self.kept_out_of_view(|record| {
            (self.rest.keeps(record) || record.below > 0) && !self.claimed.has(record.page)
        })
    }

    fn kept_out_of_view(&self, is_kept: impl Fn(&Record) -> bool) -> u32 {
        if !self.rest.keeps_all {
            return 0;
        }
        let is_alone = |record: &Record| match record.state {
            State::Resident(slot) => self.slots[slot.index() as usize].pages == 1,
            _ => false,
        };
        let is_out_of_view = |record: &Record| record.age_out_of_view(self.round).is_some();
        let records = self.records.iter();
        records.filter(|record| is_out_of_view(record) && is_kept(record) && is_alone(record)).count() as u32
    }

    /// A page that made room may come again while the views rest: none of them gained by it.
    pub(crate) fn allow_again(&mut self, page: PageId) {
        self.rest.given_up.remove(page);
    }

    /// Returns true if the page was given up since the views rest.
    pub(crate) fn has_given_up(&self, page: PageId) -> bool {
        self.rest.given_up.get(page).is_some()
    }

    /// Returns true if any page was.
    pub(crate) fn has_given_up_any(&self) -> bool {
        !self.rest.given_up.is_empty()
    }
}
