//! How often a pager's structures are checked: after some of its steps only, where they are large.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Records that a step visits for its checks, on average, at most: a pager of more is checked after some
/// steps only.
const VISITS: usize = 256;

/// Visits that a pager's steps without a check have left to a later one. Each pool has its own, so that none
/// uses up those of others.
#[derive(Debug, Default)]
pub(crate) struct CheckPace(AtomicUsize);

impl CheckPace {
    /// Returns true if, after another step, a check of so many visits is due.
    pub(crate) fn is_due(&self, visits: usize) -> bool {
        let saved = self.0.load(Ordering::Relaxed) + VISITS;
        let is_due = saved >= visits;
        self.0.store(if is_due { 0 } else { saved }, Ordering::Relaxed);
        is_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_pager_is_checked_beside_small_ones() {
        let [small, large] = [(); 2].map(|()| CheckPace::default());
        let checked = (0..100).filter(|_| {
            assert!(small.is_due(VISITS) && small.is_due(1));
            large.is_due(10 * VISITS)
        });
        assert_eq!(checked.count(), 10);
    }
}
