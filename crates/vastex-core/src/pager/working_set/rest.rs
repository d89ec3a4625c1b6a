//! Views that rest, seen from the set: which rest it is, whether the set is of nothing else, and whether it
//! misses a page that was given up.

use crate::pager::working_set::WorkingSet;
use crate::pager::working_set::window::Window;
use crate::wanted::feedback::Need;

/// Which rest of its views it is. Two in a row differ, unless a view that rests takes another's place, which
/// is yet to be known ([`WorkingSet::knows_rest`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::pager) struct RestNumber {
    views: usize,
    /// How often these views were said to rest or not to, or to look at something else, all of them together.
    changes: u64,
}

impl WorkingSet {
    /// Which rest it is of the views that rest; `None` where there is none, or one is drawn that does not and
    /// that wants something.
    pub(in crate::pager) fn rest_number(&self) -> Option<RestNumber> {
        let counts =
            |window: &&Window| window.gaps.are_of_interest() || window.is_drawn() && !window.cycle.is_empty();
        let number = self.windows().filter(counts).try_fold((0, 0), |(views, changes), window| {
            window.gaps.are_of_interest().then(|| (views + 1, changes + window.gaps.changes()))
        });
        number.filter(|(views, _)| *views > 0).map(|(views, changes)| RestNumber { views, changes })
    }

    /// Returns true if nothing of what those of them that are drawn wanted before they rest is in the set.
    /// Who was not drawn for a jitter cycle is not waited for.
    pub(in crate::pager) fn knows_rest(&self) -> bool {
        let counts = |window: &&Window| window.gaps.are_of_interest() && window.is_drawn_lately();
        let mut resting = self.windows().filter(counts);
        resting.all(|window| window.gaps.is_rest_known())
    }

    /// Returns true if a page that was given up is what some pixel is to show at a bias. Costs a visit of
    /// each page of the set.
    pub(in crate::pager) fn misses_given_up(&self, bias: u16) -> bool {
        let is_given_up_at = |at: u32, level: u8| {
            let above = std::iter::successors(self.nodes.get(at as usize), |node| {
                self.nodes.get(node.parent as usize)
            });
            above.skip_while(|node| node.page.level() < level).take(1).any(|node| node.is_given_up)
        };
        self.by_level.iter().flatten().any(|&at| {
            let node = &self.nodes[at as usize];
            let eighths = (0..).zip(&node.feedbacks).filter(|(_, count)| **count > 0);
            let mut needs = eighths.map(|(eighth, _)| Need::new(node.page.level(), eighth));
            needs.any(|need| is_given_up_at(at, need.level_at(bias)))
        })
    }
}
