//! What is changed in the window while it runs: how views say what they want, and the theme.

use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};

use super::super::display::SIZE;
use super::{ABOVE, PLACE, Window, mean};

/// Columns of the picture that the machine does not cover, and notices only at their foot.
const BESIDE: std::ops::Range<usize> = SIZE[0] - 160..SIZE[0] - 8;
/// The list of modes of feedback in what the machine does, once that is at its foot, and the second of them.
const FEEDBACK: [usize; 2] = [58, SIZE[1] - 35];
const SECOND: [usize; 2] = [38, SIZE[1] - 84];
/// The columns of the names of the themes, which are the last in the panel, and what the one is written on
/// that is chosen.
const DARK: usize = SIZE[0] - 178;
const LIGHT: usize = SIZE[0] - 128;
const CHOSEN: [u8; 3] = [0, 92, 128];
/// Where the panel shows its ground.
const PANEL: std::ops::Range<usize> = SIZE[0] - 60..SIZE[0] - 20;

impl Window<'_> {
    /// Another mode of feedback: the picture is the same in every moment, until the other mode has it.
    pub(super) fn change_feedback(&mut self) -> Result<()> {
        self.point([FEEDBACK[0], SIZE[1] - 200])?;
        self.turn_wheel(false, 20)?;
        self.settled()?;
        self.click(FEEDBACK)?;
        self.rest()?;
        self.keep("16-modes")?;
        let before = self.beside()?;
        self.click(SECOND)?;
        let begun = Instant::now();
        // Pictures of the mode before are one and the same, and so are those of the other mode.
        let (mut shown, mut others) = (before.clone(), 0);
        loop {
            let seen = self.beside()?;
            if seen != shown {
                others += 1;
                shown = seen;
                // What was seen when it went wrong.
                self.keep("17-feedback")?;
            }
            ensure!(
                others < 2 && is_same(&shown, &before),
                "the picture changes {} ms after the mode of feedback",
                begun.elapsed().as_millis()
            );
            if self
                .title()
                .is_some_and(|title| title.contains("feedback: inline") && !title.contains("as soon"))
            {
                break;
            }
            sleep(Duration::from_millis(5));
            ensure!(begun.elapsed() < super::PATIENCE, "the mode stays; the title is {:?}", self.title());
        }
        self.point(PLACE)?;
        self.settled()?;
        ensure!(is_same(&self.beside()?, &before), "the picture is another one by the other mode");
        self.keep("17-feedback")
    }

    fn beside(&self) -> Result<Vec<u8>> {
        let mut seen = self.display.look(BESIDE)?;
        seen.truncate(4 * BESIDE.len() * ABOVE);
        Ok(seen)
    }

    /// The light theme, and the dark one again.
    pub(super) fn change_theme(&mut self) -> Result<()> {
        self.key("m")?;
        self.point([SIZE[0] - 150, SIZE[1] - 200])?;
        self.rest()?;
        self.turn_wheel(false, 24)?;
        self.rest()?;
        let brightness = |window: &mut Self| window.display.look(PANEL).ok().map(|seen| mean(&seen));
        let dark = brightness(self).context("the display shows nothing")?;
        let row = self.display.lowest(SIZE[0] - 300..SIZE[0] - 8, CHOSEN)?.context("no theme is chosen")? - 8;
        self.click([LIGHT, row])?;
        self.until("a light panel", |window| brightness(window).filter(|light| *light > dark + 80.0))?;
        self.point(PLACE)?;
        self.rest()?;
        self.keep("15-light")?;
        self.click([DARK, row])?;
        self.until("a dark panel", |window| brightness(window).filter(|there| (there - dark).abs() < 5.0))?;
        self.point(PLACE)?;
        self.key("m")
    }

    /// Escape leaves the full screen, and does not end the program.
    pub(super) fn fill_screen(&mut self) -> Result<()> {
        for key in ["F11", "Escape", "f", "f", "F11", "Escape"] {
            self.key(key)?;
            self.rest()?;
            ensure!(self.program.try_wait()?.is_none(), "{key} ends the program in the full screen");
        }
        Ok(())
    }
}

/// Returns true if two pictures are the same, but for what shaders round otherwise.
fn is_same(seen: &[u8], before: &[u8]) -> bool {
    seen.len() == before.len() && seen.iter().zip(before).all(|(one, other)| one.abs_diff(*other) <= 1)
}
