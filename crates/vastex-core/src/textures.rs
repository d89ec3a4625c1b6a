//! The textures of a pager, and the walks from page to page that need their geometry.

use std::sync::Arc;

use crate::geometry::Geometry;
use crate::page::{PageId, PagePos, TextureId};

/// All textures of a pager, by number.
#[derive(Clone, Debug, Default)]
pub(crate) struct Textures {
    geometries: Vec<Arc<Geometry>>,
}

impl Textures {
    /// Adds a texture; nothing where there are as many as a page id can tell apart.
    pub(crate) fn add(&mut self, geometry: Arc<Geometry>) -> Option<TextureId> {
        let id = TextureId::new(u16::try_from(self.geometries.len()).ok()?)?;
        self.geometries.push(geometry);
        Some(id)
    }

    pub(crate) fn len(&self) -> usize {
        self.geometries.len()
    }

    pub(crate) fn geometry(&self, texture: TextureId) -> Option<&Arc<Geometry>> {
        self.geometries.get(usize::from(texture.number()))
    }

    /// The pages of all tails.
    #[cfg(feature = "checks")]
    pub(crate) fn tails(&self) -> impl Iterator<Item = PageId> + '_ {
        self.geometries.iter().enumerate().filter_map(|(number, geometry)| {
            page_id(TextureId::new(number as u16)?, geometry, geometry.tail_pos())
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
