//! A window with nothing to show: a file that cannot be shown is told of in it, and it stays; another window
//! opens beside it.

use std::fs;
use std::path::Path;

use anyhow::{Result, ensure};

use super::super::display::{Display, SIZE};
use super::{ERROR, Window};

/// Opens a file that is no container alone, whose ending is in the title of a window that shows nothing, asks
/// for another window, and ends.
pub(in super::super) fn use_broken(place: &Path) -> Result<()> {
    let display = Display::start(place)?;
    let broken = place.join("broken.vastex");
    fs::write(&broken, "no container")?;
    let size = format!("{}x{}", SIZE[0], SIZE[1]);
    Window::hold(&display, place, &broken, &["--size", &size], Window::tells_of_a_file_alone)
}

impl Window<'_> {
    fn tells_of_a_file_alone(&mut self) -> Result<()> {
        self.until("an error where nothing else is shown", |window| {
            window.display.find(0..SIZE[0], ERROR).ok().flatten().filter(|found| found.count > 4000)
        })?;
        self.keep("01-broken")?;
        self.key("ctrl+n")?;
        // The other one goes with the display.
        self.until("another window", |window| {
            let found = window.xdotool(&["search", "--onlyvisible", "--name", "."]).ok()?;
            found.lines().any(|id| *id != *window.id).then_some(())
        })?;
        ensure!(self.program.try_wait()?.is_none(), "it did not stay");
        self.xdotool(&["windowfocus", &self.id.clone()])?;
        let ended = self.quit()?;
        ensure!(ended.code() == Some(1), "it ended with {ended}");
        Ok(())
    }
}
