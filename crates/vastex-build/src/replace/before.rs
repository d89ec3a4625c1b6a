//! What the pages of a container show before they change, those without tiles too.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use bytes::Bytes;
use vastex_core::{Geometry, PagePos};
use vastex_tiles::{Container, TileSource};

use super::error::ReplaceError;
use super::region::PageBox;
use super::slice::{LayerShape, Slice};
use super::spans::Axis;
use crate::texels::magnify::magnified;

/// The version before a change.
pub(super) struct Before(Arc<Container>);

impl Before {
    pub(super) fn new(container: Arc<Container>) -> Before {
        Before(container)
    }

    fn geometry(&self) -> &Geometry {
        &self.0.description().geometry
    }

    /// Returns true if a page has a tile.
    pub(super) fn has(&self, pos: PagePos) -> bool {
        self.0.present().is_none_or(|present| present.contains(pos))
    }

    /// The pages again, if any of them has no tile.
    pub(super) fn missing(&self, pages: PageBox) -> Option<PageBox> {
        let lacks_one = self.0.present().is_some() && pages.iter().any(|pos| !self.has(pos));
        lacks_one.then_some(pages)
    }

    /// The bytes of a tile: all layers.
    pub(super) fn tile(&self, pos: PagePos) -> Result<Bytes, ReplaceError> {
        let failed = |error| ReplaceError::Decode { name: self.0.name().into(), pos, error };
        let tile = pollster::block_on(self.0.read(pos))?;
        tile.decode(self.0.description()).map_err(failed)
    }

    /// A layer's texels of a page's tile or, where it has none, what its nearest ancestor shows in its place.
    pub(super) fn shown(&self, shape: &LayerShape, pos: PagePos) -> Result<Vec<u8>, ReplaceError> {
        let texels = |pos| Ok::<_, ReplaceError>(shape.decoded(&self.tile(pos)?[shape.bytes.clone()]));
        if self.has(pos) {
            return texels(pos);
        }
        let geometry = self.geometry();
        let mut ancestors = std::iter::successors(geometry.parent(pos), |&pos| geometry.parent(pos));
        let nearest = ancestors.find(|&pos| self.has(pos)).unwrap_or_else(|| geometry.tail_pos());
        Ok(magnified(&shape.geometry, pos, nearest, &texels(nearest)?, shape.texel()))
    }

    /// A layer's part of a page's tile; where pages beside it get their first tile, which those in `made`
    /// without one do, what they show stands in its border. Without a tile it is as [`Before::shown`], and
    /// its border as the pages beside it.
    ///
    /// Every tile gets the same blocks for the same place: those of the page in whose payload they lie or,
    /// where that has no tile, those of the tiles around it.
    pub(super) fn joined<'s>(
        &self,
        shape: &'s LayerShape,
        pos: PagePos,
        axes: [Axis; 2],
        made: &PageBox,
    ) -> Result<Slice<'s>, ReplaceError> {
        let page = |x, y| PagePos::new_2d(pos.level, x, y);
        let is_new = |of: PagePos| !self.has(of) && made.contains(of);
        let mut slice = match self.has(pos) {
            true => Slice::stored(shape, &self.tile(pos)?[shape.bytes.clone()]),
            false => Slice::black(shape),
        };
        let box_of_tile = shape.geometry.level_box_of_tile(pos);
        let [columns, rows] = [0, 1].map(|a| segments(axes[a], box_of_tile.origin[a], box_of_tile.size[a]));
        let mut pages = Pages { before: self, shape, axes, found: BTreeMap::new() };
        for rows in &rows {
            for columns in &columns {
                let owner = page(columns.owner, rows.owner);
                let source = columns.source.zip(rows.source).map(|(x, y)| page(x, y));
                let is_inside = columns.is_inside && rows.is_inside;
                let shows_new = !is_inside && source.is_some_and(is_new);
                let stored = match self.has(owner) {
                    true => Some(owner),
                    false if made.contains(owner) => None,
                    false => self.holding(pos, columns, rows),
                };
                match stored {
                    Some(of) if of == pos && !shows_new => {}
                    Some(of) if !shows_new => pages.copy_stored(of, columns, rows, &mut slice)?,
                    _ => pages.copy_shown(source, columns, rows, &mut slice)?,
                }
            }
        }
        Ok(slice)
    }

    /// A page that has a tile, in whose border it holds these texels: the page itself, or else any, since all
    /// agree.
    fn holding(&self, pos: PagePos, columns: &Segment, rows: &Segment) -> Option<PagePos> {
        let page = |x, y| PagePos::new_2d(pos.level, x, y);
        let pages = columns.pages().flat_map(|x| rows.pages().map(move |y| page(x, y)));
        pages.filter(|&page| self.has(page)).min_by_key(|&page| page != pos)
    }
}

