//! Textures come to a pool, each with its tail, and leave it.

use std::sync::Arc;

use crate::pager::pool::Pager;
use crate::table::pool::{PoolError, PoolLayout, Slot};
use crate::texture::geometry::{Geometry, page_id};
use crate::texture::page::TextureId;
use crate::texture::page_contents::PageContents;
use crate::texture::page_set::PageSet;

impl Pager {
    /// Adds a texture under a number that is free and pins its tail, whose slot is returned: the caller puts the tail's
    /// tile there before it draws.
    ///
    /// `present` are the pages that have tiles, nothing where all have: where another is wanted, its nearest ancestor that has
    /// one is. `contents` are the pages that have the same tile, nothing where all differ: those share a load and a slot. A pool
    /// that would have no slot left to work with refuses the texture.
    pub fn add_texture(
        &mut self,
        texture: TextureId,
        geometry: &Geometry,
        present: Option<Arc<PageSet>>,
        contents: Option<Arc<PageContents>>,
    ) -> Result<Slot, PoolError> {
        // Where all is tail there is nothing to work with.
        let is_all_tail = geometry.page_count() == 1 && self.textures.are_all_tail();
        let settings = self.settings;
        let needed = self.textures.count() + if is_all_tail { 1 } else { PoolLayout::MIN_SLOTS };
        if needed > settings.slots {
            return Err(PoolError::TooSmall {
                budget: u64::from(settings.slots) * settings.tile_bytes,
                slots: settings.slots,
                tile_bytes: settings.tile_bytes,
                needed,
            });
        }
        if self.textures.geometry(texture).is_some() {
            return Err(PoolError::NumberTaken { number: texture.number() });
        }
        let slot = match self.residency.take_free_slot() {
            Some(slot) => slot,
            None => {
                let (slot, _) = self
                    .residency
                    .take_slot(&self.textures)
                    .ok_or(PoolError::AllInView { slots: settings.slots })?;
                slot
            }
        };
        self.textures.add(texture, Arc::new(geometry.clone()), present);
        if let Some(contents) = contents {
            self.residency.add_contents(texture, geometry.dims(), contents);
            self.waiting.reserve(settings.slots as usize);
        }
        if let Some(tail) = page_id(texture, geometry, geometry.tail_pos()) {
            self.residency.put_tail(tail, slot);
        }
        self.room = self.room.saturating_sub(1);
        self.check();
        Ok(slot)
    }

    /// Removes a texture: its tiles and its tail give up their slots, what is in flight is called off. Says how many loads the
    /// loader has yet to answer, or nothing where there is no such texture. The number may be given to another texture when
    /// they are answered and no feedback under way names this one.
    ///
    /// Its page table is the caller's, and is not told of. Costs a visit of every page that has a state.
    pub fn remove_texture(&mut self, texture: TextureId) -> Option<u32> {
        if !self.textures.remove(texture) {
            return None;
        }
        self.claims.forget(texture, &mut self.residency);
        let loads = self.residency.forget(texture);
        self.by_hand.retain(|page| page.texture() != texture);
        self.set.forget(texture);
        self.rebuild_set();
        self.order.retain(|page| page.texture() != texture);
        self.waiting.retain(|page| page.texture() != texture);
        (self.next_request, self.held_back, self.next_upload) = (0, None, 0);
        (self.next_by_hand, self.next_upload_by_hand) = (0, 0);
        self.make_room();
        self.plan_due = true;
        let under_way = loads.len() as u32;
        self.cancels.extend(loads);
        self.check();
        Some(under_way)
    }
}
