//! What a person asks for in the panel and in the dialog for files.

use std::path::Path;
use std::thread;
use std::time::Duration;

use anyhow::Result;
use vastex_scenes::{Pose, Scene};
use vastex_viewer::Link;
use vastex_viewer::camera::Controller;
use vastex_viewer::input::Action;
use vastex_viewer::panels::WindowAsked;
use winit::event_loop::ActiveEventLoop;

use super::dialog::{self, Chosen, Wanted};
use super::files::{Folder, Step, list_beside};
use super::offered::files_among;
use super::viewer::{DIALOG, MadeAnew};
use super::{App, Message};
use crate::args::is_link;
use crate::open;

/// After so long a dialog for files may be asked for again: that of some systems never answers.
const ASK_AGAIN: Duration = Duration::from_secs(5);

impl App {
    /// A person chose a file or a folder in the dialog, or nothing.
    pub(super) fn on_chosen(&mut self, chosen: Chosen, wanted: Wanted) -> Result<()> {
        self.choosing_since = None;
        let Some(open) = &mut self.open else { return Ok(()) };
        match chosen {
            Chosen::Path(path) if wanted == Wanted::FileOver => self.lay_over(&path)?,
            Chosen::Path(path) => self.open_chosen(&path)?,
            Chosen::NothingSoon => open.viewer.offer_path_field(),
            Chosen::Nothing => self.notify(
                "nothing was chosen; if no dialog came up, write a path into the field of the panel (M)",
            ),
        }
        Ok(())
    }

    /// Begins to open a file that a person chose in the window. Where it cannot be shown, what was there
    /// before stays.
    pub(super) fn open_chosen(&mut self, path: &Path) -> Result<()> {
        if let Some(link) = path.to_str().filter(|text| Link::is_link(text)) {
            return self.open_link(link);
        }
        if let Some(open) = &mut self.open {
            open.viewer.scene.beside.forget(DIALOG);
        }
        let are_of_what_is_shown = open::are_of_first_image(path, self.shown_path());
        let files = files_among(self.offered(), path);
        let before = std::mem::replace(&mut self.files, files);
        self.files_before.get_or_insert(before);
        self.open_another()?;
        // Other bands of an image, and it itself, are seen where those before were.
        self.keeps_camera = are_of_what_is_shown;
        Ok(())
    }

    /// Goes to another file, or looks for one: in a folder that is far away that may take long, so it is
    /// listed beside the loop of events.
    pub(super) fn go_to_file(&mut self, step: Step) -> Result<()> {
        match step {
            Step::Other => return self.open_another(),
            Step::Nowhere => self.notify("there is no other file to show beside this one"),
            Step::Waiting => {}
            Step::List(file) => {
                let (proxy, asked) = (self.proxy.clone(), file.clone());
                // Nobody listens where the window is closed.
                let list = move || drop(proxy.send_event(Message::Listed(list_beside(asked))));
                if thread::Builder::new().name("vastex-folder".into()).spawn(list).is_err() {
                    let step = self.files.take(Folder::none(file));
                    return self.go_to_file(step);
                }
                // Gone with what is opened, or with what is said then.
                self.notify("looking for other files in the folder");
            }
        }
        Ok(())
    }

    /// Begins to make the textures of the window anew, as they are wanted there.
    pub(super) fn make_anew(&mut self) {
        let (pose, proxy) = (self.cameras[self.scene as usize].pose(), self.proxy.clone());
        // Nobody listens where the window is closed.
        let send = move |made| drop(proxy.send_event(Message::MadeAnew(Box::new(made))));
        if let Some(open) = &mut self.open {
            open.viewer.make_anew(pose, send);
        }
    }

    /// Textures for the window were made.
    pub(super) fn take_anew(&mut self, made: MadeAnew) {
        if let Some(open) = &mut self.open {
            open.viewer.take_anew(made);
            open.window.request_redraw();
        }
    }

