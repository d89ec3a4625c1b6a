//! `vastex view`: a window with a scene to move about in.
//!
//! Here is what happens when: it draws while something changes and sleeps while nothing does. How a frame comes about
//! is `viewer`'s business, what is shown `shown`'s, how it is opened `opening`'s; which file comes next is `files`', what events of the
//! window system are `events`', where pictures appear `surface`'s.

mod events;
mod files;
mod opening;
mod shown;
mod surface;
mod title;
mod viewer;

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result, anyhow};
use vastex::GpuError;
use vastex_scenes::{Pose, Scene};
use vastex_viewer::camera::Controller;
use vastex_viewer::input::{Action, Input};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Fullscreen, Window, WindowId};

use crate::args::ViewArgs;
use crate::report;
use files::Files;
use opening::{News, Opening, Told};
use viewer::{Viewer, Wake};

/// Devices that may be lost, one after another, before the program gives up.
const MAX_LOST_DEVICES: u32 = 3;

pub(crate) fn run(args: ViewArgs) -> Result<ExitCode> {
    let events = EventLoop::with_user_event().build().map_err(|error| {
        anyhow!(
            "no window can be opened; run this where there is a display (DISPLAY or WAYLAND_DISPLAY names it), or draw to a \
             file with `vastex render`: {}",
            without_place(&error.to_string())
        )
    })?;
    let mut app = App {
        proxy: events.create_proxy(),
        files: Files::new(&args.scene.source, &args.files),
        input: Input::default(),
        begun: Instant::now(),
        scene: args.scene.on,
        cameras: Scene::ALL.map(|scene| Controller::new(Pose::first(scene))),
        open: None,
        opening: None,
        openings: 0,
        lost_devices: 0,
        outcome: Ok(()),
        args: Arc::new(args),
    };
    events.run_app(&mut app).context("the window system broke off")?;
    app.outcome.map(|()| ExitCode::SUCCESS)
}

/// What winit says without the line of its source that says it.
fn without_place(error: &str) -> &str {
    let said = error.strip_prefix("os error at ").and_then(|placed| placed.split_once(": "));
    said.map_or(error, |(_, why)| why)
}

/// The program between its events.
struct App {
    args: Arc<ViewArgs>,
    /// By which threads that open a source reach the loop of events.
    proxy: EventLoopProxy<News>,
    files: Files,
    input: Input,
    /// When the program began; times of input are told from then.
    begun: Instant,
    scene: Scene,
    /// Where the camera is in each scene, in the order of [`Scene::ALL`].
    cameras: [Controller; Scene::ALL.len()],
    open: Option<Open>,
    /// The source that is being opened, if any, and how many were begun.
    opening: Option<Opening>,
    openings: u64,
    lost_devices: u32,
    outcome: Result<()>,
}

/// The window, and what draws in it.
struct Open {
    window: Arc<Window>,
    viewer: Viewer,
    /// Whether there is anything to see of a file.
    has_shown: bool,
    /// The opening whose camera stands where a person has moved it, or at the beginning.
    camera_of: u64,
}

