//! A window, and the scene or the volume that is seen in it. How a frame comes about is in `drawing`.

mod anew;
mod drawing;
mod notices;
mod outgoing;
#[cfg(feature = "volumes")]
mod volume;

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow};
use glam::DVec2;
use vastex::{Event, Filter, Settings};
use vastex_scenes::{Pose, Scene};
use vastex_viewer::Remembered;
use vastex_viewer::beside::{Wake, WindowState};
use vastex_viewer::hud::{Chosen, NamedByHost};
use vastex_viewer::input::InputEvent;
use vastex_viewer::panels::Bookmark;
use vastex_viewer::stage::{Clock, GpuTimer};
use vastex_viewer::surface_scene::{
    DisplayError, DisplaySettings, FirstDisplay, PreparedSource, SurfaceScene,
};
use vastex_viewer::window_scene::{ShownVolume, WindowScene};
use winit::event::WindowEvent;
use winit::event_loop::OwnedDisplayHandle;
use winit::raw_window_handle::{HasDisplayHandle, RawDisplayHandle};
use winit::window::Window;

use super::bookmarks::Bookmarks;
use super::device::{default_fade, device_for};
use super::recent::Recent;
use super::screen_reader::{self, Reader};
use super::shell::{Heard, Shell};
use super::surface::Surface;
use super::times::Times;
#[cfg(feature = "volumes")]
use super::volume_work::VolumeWork;
use crate::args::{Fault, SceneArgs, ViewArgs};
use crate::commands::render;
use anew::Anew;
pub(super) use anew::MadeAnew;

/// How often the window asks which display it is on.
const DISPLAY_LOOKS: Duration = Duration::from_secs(1);
/// What is said of the system's dialog for files, as a topic.
pub(super) const DIALOG: &str = "dialog";
/// What there is to know of a file, as a topic.
pub(super) const OF_FILE: &str = "file";

/// A window, and what is displayed in it.
pub(super) struct Viewer {
    window: Arc<Window>,
    surface: Surface,
    shell: Shell,
    /// What is seen, and what stands beside it.
    pub(super) scene: SurfaceScene,
    /// A volume in its place.
    volume: Option<Box<OpenVolume>>,
    pub(super) recent: Recent,
    pub(super) bookmarks: Bookmarks,
    /// Textures that are wanted in the place of those of the scene.
    anew: Anew,
    /// What measures frames while what the machine does is shown.
    timer: Option<GpuTimer>,
    /// Frames of sources, those of previews left out.
    frames: u64,
    /// That a pool is too small, until the view has settled and it is said.
    shortage: Option<Event>,
    /// What is measured, if that is asked for.
    pub(super) times: Option<Times>,
    /// When the display was looked at.
    display_seen: Option<Instant>,
    /// What is to go wrong after the first frame of a source, in tests.
    fault: Option<Fault>,
}

/// A volume in the window.
struct OpenVolume {
    shown: ShownVolume,
    /// The threads that read it.
    #[cfg(feature = "volumes")]
    work: VolumeWork,
}

/// What a window shows: a volume, or what lies on its scene where there is none.
fn shown_of<'a>(scene: &'a mut SurfaceScene, volume: &'a mut Option<Box<OpenVolume>>) -> WindowScene<'a> {
    WindowScene::of(scene, volume.as_deref_mut().map(|volume| &mut volume.shown))
}

