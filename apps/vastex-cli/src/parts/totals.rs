//! How a picture in parts came about: of all its parts together, as of one that is drawn at once.

use std::collections::BTreeSet;

use vastex::PageId;
use vastex::diagnostics::{FrameStats, Stats};
use vastex_scenes::Outcome;

/// How the parts of a picture came about, as far as they are drawn.
///
/// What is counted from the beginning of a run on (loads, evictions, bytes, frames) is so already. What is
/// measured of a view is summed over the parts (wanted pages, pixels), so that a page which two parts want
/// counts for both; of the mip bias and of what is in memory it is the most.
#[derive(Clone, Debug)]
pub(crate) struct Totals {
    outcome: Outcome,
    parts: u32,
    /// Pages that could not be had for any of them.
    failed: BTreeSet<PageId>,
}

impl Totals {
    /// Of a picture of which nothing is drawn yet.
    pub(crate) fn new(stats: FrameStats) -> Totals {
        Totals { outcome: Outcome { converged: true, stats }, parts: 0, failed: BTreeSet::new() }
    }

    /// Adds a part, with the pages in view of it that could not be had.
    pub(crate) fn add(&mut self, drawn: Outcome, failed: Vec<PageId>) {
        let before = std::mem::replace(&mut self.outcome, drawn);
        self.outcome.converged &= before.converged;
        self.failed.extend(failed);
        if self.parts > 0 {
            let stats = &mut self.outcome.stats;
            stats.degenerate_pixels = stats.degenerate_pixels.saturating_add(before.stats.degenerate_pixels);
            stats.pool_bytes = stats.pool_bytes.max(before.stats.pool_bytes);
            add(&mut stats.pager, &before.stats.pager);
        }
        self.outcome.stats.pager.failed = u32::try_from(self.failed.len()).unwrap_or(u32::MAX);
        self.parts += 1;
    }

    /// Adds the parts of another picture of the same run.
    pub(crate) fn follow(&mut self, next: Totals) {
        let parts = self.parts + next.parts;
        self.add(next.outcome, next.failed.into_iter().collect());
        self.parts = parts;
    }

    /// How all of them came about.
    pub(crate) fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    /// How many there are.
    pub(crate) fn parts(&self) -> u32 {
        self.parts
    }

    /// Share of the pixels that were asked what they want whose page was there when their part was drawn, at
    /// mip bias 0.
    pub(crate) fn share_at_wanted_level(&self) -> f64 {
        let Stats { pixels, pixels_at_wanted, bias_eighths, .. } = self.outcome.stats.pager;
        match pixels {
            _ if self.outcome.converged && bias_eighths == 0 => 1.0,
            0 => 1.0,
            pixels => pixels_at_wanted as f64 / pixels as f64,
        }
    }
}

/// Adds what was measured of parts before.
fn add(stats: &mut Stats, before: &Stats) {
    for (sum, part) in [
        (&mut stats.wanted, before.wanted),
        (&mut stats.wanted_at_bias, before.wanted_at_bias),
        (&mut stats.missing, before.missing),
    ] {
        *sum = sum.saturating_add(part);
    }
    for (sum, part) in [
        (&mut stats.pixels, before.pixels),
        (&mut stats.pixels_at_wanted, before.pixels_at_wanted),
        (&mut stats.levels_short, before.levels_short),
    ] {
        *sum = sum.saturating_add(part);
    }
    stats.bias_eighths = stats.bias_eighths.max(before.bias_eighths);
    stats.occupied = stats.occupied.max(before.occupied);
    stats.resident = stats.resident.max(before.resident);
    stats.slots = stats.slots.max(before.slots);
}

#[cfg(test)]
mod tests {
    use vastex::{Dims, PagePos, TextureNumber};

    use super::*;

    fn page(x: u32) -> PageId {
        let pos = PagePos { level: 0, x, y: 0, z: 0 };
        PageId::new(TextureNumber::new(0).unwrap(), Dims::D2, pos).unwrap()
    }

    fn part(converged: bool, pager: Stats, degenerate_pixels: u32) -> Outcome {
        Outcome { converged, stats: FrameStats { pager, degenerate_pixels, ..FrameStats::default() } }
    }

    /// The last part is the easy one: nothing of it may stand for the others.
    #[test]
    fn a_picture_is_as_good_as_its_worst_part_and_counts_what_all_of_them_want() {
        let before = Stats { wanted: 900, loaded: 3, ..Stats::default() };
        let mut totals = Totals::new(FrameStats { pager: before, ..FrameStats::default() });
        let hard = Stats {
            wanted: 100,
            missing: 4,
            bias_eighths: 9,
            occupied: 60,
            loaded: 70,
            pixels: 300,
            pixels_at_wanted: 150,
            failed: 2,
            ..Stats::default()
        };
        totals.add(part(false, hard, 5), vec![page(1), page(2)]);
        let easy = Stats {
            wanted: 10,
            occupied: 50,
            loaded: 75,
            evicted: 20,
            pixels: 100,
            pixels_at_wanted: 100,
            failed: 1,
            ..Stats::default()
        };
        totals.add(part(true, easy, 1), vec![page(2)]);
        assert_eq!((totals.parts(), totals.outcome().converged), (2, false));
        let FrameStats { pager, degenerate_pixels, .. } = &totals.outcome().stats;
        assert_eq!((pager.wanted, pager.missing, pager.failed, *degenerate_pixels), (110, 4, 2, 6));
        assert_eq!((pager.bias_eighths, pager.occupied), (9, 60));
        assert_eq!((pager.loaded, pager.evicted), (75, 20), "counted from the beginning on");
        assert!((totals.share_at_wanted_level() - 250.0 / 400.0).abs() < 1e-12);
        let mut next = Totals::new(FrameStats::default());
        next.add(part(true, easy, 0), vec![page(3)]);
        totals.follow(next);
        let pager = totals.outcome().stats.pager;
        assert_eq!((totals.parts(), pager.wanted, pager.failed, pager.bias_eighths), (3, 120, 3, 9));
    }

    #[test]
    fn a_picture_all_of_which_is_there_is_at_the_level_that_it_wants() {
        let mut totals = Totals::new(FrameStats::default());
        // Some pixels came before their pages.
        let stats = Stats { pixels: 10, pixels_at_wanted: 9, ..Stats::default() };
        totals.add(part(true, stats, 0), Vec::new());
        assert_eq!(totals.share_at_wanted_level(), 1.0);
        assert_eq!(Totals::new(FrameStats::default()).share_at_wanted_level(), 1.0);
    }
}
