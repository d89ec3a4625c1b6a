//! Where pages went: what page tables, and the application, have yet to be told of.

use crate::residency::Residency;
use crate::table::pool::Slot;
use crate::table::{ChangeRule, TableChange, TableEntry};
use crate::texture::page::{PageId, TextureNumber};
use crate::texture::textures::Textures;

/// Pages that leave or get a slot in a frame for which there is memory from the beginning.
const MOVES: u32 = 1024;

/// Where pages went: what page tables and the application have yet to be told.
#[derive(Debug)]
pub(super) struct Moves {
    /// Pages that have left their slots.
    pub(super) evicted: Vec<(PageId, Slot)>,
    /// Pages that have come into one.
    pub(super) settled: Vec<PageId>,
    /// Pages that had failed, and are in slots now.
    pub(super) recovered: Vec<PageId>,
}

impl Moves {
    pub(super) fn new(slots: u32) -> Moves {
        // How many there are in a frame varies more than what is in the pool.
        let room = slots.min(MOVES) as usize;
        Moves { evicted: Vec::with_capacity(room), settled: Vec::with_capacity(room), recovered: Vec::new() }
    }

    pub(super) fn forget(&mut self, texture: TextureNumber) {
        self.evicted.retain(|(page, _)| page.texture() != texture);
        self.settled.retain(|page| page.texture() != texture);
    }

    /// Page tables begin anew.
    pub(super) fn forget_tables(&mut self) {
        self.evicted.clear();
        self.settled.clear();
    }
}

impl Residency {
    /// Adds the page-table changes of what has moved since the last call: evictions first, then loads.
    pub(crate) fn drain_table_changes(&mut self, textures: &Textures, changes: &mut Vec<TableChange>) {
        let Residency { moves, records, .. } = self;
        for (page, slot) in moves.evicted.drain(..) {
            // The page itself, where it has moved from one slot to another.
            let line = std::iter::once(page).chain(textures.ancestors(page));
            let left = line.into_iter().find_map(|page| records.slot_of(page).map(|slot| (page, slot)));
            let Some((ancestor, ancestor_slot)) = left else { continue };
            changes.push(TableChange {
                page,
                rule: ChangeRule::Naming(TableEntry::new(page.level(), slot)),
                entry: TableEntry::new(ancestor.level(), ancestor_slot),
            });
        }
        for page in moves.settled.drain(..) {
            let Some(slot) = records.slot_of(page) else { continue };
            let entry = TableEntry::new(page.level(), slot);
            changes.push(TableChange { page, rule: ChangeRule::Coarser, entry });
        }
    }

    /// Pages that had failed and are here now, since the last call.
    pub(crate) fn drain_recovered(&mut self) -> impl Iterator<Item = PageId> + '_ {
        self.moves.recovered.drain(..)
    }
}