impl Viewer {
    /// Sets everything up on a device of its own, with nothing to display; as it was before, where the
    /// arguments do not say otherwise. What of that cannot be had is added to the notes.
    pub(super) fn new(
        (args, before, notes): (&ViewArgs, &Remembered, &mut Vec<String>),
        scene: Scene,
        (window, reader): (Arc<Window>, Reader),
        display: OwnedDisplayHandle,
    ) -> Result<Viewer> {
        let (gpu, surface) = device_for(&window, display)?;
        let fault = args.fault;
        let (fade, args) = (args.fade_ms.map_or(default_fade(&gpu), Duration::from_millis), &args.scene);
        let settings = Settings { fade, ..render::settings(args)? };
        let named = NamedByHost {
            filter: args.filter.is_some(),
            feedback: args.feedback.is_some(),
            uploads: args.upload_kib_per_frame.is_some(),
        };
        let mut chosen = Chosen::before(before, named, &settings);
        let textures = chosen.textures(&gpu, settings, notes)?;
        let surface = Surface::new(&gpu, window.clone(), surface)?;
        let pictures = (surface.formats().clone(), surface.size());
        let may_be_crisp = args.filter() == Filter::default();
        let begun = Instant::now();
        let clock: Clock = Arc::new(move || begun.elapsed());
        let first = first_display(args, scene, may_be_crisp);
        Ok(Viewer {
            shell: Shell::new(window.clone(), reader),
            scene: SurfaceScene::new((gpu, textures), pictures, first, chosen, clock),
            volume: None,
            recent: Recent::load(),
            bookmarks: Bookmarks::load(),
            anew: Anew::default(),
            timer: None,
            frames: 0,
            shortage: None,
            times: None,
            display_seen: None,
            fault,
            window,
            surface,
        })
    }

    /// Displays a preview of the source that an opening will bring. Says which scene it is on.
    pub(super) fn show_preview(
        &mut self,
        opening: u64,
        name: &str,
        source: PreparedSource,
    ) -> Result<Scene, DisplayError> {
        let scene = self.scene.show_preview(opening, name, source)?;
        self.volume = None;
        Ok(scene)
    }

    /// Displays the source that an opening brought. Says which scene it is on.
    pub(super) fn show_source(
        &mut self,
        opening: u64,
        name: &str,
        source: PreparedSource,
    ) -> Result<Scene, DisplayError> {
        let scene = self.scene.show_source(opening, name, source)?;
        self.volume = None;
        Ok(scene)
    }

    /// Returns true if a volume is shown.
    pub(super) fn shows_volume(&self) -> bool {
        self.volume.is_some()
    }

