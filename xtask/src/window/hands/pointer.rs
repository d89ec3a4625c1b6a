//! What a hand does with the pointer: moves it, presses, drags, turns and clicks.

use std::thread::sleep;

use anyhow::Result;

use super::{EVERY, Window};

impl Window<'_> {
    /// Presses at a place and lets go at another one, as fast as hands are: what is dragged goes on.
    pub(super) fn drag(&self, places: [[usize; 2]; 2]) -> Result<()> {
        self.take_along(places)?;
        self.xdotool(&["mouseup", "1"]).map(drop)
    }

    /// Presses at a place and lets go at another one after a pause there, so that nothing goes on.
    pub(super) fn turn(&mut self, places: [[usize; 2]; 2]) -> Result<()> {
        self.take_along(places)?;
        self.rest()?;
        self.xdotool(&["mouseup", "1"]).map(drop)
    }

    fn take_along(&self, [from, to]: [[usize; 2]; 2]) -> Result<()> {
        const STEPS: usize = 4;
        self.point(from)?;
        self.xdotool(&["mousedown", "1"])?;
        for step in 1..=STEPS {
            let between = |axis: usize| (from[axis] * (STEPS - step) + to[axis] * step) / STEPS;
            self.point([between(0), between(1)])?;
            sleep(EVERY);
        }
        Ok(())
    }

    /// Notches of the wheel, upwards or downwards, one after the other.
    pub(super) fn turn_wheel(&self, is_upwards: bool, notches: usize) -> Result<()> {
        let button = if is_upwards { "4" } else { "5" };
        self.xdotool(&["click", "--repeat", &notches.to_string(), "--delay", "15", button]).map(drop)
    }

    pub(super) fn point(&self, [x, y]: [usize; 2]) -> Result<()> {
        self.xdotool(&["mousemove", &x.to_string(), &y.to_string()]).map(drop)
    }

    pub(super) fn click(&mut self, place: [usize; 2]) -> Result<()> {
        self.point(place)?;
        // The panel hears of the move in the frame before the press.
        self.rest()?;
        self.xdotool(&["click", "1"]).map(drop)
    }
}
