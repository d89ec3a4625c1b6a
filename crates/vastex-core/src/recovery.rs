//! Recovery: the memory of a pool is gone, and what was in it is loaded again.
//!
//! What pages are wanted, which of them failed, what the loader has and what was asked for by hand is all still known; only tiles
//! are lost. The tails keep their slots, and are the caller's to put there again.

use crate::page::{PageId, TextureId};
use crate::pager::Pager;
use crate::pagers::Pagers;
use crate::pool::Slot;
use crate::records::{Cancel, State};
use crate::residency::Residency;
use crate::textures::page_id;

impl Pager {
    /// The pool is empty: its memory was lost. What is in view, pinned or held is queued anew; page-table changes that were not
    /// taken yet are forgotten, since page tables begin anew too, with nothing but their tails.
    ///
    /// Costs a visit of every page that has a state.
    pub fn tiles_lost(&mut self) {
        self.residency.evicted.clear();
        self.residency.settled.clear();
        self.residency.lose_tiles();
        self.work_out();
        self.plan_by_hand();
        self.check();
    }

    /// The slot of a texture's tail; nothing where there is no such texture.
    pub fn tail_slot(&self, texture: TextureId) -> Option<Slot> {
        let geometry = self.textures.geometry(texture)?;
        self.residency.slot_of(page_id(texture, geometry, geometry.tail_pos())?)
    }
}

impl Pagers {
    /// The pools are empty: the device that had them was lost. See [`Pager::tiles_lost`].
    pub fn tiles_lost(&mut self) {
        self.iter_mut().for_each(Pager::tiles_lost);
    }
}

impl Residency {
    /// `Resident -> Absent` for all but the tails. A refresh that the loader has becomes the page's first load.
    fn lose_tiles(&mut self) {
        let lost: Vec<PageId> =
            self.records.iter().filter(|record| record.is_lost()).map(|r| r.page).collect();
        for page in lost {
            if let Some(slot) = self.slot_of(page)
                && self.take_out(slot)
            {
                self.free.push(slot);
            }
            if self.refreshes.is_ready(page) {
                self.waste_one(page);
            }
            let is_loading = self.refreshes.becomes_first_load(page);
            if let Some(record) = self.records.get_mut(page) {
                record.state = if is_loading { State::Loading(Cancel::No) } else { State::Absent };
            }
        }
        self.records.retain(|record| {
            record.below = 0;
            record.state != State::Absent
        });
        self.sharing.lose_tiles();
        self.victims.clear();
    }
}

impl crate::records::Record {
    fn is_lost(&self) -> bool {
        matches!(self.state, State::Resident(_)) && self.wanted_round != u64::MAX
    }
}
