//! Telemetry: how each pool stood after each of the last frames.
//!
//! [`PoolFrame`] is one pool after one frame, [`History`] keeps those of the last frames. Everything follows
//! from what the pager counts anyway; time is in frames, since there is no clock here. What the tiers below
//! the pools do is counted where they are, and how records are written down is the business of those who
//! write.

use std::collections::VecDeque;

use rustc_hash::FxHashSet;

use crate::pager::pool::PoolPager;
use crate::residency::stats::Stats;
use crate::residency::time_to_sharp::TimeToSharp;
use crate::table::pool::{PoolId, Slot};

/// The state of a pool after a frame, and what happened in that frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PoolFrame {
    /// The frame.
    pub frame: u64,
    /// The pool.
    pub pool: PoolId,
    /// Counters of this frame alone, and the state at its end.
    pub stats: Stats,
    /// Frames since the newest feedback was drawn; `None` before the first.
    pub feedback_age: Option<u64>,
    /// Of the last 256 tiles that were loaded; `None` before the first.
    pub time_to_sharp: Option<TimeToSharp>,
}

impl PoolPager {
    /// Totals and gauges. Costs a visit of each missing page and of each that is pinned.
    pub fn stats(&self) -> Stats {
        let tails = self.residency.tails();
        let failed = self.failed_pages().count() as u32;
        let missing =
            self.load_order.pages().filter(|&page| self.residency.slot_of(page).is_none()).count() as u32;
        let (pixels, shortfall) = (self.set.pixels(), self.set.shortfall());
        Stats {
            locked: tails + self.slots_pinned(),
            pixels,
            pixels_at_wanted: pixels.saturating_sub(shortfall.pixels),
            levels_short: shortfall.levels,
            wanted: self.set.size_at(0) + tails,
            wanted_at_bias: self.set.size_at(self.bias.bias()) + tails,
            bias_eighths: self.bias.bias(),
            missing: missing - failed,
            failed,
            ..*self.residency.stats()
        }
    }

    /// Slots of pages that the application pins; tails are none of theirs.
    fn slots_pinned(&self) -> u32 {
        let pinned = self.claims.pinned().filter(|&page| !self.textures.is_tail(page));
        let slots = pinned.filter_map(|page| self.residency.slot_of(page));
        if self.residency.sharing().is_empty() {
            return slots.count() as u32;
        }
        slots.collect::<FxHashSet<Slot>>().len() as u32
    }

    /// The frame that has just been played, where `earlier` is what [`PoolPager::stats`] said after the one
    /// before. Costs a visit of each missing page.
    pub fn frame_since(&self, earlier: &Stats) -> PoolFrame {
        let frame = self.residency.frame();
        PoolFrame {
            frame,
            pool: self.pool(),
            stats: self.stats().since(earlier),
            feedback_age: self.newest_feedback.map(|newest| frame.saturating_sub(newest)),
            time_to_sharp: self.residency.waits().percentiles(),
        }
    }
}

/// The records of the last frames, oldest first. Where a frame has as many records as those before, adding
/// one allocates nothing once the history is full.
#[derive(Clone, Debug)]
pub struct History<R> {
    frames: u64,
    records: VecDeque<(u64, R)>,
}

impl<R> History<R> {
    /// Nothing yet; it will hold the records of so many frames, of none where 0.
    pub fn new(frames: u64) -> History<R> {
        History { frames, records: VecDeque::new() }
    }

    /// Frames that the history can hold.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Adds a record of a frame, which is none before the newest, and lets go of the frames that are too long
    /// ago.
    pub fn push(&mut self, frame: u64, record: R) {
        while self.records.front().is_some_and(|(oldest, _)| frame.saturating_sub(*oldest) >= self.frames) {
            self.records.pop_front();
        }
        if self.frames > 0 {
            self.records.push_back((frame, record));
        }
    }

    /// All records, oldest first.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &R> + '_ {
        self.records.iter().map(|(_, record)| record)
    }

    /// The records of the newest frame, in the order in which they came.
    pub fn newest(&self) -> impl Iterator<Item = &R> + '_ {
        let newest = self.records.back().map(|(frame, _)| *frame);
        let first = self.records.partition_point(|(frame, _)| Some(*frame) < newest);
        self.records.range(first..).map(|(_, record)| record)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_history_holds_the_last_frames(frames in 0u64..9, steps in prop::collection::vec((0u64..4, 1usize..4), 0..40)) {
            let mut history = History::new(frames);
            let (mut all, mut now) = (Vec::new(), 0);
            for (step, records) in steps {
                now += step;
                for nth in 0..records {
                    history.push(now, (now, nth));
                    all.push((now, nth));
                }
                let expected: Vec<_> = all.iter().copied().filter(|(frame, _)| frame + frames > now).collect();
                prop_assert_eq!(history.iter().copied().collect::<Vec<_>>(), expected.clone());
                let newest: Vec<_> = expected.into_iter().filter(|(frame, _)| *frame == now).collect();
                prop_assert_eq!(history.newest().copied().collect::<Vec<_>>(), newest);
            }
        }
    }
}
