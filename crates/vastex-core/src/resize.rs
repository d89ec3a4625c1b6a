//! Resizing: a pool gets more slots or fewer while it runs, and keeps its tiles.
//!
//! Slots are numbered from 0, so that a larger pool has all slots of the smaller one. Of a pool that shrinks the pages out of view
//! go first, as always; what is left in slots that there are no more moves into free ones. Page tables begin anew, since moved
//! tiles may be ancestors of any page. That the memory is taken, and tiles are copied, is the GPU crate's business.

use rustc_hash::FxHashMap;

use crate::budget::PagerSettings;
use crate::page::TextureId;
use crate::pager::Pager;
use crate::pagers::Pagers;
use crate::pool::{PoolError, PoolId, PoolLayout, Slot};
use crate::records::State;
use crate::residency::Residency;
use crate::slots::Holding;
use crate::table::{ChangeRule, TableChange, TableEntry};

/// A tile that was in one slot and is in another now, or stays where it is while the slot's place in memory moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotMove {
    /// Where it was.
    pub from: Slot,
    /// Where it is.
    pub to: Slot,
}

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
        if !self.evict_down_to(slots) {
            self.set_slots(before);
            self.check();
            return Err(PoolError::AllInView { slots });
        }
        self.residency.resize(slots, moves);
        self.residency.evicted.clear();
        self.residency.settled.clear();
        self.work_out();
        self.check();
        Ok(())
    }

    /// Slots for what must always be resident, and to work with.
    fn slots_needed(&self) -> u32 {
        let tails = self.residency.stats.pinned;
        let by_hand = self.residency.tickets.pinned().count() as u32;
        let with_room =
            (u64::from(tails + by_hand) * 100).div_ceil(u64::from(PagerSettings::MOST_PINS)) as u32;
        let least = tails.max(1) + PoolLayout::MIN_SLOTS - 1;
        if by_hand == 0 { least } else { least.max(with_room) }
    }

    fn set_slots(&mut self, slots: u32) {
        self.settings.slots = slots;
        self.residency.stats.slots = slots;
        self.bias.set_slots(slots);
        self.plan_due = true;
        self.work_out();
    }

    /// Evicts until so many slots hold all that is left. Says whether that could be done.
    fn evict_down_to(&mut self, slots: u32) -> bool {
        self.residency.let_go_of_what_has_settled();
        while self.residency.stats.occupied > slots {
            let Some((slot, _)) = self.residency.evict_next(&self.textures) else { return false };
            self.residency.free.push(slot);
        }
        true
    }

    /// Replaces `changes` with what a page table in which every entry leads to the tail is to be told, so that it leads to what is
    /// resident. Costs a visit of every page that has a state.
    pub fn resident_changes(&self, texture: TextureId, changes: &mut Vec<TableChange>) {
        let own = self.resident().filter(|(page, _)| page.texture() == texture);
        let finer = own.filter(|(page, _)| !self.textures.is_tail(*page));
        changes.clear();
        changes.extend(finer.map(|(page, slot)| TableChange {
            page,
            rule: ChangeRule::Coarser,
            entry: TableEntry::new(page.level(), slot),
        }));
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

impl Residency {
    /// What got its slot in this frame may lose it in it: page tables begin anew, so there is no order to keep.
    fn let_go_of_what_has_settled(&mut self) {
        let before = self.frame.wrapping_sub(1);
        self.records.retain(|record| {
            record.settled_at = if record.settled_at == self.frame { before } else { record.settled_at };
            true
        });
    }

    /// Keeps the tiles, of which there are at most `slots`, in the lowest slots.
    fn resize(&mut self, slots: u32, moves: &mut Vec<SlotMove>) {
        let numbered = |slots: Vec<Holding>| (0..).map(Slot::new).zip(slots);
        let beyond = numbered(self.slots.clone()).skip(slots as usize);
        self.slots.resize(slots as usize, Holding::FREE);
        let stays = numbered(self.slots.clone()).filter(|(_, holding)| *holding != Holding::FREE);
        moves.extend(stays.map(|(slot, _)| SlotMove { from: slot, to: slot }));
        let mut free = numbered(self.slots.clone()).filter(|(_, holding)| *holding == Holding::FREE);
        let mut moved = FxHashMap::default();
        for (from, holding) in beyond.filter(|(_, holding)| *holding != Holding::FREE) {
            let Some((to, _)) = free.next() else { break }; // there are as many, so that none is left over
            *self.holding(to) = holding;
            if let Some(content) = self.sharing.get_mut(holding.content) {
                content.slot = Some(to);
            }
            moved.insert(from, to);
            moves.push(SlotMove { from, to });
        }
        self.records.retain(|record| {
            if let State::Resident(slot) = &mut record.state {
                *slot = moved.get(slot).copied().unwrap_or(*slot);
            }
            true
        });
        self.free.clear();
        self.free.extend(free.map(|(slot, _)| slot));
        self.free.reverse(); // the lowest are taken first
        self.victims.clear();
    }
}
