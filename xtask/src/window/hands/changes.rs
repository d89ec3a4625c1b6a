//! What is changed in the window while it runs: how views say what they want, the theme, the scene in a small
//! window, and a picture that is taken of it.

use std::fs;
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};

use super::super::display::SIZE;
use super::{PLACE, Window, mean};

/// Columns of the picture that neither the machine nor a notice covers.
const BESIDE: std::ops::Range<usize> = 1080..SIZE[0] - 8;
/// The list of modes of feedback in what the machine does, once that is at its foot, and the second of them.
const FEEDBACK: [usize; 2] = [58, 765];
const SECOND: [usize; 2] = [38, 716];
/// The columns of the names of the themes, which are the last in the panel, and what the one is written on
/// that is chosen.
const DARK: usize = 1102;
const LIGHT: usize = 1152;
const CHOSEN: [u8; 3] = [0, 92, 128];
/// Where the panel shows its ground.
const PANEL: std::ops::Range<usize> = SIZE[0] - 60..SIZE[0] - 20;
/// A window that is quick to draw.
const SMALL: [usize; 2] = [420, 280];

impl Window<'_> {
    /// Another mode of feedback: the picture is the same in every moment, until the other mode has it.
    pub(super) fn change_feedback(&mut self) -> Result<()> {
        self.point([FEEDBACK[0], 500])?;
        (0..10).try_for_each(|_| self.xdotool(&["click", "5"]).map(drop))?;
        self.settled()?;
        self.click(FEEDBACK)?;
        sleep(Duration::from_millis(500));
        self.keep("14-modes")?;
        let before = self.display.look(BESIDE)?;
        self.click(SECOND)?;
        let begun = Instant::now();
        loop {
            let seen = self.display.look(BESIDE)?;
            if seen != before {
                // What was seen when it went wrong.
                self.keep("15-feedback")?;
            }
            ensure!(
                seen == before,
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
        ensure!(self.display.look(BESIDE)? == before, "the picture is another one by the other mode");
        self.keep("15-feedback")
    }

    /// The light theme, and the dark one again.
    pub(super) fn change_theme(&mut self) -> Result<()> {
        self.key("m")?;
        self.point([SIZE[0] - 150, 600])?;
        sleep(Duration::from_millis(300));
        (0..20).try_for_each(|_| self.xdotool(&["click", "5"]).map(drop))?;
        sleep(Duration::from_millis(500));
        let brightness = |window: &mut Self| window.display.look(PANEL).ok().map(|seen| mean(&seen));
        let dark = brightness(self).context("the display shows nothing")?;
        let row = self.display.lowest(SIZE[0] - 300..SIZE[0] - 8, CHOSEN)?.context("no theme is chosen")? - 8;
        self.click([LIGHT, row])?;
        self.until("a light panel", |window| brightness(window).filter(|light| *light > dark + 80.0))?;
        self.point(PLACE)?;
        sleep(Duration::from_millis(500));
        self.keep("16-light")?;
        self.click([DARK, row])?;
        self.until("a dark panel", |window| brightness(window).filter(|there| (there - dark).abs() < 5.0))?;
        self.point(PLACE)?;
        self.key("m")
    }

    /// A planet in a small window, of which a picture is taken, and the image in the large one again.
    pub(super) fn see_planet(&mut self) -> Result<()> {
        let magnification = self.magnification()?;
        self.key("u")?;
        self.resize(SMALL)?;
        self.key("F10")?;
        self.until("a planet", |window| window.title().filter(|title| title.contains("planet")))?;
        self.settled()?;
        self.keep("17-planet")?;
        self.key("F5")?;
        let place = self.place.clone();
        let picture = self.until("a picture of the window", |window| {
            let title = window.title()?;
            let name = title.split("the picture is ").nth(1)?.trim().to_owned();
            fs::read(place.join(name)).ok()
        })?;
        let side = |at: usize| Some(u32::from_be_bytes(picture.get(at..at + 4)?.try_into().ok()?) as usize);
        ensure!(
            [side(16), side(20)] == SMALL.map(Some),
            "the picture has {:?} pixels, the window {SMALL:?}",
            [side(16), side(20)]
        );
        fs::write(place.join("steps/18-picture.png"), picture)?;
        self.key("F1")?;
        self.resize(SIZE)?;
        self.until("the image as it was", |window| {
            window.magnification().ok().filter(|there| *there == magnification)
        })?;
        self.key("u")
    }

    fn resize(&self, [width, height]: [usize; 2]) -> Result<()> {
        let (width, height) = (width.to_string(), height.to_string());
        self.xdotool(&["windowsize", "--sync", &self.id, &width, &height]).map(drop)
    }
}
