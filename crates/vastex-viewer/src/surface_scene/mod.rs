//! Sources on a scene in a window, apart from any window (feature `egui`): an image, a plane, a globe or a
//! planet, files over it, and what lies over the picture and beside it.
//!
//! A host opens sources on threads of its own and hands them to a [`SurfaceScene`] once they are prepared;
//! the scene says which of them is displayed when, and how. The host runs egui and hands over a picture in
//! each frame ([`SurfaceScene::begin_frame`], [`SurfaceScene::show_panels`], [`SurfaceScene::record`],
//! [`SurfaceScene::end_frame`]); the scene says when the next one is due, and collects what there is to say
//! and what a person asks for that is the host's to do ([`Beside`]). Nothing here waits.

mod below;
mod display;
mod displayed;
mod first_ranges;
mod frames;
mod guided;
mod hud;
mod last_picture;
mod layers;
mod measuring;
mod panels;
mod panes;
mod picture_format;
mod remembering;
mod source;
mod unseen;
mod values;
mod view;
mod wake;

use std::sync::Arc;

use glam::DVec2;
use vastex::diagnostics::{FrameStats, PoolStats};
use vastex::{FeedbackMode, Preparer, Textures, ViewId};

use crate::beside::{Beside, CUT};
use crate::camera::{Aspects, Pose};
use crate::gpu::Gpu;
use crate::hud::Chosen;
use crate::inspect;
use crate::overlay::Overlay;
use crate::panels::{DisplayPanel, Measure, Minimap, Shapes};
use crate::scene::Scene;
use crate::stage::Clock;
use crate::surface::LayerOptions;
use below::Below;
pub use display::Display;
pub use displayed::{Blueprint, DisplaySettings, Displayed};
use first_ranges::FirstRanges;
pub use frames::MarkParts;
pub use guided::Guided;
use last_picture::LastPicture;
pub use picture_format::{PictureFormat, PictureFormats};
pub use source::{DisplayError, Growth, PreparedSource};
use values::Values;

/// Frames after a change of the view in which nothing is taken for settled: feedback is on its way for some,
/// and a whole jitter cycle belongs to a view.
const UNSETTLED_FRAMES: u32 = 24;

/// How files are displayed that nobody has changed anything of.
#[derive(Clone, Debug)]
pub struct FirstDisplay {
    /// The layers of a file.
    pub layers: Vec<LayerOptions>,
    /// What a file is displayed with, but for its layers.
    pub settings: DisplaySettings,
    /// True if files beside the one that is displayed next, as heights of its own, are those that the
    /// settings name; else these went with a file before.
    pub is_asked: bool,
}

/// Sources on a scene in a window.
pub struct SurfaceScene {
    gpu: Gpu,
    textures: Textures,
    formats: PictureFormats,
    /// Width and height of the window's pictures.
    size: [u32; 2],
    settings: DisplaySettings,
    display: Display<Displayed>,
    /// What stands beside the picture and over it, of the scene as well as of what takes its place.
    pub beside: Beside,
    /// Name of what is shown in the scene's place, if anything is.
    in_its_place: Option<String>,
    /// How layers are displayed of a file in which nobody has changed that, and the opening of the one in
    /// which somebody may have.
    first_layers: Vec<LayerOptions>,
    layers_of: u64,
    first_ranges: FirstRanges,
    is_asked: bool,
    /// A mode of feedback that is wanted in the place of the one that there is, and whether that is news.
    wanted_feedback: Option<FeedbackMode>,
    feedback_is_news: bool,
    unsettled: u32,
    last_picture: LastPicture,
    /// Where the pointer is in the view, if it is over it.
    pointer: Option<DVec2>,
    /// The pane that the pointer belongs to, and whether a button or a finger keeps it there.
    pane: u32,
    pane_is_held: bool,
    /// Shapes over the source of an opening, and its number.
    shapes: Option<(u64, Arc<Shapes>)>,
    /// A map of each pane.
    minimaps: Vec<Minimap>,
    /// The values in view, for the panel, and whether they are those of the settled view.
    values: Option<Values>,
    below: Below,
    /// Pixels of which a person asked to be told in words.
    to_tell: Vec<[u32; 2]>,
}

