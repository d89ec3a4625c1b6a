//! How long the pages of a view were missing: from the feedback that first wanted them to the frame in which
//! they were resident, 0 for those that were here already.

use std::collections::BTreeMap;

use crate::pager::pool::PoolPager;
use crate::residency::PageState;
use crate::texture::page::PageId;

/// Times to sharp of the pages that came into view.
#[derive(Clone, Debug, Default)]
pub struct Sharpness {
    /// Pages of the last working set; since when they are missing, where they are.
    in_view: BTreeMap<PageId, Option<u64>>,
    frames: Vec<u64>,
}

impl Sharpness {
    /// Takes note of the working set at the bias in force after a frame.
    pub(crate) fn note(&mut self, frame: u64, pager: &PoolPager) {
        let mut now = BTreeMap::new();
        for page in pager.pages_in_view() {
            let is_here = matches!(pager.state(page), PageState::Resident(_));
            let since = match self.in_view.get(&page) {
                Some(None) => None,
                Some(Some(since)) => Some(*since),
                None => Some(frame),
            };
            if let Some(since) = since.filter(|_| is_here) {
                self.frames.push(frame - since);
            }
            now.insert(page, since.filter(|_| !is_here));
        }
        self.in_view = now;
    }

    /// Pages that became sharp.
    pub fn count(&self) -> usize {
        self.frames.len()
    }

    /// Frames that a page took on average.
    pub fn mean(&self) -> f64 {
        self.frames.iter().sum::<u64>() as f64 / self.frames.len().max(1) as f64
    }

    /// Frames that so many percent of the pages did not exceed.
    pub fn percentile(&self, percent: usize) -> u64 {
        let mut sorted = self.frames.clone();
        sorted.sort_unstable();
        let at = (sorted.len() * percent).div_ceil(100).saturating_sub(1);
        sorted.get(at).copied().unwrap_or(0)
    }
}
