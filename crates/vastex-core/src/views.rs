//! Views: the main view, and others beside it, as of a mirror, a shadow, a second eye, a second window.
//!
//! Each gives feedback of its own, as often as it is drawn, and what any of them wants is wanted; how sharply, the sharpest
//! need of any says. A view's weight only says how much its pixels count when it is decided what is loaded first. What each
//! wants is kept for one jitter cycle of its own (`working_set`).

use crate::feedback::Feedback;
use crate::pager::Pager;
use crate::pagers::Pagers;

/// Views that there can be at once, the main view among them.
pub const MAX_VIEWS: usize = 8;

/// Names a view. Numbers are not given twice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ViewId(u32);

impl ViewId {
    /// The main view, which is always there.
    pub const MAIN: ViewId = ViewId(0);

    /// What is expected to be seen, which is no view yet: feedback of it goes where [`Pagers::expect`] takes it.
    pub const EXPECTED: ViewId = ViewId(u32::MAX);

    /// The view of this number; 0 is the main view.
    pub const fn new(number: u32) -> ViewId {
        ViewId(number)
    }

    /// Its number.
    pub const fn number(self) -> u32 {
        self.0
    }
}

/// Why a view could not be added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ViewError {
    /// There are as many as there can be.
    #[error(
        "there are {MAX_VIEWS} views already; remove one, or let views that show parts of one scene share one"
    )]
    TooMany,
    /// There is a view of this number.
    #[error("there is a view of the number {0} already; take one that is free")]
    NumberTaken(u32),
}

/// How much a pixel counts, in 65536ths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Weight(u32);

impl Weight {
    pub(crate) const ONE: Weight = Weight(1 << Weight::FRACTION_BITS);
    const FRACTION_BITS: u32 = 16;
    /// A weight is at least one by this, and at most this.
    const MOST: f32 = 256.0;

    /// The nearest weight; of what is no number, that of the main view.
    pub(crate) fn new(weight: f32) -> Weight {
        if weight.is_nan() {
            return Weight::ONE;
        }
        Weight((weight.clamp(1.0 / Weight::MOST, Weight::MOST) * Weight::ONE.0 as f32) as u32)
    }

    /// What so many pixels count: at least one where there is any.
    pub(crate) fn of(self, pixels: u32) -> u32 {
        let weighted = (u64::from(pixels) * u64::from(self.0)) >> Weight::FRACTION_BITS;
        u32::try_from(weighted).unwrap_or(u32::MAX).max(pixels.min(1))
    }
}

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
            self.work_out();
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
        Views { all: vec![(ViewId::MAIN, 1.0)], next: ViewId::MAIN.0 + 1 }
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
        let view = ViewId(self.views.next);
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

    /// Whether it is a feedback of a view that there is.
    pub(crate) fn knows(&self, feedback: &Feedback) -> bool {
        self.views.has(feedback.view)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_weight_is_a_number_whatever_is_given() {
        assert_eq!((Weight::new(1.0), Weight::new(f32::NAN)), (Weight::ONE, Weight::ONE));
        assert_eq!(Weight::new(f32::INFINITY), Weight::new(256.0));
        assert_eq!(Weight::new(-3.0), Weight::new(1.0 / 256.0));
        assert_eq!(Weight::new(0.5).of(7), 3);
        assert_eq!(Weight::new(256.0).of(u32::MAX), u32::MAX);
    }

    proptest! {
        #[test]
        fn no_weight_makes_pixels_nothing_or_turns_them_round(weight in any::<f32>(), few in any::<u32>(), more in any::<u32>()) {
            let weight = Weight::new(weight);
            let (few, more) = (few.min(more), few.max(more));
            prop_assert!(weight.of(few) <= weight.of(more));
            prop_assert_eq!(weight.of(few) == 0, few == 0);
            prop_assert_eq!(Weight::ONE.of(few), few);
        }
    }
}
