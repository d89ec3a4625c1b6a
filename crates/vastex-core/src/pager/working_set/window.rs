//! What one view wanted over its last jitter cycle: its window of the working set.
//!
//! A view that is not drawn for a while keeps its window, and one that jumps leaves those of the others as
//! they are. What the windows come to is `working_set`'s.

use std::collections::VecDeque;

use crate::pager::working_set::gaps::Gaps;
use crate::pager::working_set::{Named, Node, WorkingSet};
use crate::shader_constants::{JITTER_CYCLE, RAY_TURNS};
use crate::texture::page::PageId;
use crate::texture::textures::Textures;
use crate::wanted::feedback::Feedback;
use crate::wanted::view::{MAX_VIEWS, ViewError, ViewId, Weight};

/// Frames in which nothing was heard of any view, after which none that moves is drawn.
const IDLE_AFTER: u32 = 128;

/// What one view wanted over its last jitter cycle.
#[derive(Debug)]
pub(super) struct Window {
    pub(super) view: ViewId,
    pub(super) weight: Weight,
    /// What the feedbacks of the cycle named, the oldest first.
    pub(super) cycle: VecDeque<Named>,
    /// Pixels of each feedback of the cycle, those that want tails among them.
    pub(super) pixels: VecDeque<u64>,
    /// Feedbacks ever.
    observed: u64,
    /// The frame from which feedback shows something else than before.
    cut: Option<u64>,
    /// Feedbacks in a row after which nothing was newly wanted and nothing missing.
    quiet: u32,
    /// Rounds since the view was last drawn.
    undrawn: u32,
    /// Feedbacks of a cycle.
    length: u32,
    /// Feedbacks of a cycle without the turns of the view's own.
    jitter_cycle: u32,
    /// Jitter cycles until the view has said all that it wants.
    turns: u32,
    /// What is known of the gaps of a view that rests.
    pub(super) gaps: Gaps,
}

impl Window {
    pub(super) fn new(view: ViewId, weight: Weight, length: u32) -> Window {
        let (cycle, pixels) = (VecDeque::new(), VecDeque::new());
        let gaps = Gaps::default();
        let (observed, cut, quiet, undrawn, turns) = (0, None, 0, 0, 1);
        let jitter_cycle = length;
        Window {
            view,
            weight,
            cycle,
            pixels,
            observed,
            cut,
            quiet,
            undrawn,
            length,
            jitter_cycle,
            turns,
            gaps,
        }
    }

    /// Feedbacks now in the window, at most the view's jitter cycles of them.
    pub(super) fn feedbacks(&self) -> usize {
        self.pixels.len()
    }

    pub(super) fn is_whole(&self) -> bool {
        self.feedbacks() >= self.length as usize
    }

    fn set_length(&mut self, length: u32) {
        if std::mem::replace(&mut self.length, length) != length {
            self.gaps.look_later();
        }
    }

    /// Feedbacks of a cycle without the turns of the view's own.
    pub(super) fn jitter_cycle(&self) -> u32 {
        self.jitter_cycle
    }

    pub(super) fn cut_from(&mut self, frame: u64) {
        self.cut = Some(frame);
        self.gaps.note_change();
    }

    /// Returns true if a cut was declared that the feedback of this frame is the first to show.
    pub(super) fn take_cut(&mut self, frame: u64) -> bool {
        self.cut.take_if(|cut| *cut <= frame).is_some()
    }

    /// Returns true if the view has been seen for a whole cycle, without its turns where its gaps are looked
    /// for, and no cut was declared that is yet to show.
    pub(super) fn is_known(&self) -> bool {
        let enough = if self.gaps.are_of_interest() { self.jitter_cycle } else { self.length };
        self.feedbacks() >= enough as usize && self.cut.is_none()
    }

    /// A feedback of so many pixels begins.
    pub(super) fn begin(&mut self, pixels: u64) {
        self.observed += 1;
        self.undrawn = 0;
        self.pixels.push_back(pixels);
    }

    /// A feedback of gaps: of what else the view wants nothing becomes older.
    pub(super) fn begin_gaps(&mut self) {
        self.undrawn = 0;
    }

    /// The view is not drawn until there is feedback of it.
    fn hide(&mut self) {
        self.undrawn = u32::MAX;
    }

    /// The feedback names a page.
    pub(super) fn name(&mut self, node: u32, pixels: u32, eighth: u8) {
        self.cycle.push_back(self.named(node, pixels, eighth));
    }

    pub(super) fn named(&self, node: u32, pixels: u32, eighth: u8) -> Named {
        Named { feedback: self.observed, node, pixels, eighth }
    }

