//! What a pager has decided, as values for the loader and the GPU; and what of it page tables are told.

use bytes::Bytes;

use crate::page::{PageId, PagePos};
use crate::pager::Pager;
use crate::pool::Slot;
use crate::table::{ChangeRule, TableChange, TableEntry};

/// A tile to load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// The page.
    pub page: PageId,
    /// The page within its texture.
    pub pos: PagePos,
    /// Its place in the order of loading at this moment; the lowest is best. A later request may overtake it.
    pub rank: u64,
}

/// A tile to copy into its slot.
#[derive(Clone, Debug, PartialEq)]
pub struct Upload {
    /// The page.
    pub page: PageId,
    /// Where its tile goes.
    pub slot: Slot,
    /// The tile, all layers.
    pub bytes: Bytes,
    /// The page that gave up the slot, of several that shared it the last.
    pub evicted: Option<PageId>,
}

impl Pager {
    /// Replaces `changes` with the page-table changes of the uploads handed out since the last call: evictions first,
    /// then loads.
    pub fn take_table_changes(&mut self, changes: &mut Vec<TableChange>) {
        changes.clear();
        self.append_table_changes(changes);
    }

    pub(crate) fn append_table_changes(&mut self, changes: &mut Vec<TableChange>) {
        self.join_waiting();
        let mut evicted = std::mem::take(&mut self.residency.evicted);
        for (page, slot) in evicted.drain(..) {
            // The page itself, where it has moved from one slot to another.
            let line = std::iter::once(page).chain(self.textures.ancestors(page));
            let left = line.into_iter().find_map(|a| self.residency.slot_of(a).map(|slot| (a, slot)));
            let Some((ancestor, ancestor_slot)) = left else { continue };
            changes.push(TableChange {
                page,
                rule: ChangeRule::Naming(TableEntry::new(page.level(), slot)),
                entry: TableEntry::new(ancestor.level(), ancestor_slot),
            });
        }
        self.residency.evicted = evicted;
        let mut settled = std::mem::take(&mut self.residency.settled);
        for page in settled.drain(..) {
            let Some(slot) = self.residency.slot_of(page) else { continue };
            let entry = TableEntry::new(page.level(), slot);
            changes.push(TableChange { page, rule: ChangeRule::Coarser, entry });
        }
        self.residency.settled = settled;
    }
}