    /// Puts what is displayed on a scene, or on the next that there is.
    pub(super) fn choose_scene(&mut self, choice: Option<Scene>) {
        // A scene is chosen by what can be seen.
        let Some(open) = self.open.as_mut().filter(|open| !open.viewer.scene.is_empty()) else { return };
        let viewer = &mut open.viewer;
        match choice {
            Some(scene) if scene != self.scene => match viewer.scene.put_on(scene) {
                Ok(()) => {
                    self.scene = scene;
                    viewer.scene.beside.forget("scene");
                }
                Err(error) => viewer.scene.report_error("scene", &error.to_string()),
            },
            Some(_) => {}
            None => {
                let next = |step| Scene::ALL[(self.scene as usize + step) % Scene::ALL.len()];
                let mut others = (1..Scene::ALL.len()).map(next);
                self.scene = others.find(|&scene| viewer.scene.put_on(scene).is_ok()).unwrap_or(self.scene);
            }
        }
        // Nothing can be measured elsewhere, and a double click there is no end of a line.
        if self.scene != Scene::Image {
            viewer.scene.end_measuring();
        }
    }

    /// Moves the camera to a pose, in its scene.
    fn go(&mut self, events: &ActiveEventLoop, pose: Pose) -> Result<()> {
        let scene = pose.scene(self.scene);
        self.perform(events, Action::Scene(Some(scene)))?;
        if self.scene == scene {
            self.cameras[scene as usize] = Controller::new(pose);
            self.input.rest();
            self.open.iter_mut().for_each(|open| open.viewer.scene.jumped());
        }
        Ok(())
    }

    /// Asks for a file or a folder by the system's dialog, unless one is on its way.
    fn ask_by_dialog(&mut self, wanted: Wanted) -> Result<()> {
        let now = self.begun.elapsed();
        if self.choosing_since.is_some_and(|since| now.saturating_sub(since) < ASK_AGAIN) {
            self.notify("the dialog for files is open, or on its way; in some seconds Ctrl + O asks again");
            return Ok(());
        }
        self.choosing_since = Some(now);
        let proxy = self.proxy.clone();
        let send = move |chosen| drop(proxy.send_event(Message::Chosen(chosen, wanted)));
        dialog::choose(wanted, self.files.current(), send);
        Ok(())
    }

    /// Does what was asked for in the panel.
    pub(super) fn on_asked(&mut self, events: &ActiveEventLoop, asked: WindowAsked) -> Result<()> {
        match asked {
            WindowAsked::Open(path) => self.open_chosen(Path::new(&path)),
            WindowAsked::OpenBands(file, bands) => {
                self.open_chosen(&open::path_of_bands(file.as_ref(), &bands))
            }
            WindowAsked::LayOver(path) if is_link(Path::new(&path)) => {
                self.notify("a link is opened, and lies over nothing; open it, or lay its file over");
                Ok(())
            }
            WindowAsked::LayOver(path) => self.lay_over(Path::new(&path)),
            WindowAsked::Choose => self.ask_by_dialog(Wanted::File),
            WindowAsked::ChooseFolder => self.ask_by_dialog(Wanted::Folder),
            WindowAsked::ChooseOver => self.ask_by_dialog(Wanted::FileOver),
            WindowAsked::File(step) => self.perform(events, Action::File(step)),
            WindowAsked::Scene(scene) => self.perform(events, Action::Scene(Some(scene))),
            WindowAsked::Fit => self.perform(events, Action::Reset),
            WindowAsked::Go(pose) => self.go(events, pose),
            WindowAsked::Show(view) => {
                self.show_text(&view);
                Ok(())
            }
            WindowAsked::ShowText(text) => {
                self.show_volume_text(&text);
                Ok(())
            }
            WindowAsked::CopyView => self.perform(events, Action::CopyView),
            WindowAsked::CopyLink => self.perform(events, Action::CopyLink),
            WindowAsked::Keep(name) => {
                let pose = self.cameras[self.scene as usize].pose();
                self.open.iter_mut().for_each(|open| open.viewer.keep_view(name.clone(), pose));
                Ok(())
            }
            WindowAsked::Forget(index) => {
                self.open.iter_mut().for_each(|open| open.viewer.bookmarks.forget(index));
                Ok(())
            }
            WindowAsked::Move(moved) => self.perform(events, Action::Move(moved)),
        }
    }
}
