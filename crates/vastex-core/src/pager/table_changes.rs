//! What page tables are told: of each upload that was handed out, or of all that is resident where a table
//! begins anew.

use crate::pager::Pager;
use crate::pager::pool::PoolPager;
use crate::table::pool::Slot;
use crate::table::{ChangeRule, TableChange, TableEntry};
use crate::texture::geometry::page_id;
use crate::texture::page::TextureNumber;

impl Pager {
    /// Replaces `changes` with the page-table changes of the uploads handed out since the last call, of every
    /// pool: evictions before loads in each.
    pub fn take_table_changes(&mut self, changes: &mut Vec<TableChange>) {
        changes.clear();
        for pool in self.pools_mut() {
            pool.load_order.join_waiting(&mut pool.residency, &pool.textures);
            pool.check();
            pool.residency.drain_table_changes(&pool.textures, changes);
        }
    }
}

impl PoolPager {
    /// Replaces `changes` with what a page table in which every entry leads to the tail is to be told, so
    /// that it leads to what is resident. Costs a visit of every page that has a state.
    pub fn resident_changes(&self, texture: TextureNumber, changes: &mut Vec<TableChange>) {
        let own = self.resident().filter(|(page, _)| page.texture() == texture);
        let finer = own.filter(|(page, _)| !self.textures.is_tail(*page));
        changes.clear();
        changes.extend(finer.map(|(page, slot)| TableChange {
            page,
            rule: ChangeRule::Coarser,
            entry: TableEntry::new(page.level(), slot),
        }));
    }

    /// The slot of a texture's tail; `None` if there is no such texture.
    pub fn tail_slot(&self, texture: TextureNumber) -> Option<Slot> {
        let geometry = self.textures.geometry(texture)?;
        self.residency.slot_of(page_id(texture, geometry, geometry.tail_pos())?)
    }
}
