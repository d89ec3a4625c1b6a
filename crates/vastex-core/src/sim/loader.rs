//! A loader that takes a whole number of frames, carries so many tiles a frame, and fails when it is told to.

use crate::page::PageId;
use crate::sim::Random;

/// How a load ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    Tile,
    Failure,
    Cancelled,
}

/// Loads under way.
#[derive(Clone, Debug)]
pub struct Loads {
    under_way: Vec<(u64, PageId, bool)>,
    random: Random,
    /// Frames that a load takes.
    pub latency_frames: u64,
    /// Tiles that can arrive in one frame.
    pub tiles_per_frame: usize,
    /// Share of the pages whose tiles can never be had.
    pub broken: f64,
    /// Share of the loads that fail by chance.
    pub failing: f64,
    /// Share of the loads that take ten times as long.
    pub slow: f64,
}

impl Loads {
    pub(crate) fn new(seed: u64) -> Loads {
        Loads {
            under_way: Vec::new(),
            random: Random::new(seed),
            latency_frames: 1,
            tiles_per_frame: 8,
            broken: 0.0,
            failing: 0.0,
            slow: 0.0,
        }
    }

    /// Whether the page's tile can never be had: a property of the page.
    pub(crate) fn is_broken(&self, page: PageId) -> bool {
        Random::new(page.to_bits()).chance(self.broken)
    }

    pub(crate) fn begin(&mut self, page: PageId, frame: u64) {
        let slow = if self.random.chance(self.slow) { 10 } else { 1 };
        self.under_way.push((frame + self.latency_frames * slow, page, false));
    }

    pub(crate) fn cancel(&mut self, page: PageId) {
        self.under_way
            .iter_mut()
            .filter(|(_, p, _)| *p == page)
            .for_each(|(.., cancelled)| *cancelled = true);
    }

    pub(crate) fn has(&self, page: PageId) -> bool {
        self.under_way.iter().any(|(_, loading, _)| *loading == page)
    }

    pub(crate) fn under_way(&self) -> usize {
        self.under_way.len()
    }

    /// What arrives in a frame. A cancelled load is let go of at once or, half the time, was too late to stop.
    pub(crate) fn arrivals(&mut self, frame: u64) -> Vec<(PageId, Outcome)> {
        let mut room = self.tiles_per_frame;
        let mut arrived = Vec::new();
        for (due, page, cancelled) in std::mem::take(&mut self.under_way) {
            let outcome = if cancelled && self.random.chance(0.5) {
                Outcome::Cancelled
            } else if due > frame || room == 0 {
                self.under_way.push((due, page, cancelled));
                continue;
            } else {
                room -= 1;
                let fails = self.is_broken(page) || self.random.chance(self.failing);
                if fails { Outcome::Failure } else { Outcome::Tile }
            };
            arrived.push((page, outcome));
        }
        arrived
    }
}
