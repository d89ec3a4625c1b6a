//! The working set: the distinct pages that views want over one jitter cycle of each, with their ancestors.
//!
//! Each view has a window of its own (`window`), and what any of them wants is in the set; how sharply, the
//! sharpest need of any says. Pixels are counted by the weight of their view.
//!
//! Feedback is unbiased and says how sharply each page is needed, so the size of the set is known at every
//! mip bias at once: a page of level `l`, of whose pixels the sharpest needs `n` eighths, is wanted at every
//! bias below `8 * (l + 1) - n`, and at none above. That number is the page's *threshold*; a histogram of
//! thresholds answers "what is the smallest bias whose set fits?" without trying any.
//!
//! Tails are not counted here: they are pinned. Which bias is taken, and when it falls again, is `bias`'s
//! business; what is loaded first, that of `ranking` and `load_order`.

use crate::residency::page_map::PageMap;
use crate::residency::records::RecordHint;
use crate::residency::sharing::ContentId;
use crate::shader_constants::{JITTER_CYCLE, MAX_LEVELS, STEPS_PER_LEVEL};
use crate::texture::page::{PageId, TextureNumber};
use crate::texture::textures::Textures;
use crate::wanted::feedback::{Feedback, Need, WantedPage, merge_same};
use crate::wanted::view::{MAX_VIEWS, ViewId, Weight};

use gaps::HeldBy;
pub(super) use gaps::named_by_turns;
pub(super) use rest::RestNumber;
use window::Window;

mod gaps;
mod rest;
mod window;

/// Thresholds are at most 8 times the number of levels.
const THRESHOLDS: usize = (MAX_LEVELS * STEPS_PER_LEVEL) as usize + 1;
/// Instead of a node's index: there is none.
const NOWHERE: u32 = u32::MAX;

/// A page of the working set: one that a feedback of the last jitter cycle of any view named, or an ancestor
/// of one.
///
/// Nodes stay from frame to frame and know their parents, so that working out the set takes no look-up.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    page: PageId,
    /// The index of its parent's node; [`NOWHERE`] just below a tail.
    parent: u32,
    /// Nodes whose parent it is.
    children: u32,
    /// Feedbacks of the cycles that named the page.
    named: u32,
    /// Feedback pixels of theirs.
    named_pixels: u32,
    /// Feedbacks that named the page, for each window.
    named_by: [u8; MAX_VIEWS],
    /// A bit for each window with `named_by` above 0.
    views: u8,
    /// A bit for each window that named the page or one below it.
    views_below: u8,
    /// The windows that hold it as a gap of their view, and how sharply.
    held: HeldBy,
    /// Feedbacks of the cycles in which the sharpest need was so many eighths.
    feedbacks: [u16; STEPS_PER_LEVEL as usize],
    /// True if the page is wanted at every bias, whatever feedback says.
    is_pinned: bool,
    /// The page was given up while its views rest, and is wanted at no bias.
    is_given_up: bool,
    /// The sharpest need of the page and all that lies below it.
    need: Need,
    /// Feedback pixels of the page and all that lies below it, over the cycles.
    pub(in crate::pager) pixels: u32,
    /// Feedback pixels, among `pixels`, that already show something finer than the page.
    pub(in crate::pager) finer: u32,
    /// True if its tile is in a slot.
    pub(in crate::pager) is_resident: bool,
    /// Where its record was when the set was worked out.
    pub(in crate::pager) record: RecordHint,
    /// What it has in common with other pages, as of then.
    pub(in crate::pager) content: ContentId,
    /// The content has to be asked for.
    is_new: bool,
}

impl Node {
    fn new(page: PageId, parent: u32) -> Node {
        Node {
            page,
            parent,
            children: 0,
            named: 0,
            named_pixels: 0,
            named_by: [0; MAX_VIEWS],
            views: 0,
            views_below: 0,
            held: HeldBy::default(),
            feedbacks: [0; STEPS_PER_LEVEL as usize],
            is_pinned: false,
            is_given_up: false,
            need: Need::LEAST,
            pixels: 0,
            finer: 0,
            is_resident: false,
            record: RecordHint::default(),
            content: ContentId::NONE,
            is_new: true,
        }
    }

