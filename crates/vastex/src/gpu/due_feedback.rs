//! Lock-step: the feedback of frame `n` acts in frame `n + 2` on every machine.

use std::collections::VecDeque;

use vastex_core::ViewId;

/// Frames between a view and its feedback.
pub(crate) const FEEDBACK_FRAMES: u64 = 2;

/// Frames, and views of them, whose feedback was recorded and has not been taken.
#[derive(Debug, Default)]
pub(super) struct DueFeedback(VecDeque<(u64, ViewId)>);

impl DueFeedback {
    pub(super) fn record(&mut self, frame: u64, view: ViewId) {
        self.0.push_back((frame, view));
    }

    /// Feedback of a view that was under way is given up.
    pub(super) fn forget(&mut self, view: ViewId) {
        self.0.retain(|(_, recorded)| *recorded != view);
    }

    /// The frame and the view whose feedback is to be waited for in `frame`, if any is left.
    pub(super) fn take(&mut self, frame: u64) -> Option<(u64, ViewId)> {
        self.0.pop_front_if(|(recorded, _)| *recorded + FEEDBACK_FRAMES <= frame)
    }

    /// Feedback that was due but whose commands are not submitted stays due.
    pub(super) fn put_back(&mut self, late: Vec<(u64, ViewId)>) {
        late.into_iter().rev().for_each(|recorded| self.0.push_front(recorded));
    }
}
