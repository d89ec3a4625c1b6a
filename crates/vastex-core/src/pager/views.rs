//! Which views there are in all pools, with their weights.
//!
//! Each gives feedback of its own, as often as it is drawn, and what any of them wants is wanted; how
//! sharply, the sharpest need of any says. A view's weight only says how much its pixels count when it is
//! decided what is loaded first. What each wants is kept for one jitter cycle of its own (`working_set`).

use crate::pager::Pager;
use crate::pager::pool::PoolPager;
use crate::pager::working_set::{WorkingSet, named_by_turns};
use crate::wanted::feedback::Feedback;
use crate::wanted::view::{MAX_VIEWS, ViewError, ViewId, Weight};

/// The views that every pager knows.
#[derive(Debug)]
pub(crate) struct Views {
    all: Vec<KnownView>,
    next: u32,
}

/// A view as every pager knows it.
#[derive(Clone, Copy, Debug)]
struct KnownView {
    view: ViewId,
    weight: f32,
    /// Jitter cycles until it has said all that it wants.
    turns: u32,
    /// Feedbacks in which all of its pixels are looked at for gaps; 0 where it does not rest.
    gap_passes: u32,
}

impl KnownView {
    fn new(view: ViewId, weight: f32) -> KnownView {
        KnownView { view, weight, turns: 1, gap_passes: 0 }
    }
}

impl Default for Views {
    fn default() -> Views {
        let main = KnownView::new(ViewId::MAIN, 1.0);
        Views { all: vec![main], next: ViewId::MAIN.number() + 1 }
    }
}

impl Views {
    /// Makes the views known to a new pool, which knows the main view.
    pub(crate) fn add_to(&self, pager: &mut PoolPager) {
        for &KnownView { view, weight, turns, gap_passes } in &self.all {
            if !pager.set.set_weight(view, Weight::new(weight)) {
                let added = pager.set.add_view(view, Weight::new(weight));
                debug_assert_eq!(added, Ok(()), "there is room, as in the other pools");
            }
            pager.set.set_view_turns(view, turns);
            pager.set.set_gap_passes(view, gap_passes, 0);
        }
    }

    /// Returns true if feedback of this view is taken in.
    pub(crate) fn has(&self, view: ViewId) -> bool {
        self.all.iter().any(|known| known.view == view)
    }
}

impl Pager {
    /// Adds a view. `weight` says how much its pixels count when it is decided what is loaded first, beside
    /// those of the main view, which count 1 each: from 1/256 to 256, beyond that as the nearest of these.
    pub fn add_view(&mut self, weight: f32) -> Result<ViewId, ViewError> {
        if self.views.all.len() >= MAX_VIEWS {
            return Err(ViewError::TooMany);
        }
        let view = ViewId::new(self.views.next);
        self.views.next += 1;
        self.views.all.push(KnownView::new(view, weight));
        self.pools_mut().try_for_each(|pager| pager.set.add_view(view, Weight::new(weight)))?;
        Ok(view)
    }

    /// Sets how much a view's pixels count, from its next feedback on. Returns true if there is such a view.
    pub fn set_weight(&mut self, view: ViewId, weight: f32) -> bool {
        let known = self.views.all.iter_mut().find(|known| known.view == view);
        known.into_iter().for_each(|known| known.weight = weight);
        for pager in self.pools_mut() {
            pager.set.set_weight(view, Weight::new(weight));
        }
        self.views.has(view)
    }

    /// Removes a view: what only it wanted is out of view. Returns true if there was one; the main view
    /// stays. Feedback of a view that there is no more is dropped.
    pub fn remove_view(&mut self, view: ViewId) -> bool {
        let before = self.views.all.len();
        self.views.all.retain(|known| known.view != view || view == ViewId::MAIN);
        let Pager { pools, events, .. } = self;
        for pager in pools.iter_mut().map(|pool| &mut pool.pager).filter(|_| view != ViewId::MAIN) {
            if pager.set.remove_view(view) {
                // Less is wanted: the picture may become sharper.
                pager.end_rest();
                pager.recompute(events);
                pager.check();
            }
        }
        self.views.all.len() < before
    }

    /// A view has jumped: its feedback of `frame` and later belongs to a new working set. What other views
    /// want stays.
    ///
    /// A jump that is not declared is noticed where little of the new view was wanted before. So submit one
    /// feedback per view and frame: partial feedbacks that take turns would be taken for jumps.
    pub fn view_cut(&mut self, view: ViewId, frame: u64) {
        self.pools_mut().for_each(|pager| pager.set.view_cut(view, frame));
    }

    /// Sets how many entries take turns in a feedback pixel at most, of textures that one material samples
    /// and that are no group; 1 is where no material has several. So many jitter cycles it takes until every
    /// pixel has answered for each from all sample positions: as long a feedback counts, and as long a view
    /// is looked at before it has converged. 15 at most.
    pub fn set_turns(&mut self, turns: u32) {
        self.turns = turns;
        self.pools_mut().for_each(|pager| pager.set.set_turns(turns));
    }

