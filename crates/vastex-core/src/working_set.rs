//! The working set: the distinct pages that a view wants over one jitter cycle, with their ancestors.
//!
//! Feedback is unbiased and says how sharply each page is needed, so the size of the set is known at every mip bias at
//! once: a page of level `l`, of whose pixels the sharpest needs `n` eighths, is wanted at every bias below
//! `8 * (l + 1) - n`, and at none above. That number is the page's *threshold*; a histogram of thresholds answers
//! "what is the smallest bias whose set fits?" without trying any.
//!
//! Tails are not counted here: they are pinned. Which bias is taken, and when it falls again, is `bias`'s business;
//! what is loaded first, `order`'s.

use rustc_hash::FxHashMap;
use std::collections::VecDeque;

use crate::feedback::{Feedback, Need, WantedPage};
use crate::page::{PageId, TextureId};
use crate::shared::{JITTER_CYCLE, MAX_LEVELS, STEPS_PER_LEVEL};
use crate::textures::Textures;

/// Thresholds are at most 8 times the number of levels.
const THRESHOLDS: usize = (MAX_LEVELS * STEPS_PER_LEVEL) as usize + 1;

/// What the feedbacks of the last jitter cycle said of one page.
#[derive(Clone, Copy, Debug, Default)]
struct Direct {
    /// Feedback pixels, summed over the cycle.
    pixels: u32,
    /// Feedbacks of the cycle in which the sharpest need was so many eighths.
    feedbacks: [u8; STEPS_PER_LEVEL as usize],
}

/// A page of the working set.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    /// The sharpest need of the page and all that lies below it.
    need: Need,
    /// Feedback pixels of the page and all that lies below it, over the cycle.
    pub(crate) pixels: u32,
    /// Those of them that already show something finer than the page.
    pub(crate) finer: u32,
}

impl Node {
    fn threshold(&self, level: u8) -> u16 {
        (u16::from(level) + 1) * STEPS_PER_LEVEL as u16 - self.need.eighths()
    }
}

/// See the head of the file.
#[derive(Debug)]
pub(crate) struct WorkingSet {
    cycle: VecDeque<Vec<WantedPage>>,
    /// The memory of a feedback that was let go, for the next one.
    spare: Vec<WantedPage>,
    direct: FxHashMap<PageId, Direct>,
    nodes: FxHashMap<PageId, Node>,
    by_level: Vec<Vec<PageId>>,
    histogram: Vec<u32>,
    /// Pixels of each feedback of the cycle, those that want tails among them.
    pixels: VecDeque<u64>,
    shortfall: Shortfall,
}

/// How much coarser than at mip bias 0 the picture is, by the pixels of the cycle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shortfall {
    /// Feedback pixels whose wanted page is not resident.
    pub(crate) pixels: u64,
    /// Levels by which what is resident is coarser than what they want, summed over them.
    pub(crate) levels: u64,
}

impl WorkingSet {
    pub(crate) fn new() -> WorkingSet {
        WorkingSet {
            cycle: VecDeque::new(),
            spare: Vec::new(),
            direct: FxHashMap::default(),
            nodes: FxHashMap::default(),
            by_level: vec![Vec::new(); MAX_LEVELS as usize],
            histogram: vec![0; THRESHOLDS],
            pixels: VecDeque::new(),
            shortfall: Shortfall::default(),
        }
    }

    /// Forgets everything: the view has jumped.
    pub(crate) fn restart(&mut self) {
        self.cycle.clear();
        self.direct.clear();
        self.pixels.clear();
    }

    /// Forgets what was wanted of a texture; the set follows when it is worked out again.
    pub(crate) fn forget(&mut self, texture: TextureId) {
        self.cycle.iter_mut().for_each(|pages| pages.retain(|wanted| wanted.page.texture() != texture));
        self.direct.retain(|page, _| page.texture() != texture);
    }

    /// Feedbacks now in the set, at most a jitter cycle of them.
    pub(crate) fn feedbacks(&self) -> usize {
        self.cycle.len()
    }