impl SurfaceScene {
    /// Nothing is displayed yet: in pictures of so many pixels, of these formats, with these textures on this
    /// device, as a person chose. Files are displayed as `first` says.
    pub fn new(
        (gpu, textures): (Gpu, Textures),
        (formats, size): (PictureFormats, [u32; 2]),
        first: FirstDisplay,
        chosen: Chosen,
        clock: Clock,
    ) -> SurfaceScene {
        SurfaceScene {
            gpu,
            textures,
            formats,
            size,
            settings: first.settings,
            display: Display::Empty,
            beside: Beside::new(chosen, clock),
            in_its_place: None,
            first_layers: first.layers,
            layers_of: 0,
            first_ranges: FirstRanges::default(),
            is_asked: first.is_asked,
            wanted_feedback: None,
            feedback_is_news: false,
            unsettled: UNSETTLED_FRAMES,
            last_picture: LastPicture::default(),
            pointer: None,
            pane: 0,
            pane_is_held: false,
            shapes: None,
            minimaps: Vec::new(),
            values: None,
            below: Below::default(),
            to_tell: Vec::new(),
        }
    }

    /// The device that draws.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The textures of the sources, to be asked about themselves.
    pub fn textures(&self) -> &Textures {
        &self.textures
    }

    /// The textures of the sources, to be told something, and for their events.
    pub fn textures_mut(&mut self) -> &mut Textures {
        &mut self.textures
    }

    /// What sources are displayed with.
    pub fn settings(&self) -> &DisplaySettings {
        &self.settings
    }

    /// What is displayed, and what takes its place.
    pub fn display(&self) -> &Display<Displayed> {
        &self.display
    }

    /// What reads a source before it can be displayed, on any thread.
    pub fn preparer(&self) -> Preparer {
        self.textures.preparer()
    }

    /// What the pictures of the window have to be for what is displayed; `None` if nothing is.
    pub fn format(&self) -> Option<&PictureFormat> {
        self.display.displayed().map(|source| &source.format)
    }

    /// Returns true if there is nothing to see, in the scene or in its place.
    pub fn is_empty(&self) -> bool {
        self.display.displayed().is_none() && self.in_its_place.is_none()
    }

    /// Another file is being opened.
    pub fn begin_opening(&mut self, name: &str) -> Result<(), DisplayError> {
        self.beside.title.forget_notice();
        self.set_opening(name, 0.0)
    }

    /// A file is being opened, and so much of it is done, 0 to 1. What is displayed stays until there is
    /// something to see of it; what has come of its preview is drawn.
    pub fn set_opening(&mut self, name: &str, share: f64) -> Result<(), DisplayError> {
        self.beside.opening = Some((name.to_owned(), share));
        self.catch_up()
    }

    /// No file is being opened any more. What has come of the last one is drawn.
    pub fn end_opening(&mut self) -> Result<(), DisplayError> {
        self.beside.opening = None;
        self.catch_up()
    }

    fn catch_up(&mut self) -> Result<(), DisplayError> {
        if let Some(displayed) = self.display.displayed_mut()
            && displayed.catch_up(&mut self.textures)?
        {
            self.wake();
        }
        Ok(())
    }

    /// Displays a preview of the source that an opening, by its number, will bring. Says which scene that is
    /// on.
    pub fn show_preview(
        &mut self,
        opening: u64,
        name: &str,
        source: PreparedSource,
    ) -> Result<Scene, DisplayError> {
        let preview = self.displayed(opening, name, source)?;
        self.settings.scene = preview.renderer.scene();
        let gone = self.display.show_preview(opening, preview);
        self.remove(gone);
        self.catch_up()?;
        Ok(self.settings.scene)
    }

