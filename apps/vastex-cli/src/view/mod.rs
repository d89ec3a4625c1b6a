//! `vastex view`: a window with a scene to move about in.
//!
//! Here is the loop of events: it draws while something changes and sleeps while nothing does; `perform`
//! carries actions out. `opening` opens a source on a thread, `showing` displays it or refuses it, `shown` is
//! the one that is seen, `over` lays others over it. `viewer` draws the viewer's scene on what `device`
//! finds, `shell` is egui in the window, `requests` does what is asked for in its panel. `files` knows the
//! next file, `offered` the images of a plate, `dialog` asks the system for a file, `recent` remembers them
//! and `bookmarks` views of them, both by `state`. What goes out of the window is in `outgoing`: pictures
//! (`shots`), camera paths (`flight`), texts (`clipboard`, `links`). `events` translates winit's events,
//! `new_window` makes the window, and `screen_reader` tells what is in it to those who do not see it.
//! `surface` is where pictures appear, `times` what is measured of the window, `remembered` what it was like
//! when it was closed last. Of volumes `volume_work` reads what is needed, and `volume_flight` moves them
//! along paths.

mod bookmarks;
mod clipboard;
mod device;
mod dialog;
mod events;
mod files;
mod flight;
mod links;
mod new_window;
mod offered;
#[cfg(feature = "volumes")]
mod one_search;
mod opening;
mod outgoing;
mod over;
mod perform;
mod recent;
mod remembered;
mod requests;
mod screen_reader;
mod shell;
mod shots;
mod showing;
mod shown;
mod state;
mod surface;
mod times;
mod viewer;
#[cfg(feature = "volumes")]
mod volume_flight;
#[cfg(feature = "volumes")]
mod volume_work;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result, anyhow};
use glam::DVec2;
use vastex::GpuError;
use vastex_scenes::{Pose, Scene};
use vastex_viewer::Remembered;
#[cfg(feature = "volumes")]
use vastex_viewer::VolumeFlight;
use vastex_viewer::beside::Wake;
use vastex_viewer::camera::{Controller, Flight};
use vastex_viewer::input::Input;
use vastex_viewer::surface_scene::{DisplayError, FirstDisplay};
use winit::application::ApplicationHandler;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Window, WindowId};

use crate::args::ViewArgs;
use crate::open::{self, Lies};
use crate::{report, screenshot};
use dialog::{Chosen, Wanted};
use files::{Files, Folder};
use flight::RecordedOf;
use links::Linked;
use opening::{Openings, Report};
use over::Over;
use shots::{Shots, TakenShot};
use shown::Shown;
use times::Times;
use viewer::{MadeAnew, Viewer};

/// Devices that may be lost, one after another, before the program gives up.
const MAX_LOST_DEVICES: u32 = 3;

pub(crate) fn run(mut args: ViewArgs) -> Result<ExitCode> {
    args.put_beside();
    open::pick_bands(&mut args.scene)?;
    // What is not there is no reason to open a window.
    let source = args.file();
    #[cfg(feature = "volumes")]
    let is_volume = source.is_some_and(|source| crate::volumes::opens_as_volume(source, &args));
    #[cfg(not(feature = "volumes"))]
    let is_volume = false;
    #[cfg(feature = "volumes")]
    match is_volume {
        true => args.check_of_volume()?,
        false if source.is_some() => args.check_of_image()?,
        false => {}
    }
    if let Some(source) = source.filter(|_| !is_volume)
        && open::what_lies_at(source)? == Lies::Container
        && !source.exists()
    {
        vastex::open(source)?;
    }
    if let Some(shapes) = &args.shapes {
        open::check_shapes(shapes).with_context(|| shapes.display().to_string())?;
    }
    if let Some(output) = &args.screenshot {
        return screenshot::run(&args, output);
    }
    let events = EventLoop::with_user_event().build().map_err(|error| {
        anyhow!(
            "no window can be opened; run this where there is a display (DISPLAY or WAYLAND_DISPLAY names it), or draw to a \
             file with `vastex render`: {}",
            events::without_place(&error.to_string())
        )
    })?;
    let mut app = App {
        proxy: events.create_proxy(),
        files: Files::new(&args.scene.source, &args.files),
        files_before: None,
        choosing_since: None,
        input: Input::default(),
        is_shifted: false,
        begun: Instant::now(),
        scene: args.scene.scene(),
        cameras: Scene::ALL.map(|scene| Controller::new(Pose::first(scene))),
        fitted: Some(Pose::first(Scene::Image)),
        open: None,
        openings: Openings::default(),
        over: Over::new(args.scene.files_over()),
        shown: Shown::default(),
        args_of: 1,
        offered_with: None,
        linked: None,
        before_link: None,
        keeps_camera: false,
        flight: Flight::default(),
        recorded_of: RecordedOf::default(),
        #[cfg(feature = "volumes")]
        volume_flight: VolumeFlight::default(),
        #[cfg(feature = "volumes")]
        volume_recorded_of: PathBuf::new(),
        shots: Shots::default(),
        to_play: args.camera_path.clone(),
        lost_devices: 0,
        waits_unseen: false,
        outcome: Ok(ExitCode::SUCCESS),
        args: Arc::new(args),
    };
    events.run_app(&mut app).context("the window system broke off")?;
    app.outcome
}

