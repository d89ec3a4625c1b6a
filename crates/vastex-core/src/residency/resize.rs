//! Resizing: which tile goes where when the pool gets more slots or fewer.
//!
//! Slots are numbered from 0, so that a larger pool has all slots of the smaller one. Of a pool that shrinks,
//! what is left in slots that there are no more moves into free ones. That the memory is taken, and tiles are
//! copied, is the GPU crate's business.

use rustc_hash::FxHashMap;

use crate::residency::Residency;
use crate::residency::records::State;
use crate::residency::slots::SlotUse;
use crate::table::pool::Slot;
use crate::texture::textures::Textures;

/// A tile that was in one slot and is in another now, or stays where it is while the slot's place in memory
/// moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotMove {
    /// The slot that the tile was in.
    pub from: Slot,
    /// The slot that the tile is in.
    pub to: Slot,
}

impl Residency {
    /// The pool has so many slots from now on, as far as what is counted goes; [`Residency::resize`] follows.
    pub(crate) fn set_slots(&mut self, slots: u32) {
        self.stats.slots = slots;
    }

    /// Evicts until so many slots hold all that is left. Returns false if that cannot be done.
    pub(crate) fn evict_down_to(&mut self, slots: u32, textures: &Textures) -> bool {
        self.allow_eviction_of_settled();
        while self.stats.occupied > slots {
            let Some((slot, _)) = self.evict_next(textures) else { return false };
            self.free.push(slot);
        }
        true
    }

    /// What got its slot in this frame may lose it in it: page tables begin anew, so there is no order to
    /// keep.
    fn allow_eviction_of_settled(&mut self) {
        let before = self.frame.wrapping_sub(1);
        self.records.retain(|record| {
            record.settled_at = if record.settled_at == self.frame { before } else { record.settled_at };
            true
        });
    }

    /// Keeps the tiles, of which there are at most `slots`, in the lowest slots.
    pub(crate) fn resize(&mut self, slots: u32, moves: &mut Vec<SlotMove>) {
        let numbered = |slots: Vec<SlotUse>| (0..).map(Slot::new).zip(slots);
        let beyond = numbered(self.slots.clone()).skip(slots as usize);
        self.slots.resize(slots as usize, SlotUse::FREE);
        let stays = numbered(self.slots.clone()).filter(|(_, slot_use)| *slot_use != SlotUse::FREE);
        moves.extend(stays.map(|(slot, _)| SlotMove { from: slot, to: slot }));
        let mut free = numbered(self.slots.clone()).filter(|(_, slot_use)| *slot_use == SlotUse::FREE);
        let mut moved = FxHashMap::default();
        for (from, slot_use) in beyond.filter(|(_, slot_use)| *slot_use != SlotUse::FREE) {
            let Some((to, _)) = free.next() else { break }; // there are as many, so that none is left over
            *self.slot_use(to) = slot_use;
            if let Some(content) = self.sharing.get_mut(slot_use.content) {
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
