//! What goes out of the window: pictures of it, where its camera went, and what it shows as a text.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use vastex_scenes::Scene;
use vastex_viewer::CameraPath;
use vastex_viewer::camera::Controller;
use vastex_viewer::input::Action;
use winit::event_loop::ActiveEventLoop;

use super::clipboard::Copied;
use super::flight::free_name;
use super::{App, Message, Open, flight};
use crate::args::ViewArgs;
use crate::output::Output;
use crate::report;

/// Held by the one thread that chooses a file's name.
static CHOOSING: Mutex<()> = Mutex::new(());

/// How long the end of a program waits for pictures that were asked for.
const LONGEST_END: Duration = Duration::from_secs(20);

/// What is said where a recording begins, and where no path is there to be played.
pub(super) const RECORDING: &str = "the camera is recorded; F8 ends that and writes the path";
pub(super) const NO_PATH: &str =
    "there is no camera path to play; F8 records one, and files of them can be dropped here";

/// Pictures that are being drawn, each on a thread and a device of its own; and what was copied.
#[derive(Default)]
pub(super) struct Shots {
    threads: Vec<JoinHandle<()>>,
    pub(super) copied: Copied,
}

impl Drop for Shots {
    /// Waits a little for them.
    fn drop(&mut self) {
        let begun = Instant::now();
        while self.threads.iter().any(|thread| !thread.is_finished()) && begun.elapsed() < LONGEST_END {
            thread::sleep(Duration::from_millis(20));
        }
    }
}

impl App {
    /// Says something in the title of the window.
    pub(super) fn notice(&mut self, notice: &str) {
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
            return self.shoot_on_thread(source, size, move |args, output| shot.write(args, output));
        }
        let over = self.over.laid(self.is_opening_shown());
        let is_fitted = self.scene == Scene::Image && self.fitted == Some(pose);
        let Some(shot) = open.viewer.shot((&source, over), (pose, is_fitted), times) else {
            return self.notice("there is nothing to be seen in a picture yet");
        };
        let size = shot.size;
        self.shoot_on_thread(source, size, move |args, output| shot.write(args, output));
    }

    /// Has a picture of so many pixels of a source drawn and written.
    fn shoot_on_thread(
        &mut self,
        source: PathBuf,
        [width, height]: [u32; 2],
        write: impl FnOnce(&ViewArgs, &Output) -> Result<bool> + Send + 'static,
    ) {
        let (args, proxy) = (self.args.clone(), self.proxy.clone());
        let draw = move || {
            let taken = || -> Result<PathBuf> {
                let file = {
                    // One after the other, so that no two choose one name, which is taken from then on.
                    let _choosing = CHOOSING.lock().unwrap_or_else(PoisonError::into_inner);
                    let file = free_name(Path::new(""), &source, "png");
                    Output::at(&file)?.write(&[])?;
                    file
                };
                let written = write(&args, &Output::at(&file)?);
                if written.is_err() {
                    // Nobody has any use for an empty file.
                    drop(std::fs::remove_file(&file));
                }
                written.map(|_| file)
            };
            // Nobody listens where the window is closed.
            drop(proxy.send_event(Message::Shot(taken().context("no picture was written"))));
        };
        self.shots.threads.retain(|thread| !thread.is_finished());
        match thread::Builder::new().name("vastex-shot".into()).spawn(draw) {
            Ok(thread) => {
                self.shots.threads.push(thread);
                self.notice(&format!("a picture of {width}x{height} pixels is being drawn"));
            }
            Err(error) => self.say_wrong("picture", &format!("no picture can be drawn: {error}")),
        }
    }

    /// A picture is there, or why there is none.
    pub(super) fn on_shot(&mut self, shot: Result<PathBuf>) {
        match shot {
            Ok(file) => self.say_done(&format!("the picture is {}", file.display())),
            Err(error) => self.say_wrong("picture", &report::message(&error)),
        }
    }

    /// Notes where the camera goes from here on, or ends that and writes it down.
    pub(super) fn record_or_end(&mut self) {
        #[cfg(feature = "volumes")]
        if self.shows_volume() {
            return self.record_or_end_of_volume();
        }
        let (now, pose) = (self.begun.elapsed(), self.cameras[self.scene as usize].pose());
        let Some(open) = &self.open else { return };
        if !self.flight.is_recording() {
            self.flight.begin_recording(now, pose);
            return self.notice(RECORDING);
        }
        let image = open.viewer.scene.image_size();
        let text = self.flight.end_recording(now, pose).map(|path| path.to_text(image));
        self.write_path(text);
    }

    /// Writes down a path that was recorded.
    pub(super) fn write_path(&mut self, text: Option<String>) {
        let source = self.shown_path().to_owned();
        match text.map(|text| flight::write_path(&text, Path::new(""), &source)) {
            Some(Ok(file)) => self.say_done(&format!("the camera path is {}; F9 plays it", file.display())),
            None => self.say_done("nothing was recorded"),
            Some(Err(error)) => self.say_wrong("camera path", &report::message(&error)),
        }
    }

    /// Says what was done, on stderr and for a while in the window.
    fn say_done(&mut self, said: &str) {
        report::say(said);
        self.notice(said);
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
            None => self.notice(NO_PATH),
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
                self.say_wrong("camera path", &report::message(&error));
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
        self.notice(&said);
    }
}
