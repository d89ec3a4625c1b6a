//! Lock-step: what arrives, arrives in the same frame on every machine.
//!
//! The feedback of frame `n` acts in frame `n + 2`. A load takes a whole number of frames, and its result is waited for
//! when they are over; results are handed on in the order of the requests, whichever thread was first.

use std::collections::{HashMap, HashSet, VecDeque};

use vastex_core::{PageId, ViewId};
use vastex_tiles::{LoadError, Loaded, Loader};

use crate::error::Error;
use crate::settings::Pace;

/// Frames between a view and its feedback.
pub(crate) const FEEDBACK_FRAMES: u64 = 2;

/// See the head of the file.
#[derive(Debug)]
pub(crate) struct LockStep {
    latency_frames: u64,
    /// Frames, and views of them, whose feedback was recorded and has not been taken.
    recorded: VecDeque<(u64, ViewId)>,
    /// Loads under way, with the frame in which they end.
    loads: VecDeque<(u64, PageId)>,
    /// Results that came before their frame.
    early: HashMap<PageId, Loaded>,
    cancelled: HashSet<PageId>,
}

impl LockStep {
    /// What waits for feedback and loads; nothing in real time. A browser lets nothing be waited for.
    pub(crate) fn of(pace: Pace, in_browser: bool) -> Result<Option<LockStep>, Error> {
        match pace {
            Pace::Realtime => Ok(None),
            Pace::LockStep { .. } if in_browser => Err(Error::LockStepInBrowser),
            Pace::LockStep { latency_frames } => Ok(Some(LockStep::new(latency_frames))),
        }
    }

    fn new(latency_frames: u64) -> LockStep {
        LockStep {
            latency_frames: latency_frames.max(1),
            recorded: VecDeque::new(),
            loads: VecDeque::new(),
            early: HashMap::new(),
            cancelled: HashSet::new(),
        }
    }

    pub(crate) fn feedback_recorded(&mut self, frame: u64, view: ViewId) {
        self.recorded.push_back((frame, view));
    }

    /// Feedback of a view that was under way is given up.
    pub(crate) fn forget_feedback(&mut self, view: ViewId) {
        self.recorded.retain(|(_, recorded)| *recorded != view);
    }

    /// The frame and the view whose feedback is to be waited for in `frame`, if any is left.
    pub(crate) fn due_feedback(&mut self, frame: u64) -> Option<(u64, ViewId)> {
        self.recorded.pop_front_if(|(recorded, _)| *recorded + FEEDBACK_FRAMES <= frame)
    }

    /// Feedback that was due but whose commands are not submitted stays due.
    pub(crate) fn feedback_is_late(&mut self, late: Vec<(u64, ViewId)>) {
        late.into_iter().rev().for_each(|recorded| self.recorded.push_front(recorded));
    }

    pub(crate) fn requested(&mut self, page: PageId, frame: u64) {
        self.loads.push_back((frame + self.latency_frames, page));
    }

    /// The load is called off. The loader is not told, since whether it has begun depends on the machine.
    pub(crate) fn cancel(&mut self, page: PageId) {
        self.cancelled.insert(page);
    }

    /// The loads that end in `frame`, waited for.
    pub(crate) fn due_loads(&mut self, frame: u64, loader: &mut Loader) -> Vec<Loaded> {
        let mut due = Vec::new();
        while let Some((_, page)) = self.loads.pop_front_if(|(ends, _)| *ends <= frame) {
            while !self.early.contains_key(&page) {
                let Some(loaded) = loader.wait() else { break };
                self.early.insert(loaded.page, loaded);
            }
            let Some(mut loaded) = self.early.remove(&page) else { continue };
            if self.cancelled.remove(&page) {
                loaded.result = Err(LoadError::Cancelled);
            }
            due.push(loaded);
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lock_step_is_refused_in_a_browser() {
        let is_waited =
            |pace, in_browser| LockStep::of(pace, in_browser).map(|lock_step| lock_step.is_some());
        let paced = Pace::LockStep { latency_frames: 1 };
        assert!(matches!(is_waited(Pace::Realtime, true), Ok(false)));
        assert!(matches!(is_waited(paced, false), Ok(true)));
        let error = is_waited(paced, true).unwrap_err();
        assert!(matches!(error, Error::LockStepInBrowser) && error.to_string().contains("Pace::Realtime"));
    }
}
