//! What goes out of the window: pictures of it, where its camera went, and what it shows as a text.

use std::path::{Path, PathBuf};

use anyhow::Result;
use vastex_scenes::Scene;
use vastex_viewer::CameraPath;
use vastex_viewer::camera::{Controller, LeftOut, Recorded};
use vastex_viewer::input::Action;
use winit::event_loop::ActiveEventLoop;

use super::flight::{RecordedOf, said_of};
use super::shots::{AskedShot, TakenShot};
use super::{App, Message, Open, flight};
use crate::args::ViewArgs;
use crate::output::Output;
use crate::report;
use crate::screenshot::Patience;

/// What is said where a recording begins, and where no path is there to be played.
pub(super) const RECORDING: &str = "the camera is recorded; F8 ends that and writes the path";
pub(super) const NO_PATH: &str =
    "there is no camera path to play; F8 records one, and files of them can be dropped here";

impl App {
    /// Says something in the title of the window.
    pub(super) fn notify(&mut self, notice: &str) {
        if let Some(Open { window, viewer }) = &mut self.open {
            viewer.scene.beside.notify(notice);
            window.request_redraw();
        }
    }

    /// Begins to draw a picture of what the window shows, so many times as large.
    pub(super) fn shoot(&mut self, times: u32) {
        let Some(open) = &self.open else { return };
        let (source, pose) = (self.shown_path().to_owned(), self.cameras[self.scene as usize].pose());
        #[cfg(feature = "volumes")]
        if let Some(shot) = open.viewer.volume_shot(times) {
            let size = shot.size;
            let write = move |args: &ViewArgs, to: (&Output, &Patience)| shot.write_while(args, to);
            return self.shoot_on_thread(source, size, write);
        }
        let over = self.over.laid(self.is_opening_shown());
        let is_fitted = self.scene == Scene::Image && self.fitted == Some(pose);
        let Some(shot) = open.viewer.shot((&source, over), (pose, is_fitted), times) else {
            return self.notify("there is nothing to be seen in a picture yet");
        };
        let size = shot.size;
        self.shoot_on_thread(source, size, move |args, to| shot.write_while(args, to));
    }

    /// Has a picture of so many pixels of a source drawn and written, once those are that were asked for
    /// before.
    fn shoot_on_thread(
        &mut self,
        of: PathBuf,
        [width, height]: [u32; 2],
        write: impl FnOnce(&ViewArgs, (&Output, &Patience)) -> Result<bool> + Send + 'static,
    ) {
        let (args, proxy) = (self.args.clone(), self.proxy.clone());
        let asked = AskedShot {
            of,
            directory: PathBuf::new(),
            draw: Box::new(move |to| write(&args, to)),
            // Nobody listens where the window is closed.
            send: Box::new(move |shot| drop(proxy.send_event(Message::Shot(shot)))),
        };
        match self.shots.ask(asked) {
            Ok(0) => self.notify(&format!("a picture of {width}x{height} pixels is being drawn")),
            Ok(before) => self
                .notify(&format!("a picture of {width}x{height} pixels is drawn after {before} before it")),
            Err(error) => self.report_error("picture", &report::message(&error)),
        }
    }

    /// A picture is there, or why there is none.
    pub(super) fn on_shot(&mut self, shot: Result<TakenShot>) {
        match shot {
            Ok(TakenShot { file, is_whole: true }) => {
                self.announce(&format!("the picture is {}", file.display()));
            }
            Ok(TakenShot { file, .. }) => {
                let file = file.display();
                let said = format!("the picture is {file}, but not everything in view was loaded");
                self.report_error("picture", &said);
            }
            Err(error) => self.report_error("picture", &report::message(&error)),
        }
        if let Err(error) = self.shots.go_on() {
            self.report_error("picture", &report::message(&error));
        }
    }

