//! What becomes of the file that is to be shown: it is opened, and displayed or refused.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Error, Result};
use vastex_scenes::{Pose, Scene};
use vastex_viewer::camera::Controller;

#[cfg(feature = "volumes")]
use vastex_viewer::volume_scene::VolumeLook;

use super::offered::name_among;
use super::opening::{OpeningEvent, Report};
use super::viewer::OF_FILE;
use super::{App, Message};
use crate::report;

impl App {
    /// Begins to open the file that is to be shown, and breaks off what was being opened.
    pub(super) fn open_file(&mut self) -> Result<()> {
        let path = self.files.current().to_owned();
        self.over.begin_again();
        self.open.iter_mut().for_each(|open| open.viewer.scene.beside.forget_notes());
        let number = self.begin(&path, true, false)?;
        self.follow_offer(&path, number);
        self.linked.iter_mut().for_each(|linked| linked.opening = Some(number));
        Ok(())
    }

    /// Begins anew to open the file that is being opened. What a person did with what there is of it stays.
    pub(super) fn open_file_again(&mut self) -> Result<()> {
        let path = self.files.current().to_owned();
        self.begin(&path, true, true).map(drop)
    }

    /// Begins to open another file than the one that is displayed or being opened, with nothing over it.
    pub(super) fn open_another(&mut self) -> Result<()> {
        self.linked = None;
        self.keeps_camera = false;
        self.open_with(Vec::new())
    }

    /// The same with files that are to lie over it.
    pub(super) fn open_with(&mut self, over: Vec<PathBuf>) -> Result<()> {
        let is_empty = self.open.as_ref().is_none_or(|open| open.viewer.scene.is_empty());
        match is_empty {
            true => self.over.forget(),
            false => self.over.set_aside(),
        }
        self.over.add(over);
        self.open_file()
    }

    /// Begins to open a file, perhaps with previews and perhaps once more, and breaks off what was being
    /// opened. The number of the opening, 0 without a window.
    pub(super) fn begin(&mut self, path: &Path, has_previews: bool, is_again: bool) -> Result<u64> {
        let Some(open) = &mut self.open else { return Ok(0) };
        let name = name_among(open.viewer.scene.beside.panel().offered(), path);
        open.viewer.scene.begin_opening(&name)?;
        open.window.request_redraw();
        let (preparer, proxy) = (open.viewer.scene.preparer(), self.proxy.clone());
        // Nobody listens where the window is closed.
        let send = move |report| drop(proxy.send_event(Message::Opening(Box::new(report))));
        Ok(self.openings.begin((path, has_previews, is_again), self.opening_args(), preparer, send))
    }

    /// Hears of the file that is being opened. Reports of other files are old.
    pub(super) fn on_report(&mut self, Report { opening: number, event }: Report) -> Result<()> {
        // Some are of files that have been displayed for long.
        let event = match (event, &mut self.open) {
            (OpeningEvent::Shapes(shapes), Some(open)) => {
                open.viewer.take_shapes(number, shapes);
                open.window.request_redraw();
                return Ok(());
            }
            #[cfg(feature = "build")]
            (OpeningEvent::Mending(mending), Some(open)) => {
                open.viewer.hear_of_mending(mending)?;
                open.window.request_redraw();
                return Ok(());
            }
            #[cfg(feature = "build")]
            (OpeningEvent::LaterNote(note), Some(open)) => {
                let current = self.openings.number().filter(|number| !self.over.is_of(*number));
                if self.shown.concerns(number, current) {
                    open.viewer.scene.beside.show_note(OF_FILE, &note);
                    open.window.request_redraw();
                }
                return Ok(());
            }
            (event, _) => event,
        };
        let is_measured = self.is_measured();
        let is_seen = match &event {
            OpeningEvent::Preview(_) | OpeningEvent::Opened(_) => true,
            #[cfg(feature = "volumes")]
            OpeningEvent::Volume(_) => true,
            _ => false,
        };
        if let Some(opening) = self.openings.current(number).filter(|_| is_seen) {
            self.follow_link(opening.first);
        }
        let (Some(opening), Some(open)) = (self.openings.current(number), &mut self.open) else {
            return Ok(());
        };
        open.window.request_redraw();
        if self.over.is_of(number) {
            let path = opening.path.clone();
            return self.on_report_of_over(&path, event);
        }
        let (path, first) = (opening.path.clone(), opening.first);
        let name = name_among(open.viewer.scene.beside.panel().offered(), &path);
        match event {
            OpeningEvent::Shapes(_) => {}
            #[cfg(feature = "build")]
            OpeningEvent::Mending(_) | OpeningEvent::LaterNote(_) => {}
            OpeningEvent::Progress(share) => open.viewer.scene.set_opening(&name, share)?,
            OpeningEvent::Note(note) => open.viewer.scene.beside.show_note(OF_FILE, &note),
            OpeningEvent::Preview(source) => {
                // What cannot be shown is said once all of it is there.
                if let Ok(scene) = open.viewer.show_preview(first, &name, source) {
                    self.scene = scene;
                    self.look_at(first, &path);
                }
            }
            OpeningEvent::Opened(source) => match open.viewer.show_source(first, &name, source) {
                // The next frame finds that the device was lost, and opens the file again.
                Err(error) if error.is_device_lost() => {}
                shown => {
                    open.viewer.scene.end_opening()?;
                    self.openings.end();
                    match shown.with_context(|| path.display().to_string()) {
                        Ok(scene) => {
                            (self.files_before, self.before_link) = (None, None);
                            self.over.drop_aside();
                            if !is_measured {
                                open.viewer.recent.add(&path);
                            }
                            self.scene = scene;
                            self.look_at(first, &path);
                            self.open_next_over()?;
                        }
                        Err(error) => self.refuse(first, error)?,
                    }
                }
            },
            #[cfg(feature = "volumes")]
            OpeningEvent::Volume(volume) => {
                let (opened, settings, said) = *volume;
                let oddities = opened.oddities();
                // What the command line and links say is of the first file.
                let look = match first == self.args_of {
                    true => opened.initial_look(&self.args),
                    false => Ok(VolumeLook::first(&opened.facts)),
                };
                let shown = look
                    .and_then(|look| open.viewer.show_volume(first, (&name, opened, look), said, settings));
                open.viewer.scene.end_opening()?;
                self.openings.end();
                match shown.with_context(|| path.display().to_string()) {
                    Ok(()) => {
                        oddities
                            .iter()
                            .for_each(|oddity| open.viewer.scene.beside.show_note(OF_FILE, oddity));
                        (self.files_before, self.before_link) = (None, None);
                        self.over.forget();
                        if !is_measured {
                            open.viewer.recent.add(&path);
                        }
                        self.look_at(first, &path);
                    }
                    Err(error) => self.refuse(first, error)?,
                }
            }
            #[cfg(feature = "volumes")]
            OpeningEvent::Listed(listed) => {
                open.viewer.scene.end_opening()?;
                self.openings.end();
                self.offer(first, &path, listed)?;
            }
            OpeningEvent::Failed(error) => {
                open.viewer.scene.end_opening()?;
                self.openings.end();
                self.refuse(first, error)?;
            }
        }
        Ok(())
    }