/// What other threads say to the loop of events.
enum Message {
    Opening(Box<Report>),
    /// What became of a dialog, and what was asked for in it.
    Chosen(Chosen, Wanted),
    /// The text that was copied, which was asked for, or why there is none.
    Copied(Result<String, String>),
    /// What lies beside a file.
    Listed(Folder),
    /// Textures for another mode of feedback.
    MadeAnew(Box<MadeAnew>),
    /// A picture of the window lies in a file, or none does.
    Shot(Result<TakenShot>),
    /// What a screen reader asks for.
    Reader(screen_reader::Asked),
}

/// The program between its events.
struct App {
    args: Arc<ViewArgs>,
    /// By which other threads reach the loop of events.
    proxy: EventLoopProxy<Message>,
    files: Files,
    /// The files before one that a person chose in the window, until it can be shown.
    files_before: Option<Files>,
    /// When the dialog for files was asked for that is open, or was never seen.
    choosing_since: Option<Duration>,
    input: Input,
    /// True if Shift is held.
    is_shifted: bool,
    /// When the program began; times of input are told from then.
    begun: Instant,
    scene: Scene,
    /// Where the camera is in each scene, in the order of [`Scene::ALL`].
    cameras: [Controller; Scene::ALL.len()],
    /// The pose that showed all of an image, which is followed while the camera is there.
    fitted: Option<Pose>,
    open: Option<Open>,
    openings: Openings,
    over: Over,
    /// What is seen, and what the cameras look at.
    shown: Shown,
    /// The opening that the arguments say of where the camera is and what is shown.
    args_of: u64,
    /// The arguments, where they are said of what lists the images that are offered.
    offered_with: Option<Arc<ViewArgs>>,
    /// The link that is being opened; and what was asked for before the one that was opened last.
    linked: Option<Linked>,
    before_link: Option<(FirstDisplay, Arc<ViewArgs>, u64)>,
    /// True if they stay where they are when the file that is being opened is displayed.
    keeps_camera: bool,
    flight: Flight,
    recorded_of: RecordedOf,
    #[cfg(feature = "volumes")]
    volume_flight: VolumeFlight,
    /// The file of the volume that is recorded.
    #[cfg(feature = "volumes")]
    volume_recorded_of: PathBuf,
    shots: Shots,
    /// A camera path that is to be played once there is something to see.
    to_play: Option<PathBuf>,
    lost_devices: u32,
    /// True if nobody is to see the frame that is due next.
    waits_unseen: bool,
    outcome: Result<ExitCode>,
}

/// The window, and what draws in it.
struct Open {
    window: Arc<Window>,
    viewer: Viewer,
}

impl Open {
    /// What the window is like now.
    fn remembered(&self) -> Remembered {
        self.viewer.remembered(&remembered::of_window(&self.window, self.viewer.window_size()))
    }
}

impl App {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<()> {
        // A test is to see what it asks for.
        let (before, mut notes) = if self.is_measured() { Default::default() } else { remembered::load() };
        let sizes = (self.args.scene.size, self.args.scene.size());
        let (window, reader) = new_window::open(events, sizes, &before, &self.proxy)?;
        let display = events.owned_display_handle();
        let with = (&*self.args, &before, &mut notes);
        let mut viewer = Viewer::new(with, self.scene, (window.clone(), reader), display)?;
        viewer.show_as_before(&before);
        self.open = Some(Open { window, viewer });
        if self.args.times
            && let Some(open) = &mut self.open
        {
            open.viewer.times = Some(Times::new(self.begun));
        }
        if self.args.file().is_some() {
            self.open_file()?;
        }
        self.open.iter_mut().for_each(|open| open.viewer.note_left_out(&notes));
        Ok(())
    }

