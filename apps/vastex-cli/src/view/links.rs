//! Links and views of texts: copied out of the window, opened in it from its field, the clipboard and files
//! that are dropped onto it, and handed to other windows.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Error, Result, anyhow};
use vastex_scenes::Scene;
use vastex_viewer::camera::Controller;
use vastex_viewer::{Link, ViewText, VolumeViewText};

use super::files::Files;
use super::{App, Message, Open};
use crate::args::{ViewArgs, of_link, without_help};
use crate::{link, open, report};

/// Bytes of a file that may be a link.
const MOST_BYTES: u64 = 1 << 16;
/// Bytes of a copied view or path at most.
const MOST_PASTED: usize = 4096;
/// What is said of anything else that was copied.
const NOTHING_COPIED: &str = "what was copied is no view, no link and no file";

/// What a link asks for, until its source is there.
pub(super) struct Linked {
    /// The opening of its source, once it has begun.
    pub(super) opening: Option<u64>,
    pub(super) args: Arc<ViewArgs>,
}

/// The link that a file has, if it has one and nothing else.
pub(super) fn link_in(file: &Path) -> Option<String> {
    // A pipe would keep the window until somebody writes to it.
    let is_short = |about: &std::fs::Metadata| about.is_file() && about.len() <= MOST_BYTES;
    std::fs::metadata(file).ok().filter(is_short)?;
    let mut text = String::new();
    std::fs::File::open(file).ok()?.take(MOST_BYTES).read_to_string(&mut text).ok()?;
    (Link::is_link(&text) && text.trim().lines().count() == 1).then(|| text.trim().to_owned())
}

impl App {
    /// With what a source is opened: as the link says that it is of, or as the command line does.
    pub(super) fn opening_args(&self) -> Arc<ViewArgs> {
        self.linked.as_ref().map_or(&self.args, |linked| &linked.args).clone()
    }

    /// Something of an opening is there: where that is the one of a link, all is as the link says. Where it
    /// cannot be displayed, [`App::take_back_link`] has it as it was.
    pub(super) fn follow_link(&mut self, opening: u64) {
        let Some(linked) = self.linked.take_if(|linked| linked.opening == Some(opening)) else { return };
        if let Some(Open { viewer, .. }) = &mut self.open {
            let asked = viewer.ask(&linked.args.scene);
            let args = std::mem::replace(&mut self.args, linked.args);
            let args_of = std::mem::replace(&mut self.args_of, opening);
            self.before_link = Some((asked, args, args_of));
        }
    }

    /// The source of a link cannot be displayed: all is as it was before.
    pub(super) fn take_back_link(&mut self) {
        self.linked = None;
        let Some((asked, args, args_of)) = self.before_link.take() else { return };
        (self.args, self.args_of) = (args, args_of);
        if let Some(open) = &mut self.open {
            open.viewer.scene.set_first_display(asked);
        }
    }

    /// Begins to open what a link names. A link that cannot be read is told, and nothing changes.
    pub(super) fn open_link(&mut self, text: &str) -> Result<()> {
        let args = of_link(&self.args, text).map_err(|error| anyhow!(without_help(&error)));
        let args = args.and_then(|mut args| {
            open::pick_bands(&mut args.scene)?;
            Ok(args)
        });
        let args = match args {
            Ok(args) => args,
            Err(error) => {
                self.report_error("link", &report::message(&error));
                return Ok(());
            }
        };
        let over: Vec<PathBuf> = args.scene.files_over().map(Path::to_owned).collect();
        let before = std::mem::replace(&mut self.files, Files::new(&args.scene.source, &[]));
        self.files_before.get_or_insert(before);
        self.keeps_camera = false;
        self.linked = Some(Linked { opening: None, args: Arc::new(args) });
        self.open_with(over)
    }

    /// Moves the camera to where a view is, and shows what it says. What cannot be shown is told, and nothing
    /// changes.
    pub(super) fn show_text(&mut self, view: &ViewText) {
        let scene = view.scene(self.scene);
        let Some(Open { viewer, window }) = &mut self.open else { return };
        if viewer.shows_volume() {
            return self.notify("the view is of an image, and a volume is shown");
        }
        if viewer.scene.show_view(view) {
            self.scene = scene;
            self.cameras[scene as usize] = Controller::new(view.pose);
            if scene != Scene::Image {
                viewer.scene.end_measuring();
            }
            viewer.scene.jumped();
            self.input.rest();
            self.flight.stop();
        }
        window.request_redraw();
    }

