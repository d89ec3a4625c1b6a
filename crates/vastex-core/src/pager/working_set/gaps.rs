//! The gaps of a view that rests: what some of its pixels need and the cycle has not named, since feedback
//! looks at a quarter of all pixels.
//!
//! Once a jitter cycle was seen at rest and all is there that it has named, feedback looks for gaps: in a few
//! passes every pixel of the picture names something that is not there for it. That is held until the view
//! moves, or something else of it is to be seen. There are no gaps where all pixels were looked at since
//! something last came, and nobody has named any.
//!
//! A ray may name what can never be had in the place of what lies behind it. So while something of the view
//! has failed, in whatever pool, all pixels are looked at as often as it takes until each has named whatever
//! its ray lacks.
//!
//! Nobody names what is there, so that no view is known to need it, and it may make room for what others
//! need, or for what was prefetched; or the mip bias falls, and what is shown is not enough any more. While
//! the views of a pool rest all pixels of each of them are looked at again after that. In that time the set
//! only grows and the bias only rises (`pager/rest`), so that only so many tiles come, and what the
//! application asks for comes once each time that it does. So one is the last that makes room, and views
//! converge after it. Where a view moves there may be no last one: the others are looked at again once it
//! rests, or nothing was heard of any view for many frames.

use crate::pager::working_set::{Named, Node, WorkingSet};
use crate::shader_constants::STEPS_PER_LEVEL;
use crate::texture::page::PageId;
use crate::texture::textures::Textures;
use crate::wanted::feedback::{Feedback, WantedPage};
use crate::wanted::view::{MAX_VIEWS, ViewId};

/// Of as many bricks that a ray lacks it names one, where nothing of the view has failed.
const LEAST_NAMED: u32 = 4;
/// As many at most.
const MOST_NAMED: u32 = 64;

/// Of how many pages that a ray of a view lacks it is to name one, by turns, where so many pages of the view
/// could not be had: two kinds of pages may take turns.
pub(crate) fn named_by_turns(failed: u32) -> u32 {
    failed.saturating_add(1).saturating_mul(2).clamp(LEAST_NAMED, MOST_NAMED)
}

/// How often every pixel is looked at before there are no gaps.
fn gap_rounds(failed: u32) -> u32 {
    if failed == 0 { 1 } else { named_by_turns(failed) }
}

/// The views that hold a page as a gap, and how sharply each is known to need it.
///
/// Each view has 4 bits: 0 where it does not hold it, else one more than the eighths.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HeldBy(u32);

const HELD_BITS: usize = 4;
const _: () = assert!(MAX_VIEWS * HELD_BITS <= 32 && STEPS_PER_LEVEL < 1 << HELD_BITS);

impl HeldBy {
    /// How sharply the view needs it; `None` where it does not hold it.
    fn eighth(self, view_index: usize) -> Option<u8> {
        (self.0 >> (view_index * HELD_BITS) & 0xf).checked_sub(1).map(|eighth| eighth as u8)
    }

    fn set(&mut self, view_index: usize, eighth: Option<u8>) {
        let at = view_index * HELD_BITS;
        self.0 = self.0 & !(0xf << at) | eighth.map_or(0, |eighth| u32::from(eighth) + 1) << at;
    }
}

/// What is known of the gaps of a view.
#[derive(Debug, Default)]
pub(super) struct Gaps {
    /// Feedbacks in which all pixels are looked at; 0 where gaps are not looked for.
    passes: u32,
    /// The frame after which the view rests, and feedbacks of the cycle that were drawn since.
    since: u64,
    seen: u32,
    /// What was wanted before is let go of.
    is_rest_known: bool,
    /// How often the view was said to rest or not to, or to look at something else.
    changes: u64,
    /// Whether what the cycle named was there once: from then on feedback looks for gaps.
    is_looked_for: bool,
    /// Feedbacks in a row that found none.
    clean: u32,
    /// Pages of the view that could not be had.
    failed: u32,
    /// As many in all pools together: a ray passes over those of each.
    failed_in_all: u32,
    /// The last frame in which something of the view was missing, or that [`WorkingSet::look_again`] knows
    /// of: what was drawn by then says nothing of what is there now.
    changed: u64,
    /// What was found, each page once. How sharply it is needed by now its node says.
    pub(super) held: Vec<Named>,
}

impl Gaps {
    /// Returns true if there are none; nothing is said where they are not looked for.
    pub(super) fn are_none(&self) -> Option<bool> {
        let passes = self.passes.saturating_mul(gap_rounds(self.failed_in_all));
        (self.passes > 0).then_some(self.is_looked_for && self.clean >= passes)
    }

    /// Returns true if gaps are to be looked for, now or later.
    pub(super) fn are_of_interest(&self) -> bool {
        self.passes > 0
    }

