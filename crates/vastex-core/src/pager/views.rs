//! Views: the main view, and others beside it, as of a mirror, a shadow, a second eye, a second window.
//!
//! Each gives feedback of its own, as often as it is drawn, and what any of them wants is wanted; how sharply, the sharpest
//! need of any says. A view's weight only says how much its pixels count when it is decided what is loaded first. What each
//! wants is kept for one jitter cycle of its own (`working_set`).

use crate::pager::Pagers;
use crate::pager::pool::Pager;
use crate::pager::working_set::WorkingSet;
use crate::wanted::feedback::Feedback;
use crate::wanted::view::{MAX_VIEWS, ViewError, ViewId, Weight};

impl Pager {
    /// Adds a view under a number that is free. `weight` says how much its pixels count when it is decided what is loaded first,
    /// beside those of the main view, which count 1 each: from 1/256 to 256, beyond that as the nearest of these.
    pub fn add_view(&mut self, view: ViewId, weight: f32) -> Result<(), ViewError> {
        self.set.add_view(view, Weight::new(weight))
    }

    /// Sets how much a view's pixels count, from its next feedback on. Says whether there is such a view.
    pub fn set_weight(&mut self, view: ViewId, weight: f32) -> bool {
        self.set.set_weight(view, Weight::new(weight))
    }

    /// Removes a view: what only it wanted is out of view. Says whether there was one; the main view stays. Feedback of a
    /// view that there is no more is dropped.
    pub fn remove_view(&mut self, view: ViewId) -> bool {
        let removed = view != ViewId::MAIN && self.set.remove_view(view);
        if removed {
            self.recompute();
            self.check();
        }
        removed
    }

    /// A view has jumped: its feedback of `frame` and later belongs to a new working set. What other views want stays.
    ///
    /// A jump that is not declared is noticed where little of the new view was wanted before. So what one view wants in a
    /// frame belongs into one feedback: things to look at that take turns would look like jumps.
    pub fn view_cut(&mut self, view: ViewId, frame: u64) {
        self.set.view_cut(view, frame);
    }
}

/// The views that every pager knows.
#[derive(Debug)]
pub(crate) struct Views {
    /// Each with its weight.
    all: Vec<(ViewId, f32)>,
    next: u32,
}

impl Default for Views {
    fn default() -> Views {
        Views { all: vec![(ViewId::MAIN, 1.0)], next: ViewId::MAIN.number() + 1 }
    }
}

impl Views {
    /// Makes the views known to a new pager, which knows the main view.
    pub(crate) fn tell(&self, pager: &mut Pager) {
        for &(view, weight) in &self.all {
            if !pager.set_weight(view, weight) {
                let added = pager.add_view(view, weight);
                debug_assert_eq!(added, Ok(()), "there is room, as in the other pagers");
            }
        }
    }

    /// Whether feedback of this view is taken in.
    pub(crate) fn has(&self, view: ViewId) -> bool {
        self.all.iter().any(|(known, _)| *known == view)
    }
}

impl Pagers {
    /// Adds a view; `weight` as in [`Pager::add_view`].
    pub fn add_view(&mut self, weight: f32) -> Result<ViewId, ViewError> {
        if self.views.all.len() >= MAX_VIEWS {
            return Err(ViewError::TooMany);
        }
        let view = ViewId::new(self.views.next);
        self.views.next += 1;
        self.views.all.push((view, weight));
        self.iter_mut().try_for_each(|pager| pager.add_view(view, weight))?;
        Ok(view)
    }

    /// Sets how much a view's pixels count; see [`Pager::set_weight`].
    pub fn set_weight(&mut self, view: ViewId, weight: f32) -> bool {
        let known = self.views.all.iter_mut().find(|(known, _)| *known == view);
        known.into_iter().for_each(|(_, old)| *old = weight);
        for pager in self.iter_mut() {
            pager.set_weight(view, weight);
        }
        self.views.has(view)
    }

    /// Removes a view; see [`Pager::remove_view`].
    pub fn remove_view(&mut self, view: ViewId) -> bool {
        let before = self.views.all.len();
        self.views.all.retain(|(known, _)| *known != view || view == ViewId::MAIN);
        for pager in self.iter_mut() {
            pager.remove_view(view);
        }
        self.views.all.len() < before
    }

    /// A view has jumped; see [`Pager::view_cut`].
    pub fn view_cut(&mut self, view: ViewId, frame: u64) {
        self.iter_mut().for_each(|pager| pager.view_cut(view, frame));
    }

    /// Sets how many entries take turns in a feedback pixel at most, of textures that one material samples and that are no group; 1
    /// is where no material has several. So many jitter cycles it takes until every pixel has answered for each from all sample
    /// positions: as long a feedback counts, and as long a view is looked at before it has converged. 15 at most.
    pub fn set_turns(&mut self, turns: u32) {
        self.turns = turns;
        self.iter_mut().for_each(|pager| pager.set.set_turns(turns));
    }

    /// Feedbacks of a view after which it has been seen whole: a jitter cycle for each of the turns.
    pub fn feedback_cycle(&self) -> u32 {
        WorkingSet::cycle_of(self.turns)
    }

    /// Whether it is a feedback of a view that there is.
    pub(crate) fn knows(&self, feedback: &Feedback) -> bool {
        self.views.has(feedback.view)
    }
}