    /// An entry of the feedback that has become too old; to be called until there is none.
    pub(super) fn next_too_old(&mut self) -> Option<Named> {
        self.next_before(self.length as usize)
    }

    /// An entry that is older than the newest feedbacks, so many; to be called until there is none.
    pub(super) fn next_before(&mut self, feedbacks: usize) -> Option<Named> {
        while self.feedbacks() > feedbacks {
            let oldest = self.observed + 1 - self.feedbacks() as u64;
            if let Some(named) = self.cycle.pop_front_if(|named| named.feedback <= oldest) {
                return Some(named);
            }
            self.pixels.pop_front();
        }
        None
    }

    /// The round of a frame is over: nothing was newly wanted in it and nothing missing, or something was.
    /// `settled`: all that the view wants is there.
    pub(super) fn end_round(&mut self, quiet: bool, settled: bool, frame: u64) {
        let drawn = u32::from(self.undrawn == 0);
        self.gaps.end_round(settled, frame);
        self.quiet = if quiet { self.quiet.saturating_add(drawn) } else { 0 };
        self.undrawn = self.undrawn.saturating_add(1);
    }

    /// Returns true if the view is being drawn: neither before its first feedback nor for a jitter cycle of
    /// rounds without one.
    pub(super) fn is_drawn(&self) -> bool {
        self.feedbacks() > 0 && self.undrawn <= self.length
    }

    /// Returns true if the view was drawn within a jitter cycle of rounds.
    pub(super) fn is_drawn_lately(&self) -> bool {
        self.feedbacks() > 0 && self.undrawn <= self.jitter_cycle
    }

    /// Returns true if a whole cycle of the view was quiet; where its gaps are looked for, all pixels after
    /// it.
    pub(super) fn is_quiet(&self) -> bool {
        let is_quiet = || self.is_whole() && self.quiet >= self.length;
        self.gaps.are_none().map_or_else(is_quiet, |are_none| are_none && self.is_known())
    }
}

