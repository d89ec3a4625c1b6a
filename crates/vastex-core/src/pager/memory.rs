//! The memory of a pool changes while it runs: it gets more slots or fewer and keeps its tiles, or is lost with all of them.
//!
//! Of a pool that shrinks the pages out of view go first, as always. Page tables begin anew either way, since moved tiles may be ancestors
//! of any page. What pages are wanted, which of them failed, what the loader has and what was asked for by hand stays known.

use crate::pager::Pagers;
use crate::pager::pool::Pager;
use crate::pager::settings::PagerSettings;
use crate::residency::resize::SlotMove;
use crate::table::pool::{PoolError, PoolId, PoolLayout};

impl Pager {
    /// Gives the pool so many slots from now on, between two frames. The caller copies the tiles of `moves`, which is replaced with
    /// all tiles that stay, and makes the page tables of the pool's textures anew: with their tails
    /// ([`Pager::tail_slot`]) and [`Pager::resident_changes`]. Changes that were not taken yet are in these.
    ///
    /// Fails, with nothing changed but that some pages out of view may have gone, where the pins would not fit, or where what is in view
    /// does not and the mip bias may not act. Costs a visit of every page that has a state.
    pub fn resize(&mut self, slots: u32, moves: &mut Vec<SlotMove>) -> Result<(), PoolError> {
        moves.clear();
        let needed = self.slots_needed();
        if slots < needed {
            let tile_bytes = self.settings.tile_bytes;
            let budget = u64::from(slots) * tile_bytes;
            return Err(PoolError::TooSmall { budget, slots, tile_bytes, needed });
        }
        let before = self.settings.slots;
        self.set_slots(slots);
        if !self.residency.evict_down_to(slots, &self.textures) {
            self.set_slots(before);
            self.check();
            return Err(PoolError::AllInView { slots });
        }
        self.residency.resize(slots, moves);
        self.residency.forget_table_changes();
        self.recompute();
        self.check();
        Ok(())
    }

    /// Slots for what must always be resident, and to work with.
    fn slots_needed(&self) -> u32 {
        let tails = self.residency.tails();
        let by_hand = self.claims.pinned().count() as u32;
        let with_room =
            (u64::from(tails + by_hand) * 100).div_ceil(u64::from(PagerSettings::MOST_PINS)) as u32;
        let least = tails.max(1) + PoolLayout::MIN_SLOTS - 1;
        if by_hand == 0 { least } else { least.max(with_room) }
    }

    fn set_slots(&mut self, slots: u32) {
        self.settings.slots = slots;
        self.residency.set_slots(slots);
        self.bias.set_slots(slots);
        self.plan_due = true;
        self.recompute();
    }
}

impl Pagers {
    /// Gives a pool that there is so many slots from now on; see [`Pager::resize`].
    pub fn resize_pool(
        &mut self,
        pool: PoolId,
        slots: u32,
        moves: &mut Vec<SlotMove>,
    ) -> Result<(), PoolError> {
        moves.clear();
        self.pager_mut(pool).map_or(Ok(()), |pager| pager.resize(slots, moves))
    }
}

impl Pager {
    /// The pool is empty: its memory was lost. What is in view, pinned or held is queued anew; page-table changes that were not
    /// taken yet are forgotten, since page tables begin anew too, with nothing but their tails.
    ///
    /// Costs a visit of every page that has a state.
    pub fn tiles_lost(&mut self) {
        self.residency.forget_table_changes();
        self.residency.lose_tiles();
        self.recompute();
        self.plan_by_hand();
        self.check();
    }
}

impl Pagers {
    /// The pools are empty: the device that had them was lost. See [`Pager::tiles_lost`].
    pub fn tiles_lost(&mut self) {
        self.iter_mut().for_each(Pager::tiles_lost);
    }
}