    /// Sets after how many jitter cycles a view has said all that it wants, where that is more than
    /// [`Pager::set_turns`] says: one of rays, which ask for several pages each. Its feedback counts for so
    /// long, and that of no other view. 15 at most.
    pub fn set_view_turns(&mut self, view: ViewId, turns: u32) {
        let known = self.views.all.iter_mut().find(|known| known.view == view);
        let Some(known) = known.filter(|known| known.turns != turns) else { return };
        known.turns = turns;
        self.pools_mut().for_each(|pager| pager.set.set_view_turns(view, turns));
    }

    /// Says that a view rests, so that it has converged only when every one of its pixels has found what it
    /// needs; so many feedbacks of gaps ([`Feedback::gaps`]) look at all pixels. 0 where it does not rest, as
    /// at first: what was held of its gaps is let go of. What they name is held until then, or until the view
    /// jumps. While all views of a pool with [`BiasRule::Solved`](crate::BiasRule::Solved) rest, none of its
    /// tiles is uploaded twice, unless several pages may have it, or it was asked for explicitly or made room
    /// for what was; so ask [`Pager::looks_for_gaps`] for each feedback then. A view that moves keeps the
    /// others from resting until nothing was heard of it for a jitter cycle of feedbacks of others, or of any
    /// for 128 frames: hide one by removing it. Another rest begins where a view is drawn, hidden or removed,
    /// its turns are set, or a pin or a texture goes. And where one of the pool's pages makes room in that
    /// time, or has since others moved, or the mip bias has fallen, no view has converged until its pixels
    /// were looked at once more.
    pub fn set_gap_passes(&mut self, view: ViewId, passes: u32) {
        let known = self.views.all.iter_mut().find(|known| known.view == view);
        let Some(known) = known.filter(|known| known.gap_passes != passes) else { return };
        known.gap_passes = passes;
        let frame = self.frame;
        self.pools_mut().for_each(|pager| pager.set.set_gap_passes(view, passes, frame));
    }

    /// Returns true if the next feedback of a view is to look for gaps: the view rests
    /// ([`Pager::set_gap_passes`]), it was seen for a jitter cycle since, whatever its turns
    /// ([`Pager::set_view_turns`]), and all that it wanted in that was there once. What it wanted before is
    /// let go of then. Costs a visit of each page of the working sets until it says so, and nothing from then
    /// on.
    pub fn looks_for_gaps(&mut self, view: ViewId) -> bool {
        let said = |pager: &PoolPager| pager.set.looks_for_gaps(view);
        if self.pools.is_empty() || self.pools().any(|pager| said(pager).is_none()) {
            return false;
        }
        if self.pools().any(|pager| said(pager) == Some(false)) {
            let mut is_seen = true;
            self.pools_mut().for_each(|pager| is_seen &= pager.set.is_seen_at_rest(view));
            if !is_seen || !self.pools().all(|pager| pager.has_all_of(view)) {
                return false;
            }
            self.pools_mut().for_each(|pager| pager.set.look_for_gaps(view));
        }
        true
    }

    /// Of how many pages that a ray of a view lacks its feedback of gaps is to name one, a different one each
    /// time that all pixels are looked at: 4, or more where pages of the view could not be had, which would
    /// hide others behind them; 64 at most. Each of the pools of the view counts.
    pub fn gaps_by_turns(&self, view: ViewId) -> u32 {
        named_by_turns(self.failed_of(view))
    }

    /// Pages of a view that rests that could not be had, in all pools together.
    fn failed_of(&self, view: ViewId) -> u32 {
        self.pools().map(|pager| pager.set.failed_of(view)).sum()
    }

    /// Each pool is told how many pages of the views that rest could not be had in all of them.
    pub(super) fn share_failed(&mut self) {
        let frame = self.frame;
        for place in 0..self.views.all.len() {
            let KnownView { view, gap_passes, .. } = self.views.all[place];
            if gap_passes > 0 {
                let failed = self.failed_of(view);
                self.pools_mut().for_each(|pager| pager.set.set_failed_in_all(view, failed, frame));
            }
        }
    }

    /// Feedbacks of a view after which it has been seen whole, unless it has turns of its own
    /// ([`Pager::set_view_turns`]): a jitter cycle for each of the turns.
    pub fn feedback_cycle(&self) -> u32 {
        WorkingSet::cycle_of(self.turns)
    }

    /// Returns true if a view has been seen for a whole jitter cycle of its own since it last jumped, and all
    /// that it wanted in that cycle is resident at the bias in force, or could not be had, and, where its
    /// gaps are looked for, it has none and, by [`BiasRule::Solved`](crate::BiasRule::Solved), the bias falls no
    /// further; whatever other views want. False for a view that there is not, and where there is no pool.
    /// Costs a visit of each page of the working sets.
    pub fn is_view_converged(&self, view: ViewId) -> bool {
        let has_no_gaps =
            |pager: &PoolPager| pager.set.has_no_gaps(view, pager.last_change()) && !pager.becomes_sharper();
        let has_all = |pager: &PoolPager| has_no_gaps(pager) && pager.has_all_of(view);
        !self.pools.is_empty() && self.pools().all(has_all)
    }

    /// Returns true if it is a feedback of a view that there is.
    pub(crate) fn knows(&self, feedback: &Feedback) -> bool {
        self.views.has(feedback.view)
    }
}