impl WorkingSet {
    /// The pages that a view wanted in its last cycle, with their ancestors, at a bias in eighths of a level;
    /// `None` where it has not been seen for a whole cycle since it jumped.
    pub(crate) fn pages_of(&self, view: ViewId, bias: u16) -> Option<impl Iterator<Item = PageId> + '_> {
        let index = self.index_of(view)?;
        self.windows[index].as_ref().filter(|window| window.is_known())?;
        let is_of_view = move |(_, node): &(PageId, &Node)| node.views_below & (1 << index) != 0;
        Some(self.pages_at(bias).filter(is_of_view).map(|(page, _)| page))
    }

    /// Makes a window for a view.
    pub(crate) fn add_view(&mut self, view: ViewId, weight: Weight) -> Result<(), ViewError> {
        if self.index_of(view).is_some() {
            return Err(ViewError::NumberTaken(view.number()));
        }
        let free = self.windows.iter().position(Option::is_none).unwrap_or(self.windows.len());
        if free >= MAX_VIEWS {
            return Err(ViewError::TooMany);
        }
        self.windows.resize_with(self.windows.len().max(free + 1), || None);
        self.windows[free] = Some(Window::new(view, weight, self.cycle));
        Ok(())
    }

    /// Returns true if there was such a view; the set follows when it is worked out again.
    pub(crate) fn remove_view(&mut self, view: ViewId) -> bool {
        let Some(view_index) = self.index_of(view) else { return false };
        self.restart(view);
        self.windows[view_index] = None;
        true
    }

    pub(crate) fn set_weight(&mut self, view: ViewId, weight: Weight) -> bool {
        let window = self.window_mut(view);
        window.map(|window| window.weight = weight).is_some()
    }

    /// Feedback of the view from this frame on shows something else.
    pub(crate) fn view_cut(&mut self, view: ViewId, frame: u64) {
        if let Some(window) = self.window_mut(view) {
            window.cut_from(frame);
        }
    }

    /// A frame begins. Rounds need a view that is drawn, and where all others rest there may be none: so
    /// views that were said to move are hidden after many frames in which nothing was heard of any.
    pub(crate) fn begin_frame(&mut self) {
        self.unheard = self.unheard.saturating_add(1);
        if self.unheard > IDLE_AFTER {
            let windows = self.windows.iter_mut().flatten();
            windows.filter(|window| !window.gaps.are_of_interest()).for_each(Window::hide);
        }
    }

    /// Sets how many textures take turns in a feedback pixel at most: so many jitter cycles it takes until
    /// each has been answered for at every sample position, and so long a feedback counts.
    pub(crate) fn set_turns(&mut self, turns: u32) {
        self.cycle = WorkingSet::cycle_of(turns);
        let cycle = self.cycle;
        for window in self.windows.iter_mut().flatten() {
            window.jitter_cycle = cycle;
            window.set_length(cycle.max(WorkingSet::cycle_of(window.turns)));
        }
    }

    /// The same for a view, of which it says more than is said of all.
    pub(crate) fn set_view_turns(&mut self, view: ViewId, turns: u32) {
        let cycle = self.cycle;
        if let Some(window) = self.window_mut(view) {
            window.turns = turns;
            window.set_length(cycle.max(WorkingSet::cycle_of(turns)));
        }
    }

    /// Feedbacks after which a view has been seen whole where so many textures take turns.
    pub(crate) fn cycle_of(turns: u32) -> u32 {
        JITTER_CYCLE * turns.clamp(1, RAY_TURNS)
    }

    /// Feedbacks of a view after which it has been seen whole.
    pub(crate) fn cycle(&self) -> u32 {
        self.cycle
    }

    /// Returns true if the feedback is the first after a cut of its view: one that was declared, or a jump.
    pub(crate) fn is_cut(&mut self, feedback: &Feedback, textures: &Textures) -> bool {
        let window = self.window_mut(feedback.view);
        let is_cut = window.is_some_and(|window| window.take_cut(feedback.frame));
        // Gaps are not what the view wants: however few of them are near to that, it has not jumped.
        is_cut || !feedback.gaps && self.is_jump(feedback, textures)
    }

    /// Forgets what a view wanted: it has jumped.
    pub(crate) fn restart(&mut self, view: ViewId) {
        let Some(view_index) = self.index_of(view) else { return };
        while let Some(named) = self.windows[view_index].as_mut().and_then(|window| window.cycle.pop_front())
        {
            self.unname(view_index, named);
        }
        self.let_gaps_go(view_index);
        if let Some(window) = &mut self.windows[view_index] {
            window.pixels.clear();
        }
    }

    pub(super) fn windows(&self) -> impl Iterator<Item = &Window> {
        self.windows.iter().flatten()
    }

    pub(super) fn index_of(&self, view: ViewId) -> Option<usize> {
        self.windows.iter().position(|window| window.as_ref().is_some_and(|window| window.view == view))
    }

    pub(super) fn window_mut(&mut self, view: ViewId) -> Option<&mut Window> {
        self.windows.iter_mut().flatten().find(|window| window.view == view)
    }

    /// Returns true if under a quarter of the feedback's pixels fall on pages of its view's window, their
    /// ancestors or descendants.
    ///
    /// Only a window of a whole jitter cycle can tell: where pages are smaller than the blocks of pixels that
    /// feedback stands for, the frames of a cycle see different pages of one view.
    pub(crate) fn is_jump(&self, feedback: &Feedback, textures: &Textures) -> bool {
        let Some((view_index, window)) = self
            .index_of(feedback.view)
            .and_then(|view_index| Some((view_index, self.windows[view_index].as_ref()?)))
        else {
            return false;
        };
        if window.cycle.is_empty() || !window.is_whole() {
            return false;
        }
        let node = |page: PageId| self.index.get(page).map(|&at| &self.nodes[at as usize]);
        let is_named = |page: PageId| node(page).is_some_and(|node| node.views >> view_index & 1 == 1);
        // Mostly a quarter of the pixels is soon found to be near, whatever the rest is.
        let mut all: u64 = feedback.pages.iter().map(|wanted| u64::from(wanted.pixels)).sum();
        let mut related = 0;
        for wanted in &feedback.pages {
            let is_known = node(wanted.page).is_some_and(|node| node.views_below >> view_index & 1 == 1);
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

    /// Takes note of whether nothing was newly wanted and nothing missing after the feedbacks taken in since
    /// the last time, in the round of a frame; returns true if that was so for a whole jitter cycle of every
    /// view that is being drawn, and for all pixels where gaps are looked for.
    /// `settled` has a bit for each view whose gaps are looked for: whether all that it wants is there.
    pub(crate) fn end_round(&mut self, quiet: bool, settled: u64, frame: u64) -> bool {
        for (index, window) in self.windows.iter_mut().enumerate() {
            if let Some(window) = window {
                window.end_round(quiet, settled >> index & 1 == 1, frame);
            }
        }
        let mut drawn = self.windows().filter(|window| window.is_drawn()).peekable();
        quiet && drawn.peek().is_some() && drawn.all(Window::is_quiet)
    }
}
