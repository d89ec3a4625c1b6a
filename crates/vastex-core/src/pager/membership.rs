//! Adding a texture to a pool, with its tail, and removing it.

use std::sync::Arc;

use crate::pager::pool::PoolPager;
use crate::table::pool::{PoolError, PoolLayout, Slot};
use crate::texture::geometry::{Geometry, page_id};
use crate::texture::page::TextureNumber;
use crate::texture::page_contents::PageContents;
use crate::texture::page_set::PageSet;

impl PoolPager {
    /// Adds a texture under a number that is free in all pools, and puts its tail into the slot that is
    /// returned.
    pub(super) fn add_texture(
        &mut self,
        texture: TextureNumber,
        geometry: &Geometry,
        present: Option<Arc<PageSet>>,
        contents: Option<Arc<PageContents>>,
    ) -> Result<Slot, PoolError> {
        // Where all is tail there is nothing to work with.
        let is_all_tail = geometry.page_count() == 1 && self.textures.are_all_tail();
        let needed = self.textures.count() + if is_all_tail { 1 } else { PoolLayout::MIN_SLOTS };
        let slots = self.residency.slot_count();
        if needed > slots {
            return Err(self.too_small(slots, needed));
        }
        let mut taken = self.residency.take_slot(&self.textures);
        if taken.is_none() && self.residency.keeps_all_of_rest() {
            // What came while the views rest may make room for what was not there when they came to rest.
            self.end_rest();
            taken = self.residency.take_slot(&self.textures);
        }
        let (slot, evicted) = taken.ok_or(PoolError::AllInView { slots })?;
        evicted.into_iter().for_each(|page| self.residency.allow_again(page));
        self.textures.add(texture, Arc::new(geometry.clone()), present);
        self.load_order.add_texture(slots, contents.is_some());
        if let Some(contents) = contents {
            self.residency.add_contents(texture, geometry.dims(), contents);
        }
        if let Some(tail) = page_id(texture, geometry, geometry.tail_pos()) {
            self.residency.put_tail(tail, slot);
        }
        self.check();
        Ok(slot)
    }

    pub(super) fn too_small(&self, slots: u32, needed: u32) -> PoolError {
        let tile_bytes = self.residency.tile_bytes();
        PoolError::TooSmall { budget: u64::from(slots) * tile_bytes, slots, tile_bytes, needed }
    }

    /// Removes a texture: its tiles and its tail give up their slots, what is in flight is called off. Gives
    /// how many loads the loader has yet to answer; `None` if there is no such texture.
    ///
    /// Costs a visit of every page that has a state.
    pub(super) fn remove_texture(&mut self, texture: TextureNumber) -> Option<u32> {
        if !self.textures.remove(texture) {
            return None;
        }
        // Less is wanted: the picture may become sharper. Nothing that was given up is of the texture then.
        self.end_rest();
        self.claims.forget(texture, &self.residency);
        let under_way = self.residency.forget(texture);
        self.set.forget(texture);
        self.rebuild_set();
        self.load_order.forget(texture);
        self.plan.forget(texture);
        self.fit_slots();
        self.check();
        Some(under_way)
    }
}