    /// Nothing of the view is known any more: what it wants is waited for once more.
    pub(super) fn look_later(&mut self) {
        (self.is_looked_for, self.is_rest_known, self.clean, self.seen) = (false, false, 0, 0);
    }

    /// Returns true if what the view wanted before it rests is let go of.
    pub(super) fn is_rest_known(&self) -> bool {
        self.is_rest_known
    }

    /// How often the view was said to rest or not to, or to look at something else.
    pub(super) fn changes(&self) -> u64 {
        self.changes
    }

    /// The view is said to look at something else, or to rest or not to.
    pub(super) fn note_change(&mut self) {
        self.changes += 1;
    }

    /// A feedback of the cycle was drawn in a frame.
    pub(super) fn note_cycle(&mut self, frame: u64) {
        self.seen = self.seen.saturating_add(u32::from(frame > self.since));
    }

    pub(super) fn end_round(&mut self, settled: bool, frame: u64) {
        if !settled {
            (self.clean, self.changed) = (0, frame);
        }
    }

    /// Returns true if gaps are looked for, and what is counted are looks from before the frame was over.
    fn are_older_than(&self, frame: u64) -> bool {
        self.passes > 0 && self.changed < frame
    }

    /// So many pages of the view could not be had, in all pools together. Where they were others before, rays
    /// have passed over others by the frame, and take other turns from then on.
    fn set_failed_in_all(&mut self, failed: u32, frame: u64) {
        if std::mem::replace(&mut self.failed_in_all, failed) != failed {
            (self.clean, self.changed) = (0, frame);
        }
    }

    fn note(&mut self, frame: u64, is_clean: bool) {
        self.clean = match (is_clean, frame > self.changed) {
            (false, _) => 0,
            (true, true) => self.clean.saturating_add(1),
            (true, false) => self.clean,
        };
    }
}

impl Node {
    /// A view that holds it as a gap needs it more sharply than before.
    fn sharpen(&mut self, before: u8, eighth: u8) {
        let [before, now] = [before, eighth].map(usize::from);
        self.feedbacks[before] = self.feedbacks[before].saturating_sub(1);
        self.feedbacks[now] = self.feedbacks[now].saturating_add(1);
    }
}

impl WorkingSet {
    /// Takes in a feedback of gaps.
    pub(super) fn observe_gaps(&mut self, view_index: usize, feedback: &Feedback, textures: &Textures) {
        let Some(window) = &mut self.windows[view_index] else { return };
        let weight = window.weight;
        window.begin_gaps();
        let mut is_clean = true;
        // What was drawn before the view came to rest where it is now says nothing of what it wants.
        if window.gaps.passes == 0 || feedback.frame <= window.gaps.since {
            return;
        }
        for &named in &feedback.pages {
            let WantedPage { page, pixels, eighth } = named.present(textures);
            if !textures.contains(page) || textures.is_tail(page) {
                continue;
            }
            let at = self.add(page, textures);
            let node = &mut self.nodes[at as usize];
            let (pixels, eighth) = (weight.of(pixels), eighth & 7);
            let held = node.held.eighth(view_index);
            if held.is_some_and(|held| held <= eighth) {
                continue;
            }
            is_clean = false;
            node.held.set(view_index, Some(eighth));
            if let Some(before) = held {
                // At a mip bias a coarser page was to be had for it, and now it may be one that is not there.
                node.sharpen(before, eighth);
                continue;
            }
            node.named_in(view_index, pixels, eighth);
            if let Some(window) = &mut self.windows[view_index] {
                let named = window.named(at, pixels, eighth);
                window.gaps.held.push(named);
            }
        }
        if let Some(window) = &mut self.windows[view_index] {
            window.gaps.note(feedback.frame, is_clean);
        }
    }

    /// The views that rest, each with its place among all views.
    pub(crate) fn views_with_gaps(&self) -> impl Iterator<Item = (usize, ViewId)> {
        let windows = self.windows.iter().enumerate();
        let windows = windows.filter_map(|(index, window)| Some((index, window.as_ref()?)));
        windows.filter(|(_, window)| window.gaps.passes > 0).map(|(index, window)| (index, window.view))
    }

    /// Lets go of what a view was found to lack.
    pub(super) fn let_gaps_go(&mut self, view_index: usize) {
        let Some(window) = &mut self.windows[view_index] else { return };
        window.gaps.look_later();
        for mut named in std::mem::take(&mut window.gaps.held) {
            let held = &mut self.nodes[named.node as usize].held;
            named.eighth = held.eighth(view_index).unwrap_or(named.eighth);
            held.set(view_index, None);
            self.unname(view_index, named);
        }
    }

