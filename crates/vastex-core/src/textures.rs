//! The textures of a pager, and the walks from page to page that need their geometry.

use std::sync::Arc;

use crate::feedback::WantedPage;
use crate::geometry::Geometry;
use crate::page::{PageId, PagePos, TextureId};
use crate::page_set::PageSet;

/// All textures of a pager, by number.
#[derive(Clone, Debug, Default)]
pub(crate) struct Textures {
    textures: Vec<Texture>,
}

#[derive(Clone, Debug)]
struct Texture {
    geometry: Arc<Geometry>,
    /// The pages that have tiles; nothing where all have.
    present: Option<Arc<PageSet>>,
}

impl Textures {
    /// Adds a texture; nothing where there are as many as a page id can tell apart.
    pub(crate) fn add(
        &mut self,
        geometry: Arc<Geometry>,
        present: Option<Arc<PageSet>>,
    ) -> Option<TextureId> {
        let id = TextureId::new(u16::try_from(self.textures.len()).ok()?)?;
        self.textures.push(Texture { geometry, present });
        Some(id)
    }

    pub(crate) fn len(&self) -> usize {
        self.textures.len()
    }

    pub(crate) fn geometry(&self, texture: TextureId) -> Option<&Arc<Geometry>> {
        Some(&self.textures.get(usize::from(texture.number()))?.geometry)
    }

    /// The pages of all tails.
    #[cfg(feature = "checks")]
    pub(crate) fn tails(&self) -> impl Iterator<Item = PageId> + '_ {
        self.textures.iter().enumerate().filter_map(|(number, Texture { geometry, .. })| {
            page_id(TextureId::new(number as u16)?, geometry, geometry.tail_pos())
        })
    }

    /// Whether the page exists, in a texture that exists.
    pub(crate) fn contains(&self, page: PageId) -> bool {
        self.pos(page).is_some_and(|(geometry, pos)| geometry.contains(pos))
    }

    /// What is wanted where a page that exists is wanted: the page itself, or where it has no tile its nearest ancestor that
    /// has one, as sharply as there is anything.
    pub(crate) fn present(&self, wanted: WantedPage) -> WantedPage {
        let has_tile = |page: PageId| {
            let texture = self.textures.get(usize::from(page.texture().number()));
            let present = texture.and_then(|texture| texture.present.as_deref());
            present.is_none_or(|set| self.pos(page).is_some_and(|(_, pos)| set.contains(pos)))
        };
        if has_tile(wanted.page) {
            return wanted;
        }
        let page = self.ancestors(wanted.page).find(|&page| has_tile(page));
        WantedPage { page: page.unwrap_or(wanted.page), eighth: 0, ..wanted }
    }

    /// Whether any page of any texture has no tile.
    pub(crate) fn are_sparse(&self) -> bool {
        self.textures.iter().any(|texture| texture.present.is_some())
    }

    /// Whether the page is a tail. The page exists.
    pub(crate) fn is_tail(&self, page: PageId) -> bool {
        self.pos(page).is_some_and(|(geometry, pos)| geometry.is_tail(pos))
    }

    /// Level and coordinates of a page.
    pub(crate) fn pos(&self, page: PageId) -> Option<(&Geometry, PagePos)> {
        let geometry = self.geometry(page.texture())?;
        Some((geometry, page.pos(geometry.dims())))
    }

    /// The page of the next coarser level that covers this one; nothing for a tail.
    pub(crate) fn parent(&self, page: PageId) -> Option<PageId> {
        let (geometry, pos) = self.pos(page)?;
        page_id(page.texture(), geometry, geometry.parent(pos)?)
    }

    /// The ancestors of a page, nearest first, its tail last.
    pub(crate) fn ancestors(&self, page: PageId) -> impl Iterator<Item = PageId> + '_ {
        std::iter::successors(self.parent(page), |&page| self.parent(page))
    }
}

/// Packs a page that exists; `None` cannot come of one, since geometries refuse what does not pack.
pub(crate) fn page_id(texture: TextureId, geometry: &Geometry, pos: PagePos) -> Option<PageId> {
    PageId::new(texture, geometry.dims(), pos).ok()
}