    /// A feedback of the window at `view_index` names it.
    fn named_in(&mut self, view_index: usize, pixels: u32, eighth: u8) {
        self.named += 1;
        self.named_pixels = self.named_pixels.saturating_add(pixels);
        self.named_by[view_index] = self.named_by[view_index].saturating_add(1);
        self.views |= 1 << view_index;
        let count = &mut self.feedbacks[usize::from(eighth)];
        *count = count.saturating_add(1);
    }

    fn is_in_set(&self) -> bool {
        self.named > 0 || self.children > 0 || self.is_pinned
    }

    fn own_need(&self) -> Need {
        // The first that is not 0.
        let eighth = self.feedbacks.iter().take_while(|count| **count == 0).count() as u32 % STEPS_PER_LEVEL;
        if self.named > 0 { Need::new(self.page.level(), eighth as u8) } else { Need::LEAST }
    }

    fn threshold(&self) -> u16 {
        if self.is_pinned {
            return THRESHOLDS as u16 - 1;
        }
        if self.is_given_up {
            return 0;
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
    /// By the view's weight then.
    pixels: u32,
    eighth: u8,
}

/// The distinct pages that views want over one jitter cycle of each, with their ancestors.
#[derive(Debug)]
pub(crate) struct WorkingSet {
    /// One for each view; `None` if the view was removed.
    windows: Vec<Option<Window>>,
    /// Feedbacks of a view after which it has been seen whole, and frames begun since the last of any view.
    cycle: u32,
    unheard: u32,
    nodes: Vec<Node>,
    index: PageMap<u32>,
    /// The nodes of each level, and of those that have left the set since it was worked out.
    by_level: Vec<Vec<u32>>,
    left: Vec<u32>,
    /// Places in `nodes` that nobody knows any more.
    free: Vec<u32>,
    /// Pages that are wanted at every bias.
    pins: Vec<PageId>,
    /// How many tiles have each threshold: of pages of the same content the highest counts.
    histogram: Vec<u32>,
    /// Times that the set was worked out, and of each content when that was last and the highest threshold
    /// then.
    worked_out: u64,
    contents: Vec<(u64, u16)>,
    shortfall: Shortfall,
    /// A feedback of sparse textures, kept for its memory.
    standing: Vec<WantedPage>,
    /// Of each texture whose tail was named, the newest feedback that did: its frame.
    tails: Vec<(TextureNumber, u64)>,
}

/// How much coarser than at mip bias 0 the picture is, by the pixels of the cycles.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shortfall {
    /// Feedback pixels whose wanted page is not resident, and by how many levels what is resident is coarser
    /// than what they want, summed over them.
    pub(in crate::pager) pixels: u64,
    pub(in crate::pager) levels: u64,
}

impl WorkingSet {
    pub(crate) fn new() -> WorkingSet {
        WorkingSet {
            windows: vec![Some(Window::new(ViewId::MAIN, Weight::ONE, JITTER_CYCLE))],
            cycle: JITTER_CYCLE,
            nodes: Vec::new(),
            index: PageMap::default(),
            by_level: vec![Vec::new(); MAX_LEVELS as usize],
            left: Vec::new(),
            free: Vec::new(),
            pins: Vec::new(),
            histogram: vec![0; THRESHOLDS],
            worked_out: 0,
            contents: Vec::new(),
            shortfall: Shortfall::default(),
            standing: Vec::new(),
            unheard: 0,
            tails: Vec::new(),
        }
    }

    /// From the next time that the set is worked out on these pages are wanted at every bias; with a page its
    /// ancestors are given, but no tails.
    pub(crate) fn set_pins(&mut self, pages: Vec<PageId>, textures: &Textures) {
        for page in std::mem::take(&mut self.pins) {
            if let Some(&at) = self.index.get(page) {
                self.nodes[at as usize].is_pinned = false;
                self.leave(at);
            }
        }
        self.pins = pages;
        self.pin(textures);
    }

    /// The pages that are pinned.
    pub(crate) fn pins(&self) -> &[PageId] {
        &self.pins
    }

    fn pin(&mut self, textures: &Textures) {
        for index in 0..self.pins.len() {
            let at = self.add(self.pins[index], textures);
            self.nodes[at as usize].is_pinned = true;
        }
    }

