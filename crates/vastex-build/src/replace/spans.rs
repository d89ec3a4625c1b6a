//! Which texels along one axis change, level by level, and which pages show them.
//!
//! What changes of an image is a rectangle, and stays columns times rows on every level. At a wrapping edge
//! the texels of the next level near one end can be made of those at the other end too, so along an axis
//! there can be several ranges.

use std::ops::Range;

use vastex_core::{AddressMode, Geometry, fold, is_border_color};

use crate::texels::filter::Reach;

/// Texels (or pages) along one axis of a level: ranges that ascend and do not touch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Spans(Vec<Range<u32>>);

impl Spans {
    /// The texels of all `ranges`, which may overlap.
    pub(super) fn new(ranges: impl IntoIterator<Item = Range<u32>>) -> Spans {
        let mut sorted: Vec<_> = ranges.into_iter().filter(|range| !range.is_empty()).collect();
        sorted.sort_unstable_by_key(|range| range.start);
        let mut merged: Vec<Range<u32>> = Vec::with_capacity(sorted.len());
        for range in sorted {
            match merged.last_mut() {
                Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
                _ => merged.push(range),
            }
        }
        Spans(merged)
    }

    /// The texels of both.
    pub(super) fn and(&self, other: &Spans) -> Spans {
        Spans::new(self.0.iter().chain(&other.0).cloned())
    }

    /// The ranges of a coarser grid, one of whose steps is `unit` texels, that hold any of these texels.
    pub(super) fn in_units(&self, unit: u32) -> Spans {
        Spans::new(self.0.iter().map(|range| range.start / unit..range.end.div_ceil(unit)))
    }

    pub(super) fn ranges(&self) -> &[Range<u32>] {
        &self.0
    }

    /// All texels, ascending.
    pub(super) fn texels(&self) -> impl Iterator<Item = u32> + '_ {
        self.0.iter().cloned().flatten()
    }

    /// Number of texels.
    pub(super) fn count(&self) -> usize {
        self.0.iter().map(ExactSizeIterator::len).sum()
    }

    pub(super) fn contains(&self, texel: u32) -> bool {
        self.0.iter().any(|range| range.contains(&texel))
    }

    /// The place of a texel among all; `None` for one that is not here.
    pub(super) fn index_of(&self, texel: u32) -> Option<usize> {
        let mut before = 0;
        for range in &self.0 {
            if range.contains(&texel) {
                return Some(before + (texel - range.start) as usize);
            }
            before += range.len();
        }
        None
    }
}

/// Texels that lie side by side in a tile as well as among the changed ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    /// First texel, from the beginning of the box of the tile.
    pub(super) to: usize,
    /// First texel, by its place among those of the patch.
    pub(super) from: usize,
    pub(super) len: usize,
}

/// Texels side by side within one page that all change, or all do not.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) page: u32,
    pub(super) range: Range<u32>,
    pub(super) changes: bool,
}

/// One axis of one level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    mode: AddressMode,
    size: u32,
    page: u32,
    pages: u32,
    border: u32,
    /// How the next level is made.
    reach: Reach,
}

impl Axis {
    pub(super) fn new(geometry: &Geometry, level: u8, axis: usize, reach: Reach) -> Axis {
        let shape = geometry.level(level);
        let size = shape.size[axis];
        let in_tail = level >= geometry.tail().first_level();
        Axis {
            mode: geometry.address()[axis],
            size,
            page: if in_tail { size } else { geometry.page()[axis] },
            pages: if in_tail { 1 } else { shape.pages[axis] },
            border: geometry.border()[axis],
            reach,
        }
    }

    /// The texel inside the level that `texel` stands for; `None` if the border colour stands.
    pub(super) fn inside(&self, texel: i64) -> Option<u32> {
        (!is_border_color(self.mode, texel, self.size)).then(|| fold(self.mode, texel, self.size))
    }

    /// The page that shows a texel of the level within its payload, and the texel's place from the beginning
    /// of the page's tile.
    pub(super) fn place(&self, texel: u32) -> (u32, usize) {
        (texel / self.page, (texel % self.page + self.border) as usize)
    }

    /// The page whose tile is the first to ask for what stands at `texel`, beyond the edges too.
    pub(super) fn owner(&self, texel: i64) -> u32 {
        texel.div_euclid(self.page.into()).clamp(0, i64::from(self.pages) - 1) as u32
    }

    /// The page beside the texel's owner whose tile holds the texel in its border, if there is one.
    pub(super) fn second_owner(&self, texel: i64) -> Option<u32> {
        let (owner, border) = (self.owner(texel), i64::from(self.border));
        let from_page = texel - i64::from(owner) * i64::from(self.page);
        if (0..border).contains(&from_page) {
            return owner.checked_sub(1);
        }
        let from_next = i64::from(self.page) - from_page;
        ((1..=border).contains(&from_next) && owner + 1 < self.pages).then(|| owner + 1)
    }

