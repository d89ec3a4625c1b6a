//! Failures that are remembered: for how long, and of how many pages.
//!
//! A page that could not be had is tried again with back-off, so its record stays when the page leaves the
//! view; otherwise a camera that sways would ask a dead source in each frame. It is forgotten when it was
//! neither in view nor claimed when twice its last back-off has passed since the failure, and sooner where
//! there are more such pages than [`MOST`]: a flight over a source that has died leaves no more behind. What
//! is forgotten begins anew: the next failure is the first, and is reported.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::residency::Residency;
use crate::residency::records::{RecordHint, State};
use crate::shader_constants::JITTER_CYCLE;
use crate::texture::page::PageId;

/// Failures that are remembered at most, beside those of pages in view or held.
const MOST: usize = 32_768;
/// Of those that are too many, so many are looked at in a frame.
const LOOKED_AT: usize = 1024;
/// Frames until a page is looked at again that is in use.
const AGAIN: u64 = 1024;

/// Frames that a tile which failed once waits before it is tried again; doubled at each further failure.
const FIRST_BACK_OFF: u64 = 2 * JITTER_CYCLE as u64;
/// How often the wait is doubled at most: about five minutes at 60 frames a second.
const DOUBLINGS: u32 = 9;

/// Frames until a load is tried again after it and so many before it have failed.
pub(crate) fn back_off(failures: u32) -> u64 {
    FIRST_BACK_OFF << failures.min(DOUBLINGS)
}

/// When each failure may be forgotten, soonest first: the frame, the page, and how often it had failed in a
/// row by then.
#[derive(Debug, Default)]
pub(crate) struct Failures(BinaryHeap<Reverse<(u64, PageId, u16)>>);

impl Failures {
    /// Returns true if none is remembered.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// A load of the page has failed in `frame`, that often in a row, and may be tried again in `retry_at`.
    pub(crate) fn note(&mut self, page: PageId, failures: u16, frame: u64, retry_at: u64) {
        self.0.push(Reverse((retry_at + (retry_at - frame), page, failures)));
    }
}

impl Residency {
    /// Forgets failures whose time has come. Costs a visit of these.
    pub(crate) fn forget_failures(&mut self) {
        for looked_at in 0.. {
            let is_too_many = self.failing.0.len() > MOST && looked_at < LOOKED_AT;
            let is_due = |Reverse((at, ..)): &Reverse<(u64, PageId, u16)>| *at <= self.frame || is_too_many;
            if !self.failing.0.peek().is_some_and(is_due) {
                break;
            }
            if let Some(Reverse((_, page, failures))) = self.failing.0.pop() {
                self.forget_failure(page, failures);
            }
        }
    }

    fn forget_failure(&mut self, page: PageId, failures: u16) {
        // Since then it may have come, failed again, or have gone with its texture.
        let Some(record) = self.records.get(page).filter(|record| record.failures == failures) else {
            return;
        };
        if record.state != State::Failed || self.has_use_for(page, RecordHint::default()) {
            self.failing.0.push(Reverse((self.frame + AGAIN, page, failures)));
            return;
        }
        if let Some(record) = self.records.get_mut(page) {
            record.failures = 0;
        }
        self.drop_page(page);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::residency::PageState;
    use crate::residency::sharing::ContentId;
    use crate::texture::page::{Dims, PagePos, TextureNumber};

    fn page(n: u32) -> PageId {
        PageId::new(TextureNumber::new(0).unwrap(), Dims::D2, PagePos::new_2d(0, n % 4096, n / 4096)).unwrap()
    }

    /// The page is wanted in one frame, and cannot be had.
    fn fail(residency: &mut Residency, page: PageId) {
        residency.begin_round();
        residency.want(page, ContentId::NONE, RecordHint::default());
        if residency.begin_load(page, 0) {
            residency.load_failed(page);
        }
        residency.begin_round();
    }

    #[test]
    fn a_failure_out_of_view_is_forgotten_after_twice_its_back_off() {
        let mut residency = Residency::new(10, 1);
        residency.begin_frame(1);
        fail(&mut residency, page(7));
        let PageState::Failed { until } = residency.state(page(7)) else { panic!("it has not failed") };
        residency.begin_frame(until - 1);
        fail(&mut residency, page(7));
        assert_eq!(residency.stats.failures, 1, "not tried again before its time, though it left the view");
        residency.begin_frame(until + (until - 1) - 1);
        assert!(residency.has_failed(page(7)));
        residency.begin_frame(until + (until - 1));
        assert_eq!((residency.state(page(7)), residency.records.len()), (PageState::Absent, 0));
    }

    #[test]
    fn one_in_view_is_not_forgotten_and_each_failure_waits_longer() {
        let mut residency = Residency::new(10, 1);
        for frame in 1..5000 {
            residency.begin_frame(frame);
            residency.begin_round();
            residency.want(page(7), ContentId::NONE, RecordHint::default());
            if residency.begin_load(page(7), 0) {
                residency.load_failed(page(7));
            }
        }
        // 32, 64, 128 ... frames: 32 * (2^n - 1) of them.
        assert_eq!(residency.stats.failures, 8);
        assert!(residency.has_failed(page(7)) && residency.failing.0.len() <= 8);
    }

    #[test]
    fn a_flight_over_a_dead_source_leaves_a_bounded_number_behind() {
        let mut residency = Residency::new(10, 1);
        for n in 0..60_000 {
            residency.begin_frame(1 + u64::from(n) / 2000); // 2,000 in each frame
            fail(&mut residency, page(n));
        }
        residency.begin_frame(31);
        let known = residency.records.len();
        assert!((MOST / 2..=MOST + 2000).contains(&known), "{known}");
        assert!(residency.has_failed(page(59_999)), "the newest are remembered");
        residency.begin_frame(2000);
        assert_eq!((residency.records.len(), residency.failing.0.len()), (0, 0));
    }
}
