//! A scene in a window: how a frame comes about, and when the next one is due.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use vastex::diagnostics::{ExplainedPixel, FrameStats, PoolStats};
use vastex::{Event, Settings, TextureId, Textures, TileSource, ViewId};
use vastex_core::Dims;
use vastex_scenes::{
    DisplayOptions, Gpu, Layers, Overlay, OverlayRenderer, Pose, Relief, Scene, SceneDesc, SceneRenderer,
};
use vastex_viewer::camera::Aspects;
use vastex_viewer::inspect;
use vastex_viewer::stage::{Frame, Pictures, StageView};
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window;

use super::surface::Surface;
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

/// When the next frame is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wake {
    Now,
    After(Duration),
    /// When something happens to the window.
    OnEvent,
}

/// A scene in a window, and what is shown of it.
pub(super) struct Viewer {
    gpu: Gpu,
    window: Arc<Window>,
    surface: Surface,
    textures: Textures,
    texture: TextureId,
    shown: DisplayOptions,
    /// The heights of the texture, once a scene has needed them.
    relief: Option<Relief>,
    renderer: SceneRenderer,
    /// What is drawn in the place of the picture, if anything.
    overlay: Option<OverlayRenderer>,
    /// Name of the source, for the title.
    name: String,
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

impl Viewer {
    /// Sets everything up on a device of its own.
    pub(super) fn new(
        args: &ViewArgs,
        scene: Scene,
        source: Arc<dyn TileSource>,
        window: Arc<Window>,
        display: OwnedDisplayHandle,
    ) -> Result<Viewer> {
        let (gpu, surface) = device_for(&window, display)?;
        let (fade, args) = (args.fade_ms.map_or(default_fade(&gpu), Duration::from_millis), &args.scene);
        let settings = Settings { fade, ..settings(args)? };
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings)?;
        let texture = textures.add_blocking(source)?;
        let name = args.source.file_name().unwrap_or_default().to_string_lossy().into_owned();
        textures.texture_mut(texture)?.set_name(name.clone());
        let shown = args.shown();
        let mut relief = None;
        let drawn = described(scene, &shown, &mut textures, texture, &mut relief)?;
        let surface = Surface::new(&gpu, window.clone(), surface, &drawn.layers)?;
        let renderer = SceneRenderer::new(&gpu, &textures, drawn, surface.drawn_format())?;
        let overlay = args
            .overlay
            .map(|overlay| OverlayRenderer::new(&gpu.device, &textures, &renderer, overlay))
            .transpose()?;
        Ok(Viewer {
            overlay,
            gpu,
            window,
            surface,
            textures,
            texture,
            shown,
            relief,
            renderer,
            name,
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

    /// Goes on with a device of its own after this one's was lost. What was read stays, and the view is sharp again as soon as it is
    /// uploaded.
    pub(super) fn restored(self, display: OwnedDisplayHandle) -> Result<Viewer> {
        let Viewer { window, mut textures, renderer, overlay, surface, gpu, shown, relief, .. } = self;
        let overlay = overlay.map(|overlay| overlay.overlay());
        let drawn = SceneDesc {
            scene: renderer.scene(),
            layers: renderer.layers().clone(),
            relief: relief.clone().filter(|_| renderer.has_relief()),
            tiling: shown.tiling,
            always_fixed: shown.always_fixed,
        };
        // A window has one surface at a time.
        drop((renderer, surface, gpu));
        let (gpu, surface) = device_for(&window, display)?;
        textures.memory().restore(&gpu.device, &gpu.queue)?;
        let surface = Surface::new(&gpu, window.clone(), surface, &drawn.layers)?;
        let renderer = SceneRenderer::new(&gpu, &textures, drawn, surface.drawn_format())?;
        let overlay = overlay
            .map(|overlay| OverlayRenderer::new(&gpu.device, &textures, &renderer, overlay))
            .transpose()?;
        let unsettled = UNSETTLED_FRAMES;
        Ok(Viewer { gpu, window, surface, textures, renderer, overlay, unsettled, shown, relief, ..self })
    }

    /// Width and height of the view in pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        self.surface.size()
    }

    /// Width over height of the view and of the image.
    pub(super) fn aspects(&self) -> Aspects {
        let [width, height] = self.size();
        [f64::from(width) / f64::from(height), self.renderer.image_aspect()]
    }

    /// Frames drawn so far.
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
            report::say(&format!("{}: the pools keep their size: {error}", self.name));
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

    /// Says something to the person at the window, in its title and on stderr.
    pub(super) fn notify(&mut self, notice: &str) {
        report::say(&format!("{}: {notice}", self.name));
        self.title.notify(notice.to_owned(), Instant::now());
    }

    /// Puts the texture on something else. It may not go there: a terrain needs heights.
    pub(super) fn show(&mut self, scene: Scene) -> Result<()> {
        let (shown, textures) = (&self.shown, &mut self.textures);
        let drawn = described(scene, shown, textures, self.texture, &mut self.relief)?;
        let renderer = SceneRenderer::new(&self.gpu, &self.textures, drawn, self.surface.drawn_format())?;
        let before = std::mem::replace(&mut self.renderer, renderer);
        before.layers().clone().remove(&mut self.textures);
        self.draw_overlay(self.overlay.as_ref().map(OverlayRenderer::overlay));
        self.jumped();
        Ok(())
    }

    /// Draws the next overlay in the place of the picture; after the last, the picture.
    pub(super) fn next_overlay(&mut self) {
        self.draw_overlay(Overlay::next(self.overlay.as_ref().map(OverlayRenderer::overlay)));
    }

    fn draw_overlay(&mut self, overlay: Option<Overlay>) {
        let device = &self.gpu.device;
        self.overlay = overlay
            .and_then(|overlay| OverlayRenderer::new(device, &self.textures, &self.renderer, overlay).ok());
    }

    /// Asks why a pixel shows what it shows; one of the next frames tells it.
    pub(super) fn explain(&mut self, pose: Pose, pixel: [u32; 2]) -> Result<()> {
        let (renderer, size) = (&self.renderer, self.surface.size());
        let asked = (renderer, renderer.camera(), &pose);
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
            () if awake || self.textures.pixels().asked() > 0 => Wake::Now,
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
        let shown = self.surface.acquire();
        if !matches!(shown, Ok(Some(_))) {
            self.textures.inspect().check_device()?; // a lost one is the reason, whatever the window says
        }
        let shown = shown?;
        self.is_hidden = shown.is_none();
        let Some(shown) = shown else { return Ok(()) };
        self.renderer.set_pose(&self.gpu.queue, &self.textures, &pose, self.surface.size());
        let renderer = &self.renderer;
        if let Some(overlay) = &mut self.overlay {
            overlay.look(&self.gpu.device, &self.gpu.queue, &self.textures, renderer, self.surface.size())?;
        }
        let now = Instant::now();
        if let Some(before) = self.drawn_at.replace(now) {
            self.textures.set_frame_time(now.duration_since(before));
            if self.is_busy {
                self.title.count_frame(now.duration_since(before));
            }
        }
        let views = [StageView { view: ViewId::MAIN, camera: renderer.camera(), pose }];
        // An overlay hides the picture.
        let pictures = if self.overlay.is_some() { Pictures::ForFeedback } else { Pictures::Always };
        let frame = Frame {
            views: &views,
            expected: None,
            picture: self.surface.size(),
            has_feedback: true,
            pictures,
        };
        let target = self.surface.target(&shown.view);
        let mut encoder = frame.record(&self.gpu, &mut self.textures, renderer, &target, |_, _| Ok(()))?;
        if let Some(overlay) = &self.overlay {
            overlay.draw(&mut encoder, &self.renderer, &self.textures, &target);
            target.encode(&mut encoder);
        }
        self.gpu.queue.submit([encoder.finish()]);
        self.surface.present(shown);
        // While the first picture is looked at.
        self.renderer.compile_all();
        self.print_explained()?;
        self.frames += 1;
        self.unsettled = self.unsettled.saturating_sub(1);
        if self.unsettled == 0 && self.textures.inspect().settings().picture != self.surface.size() {
            self.fit_pools();
        }
        self.tell(pose);
        Ok(())
    }

    /// Says what happened, on stderr and in the title.
    fn tell(&mut self, pose: Pose) {
        while let Some(event) = self.textures.poll_event() {
            match &event {
                Event::Failed { page, why, .. } => {
                    let (name, pos) = (&self.name, page.pos(Dims::D2));
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
        let Ok(texture) = self.textures.texture(self.texture) else { return };
        let [width, height, _] = texture.description().geometry.size();
        let scale = pose.magnification(self.surface.size(), [width, height]);
        let shown = TitleParts {
            name: &self.name,
            size: [width, height],
            scene: scale.map_or_else(|| Scale::On(self.renderer.scene().name()), Scale::Even),
            overlay: self.overlay.as_ref().map(|overlay| overlay.overlay().name()),
            stats: &stats,
            is_settled,
        };
        if let Some(title) = self.title.due(Instant::now(), &shown) {
            self.window.set_title(title);
        }
    }
}

/// A scene with what is asked to be shown of a texture. Its heights, if the scene has any, are looked for once.
fn described(
    scene: Scene,
    shown: &DisplayOptions,
    textures: &mut Textures,
    texture: TextureId,
    known: &mut Option<Relief>,
) -> Result<SceneDesc> {
    let layers = shown.layers_of(textures, texture)?;
    if known.is_none() {
        *known = shown.relief_of(scene, textures, layers[0].layer)?;
    }
    let relief = known.clone().filter(|_| shown.displaces(scene));
    let layers = Layers::new(textures, layers, relief.as_ref().map(Relief::layer))?;
    Ok(SceneDesc { scene, layers, relief, tiling: shown.tiling, always_fixed: shown.always_fixed })
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