    /// Notes where the camera goes from here on, or ends that and writes it down.
    pub(super) fn record_or_end(&mut self) {
        if self.is_recording() {
            return self.end_recordings();
        }
        #[cfg(feature = "volumes")]
        if self.shows_volume() {
            return self.record_volume();
        }
        let (now, pose) = (self.begun.elapsed(), self.cameras[self.scene as usize].pose());
        let Some(open) = &self.open else { return };
        let image = open.viewer.scene.image_size();
        self.recorded_of = RecordedOf { file: self.shown_path().to_owned(), image };
        self.flight.begin_recording(now, pose);
        self.notify(RECORDING);
    }

    /// Returns true if something is noted, of what is shown or was shown before.
    fn is_recording(&self) -> bool {
        #[cfg(feature = "volumes")]
        if self.volume_flight.is_recording() {
            return true;
        }
        self.flight.is_recording()
    }

    /// Ends what is noted over an image, and writes it down.
    fn end_recording(&mut self) {
        let (now, pose) = (self.begun.elapsed(), self.cameras[self.scene as usize].pose());
        let image = self.recorded_of.image;
        let text = |Recorded { path, left_out }: Recorded<'_>| (path.to_text(image), left_out);
        let recorded = self.flight.end_recording(now, pose).map(text);
        let of = std::mem::take(&mut self.recorded_of.file);
        self.write_path(recorded, &of);
    }

    /// Ends all that is noted, and writes it down.
    pub(super) fn end_recordings(&mut self) {
        if self.flight.is_recording() {
            self.end_recording();
        }
        #[cfg(feature = "volumes")]
        self.end_recording_of_volume();
    }

    /// Writes down a path that was recorded over a file, with what it does not have.
    pub(super) fn write_path(&mut self, recorded: Option<(String, Option<LeftOut>)>, of: &Path) {
        let Some((text, left_out)) = recorded else { return self.announce("nothing was recorded") };
        match said_of(flight::write_path(&text, Path::new(""), of), left_out) {
            Ok(said) => self.announce(&said),
            Err(said) => self.report_error("camera path", &said),
        }
    }

    /// Says what was done, on stderr and for a while in the window.
    fn announce(&mut self, said: &str) {
        report::say(said);
        self.notify(said);
    }

    /// Plays the path that was recorded or read last.
    pub(super) fn play(&mut self, events: &ActiveEventLoop) -> Result<()> {
        #[cfg(feature = "volumes")]
        if self.shows_volume() {
            self.play_in_volume();
            return Ok(());
        }
        match self.flight.play(self.begun.elapsed()) {
            Some(pose) => {
                let scene = pose.scene(self.scene);
                if scene != self.scene {
                    self.perform(events, Action::Scene(Some(scene)))?;
                    self.flight.play(self.begun.elapsed());
                }
                self.cameras[self.scene as usize] = Controller::new(pose);
                self.open.iter_mut().for_each(|open| open.viewer.scene.jumped());
            }
            None => self.notify(NO_PATH),
        }
        Ok(())
    }

    /// Plays the path of a file.
    pub(super) fn play_file(&mut self, events: &ActiveEventLoop, file: &Path) -> Result<()> {
        #[cfg(feature = "volumes")]
        if self.shows_volume() {
            self.play_file_in_volume(file);
            return Ok(());
        }
        let image = self.open.as_ref().map_or([1; 2], |open| open.viewer.scene.image_size());
        match flight::read_path(file, |text| CameraPath::from_text(text, image)) {
            Ok(path) => {
                self.flight.set_path(path);
                self.play(events)
            }
            Err(error) => {
                self.report_error("camera path", &report::message(&error));
                Ok(())
            }
        }
    }

    /// Copies what is shown as a text, which the window and `render` read.
    pub(super) fn copy_view(&mut self) {
        let pose = self.cameras[self.scene as usize].pose();
        let Some(text) = self.open.as_ref().and_then(|open| open.viewer.view_text(pose)) else { return };
        self.copy_text("the view", &text);
    }

    /// Copies a text, or says it on stderr.
    pub(super) fn copy_text(&mut self, what: &str, text: &str) {
        let said = match self.shots.copied.copy(text) {
            Ok(()) => format!("copied: {text}"),
            Err(why) => {
                report::say(&format!("{what} is {text}"));
                format!("the clipboard cannot be reached ({why}); {what} stands on stderr")
            }
        };
        self.notify(&said);
    }
}