    /// Shows of a volume what a view says. What cannot be shown is told, and nothing changes.
    pub(super) fn show_volume_text(&mut self, text: &str) {
        let shown =
            text.parse::<VolumeViewText>().map_err(Error::from).and_then(|view| match &mut self.open {
                Some(open) => match open.viewer.volume() {
                    Some(volume) => Ok(volume.show_view(&view)?),
                    None => Err(anyhow!("the view is of a volume, and none is shown; open it first")),
                },
                None => Ok(()),
            });
        if let Err(error) = shown {
            self.report_error("paste", &report::message(&error));
        }
        self.open.iter().for_each(|open| open.window.request_redraw());
    }

    /// Asks for the view, the link or the file that was copied. It comes as a message, also from a program
    /// that takes its time.
    pub(super) fn ask_to_paste(&mut self) {
        let proxy = self.proxy.clone();
        // Nobody listens where the window is closed.
        let send = move |text| drop(proxy.send_event(Message::Copied(text)));
        if let Err(why) = self.shots.copied.read(send) {
            self.notify(&format!("nothing can be pasted: {why}"));
        }
    }

    /// Shows the view that was copied, or opens the link or the file.
    pub(super) fn paste(&mut self, copied: Result<String, String>) -> Result<()> {
        let text = match copied {
            Ok(text) => text,
            Err(why) => {
                self.notify(&format!("nothing can be pasted: {why}"));
                return Ok(());
            }
        };
        let text = text.trim();
        if Link::is_link(text) {
            return self.open_link(text);
        }
        if VolumeViewText::is_meant(text) && text.len() <= MOST_PASTED && text.lines().count() == 1 {
            self.show_volume_text(text);
            return Ok(());
        }
        let image = self.open.as_ref().map_or([1; 2], |open| open.viewer.scene.image_size());
        // What is copied elsewhere may be long, and may be nobody's business: it is told only where it is
        // meant as a view.
        let is_meant = Scene::ALL.iter().any(|scene| text.starts_with(&format!("{}:", scene.name())));
        match ViewText::from_text(text, image) {
            _ if text.len() > MOST_PASTED || text.lines().count() != 1 => self.notify(NOTHING_COPIED),
            Ok(view) => self.show_text(&view),
            Err(_) if Path::new(text).exists() => return self.open_chosen(Path::new(text)),
            Err(error) if is_meant => self.report_error("paste", &report::message(&error.into())),
            Err(_) => self.notify(NOTHING_COPIED),
        }
        Ok(())
    }

    /// A link to what is shown, if anything is.
    fn link(&self) -> Option<Result<Link>> {
        let pose = self.cameras[self.scene as usize].pose();
        let Open { viewer, .. } = self.open.as_ref()?;
        let view = viewer.view_text(pose)?;
        // A file that the view does not name would lie over the others where the link is opened.
        let named = ViewText::from_text(&view, viewer.scene.image_size());
        let last = named.ok().map_or(0, |view| match view.names_layers() {
            true => view.textures().max().unwrap_or(0),
            // All of them are shown.
            false => usize::MAX,
        });
        let over = self.over.all(self.is_opening_shown()).take(last);
        Some(link::link_of(self.shown_path(), over, Some(view)))
    }

    /// Copies a link to what is shown.
    pub(super) fn copy_link(&mut self) {
        match self.link() {
            Some(Ok(link)) => self.copy_text("the link", &link.to_string()),
            Some(Err(error)) => self.report_error("link", &report::message(&error)),
            None => {}
        }
    }

    /// Opens another window: with what is shown in this one, or with nothing. It goes on by itself.
    pub(super) fn open_window(&mut self, is_same: bool) {
        let link = self.link().filter(|_| is_same).transpose();
        let started = link.and_then(|link| {
            let link = link.map(|link| link.to_string());
            let is_of_source = open::is_same_file(self.shown_path(), &self.args.scene.source);
            link::open_window(link.as_deref().map(|link| (link, is_of_source)), &self.args)
        });
        if let Err(error) = started {
            let why = format!("no other window can be opened: {}", report::message(&error));
            self.report_error("window", &why);
        }
    }

    /// Says what went wrong on stderr, and in the window until it is read.
    pub(super) fn report_error(&mut self, topic: &str, message: &str) {
        report::say(&format!("error: {message}"));
        self.open.iter_mut().for_each(|open| open.viewer.scene.beside.show_error(topic, message));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_a_link_has_nothing_else_in_it() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("a.txt");
        for (text, link) in [
            ("vastex:a.tif\n", Some("vastex:a.tif")),
            ("vastex:a.tif\nvastex:b.tif\n", None),
            ("see vastex:a.tif", None),
            ("", None),
        ] {
            std::fs::write(&file, text).unwrap();
            assert_eq!(link_in(&file).as_deref(), link, "{text}");
        }
        std::fs::write(&file, [0xff, 0xfe]).unwrap();
        assert!(link_in(&file).is_none() && link_in(directory.path()).is_none());
    }
}