    /// Forgets what was wanted of a texture; the set follows when it is worked out again.
    pub(crate) fn forget(&mut self, texture: TextureNumber) {
        let WorkingSet { windows, nodes, index, left, pins, tails, .. } = self;
        tails.retain(|(of, _)| *of != texture);
        pins.retain(|page| page.texture() != texture);
        for window in windows.iter_mut().flatten() {
            let stays = |named: &Named| nodes[named.node as usize].page.texture() != texture;
            window.cycle.retain(stays);
            window.gaps.held.retain(stays);
        }
        index.retain(|page, &node| {
            let is_other = page.texture() != texture;
            if !is_other {
                nodes[node as usize] = Node::new(page, NOWHERE);
                left.push(node);
            }
            is_other
        });
    }

    /// Takes in a feedback, and lets go of the one that is a jitter cycle of its view old. Pages that do not
    /// exist are dropped, as is all of a view that there is not.
    pub(crate) fn observe(&mut self, feedback: &Feedback, textures: &Textures) {
        let Some(view_index) = self.index_of(feedback.view) else { return };
        let Some(window) = &mut self.windows[view_index] else { return };
        let weight = window.weight;
        self.unheard = 0;
        if feedback.gaps {
            return self.observe_gaps(view_index, feedback, textures);
        }
        window.gaps.note_cycle(feedback.frame);
        window.begin(feedback.pages.iter().map(|wanted| u64::from(weight.of(wanted.pixels))).sum());
        if textures.are_sparse() {
            let mut standing = std::mem::take(&mut self.standing);
            standing.clear();
            let there = feedback.pages.iter().filter(|wanted| textures.contains(wanted.page));
            standing.extend(there.map(|wanted| wanted.present(textures)));
            merge_same(&mut standing);
            self.name((view_index, feedback.frame), weight, &standing, textures);
            self.standing = standing;
        } else {
            self.name((view_index, feedback.frame), weight, &feedback.pages, textures);
        }
        // Last, so that what both name keeps its nodes.
        while let Some(named) = self.windows[view_index].as_mut().and_then(Window::next_too_old) {
            self.unname(view_index, named);
        }
    }

    fn name(
        &mut self,
        (view_index, frame): (usize, u64),
        weight: Weight,
        pages: &[WantedPage],
        textures: &Textures,
    ) {
        for &WantedPage { page, pixels, eighth } in pages {
            let at = match self.index.get(page) {
                Some(&at) => at,
                None if textures.contains(page) && !textures.is_tail(page) => self.add(page, textures),
                None => {
                    if textures.is_tail(page) {
                        self.name_tail(page.texture(), frame);
                    }
                    continue;
                }
            };
            let (node, pixels, eighth) = (&mut self.nodes[at as usize], weight.of(pixels), eighth & 7);
            node.named_in(view_index, pixels, eighth);
            if let Some(window) = &mut self.windows[view_index] {
                window.name(at, pixels, eighth);
            }
        }
    }

    fn name_tail(&mut self, texture: TextureNumber, frame: u64) {
        match self.tails.iter_mut().find(|(of, _)| *of == texture) {
            Some((_, named)) => *named = frame.max(*named),
            None => self.tails.push((texture, frame)),
        }
    }

    /// The newest frame whose feedback named the tail of a texture, if any did.
    pub(crate) fn tail_named(&self, texture: TextureNumber) -> Option<u64> {
        self.tails.iter().find(|(of, _)| *of == texture).map(|(_, frame)| *frame)
    }

