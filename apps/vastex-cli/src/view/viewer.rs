//! A window with a source in it: how a frame comes about, and when the next one is due.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use vastex::diagnostics::{ExplainedPixel, FrameStats, PoolStats};
use vastex::{Event, FeedbackMode, Preparer, Settings, Textures, ViewId};
use vastex_core::Dims;
use vastex_scenes::{Gpu, Overlay, Pose, Scene};
use vastex_viewer::camera::Aspects;
use vastex_viewer::inspect;
use vastex_viewer::layers::BACKGROUND;
use vastex_viewer::stage::{self, Pictures, StageView, draw_again};
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window;

use super::opening::Arrival;
use super::shown::{Showing, Shown};
use super::surface::{self, Surface};
use super::title::{Scale, Title, TitleParts};
use crate::args::ViewArgs;
use crate::commands::render::settings;
use crate::explained::Explained;
use crate::{gpu, report, shortage};

/// Frames after a change of the view in which nothing is taken for settled: feedback is on its way for some, and a
/// whole jitter cycle belongs to a view.
const UNSETTLED_FRAMES: u32 = 24;
/// Between two frames of a window that shows nothing, or that only waits for tiles to be tried again.
const SLOW: Duration = Duration::from_millis(250);
/// Frames after which what a source wants is known, and how long it is waited for at most before it is shown.
const FIRST_WANTED: u32 = 8;
const LONGEST_WAIT: Duration = Duration::from_secs(1);

/// When the next frame is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wake {
    Now,
    After(Duration),
    /// When something happens to the window.
    OnEvent,
}

/// A window, and what is shown in it.
pub(super) struct Viewer {
    gpu: Gpu,
    window: Arc<Window>,
    surface: Surface,
    textures: Textures,
    showing: Showing,
    shown: Option<Shown>,
    /// What takes its place as soon as it is sharp.
    next: Option<Next>,
    /// Whether what is shown stands for a source that is still being opened.
    is_coarse: bool,
    /// How much is done of a source that is being opened, 0 to 1.
    opening: Option<f64>,
    /// Frames of whole sources.
    frames: u64,
    /// When the last frame was drawn, and whether the next follows without a pause.
    drawn_at: Option<Instant>,
    is_busy: bool,
    unsettled: u32,
    is_hidden: bool,
    /// That a pool is too small, until the view has settled and it is said; it is said once.
    shortage: Option<Event>,
    is_shortage_told: bool,
    title: Title,
}

/// A source that is loaded behind another one.
struct Next {
    shown: Shown,
    since: Instant,
    frames: u32,
}

impl Viewer {
    /// Sets everything up on a device of its own, with nothing to show.
    pub(super) fn new(
        args: &ViewArgs,
        scene: Scene,
        window: Arc<Window>,
        display: OwnedDisplayHandle,
    ) -> Result<Viewer> {
        let (gpu, surface) = device_for(&window, display)?;
        let (fade, args) = (args.fade_ms.map_or(default_fade(&gpu), Duration::from_millis), &args.scene);
        let settings = Settings { fade, ..settings(args)? };
        let textures = Textures::new(&gpu.device, &gpu.queue, settings)?;
        let surface = Surface::new(&gpu, window.clone(), surface)?;
        Ok(Viewer {
            gpu,
            window,
            surface,
            textures,
            showing: Showing { scene, options: args.shown(), overlay: args.overlay },
            shown: None,
            next: None,
            is_coarse: false,
            opening: None,
            frames: 0,
            drawn_at: None,
            is_busy: false,
            unsettled: UNSETTLED_FRAMES,
            is_hidden: false,
            shortage: None,
            is_shortage_told: false,
            title: Title::default(),
        })
    }

    /// What reads a source before it can be shown.
    pub(super) fn preparer(&self) -> Preparer {
        self.textures.preparer()
    }

    /// A source is being opened. What is shown stays until there is something to show of it.
    pub(super) fn begin(&mut self, name: &str) {
        self.opening = Some(0.0);
        if self.shown.is_none() {
            self.window.set_title(&format!("{name} – opening"));
        }
        self.wake();
    }

