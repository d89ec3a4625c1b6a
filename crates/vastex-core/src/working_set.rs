//! The working set: the distinct pages that a view wants over one jitter cycle, with their ancestors.
//!
//! Feedback is unbiased and says how sharply each page is needed, so the size of the set is known at every mip bias at
//! once: a page of level `l`, of whose pixels the sharpest needs `n` eighths, is wanted at every bias below
//! `8 * (l + 1) - n`, and at none above. That number is the page's *threshold*; a histogram of thresholds answers
//! "what is the smallest bias whose set fits?" without trying any.
//!
//! Tails are not counted here: they are pinned. Which bias is taken, and when it falls again, is `bias`'s business;
//! what is loaded first, `order`'s.

use std::collections::VecDeque;

use crate::feedback::{Feedback, Need, WantedPage};
use crate::page::{PageId, TextureId};
use crate::page_map::PageMap;
use crate::records::RecordHint;
use crate::shared::{JITTER_CYCLE, MAX_LEVELS, STEPS_PER_LEVEL};
use crate::textures::Textures;

/// Thresholds are at most 8 times the number of levels.
const THRESHOLDS: usize = (MAX_LEVELS * STEPS_PER_LEVEL) as usize + 1;
/// Instead of a node's index: there is none.
const NOWHERE: u32 = u32::MAX;

/// A page of the working set: one that a feedback of the last jitter cycle named, or an ancestor of one.
///
/// Nodes stay from frame to frame and know their parents, so that working out the set takes no look-up.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    page: PageId,
    /// The index of its parent's node; [`NOWHERE`] just below a tail.
    parent: u32,
    /// Nodes whose parent it is.
    children: u32,
    /// Feedbacks of the cycle that named the page.
    named: u32,
    /// Feedback pixels of theirs.
    named_pixels: u32,
    /// Feedbacks of the cycle in which the sharpest need was so many eighths.
    feedbacks: [u8; STEPS_PER_LEVEL as usize],
    /// It is wanted at every bias, whatever feedback says.
    is_pinned: bool,
    /// The sharpest need of the page and all that lies below it.
    need: Need,
    /// Feedback pixels of the page and all that lies below it, over the cycle.
    pub(crate) pixels: u32,
    /// Those of them that already show something finer than the page.
    pub(crate) finer: u32,
    /// Whether its tile is in a slot.
    pub(crate) is_resident: bool,
    /// Where its record was when the set was worked out.
    pub(crate) record: RecordHint,
}

impl Node {
    fn new(page: PageId, parent: u32) -> Node {
        Node {
            page,
            parent,
            children: 0,
            named: 0,
            named_pixels: 0,
            feedbacks: [0; STEPS_PER_LEVEL as usize],
            is_pinned: false,
            need: Need::LEAST,
            pixels: 0,
            finer: 0,
            is_resident: false,
            record: RecordHint::default(),
        }
    }

    fn is_in_set(&self) -> bool {
        self.named > 0 || self.children > 0 || self.is_pinned
    }

    fn own_need(&self) -> Need {
        // The first that is not 0, told from all at once.
        let eighth = u64::from_le_bytes(self.feedbacks).trailing_zeros() / u8::BITS % STEPS_PER_LEVEL;
        if self.named > 0 { Need::new(self.page.level(), eighth as u8) } else { Need::LEAST }
    }

    fn threshold(&self) -> u16 {
        if self.is_pinned {
            return THRESHOLDS as u16 - 1;
        }
        (u16::from(self.page.level()) + 1) * STEPS_PER_LEVEL as u16 - self.need.eighths()
    }
}

/// One entry of a feedback of the cycle.
#[derive(Clone, Copy, Debug)]
struct Named {
    /// The number of the feedback.
    feedback: u64,
    node: u32,
    pixels: u32,
    eighth: u8,
}