    /// An entry leaves the window at `view_index`.
    fn unname(&mut self, view_index: usize, named: Named) {
        let node = &mut self.nodes[named.node as usize];
        node.named -= 1;
        node.named_pixels = node.named_pixels.saturating_sub(named.pixels);
        node.named_by[view_index] = node.named_by[view_index].saturating_sub(1);
        if node.named_by[view_index] == 0 {
            node.views &= !(1 << view_index);
        }
        let count = &mut node.feedbacks[usize::from(named.eighth)];
        *count = count.saturating_sub(1);
        self.leave(named.node);
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

    /// Works out the set from the feedbacks: every page wanted and every ancestor, once. Costs one visit of
    /// each.
    ///
    /// `find` says where the record of a page is, and whether its tile is in a slot; it is told where the
    /// record was. `is_given_up` is asked for each page that is in no slot, `content_of` once for each that
    /// comes into the set.
    pub(crate) fn rebuild(
        &mut self,
        find: impl Fn(PageId, RecordHint) -> (RecordHint, bool),
        is_given_up: impl Fn(PageId) -> bool,
        content_of: impl Fn(PageId) -> ContentId,
    ) {
        self.histogram.fill(0);
        self.shortfall = Shortfall::default();
        self.worked_out += 1;
        let WorkingSet { nodes, by_level, left, free, histogram, shortfall, contents, worked_out, .. } = self;
        for level in by_level.iter_mut() {
            if !left.is_empty() {
                level.retain(|&at| nodes[at as usize].is_in_set());
            }
            for &at in level.iter() {
                let node = &mut nodes[at as usize];
                (node.need, node.pixels, node.finer) = (node.own_need(), node.named_pixels, 0);
                node.views_below = node.views;
                (node.record, node.is_resident) = find(node.page, node.record);
                node.is_given_up = !node.is_resident && !node.is_pinned && is_given_up(node.page);
                if std::mem::take(&mut node.is_new) {
                    node.content = content_of(node.page);
                }
            }
        }
        free.append(left);
        for &at in by_level.iter().flatten() {
            let node = &nodes[at as usize];
            let Node { parent, need, pixels, is_resident, views_below, .. } = *node;
            let shown = if is_resident { pixels } else { node.finer };
            histogram[usize::from(node.threshold())] += 1;
            if node.content.is_some() {
                count_once(histogram, contents, node.content, (*worked_out, node.threshold()));
            }
            // Each pixel that shows nothing as fine as this page shows something a level coarser at best.
            shortfall.levels += u64::from(pixels.saturating_sub(shown));
            shortfall.pixels += if is_resident { 0 } else { u64::from(node.named_pixels) };
            if let Some(above) = nodes.get_mut(parent as usize) {
                above.need = above.need.min(need);
                above.pixels = above.pixels.saturating_add(pixels);
                above.finer = above.finer.saturating_add(shown);
                above.views_below |= views_below;
            }
        }
    }

    /// Feedback pixels of the cycles, those that want tails among them.
    pub(crate) fn pixels(&self) -> u64 {
        self.windows().flat_map(|window| &window.pixels).sum()
    }

    /// How much coarser than wanted the picture was when the set was worked out.
    pub(crate) fn shortfall(&self) -> Shortfall {
        self.shortfall
    }

    /// The page has left those that it had its content in common with.
    pub(crate) fn forget_content(&mut self, page: PageId) {
        if let Some(&at) = self.index.get(page) {
            self.nodes[at as usize].is_new = true;
        }
    }

    /// Tiles of the set at a bias, in eighths of a level: pages of the same content have one. Tails are not
    /// counted.
    pub(crate) fn size_at(&self, bias: u16) -> u32 {
        self.histogram.iter().skip(usize::from(bias) + 1).sum()
    }

    /// The smallest bias, in eighths of a level, at which the set has at most `limit` tiles.
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

    /// The pages that feedback named, with their pixels over the cycles.
    pub(crate) fn direct_pages(&self) -> impl Iterator<Item = (PageId, u32)> + '_ {
        let named = self.nodes.iter().filter(|node| node.named > 0);
        named.map(|node| (node.page, node.named_pixels))
    }
}

/// A page of a content, which the histogram counts already, has this threshold; only the highest of the
/// content counts.
fn count_once(
    histogram: &mut [u32],
    contents: &mut Vec<(u64, u16)>,
    content: ContentId,
    now @ (worked_out, threshold): (u64, u16),
) {
    if contents.len() <= content.index() {
        contents.resize(content.index() + 1, (0, 0));
    }
    let known = &mut contents[content.index()];
    let (before, highest) = *known;
    if before != worked_out {
        *known = now;
    } else {
        histogram[usize::from(threshold.min(highest))] -= 1;
        known.1 = threshold.max(highest);
    }
}

#[cfg(test)]
mod tests;
