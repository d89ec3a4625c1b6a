//! A volume in the window under the hands of a person: slices, 3-D, modes, channels, and a window at rest.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::super::display::{Display, SIZE};
use super::super::program;
use super::Window;
use crate::shell;

/// What is looked at: a head of three channels.
const VOLUME: &str = "assets/volumes/head.zip";

/// A window that is quick to draw.
const WINDOW: [usize; 2] = [440, 308];
/// The middles of the four pictures: the slices across z and x, that across y, and 3-D.
const SLICES: [[usize; 2]; 3] = [[110, 77], [330, 77], [110, 231]];
const SPACE: [usize; 2] = [330, 231];
/// The middle of the one that is alone, without the panel and beside it.
const ALONE: [[usize; 2]; 2] = [[220, 154], [60, 154]];
/// How much of a picture is looked at, to either side of its middle.
const BESIDE: usize = 55;
/// What is brighter than anything but the volume itself and lines of one pixel, and how many pixels are more
/// than lines.
const BRIGHT: u8 = 140;
const MORE_THAN_LINES: usize = 450;
/// The panel's buttons for pictures and modes, with the panel at the right.
const EMISSION: [usize; 2] = [WINDOW[0] - 106, 195];
const FIRST_CHANNEL: [usize; 2] = [WINDOW[0] - 303, 291];

/// A path that is played as the window opens.
const PATH: &str = "vastex path 1\n0 volume:x=49,y=58,z=47,zoom=1,yaw=30,pitch=20;slices=49,58,40\n\
    0.5 volume:x=49,y=58,z=47,zoom=1.2,yaw=70,pitch=10;slices=49,58,47\n";
/// Rows at the top in which the mode's name and the panel's button stand over the picture.
const OVER: usize = 40;
/// By how much a code of a pixel may differ from `vastex render`'s.
const ROUNDING: u8 = 2;

/// Opens a volume of three channels along a path, goes through its slices, turns it, shows it alone, records
/// a path and plays both, shows it by another mode, hides a channel, and ends. After steps that are quick to
/// draw the window comes to rest.
pub(in super::super) fn use_volume(place: &Path) -> Result<()> {
    let display = Display::start(place)?;
    let size = format!("{}x{}", WINDOW[0], WINDOW[1]);
    let volume = shell::root().join(VOLUME);
    let path = place.join("opening.path");
    fs::write(&path, PATH)?;
    let first = ["--size", &size, "--camera-path", &path.to_string_lossy()];
    Window::hold(&display, place, &volume, &first, Window::look_at_volume)
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
        self.point([88, 94])?;
        self.turn_wheel(true, 5)?;
        self.until("another slice", |window| (window.around(SLICES[0]).ok()? != before).then_some(()))?;
        // A press puts the crosshair, and with it the others.
        let before = self.around(SLICES[1])?;
        self.click([94, 68])?;
        self.until("the slices there", |window| (window.around(SLICES[1]).ok()? != before).then_some(()))?;
        self.costs_nothing()?;
        self.keep("02-slices")?;
        let before = self.around(SPACE)?;
        self.turn([SPACE, [SPACE[0] + 50, SPACE[1] + 16]])?;
        self.until("a volume that was turned", |window| {
            (window.around(SPACE).ok()? != before).then_some(())
        })?;
        self.costs_nothing()?;
        self.keep("03-turned")?;
        self.key("space")?;
        self.until("3-D alone", |window| {
            let bright = window.bright_at(ALONE[0]).ok()?;
            (bright > 8 * MORE_THAN_LINES && window.bright_at([33, 77]).ok()? < MORE_THAN_LINES).then_some(())
        })?;
        self.costs_nothing()?;
        self.keep("04-space")?;
        self.go_along_paths()?;
        self.key("m")?;
        self.rest()?;
        let before = self.around(ALONE[1])?;
        self.click(EMISSION)?;
        self.until("another mode", |window| (window.around(ALONE[1]).ok()? != before).then_some(()))?;
        self.costs_nothing()?;
        self.keep("06-emission")?;
        // The first channel is white, and what lies below it dark in one colour at least.
        let bright = self.bright_at(ALONE[1])?;
        ensure!(bright > 4 * MORE_THAN_LINES, "in emission {bright} pixels are bright");
        self.click(FIRST_CHANNEL)?;
        self.until("one channel fewer", |window| {
            (window.bright_at(ALONE[1]).ok()? < MORE_THAN_LINES).then_some(())
        })?;
        self.costs_nothing()?;
        self.keep("07-channels")?;
        let ended = self.quit()?;
        ensure!(ended.success(), "it ended with {ended}");
        Ok(())
    }

    /// Plays the path of the beginning, records another one and plays that: each ends at the view of its last
    /// line, as `vastex render` draws it.
    fn go_along_paths(&mut self) -> Result<()> {
        self.key("g")?;
        self.key("F9")?;
        self.ends_at(&self.place.join("opening.path"))?;
        self.key("F8")?;
        self.rest()?;
        self.turn([ALONE[0], [ALONE[0][0] - 66, ALONE[0][1] - 22]])?;
        self.rest()?;
        self.key("F8")?;
        let recorded = self.place.join("head-1.path");
        self.until("a path that was recorded", |_| recorded.exists().then_some(()))?;
        self.turn([ALONE[0], [ALONE[0][0] + 33, ALONE[0][1] + 50]])?;
        self.key("F9")?;
        self.ends_at(&recorded)?;
        self.keep("05-along-a-path")?;
        self.key("g")
    }

    /// Waits until the window shows the view of a path's last line, and nothing else.
    fn ends_at(&mut self, path: &Path) -> Result<()> {
        let text = fs::read_to_string(path)?;
        let (_, last) = text.trim_end().rsplit_once(' ').context("a path without a place")?;
        let (picture, size) = (self.place.join("last.rgba"), format!("{}x{}", WINDOW[0], WINDOW[1]));
        let mut render = shell::command(&program().to_string_lossy());
        render.args(["render", VOLUME, "--view", &format!("{last};panes=3d"), "--size", &size]);
        shell::run(render.args(["--format", "raw", "-o"]).arg(&picture))?;
        let drawn = fs::read(&picture)?;
        self.until("the view of a path's last line", |window| {
            let seen = window.display.look(0..WINDOW[0]).ok()?;
            let mut pairs = drawn.chunks_exact(4).zip(seen.chunks_exact(4)).skip(OVER * WINDOW[0]);
            let is_near = |(drawn, seen): (&[u8], &[u8])| {
                (0..3).all(|channel| drawn[channel].abs_diff(seen[2 - channel]) <= ROUNDING)
            };
            pairs.all(is_near).then_some(())
        })
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