    /// So much of it is done, 0 to 1; nothing where it is there, or where there will be none. What has come of its picture is
    /// drawn.
    pub(super) fn progressed(&mut self, opening: Option<f64>) -> Result<()> {
        self.opening = opening;
        if let Some(shown) = &mut self.shown
            && shown.catch_up(&mut self.textures)?
        {
            self.wake();
        }
        Ok(())
    }

    /// Shows a source in the place of what is shown: at once, or, where it is the whole of what is shown already, as soon as it
    /// is as sharp.
    pub(super) fn show(&mut self, name: &str, arrival: Arrival, is_coarse: bool) -> Result<()> {
        let shown = Shown::new(&self.gpu, &mut self.textures, &self.surface, &self.showing, (name, arrival))?;
        self.drop_next();
        let takes_over = std::mem::replace(&mut self.is_coarse, is_coarse) && !is_coarse;
        // A picture that says itself what it wants cannot be behind another one.
        let is_inline = self.textures.inspect().feedback_mode() == FeedbackMode::Inline;
        match &self.shown {
            Some(_) if takes_over && !is_inline && self.showing.overlay.is_none() => {
                self.next = Some(Next { shown, since: Instant::now(), frames: 0 });
            }
            _ => self.replace(shown),
        }
        self.wake();
        Ok(())
    }

    fn replace(&mut self, shown: Shown) {
        self.surface.wear(&shown.suit);
        if let Some(before) = self.shown.replace(shown) {
            before.remove(&mut self.textures);
        }
        self.is_shortage_told = false;
        self.jumped();
    }

    fn drop_next(&mut self) {
        if let Some(next) = self.next.take() {
            next.shown.remove(&mut self.textures);
        }
    }

    /// Has the next source take its place, if it is time.
    fn take_next(&mut self) {
        let is_due = |next: &mut Next| {
            let is_sharp = next.frames >= FIRST_WANTED && self.textures.stats().converged;
            is_sharp || next.since.elapsed() > LONGEST_WAIT
        };
        if let Some(next) = self.next.take_if(is_due) {
            self.replace(next.shown);
        }
    }

    /// Goes on with a device of its own after this one's was lost. What was read stays, and the view is sharp again as soon as it is
    /// uploaded.
    pub(super) fn restored(mut self, display: OwnedDisplayHandle) -> Result<Viewer> {
        if let Some(next) = self.next.take() {
            self.replace(next.shown);
        }
        let Viewer { window, mut textures, shown, surface, gpu, showing, .. } = self;
        // A window has one surface at a time.
        drop((surface, gpu));
        let (gpu, surface) = device_for(&window, display)?;
        textures.memory().restore(&gpu.device, &gpu.queue)?;
        let mut surface = Surface::new(&gpu, window.clone(), surface)?;
        let shown = shown.map(|shown| shown.restored(&gpu, &textures, &surface, &showing)).transpose()?;
        shown.iter().for_each(|shown| surface.wear(&shown.suit));
        let unsettled = UNSETTLED_FRAMES;
        Ok(Viewer { gpu, window, surface, textures, shown, showing, unsettled, ..self })
    }