    /// Displays the source that an opening brought: in the place of its preview as soon as it is as sharp,
    /// else at once. Says which scene it is on: an image where it cannot go on the one that is displayed, as
    /// on a terrain without heights.
    pub fn show_source(
        &mut self,
        opening: u64,
        name: &str,
        source: PreparedSource,
    ) -> Result<Scene, DisplayError> {
        let source = self.displayed(opening, name, source)?;
        // A picture that says itself what it wants cannot be behind another one.
        let is_inline = self.textures.inspect().feedback_mode() == FeedbackMode::Inline;
        let may_be_behind = !is_inline && self.settings.overlay.is_none();
        self.settings.scene = source.renderer.scene();
        let gone = self.display.show_source(opening, source, may_be_behind, self.beside.now());
        self.remove(gone);
        Ok(self.settings.scene)
    }

    fn displayed(
        &mut self,
        opening: u64,
        name: &str,
        source: PreparedSource,
    ) -> Result<Displayed, DisplayError> {
        let (mut settings, may_be_image) = (self.settings.clone(), !self.is_empty());
        // Another file has other layers and other values.
        let is_other = self.layers_of != opening;
        if is_other {
            // Those of other files come when these are laid over it.
            let layers = self.first_layers.iter().filter(|layer| layer.texture == 0);
            settings.options.layers = self.beside.chosen.filtered(layers.cloned().collect(), 1);
            if !self.is_asked {
                settings.options.forget_textures_beside();
            }
        }
        let source = (name, source);
        let made =
            Displayed::new(&self.gpu, &mut self.textures, &self.formats, &settings, may_be_image, source)?;
        if is_other {
            self.is_asked = false;
            (self.layers_of, self.settings) = (opening, settings);
            let panel = &mut self.beside.panel;
            panel.display = DisplayPanel::default();
            panel.measure.iter_mut().for_each(|measure| *measure = Measure::default());
        }
        self.change_pools_again();
        Ok(made)
    }

    /// What is displayed is another one than before.
    fn remove(&mut self, gone: impl IntoIterator<Item = Displayed>) {
        gone.into_iter().for_each(|gone| gone.remove(&mut self.textures));
        self.in_its_place = None;
        self.beside.forget(CUT);
        self.beside.shortage_is_said = false;
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

    /// Displays nothing, in whose place the host shows what an opening, by its number, brought: of this name,
    /// until the scene displays something again.
    pub fn give_way(&mut self, opening: u64, name: &str) {
        let before = std::mem::replace(&mut self.display, Display::Empty);
        self.remove(before.into_sources());
        self.layers_of = opening;
        self.is_asked = false;
        self.in_its_place = Some(name.to_owned());
    }

    /// Forgets that files beside the one that is displayed next were asked for ([`FirstDisplay::is_asked`]):
    /// they go with one that cannot be displayed.
    pub fn forget_asked(&mut self) {
        self.is_asked = false;
    }

    /// Sets how files are displayed at first, from the next one on. Returns what was set before.
    pub fn set_first_display(&mut self, asked: FirstDisplay) -> FirstDisplay {
        FirstDisplay {
            layers: std::mem::replace(&mut self.first_layers, asked.layers),
            settings: std::mem::replace(&mut self.settings, asked.settings),
            is_asked: std::mem::replace(&mut self.is_asked, asked.is_asked),
        }
    }

    /// Leaves a device that was lost, whose surface may be in the way of another one's.
    pub fn leave_device(&mut self) {
        self.finish_taking_over();
        self.beside.hud.forget_device();
    }

    /// Goes on with another device after [`SurfaceScene::leave_device`]. What was read stays, and the view is
    /// sharp again as soon as it is uploaded.
    pub fn restored(mut self, gpu: &Gpu, formats: PictureFormats) -> Result<SurfaceScene, DisplayError> {
        self.textures.memory().restore(&gpu.device, &gpu.queue)?;
        let SurfaceScene { textures, display, settings, .. } = self;
        let display = display.try_map(|source| source.restored(gpu, &textures, &formats, &settings))?;
        let gpu = gpu.clone();
        // The device before answers for nothing any more.
        let last_picture = LastPicture::default();
        let mut restored = SurfaceScene { gpu, textures, formats, display, settings, last_picture, ..self };
        restored.wake();
        // What was being made was for the device before.
        restored.feedback_is_news = restored.wanted_feedback.is_some();
        Ok(restored)
    }

    /// Columns and rows of the image.
    pub fn image_size(&self) -> [u32; 2] {
        self.display.displayed().map_or([1; 2], |source| source.size)
    }

    /// Width over height of the view and of the image.
    pub fn aspects(&self) -> Aspects {
        let [width, height] = self.size();
        let image = self.display.displayed().map_or(1.0, |source| source.renderer.image_aspect());
        [f64::from(width) / f64::from(height), image]
    }

    /// The window's pictures have another size.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.size = size;
        let area = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
        // Smaller pools can wait until nothing of the larger picture is wanted any more.
        if area(size) > area(self.textures.inspect().settings().picture) {
            self.fit_pools();
        }
        self.jumped();
    }

