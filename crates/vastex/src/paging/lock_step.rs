//! Lock-step: tiles arrive in the same frame on every machine.
//!
//! A load takes a whole number of frames, and its result is waited for
//! when they are over; results are handed on in the order of the requests, whichever thread was first.

use std::collections::{HashMap, HashSet, VecDeque};

use vastex_core::PageId;
use vastex_tiles::{LoadError, Loaded, Loader};

use crate::error::Error;
use crate::settings::Pace;

/// Loads in lock-step.
#[derive(Debug)]
pub(crate) struct LockStep {
    latency_frames: u64,
    /// Loads under way, with the frame in which they end.
    loads: VecDeque<(u64, PageId)>,
    /// Results that came before their frame.
    early: HashMap<PageId, Loaded>,
    cancelled: HashSet<PageId>,
}

impl LockStep {
    /// What waits for loads; nothing in real time. A browser lets nothing be waited for.
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
            loads: VecDeque::new(),
            early: HashMap::new(),
            cancelled: HashSet::new(),
        }
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
