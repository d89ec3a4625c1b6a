//! What the pages of a container show before they change, those without tiles too.

use std::collections::BTreeMap;
use std::sync::Arc;

use vastex_core::{Geometry, PagePos};
use vastex_tiles::{Container, TileSource};

use super::error::ReplaceError;
use super::region::PageBox;
use super::rules::Rules;
use super::spans::Axis;
use crate::magnify::magnified;

/// The version before a change.
pub(super) struct Before {
    container: Arc<Container>,
    /// A texel of the border colour.
    color: Vec<u8>,
}

impl Before {
    pub(super) fn new(container: Arc<Container>, rules: &Rules) -> Before {
        Before { container, color: rules.color.clone() }
    }

    fn geometry(&self) -> &Geometry {
        &self.container.description().geometry
    }

    /// Whether a page has a tile.
    pub(super) fn has(&self, pos: PagePos) -> bool {
        self.container.present().is_none_or(|present| present.contains(pos))
    }

    /// The pages again, if any of them has no tile.
    pub(super) fn missing(&self, pages: PageBox) -> Option<PageBox> {
        let lacks_one = self.container.present().is_some() && pages.iter().any(|pos| !self.has(pos));
        lacks_one.then_some(pages)
    }

    /// The texels of a tile.
    pub(super) fn tile(&self, pos: PagePos) -> Result<Vec<u8>, ReplaceError> {
        let failed = |error| ReplaceError::Decode { name: self.container.name().into(), pos, error };
        let tile = pollster::block_on(self.container.read(pos))?;
        let texels = tile.decode(self.container.description()).map_err(failed)?;
        Ok(texels.into())
    }

    /// The texels of a page's tile or, where it has none, what its nearest ancestor shows in its place.
    pub(super) fn shown(&self, pos: PagePos) -> Result<Vec<u8>, ReplaceError> {
        if self.has(pos) {
            return self.tile(pos);
        }
        let geometry = self.geometry();
        let mut ancestors = std::iter::successors(geometry.parent(pos), |&pos| geometry.parent(pos));
        let nearest = ancestors.find(|&pos| self.has(pos)).unwrap_or_else(|| geometry.tail_pos());
        Ok(magnified(geometry, pos, nearest, &self.tile(nearest)?, self.color.len()))
    }

    /// As [`Before::shown`], and in the border what the pages beside it show. Of a page that has a tile, its border stays where
    /// the page beside it neither has one nor gets one, as `is_made` says.
    pub(super) fn joined(
        &self,
        pos: PagePos,
        axes: [Axis; 2],
        is_made: impl Fn(PagePos) -> bool,
    ) -> Result<Vec<u8>, ReplaceError> {
        let (shown, texel) = (self.geometry().level_box_of_tile(pos), self.color.len());
        let mut texels = self.shown(pos)?;
        let has_tile = self.has(pos);
        let joins = |of: PagePos| of != pos && (!has_tile || self.has(of) || is_made(of));
        // The page and the place in its tile of each texel along an axis; nothing where the border colour stands.
        let [columns, rows] = [0, 1].map(|a| {
            let place = |i: u32| axes[a].inside(shown.origin[a] + i64::from(i)).map(|t| axes[a].place(t));
            (0..shown.size[a]).map(place).collect::<Vec<_>>()
        });
        let side = self.geometry().tile()[0] as usize;
        let mut tiles: BTreeMap<[u32; 2], Option<Vec<u8>>> = BTreeMap::new();
        for (row, y) in texels.chunks_exact_mut(side * texel).zip(&rows) {
            for (target, x) in row.chunks_exact_mut(texel).zip(&columns) {
                let (Some((page_x, x)), Some((page_y, y))) = (x, y) else {
                    target.copy_from_slice(&self.color);
                    continue;
                };
                let tile = match tiles.entry([*page_x, *page_y]) {
                    std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
                    std::collections::btree_map::Entry::Vacant(entry) => {
                        let of = PagePos::new_2d(pos.level, *page_x, *page_y);
                        entry.insert(if joins(of) { Some(self.shown(of)?) } else { None })
                    }
                };
                if let Some(tile) = tile {
                    target.copy_from_slice(&tile[(y * side + x) * texel..][..texel]);
                }
            }
        }
        Ok(texels)
    }
}