    /// Returns true if the window is opened for a test or a benchmark, and nobody is there to choose another
    /// file.
    fn is_measured(&self) -> bool {
        self.args.exit_after_frames.is_some() || self.args.times
    }

    /// Draws a frame. A lost device is replaced, with everything that was made from it.
    fn draw(&mut self, events: &ActiveEventLoop) -> Result<()> {
        // A path is of the file that it was named with, and another one may have come before that.
        let to_play = self.to_play.take_if(|_| self.shown.path().is_some());
        if let Some(file) = to_play.filter(|_| self.shown.is_of(self.args_of)) {
            self.play_file(events, &file)?;
        }
        self.keep_fitted();
        #[cfg(feature = "volumes")]
        self.lead_volume();
        let camera = &mut self.cameras[self.scene as usize];
        let Some(Open { viewer, .. }) = &mut self.open else { return Ok(()) };
        let (moved, aspects) = (self.input.motion(self.begun.elapsed()), viewer.scene.aspects());
        if let Some(moved) = moved {
            viewer.scene.with_heights(|heights| camera.apply_over(moved, aspects, heights));
            viewer.scene.wake();
        }
        let now = self.begun.elapsed();
        if let Some(pose) = self.flight.pose(now).filter(|pose| pose.scene(self.scene) == self.scene) {
            *camera = Controller::new(pose);
            viewer.scene.wake();
        }
        self.flight.note(now, camera.pose());
        let drawn = viewer.draw(camera.pose());
        match drawn {
            Err(error) if is_device_lost(&error) && self.lost_devices < MAX_LOST_DEVICES => {
                self.lost_devices += 1;
                report::say("the graphics device was lost; going on with a new one");
                let Some(open) = self.open.take() else { return Ok(()) };
                let mut viewer = open.viewer.restored(events.owned_display_handle())?;
                let said = "The graphics device was lost. The window goes on with a new one.";
                viewer.scene.beside.show_error("device", said);
                self.open = Some(Open { viewer, ..open });
                // What it prepares is for the device that was lost.
                match self.openings.number() {
                    Some(number) if self.over.is_of(number) => {
                        self.openings.end();
                        self.over.begin_again();
                        self.open_next_over()?;
                    }
                    Some(_) => self.open_file_again()?,
                    None => {}
                }
            }
            drawn => drawn?,
        }
        if self.open.as_mut().is_some_and(|open| open.viewer.wants_anew()) {
            self.make_anew();
        }
        let asked = self.open.as_mut().map(|open| open.viewer.scene.beside.take_asked());
        let asked = asked.unwrap_or_default();
        for asked in asked {
            self.on_asked(events, asked)?;
            self.open.iter().for_each(|open| open.window.request_redraw());
        }
        Ok(())
    }

