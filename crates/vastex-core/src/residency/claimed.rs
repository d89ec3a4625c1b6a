//! How often each page is claimed against what is out of view. Who claims it, and until when, is the pager's
//! business (`pager/claims`).

use rustc_hash::{FxHashMap, FxHashSet};

use crate::residency::Residency;
use crate::texture::page::{PageId, TextureNumber};

/// How often each page is claimed.
#[derive(Debug, Default)]
pub(super) struct Claimed(FxHashMap<PageId, u32>);

impl Claimed {
    pub(super) fn has(&self, page: PageId) -> bool {
        self.0.contains_key(&page)
    }

    pub(super) fn forget(&mut self, texture: TextureNumber) {
        self.0.retain(|page, _| page.texture() != texture);
    }
}

impl Residency {
    /// The page is claimed once more.
    pub(crate) fn claim(&mut self, page: PageId) {
        *self.claimed.0.entry(page).or_insert(0) += 1;
    }

    /// A claim to the page ends.
    pub(crate) fn unclaim(&mut self, page: PageId) {
        if let Some(claims) = self.claimed.0.get_mut(&page) {
            *claims -= 1;
            if *claims == 0 {
                self.claimed.0.remove(&page);
            }
        }
    }

    /// Returns true if the page is held against what is out of view.
    pub(crate) fn is_claimed(&self, page: PageId) -> bool {
        self.claimed.has(page)
    }

    /// Slots out of view that claimed pages are in. A stale sharer is in none of its own: the slot is
    /// others', and its own is counted when its refresh is planned.
    pub(crate) fn slots_claimed(&mut self) -> u32 {
        let stale: FxHashSet<PageId> = self.stale_sharers().collect();
        let Residency { records, sharing, claimed, round, .. } = self;
        let (round, plan) = (*round, sharing.plan);
        let is_out_of_view =
            |page: PageId| records.get(page).is_some_and(|record| record.age_out_of_view(round).is_some());
        let slots = claimed.0.keys().filter(|&&page| {
            is_out_of_view(page)
                && !stale.contains(&page)
                && sharing.content_of(page).is_none_or(|content| {
                    // Pages of one content have one slot, which may be in view with others.
                    content.wanted_round < round && std::mem::replace(&mut content.counted, plan) != plan
                })
        });
        slots.count() as u32
    }

    /// How often each page is claimed, in no order.
    #[cfg(feature = "checks")]
    pub(crate) fn claims(&self) -> impl Iterator<Item = (PageId, u32)> + '_ {
        self.claimed.0.iter().map(|(&page, &claims)| (page, claims))
    }
}
