//! A part of a texture that an application names, and the pages that it comes to.

use std::ops::{Range, RangeInclusive};

use crate::texture::geometry::{AddressMode, Geometry};
use crate::texture::page::PagePos;

/// A box of texels of level 0, on a range of levels. What lies beyond the texture counts for nothing.
///
/// ```
/// use vastex_core::{Geometry, GeometrySpec, Region};
/// let geometry = Geometry::new(GeometrySpec { page: 128, ..GeometrySpec::image(4096, 2048) })?;
/// // A quarter of the image, at level 1 and nothing else: 8x4 pages.
/// assert_eq!(Region::image(0..2048, 0..1024).on_levels(1..=1).page_count(&geometry), 32);
/// # Ok::<(), vastex_core::GeometryError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Region {
    /// Texels of level 0 along x, y and z.
    pub texels: [Range<u32>; 3],
    /// Levels; those coarser than the texture's last are the same as that.
    pub levels: RangeInclusive<u8>,
}

/// How a page belongs to a region by the texels that it covers, or by all that its tile holds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reach {
    Payload,
    Tile,
}

impl Region {
    /// The whole of a texture, on all levels.
    pub fn whole() -> Region {
        Region { texels: [0..u32::MAX, 0..u32::MAX, 0..u32::MAX], levels: 0..=u8::MAX }
    }

    /// Columns and rows of an image, on all levels.
    pub fn image(columns: Range<u32>, rows: Range<u32>) -> Region {
        Region { texels: [columns, rows, 0..1], ..Region::whole() }
    }

    /// The region's texels on these levels alone.
    pub fn on_levels(self, levels: RangeInclusive<u8>) -> Region {
        Region { levels, ..self }
    }

    /// Returns true if the tile of a page that exists holds a texel of the region, in its borders too.
    pub fn concerns(&self, geometry: &Geometry, pos: PagePos) -> bool {
        self.touches(geometry, pos, Reach::Tile)
    }

    /// How many pages of the texture cover the region, the tail counted as one.
    pub fn page_count(&self, geometry: &Geometry) -> u64 {
        let tail = u64::from(self.has_tail(geometry));
        let of_level = |level| -> u64 {
            let along = |a| self.pages_along(geometry, level, a, Reach::Payload);
            (0..3).map(|a| along(a).into_iter().map(|pages| pages.len() as u64).sum::<u64>()).product()
        };
        self.levels_before_tail(geometry).map(of_level).sum::<u64>() + tail
    }

    /// The pages that cover the region: the tail first, then from coarse to fine, row by row within a level.
    pub(crate) fn pages<'a>(
        &'a self,
        geometry: &'a Geometry,
        reach: Reach,
    ) -> impl Iterator<Item = PagePos> + 'a {
        let tail = self.has_tail(geometry).then(|| geometry.tail_pos());
        let finer = self.levels_before_tail(geometry).rev().flat_map(move |level| {
            let [columns, rows, slices] = [0, 1, 2].map(|a| self.pages_along(geometry, level, a, reach));
            slices.into_iter().flatten().flat_map(move |z| {
                let columns = columns.clone();
                rows.clone().into_iter().flatten().flat_map(move |y| {
                    columns.clone().into_iter().flatten().map(move |x| PagePos { level, x, y, z })
                })
            })
        });
        tail.into_iter().chain(finer)
    }

    /// Returns true if a page that exists is one of [`Region::pages`].
    pub(crate) fn touches(&self, geometry: &Geometry, pos: PagePos, reach: Reach) -> bool {
        if geometry.is_tail(pos) {
            return self.has_tail(geometry);
        }
        let along = |a: usize| {
            let pages = self.pages_along(geometry, pos.level, a, reach);
            pages.iter().any(|pages| pages.contains(&pos.coords()[a]))
        };
        self.levels.contains(&pos.level) && (0..3).all(along)
    }

    fn is_empty(&self) -> bool {
        self.levels.is_empty() || self.texels.iter().any(Range::is_empty)
    }

    fn has_tail(&self, geometry: &Geometry) -> bool {
        let inside = (0..3).all(|a| self.texels[a].start < geometry.size()[a]);
        !self.is_empty() && inside && *self.levels.end() >= geometry.tail().first_level()
    }

    fn levels_before_tail(&self, geometry: &Geometry) -> Range<u8> {
        let first_of_tail = geometry.tail().first_level();
        *self.levels.start()..first_of_tail.min(self.levels.end().saturating_add(1))
    }

    /// The pages of a level along one axis: ranges apart from one another, in ascending order. There are
    /// several where what a tile holds goes on at the other end.
    fn pages_along(&self, geometry: &Geometry, level: u8, axis: usize, reach: Reach) -> [Range<u32>; 3] {
        let (shape, texels) = (geometry.level(level), &self.texels[axis]);
        if self.is_empty() || texels.start >= geometry.size()[axis] {
            return [0..0, 0..0, 0..0];
        }
        let (size, scale) = (i64::from(shape.size[axis]), shape.scale[axis] as i64);
        // In texels of the level, whose last one may stand for fewer texels of level 0 than the others.
        let (first, end) = (i64::from(texels.start) / scale, (i64::from(texels.end) + scale - 1) / scale);
        let end = end.min(size);
        let side = i64::from(geometry.page()[axis]);
        let margin = if reach == Reach::Tile { i64::from(geometry.border()[axis]) } else { 0 };
        let pages = |(first, end): (i64, i64)| {
            let (before, after) =
                ((first - margin).div_euclid(side), (end - 1 + margin).div_euclid(side) + 1);
            let bound = |page: i64| page.clamp(0, i64::from(shape.pages[axis])) as u32;
            bound(before)..bound(after)
        };
        let here = (first, end);
        let beyond = match geometry.address()[axis] {
            _ if reach == Reach::Payload => [here; 2],
            AddressMode::Wrap => [(first - size, end - size), (first + size, end + size)],
            AddressMode::Mirror => [(-end, -first), (2 * size - end, 2 * size - first)],
            AddressMode::Clamp | AddressMode::Border => [here; 2],
        };
        apart([pages(here), pages(beyond[0]), pages(beyond[1])])
    }
}