    fn handle(&mut self, window_events: &ActiveEventLoop, event: &WindowEvent) -> Result<()> {
        if let Some(open) = &mut self.open {
            let heard = open.viewer.hear(event);
            if heard.is_stale {
                open.window.request_redraw();
            }
            if heard.is_taken {
                return Ok(());
            }
        }
        match event {
            WindowEvent::CloseRequested => window_events.exit(),
            WindowEvent::RedrawRequested => self.draw(window_events)?,
            WindowEvent::DroppedFile(path) => {
                if path.extension().is_some_and(|ending| ending == "path") {
                    self.play_file(window_events, path)?;
                } else if let Some(link) = links::link_in(path) {
                    self.open_link(&link)?;
                } else if self.files.drop_in(path, self.begun.elapsed()) {
                    self.open_another()?;
                }
            }
            WindowEvent::Resized(size) => {
                if let Some(open) = &mut self.open {
                    open.viewer.resize([size.width, size.height]);
                }
            }
            event => {
                let Some(open) = &mut self.open else { return Ok(()) };
                let pose = self.cameras[self.scene as usize].pose();
                match event {
                    WindowEvent::CursorMoved { position, .. } => {
                        open.viewer.set_pointer(Some(DVec2::new(position.x, position.y)), pose);
                    }
                    WindowEvent::CursorLeft { .. } => open.viewer.set_pointer(None, pose),
                    _ => {}
                }
                if let WindowEvent::ModifiersChanged(held) = event {
                    self.is_shifted = held.state().shift_key();
                }
                let Some(event) = events::translated(event, self.is_shifted) else { return Ok(()) };
                if open.viewer.hear_in_volume(event) {
                    return Ok(());
                }
                let event = open.viewer.scene.event_in_pane(event);
                self.input.look_flat(self.scene == Scene::Image);
                let action = self.input.on_event(event, open.viewer.scene.view(), self.begun.elapsed());
                if let Some(action) = action {
                    if action.may_change_picture() {
                        open.viewer.scene.wake();
                    }
                    self.perform(window_events, action)?;
                }
            }
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

impl ApplicationHandler<Message> for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.open.is_none() {
            let opened = self.open(events);
            self.note(events, opened);
        }
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: StartCause) {
        let (StartCause::ResumeTimeReached { .. }, Some(open)) = (cause, &self.open) else { return };
        // At the end of what is measured a frame would be one more to wait for, and what nobody sees is drawn
        // before the next pause.
        if !self.waits_unseen && !open.viewer.times.as_ref().is_some_and(Times::are_over) {
            open.window.request_redraw();
        }
    }

    fn user_event(&mut self, events: &ActiveEventLoop, message: Message) {
        let mut heard = Ok(());
        match message {
            Message::Opening(report) => heard = self.on_report(*report),
            Message::Listed(folder) => {
                let step = self.files.take(folder);
                heard = self.go_to_file(step);
            }
            Message::Chosen(chosen, wanted) => heard = self.on_chosen(chosen, wanted),
            Message::Copied(copied) => heard = self.paste(copied),
            Message::MadeAnew(made) => self.take_anew(*made),
            Message::Shot(shot) => self.on_shot(shot),
            Message::Reader(asked) => {
                if let Some(open) = &mut self.open {
                    open.viewer.hear_reader(asked);
                }
            }
        }
        self.note(events, heard);
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let handled = self.handle(events, &event);
        self.note(events, handled);
        let frames = self.open.as_ref().map_or(0, |open| open.viewer.frames());
        let is_enough = self.args.exit_after_frames.is_some_and(|last| frames >= last);
        if is_enough && !self.openings.is_opening() {
            events.exit();
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let Some(open) = &mut self.open else { return };
        let end = open.viewer.times.as_ref().and_then(Times::end);
        if open.viewer.times.as_ref().is_some_and(Times::are_over) {
            let told = open.viewer.times.as_ref().map(Times::json).transpose();
            let printed = told.map_err(Error::from).and_then(|text| report::print(&text.unwrap_or_default()));
            self.note(events, printed);
            return events.exit();
        }
        let is_restless = self.args.restless && self.openings.is_opening();
        let is_counted = self.args.exit_after_frames.is_some();
        let awake = self.input.is_moving() || self.flight.is_playing() || is_restless || is_counted;
        let mut wake = open.viewer.next_frame(awake);
        // Other events make none of them late.
        if wake == Wake::Unseen(Duration::ZERO) {
            let drawn = open.viewer.draw_unseen(self.cameras[self.scene as usize].pose());
            // What went wrong is found again, and told, by a frame that is seen.
            wake = if drawn.is_ok() { open.viewer.next_frame(awake) } else { Wake::Now };
        }
        self.waits_unseen = matches!(wake, Wake::Unseen(_));
        events.set_control_flow(match wake {
            Wake::Now => {
                open.window.request_redraw();
                ControlFlow::Wait
            }
            Wake::After(pause) | Wake::Unseen(pause) => {
                ControlFlow::WaitUntil(Instant::now() + Duration::max(pause, Duration::from_millis(1)))
            }
            Wake::OnEvent => end.map_or(ControlFlow::Wait, ControlFlow::WaitUntil),
        });
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        self.end_recordings();
        if let Some(open) = self.open.as_ref().filter(|_| !self.is_measured()) {
            remembered::keep(&open.remembered());
        }
        self.open.iter_mut().for_each(|open| open.viewer.write_log());
        // The surface must go before the connection to the window system does.
        self.open = None;
        // What is being opened is broken off, and what is built of it written down.
        self.openings = Openings::default();
        // A picture that was asked for is written.
        self.shots = Shots::default();
    }
}

fn is_device_lost(error: &Error) -> bool {
    let is_lost = matches!(error.downcast_ref(), Some(vastex::Error::Gpu(GpuError::DeviceLost)));
    is_lost || error.downcast_ref().is_some_and(DisplayError::is_device_lost)
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