impl App {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let [width, height] = self.args.scene.size;
        let attributes = Window::default_attributes()
            .with_title("vastex")
            .with_inner_size(PhysicalSize::new(width, height))
            .with_min_inner_size(PhysicalSize::new(64, 64));
        let window = events.create_window(attributes).map_err(|error| {
            let why = without_place(&error.to_string()).to_owned();
            anyhow!("no window can be opened; draw to a file with `vastex render`: {why}")
        })?;
        let window = Arc::new(window);
        let display = events.owned_display_handle();
        let viewer = Viewer::new(&self.args, self.scene, window.clone(), display)?;
        self.open = Some(Open { window, viewer, has_shown: false, camera_of: 0 });
        self.open_file()
    }

    /// Begins to open the file that is to be shown, and breaks off what was being opened.
    fn open_file(&mut self) -> Result<()> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let path = self.files.current().to_owned();
        self.openings += 1;
        open.viewer.begin(&name_of(&path));
        open.window.request_redraw();
        let (preparer, proxy) = (open.viewer.preparer(), self.proxy.clone());
        self.opening = Some(Opening::begin(self.openings, path, self.args.clone(), preparer, proxy)?);
        Ok(())
    }

    /// Hears of the source that is being opened. News of another one are old.
    fn hear(&mut self, News { opening, told }: News) -> Result<()> {
        let is_current = |current: &&Opening| current.number == opening;
        let (Some(current), Some(open)) = (self.opening.as_ref().filter(is_current), &mut self.open) else {
            return Ok(());
        };
        open.window.request_redraw();
        let name = name_of(&current.path);
        match told {
            Told::Done(share) => return open.viewer.progressed(Some(share)),
            Told::Note(note) => open.viewer.notify_in_title(&note),
            Told::Coarse(arrival) => {
                // What cannot be shown is said once all of it is there.
                if open.viewer.show(&name, arrival, true).is_ok() {
                    self.has_shown(opening);
                }
            }
            Told::Whole(arrival) => {
                let outcome = open.viewer.show(&name, arrival, false);
                open.viewer.progressed(None)?;
                let outcome = outcome.with_context(|| current.path.display().to_string());
                self.opening = None;
                match outcome {
                    Ok(()) => self.has_shown(opening),
                    Err(error) => return self.refuse(error),
                }
            }
            Told::Failed(error) => {
                open.viewer.progressed(None)?;
                self.opening = None;
                return self.refuse(error);
            }
        }
        Ok(())
    }

    /// Something of an opening is shown: its camera begins where cameras begin.
    fn has_shown(&mut self, opening: u64) {
        let Some(open) = &mut self.open else { return };
        open.has_shown = true;
        if std::mem::replace(&mut open.camera_of, opening) != opening {
            self.cameras = Scene::ALL.map(|scene| Controller::new(Pose::first(scene)));
        }
    }

    /// A file cannot be shown: that ends a program that shows nothing, and is said where something is shown.
    fn refuse(&mut self, error: Error) -> Result<()> {
        match &mut self.open {
            Some(open) if open.has_shown => {
                let message = report::message(&error);
                report::say(&message);
                open.viewer.notify_in_title(&message);
                Ok(())
            }
            _ => Err(error),
        }
    }

    /// Draws a frame. A lost device is replaced, with everything that was made from it.
    fn draw(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let camera = &mut self.cameras[self.scene as usize];
        let Some(Open { viewer, .. }) = &mut self.open else { return Ok(()) };
        let (moved, aspects) = (self.input.motion(self.begun.elapsed()), viewer.aspects());
        if let Some(moved) = moved {
            camera.apply(moved, aspects);
            viewer.wake();
        }
        let drawn = viewer.draw(camera.pose());
        let is_lost = |error: &anyhow::Error| {
            matches!(error.downcast_ref(), Some(vastex::Error::Gpu(GpuError::DeviceLost)))
        };
        match drawn {
            Err(error) if is_lost(&error) && self.lost_devices < MAX_LOST_DEVICES => {
                self.lost_devices += 1;
                report::say("the graphics device was lost; going on with a new one");
                let Some(open) = self.open.take() else { return Ok(()) };
                let viewer = open.viewer.restored(events.owned_display_handle())?;
                self.open = Some(Open { viewer, ..open });
            }
            drawn => drawn?,
        }
        Ok(())
    }

    fn handle(&mut self, window_events: &ActiveEventLoop, event: &WindowEvent) -> Result<()> {
        match event {
            WindowEvent::CloseRequested => window_events.exit(),
            WindowEvent::RedrawRequested => self.draw(window_events)?,
            WindowEvent::DroppedFile(path) => {
                if self.files.drop_in(path, self.begun.elapsed()) {
                    self.open_file()?;
                }
            }
            WindowEvent::Resized(size) => {
                if let Some(open) = &mut self.open {
                    open.viewer.resize([size.width, size.height]);
                }
            }
            event => {
                let Some(open) = &mut self.open else { return Ok(()) };
                let Some(event) = events::translated(event) else { return Ok(()) };
                let action = self.input.on_event(event, open.viewer.size(), self.begun.elapsed());
                if let Some(action) = action {
                    open.viewer.wake();
                    self.perform(window_events, action)?;
                }
            }
        }
        Ok(())
    }

    fn perform(&mut self, events: &ActiveEventLoop, action: Action) -> Result<()> {
        if let Action::File(step) = action {
            return if self.files.step(step) { self.open_file() } else { Ok(()) };
        }
        let Some(Open { window, viewer, .. }) = &mut self.open else { return Ok(()) };
        let scene_index = self.scene as usize;
        match action {
            Action::Move(moved) => {
                self.cameras[scene_index].apply(moved, viewer.aspects());
            }
            Action::Reset => {
                self.cameras[scene_index] = Controller::new(Pose::first(self.scene));
                viewer.jumped();
            }
            Action::Scene(choice) => {
                let next = |step| Scene::ALL[(scene_index + step) % Scene::ALL.len()];
                match choice {
                    Some(scene) if scene != self.scene => match viewer.put_on(scene) {
                        Ok(()) => self.scene = scene,
                        Err(error) => viewer.notify(&error.to_string()),
                    },
                    Some(_) => {}
                    // The next that there is.
                    None => {
                        let mut others = (1..Scene::ALL.len()).map(next);
                        self.scene = others.find(|&scene| viewer.put_on(scene).is_ok()).unwrap_or(self.scene);
                    }
                }
            }
            Action::Overlay => viewer.next_overlay(),
            Action::Explain(pixel) => viewer.explain(self.cameras[scene_index].pose(), pixel)?,
            Action::FillScreen => {
                let filled = window.fullscreen().is_some();
                window.set_fullscreen((!filled).then_some(Fullscreen::Borderless(None)));
            }
            Action::File(_) | Action::Redraw => {}
            Action::Quit => events.exit(),
        }
        Ok(())
    }

    fn note(&mut self, events: &ActiveEventLoop, outcome: Result<()>) {
        if let Err(error) = outcome {
            self.outcome = Err(error);
            events.exit();
        }
    }
}