    /// What the window shows.
    pub(super) fn shown(&mut self) -> WindowScene<'_> {
        shown_of(&mut self.scene, &mut self.volume)
    }

    /// Goes on with a device of its own after this one's was lost. What was read stays, and the view is sharp
    /// again as soon as it is uploaded.
    pub(super) fn restored(mut self, display: OwnedDisplayHandle) -> Result<Viewer> {
        // What was said stays said where there is no other device.
        self.write_log();
        self.scene.leave_device();
        self.shell.painter.forget_device();
        let Viewer { window, surface, scene, .. } = self;
        // A window has one surface at a time.
        drop(surface);
        let (gpu, surface) = device_for(&window, display)?;
        let mut surface = Surface::new(&gpu, window.clone(), surface)?;
        let scene = scene.restored(&gpu, surface.formats().clone())?;
        scene.format().iter().for_each(|format| surface.set_format(format));
        let mut restored = Viewer { window, surface, scene, timer: None, ..self };
        if let Some(OpenVolume { shown: volume, .. }) = restored.volume.as_deref_mut() {
            let restored = volume.restore(&gpu, restored.surface.formats());
            restored.map_err(|error| anyhow!("{}: {error}", volume.name()))?;
        }
        Ok(restored)
    }

    /// The next file is displayed as these arguments say. Gives back what was asked before.
    pub(super) fn ask(&mut self, args: &SceneArgs) -> FirstDisplay {
        let may_be_crisp = self.scene.settings().may_be_crisp;
        self.scene.set_first_display(first_display(args, args.scene(), may_be_crisp))
    }

    /// Frames of sources drawn so far, those of previews left out.
    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    /// Width and height of the window in pixels, however it is divided.
    pub(super) fn window_size(&self) -> [u32; 2] {
        self.surface.size()
    }

    /// The window has another size.
    pub(super) fn resize(&mut self, size: [u32; 2]) {
        self.surface.resize(size);
        self.scene.resize(self.surface.size());
        self.volume.iter_mut().for_each(|volume| volume.shown.resize(self.surface.size()));
    }

    /// Hears an event before the picture does.
    pub(super) fn hear(&mut self, event: &WindowEvent) -> Heard {
        let heard = self.shell.hear(event);
        if heard.is_stale {
            self.volume.iter_mut().for_each(|volume| volume.shown.refresh());
        }
        heard
    }

    /// A screen reader asks for something, which the next frame does.
    pub(super) fn hear_reader(&mut self, asked: screen_reader::Asked) {
        self.shell.hear_reader(asked);
        self.volume.iter_mut().for_each(|volume| volume.shown.refresh());
        self.window.request_redraw();
    }

    /// Hears keys and the pointer before surfaces do. Returns true if that was all there is to it.
    pub(super) fn hear_in_volume(&mut self, event: InputEvent) -> bool {
        let Some(OpenVolume { shown: volume, .. }) = self.volume.as_deref_mut() else { return false };
        let is_taken = volume.on_event(&self.scene.beside, event);
        if volume.is_stale() {
            self.window.request_redraw();
        }
        is_taken
    }

    /// The volume that is shown, if one is.
    pub(super) fn volume(&mut self) -> Option<&mut ShownVolume> {
        self.volume.as_deref_mut().map(|volume| &mut volume.shown)
    }

    /// What is shown knows how the window is now.
    fn look_at_window(&mut self) {
        self.look_at_display();
        self.scene.beside.set_window(WindowState {
            is_over_panel: self.shell.is_over_panel(),
            fills_screen: self.window.fullscreen().is_some(),
            is_dark: self.shell.is_dark(),
            // winit tells of them everywhere else.
            lacks_drops: is_under_wayland(&self.window),
        });
    }

    /// What is shown knows how often the display shows another frame. No event says in time, and on all
    /// systems, that the window has another display, and some systems take long to answer.
    fn look_at_display(&mut self) {
        if self.display_seen.is_some_and(|seen| seen.elapsed() < DISPLAY_LOOKS) {
            return;
        }
        self.display_seen = Some(Instant::now());
        let display = self.window.current_monitor();
        self.scene.beside.set_refresh_rate(display.and_then(|display| display.refresh_rate_millihertz()));
    }

    /// The pointer is there, in pixels of the view, or not over it.
    pub(super) fn set_pointer(&mut self, pointer: Option<DVec2>, pose: Pose) {
        self.look_at_window();
        let window = self.window.clone();
        if let Some(title) = self.shown().set_pointer(pointer, pose) {
            window.set_title(title);
        }
    }

    /// Opens the panel, and gives its first control the keys.
    pub(super) fn enter_panel(&mut self) {
        self.scene.beside.open_panel();
        self.shell.focus_next();
    }

    /// What is shown becomes a bookmark.
    pub(super) fn keep_view(&mut self, name: String, pose: Pose) {
        if let Some(view) = self.view_text(pose) {
            self.bookmarks.keep(&Bookmark { name, view });
        }
    }

    /// The window is as it was when it was closed last.
    pub(super) fn show_as_before(&mut self, before: &Remembered) {
        self.scene.beside.show_as_before(before);
        self.shell.set_theme(before.theme);
    }

    /// A window with what is shown in this one now, and what was chosen there.
    pub(super) fn remembered(&self, window: &Remembered) -> Remembered {
        Remembered { theme: self.shell.theme(), ..self.scene.beside.remembered(window) }
    }

    /// When the next frame is due; `awake` says that the view will change by itself.
    pub(super) fn next_frame(&mut self, awake: bool) -> Wake {
        self.write_log();
        let panels = self.shell.due_in(Instant::now());
        self.shown().next_frame(awake, panels)
    }
}

/// Returns true if a window is one under Wayland.
fn is_under_wayland(window: &Window) -> bool {
    matches!(window.display_handle().map(|display| display.as_raw()), Ok(RawDisplayHandle::Wayland(_)))
}

/// How files are displayed, at first and until a person changes that, by these arguments.
fn first_display(args: &SceneArgs, scene: Scene, may_be_crisp: bool) -> FirstDisplay {
    let options = args.shown();
    let layers = options.layers.clone();
    let (overlay, range_is_free) = (args.overlay(), args.range_is_free());
    let settings = DisplaySettings { scene, options, overlay, may_be_crisp, range_is_free };
    FirstDisplay { layers, settings, is_asked: true }
}
