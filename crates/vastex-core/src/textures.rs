//! The textures of a pager, and the walks from page to page that need their geometry.

use std::sync::Arc;

use crate::geometry::Geometry;
use crate::page::{PageId, PagePos, TextureId};
use crate::pool::Slot;

/// One texture of a pool.
#[derive(Clone, Debug)]
struct Texture {
    geometry: Arc<Geometry>,
    tail_slot: Slot,
}

/// All textures of a pager, by number.
#[derive(Clone, Debug, Default)]
pub(crate) struct Textures {
    textures: Vec<Texture>,
}

impl Textures {
    /// Adds a texture; nothing where there are as many as a page id can tell apart.
    pub(crate) fn add(&mut self, geometry: Arc<Geometry>, tail_slot: Slot) -> Option<TextureId> {
        let id = TextureId::new(u16::try_from(self.textures.len()).ok()?)?;
        self.textures.push(Texture { geometry, tail_slot });
        Some(id)
    }

    pub(crate) fn len(&self) -> usize {
        self.textures.len()
    }

    pub(crate) fn geometry(&self, texture: TextureId) -> Option<&Arc<Geometry>> {
        self.textures.get(usize::from(texture.number())).map(|texture| &texture.geometry)
    }

    /// The pages and slots of all tails.
    pub(crate) fn tails(&self) -> impl Iterator<Item = (PageId, Slot)> + '_ {
        self.textures.iter().enumerate().filter_map(|(number, texture)| {
            let id = TextureId::new(number as u16)?;
            Some((page_id(id, &texture.geometry, texture.geometry.tail_pos())?, texture.tail_slot))
        })
    }

    /// Whether the page exists, in a texture that exists.
    pub(crate) fn contains(&self, page: PageId) -> bool {
        self.pos(page).is_some_and(|(geometry, pos)| geometry.contains(pos))
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
