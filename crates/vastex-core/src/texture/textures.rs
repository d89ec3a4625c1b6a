//! The textures of one pool, and the walks from page to page that need their geometry.

use std::sync::Arc;

use crate::texture::geometry::{Geometry, page_id};
use crate::texture::level_rule::LevelRule;
use crate::texture::page::{PageId, PagePos, TextureNumber};
use crate::texture::page_set::PageSet;

/// All textures of one pool, by number; the numbers between are those of other pools' textures, or of none.
#[derive(Clone, Debug, Default)]
pub(crate) struct Textures {
    textures: Vec<Option<Texture>>,
    count: u32,
    /// How many textures have pages without a tile, and how many have pages beside their tail.
    sparse: u32,
    with_pages: u32,
}

#[derive(Clone, Debug)]
struct Texture {
    geometry: Arc<Geometry>,
    /// The pages that have tiles; `None` if all have.
    present: Option<Arc<PageSet>>,
    /// How its levels are chosen, for groups.
    rule: LevelRule,
}

impl Texture {
    fn is_sparse(&self) -> bool {
        self.present.is_some()
    }

    fn has_pages(&self) -> bool {
        self.geometry.page_count() > 1
    }
}

impl Textures {
    /// Adds a texture. Returns true if its number was free.
    pub(crate) fn add(
        &mut self,
        texture: TextureNumber,
        geometry: Arc<Geometry>,
        present: Option<Arc<PageSet>>,
    ) -> bool {
        let number = usize::from(texture.number());
        if self.textures.len() <= number {
            self.textures.resize(number + 1, None);
        }
        let is_free = self.textures[number].is_none();
        if is_free {
            let rule = LevelRule::default().within(&geometry);
            let texture = Texture { geometry, present, rule };
            self.count += 1;
            self.sparse += u32::from(texture.is_sparse());
            self.with_pages += u32::from(texture.has_pages());
            self.textures[number] = Some(texture);
        }
        is_free
    }

    /// Forgets a texture. Returns true if it was there.
    pub(crate) fn remove(&mut self, texture: TextureNumber) -> bool {
        let place = self.textures.get_mut(usize::from(texture.number()));
        let Some(gone) = place.and_then(Option::take) else { return false };
        self.count -= 1;
        self.sparse -= u32::from(gone.is_sparse());
        self.with_pages -= u32::from(gone.has_pages());
        true
    }

    /// Returns true if there is nothing in any of them but its tail.
    pub(crate) fn are_all_tail(&self) -> bool {
        self.with_pages == 0
    }

    /// Textures with pages beside their tail.
    pub(crate) fn with_pages(&self) -> u32 {
        self.with_pages
    }

    /// Textures that there are.
    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    fn get(&self, texture: TextureNumber) -> Option<&Texture> {
        self.textures.get(usize::from(texture.number()))?.as_ref()
    }

    pub(crate) fn geometry(&self, texture: TextureNumber) -> Option<&Arc<Geometry>> {
        Some(&self.get(texture)?.geometry)
    }

    /// How the levels of a texture are chosen, within those that it has.
    pub(crate) fn rule(&self, texture: TextureNumber) -> Option<LevelRule> {
        Some(self.get(texture)?.rule)
    }

    /// Returns true if there is such a texture.
    pub(crate) fn set_rule(&mut self, texture: TextureNumber, rule: LevelRule) -> bool {
        let place = self.textures.get_mut(usize::from(texture.number())).and_then(Option::as_mut);
        place.map(|texture| texture.rule = rule.within(&texture.geometry)).is_some()
    }

    /// The pages of all tails.
    #[cfg(feature = "checks")]
    pub(crate) fn tails(&self) -> impl Iterator<Item = PageId> + '_ {
        (0..=TextureNumber::MAX).zip(&self.textures).filter_map(|(number, texture)| {
            let geometry = &texture.as_ref()?.geometry;
            page_id(TextureNumber::new(number)?, geometry, geometry.tail_pos())
        })
    }

    /// Returns true if the page exists, in a texture that exists.
    pub(crate) fn contains(&self, page: PageId) -> bool {
        self.pos(page).is_some_and(|(geometry, pos)| geometry.contains(pos))
    }

    /// A page that exists, or where it has no tile its nearest ancestor that has one.
    pub(crate) fn present_page(&self, page: PageId) -> PageId {
        let Some(present) = self.get(page.texture()).and_then(|texture| texture.present.as_deref()) else {
            return page;
        };
        let has_tile = |page: &PageId| self.pos(*page).is_some_and(|(_, pos)| present.contains(pos));
        std::iter::once(page).chain(self.ancestors(page)).find(has_tile).unwrap_or(page)
    }

    /// Returns true if any page of any texture has no tile.
    pub(crate) fn are_sparse(&self) -> bool {
        self.sparse > 0
    }

    /// Returns true if the page is a tail. The page exists.
    pub(crate) fn is_tail(&self, page: PageId) -> bool {
        self.pos(page).is_some_and(|(geometry, pos)| geometry.is_tail(pos))
    }

    /// Level and coordinates of a page.
    pub(crate) fn pos(&self, page: PageId) -> Option<(&Geometry, PagePos)> {
        let geometry = self.geometry(page.texture())?;
        Some((geometry, page.pos(geometry.dims())))
    }

    /// The page of the next coarser level that covers this one; `None` for a tail.
    pub(crate) fn parent(&self, page: PageId) -> Option<PageId> {
        let (geometry, pos) = self.pos(page)?;
        page_id(page.texture(), geometry, geometry.parent(pos)?)
    }

    /// The ancestors of a page, nearest first, its tail last.
    pub(crate) fn ancestors(&self, page: PageId) -> impl Iterator<Item = PageId> + '_ {
        std::iter::successors(self.parent(page), |&page| self.parent(page))
    }
}
