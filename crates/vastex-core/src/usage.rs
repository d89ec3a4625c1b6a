//! Who takes a pool: how many slots and wanted pages are of which texture, and of which level.

use std::cmp::Reverse;

use rustc_hash::FxHashMap;

use crate::event::TexturePages;
use crate::page::TextureId;
use crate::pager::Pager;
use crate::pool::PoolId;
use crate::shared::MAX_LEVELS;

/// Textures that [`crate::Event::Oversubscribed`] names.
const NAMED: usize = 3;

/// What is in a pool.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PoolUsage {
    /// The pool.
    pub pool: PoolId,
    /// Its slots.
    pub slots: u32,
    /// Slots that hold a tile.
    pub occupied: u32,
    /// Pages whose tiles are in them, which is what its textures have: more than slots where pages of the same content share one.
    pub pages: u32,
    /// Those of them that are not given up whatever is in view: tails, and what is pinned by hand.
    pub locked: u32,
    /// The mip bias in force, in eighths of a level.
    pub bias_eighths: u16,
    /// Its textures, the one with the most pages first, among equals the one with the lowest number.
    pub textures: Vec<TextureUsage>,
}

/// What a pool holds of one texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextureUsage {
    /// The texture.
    pub texture: TextureId,
    /// Pages whose tiles are in slots, its tail among them.
    pub pages: u32,
    /// The same by level, finest first, levels without pages left out; the tail counts as its finest level.
    pub levels: Vec<(u8, u32)>,
}

impl Pager {
    /// What is in the pool, and of which textures. Costs a visit of every page that has a state, so it is for people and tools, not for each
    /// frame.
    pub fn usage(&self) -> PoolUsage {
        let mut pages: FxHashMap<TextureId, [u32; MAX_LEVELS as usize]> = FxHashMap::default();
        for (page, _) in self.resident() {
            pages.entry(page.texture()).or_default()[usize::from(page.level())] += 1;
        }
        let of_texture = |(texture, by_level): (TextureId, [u32; MAX_LEVELS as usize])| TextureUsage {
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
        let mut pages: FxHashMap<TextureId, TexturePages> = FxHashMap::default();
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
