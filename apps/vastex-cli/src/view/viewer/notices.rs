//! What a person is told of the frames: by the title, and of what goes wrong on stderr as well.

use std::time::Instant;

use anyhow::Result;
use vastex::Event;
use vastex::diagnostics::{ExplainedPixel, FrameStats};
use vastex_core::Dims;
use vastex_scenes::Pose;
use vastex_viewer::inspect;

use super::super::display::Display;
use super::super::displayed::Displayed;
use super::super::title::{Scale, TitleImage, TitleParts};
use super::Viewer;
use crate::explained::Explained;
#[cfg(feature = "build")]
use crate::open::Mending;
use crate::{report, shortage};

/// What is said of a file that cannot be shown, as a topic.
const FILE: &str = "file that cannot be shown";

impl Viewer {
    /// A file cannot be shown: that takes the place of what was said of another one, of which nothing is
    /// counted.
    pub(in super::super) fn tell_of_file(&mut self, message: &str) {
        self.messages.forget(FILE);
        self.tell(FILE, message);
    }

    /// Says what went wrong of what is shown, on stderr, and in the window until it is read.
    pub(in super::super) fn say_wrong(&mut self, topic: &str, message: &str) {
        report::say(&format!("error: {}: {message}", self.name()));
        self.tell(topic, message);
    }

    /// What went wrong of a topic is no longer so.
    pub(in super::super) fn forget(&mut self, topic: &str) {
        self.messages.forget(topic);
    }

    /// Says what happened, on stderr and in the title.
    pub(super) fn report_events(&mut self, stats: &FrameStats) {
        while let Some(event) = self.textures.poll_event() {
            match &event {
                Event::Failed { page, why, .. } => {
                    let name = report::file_of(&self.textures, *page).unwrap_or(self.name());
                    let pos = page.pos(Dims::D2);
                    let message = format!("{name}: {pos} failed, a coarser one is shown instead: {why}");
                    report::say(&message);
                    self.messages.add("tiles", message);
                }
                // A view that moves wants for a moment what it leaves as well as what it comes to.
                Event::Oversubscribed { .. } => self.shortage = Some(event),
                event => {
                    if let Some(shortage) = shortage::text(event, &self.textures) {
                        self.notify(&shortage);
                    }
                }
            }
        }
        // They may come after all, when they are tried again.
        if self.is_settled(stats) && stats.pager.failed == 0 {
            self.messages.forget("tiles");
        }
        if self.is_settled(stats) && !self.is_shortage_reported {
            let event = self.shortage.take().and_then(|event| shortage::at_rest(event, &stats.pools));
            if let Some(text) = event.and_then(|event| shortage::text(&event, &self.textures)) {
                self.is_shortage_reported = true;
                // What the machine does says the same, with the remedy beside it.
                match self.hud.is_shown() {
                    true => report::say(&format!("{}: {text}", self.name())),
                    false => self.notify(&text),
                }
            }
        }
    }

    /// Tells what there is to know of a file, in the window until it is read or another file is displayed.
    pub(in super::super) fn note(&mut self, note: &str) {
        self.messages.note("file", note);
        self.window.request_redraw();
    }

    /// Another file is being opened, of which other things are to be known.
    pub(in super::super) fn forget_notes(&mut self) {
        self.messages.forget_notes();
    }

    /// Hears what becomes of a file in the cache that is damaged. Once it is whole, what failed is tried
    /// again.
    #[cfg(feature = "build")]
    pub(in super::super) fn hear_of_mending(&mut self, mending: Mending) -> Result<()> {
        match mending {
            Mending::Begun(text) => self.messages.note("cache", &text),
            Mending::Failed(text) => self.tell("cache", &text),
            Mending::Done => {
                self.messages.forget("cache");
                let shown = [self.display.displayed(), self.display.next()];
                let textures: Vec<_> = shown.into_iter().flatten().flat_map(Displayed::textures).collect();
                for texture in textures {
                    self.textures.texture_mut(texture)?.invalidate(&vastex::Region::whole());
                }
                self.wake();
            }
        }
        Ok(())
    }

    pub(super) fn update_title(&mut self, stats: &FrameStats, pose: Pose) {
        let (displayed, name) = (self.display.displayed(), self.name().to_owned());
        let image = displayed.map(|Displayed { size, texels, renderer, .. }| {
            let scale = pose.magnification(self.size(), *size);
            TitleImage {
                size: *size,
                scene: scale.map_or_else(|| Scale::On(renderer.scene().name()), Scale::Even),
                lack: match &self.display {
                    Display::Source(_) if texels != size => Some("reduced"),
                    // The file could not be read to its end.
                    Display::Preview { .. } if self.opening.is_none() => Some("incomplete"),
                    _ => None,
                },
            }
        });
        let texel = self.texel_below(&pose);
        let parts = TitleParts {
            name: &name,
            image,
            texel: texel.as_ref(),
            overlay: displayed.and_then(|source| Some(source.overlay.as_ref()?.overlay().name())),
            stats,
            is_settled: self.is_settled(stats),
            opening: self.opening.as_ref().map(|(_, share)| *share),
        };
        if let Some(title) = self.title.due(Instant::now(), &parts) {
            self.window.set_title(title);
        }
    }

    /// Tells the answers that have arrived: in the panel, and of what a person asked for in words in the
    /// title and in full on stdout.
    pub(super) fn print_explained(&mut self) -> Result<()> {
        for ExplainedPixel { pixel, explanations } in inspect::answers(&mut self.textures)? {
            if let Some(at) = self.to_print.iter().position(|asked| *asked == pixel) {
                self.to_print.swap_remove(at);
                let explained = Explained::new(pixel, &explanations);
                self.title.notify(explained.line(), Instant::now());
                report::print(&explained.text())?;
            }
            self.hud.show_explained(ExplainedPixel { pixel, explanations });
        }
        Ok(())
    }
}