    /// Whether under a quarter of the feedback's pixels fall on pages of the set, their ancestors or descendants.
    ///
    /// Only a set of a whole jitter cycle can tell: where pages are smaller than the blocks of pixels that feedback
    /// stands for, the frames of a cycle see different pages of one view.
    pub(crate) fn is_jump(&self, feedback: &Feedback, textures: &Textures) -> bool {
        if self.direct.is_empty() || self.cycle.len() < JITTER_CYCLE as usize {
            return false;
        }
        let (mut related, mut all) = (0u64, 0u64);
        for wanted in feedback.pages.iter().filter(|w| textures.contains(w.page)) {
            all += u64::from(wanted.pixels);
            let near = textures.is_tail(wanted.page)
                || self.nodes.contains_key(&wanted.page)
                || textures.ancestors(wanted.page).any(|page| self.direct.contains_key(&page));
            related += if near { u64::from(wanted.pixels) } else { 0 };
        }
        related * 4 < all
    }

    /// Takes in a feedback, and lets go of the one that is a jitter cycle old. Pages that do not exist are dropped.
    pub(crate) fn observe(&mut self, feedback: &Feedback, textures: &Textures) {
        if self.cycle.len() == JITTER_CYCLE as usize {
            self.forget_oldest();
        }
        let mut pages = std::mem::take(&mut self.spare);
        let exists = |w: &&WantedPage| textures.contains(w.page);
        let below_tail = |w: &WantedPage| !textures.is_tail(w.page);
        let present = feedback.pages.iter().filter(exists).map(|&wanted| textures.present(wanted));
        pages.extend(present.filter(below_tail));
        if textures.are_sparse() {
            merge_same(&mut pages);
        }
        for wanted in &pages {
            let direct = self.direct.entry(wanted.page).or_default();
            direct.pixels = direct.pixels.saturating_add(wanted.pixels);
            let count = &mut direct.feedbacks[usize::from(wanted.eighth & 7)];
            *count = count.saturating_add(1);
        }
        self.cycle.push_back(pages);
        self.pixels.push_back(feedback.pages.iter().map(|wanted| u64::from(wanted.pixels)).sum());
    }

    fn forget_oldest(&mut self) {
        let Some(mut oldest) = self.cycle.pop_front() else { return };
        self.pixels.pop_front();
        for wanted in oldest.drain(..) {
            let Some(direct) = self.direct.get_mut(&wanted.page) else { continue };
            direct.pixels = direct.pixels.saturating_sub(wanted.pixels);
            let count = &mut direct.feedbacks[usize::from(wanted.eighth & 7)];
            *count = count.saturating_sub(1);
            if direct.feedbacks == [0; STEPS_PER_LEVEL as usize] {
                self.direct.remove(&wanted.page);
            }
        }
        self.spare = oldest;
    }

    /// Works out the set from the feedbacks: every page wanted and every ancestor, once. Costs one visit of each.
    pub(crate) fn rebuild(&mut self, textures: &Textures, is_resident: impl Fn(PageId) -> bool) {
        self.nodes.clear();
        self.histogram.fill(0);
        self.shortfall = Shortfall::default();
        self.by_level.iter_mut().for_each(Vec::clear);
        for (&page, direct) in &self.direct {
            self.shortfall.pixels += if is_resident(page) { 0 } else { u64::from(direct.pixels) };
            let eighth = direct.feedbacks.iter().position(|&n| n > 0).unwrap_or(0);
            let node = Node { need: Need::new(page.level(), eighth as u8), pixels: direct.pixels, finer: 0 };
            self.nodes.insert(page, node);
            self.by_level[usize::from(page.level())].push(page);
        }
        for level in 0..self.by_level.len() {
            let pages = std::mem::take(&mut self.by_level[level]);
            for &page in &pages {
                let Some(&node) = self.nodes.get(&page) else { continue };
                self.histogram[usize::from(node.threshold(page.level()))] += 1;
                // Each pixel that shows nothing as fine as this page shows something a level coarser at best.
                let shown = if is_resident(page) { node.pixels } else { node.finer };
                self.shortfall.levels += u64::from(node.pixels.saturating_sub(shown));
                let Some(parent) = textures.parent(page).filter(|&parent| !textures.is_tail(parent)) else {
                    continue;
                };
                let above = self.nodes.entry(parent).or_insert_with(|| {
                    self.by_level[usize::from(parent.level())].push(parent);
                    Node { need: node.need, pixels: 0, finer: 0 }
                });
                above.need = above.need.min(node.need);
                above.pixels = above.pixels.saturating_add(node.pixels);
                above.finer = above.finer.saturating_add(shown);
            }
            self.by_level[level] = pages;
        }
    }

