//! A volume in the window under the hands of a person: slices, 3-D, modes, channels, and a window at rest.

use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use anyhow::{Context, Result, ensure};

use super::super::display::{Display, SIZE};
use super::Window;

/// A window that is quick to draw.
const WINDOW: [usize; 2] = [800, 560];
/// The middles of the four pictures: the slices across z and x, that across y, and 3-D.
const SLICES: [[usize; 2]; 3] = [[200, 140], [600, 140], [200, 420]];
const SPACE: [usize; 2] = [600, 420];
/// The middle of the one that is alone, without the panel and beside it.
const ALONE: [[usize; 2]; 2] = [[400, 280], [240, 280]];
/// How much of a picture is looked at, to either side of its middle.
const BESIDE: usize = 100;
/// What is brighter than anything but the volume itself and lines of one pixel, and how many pixels are more
/// than lines.
const BRIGHT: u8 = 140;
const MORE_THAN_LINES: usize = 1200;
/// The panel's buttons for pictures and modes, with the panel at the right.
const EMISSION: [usize; 2] = [WINDOW[0] - 106, 195];
const FIRST_CHANNEL: [usize; 2] = [WINDOW[0] - 303, 291];

/// Opens a volume of three channels, goes through its slices, turns it, shows it alone and by another mode,
/// hides a channel, and ends. After steps that are quick to draw the window comes to rest.
pub(in super::super) fn use_volume(place: &Path, program: &Path, volume: &Path) -> Result<()> {
    let place = place.join("volume");
    fs::create_dir_all(place.join("steps"))?;
    let display = Display::start(&place)?;
    let size = format!("{}x{}", WINDOW[0], WINDOW[1]);
    let mut window = Window::open(&display, (&place, program, volume), &["--size", &size])?;
    let used = window.look_at_volume();
    if used.is_err() {
        // What was seen when it went wrong.
        drop(window.keep("99-failed"));
    }
    let said = || fs::read_to_string(place.join("hands.txt")).unwrap_or_default();
    used.with_context(|| format!("a volume under a person's hands; the window said: {}", said()))
}

impl Window<'_> {
    fn look_at_volume(&mut self) -> Result<()> {
        self.until("four pictures", |window| {
            let all = SLICES.iter().chain([&SPACE]);
            let seen: Result<Vec<usize>> = all.map(|middle| window.bright_at(*middle)).collect();
            seen.ok()?.iter().all(|bright| *bright > MORE_THAN_LINES).then_some(())
        })?;
        self.costs_nothing()?;
        self.keep("01-open")?;
        // The wheel goes through the slices of one picture.
        let before = self.around(SLICES[0])?;
        self.point([160, 170])?;
        (0..5).try_for_each(|_| self.xdotool(&["click", "4"]).map(drop))?;
        self.until("another slice", |window| (window.around(SLICES[0]).ok()? != before).then_some(()))?;
        // A press puts the crosshair, and with it the others.
        let before = self.around(SLICES[1])?;
        self.click([170, 125])?;
        self.until("the slices there", |window| (window.around(SLICES[1]).ok()? != before).then_some(()))?;
        self.costs_nothing()?;
        self.keep("02-slices")?;
        let before = self.around(SPACE)?;
        self.point(SPACE)?;
        self.xdotool(&["mousedown", "1"])?;
        for step in 1..=6 {
            self.point([SPACE[0] + 15 * step, SPACE[1] + 5 * step])?;
            sleep(Duration::from_millis(30));
        }
        self.xdotool(&["mouseup", "1"])?;
        self.until("a volume that was turned", |window| {
            (window.around(SPACE).ok()? != before).then_some(())
        })?;
        self.costs_nothing()?;
        self.keep("03-turned")?;
        self.key("space")?;
        self.until("3-D alone", |window| {
            let bright = window.bright_at(ALONE[0]).ok()?;
            (bright > 8 * MORE_THAN_LINES && window.bright_at([60, 140]).ok()? < MORE_THAN_LINES)
                .then_some(())
        })?;
        self.costs_nothing()?;
        self.keep("04-space")?;
        self.key("m")?;
        sleep(Duration::from_millis(800));
        let before = self.around(ALONE[1])?;
        self.click(EMISSION)?;
        self.until("another mode", |window| (window.around(ALONE[1]).ok()? != before).then_some(()))?;
        self.keep("05-emission")?;
        let before = self.around(ALONE[1])?;
        self.click(FIRST_CHANNEL)?;
        self.until("one channel fewer", |window| (window.around(ALONE[1]).ok()? != before).then_some(()))?;
        self.keep("06-channels")?;
        let ended = self.quit()?;
        ensure!(ended.success(), "it ended with {ended}");
        Ok(())
    }

    /// The pixels around a place.
    fn around(&self, [x, y]: [usize; 2]) -> Result<Vec<u8>> {
        let columns = x.saturating_sub(BESIDE)..(x + BESIDE).min(SIZE[0]);
        let width = columns.len() * 4;
        let seen = self.display.look(columns)?;
        let rows = y.saturating_sub(BESIDE)..(y + BESIDE).min(SIZE[1]);
        Ok(seen[rows.start * width..rows.end * width].to_vec())
    }

    /// How many of them are bright.
    fn bright_at(&self, middle: [usize; 2]) -> Result<usize> {
        let seen = self.around(middle)?;
        Ok(seen.chunks_exact(4).filter(|pixel| pixel[..3].iter().all(|code| *code > BRIGHT)).count())
    }
}
