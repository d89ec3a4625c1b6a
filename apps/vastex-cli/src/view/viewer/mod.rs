//! A window with a source in it: what happens to it, and when its next frame is due. How a frame comes about
//! is in `drawing`.

mod anew;
mod below;
mod chosen;
mod drawing;
mod first_range;
mod hud;
mod layers;
mod measuring;
mod notices;
mod outgoing;
mod panel;
mod panes;
mod pools;
#[cfg(feature = "volumes")]
mod volume;

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Result;
use glam::DVec2;
use vastex::diagnostics::{FrameStats, PoolStats};
use vastex::{Event, FeedbackMode, Filter, Preparer, Settings, Textures, ViewId};
use vastex_scenes::{Gpu, LayerOptions, Overlay, Pose, Scene};
use vastex_viewer::camera::Aspects;
use vastex_viewer::inspect;
use vastex_viewer::panels::{DisplayPanel, Measure, Messages, Minimap, Shapes};
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window;

use super::bookmarks::Bookmarks;
use super::device::{default_fade, device_for};
use super::display::Display;
use super::displayed::{DisplaySettings, Displayed};
use super::opening::PreparedSource;
use super::panel::{Asked, Panel};
use super::recent::Recent;
use super::remembered::Remembered;
use super::shell::Shell;
use super::surface::Surface;
use super::times::Times;
use super::title::Title;
use crate::args::ViewArgs;
use crate::commands::render;
use crate::report;
use anew::Anew;
pub(super) use anew::MadeAnew;
use below::Below;
use chosen::Chosen;
use first_range::FirstRanges;
use hud::WindowHud;
pub(super) use panel::DIALOG;

/// Frames after a change of the view in which nothing is taken for settled: feedback is on its way for some,
/// and a whole jitter cycle belongs to a view.
const UNSETTLED_FRAMES: u32 = 24;
/// Between two frames of a window that shows nothing, or that only waits for tiles to be tried again.
const SLOW: Duration = Duration::from_millis(250);

/// When the next frame is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wake {
    Now,
    After(Duration),
    /// When something happens to the window.
    OnEvent,
}

impl Wake {
    /// The same, or in so long if that is earlier.
    fn no_later(self, pause: Duration) -> Wake {
        match self {
            Wake::Now => Wake::Now,
            Wake::After(before) => Wake::After(before.min(pause)),
            Wake::OnEvent => Wake::After(pause),
        }
    }
}

/// A window, and what is displayed in it.
pub(super) struct Viewer {
    gpu: Gpu,
    window: Arc<Window>,
    surface: Surface,
    textures: Textures,
    settings: DisplaySettings,
    display: Display<Displayed>,
    /// A volume in its place.
    #[cfg(feature = "volumes")]
    volume: Option<Box<volume::VolumeShown>>,
    /// Name of the file that is being opened, and how much of it is done, 0 to 1.
    opening: Option<(String, f64)>,
    /// Frames of sources, those of previews left out.
    frames: u64,
    /// When the last frame was drawn, and whether the next follows without a pause.
    drawn_at: Option<Instant>,
    is_busy: bool,
    unsettled: u32,
    is_hidden: bool,
    /// Where the pointer is in the view, if it is over it.
    pointer: Option<DVec2>,
    /// The pane that the pointer belongs to, and whether a button or a finger keeps it there.
    pane: u32,
    pane_is_held: bool,
    /// That a pool is too small, until the view has settled and it is said; it is said once.
    shortage: Option<Event>,
    is_shortage_reported: bool,
    title: Title,
    shell: Shell,
    panel: Panel,
    /// Shapes over the source of an opening, and its number.
    shapes: Option<(u64, Arc<Shapes>)>,
    /// A map of each pane.
    minimaps: Vec<Minimap>,
    /// What went wrong, until it is read.
    messages: Messages,
    hud: WindowHud,
    chosen: Chosen,
    /// Textures that are wanted in the place of these.
    anew: Anew,
    /// How layers are displayed of a file in which nobody has changed that, and the opening of the one in
    /// which somebody may have.
    first_layers: Vec<LayerOptions>,
    layers_of: u64,
    first_ranges: FirstRanges,
    /// True if the files beside it that are asked for are those of the file that is displayed next, as the
    /// command line and links name them; else they went with the one before.
    is_asked: bool,
    /// What flickers does so by the time since then.
    begun: Instant,
    /// The values in view, for the panel, and whether they are those of the settled view.
    values: Option<panel::Values>,
    /// What the last frame had to say.
    shown_notice: Option<String>,
    below: Below,
    /// Pixels of which a person asked to be told in words.
    to_print: Vec<[u32; 2]>,
    /// What was asked for in the panel and is the host's to do.
    asked: Vec<Asked>,
    /// What is measured, if that is asked for.
    pub(super) times: Option<Times>,
}