    /// Feedback pixels of the cycle, those that want tails among them.
    pub(crate) fn pixels(&self) -> u64 {
        self.pixels.iter().sum()
    }

    /// How much coarser than wanted the picture was when the set was worked out.
    pub(crate) fn shortfall(&self) -> Shortfall {
        self.shortfall
    }

    /// Pages of the set at a bias, in eighths of a level; tails not counted.
    pub(crate) fn size_at(&self, bias: u16) -> u32 {
        self.histogram.iter().skip(usize::from(bias) + 1).sum()
    }

    /// The smallest bias, in eighths of a level, at which the set has at most `limit` pages.
    pub(crate) fn bias_for(&self, limit: u32) -> u16 {
        let mut size = 0;
        for bias in (0..THRESHOLDS).rev() {
            size += self.histogram[bias]; // pages of this threshold are wanted at every smaller bias
            if size > limit {
                return bias as u16;
            }
        }
        0
    }

    /// The pages of the set at a bias, in eighths of a level, coarsest first.
    pub(crate) fn pages_at(&self, bias: u16) -> impl Iterator<Item = (PageId, &Node)> + '_ {
        self.by_level.iter().rev().flatten().filter_map(move |&page| {
            let node = self.nodes.get(&page)?;
            (node.threshold(page.level()) > bias).then_some((page, node))
        })
    }

    /// The pages that feedback named, with their pixels over the cycle.
    pub(crate) fn direct_pages(&self) -> impl Iterator<Item = (PageId, u32)> + '_ {
        self.direct.iter().map(|(&page, direct)| (page, direct.pixels))
    }
}

