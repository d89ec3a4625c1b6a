//! `vastex view`: a window with a scene to move about in.
//!
//! Here is what happens when: it draws while something changes and sleeps while nothing does. How a frame comes about
//! is `viewer`'s business, what events of the window system are `events`', where pictures appear `surface`'s.

mod events;
mod surface;
mod title;
mod viewer;

use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow};
use vastex::{GpuError, TileSource};
use vastex_scenes::{Pose, Scene};
use vastex_viewer::camera::Controller;
use vastex_viewer::input::{Action, Input};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::window::{Fullscreen, Window, WindowId};

use crate::args::ViewArgs;
use crate::open::{self, Lies};
use crate::report;
use viewer::{Viewer, Wake};

/// Devices that may be lost, one after another, before the program gives up.
const MAX_LOST_DEVICES: u32 = 3;

pub(crate) fn run(args: &ViewArgs) -> Result<ExitCode> {
    // An image may have to be built, which is for nothing where there is no window.
    let at_once = match open::what_lies_at(&args.scene.source)? {
        Lies::Generated | Lies::Container => Some(open::open(&args.scene)?),
        Lies::Other => None,
    };
    let events = EventLoop::new().map_err(|error| {
        anyhow!(
            "no window can be opened; run this where there is a display (DISPLAY or WAYLAND_DISPLAY names it), or draw to a \
             file with `vastex render`: {}",
            without_place(&error.to_string())
        )
    })?;
    let source = at_once.map_or_else(|| open::open(&args.scene), Ok)?.tiles;
    let mut app = App {
        args,
        source,
        input: Input::default(),
        begun: Instant::now(),
        scene: args.scene.on,
        cameras: Scene::ALL.map(|scene| Controller::new(Pose::first(scene))),
        open: None,
        lost_devices: 0,
        outcome: Ok(()),
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
struct App<'a> {
    args: &'a ViewArgs,
    source: Arc<dyn TileSource>,
    input: Input,
    /// When the program began; times of input are told from then.
    begun: Instant,
    scene: Scene,
    /// Where the camera is in each scene, in the order of [`Scene::ALL`].
    cameras: [Controller; Scene::ALL.len()],
    open: Option<Open>,
    lost_devices: u32,
    outcome: Result<()>,
}

/// The window, and what draws in it.
struct Open {
    window: Arc<Window>,
    viewer: Viewer,
}

impl App<'_> {
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
        self.open = Some(Open { viewer: self.viewer(events, &window)?, window });
        Ok(())
    }

    fn viewer(&self, events: &ActiveEventLoop, window: &Arc<Window>) -> Result<Viewer> {
        let display = events.owned_display_handle();
        Viewer::new(self.args, self.scene, self.source.clone(), window.clone(), display)
            .with_context(|| self.args.scene.source.display().to_string())
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
                let Some(Open { window, viewer }) = self.open.take() else { return Ok(()) };
                let viewer = viewer.restored(events.owned_display_handle())?;
                self.open = Some(Open { window, viewer });
            }
            drawn => drawn?,
        }
        Ok(())
    }

    fn handle(&mut self, window_events: &ActiveEventLoop, event: &WindowEvent) -> Result<()> {
        match event {
            WindowEvent::CloseRequested => window_events.exit(),
            WindowEvent::RedrawRequested => self.draw(window_events)?,
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
        let Some(Open { window, viewer }) = &mut self.open else { return Ok(()) };
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
                    Some(scene) if scene != self.scene => match viewer.show(scene) {
                        Ok(()) => self.scene = scene,
                        Err(error) => viewer.notify(&error.to_string()),
                    },
                    Some(_) => {}
                    // The next that there is.
                    None => {
                        let mut others = (1..Scene::ALL.len()).map(next);
                        self.scene = others.find(|&scene| viewer.show(scene).is_ok()).unwrap_or(self.scene);
                    }
                }
            }
            Action::Overlay => viewer.next_overlay(),
            Action::Explain(pixel) => viewer.explain(self.cameras[scene_index].pose(), pixel)?,
            Action::FillScreen => {
                let filled = window.fullscreen().is_some();
                window.set_fullscreen((!filled).then_some(Fullscreen::Borderless(None)));
            }
            Action::Redraw => {}
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

impl ApplicationHandler for App<'_> {
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
        // The surface must go before the connection to the window system does.
        self.open = None;
    }
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