impl Viewer {
    /// Sets everything up on a device of its own, with nothing to display; as it was before, where the
    /// arguments do not say otherwise. What of that cannot be had is added to the notes.
    pub(super) fn new(
        (args, before, notes): (&ViewArgs, &Remembered, &mut Vec<String>),
        scene: Scene,
        window: Arc<Window>,
        display: OwnedDisplayHandle,
    ) -> Result<Viewer> {
        let (gpu, surface) = device_for(&window, display)?;
        let (fade, args) = (args.fade_ms.map_or(default_fade(&gpu), Duration::from_millis), &args.scene);
        let settings = Settings { fade, ..render::settings(args)? };
        let mut chosen = Chosen::before(before, args, &settings);
        let textures = chosen.textures(&gpu, settings, notes)?;
        let surface = Surface::new(&gpu, window.clone(), surface)?;
        Ok(Viewer {
            gpu,
            shell: Shell::new(window.clone()),
            panel: Panel::new(Recent::load(), Bookmarks::load()),
            shapes: None,
            minimaps: Vec::new(),
            messages: Messages::default(),
            hud: WindowHud::default(),
            chosen,
            anew: Anew::default(),
            first_layers: args.shown().layers,
            layers_of: 0,
            first_ranges: FirstRanges::default(),
            is_asked: true,
            begun: Instant::now(),
            values: None,
            shown_notice: None,
            below: Below::default(),
            asked: Vec::new(),
            to_print: Vec::new(),
            window,
            surface,
            textures,
            settings: DisplaySettings {
                scene,
                options: args.shown(),
                overlay: args.overlay(),
                may_be_crisp: args.filter() == Filter::default(),
                range_is_free: args.range_is_free(),
            },
            display: Display::Empty,
            #[cfg(feature = "volumes")]
            volume: None,
            opening: None,
            frames: 0,
            drawn_at: None,
            is_busy: false,
            unsettled: UNSETTLED_FRAMES,
            is_hidden: false,
            pointer: None,
            pane: 0,
            pane_is_held: false,
            shortage: None,
            is_shortage_reported: false,
            title: Title::default(),
            times: None,
        })
    }

    /// What reads a source before it can be displayed.
    pub(super) fn preparer(&self) -> Preparer {
        self.textures.preparer()
    }

    /// Returns true if there is anything to see.
    pub(super) fn is_empty(&self) -> bool {
        self.display.displayed().is_none() && !self.shows_volume()
    }

    /// Another file is being opened.
    pub(super) fn begin_opening(&mut self, name: &str) -> Result<()> {
        self.title.forget_notice();
        self.set_opening(name, 0.0)
    }

    /// A file is being opened, and so much of it is done, 0 to 1. What is displayed stays until there is
    /// something to see of it; what has come of its preview is drawn.
    pub(super) fn set_opening(&mut self, name: &str, share: f64) -> Result<()> {
        self.opening = Some((name.to_owned(), share));
        self.catch_up()
    }

    /// No file is being opened any more. What has come of the last one is drawn.
    pub(super) fn end_opening(&mut self) -> Result<()> {
        self.opening = None;
        self.catch_up()
    }

    fn catch_up(&mut self) -> Result<()> {
        if let Some(displayed) = self.display.displayed_mut()
            && displayed.catch_up(&mut self.textures)?
        {
            self.wake();
        }
        Ok(())
    }

    /// Displays a preview of the source that an opening will bring. Says which scene it is on.
    pub(super) fn show_preview(&mut self, opening: u64, name: &str, source: PreparedSource) -> Result<Scene> {
        let preview = self.displayed(opening, name, source)?;
        self.settings.scene = preview.renderer.scene();
        let gone = self.display.show_preview(opening, preview);
        self.remove(gone);
        Ok(self.settings.scene)
    }

    /// Displays the source that an opening brought: in the place of its preview as soon as it is as sharp,
    /// else at once. Says which scene it is on: an image where it cannot go on the one that is displayed, as
    /// on a terrain without heights.
    pub(super) fn show_source(&mut self, opening: u64, name: &str, source: PreparedSource) -> Result<Scene> {
        let source = self.displayed(opening, name, source)?;
        // A picture that says itself what it wants cannot be behind another one.
        let is_inline = self.textures.inspect().feedback_mode() == FeedbackMode::Inline;
        let may_be_behind = !is_inline && self.settings.overlay.is_none();
        self.settings.scene = source.renderer.scene();
        let gone = self.display.show_source(opening, source, may_be_behind, Instant::now());
        self.remove(gone);
        Ok(self.settings.scene)
    }

