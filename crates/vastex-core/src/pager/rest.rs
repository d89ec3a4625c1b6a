//! While the views of a pool rest no tile is uploaded twice, however small the pool is.
//!
//! They rest where gaps are looked for in every view that is drawn and wants something of the pool; the rest
//! ends where one of them moves, and another begins where a cut is declared, another view is drawn, the pool
//! gets another size or rule, or a view, a pin or a texture goes. It is *settled* once what was wanted before
//! it is let go of, and the bias could not be smaller for what is wanted then, at the latest after a number
//! of decisions. From then on the set only grows and the bias only rises, for what gaps name is held. So a
//! page leaves the set where the bias has risen above all needs of it that are known. But gaps name what is
//! not there: that some pixel needs the page more sharply shows only when its tile has gone. It is not asked
//! for again then: the bias rises until that pixel shows the page above.
//!
//! | | what came before the rest | what came in it |
//! |---|---|---|
//! | until it is settled | makes room | stays; where nothing else makes room, uploads wait for feedbacks |
//! | after that | makes room first | makes room last, and never comes again |
//!
//! So a tile that comes in the rest and goes in it was the last one of its page, and whenever a view has
//! converged each of its pixels has what it needs at the bias. Excepted are tiles that several pages may
//! have, what no view wants, as prefetches do, and what makes room for that: the picture does not become
//! coarser for what it does not show, and a page that some pixel turns out to need comes once more. Loads are
//! not counted: a tile that waits while the bias rises may be called off, and is loaded once more if it is
//! wanted again. Where the bias falls all the same, since less is wanted, another rest begins, so that the
//! picture becomes sharper.

use crate::pager::bias::{BiasControl, BiasRule};
use crate::pager::working_set::{RestNumber, WorkingSet};
use crate::residency::Residency;

/// How far the rest of a pool's views is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PoolRest {
    /// Which one it is; `None` where the views do not rest.
    number: Option<RestNumber>,
    is_settled: bool,
    /// Decisions since it began, and whether it was settled for their number alone, and what is wanted in it
    /// is still not known.
    decisions: u32,
    is_overdue: bool,
}

/// Decisions after which a rest is settled whatever is not known: nothing waits longer for it. A rest is
/// settled after one jitter cycle, and one more for each time that the bias falls.
const MOST_UNSETTLED: u32 = 1024;

impl PoolRest {
    /// Takes note of whether the views rest, before the set is made anew.
    pub(super) fn follow(&mut self, set: &WorkingSet, bias: &mut BiasControl, residency: &mut Residency) {
        let number = set.rest_number().filter(|_| bias.rule() == Some(BiasRule::Solved));
        self.is_overdue &= !set.knows_rest();
        // A jump that nobody has declared is one of before the rest, unless that is settled.
        if self.number != number || self.is_settled && !self.is_overdue && !set.knows_rest() {
            self.begin(number, bias, residency);
        }
    }

    /// Takes note of whether the rest is settled, after the set was made anew; `bias_before` was in force
    /// until then.
    pub(super) fn settle(
        &mut self,
        bias_before: u16,
        set: &WorkingSet,
        bias: &mut BiasControl,
        residency: &mut Residency,
    ) {
        if self.number.is_none() {
            return;
        }
        if self.is_settled && bias.bias() < bias_before {
            // Something is not wanted any more, so that there is room for what was given up.
            self.begin(self.number, bias, residency);
        }
        self.decisions = self.decisions.saturating_add(1);
        let may_fall = || bias.may_fall(set, residency.slot_count(), residency.tails());
        let is_known = set.knows_rest() && !may_fall();
        if !self.is_settled && (self.decisions > MOST_UNSETTLED || is_known) {
            (self.is_settled, self.is_overdue) = (true, !is_known);
            residency.keep_all_of_rest(false);
        }
    }

    /// Returns true if the views rest.
    pub(super) fn is_under_way(&self) -> bool {
        self.number.is_some()
    }

    /// What was given up may come again, until the next feedback says that the views rest.
    pub(super) fn end(&mut self, bias: &mut BiasControl, residency: &mut Residency) {
        self.begin(None, bias, residency);
    }

    fn begin(&mut self, number: Option<RestNumber>, bias: &mut BiasControl, residency: &mut Residency) {
        *self = PoolRest { number, ..PoolRest::default() };
        residency.begin_rest(number.is_some());
        bias.forget_floor();
    }
}

/// Makes the picture coarser until nobody misses what was given up. Costs a visit of each page of the set for
/// each eighth of a level, where anything was.
pub(super) fn do_without_given_up(set: &WorkingSet, bias: &mut BiasControl, residency: &Residency) {
    while residency.has_given_up_any() && set.misses_given_up(bias.bias()) && bias.raise_floor() {}
}