    /// Makes pools that have no size of their own as large as the picture needs.
    fn fit_pools(&mut self) {
        if let Err(error) = self.textures.memory().set_picture(self.size) {
            // The pools are as they were: the picture is drawn all the same, if need be coarser.
            let said = format!("{}: the pools keep their size: {error}", self.name());
            self.beside.log(said);
        }
    }

    /// The view changes.
    pub fn wake(&mut self) {
        self.unsettled = UNSETTLED_FRAMES;
        self.last_picture.forget();
        self.values.iter_mut().for_each(Values::age);
        self.minimaps.iter_mut().for_each(Minimap::age);
    }

    /// The view is a wholly different one from here on.
    pub fn jumped(&mut self) {
        if let Ok(mut view) = self.textures.view_mut(ViewId::MAIN) {
            view.cut();
        }
        self.wake();
    }

    /// Name of what is shown, or of what is being opened, for people.
    pub fn name(&self) -> &str {
        let opening = || self.beside.opening.as_ref().map(|(name, _)| &**name);
        let displayed = self.display.displayed().map(|source| &*source.name);
        self.in_its_place.as_deref().or(displayed).or_else(opening).unwrap_or("vastex")
    }

    /// Says something of what is shown: as a notice, and in the log.
    pub fn announce(&mut self, notice: &str) {
        let line = format!("{}: {notice}", self.name());
        self.beside.log(line);
        self.beside.notify(notice);
    }

    /// Says what went wrong of what is shown: as an error, and in the log.
    pub fn report_error(&mut self, topic: &str, message: &str) {
        let line = format!("error: {}: {message}", self.name());
        self.beside.log(line);
        self.beside.show_error(topic, message);
    }

    /// Puts what is displayed on something else. It may not go there: a terrain needs heights.
    pub fn put_on(&mut self, scene: Scene) -> Result<(), DisplayError> {
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
    pub fn next_overlay(&mut self) {
        self.show_overlay(Overlay::next(self.settings.overlay));
    }

    /// Draws an overlay in the place of the picture, or the picture.
    fn show_overlay(&mut self, overlay: Option<Overlay>) {
        self.settings.overlay = overlay;
        self.finish_taking_over();
        if let Some(source) = self.display.displayed_mut() {
            source.draw_overlay(&self.gpu, &self.textures, overlay);
        }
    }

    /// Asks why a pixel shows what it shows; [`SurfaceScene::take_explained`] has the answer after one of the
    /// next frames.
    pub fn explain(&mut self, pose: Pose, pixel: [u32; 2]) -> Result<(), DisplayError> {
        let Some(Displayed { renderer, .. }) = self.display.displayed() else { return Ok(()) };
        let (panes, size) = (self.panes(), self.size);
        let asked = (renderer, renderer.camera(), &pose);
        let stretched = panes.stretched(DVec2::new(pixel[0].into(), pixel[1].into()));
        let pixel = [(stretched.x as u32).min(size[0] - 1), pixel[1]];
        inspect::ask(&self.gpu, &mut self.textures, asked, size, pixel)?;
        self.to_tell.push(pixel);
        Ok(())
    }

    /// Returns true if the picture stays as it is: everything is there, and no mip bias is about to fall.
    pub fn is_settled(&self, stats: &FrameStats) -> bool {
        let is_falling = |pool: &PoolStats| pool.pager.bias_eighths > 0 && pool.fits();
        let at_rest = stats.converged && stats.fading == 0 && self.unsettled == 0;
        at_rest && !stats.pools.iter().any(is_falling)
    }
}