    fn displayed(&mut self, opening: u64, name: &str, source: PreparedSource) -> Result<Displayed> {
        let (mut settings, may_be_image) = (self.settings.clone(), !self.is_empty());
        // Another file has other layers and other values.
        let is_other = self.layers_of != opening;
        if is_other {
            // Those of other files come when these are laid over it.
            let layers = self.first_layers.iter().filter(|layer| layer.texture == 0);
            settings.options.layers = self.chosen.filtered(layers.cloned().collect(), 1);
            if !self.is_asked {
                settings.options.forget_textures_beside();
            }
        }
        let source = (name, source);
        let made =
            Displayed::new(&self.gpu, &mut self.textures, &self.surface, &settings, may_be_image, source)?;
        if is_other {
            self.is_asked = false;
            (self.layers_of, self.settings, self.panel.display) =
                (opening, settings, DisplayPanel::default());
            self.panel.measure.iter_mut().for_each(|measure| *measure = Measure::default());
        }
        self.change_pools_again();
        Ok(made)
    }

    /// Returns true if anything has been displayed so far.
    pub(super) fn has_displayed(&self) -> bool {
        self.layers_of > 0
    }

    /// What is displayed is another one than before.
    fn remove(&mut self, gone: impl IntoIterator<Item = Displayed>) {
        gone.into_iter().for_each(|gone| gone.remove(&mut self.textures));
        #[cfg(feature = "volumes")]
        self.forget_volume();
        if let Some(displayed) = self.display.displayed() {
            self.surface.set_format(&displayed.format);
        }
        self.is_shortage_reported = false;
        self.values = None;
        self.minimaps.clear();
        self.jumped();
    }

    /// Displays a source in the place of its preview at once, if one waits behind it.
    fn finish_taking_over(&mut self) {
        if let Some(preview) = self.display.finish() {
            self.remove([preview]);
        }
    }

    /// Goes on with a device of its own after this one's was lost. What was read stays, and the view is sharp
    /// again as soon as it is uploaded.
    pub(super) fn restored(mut self, display: OwnedDisplayHandle) -> Result<Viewer> {
        self.finish_taking_over();
        self.shell.forget_device();
        self.hud.forget_device();
        let Viewer { window, mut textures, display: displayed, surface, gpu, settings, .. } = self;
        // A window has one surface at a time.
        drop((surface, gpu));
        let (gpu, surface) = device_for(&window, display)?;
        textures.memory().restore(&gpu.device, &gpu.queue)?;
        let mut surface = Surface::new(&gpu, window.clone(), surface)?;
        let displayed = displayed.try_map(|source| source.restored(&gpu, &textures, &surface, &settings))?;
        displayed.displayed().iter().for_each(|source| surface.set_format(&source.format));
        let unsettled = UNSETTLED_FRAMES;
        let mut restored =
            Viewer { gpu, window, surface, textures, display: displayed, settings, unsettled, ..self };
        restored.want_anew_again();
        #[cfg(feature = "volumes")]
        restored.restore_volume()?;
        Ok(restored)
    }

    /// Columns and rows of the image.
    pub(super) fn image_size(&self) -> [u32; 2] {
        self.display.displayed().map_or([1; 2], |source| source.size)
    }

    /// Width over height of the view and of the image.
    pub(super) fn aspects(&self) -> Aspects {
        let [width, height] = self.size();
        let image = self.display.displayed().map_or(1.0, |source| source.renderer.image_aspect());
        [f64::from(width) / f64::from(height), image]
    }

    /// Frames of sources drawn so far, those of previews left out.
    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    /// The window has another size.
    pub(super) fn resize(&mut self, size: [u32; 2]) {
        self.surface.resize(size);
        let area = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
        // Smaller pools can wait until nothing of the larger picture is wanted any more.
        if area(self.surface.size()) > area(self.textures.inspect().settings().picture) {
            self.fit_pools();
        }
        self.jumped();
    }

    /// Makes pools that have no size of their own as large as the picture needs.
    fn fit_pools(&mut self) {
        if let Err(error) = self.textures.memory().set_picture(self.surface.size()) {
            // The pools are as they were: the picture is drawn all the same, if need be coarser.
            report::say(&format!("{}: the pools keep their size: {error}", self.name()));
        }
    }

    /// The view changes.
    pub(super) fn wake(&mut self) {
        self.unsettled = UNSETTLED_FRAMES;
        self.values.iter_mut().for_each(panel::Values::age);
        self.minimaps.iter_mut().for_each(Minimap::age);
    }

    /// The view is a wholly different one from here on.
    pub(super) fn jumped(&mut self) {
        if let Ok(mut view) = self.textures.view_mut(ViewId::MAIN) {
            view.cut();
        }
        self.wake();
    }