/// See the head of the file.
#[derive(Debug)]
pub(crate) struct WorkingSet {
    /// What the feedbacks of the cycle named, the oldest first.
    cycle: VecDeque<Named>,
    /// Pixels of each feedback of the cycle, those that want tails among them.
    pixels: VecDeque<u64>,
    /// Feedbacks ever.
    observed: u64,
    nodes: Vec<Node>,
    index: PageMap<u32>,
    /// The nodes of each level, and of those that have left the set since it was worked out.
    by_level: Vec<Vec<u32>>,
    left: Vec<u32>,
    /// Places in `nodes` that nobody knows any more.
    free: Vec<u32>,
    /// Pages that are wanted at every bias.
    pins: Vec<PageId>,
    histogram: Vec<u32>,
    shortfall: Shortfall,
    /// A feedback of sparse textures, kept for its memory.
    standing: Vec<WantedPage>,
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
            pixels: VecDeque::new(),
            observed: 0,
            nodes: Vec::new(),
            index: PageMap::default(),
            by_level: vec![Vec::new(); MAX_LEVELS as usize],
            left: Vec::new(),
            free: Vec::new(),
            pins: Vec::new(),
            histogram: vec![0; THRESHOLDS],
            shortfall: Shortfall::default(),
            standing: Vec::new(),
        }
    }

    /// Forgets everything but the pins: the view has jumped.
    pub(crate) fn restart(&mut self, textures: &Textures) {
        self.pixels.clear();
        self.cycle.clear();
        self.index.clear();
        self.nodes.clear();
        self.by_level.iter_mut().for_each(Vec::clear);
        self.left.clear();
        self.free.clear();
        self.pin(textures);
    }

    /// From the next time that the set is worked out on these pages are wanted at every bias; with a page its ancestors are
    /// given, but no tails.
    pub(crate) fn set_pins(&mut self, pages: impl Iterator<Item = PageId>, textures: &Textures) {
        for page in std::mem::take(&mut self.pins) {
            if let Some(&at) = self.index.get(page) {
                self.nodes[at as usize].is_pinned = false;
                self.leave(at);
            }
        }
        self.pins.extend(pages);
        self.pin(textures);
    }

    fn pin(&mut self, textures: &Textures) {
        for place in 0..self.pins.len() {
            let at = self.add(self.pins[place], textures);
            self.nodes[at as usize].is_pinned = true;
        }
    }

    /// Forgets what was wanted of a texture; the set follows when it is worked out again.
    pub(crate) fn forget(&mut self, texture: TextureId) {
        let WorkingSet { cycle, nodes, index, left, pins, .. } = self;
        pins.retain(|page| page.texture() != texture);
        cycle.retain(|named| nodes[named.node as usize].page.texture() != texture);
        index.retain(|page, &node| {
            let is_other = page.texture() != texture;
            if !is_other {
                nodes[node as usize] = Node::new(page, NOWHERE);
                left.push(node);
            }
            is_other
        });
    }

    /// Feedbacks now in the set, at most a jitter cycle of them.
    pub(crate) fn feedbacks(&self) -> usize {
        self.pixels.len()
    }

    /// Whether under a quarter of the feedback's pixels fall on pages of the set, their ancestors or descendants.
    ///
    /// Only a set of a whole jitter cycle can tell: where pages are smaller than the blocks of pixels that feedback
    /// stands for, the frames of a cycle see different pages of one view.
    pub(crate) fn is_jump(&self, feedback: &Feedback, textures: &Textures) -> bool {
        if self.cycle.is_empty() || self.feedbacks() < JITTER_CYCLE as usize {
            return false;
        }
        let is_named =
            |page: PageId| self.index.get(page).is_some_and(|&at| self.nodes[at as usize].named > 0);
        // Mostly a quarter of the pixels is soon found to be near, whatever the rest is.
        let mut all: u64 = feedback.pages.iter().map(|wanted| u64::from(wanted.pixels)).sum();
        let mut related = 0;
        for wanted in &feedback.pages {
            let is_known = self.index.get(wanted.page).is_some_and(|&at| self.nodes[at as usize].pixels > 0);
            let pixels = u64::from(wanted.pixels);
            if !is_known && !textures.contains(wanted.page) {
                all -= pixels;
                continue;
            }
            let near =
                is_known || textures.is_tail(wanted.page) || textures.ancestors(wanted.page).any(is_named);
            related += if near { pixels } else { 0 };
            if related * 4 >= all {
                return false;
            }
        }
        related * 4 < all
    }

    /// Takes in a feedback, and lets go of the one that is a jitter cycle old. Pages that do not exist are dropped.
    pub(crate) fn observe(&mut self, feedback: &Feedback, textures: &Textures) {
        self.observed += 1;
        self.pixels.push_back(feedback.pages.iter().map(|wanted| u64::from(wanted.pixels)).sum());
        if textures.are_sparse() {
            let mut standing = std::mem::take(&mut self.standing);
            let exists = |wanted: &&WantedPage| textures.contains(wanted.page);
            standing.clear();
            standing.extend(feedback.pages.iter().filter(exists).map(|&wanted| textures.present(wanted)));
            merge_same(&mut standing);
            self.name(&standing, textures);
            self.standing = standing;
        } else {
            self.name(&feedback.pages, textures);
        }
        // Last, so that what both name keeps its nodes.
        if self.feedbacks() > JITTER_CYCLE as usize {
            self.forget_oldest();
        }
    }

    fn name(&mut self, pages: &[WantedPage], textures: &Textures) {
        for &WantedPage { page, pixels, eighth } in pages {
            let at = match self.index.get(page) {
                Some(&at) => at,
                None if textures.contains(page) && !textures.is_tail(page) => self.add(page, textures),
                None => continue,
            };
            let (node, eighth) = (&mut self.nodes[at as usize], eighth & 7);
            node.named += 1;
            node.named_pixels = node.named_pixels.saturating_add(pixels);
            let count = &mut node.feedbacks[usize::from(eighth)];
            *count = count.saturating_add(1);
            self.cycle.push_back(Named { feedback: self.observed, node: at, pixels, eighth });
        }
    }

    /// The index of the page's node, made where there is none, with those of its ancestors.
    fn add(&mut self, page: PageId, textures: &Textures) -> u32 {
        if let Some(&at) = self.index.get(page) {
            return at;
        }
        let above = textures.parent(page).filter(|&parent| !textures.is_tail(parent));
        let parent = above.map_or(NOWHERE, |parent| self.add(parent, textures)); // as deep as there are levels
        if let Some(parent) = self.nodes.get_mut(parent as usize) {
            parent.children += 1;
        }
        let node = Node::new(page, parent);
        let at = self.free.pop().unwrap_or(self.nodes.len() as u32);
        match self.nodes.get_mut(at as usize) {
            Some(place) => *place = node,
            None => self.nodes.push(node),
        }
        self.index.insert(page, at);
        self.by_level[usize::from(page.level())].push(at);
        at
    }

    fn forget_oldest(&mut self) {
        let oldest = self.observed + 1 - self.feedbacks() as u64;
        self.pixels.pop_front();
        while let Some(named) = self.cycle.pop_front_if(|named| named.feedback <= oldest) {
            let node = &mut self.nodes[named.node as usize];
            node.named -= 1;
            node.named_pixels = node.named_pixels.saturating_sub(named.pixels);
            let count = &mut node.feedbacks[usize::from(named.eighth)];
            *count = count.saturating_sub(1);
            self.leave(named.node);
        }
    }

    /// Takes a node that has no reason to be in the set out of it, then its ancestors.
    fn leave(&mut self, at: u32) {
        let mut next = at;
        while let Some(node) = self.nodes.get(next as usize).filter(|node| !node.is_in_set()) {
            let parent = node.parent;
            self.index.remove(node.page);
            self.left.push(next);
            if let Some(parent) = self.nodes.get_mut(parent as usize) {
                parent.children -= 1;
            }
            next = parent;
        }
    }

    /// Works out the set from the feedbacks: every page wanted and every ancestor, once. Costs one visit of each.
    ///
    /// `find` says where the record of a page is, and whether its tile is in a slot; it is told where the record was.
    pub(crate) fn rebuild(&mut self, find: impl Fn(PageId, RecordHint) -> (RecordHint, bool)) {
        self.histogram.fill(0);
        self.shortfall = Shortfall::default();
        let WorkingSet { nodes, by_level, left, free, histogram, shortfall, .. } = self;
        for level in by_level.iter_mut() {
            if !left.is_empty() {
                level.retain(|&at| nodes[at as usize].is_in_set());
            }
            for &at in level.iter() {
                let node = &mut nodes[at as usize];
                (node.need, node.pixels, node.finer) = (node.own_need(), node.named_pixels, 0);
                (node.record, node.is_resident) = find(node.page, node.record);
            }
        }
        free.append(left);
        for &at in by_level.iter().flatten() {
            let node = &nodes[at as usize];
            let Node { parent, need, pixels, is_resident, .. } = *node;
            let shown = if is_resident { pixels } else { node.finer };
            histogram[usize::from(node.threshold())] += 1;
            // Each pixel that shows nothing as fine as this page shows something a level coarser at best.
            shortfall.levels += u64::from(pixels.saturating_sub(shown));
            shortfall.pixels += if is_resident { 0 } else { u64::from(node.named_pixels) };
            if let Some(above) = nodes.get_mut(parent as usize) {
                above.need = above.need.min(need);
                above.pixels = above.pixels.saturating_add(pixels);
                above.finer = above.finer.saturating_add(shown);
            }
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
        let nodes = self.by_level.iter().rev().flatten().map(|&at| &self.nodes[at as usize]);
        nodes.filter(move |node| node.threshold() > bias).map(|node| (node.page, node))
    }

    /// The level of the nearest ancestor whose tile is in a slot.
    pub(crate) fn shown_above(&self, node: &Node, textures: &Textures) -> u8 {
        let above = |node: &Node| self.nodes.get(node.parent as usize);
        let shown = std::iter::successors(above(node), |node| above(node)).find(|node| node.is_resident);
        let tail = || textures.geometry(node.page.texture()).map(|geometry| geometry.tail().first_level());
        shown.map(|node| node.page.level()).or_else(tail).unwrap_or(u8::MAX)
    }

    /// The pages that feedback named, with their pixels over the cycle.
    pub(crate) fn direct_pages(&self) -> impl Iterator<Item = (PageId, u32)> + '_ {
        let named = self.nodes.iter().filter(|node| node.named > 0);
        named.map(|node| (node.page, node.named_pixels))
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
mod tests;
