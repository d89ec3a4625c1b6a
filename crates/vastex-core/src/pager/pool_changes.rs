//! Changing what pools have while they run: one is resized and keeps its tiles, or is lost with all of them;
//! it gets another rule for its mip bias; and all get other budgets.
//!
//! Of a pool that shrinks the pages out of view go first, as always. Page tables begin anew either way, since
//! moved tiles may be ancestors of any page. What pages are wanted, which of them failed, what the loader has
//! and what was asked for explicitly stays known.

use crate::pager::bias::{BiasControl, BiasRule};
use crate::pager::claims::MOST_PINS;
use crate::pager::event::EventQueue;
use crate::pager::pool::PoolPager;
use crate::pager::{Budgets, Pager};
use crate::residency::resize::SlotMove;
use crate::table::pool::{PoolError, PoolId, PoolLayout};

impl Pager {
    /// Gives a pool that there is so many slots from now on, between two frames. The caller copies the tiles
    /// of `moves`, which is replaced with all tiles that stay, and makes the page tables of the pool's
    /// textures anew: with their tails ([`PoolPager::tail_slot`]) and [`PoolPager::resident_changes`].
    /// Changes that were not taken yet are in these.
    ///
    /// Fails, with nothing changed but that some pages out of view may have gone, where the pins would not
    /// fit, or where what is in view does not and the mip bias may not act. Costs a visit of every page that
    /// has a state.
    pub fn resize_pool(
        &mut self,
        pool: PoolId,
        slots: u32,
        moves: &mut Vec<SlotMove>,
    ) -> Result<(), PoolError> {
        moves.clear();
        let Pager { pools, events, .. } = self;
        let pool = pools.get_mut(usize::from(pool.number()));
        pool.map_or(Ok(()), |pool| pool.pager.resize(slots, moves, events))
    }

    /// Sets how the mip bias of a pool that there is is decided, as [`Pager::add_pool`] does, between two
    /// frames. Where the new rule solves it, the working set fits at once; else the bias begins at 0. Costs a
    /// visit of each page of the working set.
    pub fn set_bias_rule(&mut self, pool: PoolId, rule: Option<BiasRule>) {
        let Pager { pools, events, .. } = self;
        if let Some(pool) = pools.get_mut(usize::from(pool.number())) {
            pool.pager.bias = BiasControl::new(rule);
            pool.pager.end_rest();
            pool.pager.recompute(events);
            pool.pager.check();
        }
    }

    /// Sets the budgets that all pools share, from the next frame on. What is with the loader beyond a
    /// smaller one comes all the same, and nothing else is asked for until it has.
    pub fn set_budgets(&mut self, budgets: Budgets) {
        let tile_bytes = self.pools().map(|pager| pager.residency.tile_bytes()).max().unwrap_or(0);
        self.bucket.set_per_frame(budgets.upload_bytes_per_frame, tile_bytes);
        self.budgets = budgets;
    }

    /// The pools are empty: the device that had them was lost. What is in view, pinned or held is queued
    /// anew; page-table changes that were not taken yet are forgotten, since page tables begin anew too, with
    /// nothing but their tails.
    ///
    /// Costs a visit of every page that has a state.
    pub fn tiles_lost(&mut self) {
        let Pager { pools, events, .. } = self;
        pools.iter_mut().for_each(|pool| pool.pager.tiles_lost(events));
    }
}

impl PoolPager {
    fn resize(
        &mut self,
        slots: u32,
        moves: &mut Vec<SlotMove>,
        events: &mut EventQueue,
    ) -> Result<(), PoolError> {
        let needed = self.slots_needed();
        if slots < needed {
            return Err(self.too_small(slots, needed));
        }
        let before = self.residency.slot_count();
        self.set_slots(slots, events);
        if !self.residency.evict_down_to(slots, &self.textures) {
            self.set_slots(before, events);
            self.check();
            return Err(PoolError::AllInView { slots });
        }
        self.residency.resize(slots, moves);
        self.residency.forget_table_changes();
        self.recompute(events);
        self.check();
        Ok(())
    }

    /// Slots for what must always be resident, and to work with.
    fn slots_needed(&self) -> u32 {
        let (tails, pins) = (self.residency.tails(), self.claims.pinned().count() as u32);
        let with_room = (u64::from(tails + pins) * 100).div_ceil(u64::from(MOST_PINS)) as u32;
        let least = tails.max(1) + PoolLayout::MIN_SLOTS - 1;
        if pins == 0 { least } else { least.max(with_room) }
    }

    fn set_slots(&mut self, slots: u32, events: &mut EventQueue) {
        self.end_rest();
        self.residency.set_slots(slots);
        self.plan.note_change();
        self.recompute(events);
    }

    /// What was given up while the views rest may come again.
    pub(super) fn end_rest(&mut self) {
        self.rest.end(&mut self.bias, &mut self.residency);
    }

    fn tiles_lost(&mut self, events: &mut EventQueue) {
        self.end_rest();
        self.residency.forget_table_changes();
        self.residency.lose_tiles();
        self.recompute(events);
        self.rebuild_plan();
        self.check();
    }
}
