//! What a person is told of the frames: by the title, and of what goes wrong on stderr as well.

use std::sync::Arc;

use anyhow::Result;
use vastex::Event;
use vastex::diagnostics::{ExplainedPixel, FrameStats};
use vastex_core::Dims;
use vastex_viewer::beside::TILES;
use vastex_viewer::panels::Shapes;

use super::{DIALOG, OF_FILE, Viewer};
use crate::explained::Explained;
#[cfg(feature = "build")]
use crate::open::Mending;
use crate::{report, shortage};

/// What is said of a file that cannot be shown, as a topic.
const FILE: &str = "file that cannot be shown";

impl Viewer {
    /// Says on stderr what there is to say there.
    pub(in super::super) fn write_log(&mut self) {
        self.scene.beside.take_log().iter().for_each(|line| report::say(line));
    }

    /// A file cannot be shown: that takes the place of what was said of another one, of which nothing is
    /// counted.
    pub(in super::super) fn tell_of_file(&mut self, message: &str) {
        self.scene.beside.forget(FILE);
        self.scene.beside.show_error(FILE, message);
    }

    /// Nothing was chosen, perhaps since there is no dialog for files: opens the panel with the keys in the
    /// field for a path, and says so until that is read or a file is opened.
    pub(in super::super) fn offer_path_field(&mut self) {
        self.scene.beside.ask_for_path();
        let said = "Nothing was chosen. If no dialog for files came up, this system shows none: write the path of a file into the field \"Path\" of the panel.";
        self.scene.report_error(DIALOG, said);
    }

    /// Tells what of the window before could not be had.
    pub(in super::super) fn note_left_out(&mut self, notes: &[String]) {
        for note in notes {
            report::say(&format!("note: {note}"));
            self.scene.beside.show_note(OF_FILE, note);
        }
    }

    /// Says what happened, on stderr and in the title.
    pub(super) fn report_events(&mut self, stats: &FrameStats) {
        let scene = &mut self.scene;
        while let Some(event) = scene.textures_mut().poll_event() {
            match &event {
                Event::Failed { page, why, .. } => {
                    let name = report::file_of(scene.textures(), *page).unwrap_or(scene.name());
                    let pos = page.pos(Dims::D2);
                    let message = format!("{name}: {pos} failed, a coarser one is shown instead: {why}");
                    report::say(&message);
                    scene.beside.show_error_later(TILES, &message);
                }
                // A view that moves wants for a moment what it leaves as well as what it comes to.
                Event::Oversubscribed { .. } => self.shortage = Some(event),
                event => {
                    if let Some(shortage) = shortage::text(event, scene.textures()) {
                        scene.announce(&shortage);
                    }
                }
            }
        }
        if !scene.is_settled(stats) {
            return;
        }
        // They may come after all, when they are tried again.
        if stats.pager.failed == 0 {
            scene.beside.forget(TILES);
        }
        if !scene.beside.shortage_is_said() {
            let event = self.shortage.take().and_then(|event| shortage::at_rest(event, &stats.pools));
            if let Some(text) = event.and_then(|event| shortage::text(&event, scene.textures())) {
                scene.beside.note_shortage_said();
                // What the machine does says the same, with the remedy beside it.
                match scene.beside.hud_is_shown() {
                    true => report::say(&format!("{}: {text}", scene.name())),
                    false => scene.announce(&text),
                }
            }
        }
    }

    /// Shapes have come that lie over the source of an opening, or why there are none.
    pub(in super::super) fn take_shapes(&mut self, opening: u64, shapes: Result<Arc<Shapes>>) {
        match shapes {
            Ok(shapes) => self.scene.lay_shapes(opening, shapes),
            Err(error) => {
                let message = report::message(&error);
                report::say(&format!("error: {message}"));
                self.scene.beside.show_error("shapes", &message);
            }
        }
    }

    /// Hears what becomes of a file in the cache that is damaged. Once it is whole, what failed is tried
    /// again.
    #[cfg(feature = "build")]
    pub(in super::super) fn hear_of_mending(&mut self, mending: Mending) -> Result<()> {
        let beside = &mut self.scene.beside;
        match mending {
            Mending::Begun(text) => beside.show_note("cache", &text),
            Mending::Failed(text) => beside.show_error("cache", &text),
            Mending::Done => {
                beside.forget("cache");
                self.scene.read_again()?;
            }
        }
        Ok(())
    }

    /// Tells the answers that have arrived of what a person asked for in words: in the title, and in full on
    /// stdout.
    pub(super) fn print_explained(&mut self) -> Result<()> {
        for ExplainedPixel { pixel, explanations } in self.scene.take_explained()? {
            let explained = Explained::new(pixel, &explanations);
            self.scene.beside.notify(&explained.line());
            if let Err(error) = report::print(&explained.text()) {
                let why = format!("an explanation cannot be written to stdout: {}", report::message(&error));
                self.scene.report_error("explanation", &why);
            }
        }
        Ok(())
    }
}