/// Texels of a tile along one axis that have to do with the same pages.
struct Segment {
    /// From the beginning of the tile.
    texels: Range<usize>,
    /// The first one, as a texel of the level.
    first: i64,
    /// The page whose tile says what stands there, and the one beside it that holds them in its border.
    owner: u32,
    second_owner: Option<u32>,
    /// True if the texels are the level's, and not what the address mode puts beyond its edge.
    is_inside: bool,
    /// The page that has in its payload what stands there; `None` for the border colour.
    source: Option<u32>,
    /// Where it has each of them.
    source_places: Vec<usize>,
}

impl Segment {
    /// The pages whose tiles hold the texels.
    fn pages(&self) -> impl Iterator<Item = u32> + use<> {
        std::iter::once(self.owner).chain(self.second_owner)
    }
}

fn segments(axis: Axis, origin: i64, len: u32) -> Vec<Segment> {
    let mut segments: Vec<Segment> = Vec::new();
    for i in 0..len as usize {
        let first = origin + i as i64;
        let (owner, second_owner, inside) = (axis.owner(first), axis.second_owner(first), axis.inside(first));
        let is_inside = inside.is_some_and(|inside| i64::from(inside) == first);
        let (source, source_place) = inside.map(|inside| axis.place(inside)).unzip();
        let with = (owner, second_owner, is_inside, source);
        match segments.last_mut() {
            Some(last) if (last.owner, last.second_owner, last.is_inside, last.source) == with => {
                last.texels.end += 1;
                last.source_places.extend(source_place);
            }
            _ => {
                let (texels, source_places) = (i..i + 1, source_place.into_iter().collect());
                let segment =
                    Segment { texels, first, owner, second_owner, is_inside, source, source_places };
                segments.push(segment);
            }
        }
    }
    segments
}

/// Pages around one that is made, as they are needed.
struct Pages<'a> {
    before: &'a Before,
    shape: &'a LayerShape,
    axes: [Axis; 2],
    /// What was read: the texels, and the layer's part of the tile where there is one.
    found: BTreeMap<[u32; 2], (Vec<u8>, Option<Bytes>)>,
}

impl Pages<'_> {
    fn find(&mut self, pos: PagePos) -> Result<&(Vec<u8>, Option<Bytes>), ReplaceError> {
        if let std::collections::btree_map::Entry::Vacant(entry) = self.found.entry([pos.x, pos.y]) {
            let part = match self.before.has(pos) {
                true => Some(self.before.tile(pos)?.slice(self.shape.bytes.clone())),
                false => None,
            };
            let texels = match &part {
                Some(part) => self.shape.decoded(part),
                None => self.before.shown(self.shape, pos)?,
            };
            entry.insert((texels, part));
        }
        Ok(&self.found[&[pos.x, pos.y]])
    }

    /// Copies what the tile of a page has at the same place of the level.
    fn copy_stored(
        &mut self,
        of: PagePos,
        columns: &Segment,
        rows: &Segment,
        slice: &mut Slice<'_>,
    ) -> Result<(), ReplaceError> {
        let (side, texel) = (self.shape.side(), self.shape.texel());
        let [x, place_y] = [(0, columns, of.x), (1, rows, of.y)]
            .map(|(a, texels, page)| self.axes[a].place_in(texels.first, page));
        let (texels, part) = self.find(of)?;
        let len = columns.texels.len() * texel;
        for (i, y) in rows.texels.clone().enumerate() {
            let from = ((place_y + i) * side + x) * texel;
            let to = (y * side + columns.texels.start) * texel;
            slice.texels[to..to + len].copy_from_slice(&texels[from..from + len]);
        }
        if let Some(part) = part {
            slice.take_blocks(part, [x, place_y], &columns.texels, &rows.texels);
        }
        Ok(())
    }

    /// Fills texels with those that the page `source` has in its payload for them, or with the border colour.
    fn copy_shown(
        &mut self,
        source: Option<PagePos>,
        columns: &Segment,
        rows: &Segment,
        slice: &mut Slice<'_>,
    ) -> Result<(), ReplaceError> {
        let (side, texel) = (self.shape.side(), self.shape.texel());
        let row_of = |y: usize| (y * side + columns.texels.start) * texel;
        let len = columns.texels.len() * texel;
        match source {
            None => {
                let color = self.shape.color.repeat(columns.texels.len());
                rows.texels.clone().for_each(|y| slice.texels[row_of(y)..][..len].copy_from_slice(&color));
            }
            Some(source) => {
                let (texels, _) = self.find(source)?;
                for (y, from_y) in rows.texels.clone().zip(&rows.source_places) {
                    let row = slice.texels[row_of(y)..][..len].chunks_exact_mut(texel);
                    for (to, from_x) in row.zip(&columns.source_places) {
                        to.copy_from_slice(&texels[(from_y * side + from_x) * texel..][..texel]);
                    }
                }
            }
        }
        slice.touch(columns.texels.clone(), rows.texels.clone());
        Ok(())
    }
}
