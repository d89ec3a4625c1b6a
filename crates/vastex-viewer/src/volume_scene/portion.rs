//! How much of a picture is drawn at once: so much that no frame takes long, by how long the last ones took.

/// Seconds that the pictures of a frame are to take at most, and below which more can be drawn in one.
const LONG: f64 = 0.045;
const SHORT: f64 = 0.02;
/// How many times smaller along each side pictures are drawn at most.
const SMALLEST: u32 = 6;
/// Pixels that a processor draws at once at first, and into how many parts a picture is divided at most.
const FIRST_PIXELS: f64 = 30_000.0;
const MOST_PARTS: f64 = 10.0;

/// How much of a picture is drawn at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Portion {
    /// How many times smaller along each side it is drawn while what is seen changes.
    times: u32,
    /// How many pixels at once where that stays: infinitely many until the whole has taken long.
    pixels: f64,
}

impl Portion {
    /// A device that is a processor begins with little at once, any other with the whole.
    pub(super) fn new(is_processor: bool) -> Portion {
        match is_processor {
            true => Portion { times: 3, pixels: FIRST_PIXELS },
            false => Portion { times: 1, pixels: f64::INFINITY },
        }
    }

    /// How many times smaller along each side a picture is drawn while what is seen changes.
    pub(super) fn times(&self) -> u32 {
        self.times
    }

    /// How many rows of a picture of this size are drawn at once.
    pub(super) fn rows(&self, [width, height]: [u32; 2]) -> u32 {
        (self.pixels / f64::from(width.max(1))).ceil().clamp(1.0, f64::from(height.max(1))) as u32
    }

    /// Notes how many seconds the last draw took: of the small picture, or of [`rows`](Self::rows) rows of
    /// the full one, whose size this is.
    pub(super) fn took(&mut self, seconds: f64, was_small: bool, size: [u32; 2]) {
        let whole = size.map(f64::from).iter().product::<f64>();
        if was_small {
            if seconds > LONG {
                self.times = (self.times + 1).min(SMALLEST);
            } else if seconds < SHORT {
                // While it changes, the picture of full size is drawn only where that is done at once: of a
                // part of it the rest would stay what it was.
                let least = if self.pixels < whole { 2 } else { 1 };
                self.times = self.times.saturating_sub(1).max(least);
            }
            return;
        }
        let by = (LONG / seconds.max(1e-4)).clamp(0.25, 2.0);
        let was_whole = self.pixels >= whole;
        // However much might have been drawn, no more than the whole was what took long.
        let drawn = if by < 1.0 { self.pixels.min(whole) } else { self.pixels };
        self.pixels = (drawn * by).max(whole / MOST_PARTS);
        if by < 1.0 && was_whole {
            self.times = self.times.max(2);
        }
        // So fast that the whole is drawn also while it changes.
        if self.pixels.is_finite() && self.pixels > 2.0 * whole && seconds < SHORT {
            self.times = 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [640, 400];

    #[test]
    fn a_fast_device_draws_the_whole_at_once() {
        let mut portion = Portion::new(false);
        (0..50).for_each(|_| portion.took(0.004, false, SIZE));
        assert_eq!((portion.times(), portion.rows(SIZE)), (1, 400));
    }

    #[test]
    fn a_slow_device_draws_less_at_once_whatever_it_is() {
        for is_processor in [false, true] {
            let mut portion = Portion::new(is_processor);
            (0..3).for_each(|_| portion.took(0.7, false, SIZE));
            assert_eq!(portion.rows(SIZE), 40, "a tenth, by a processor: {is_processor}");
            assert!(portion.times() > 1, "smaller while it changes");
            (0..9).for_each(|_| portion.took(0.7, true, SIZE));
            assert_eq!(portion.times(), SMALLEST);
        }
    }

    /// One slow picture, which shaders may have been compiled for, is not held against a device.
    #[test]
    fn a_device_that_becomes_fast_draws_the_whole_again() {
        let mut portion = Portion::new(false);
        portion.took(0.7, false, SIZE);
        assert_eq!((portion.times(), portion.rows(SIZE)), (2, 100));
        // Not at its full size before that is drawn at once.
        portion.took(0.004, true, SIZE);
        assert_eq!(portion.times(), 2);
        (0..4).for_each(|_| portion.took(0.004, false, SIZE));
        assert_eq!((portion.times(), portion.rows(SIZE)), (1, 400));
        // And from there it is as careful as before.
        (0..20).for_each(|_| portion.took(0.004, false, SIZE));
        portion.took(0.7, false, SIZE);
        assert_eq!((portion.times(), portion.rows(SIZE)), (2, 100));
    }

    #[test]
    fn a_picture_without_pixels_is_one_row() {
        let mut portion = Portion::new(false);
        portion.took(0.7, false, [0, 0]);
        assert_eq!(portion.rows([0, 0]), 1);
    }
}
