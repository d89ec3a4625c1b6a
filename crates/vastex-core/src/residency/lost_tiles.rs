//! The device is lost, and every tile of the pool with it. The tails keep their slots; the caller puts their
//! tiles there again.
//!
//! Which pages failed, what the loader has and what is claimed is all still known.

use crate::residency::Residency;
use crate::residency::records::{Cancel, State};
use crate::texture::page::PageId;

impl Residency {
    /// `Resident -> Absent` for all but the tails. A refresh that the loader has becomes the page's first
    /// load.
    pub(crate) fn lose_tiles(&mut self) {
        let resident = self.records.iter().filter(|record| matches!(record.state, State::Resident(_)));
        let lost: Vec<PageId> =
            resident.filter(|record| !record.is_tail()).map(|record| record.page).collect();
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
        self.last_evicted = self.frame;
        self.sharing.lose_tiles();
        self.victims.clear();
    }
}