    /// A view rests after a frame, and so many feedbacks look at all of its pixels for gaps; 0: it does not.
    pub(crate) fn set_gap_passes(&mut self, view: ViewId, passes: u32, frame: u64) {
        let Some(view_index) = self.index_of(view) else { return };
        let Some(window) = &mut self.windows[view_index] else { return };
        window.gaps.since = frame;
        if std::mem::replace(&mut window.gaps.passes, passes) != passes {
            window.gaps.note_change();
            self.let_gaps_go(view_index);
        }
    }

    /// Returns true if a view has been seen for a whole jitter cycle since it rests; what it wanted before is
    /// then let go of. Gaps name what takes more jitter cycles.
    pub(crate) fn is_seen_at_rest(&mut self, view: ViewId) -> bool {
        let Some(view_index) = self.index_of(view) else { return false };
        let Some(window) = &mut self.windows[view_index] else { return false };
        let seen = window.gaps.seen as usize;
        if !window.is_known() || seen < window.jitter_cycle() as usize {
            return false;
        }
        while let Some(named) = self.windows[view_index].as_mut().and_then(|window| window.next_before(seen))
        {
            self.unname(view_index, named);
        }
        if let Some(window) = &mut self.windows[view_index] {
            window.gaps.is_rest_known = true;
        }
        true
    }

    /// Takes note of how many pages of each view that rests could not be had. Costs a visit of each page of
    /// the set for each of these views, or nothing where `any_has` says that none has failed.
    pub(crate) fn note_failed(&mut self, any_has: bool, has_failed: impl Fn(PageId) -> bool) {
        let WorkingSet { windows, by_level, nodes, .. } = self;
        // At a mip bias a page above is what was asked for.
        let lacks = |node: &Node| {
            let above = |node: &Node| nodes.get(node.parent as usize);
            let mut shown = std::iter::successors(Some(node), |node| above(node));
            shown.find(|node| node.is_resident || has_failed(node.page)).is_some_and(|node| !node.is_resident)
        };
        for (view_index, window) in windows.iter_mut().enumerate() {
            let Some(window) = window.as_mut().filter(|window| window.gaps.passes > 0) else { continue };
            let named = by_level.iter().flatten().map(|&at| &nodes[at as usize]);
            let of_view = named.filter(|node| node.views >> view_index & 1 == 1);
            window.gaps.failed = if any_has { of_view.filter(|node| lacks(node)).count() as u32 } else { 0 };
        }
    }

    /// Pages of a view that could not be had, as far as its gaps are looked for.
    pub(crate) fn failed_of(&self, view: ViewId) -> u32 {
        self.windows().find(|window| window.view == view).map_or(0, |window| window.gaps.failed)
    }

    /// So many pages of a view could not be had in all pools together, as of a frame.
    pub(crate) fn set_failed_in_all(&mut self, view: ViewId, failed: u32, frame: u64) {
        if let Some(window) = self.window_mut(view) {
            window.gaps.set_failed_in_all(failed, frame);
        }
    }

    /// Returns true if the feedback of a view looks for gaps by now; `None` where it does not rest.
    pub(crate) fn looks_for_gaps(&self, view: ViewId) -> Option<bool> {
        let window = self.windows().find(|window| window.view == view)?;
        (window.gaps.passes > 0).then_some(window.gaps.is_looked_for)
    }

    /// All that the view wants is there: from now on its feedback looks for gaps.
    pub(crate) fn look_for_gaps(&mut self, view: ViewId) {
        if let Some(window) = self.window_mut(view) {
            (window.gaps.is_looked_for, window.gaps.clean) = (true, 0);
        }
    }

    /// Returns true if a view has no gaps, or they are not looked for. `last_change` is what
    /// [`WorkingSet::look_again`] is to be told.
    pub(crate) fn has_no_gaps(&self, view: ViewId, last_change: u64) -> bool {
        let window = self.windows().find(|window| window.view == view);
        let is_outdated = |gaps: &Gaps| gaps.are_older_than(last_change) && self.rest_number().is_some();
        window.is_none_or(|w| w.gaps.are_none().unwrap_or(true) && !is_outdated(&w.gaps))
    }

    /// Returns true if all pixels of a view that is drawn are to be looked at again.
    pub(crate) fn is_outdated(&self, last_change: u64) -> bool {
        let mut drawn = self.windows().filter(|window| window.is_drawn());
        drawn.any(|window| window.gaps.are_older_than(last_change)) && self.rest_number().is_some()
    }

    /// Since this frame, and none later, pixels may lack what was enough for them before: while all views
    /// rest, all pixels of each are looked at again.
    pub(crate) fn look_again(&mut self, last_change: u64) {
        if self.rest_number().is_some() {
            let all = self.windows.iter_mut().flatten().map(|window| &mut window.gaps);
            let outdated = all.filter(|gaps| gaps.are_older_than(last_change));
            outdated.for_each(|gaps| (gaps.clean, gaps.changed) = (0, last_change));
        }
    }
}