impl ApplicationHandler<News> for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.open.is_none() {
            let opened = self.open(events);
            self.note(events, opened);
        }
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: StartCause) {
        if let (StartCause::ResumeTimeReached { .. }, Some(open)) = (cause, &self.open) {
            open.window.request_redraw();
        }
    }

    fn user_event(&mut self, events: &ActiveEventLoop, news: News) {
        let heard = self.hear(news);
        self.note(events, heard);
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let handled = self.handle(events, &event);
        self.note(events, handled);
        let (frames, last) =
            (self.open.as_ref().map_or(0, |open| open.viewer.frames()), self.args.exit_after_frames);
        if last.is_some_and(|last| frames >= last) {
            events.exit();
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let Some(open) = &mut self.open else { return };
        let awake = self.input.is_moving() || self.args.exit_after_frames.is_some();
        events.set_control_flow(match open.viewer.next_frame(awake) {
            Wake::Now => {
                open.window.request_redraw();
                ControlFlow::Wait
            }
            Wake::After(pause) => {
                ControlFlow::WaitUntil(Instant::now() + Duration::max(pause, Duration::from_millis(1)))
            }
            Wake::OnEvent => ControlFlow::Wait,
        });
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // What is being opened is broken off. The surface must go before the connection to the window system does.
        (self.opening, self.open) = (None, None);
    }
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_error_names_a_place_of_the_machine_that_built_the_program() {
        let error = "os error at /home/builder/.cargo/registry/winit/mod.rs:765: no display is named";
        assert_eq!(without_place(error), "no display is named");
        assert_eq!(without_place("no display is named"), "no display is named");
    }
}