    /// Something of an opening is displayed: cameras begin where they begin with each source.
    fn look_at(&mut self, opening: u64, path: &Path) {
        if self.shown.turn_to(opening, path) {
            if !std::mem::take(&mut self.keeps_camera) {
                self.cameras = Scene::ALL.map(|scene| Controller::new(Pose::first(scene)));
                self.fitted = Some(Pose::first(Scene::Image));
            }
            // What the command line says of the camera is of the first file that is opened, and what a link
            // says is of its own.
            let size = self.open.as_ref().map_or([1; 2], |open| open.viewer.scene.image_size());
            if let Some(pose) = self.args.scene.pose(size).filter(|_| opening == self.args_of) {
                self.cameras[pose.scene(self.scene) as usize] = Controller::new(pose);
                self.fitted = None;
            }
            self.input.rest();
            self.open.iter_mut().for_each(|open| {
                let is_volume = open.viewer.shows_volume();
                open.viewer.bookmarks.turn_to(path, is_volume);
                open.viewer.scene.beside.turn_to(path.as_os_str());
            });
        }
    }

    /// Where all of an image is shown and nobody has moved it since, keeps all of it beside what covers the
    /// picture.
    pub(super) fn keep_fitted(&mut self) {
        let camera = &mut self.cameras[Scene::Image as usize];
        if self.fitted != Some(camera.pose()) {
            return;
        }
        let Some(open) = &mut self.open else { return };
        if let Some(pose) = open.viewer.scene.fitted().filter(|pose| *pose != camera.pose()) {
            *camera = Controller::new(pose);
            self.fitted = Some(pose);
            open.viewer.scene.wake();
        }
    }

    /// A file cannot be shown: that is said on stderr and in the window, which offers to open another one
    /// where it has nothing to show; it ends a program that measures. The exit code tells of it in any case.
    pub(super) fn refuse(&mut self, opening: u64, error: Error) -> Result<()> {
        self.outcome = Ok(ExitCode::FAILURE);
        let before = self.files_before.take();
        let is_measured = self.is_measured();
        // What was asked for with it is of no other file.
        if opening == self.args_of {
            self.to_play = None;
            self.open.iter_mut().for_each(|open| open.viewer.scene.forget_asked());
        }
        // What has come of it stays, in the place of what was there before.
        if self.shown.is_of(opening) {
            self.over.forget();
            (self.linked, self.before_link) = (None, None);
        } else {
            self.over.take_back();
            self.take_back_link();
            if let Some(before) = before {
                self.files = before;
                self.files.wait_no_more();
            }
        }
        match &mut self.open {
            Some(open) if !is_measured => {
                let message = report::message(&error);
                report::say(&format!("error: {message}"));
                open.viewer.tell_of_file(&message);
                self.open_next_over()
            }
            _ => Err(error),
        }
    }
}