    /// The place of a texel from the beginning of the tile of a page that holds it.
    pub(super) fn place_in(&self, texel: i64, page: u32) -> usize {
        (texel - i64::from(page) * i64::from(self.page) + i64::from(self.border)) as usize
    }

    /// The texels within the payload of some pages.
    pub(super) fn texels_of(&self, pages: &Spans) -> Spans {
        let first = |page: u32| (u64::from(page) * u64::from(self.page)).min(self.size.into()) as u32;
        Spans::new(pages.ranges().iter().map(|pages| first(pages.start)..first(pages.end)))
    }

    /// Returns true if all of the texels `origin..origin + len` show a changed one.
    pub(super) fn all_change(&self, changed: &Spans, origin: i64, len: u32) -> bool {
        let mut shown = origin..origin + i64::from(len);
        shown.all(|texel| self.inside(texel).is_some_and(|texel| changed.contains(texel)))
    }

    /// The texels that one of the next level is made of.
    fn sources(&self, coarse: u32) -> impl Iterator<Item = u32> + '_ {
        self.reach.of(coarse).filter_map(|texel| self.inside(texel))
    }

    /// The texels of the next level that look beyond an edge.
    fn at_edges(&self) -> impl Iterator<Item = u32> + use<> {
        let (count, factor) = (self.size.div_ceil(self.reach.factor), i64::from(self.reach.factor));
        let texels = |n: i64| (n.max(0).div_euclid(factor) + 1).min(count.into()) as u32;
        let before = texels(-self.reach.first);
        let after = texels(self.reach.first + i64::from(self.reach.count));
        (0..before).chain((count - after).max(before)..count)
    }

    /// Texels of the next level that are made of any of `changed`.
    pub(super) fn coarser(&self, changed: &Spans) -> Spans {
        let (count, factor) =
            (i64::from(self.size.div_ceil(self.reach.factor)), i64::from(self.reach.factor));
        let made = |range: &Range<u32>| {
            // The first whose last source is not before the range, and the last whose first source is not
            // behind it.
            let last_source = self.reach.first + i64::from(self.reach.count) - 1;
            let first = (i64::from(range.start) - last_source + factor - 1).div_euclid(factor);
            let last = (i64::from(range.end) - 1 - self.reach.first).div_euclid(factor);
            first.clamp(0, count) as u32..(last + 1).clamp(0, count) as u32
        };
        let edges =
            self.at_edges().filter(|&coarse| self.sources(coarse).any(|texel| changed.contains(texel)));
        Spans::new(changed.ranges().iter().map(made).chain(edges.map(|coarse| coarse..coarse + 1)))
    }

    /// Texels that those of the next level are made of.
    pub(super) fn finer(&self, coarse: &Spans) -> Spans {
        let inside = |texel: i64| texel.clamp(0, self.size.into()) as u32;
        let direct = coarse.ranges().iter().map(|range| {
            let sources = self.reach.of_run(range);
            inside(sources.start)..inside(sources.end)
        });
        let edges = self.at_edges().filter(|&texel| coarse.contains(texel));
        let folded = edges.flat_map(|texel| self.sources(texel)).map(|texel| texel..texel + 1);
        Spans::new(direct.chain(folded))
    }

    /// The pages whose tiles show any of `changed`, ascending.
    pub(super) fn pages(&self, changed: &Spans) -> Vec<u32> {
        let near = changed.ranges().iter().flat_map(|range| {
            let last = u64::from(range.end) - 1 + u64::from(self.border);
            range.start.saturating_sub(self.border) / self.page..=(last / u64::from(self.page)) as u32
        });
        // Tiles that reach beyond an edge show what the address mode puts there.
        let edges = [0, self.pages.saturating_sub(2), self.pages - 1];
        let mut pages: Vec<u32> = near.chain(edges).filter(|&page| page < self.pages).collect();
        pages.sort_unstable();
        pages.dedup();
        pages.retain(|&page| {
            let origin = i64::from(page) * i64::from(self.page) - i64::from(self.border);
            !self.runs(changed, changed, origin, self.page + 2 * self.border).is_empty()
        });
        pages
    }

    /// Where the texels `origin..origin + len` show any of `changed`, which lie in a patch of the texels
    /// `patch`.
    pub(super) fn runs(&self, changed: &Spans, patch: &Spans, origin: i64, len: u32) -> Vec<Run> {
        let mut runs: Vec<Run> = Vec::new();
        for to in 0..len as usize {
            let Some(texel) = self.inside(origin + to as i64).filter(|&texel| changed.contains(texel)) else {
                continue;
            };
            let Some(from) = patch.index_of(texel) else { continue };
            match runs.last_mut() {
                Some(run) if run.to + run.len == to && run.from + run.len == from => run.len += 1,
                _ => runs.push(Run { to, from, len: 1 }),
            }
        }
        runs
    }

    /// `texels` cut at the edges of pages and of what changes.
    pub(super) fn pieces(&self, texels: &Spans, changed: &Spans) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for range in texels.ranges() {
            let mut start = range.start;
            while start < range.end {
                let page = start / self.page;
                let page_end = (u64::from(page + 1) * u64::from(self.page)).min(range.end.into()) as u32;
                let bounds = changed.ranges().iter().flat_map(|range| [range.start, range.end]);
                let end = bounds.filter(|&bound| bound > start).fold(page_end, u32::min);
                pieces.push(Piece { page, range: start..end, changes: changed.contains(start) });
                start = end;
            }
        }
        pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use vastex_core::{GeometrySpec, LayerFormat, PagePos};

    use crate::texels::filter::{Filter, Kernel, LayerFilter, Meaning};

    fn one(range: Range<u32>) -> Spans {
        Spans::new(std::iter::once(range))
    }

    #[test]
    fn at_a_wrapping_odd_edge_the_last_texel_changes_with_the_first() {
        let reach = Reach { factor: 2, first: 0, count: 2 };
        let axis = |mode| Axis { mode, size: 9, page: 9, pages: 1, border: 1, reach };
        let changed = one(0..1);
        assert_eq!(axis(AddressMode::Wrap).coarser(&changed), Spans::new([0..1, 4..5]));
        assert_eq!(axis(AddressMode::Clamp).coarser(&changed), one(0..1));
        assert_eq!(axis(AddressMode::Wrap).finer(&one(4..5)), Spans::new([0..1, 8..9]));
        assert_eq!(axis(AddressMode::Mirror).finer(&one(4..5)), one(8..9));
    }

    #[test]
    fn a_wide_kernel_looks_round_the_edge() {
        let reach = Reach { factor: 2, first: -5, count: 12 };
        let axis = |mode| Axis { mode, size: 100, page: 9, pages: 1, border: 1, reach };
        let changed = one(0..1);
        assert_eq!(axis(AddressMode::Wrap).coarser(&changed), Spans::new([0..3, 47..50]));
        assert_eq!(axis(AddressMode::Border).coarser(&changed), one(0..3));
        assert_eq!(axis(AddressMode::Wrap).finer(&one(0..1)), Spans::new([0..7, 95..100]));
    }

    proptest! {
        #[test]
        fn what_changes_is_what_a_look_at_every_texel_finds(
            size in 1u32..200, page in 8u32..40, share in 0u32..100, start in 0u32..200, len in 1u32..200,
            kernel in prop::sample::select(Kernel::ALL.to_vec()),
            mode in prop::sample::select(vec![
                AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border,
            ]),
        ) {
            let border = 1 + (page / 2 - 1) * share / 100;
            let spec = GeometrySpec { page, border, address: [mode; 3], ..GeometrySpec::image(size, 5000) };
            let geometry = Geometry::new(spec).unwrap();
            let filter = LayerFilter::new(kernel, Meaning::Stored);
            let axis = Axis::new(&geometry, 0, 0, Filter::new(filter, LayerFormat::R8, 2).reach);
            let start = start % size;
            let changed = one(start..(start + len).min(size));
            let sources = |coarse: u32| axis.reach.of(coarse).filter_map(|texel| axis.inside(texel));
            let coarse = (0..size.div_ceil(2)).filter(|&texel| sources(texel).any(|t| changed.contains(t)));
            prop_assert_eq!(coarse.collect::<Vec<_>>(), axis.coarser(&changed).texels().collect::<Vec<_>>());
            let needed = axis.finer(&axis.coarser(&changed));
            for texel in axis.coarser(&changed).texels().flat_map(sources).chain(changed.texels()) {
                prop_assert!(needed.contains(texel));
            }
            let shows = |page: &u32| {
                let tile = geometry.level_box_of_tile(PagePos::new_2d(0, *page, 0));
                (0..i64::from(tile.size[0])).any(|i| {
                    axis.inside(tile.origin[0] + i).is_some_and(|texel| changed.contains(texel))
                })
            };
            let pages: Vec<u32> = (0..geometry.level(0).pages[0]).filter(shows).collect();
            prop_assert_eq!(axis.pages(&changed), pages);
            let pieces = axis.pieces(&needed, &changed);
            prop_assert_eq!(pieces.iter().map(|piece| piece.range.len()).sum::<usize>(), needed.count());
            for Piece { page: of_piece, mut range, changes } in pieces {
                prop_assert!(range.all(|t| t / page == of_piece && changed.contains(t) == changes));
            }
        }
    }
}