    fn name(&self) -> &str {
        #[cfg(feature = "volumes")]
        if let Some(volume) = &self.volume {
            return &volume.name;
        }
        let opening = || self.opening.as_ref().map(|(name, _)| &**name);
        self.display.displayed().map(|source| &*source.name).or_else(opening).unwrap_or("vastex")
    }

    /// Says something to the person at the window, in its title and on stderr.
    pub(super) fn notify(&mut self, notice: &str) {
        report::say(&format!("{}: {notice}", self.name()));
        self.notify_in_title(notice);
    }

    /// Says something in the title alone.
    pub(super) fn notify_in_title(&mut self, notice: &str) {
        self.title.notify(notice.to_owned(), Instant::now());
    }

    /// Says what went wrong, in the window until it is read; a second message of a topic takes the place of
    /// the first.
    pub(super) fn tell(&mut self, topic: &str, message: &str) {
        self.messages.add(topic, message);
        self.window.request_redraw();
    }

    /// Puts what is displayed on something else. It may not go there: a terrain needs heights.
    pub(super) fn put_on(&mut self, scene: Scene) -> Result<()> {
        let settings = DisplaySettings { scene, ..self.settings.clone() };
        self.finish_taking_over();
        if let Some(source) = self.display.displayed_mut() {
            source.put_on(&self.gpu, &mut self.textures, &settings)?;
        }
        self.settings = settings;
        self.jumped();
        Ok(())
    }

    /// Draws the next overlay in the place of the picture; after the last, the picture.
    pub(super) fn next_overlay(&mut self) {
        self.show_overlay(Overlay::next(self.settings.overlay));
    }

    /// Draws an overlay in the place of the picture, or the picture.
    pub(super) fn show_overlay(&mut self, overlay: Option<Overlay>) {
        self.settings.overlay = overlay;
        self.finish_taking_over();
        if let Some(source) = self.display.displayed_mut() {
            source.draw_overlay(&self.gpu, &self.textures, overlay);
        }
    }

    /// Asks why a pixel shows what it shows; one of the next frames has the answer.
    pub(super) fn explain(&mut self, pose: Pose, pixel: [u32; 2]) -> Result<()> {
        let Some(Displayed { renderer, .. }) = self.display.displayed() else { return Ok(()) };
        let (panes, size) = (self.panes(), self.surface.size());
        let asked = (renderer, renderer.camera(), &pose);
        let stretched = panes.stretched(DVec2::new(pixel[0].into(), pixel[1].into()));
        let pixel = [(stretched.x as u32).min(size[0] - 1), pixel[1]];
        inspect::ask(&self.gpu, &mut self.textures, asked, size, pixel)?;
        self.to_print.push(pixel);
        Ok(())
    }

    /// When the next frame is due; `awake` says that the view will change by itself.
    pub(super) fn next_frame(&mut self, awake: bool) -> Wake {
        let stats = self.textures.stats();
        let wake = match () {
            () if self.is_hidden => Wake::After(SLOW),
            #[cfg(feature = "volumes")]
            () if self.volume.is_some() && !awake => {
                self.volume.as_ref().map_or(Wake::OnEvent, |volume| self.next_frame_of_volume(volume))
            }
            () if self.is_empty() => {
                self.title.notice_left(Instant::now()).map_or(Wake::OnEvent, Wake::After)
            }
            // Each frame looks for answers, also where nothing moves.
            () if awake || self.textures.pixels().asked() > 0 || self.display.next().is_some() => Wake::Now,
            () if !self.is_settled(&stats) || self.hud.is_due() => Wake::Now,
            () if stats.pager.failed > 0 => Wake::After(SLOW),
            () => self.title.notice_left(Instant::now()).map_or(Wake::OnEvent, Wake::After),
        };
        // What is said is seen in the next frame, and gone in the one after its time.
        let wake = if self.title.notice() != self.shown_notice.as_deref() { Wake::Now } else { wake };
        let wake = match self.shell.due_in(Instant::now()) {
            Some(due) if due.is_zero() => Wake::Now,
            Some(due) => wake.no_later(due),
            None => wake,
        };
        let others = [self.flickers_in(), self.below.due_in(Instant::now())];
        let wake = others.into_iter().flatten().filter(|_| !self.is_hidden).fold(wake, Wake::no_later);
        self.is_busy = wake == Wake::Now;
        wake
    }

    /// Returns true if the picture stays as it is: everything is there, and no mip bias is about to fall.
    fn is_settled(&self, stats: &FrameStats) -> bool {
        let is_falling = |pool: &PoolStats| pool.pager.bias_eighths > 0 && pool.fits();
        let at_rest = stats.converged && stats.fading == 0 && self.unsettled == 0;
        at_rest && !stats.pools.iter().any(is_falling)
    }
}
