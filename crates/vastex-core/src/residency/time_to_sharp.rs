//! The time to sharp: how long tiles were waited for, as percentiles over those that came last.

/// Tiles over which the time to sharp is taken.
const WINDOW: usize = 256;

/// Frames from the feedback that first wanted a page, without a break since, to the frame in which its tile
/// is in a slot. Pages that were given up before are not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TimeToSharp {
    /// Half of the tiles took no longer.
    pub p50: u32,
    /// 95 % of the tiles took no longer.
    pub p95: u32,
}

/// How long the tiles that came last were waited for.
#[derive(Clone, Debug)]
pub(crate) struct RecentWaits {
    /// In frames; those of the last tiles, each at its number modulo the length.
    frames: [u32; WINDOW],
    /// Tiles so far.
    noted: usize,
}

impl Default for RecentWaits {
    fn default() -> RecentWaits {
        RecentWaits { frames: [0; WINDOW], noted: 0 }
    }
}

impl RecentWaits {
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_window_holds_the_last_tiles_and_no_others() {
        let mut waits = RecentWaits::default();
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
            let mut waits = RecentWaits::default();
            frames.iter().for_each(|&frames| waits.note(u64::from(frames)));
            let found = waits.percentiles().unwrap();
            for (percent, value) in [(50, found.p50), (95, found.p95)] {
                let enough = |value: u32| {
                    frames.iter().filter(|&&frames| frames <= value).count() * 100 >= frames.len() * percent
                };
                prop_assert!(enough(value) && (value == 0 || !enough(value - 1)), "{percent} %: {value}");
            }
        }
    }
}
