//! A window on a screen of twice as many pixels as are usual, and the files of a folder in it: what is drawn
//! has the screen's pixels, texels and pixels are even at 1:1, and what is written is twice as large.

use std::fs;
use std::path::Path;

use anyhow::{Result, ensure};

use super::super::display::{Display, SIZE};
use super::super::png;
use super::{PLACE, Window};

/// Columns and rows of the images.
const IMAGE: [usize; 2] = [1200, 900];
/// A smaller window, of which larger pictures are written.
const SMALL: [usize; 2] = [320, 200];
/// Pixels of a point.
const SCALE: usize = 2;
/// Columns of the panel, which has 320 points.
const PANEL: usize = SCALE * 320;
/// By how much a code of a pixel may differ from its texel's: places have few bits.
const ROUNDING: u8 = 1;
/// Where the pointer is, beside the columns that are looked at.
const AT: [usize; 2] = [520, 224];
/// The rows that are looked at: below the panel's button, and above the line at the foot.
const ROWS: std::ops::Range<usize> = 200..320;

/// Opens an image of a folder of two, looks at it at 1:1, opens the panel, goes to the other image and back,
/// and has pictures of the window written at two and four times its size.
pub(in super::super) fn use_dense_screen(place: &Path) -> Result<()> {
    let folder = place.join("folder");
    fs::create_dir_all(&folder)?;
    for (name, blue) in [("one.png", 0), ("two.png", 200)] {
        // Columns and rows in stripes of one texel.
        let texel = |n: usize| [(n % IMAGE[0] % 2 * 255) as u8, (n / IMAGE[0] % 2 * 255) as u8, blue];
        let rgb: Vec<u8> = (0..IMAGE[0] * IMAGE[1]).flat_map(texel).collect();
        png::write(&folder.join(name), IMAGE, &rgb)?;
    }
    let mut display = Display::start(place)?;
    display.scale = SCALE;
    let size = format!("{}x{}", SIZE[0], SIZE[1]);
    Window::hold(&display, place, &folder.join("one.png"), &["--size", &size], Window::look_at_folder)
}

impl Window<'_> {
    fn look_at_folder(&mut self) -> Result<()> {
        self.point(AT)?;
        self.until("the image", |window| {
            window.title().filter(|title| !title.contains("opening") && title.contains(": "))
        })?;
        self.key("1")?;
        self.until("a texel to a pixel", |window| {
            window.magnification().ok().filter(|there| *there == 100.0)
        })?;
        self.settled()?;
        self.keep("01-even")?;
        let texel = self.texel()?;
        self.point([AT[0] - 60, AT[1] + 45])?;
        let beside = self.texel_until("another texel", |there| there != texel)?;
        ensure!(
            beside == [texel[0] - 60, texel[1] + 45],
            "60 pixels left of and 45 below {texel:?} lies {beside:?}"
        );
        self.are_stripes()?;
        self.open_wide_panel()?;
        for (key, name) in [("n", "two.png"), ("p", "one.png"), ("Next", "two.png"), ("Prior", "one.png")] {
            self.key(key)?;
            self.until(name, |window| window.title().filter(|title| title.contains(name)))?;
            self.until("its texels", |window| window.texel().ok())?;
        }
        self.settled()?;
        // Few pixels take less long to draw.
        self.resize(SMALL)?;
        self.settled()?;
        self.take_picture("F6", SMALL.map(|side| 2 * side), "03-twice")?;
        self.take_picture("F7", SMALL.map(|side| 4 * side), "04-four-times")?;
        let ended = self.quit()?;
        ensure!(ended.success(), "it ended with {ended}");
        Ok(())
    }

    /// Each column and each row of pixels shows one of texels: nothing is mixed.
    fn are_stripes(&self) -> Result<()> {
        let columns = 100..400;
        let seen = self.display.look(columns.clone())?;
        let rows = seen.chunks_exact(4 * columns.len()).skip(ROWS.start).take(ROWS.len());
        let rows: Vec<&[u8]> = rows.collect();
        let at = |x: usize, y: usize| [rows[y][4 * x + 2], rows[y][4 * x + 1]];
        let first = at(0, 0);
        for y in 0..rows.len() {
            for x in 0..columns.len() {
                let turned = |value: u8, by: usize| if by.is_multiple_of(2) { value } else { 255 - value };
                let wanted = [turned(first[0], x), turned(first[1], y)];
                let is_it =
                    at(x, y).iter().zip(wanted).all(|(code, wanted)| code.abs_diff(wanted) <= ROUNDING);
                ensure!(is_it, "at {x}, {y} is {:?} for {wanted:?}", at(x, y));
            }
        }
        Ok(())
    }

    /// The panel is as wide as its points are, and hides itself again.
    fn open_wide_panel(&mut self) -> Result<()> {
        let edge = SIZE[0] - PANEL;
        let look = |window: &Self| -> Option<Vec<u8>> {
            let columns = edge + 8..edge + 60;
            let seen = window.display.look(columns.clone()).ok()?;
            Some(
                seen.chunks_exact(4 * columns.len())
                    .skip(ROWS.start)
                    .take(ROWS.len())
                    .flatten()
                    .copied()
                    .collect(),
            )
        };
        let before = look(self);
        self.key("m")?;
        self.until("the panel", |window| look(window).filter(|_| look(window) != before))?;
        self.settled()?;
        self.keep("02-panel")?;
        self.are_stripes_left_of(edge)?;
        self.point(PLACE)?;
        self.key("m")?;
        self.until("no panel", |window| look(window).filter(|_| look(window) == before))?;
        Ok(())
    }

    /// The picture reaches to the panel.
    fn are_stripes_left_of(&self, edge: usize) -> Result<()> {
        let columns = edge - 40..edge - 8;
        let seen = self.display.look(columns.clone())?;
        let row = seen.chunks_exact(4 * columns.len()).nth(ROWS.start).unwrap_or_default();
        let reds: Vec<u8> = row.chunks_exact(4).map(|pixel| pixel[2]).collect();
        let are_turned = |[one, next]: &[u8; 2]| one.abs_diff(255 - next) <= ROUNDING;
        ensure!(reds.array_windows().all(are_turned), "beside the panel lie {reds:?}");
        Ok(())
    }
}
