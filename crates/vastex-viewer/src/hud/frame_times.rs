//! The times between the last frames.

use std::collections::VecDeque;
use std::time::Duration;

/// Frames that are kept.
pub(super) const MOST: usize = 256;

/// The times between the last frames that followed one another without a pause.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameTimes {
    pub(super) ms: VecDeque<f32>,
}

impl FrameTimes {
    /// A frame came so long after the one before.
    pub fn push(&mut self, time: Duration) {
        if self.ms.len() == MOST {
            self.ms.pop_front();
        }
        self.ms.push_back(1000.0 * time.as_secs_f32());
    }

    /// Milliseconds that a share of the frames did not take longer than, 0 to 1; `None` before the second
    /// frame.
    pub(super) fn within(&self, share: f32) -> Option<f32> {
        let mut sorted: Vec<f32> = self.ms.iter().copied().collect();
        sorted.sort_by(f32::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        sorted.get((last as f32 * share).round() as usize).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_frames_are_kept() {
        let mut frames = FrameTimes::default();
        assert_eq!(frames.within(0.5), None);
        (0..MOST as u64 + 10).for_each(|n| frames.push(Duration::from_millis(n)));
        assert_eq!(
            (frames.ms.len(), frames.within(0.0), frames.within(1.0)),
            (MOST, Some(10.0), Some(265.0))
        );
    }
}
