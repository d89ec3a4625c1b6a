//! Telemetry: how each pool stood after each of the last frames.
//!
//! [`PoolFrame`] is one pool after one frame, [`History`] keeps those of the last frames. Everything follows from what the pager
//! counts anyway; time is in frames, since there is no clock here. What the tiers below the pools do is counted where they
//! are, and how records are written down is the business of those who write.

use std::collections::VecDeque;

use rustc_hash::FxHashSet;

use crate::pager::Pager;
use crate::pool::{PoolId, Slot};
use crate::stats::Stats;

/// Tiles over which the time to sharp is taken.
const WINDOW: usize = 256;

/// How a pool stood after a frame, and what happened in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PoolFrame {
    /// The frame.
    pub frame: u64,
    /// The pool.
    pub pool: PoolId,
    /// What is counted, of this frame alone; what is measured, as it stood at its end.
    pub stats: Stats,
    /// Frames since the newest feedback was drawn; nothing before the first.
    pub feedback_age: Option<u64>,
    /// Of the last 256 tiles that came; nothing before the first.
    pub time_to_sharp: Option<TimeToSharp>,
}

/// Frames from the feedback that first wanted a page, without a break since, to the frame in which its tile is in a slot.
/// Pages that were given up before are not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TimeToSharp {
    /// Half of the tiles took no longer.
    pub p50: u32,
    /// 95 % of the tiles took no longer.
    pub p95: u32,
}

impl Pager {
    /// Totals and gauges. Costs a visit of each missing page and of each that is pinned by hand.
    pub fn stats(&self) -> Stats {
        let pins = self.residency.stats.pinned;
        let failed = self.failed_pages().count() as u32;
        let missing =
            self.order.iter().filter(|&&page| self.residency.slot_of(page).is_none()).count() as u32;
        let (pixels, shortfall) = (self.set.pixels(), self.set.shortfall());
        Stats {
            locked: pins + self.slots_pinned_by_hand(),
            pixels,
            pixels_at_wanted: pixels.saturating_sub(shortfall.pixels),
            levels_short: shortfall.levels,
            wanted: self.set.size_at(0) + pins,
            wanted_at_bias: self.set.size_at(self.bias.bias()) + pins,
            bias_eighths: self.bias.bias(),
            missing: missing - failed,
            failed,
            ..self.residency.stats
        }
    }

    /// Slots of pages that are pinned by hand; tails are none of theirs.
    fn slots_pinned_by_hand(&self) -> u32 {
        let pinned = self.residency.tickets.pinned().filter(|&page| !self.textures.is_tail(page));
        let slots = pinned.filter_map(|page| self.residency.slot_of(page));
        if self.residency.sharing.is_empty() {
            return slots.count() as u32;
        }
        slots.collect::<FxHashSet<Slot>>().len() as u32
    }

    /// The frame that has just been played, where `earlier` is what [`Pager::stats`] said after the one before. Costs a visit
    /// of each missing page.
    pub fn frame_since(&self, earlier: &Stats) -> PoolFrame {
        let frame = self.residency.frame;
        PoolFrame {
            frame,
            pool: self.pool(),
            stats: self.stats().since(earlier),
            feedback_age: self.newest_feedback.map(|newest| frame.saturating_sub(newest)),
            time_to_sharp: self.residency.waits.percentiles(),
        }
    }
}

/// How long the tiles that came last were waited for.
#[derive(Clone, Debug)]
pub(crate) struct Waits {
    /// In frames; those of the last tiles, each at its number modulo the length.
    frames: [u32; WINDOW],
    /// Tiles so far.
    noted: usize,
}

impl Default for Waits {
    fn default() -> Waits {
        Waits { frames: [0; WINDOW], noted: 0 }
    }
}

impl Waits {
    pub(crate) fn note(&mut self, frames: u64) {
        self.frames[self.noted % WINDOW] = u32::try_from(frames).unwrap_or(u32::MAX);
        self.noted += 1;
    }

    pub(crate) fn percentiles(&self) -> Option<TimeToSharp> {
        let mut sorted = self.frames;
        let sorted = &mut sorted[..self.noted.min(WINDOW)];
        sorted.sort_unstable();
        let no_longer = |percent: usize| sorted.get((sorted.len() * percent).div_ceil(100).checked_sub(1)?);
        Some(TimeToSharp { p50: *no_longer(50)?, p95: *no_longer(95)? })
    }
}

/// The records of the last frames, oldest first. Where a frame has as many records as those before, adding one allocates
/// nothing once the history is full.
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

    /// Frames that it can hold.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Adds a record of a frame, which is none before the newest, and lets go of the frames that are too long ago.
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

    #[test]
    fn the_window_holds_the_last_tiles_and_no_others() {
        let mut waits = Waits::default();
        assert_eq!(waits.percentiles(), None);
        waits.note(7);
        assert_eq!(waits.percentiles(), Some(TimeToSharp { p50: 7, p95: 7 }));
        (1..=100).for_each(|frames| waits.note(frames));
        (0..WINDOW as u64).for_each(|_| waits.note(3));
        assert_eq!(waits.percentiles(), Some(TimeToSharp { p50: 3, p95: 3 }));
        waits.note(u64::MAX);
        assert_eq!(waits.percentiles(), Some(TimeToSharp { p50: 3, p95: 3 }));
        (0..13).for_each(|_| waits.note(u64::MAX));
        assert_eq!(
            waits.percentiles(),
            Some(TimeToSharp { p50: 3, p95: u32::MAX }),
            "14 of 256 are over 5 %"
        );
    }

    proptest! {
        #[test]
        fn a_percentile_is_the_least_that_so_many_keep_to(frames in prop::collection::vec(0u32..50, 1..256)) {
            let mut waits = Waits::default();
            frames.iter().for_each(|&frames| waits.note(u64::from(frames)));
            let found = waits.percentiles().unwrap();
            for (percent, value) in [(50, found.p50), (95, found.p95)] {
                let enough = |value: u32| {
                    frames.iter().filter(|&&frames| frames <= value).count() * 100 >= frames.len() * percent
                };
                prop_assert!(enough(value) && (value == 0 || !enough(value - 1)), "{percent} %: {value}");
            }
        }

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
