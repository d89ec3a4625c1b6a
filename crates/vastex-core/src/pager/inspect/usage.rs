//! Who takes a pool: how many slots and wanted pages are of which texture, and of which level.

use std::cmp::Reverse;

use rustc_hash::FxHashMap;

use crate::pager::event::TexturePages;
use crate::pager::pool::PoolPager;
use crate::residency::records::RecordHint;
use crate::shader_constants::MAX_LEVELS;
use crate::table::pool::PoolId;
use crate::texture::page::{PageId, TextureNumber};
use crate::wanted::feedback::WantedPage;

/// Textures that [`Event::Oversubscribed`](crate::Event::Oversubscribed) names.
const NAMED: usize = 3;

/// What is in a pool.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PoolUsage {
    /// The pool.
    pub pool: PoolId,
    /// Slots of the pool.
    pub slots: u32,
    /// Slots that hold a tile.
    pub occupied: u32,
    /// Pages whose tiles are in the pool's slots: more than slots if pages of the same content share one.
    pub pages: u32,
    /// Occupied slots that are never given up, whatever is in view: tails, and what an application pins.
    pub locked: u32,
    /// The mip bias in force, in eighths of a level.
    pub bias_eighths: u16,
    /// The pool's textures, the one with the most pages first, among equals the one with the lowest number.
    pub textures: Vec<TextureUsage>,
}

/// What a pool holds of one texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextureUsage {
    /// The texture.
    pub texture: TextureNumber,
    /// Pages whose tiles are in slots, its tail among them.
    pub pages: u32,
    /// Pages whose tiles are in slots by level, finest first, levels without pages left out; the tail counts
    /// as its finest level.
    pub levels: Vec<(u8, u32)>,
}

/// What is in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotUsage {
    /// A page whose tile it is; of several of the same content the first by texture, level and place.
    pub page: PageId,
    /// Pages whose tile it is.
    pub pages: u32,
    /// True if any page of the slot is in view, at the mip bias in force.
    pub is_in_view: bool,
    /// True if the slot holds a tail, or what an application pins.
    pub is_locked: bool,
}

impl PoolPager {
    /// What is in each slot, `None` if it is free. Costs a visit of every page that has a state, as
    /// [`PoolPager::usage`] does.
    pub fn slots(&self) -> Vec<Option<SlotUsage>> {
        let mut slots = vec![None; self.residency.slot_count() as usize];
        for (page, slot) in self.resident() {
            let is_in_view = self.residency.is_wanted(page, RecordHint::default());
            let is_locked = self.textures.is_tail(page) || self.claims.pins(page);
            let Some(place) = slots.get_mut(slot.index() as usize) else { continue };
            let usage =
                place.get_or_insert(SlotUsage { page, pages: 0, is_in_view: false, is_locked: false });
            usage.page = usage.page.min(page);
            usage.pages += 1;
            usage.is_in_view |= is_in_view;
            usage.is_locked |= is_locked;
        }
        slots
    }

    /// What all views want together of the pool's textures, at mip bias 0: the pages that their feedbacks of
    /// the last jitter cycles named, in ascending order, each once. Costs a visit of each.
    pub fn wanted(&self) -> Vec<WantedPage> {
        let named = self.set.direct_pages();
        let mut pages: Vec<_> = named.map(|(page, pixels)| WantedPage { page, pixels, eighth: 0 }).collect();
        pages.sort_unstable();
        pages
    }

    /// The newest frame in which a view wanted the tail of a texture, which is always there and so is none of
    /// [`PoolPager::wanted`]; `None` where none has.
    pub fn tail_wanted(&self, texture: TextureNumber) -> Option<u64> {
        self.set.tail_named(texture)
    }

    /// What is in the pool, and of which textures. Costs a visit of every page that has a state, so it is for
    /// people and tools, not for each frame.
    pub fn usage(&self) -> PoolUsage {
        let mut pages: FxHashMap<TextureNumber, [u32; MAX_LEVELS as usize]> = FxHashMap::default();
        for (page, _) in self.resident() {
            pages.entry(page.texture()).or_default()[usize::from(page.level())] += 1;
        }
        let of_texture = |(texture, by_level): (TextureNumber, [u32; MAX_LEVELS as usize])| TextureUsage {
            texture,
            pages: by_level.iter().sum(),
            levels: (0..).zip(by_level).filter(|&(_, pages)| pages > 0).collect(),
        };
        let mut textures: Vec<TextureUsage> = pages.into_iter().map(of_texture).collect();
        textures.sort_unstable_by_key(|usage| (Reverse(usage.pages), usage.texture));
        let stats = self.stats();
        PoolUsage {
            pool: self.pool(),
            slots: stats.slots,
            occupied: stats.occupied,
            pages: stats.resident,
            locked: stats.locked,
            bias_eighths: self.bias_eighths(),
            textures,
        }
    }

    /// The textures that want most pages, at most three, largest first.
    pub(crate) fn largest_textures(&self) -> Vec<TexturePages> {
        let mut pages: FxHashMap<TextureNumber, TexturePages> = FxHashMap::default();
        let fresh = |texture| TexturePages { texture, wanted: 0, resident: 0 };
        let mut of = |texture, wanted, resident| {
            let sums = pages.entry(texture).or_insert_with(|| fresh(texture));
            (sums.wanted, sums.resident) = (sums.wanted + wanted, sums.resident + resident);
        };
        self.set.pages_at(0).for_each(|(page, _)| of(page.texture(), 1, 0));
        self.resident().for_each(|(page, _)| of(page.texture(), 0, 1));
        let mut largest: Vec<TexturePages> = pages.into_values().collect();
        largest.sort_unstable_by_key(|pages| (Reverse(pages.wanted), Reverse(pages.resident), pages.texture));
        largest.truncate(NAMED);
        largest
    }
}