/// The numbers of these ranges in ranges that do not overlap, in ascending order.
fn apart(mut ranges: [Range<u32>; 3]) -> [Range<u32>; 3] {
    ranges.sort_by_key(|range| range.start);
    let mut reached = 0;
    ranges.map(|range| {
        let rest = range.start.max(reached)..range.end.max(reached);
        reached = rest.end;
        rest
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::geometry::GeometrySpec;
    use crate::texture::space::fold;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// By looking at every texel that each page's tile, or its payload, holds.
    fn naive(region: &Region, geometry: &Geometry, reach: Reach) -> BTreeSet<PagePos> {
        let covers = |pos: PagePos, axis: usize| {
            let shape = geometry.level(pos.level);
            let (border, side) = (i64::from(geometry.border()[axis]), i64::from(geometry.page()[axis]));
            let (size, origin) = (shape.size[axis], i64::from(pos.coords()[axis]) * side);
            let margin = if reach == Reach::Tile { border } else { 0 };
            (origin - margin..origin + side + margin).any(|texel| {
                let inside = (0..i64::from(size)).contains(&texel);
                let texel = u64::from(fold(geometry.address()[axis], texel, size));
                let wanted = &region.texels[axis];
                let (first, end) = (texel * shape.scale[axis], (texel + 1) * shape.scale[axis]);
                let end = end.min(u64::from(geometry.size()[axis]));
                (inside || reach == Reach::Tile)
                    && first < u64::from(wanted.end)
                    && end > u64::from(wanted.start)
            })
        };
        geometry
            .pages()
            .filter(|pos| match geometry.is_tail(*pos) {
                true => *region.levels.end() >= geometry.tail().first_level(),
                false => region.levels.contains(&pos.level) && (0..3).all(|axis| covers(*pos, axis)),
            })
            .collect()
    }

    proptest! {
        #[test]
        fn the_pages_are_those_whose_texels_lie_in_the_region(
            (x, y) in (0u32..300, 0u32..170), (w, h) in (1u32..300, 1u32..170), levels in (0u8..7, 0u8..7), mode in 0usize..4, tile: bool,
        ) {
            let modes = [AddressMode::Wrap, AddressMode::Clamp, AddressMode::Mirror, AddressMode::Border];
            let address = [modes[mode]; 3];
            let spec = GeometrySpec { page: 16, border: 4, address, ..GeometrySpec::image(300, 170) };
            let geometry = Geometry::new(spec).unwrap();
            let region = Region::image(x..x + w, y..y + h).on_levels(levels.0.min(levels.1)..=levels.0.max(levels.1));
            let reach = if tile { Reach::Tile } else { Reach::Payload };
            let pages: Vec<_> = region.pages(&geometry, reach).collect();
            let distinct: BTreeSet<_> = pages.iter().copied().collect();
            prop_assert_eq!(pages.len(), distinct.len(), "each once");
            prop_assert_eq!(&distinct, &naive(&region, &geometry, reach));
            for pos in geometry.pages() {
                prop_assert_eq!(region.touches(&geometry, pos, reach), distinct.contains(&pos));
            }
            if !tile {
                prop_assert_eq!(region.page_count(&geometry), pages.len() as u64);
            }
        }
    }

    #[test]
    fn what_lies_outside_counts_for_nothing() {
        let geometry = Geometry::new(GeometrySpec::image(4096, 2048)).unwrap();
        assert_eq!(Region::image(4096..5000, 0..10).page_count(&geometry), 0);
        assert_eq!(Region::image(10..10, 0..10).page_count(&geometry), 0);
        assert_eq!(Region::whole().page_count(&geometry), geometry.page_count());
        let volume = Geometry::new(GeometrySpec::volume([500, 400, 300])).unwrap();
        assert_eq!(Region::whole().pages(&volume, Reach::Tile).count() as u64, volume.page_count());
    }
}
