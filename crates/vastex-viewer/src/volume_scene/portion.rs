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
    is_processor: bool,
}

/// How long a device took for what it drew.
#[derive(Clone, Copy, Debug)]
pub(super) struct Took {
    /// From the beginning until the device said, when it was asked, that it was done.
    pub(super) seconds: f64,
    /// So many rows of the full picture; `None` of the small one.
    pub(super) rows: Option<u32>,
    /// True if the device was seen at work on it: it was asked before that, and was not done.
    pub(super) was_waited_for: bool,
}

impl Portion {
    /// A device that is a processor begins with little at once, any other with the whole.
    pub(super) fn new(is_processor: bool) -> Portion {
        match is_processor {
            true => Portion { times: 3, pixels: FIRST_PIXELS, is_processor },
            false => Portion { times: 1, pixels: f64::INFINITY, is_processor },
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

    /// Takes in how long a device took for a part of a picture whose full size is this.
    pub(super) fn took(&mut self, took: Took, size: [u32; 2]) {
        let Took { seconds, rows, was_waited_for } = took;
        // A GPU that is done when it is first asked may have been so long before: the host asks once a frame,
        // and its frames may be slow for other reasons.
        if !self.is_processor && !was_waited_for && seconds >= SHORT {
            return;
        }
        let whole = size.map(f64::from).iter().product::<f64>();
        let Some(rows) = rows else {
            if seconds > LONG {
                self.times = (self.times + 1).min(SMALLEST);
            } else if seconds < SHORT {
                // While it changes, the picture of full size is drawn only where that is done at once: of a
                // part of it the rest would stay what it was.
                let least = if self.pixels < whole { 2 } else { 1 };
                self.times = self.times.saturating_sub(1).max(least);
            }
            return;
        };
        let by = (LONG / seconds.max(1e-4)).clamp(0.25, 2.0);
        let was_whole = self.pixels >= whole;
        // The last part of a picture is smaller, and tells of no more than its own pixels; and however much
        // might have been drawn, no more than the whole was what took long.
        let drawn = f64::from(rows) * f64::from(size[0]);
        let might = if by < 1.0 { self.pixels.min(whole) } else { self.pixels };
        let pixels =
            if drawn < might.min(whole) { (might * by.min(1.0)).max(drawn * by) } else { might * by };
        self.pixels = pixels.max(whole / MOST_PARTS);
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

    /// Draws a part of the full picture, or the small one.
    fn draw(portion: &mut Portion, seconds: f64, is_small: bool, was_waited_for: bool) {
        let rows = if is_small { None } else { Some(portion.rows(SIZE)) };
        portion.took(Took { seconds, rows, was_waited_for }, SIZE);
    }

    #[test]
    fn a_fast_device_draws_the_whole_at_once() {
        let mut portion = Portion::new(false);
        (0..50).for_each(|_| draw(&mut portion, 0.004, false, false));
        assert_eq!((portion.times(), portion.rows(SIZE)), (1, 400));
    }

    #[test]
    fn a_slow_device_draws_less_at_once_whatever_it_is() {
        for is_processor in [false, true] {
            let mut portion = Portion::new(is_processor);
            (0..3).for_each(|_| draw(&mut portion, 0.7, false, true));
            assert_eq!(portion.rows(SIZE), 40, "a tenth, by a processor: {is_processor}");
            assert!(portion.times() > 1, "smaller while it changes");
            (0..9).for_each(|_| draw(&mut portion, 0.7, true, true));
            assert_eq!(portion.times(), SMALLEST);
        }
    }

    /// A host that draws 30 frames a second hears of everything after 33 ms.
    #[test]
    fn a_slow_host_makes_no_gpu_slow() {
        let mut portion = Portion::new(false);
        for seconds in [0.033, 0.1, 0.7] {
            draw(&mut portion, seconds, false, false);
            draw(&mut portion, seconds, true, false);
        }
        assert_eq!((portion.times(), portion.rows(SIZE)), (1, 400));
    }

    /// Of 70 ms for the whole 45 are drawn at once, and the 25 of the rest are no reason to draw more.
    #[test]
    fn the_last_part_of_a_picture_is_not_taken_for_a_full_one() {
        let mut portion = Portion::new(true);
        for _ in 0..20 {
            let mut left = SIZE[1];
            while left > 0 {
                let rows = portion.rows(SIZE).min(left);
                left -= rows;
                let seconds = 0.07 * f64::from(rows) / f64::from(SIZE[1]);
                portion.took(Took { seconds, rows: Some(rows), was_waited_for: true }, SIZE);
            }
        }
        assert!((250..270).contains(&portion.rows(SIZE)), "{}", portion.rows(SIZE));
    }

    #[test]
    fn a_device_that_becomes_fast_draws_the_whole_again() {
        let mut portion = Portion::new(false);
        draw(&mut portion, 0.7, false, true);
        assert_eq!((portion.times(), portion.rows(SIZE)), (2, 100));
        // Not at its full size before that is drawn at once.
        draw(&mut portion, 0.004, true, false);
        assert_eq!(portion.times(), 2);
        (0..4).for_each(|_| draw(&mut portion, 0.004, false, false));
        assert_eq!((portion.times(), portion.rows(SIZE)), (1, 400));
        // And from there it is as careful as before.
        (0..20).for_each(|_| draw(&mut portion, 0.004, false, false));
        draw(&mut portion, 0.7, false, true);
        assert_eq!((portion.times(), portion.rows(SIZE)), (2, 100));
    }

    #[test]
    fn a_picture_without_pixels_is_one_row() {
        let mut portion = Portion::new(false);
        portion.took(Took { seconds: 0.7, rows: Some(1), was_waited_for: true }, [0, 0]);
        assert_eq!(portion.rows([0, 0]), 1);
    }
}