/// Makes one entry of those of the same page, for which several that have no tiles may stand.
pub(crate) fn merge_same(pages: &mut Vec<WantedPage>) {
    pages.sort_unstable();
    pages.dedup_by(|next, first| {
        let same = next.page == first.page;
        if same {
            first.pixels = first.pixels.saturating_add(next.pixels);
            first.eighth = first.eighth.min(next.eighth);
        }
        same
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Geometry, GeometrySpec};
    use crate::page::{Dims, PagePos};
    use proptest::prelude::*;
    use std::collections::BTreeSet;
    use std::sync::Arc;

    fn textures() -> (Textures, TextureId, Arc<Geometry>) {
        let geometry = Arc::new(Geometry::new(GeometrySpec::image(8192, 4096)).unwrap());
        let mut textures = Textures::default();
        let id = TextureId::new(0).unwrap();
        assert!(textures.add(id, geometry.clone(), None));
        (textures, id, geometry)
    }

    fn wanted(texture: TextureId, level: u8, x: u32, y: u32, eighth: u8) -> WantedPage {
        let page = PageId::new(texture, Dims::D2, PagePos::new_2d(level, x, y)).unwrap();
        WantedPage { page, pixels: 1, eighth }
    }

    /// The set at a bias as the design states it: for each need, the ancestor at its level, and its ancestors.
    fn naive(list: &[WantedPage], geometry: &Geometry, bias: u16) -> BTreeSet<PagePos> {
        let mut set = BTreeSet::new();
        for w in list {
            let pos = w.page.pos(Dims::D2);
            let level = Need::new(pos.level, w.eighth).level_at(bias);
            let mut at = geometry.ancestor(pos, level.min(geometry.coarsest()));
            while !geometry.is_tail(at) {
                set.insert(at);
                at = geometry.parent(at).unwrap();
            }
        }
        set
    }

    proptest! {
        #[test]
        fn thresholds_agree_with_the_definition(list in prop::collection::vec((0u8..6, any::<u32>(), any::<u32>(), 0u8..8), 0..60)) {
            let (textures, id, geometry) = textures();
            let list: Vec<_> = list.into_iter().map(|(level, x, y, eighth)| {
                let [nx, ny, _] = geometry.level(level).pages;
                wanted(id, level, x % nx, y % ny, eighth)
            }).collect();
            let mut set = WorkingSet::new();
            set.observe(&Feedback { frame: 0, pages: list.clone(), degenerate: 0 }, &textures);
            set.rebuild(&textures, |_| false);
            for bias in 0..70 {
                let expected = naive(&list, &geometry, bias);
                prop_assert_eq!(set.size_at(bias) as usize, expected.len());
                let pages: BTreeSet<_> = set.pages_at(bias).map(|(page, _)| page.pos(Dims::D2)).collect();
                prop_assert_eq!(pages, expected);
            }
            for limit in 0..60 {
                let bias = set.bias_for(limit);
                prop_assert!(set.size_at(bias) <= limit);
                prop_assert!(bias == 0 || set.size_at(bias - 1) > limit);
            }
        }
    }

    proptest! {
        #[test]
        fn the_shortfall_is_what_each_pixel_lacks(
            list in prop::collection::vec((0u8..10, any::<u32>(), any::<u32>(), 1u32..100), 0..60),
            residents in 0u64..8,
        ) {
            let (textures, id, geometry) = textures();
            let list: Vec<_> = list.into_iter().map(|(level, x, y, pixels)| {
                let [nx, ny, _] = geometry.level(level).pages;
                WantedPage { pixels, ..wanted(id, level, x % nx, y % ny, 0) }
            }).collect();
            // More of the coarse pages than of the fine ones.
            let is_resident =
                |page: PageId| page.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 61 < residents + u64::from(page.level());
            let mut set = WorkingSet::new();
            set.observe(&Feedback { frame: 0, pages: list.clone(), degenerate: 0 }, &textures);
            set.rebuild(&textures, is_resident);
            let (mut pixels, mut levels) = (0, 0);
            for w in &list {
                let shown = std::iter::once(w.page)
                    .chain(textures.ancestors(w.page))
                    .find(|&page| textures.is_tail(page) || is_resident(page))
                    .unwrap();
                let short = u64::from(shown.level().saturating_sub(w.page.level()));
                pixels += u64::from(w.pixels) * u64::from(short > 0);
                levels += u64::from(w.pixels) * short;
            }
            prop_assert_eq!((set.shortfall().pixels, set.shortfall().levels), (pixels, levels));
            prop_assert_eq!(set.pixels(), list.iter().map(|w| u64::from(w.pixels)).sum::<u64>());
        }
    }

    #[test]
    fn a_page_stays_for_one_jitter_cycle() {
        let (textures, id, _) = textures();
        let mut set = WorkingSet::new();
        set.observe(&Feedback { frame: 0, pages: vec![wanted(id, 2, 1, 1, 3)], degenerate: 0 }, &textures);
        for frame in 1..=JITTER_CYCLE as u64 {
            set.rebuild(&textures, |_| false);
            assert_eq!(set.size_at(0), 4, "frame {frame}");
            set.observe(&Feedback { frame, ..Feedback::default() }, &textures);
        }
        set.rebuild(&textures, |_| false);
        assert_eq!(set.size_at(0), 0);
    }

    #[test]
    fn a_far_view_is_a_jump_and_a_near_one_is_not() {
        let (textures, id, _) = textures();
        let mut set = WorkingSet::new();
        let view = |x| Feedback { frame: 0, pages: vec![wanted(id, 0, x, 0, 0)], degenerate: 0 };
        for _ in 0..JITTER_CYCLE {
            assert!(!set.is_jump(&view(40), &textures), "too early to tell");
            set.observe(&view(3), &textures);
        }
        set.rebuild(&textures, |_| false);
        assert!(!set.is_jump(&view(3), &textures));
        assert!(set.is_jump(&view(40), &textures));
        let coarser = Feedback { frame: 1, pages: vec![wanted(id, 3, 0, 0, 0)], degenerate: 0 };
        assert!(!set.is_jump(&coarser, &textures), "zooming out is no jump");
    }
}
