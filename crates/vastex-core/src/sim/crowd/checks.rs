//! What must hold of a [`Crowd`] in every frame; each check names the frame in which it fails.

use std::collections::BTreeSet;

use crate::residency::PageState;
use crate::sim::crowd::{Crowd, Member};
use crate::table::{ChangeRule, PageTable, TableChange, TableEntry, TableImage};
use crate::texture::page::{PageId, TextureNumber};
use crate::wanted::feedback::Need;

impl Crowd {
    /// What is pinned and was here stays.
    pub(super) fn check_pins(&self) -> Result<(), String> {
        let is_here = |page: &PageId| matches!(self.pager.state(*page), PageState::Resident(_));
        match self.pinned.iter().flat_map(|(_, pages)| pages).find(|page| !is_here(page)) {
            Some(page) => Err(format!("frame {}: {page:?} is pinned and has gone", self.frame)),
            None => Ok(()),
        }
    }

    /// Loads under way keep to the budget.
    pub(super) fn check_in_flight(&self) -> Result<(), String> {
        let bytes = self.pager.stats().in_flight_bytes;
        let allowed = self.budgets.in_flight_bytes.max(self.largest_tile);
        if bytes > allowed {
            return Err(format!("frame {}: {bytes} bytes in flight of {allowed}", self.frame));
        }
        Ok(())
    }

    /// Over any frames up to now, the uploads of all pools keep to the budget.
    pub(super) fn check_upload_budget(&self) -> Result<(), String> {
        let budget = self.budgets.upload_bytes_per_frame;
        let mut sum = 0;
        for (n, bytes) in (1..).zip(self.uploaded.iter().rev()) {
            sum += bytes;
            if sum > n * budget + self.largest_tile.max(4 * budget) {
                return Err(format!("frame {}: {sum} bytes uploaded in {n} frames", self.frame));
            }
        }
        Ok(())
    }

    /// A page that the newest feedback wants, at the bias in force, is not evicted, nor an ancestor of one.
    pub(super) fn check_eviction(&self, gone: PageId) -> Result<(), String> {
        let Some(member) = self.members.iter().find(|member| member.texture == gone.texture()) else {
            return Err(format!("frame {}: {gone:?} of a texture that was removed was resident", self.frame));
        };
        let (geometry, bias) = (&member.geometry, self.pager.pool(member.pool).bias_eighths());
        let gone = gone.pos(geometry.dims());
        let newest = self.newest.values().flat_map(|newest| &newest.pages);
        for wanted in newest.filter(|wanted| wanted.page.texture() == member.texture) {
            let pos = wanted.page.pos(geometry.dims());
            let level = Need::new(pos.level, wanted.eighth).level_at(bias);
            let at_bias = geometry.ancestor(pos, level.min(geometry.coarsest()));
            if gone.level >= at_bias.level && geometry.ancestor(at_bias, gone.level) == gone {
                return Err(format!("frame {}: {gone} was evicted while {at_bias} is in view", self.frame));
            }
        }
        Ok(())
    }

    /// Every page of a texture leads to what is resident of it and of its ancestors, which is in a slot with
    /// its content.
    pub(super) fn check_table(&self, member: &Member) -> Result<(), String> {
        let (geometry, pager) = (&member.geometry, self.pager.pool(member.pool));
        let Some(tail_slot) = pager.tail_slot(member.texture) else {
            return Err(format!("frame {}: {:?} has no tail", self.frame, member.texture));
        };
        let mut expected = TableImage::new(geometry, tail_slot);
        for (page, slot) in pager.resident().filter(|(page, _)| page.texture() == member.texture) {
            let pos = page.pos(geometry.dims());
            if !self.contents.is_shown(member.pool, slot, page) {
                return Err(format!("frame {}: {slot:?} does not show {pos}", self.frame));
            }
            if !geometry.is_tail(pos) {
                let entry = TableEntry::new(pos.level, slot);
                expected.apply(geometry, &TableChange { page, rule: ChangeRule::Coarser, entry });
            }
        }
        if expected.entries() == member.table.entries() {
            return Ok(());
        }
        let wrong = geometry.pages().find(|&pos| expected.lookup(pos) != member.table.lookup(pos));
        Err(format!("frame {}: the table is wrong at {wrong:?}", self.frame))
    }

    /// A pool holds pages of its own textures, and of no others.
    pub(super) fn check_owners(&self) -> Result<(), String> {
        for pager in self.pager.pools() {
            let own = self.members.iter().filter(|member| member.pool == pager.pool());
            let own: BTreeSet<TextureNumber> = own.map(|member| member.texture).collect();
            let mut resident = pager.resident().map(|(page, _)| page);
            if let Some(page) = resident.find(|page| !own.contains(&page.texture())) {
                return Err(format!("frame {}: {page:?} is in {:?}", self.frame, pager.pool()));
            }
        }
        Ok(())
    }
}
