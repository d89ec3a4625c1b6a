//! What page tables are told: of each upload that was handed out, or of all that is resident where a table begins anew.

use crate::pager::pool::Pager;
use crate::table::pool::Slot;
use crate::table::{ChangeRule, TableChange, TableEntry};
use crate::texture::geometry::page_id;
use crate::texture::page::TextureId;

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

    /// The slot of a texture's tail; nothing where there is no such texture.
    pub fn tail_slot(&self, texture: TextureId) -> Option<Slot> {
        let geometry = self.textures.geometry(texture)?;
        self.residency.slot_of(page_id(texture, geometry, geometry.tail_pos())?)
    }
}