    /// Width and height of the view in pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        self.surface.size()
    }

    /// Width over height of the view and of the image.
    pub(super) fn aspects(&self) -> Aspects {
        let [width, height] = self.size();
        let image = self.shown.as_ref().map_or(1.0, |shown| shown.renderer.image_aspect());
        [f64::from(width) / f64::from(height), image]
    }

    /// Frames of whole sources drawn so far.
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
    }

    /// The view is a wholly different one from here on.
    pub(super) fn jumped(&mut self) {
        if let Ok(mut view) = self.textures.view_mut(ViewId::MAIN) {
            view.cut();
        }
        self.wake();
    }

    fn name(&self) -> &str {
        self.shown.as_ref().map_or("vastex", |shown| &shown.name)
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

    /// Puts what is shown on something else. It may not go there: a terrain needs heights.
    pub(super) fn put_on(&mut self, scene: Scene) -> Result<()> {
        let showing = Showing { scene, ..self.showing.clone() };
        self.finish_next();
        if let Some(shown) = &mut self.shown {
            shown.put_on(&self.gpu, &mut self.textures, &showing)?;
        }
        self.showing = showing;
        self.jumped();
        Ok(())
    }

    fn finish_next(&mut self) {
        if let Some(next) = self.next.take() {
            self.replace(next.shown);
        }
    }

    /// Draws the next overlay in the place of the picture; after the last, the picture.
    pub(super) fn next_overlay(&mut self) {
        self.showing.overlay = Overlay::next(self.showing.overlay);
        self.finish_next();
        if let Some(shown) = &mut self.shown {
            shown.draw_overlay(&self.gpu, &self.textures, self.showing.overlay);
        }
    }

    /// Asks why a pixel shows what it shows; one of the next frames tells it.
    pub(super) fn explain(&mut self, pose: Pose, pixel: [u32; 2]) -> Result<()> {
        let Some(Shown { renderer, .. }) = &self.shown else { return Ok(()) };
        let (asked, size) = ((renderer, renderer.camera(), &pose), self.surface.size());
        inspect::ask(&self.gpu, &mut self.textures, asked, size, pixel)?;
        Ok(())
    }

    /// Tells the answers that have arrived: in the title, and in full on stdout.
    fn print_explained(&mut self) -> Result<()> {
        for ExplainedPixel { pixel, explanations } in inspect::answers(&mut self.textures)? {
            let explained = Explained::new(pixel, &explanations);
            self.title.notify(explained.line(), Instant::now());
            report::print(&explained.text())?;
        }
        Ok(())
    }

    /// When the next frame is due; `awake` says that the view will change by itself.
    pub(super) fn next_frame(&mut self, awake: bool) -> Wake {
        let stats = self.textures.stats();
        let wake = match () {
            () if self.is_hidden => Wake::After(SLOW),
            // Each frame looks for answers, also where nothing moves.
            () if self.shown.is_none() => Wake::OnEvent,
            () if awake || self.textures.pixels().asked() > 0 || self.next.is_some() => Wake::Now,
            () if !self.is_settled(&stats) => Wake::Now,
            () if stats.pager.failed > 0 => Wake::After(SLOW),
            () => self.title.notice_left(Instant::now()).map_or(Wake::OnEvent, Wake::After),
        };
        self.is_busy = wake == Wake::Now;
        wake
    }

    /// Whether the picture stays as it is: everything is there, and no mip bias is about to fall.
    fn is_settled(&self, stats: &FrameStats) -> bool {
        let is_falling = |pool: &PoolStats| pool.pager.bias_eighths > 0 && shortage::fits(&pool.pager);
        let at_rest = stats.converged && stats.fading == 0 && self.unsettled == 0;
        at_rest && !stats.pools.iter().any(is_falling)
    }

    /// Draws and shows a frame, where the window shows any.
    pub(super) fn draw(&mut self, pose: Pose) -> Result<()> {
        self.take_next();
        let frame = self.surface.acquire();
        if !matches!(frame, Ok(Some(_))) {
            self.textures.inspect().check_device()?; // a lost one is the reason, whatever the window says
        }
        let frame = frame?;
        self.is_hidden = frame.is_none();
        let Some(frame) = frame else { return Ok(()) };
        let target = self.surface.target(&frame.view);
        let Some(shown) = &mut self.shown else {
            self.draw_nothing(frame);
            return Ok(());
        };
        let size = self.surface.size();
        if let Some(overlay) = &mut shown.overlay {
            shown.renderer.set_pose(&self.gpu.queue, &self.textures, &pose, size);
            overlay.look(&self.gpu.device, &self.gpu.queue, &self.textures, &shown.renderer, size)?;
        }
        let now = Instant::now();
        if let Some(before) = self.drawn_at.replace(now) {
            self.textures.set_frame_time(now.duration_since(before));
            if self.is_busy {
                self.title.count_frame(now.duration_since(before));
            }
        }
        // What comes next says what it wants, and what is shown is drawn as it is.
        let heard = self.next.as_ref().map_or(&shown.renderer, |next| &next.shown.renderer);
        let views = [StageView { view: ViewId::MAIN, camera: heard.camera(), pose }];
        // An overlay hides the picture.
        let is_behind = shown.overlay.is_some() || self.next.is_some();
        let pictures = if is_behind { Pictures::ForFeedback } else { Pictures::Always };
        let recorded =
            stage::Frame { views: &views, expected: None, picture: size, has_feedback: true, pictures };
        let mut encoder = recorded.record(&self.gpu, &mut self.textures, heard, &target, |_, _| Ok(()))?;
        if let Some(next) = &mut self.next {
            next.frames += 1;
            shown.renderer.set_pose(&self.gpu.queue, &self.textures, &pose, size);
            draw_again(&mut encoder, &self.textures, &shown.renderer, shown.renderer.camera(), &target);
        }
        if let Some(overlay) = &shown.overlay {
            overlay.draw(&mut encoder, &shown.renderer, &self.textures, &target);
            target.encode(&mut encoder);
        }
        self.gpu.queue.submit([encoder.finish()]);
        self.surface.present(frame);
        // While the first picture is looked at.
        shown.renderer.compile_all();
        self.print_explained()?;
        self.frames += u64::from(!self.is_coarse && self.next.is_none());
        self.unsettled = self.unsettled.saturating_sub(1);
        if self.unsettled == 0 && self.textures.inspect().settings().picture != self.surface.size() {
            self.fit_pools();
        }
        self.tell(pose);
        Ok(())
    }

    /// Fills the window where there is nothing to show yet.
    fn draw_nothing(&self, frame: surface::Frame) {
        let [r, g, b, a] = BACKGROUND.to_array().map(f64::from);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let ops = wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
            store: wgpu::StoreOp::Store,
        };
        let attachment = wgpu::RenderPassColorAttachment {
            view: &frame.view,
            depth_slice: None,
            resolve_target: None,
            ops,
        };
        drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(attachment)],
            ..Default::default()
        }));
        self.gpu.queue.submit([encoder.finish()]);
        self.surface.present(frame);
    }

    /// Says what happened, on stderr and in the title.
    fn tell(&mut self, pose: Pose) {
        while let Some(event) = self.textures.poll_event() {
            match &event {
                Event::Failed { page, why, .. } => {
                    let (name, pos) = (self.name(), page.pos(Dims::D2));
                    report::say(&format!("{name}: {pos} failed, a coarser one is shown instead: {why}"));
                }
                // A view that moves wants for a moment what it leaves as well as what it comes to.
                Event::Oversubscribed { .. } => self.shortage = Some(event),
                event => {
                    if let Some(shortage) = shortage::text(event, &self.textures) {
                        self.notify(&shortage);
                    }
                }
            }
        }
        let stats = self.textures.stats();
        let is_settled = self.is_settled(&stats);
        if is_settled && !self.is_shortage_told {
            let event = self.shortage.take().and_then(|event| shortage::at_rest(event, &stats.pools));
            if let Some(text) = event.and_then(|event| shortage::text(&event, &self.textures)) {
                self.is_shortage_told = true;
                self.notify(&text);
            }
        }
        let Some(Shown { name, size, renderer, overlay, .. }) = &self.shown else { return };
        let scale = pose.magnification(self.surface.size(), *size);
        let shown = TitleParts {
            name,
            size: *size,
            scene: scale.map_or_else(|| Scale::On(renderer.scene().name()), Scale::Even),
            overlay: overlay.as_ref().map(|overlay| overlay.overlay().name()),
            stats: &stats,
            is_settled,
            opening: self.opening,
        };
        if let Some(title) = self.title.due(Instant::now(), &shown) {
            self.window.set_title(title);
        }
    }
}

/// How long a tile fades in where nobody says: not at all where fading costs more than it is worth.
fn default_fade(gpu: &Gpu) -> Duration {
    match gpu.adapter.get_info().device_type {
        wgpu::DeviceType::Cpu => Duration::ZERO,
        _ => Duration::from_millis(150),
    }
}

/// A device that draws in the window, and the window's surface.
fn device_for(window: &Arc<Window>, display: OwnedDisplayHandle) -> Result<(Gpu, wgpu::Surface<'static>)> {
    let described = wgpu::InstanceDescriptor::new_with_display_handle_from_env(Box::new(display));
    let instance = pollster::block_on(vastex::instance_for(described));
    let surface = instance.create_surface(window.clone()).context(
        "no graphics driver draws in this window; install a Vulkan driver (on Debian and Ubuntu the software driver is \
         the package mesa-vulkan-drivers)",
    )?;
    let gpu = pollster::block_on(Gpu::for_surface(instance, Some(&surface)))?;
    gpu::report_refusals(&gpu);
    Ok((gpu, surface))
}
