//! What the tiles of a crowd hold: a number for each page, that changes with its content, and is the same for
//! pages of which a texture says so.

use std::collections::BTreeMap;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use bytes::Bytes;
use rustc_hash::FxHasher;

use crate::pager::pool::PoolPager;
use crate::residency::resize::SlotMove;
use crate::sim::Random;
use crate::table::pool::{PoolId, Slot};
use crate::texture::geometry::Geometry;
use crate::texture::page::{Dims, PageId, PagePos, TextureNumber};
use crate::texture::page_contents::PageContents;

/// Pages along each axis of what has one content, so that neighbours and ancestors have, too.
const PATCH: u32 = 3;

/// Contents of chance: `share` of a texture's patches of pages are like others, half of them in one of two
/// colours.
pub fn contents_of_chance(geometry: &Geometry, seed: u64, share: f64) -> PageContents {
    let colors = ["black", "white"].map(|color| Bytes::from_static(color.as_bytes()));
    let number_of = |pos: PagePos| {
        let patch = pos.coords().map(|c| u64::from(c / PATCH));
        let place = patch.iter().fold(u64::from(pos.level), |n, c| n << 16 ^ c);
        let mut random = Random::new(seed ^ Random::new(place).bits());
        let is_color = random.chance(0.5);
        random.chance(share).then(|| if is_color { random.below(2) } else { 2 + random.below(6) } as u32)
    };
    PageContents::new(geometry, colors.to_vec(), 8, number_of)
}

/// What sources would give, what is under way, and what slots hold.
#[derive(Debug, Default)]
pub(crate) struct Contents {
    same: BTreeMap<TextureNumber, (Dims, Arc<PageContents>)>,
    changes: BTreeMap<PageId, u64>,
    under_way: BTreeMap<PageId, (PoolId, u64)>,
    shown: BTreeMap<(PoolId, Slot), u64>,
}

impl Contents {
    /// A texture whose pages may be the same.
    pub(crate) fn add(&mut self, texture: TextureNumber, dims: Dims, same: Arc<PageContents>) {
        self.same.insert(texture, (dims, same));
    }

    fn changes(&self, page: PageId) -> u64 {
        self.changes.get(&page).copied().unwrap_or(0)
    }

    /// What the page holds after so many changes. Before the first it may hold what others do.
    fn after(&self, page: PageId, changes: u64) -> u64 {
        let mut hasher = FxHasher::default();
        let same = self.same.get(&page.texture()).filter(|_| changes == 0);
        let number = same.and_then(|(dims, same)| Some((same, same.of(page.pos(*dims))?)));
        match number {
            Some((same, number)) => match same.constant(number) {
                Some(color) => color.hash(&mut hasher),
                None => (page.texture(), number).hash(&mut hasher),
            },
            None => (page, changes).hash(&mut hasher),
        }
        hasher.finish()
    }

    fn now(&self, page: PageId) -> u64 {
        self.after(page, self.changes(page))
    }

    pub(crate) fn change(&mut self, page: PageId) {
        *self.changes.entry(page).or_insert(0) += 1;
    }

    /// A load reads when it begins: the most out of date that a tile can be. What is here already, or on its
    /// way, is not to be loaded again.
    pub(crate) fn read(&mut self, page: PageId, pager: &PoolPager) -> Result<(), String> {
        let (pool, now) = (pager.pool(), self.now(page));
        let is_same = |&other: &PageId| other != page && self.changes(other) == 0 && self.now(other) == now;
        let on_its_way = self.under_way.iter().filter(|(_, (at, _))| *at == pool).map(|(other, _)| *other);
        let there = |other: &PageId| pager.has_texture(other.texture());
        if let Some(other) = on_its_way.filter(there).find(is_same) {
            return Err(format!("{page:?} is being loaded, with {other:?}"));
        }
        if self.changes(page) == 0
            && let Some(other) = pager.resident().map(|(other, _)| other).find(is_same)
        {
            return Err(format!("{page:?} is here, with {other:?}"));
        }
        self.under_way.insert(page, (pool, now));
        Ok(())
    }

    pub(crate) fn load_ended(&mut self, page: PageId) -> Bytes {
        let read = self.under_way.remove(&page).map_or(0, |(_, content)| content);
        Bytes::copy_from_slice(&read.to_le_bytes())
    }

    pub(crate) fn show(&mut self, pool: PoolId, slot: Slot, tile: &[u8]) {
        let content = tile.try_into().map_or(u64::MAX, u64::from_le_bytes);
        self.shown.insert((pool, slot), content);
    }

    pub(crate) fn show_as_it_is(&mut self, pool: PoolId, slot: Slot, page: PageId) {
        self.shown.insert((pool, slot), self.now(page));
    }

    /// The pool has other slots, with the tiles of some.
    pub(crate) fn move_tiles(&mut self, pool: PoolId, moves: &[SlotMove]) {
        let shown: Vec<_> = moves
            .iter()
            .filter_map(|tile| Some(((pool, tile.to), *self.shown.get(&(pool, tile.from))?)))
            .collect();
        self.shown.retain(|(other, _), _| *other != pool);
        self.shown.extend(shown);
    }

    /// Every slot is empty.
    pub(crate) fn lose(&mut self) {
        self.shown.clear();
    }

    /// Returns true if the slot shows the page, as it is now or was once.
    pub(crate) fn is_shown(&self, pool: PoolId, slot: Slot, page: PageId) -> bool {
        let shown = self.shown.get(&(pool, slot));
        (0..=self.changes(page)).any(|changes| shown == Some(&self.after(page, changes)))
    }

    /// Returns true if the slot shows the page as it is now.
    pub(crate) fn is_shown_as_it_is(&self, pool: PoolId, slot: Slot, page: PageId) -> bool {
        self.shown.get(&(pool, slot)) == Some(&self.now(page))
    }

    pub(crate) fn forget(&mut self, texture: TextureNumber) {
        self.same.remove(&texture);
        self.changes.retain(|page, _| page.texture() != texture);
    }
}
