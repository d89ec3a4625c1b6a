//! An image of any size as a widget of a program that uses egui and draws it with wgpu, as eframe does.
//!
//! The widget draws into a texture of its own, by the frame loop of `vastex`, and egui paints that. What a
//! person does to it is in `hands`.

mod hands;

use std::sync::Arc;
use std::time::Duration;

use egui::epaint::mutex::RwLock;
use egui::{Color32, Pos2, Rect, Response, Role, Sense, Ui, Vec2, WidgetInfo};
use egui_wgpu::{RenderState, Renderer};
use glam::DVec2;
use vastex::{Event, Filter, Prepared, Preparer, Settings, TextureId, Textures, ViewId};

use crate::camera::{Controller, Pose};
use crate::gpu::Gpu;
use crate::inspect::{InspectedTexel, texel_at};
use crate::layers::{Layers, ShownLayer};
use crate::scene::Scene;
use crate::stage::{Canvas, Frame, Pictures, StageView, TargetKind};
use crate::surface::{SceneDesc, SceneRenderer, Tiling, shows_large_texels};
use hands::Hands;

/// The format of the textures that egui paints.
const PICTURE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Frames after a change of the view in which nothing is taken for settled.
const UNSETTLED_FRAMES: u32 = 24;
/// As long after one another frames are drawn in which tiles that failed may be tried again.
const SLOW: Duration = Duration::from_millis(250);

/// An image cannot be shown in a program's window.
#[derive(Debug, thiserror::Error)]
pub enum VastexImageError {
    /// The graphics adapter lacks what pictures are drawn into.
    #[error("the graphics adapter {0} does not blend into half floats, into which pictures are drawn")]
    HalfFloats(String),
    /// The image cannot be read, or the device refuses it.
    #[error(transparent)]
    Vastex(#[from] vastex::Error),
}

/// An image of any size to pan and zoom in, for any program that shows egui by wgpu. The same value goes on
/// from frame to frame.
///
/// Drag, a wheel, a pinch, arrow keys, `+` and `-` move; a double click and `0` show all of it; 1 to 9 show
/// so many pixels a texel. Large texels are shown as they are. It asks egui for further frames while
/// something is loading or moving, for a few in a second while a tile cannot be had that is tried again, and
/// for none after that.
///
/// ```no_run
/// use std::sync::Arc;
/// use vastex::{ImageSource, Settings, TextureSettings};
/// use vastex_viewer::widget::VastexImage;
///
/// # fn app(state: &egui_wgpu::RenderState, ui: &mut egui::Ui, pixels: Vec<u8>) -> Result<(), Box<dyn std::error::Error>> {
/// // once, with the `wgpu_render_state` of eframe's `CreationContext`
/// let mut image = VastexImage::new(state, Settings::default())?;
/// let source = Arc::new(ImageSource::rgba8(100_000, 40_000, pixels)?);
/// // here, or on a thread of the program's own
/// let prepared = image.preparer().read_blocking(source, TextureSettings::default())?;
/// image.set_image(prepared)?;
/// // in each frame; it takes all the space that is left
/// image.show(ui);
/// # Ok(()) }
/// ```
pub struct VastexImage {
    gpu: Gpu,
    painter: Arc<RwLock<Renderer>>,
    textures: Textures,
    /// What is shown, once there is something.
    shown: Option<Shown>,
    camera: Controller,
    hands: Hands,
    /// What is drawn into, and what egui knows it by.
    canvas: Option<(Canvas, egui::TextureId)>,
    /// Where it lies in the window, in points, and where the camera was in the last frame.
    place: Rect,
    drawn: Option<Pose>,
    unsettled: u32,
    error: Option<String>,
    /// Why the tile failed that failed last.
    fault: Option<String>,
}

/// The image that is shown.
struct Shown {
    texture: TextureId,
    renderer: SceneRenderer,
    /// Columns and rows.
    size: [u32; 2],
    is_crisp: bool,
}

impl VastexImage {
    /// Shows nothing yet. Images come by [`VastexImage::preparer`] and [`VastexImage::set_image`].
    pub fn new(state: &RenderState, settings: Settings) -> Result<VastexImage, VastexImageError> {
        let RenderState { instance, adapter, device, queue, renderer: painter, .. } = state.clone();
        let gpu = Gpu::new(instance, adapter, device, queue);
        if TargetKind::for_layers(&gpu.adapter, 2) != TargetKind::Linear {
            return Err(VastexImageError::HalfFloats(gpu.adapter_name()));
        }
        let textures = Textures::new(&gpu.device, &gpu.queue, settings)?;
        Ok(VastexImage {
            gpu,
            painter,
            textures,
            shown: None,
            camera: Controller::new(Pose::first(Scene::Image)),
            hands: Hands::default(),
            canvas: None,
            place: Rect::NOTHING,
            drawn: None,
            unsettled: UNSETTLED_FRAMES,
            error: None,
            fault: None,
        })
    }

    /// What reads an image for [`VastexImage::set_image`], on any thread.
    pub fn preparer(&self) -> Preparer {
        self.textures.preparer()
    }

    /// Shows the first layer of an image that was read, all of it, in the place of the one before. Neither
    /// reads nor waits.
    pub fn set_image(&mut self, prepared: Prepared) -> Result<(), VastexImageError> {
        let texture = self.textures.add(prepared).map_err(|refused| refused.error)?;
        let shown = Shown::new(&self.gpu, &self.textures, texture).inspect_err(|_| {
            self.textures.remove(texture);
        })?;
        if let Some(before) = self.shown.replace(shown) {
            self.textures.remove(before.texture);
        }
        self.drawn = None;
        self.fit();
        Ok(())
    }

    /// Shows the image in all the space that is left.
    pub fn show(&mut self, ui: &mut Ui) -> Response {
        let size = ui.available_size_before_wrap();
        self.show_sized(ui, size)
    }

    /// Shows the image in so many points. What goes wrong while it is drawn is written in its place.
    pub fn show_sized(&mut self, ui: &mut Ui, size: Vec2) -> Response {
        let (place, response) = ui.allocate_exact_size(size.max(Vec2::splat(1.0)), Sense::click_and_drag());
        let label = match self.size() {
            Some([width, height]) => format!("image of {width} by {height} texels"),
            None => "no image".into(),
        };
        response.widget_info(|| WidgetInfo::labeled(Role::Image, ui.is_enabled(), &label));
        self.place = place;
        let Some(image) = self.size().filter(|_| ui.is_rect_visible(place)) else { return response };
        let scale = ui.ctx().pixels_per_point();
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        let picture =
            [place.width(), place.height()].map(|side| (side * scale).round().clamp(1.0, most as f32) as u32);
        let is_moving = self.hands.move_camera(ui, &response, &mut self.camera, (picture, image));
        let drawn = self.draw(ui, picture);
        if let Err(error) = drawn {
            self.error = Some(error.to_string());
        }
        if let Some((_, texture)) = &self.canvas {
            let all = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter().image(*texture, place, all, Color32::WHITE);
        }
        match &self.error {
            Some(error) => {
                let (at, font) = (place.center(), egui::TextStyle::Body.resolve(ui.style()));
                let color = ui.visuals().error_fg_color;
                ui.painter().text(at, egui::Align2::CENTER_CENTER, error, font, color);
            }
            None if is_moving || !self.is_settled() => ui.ctx().request_repaint(),
            None if self.has_failed() => ui.ctx().request_repaint_after(SLOW),
            None => {}
        }
        response
    }

    /// Where the camera is.
    pub fn pose(&self) -> Pose {
        self.camera.pose()
    }

    /// Puts the camera somewhere else. Poses of other scenes than an image have no effect.
    pub fn set_pose(&mut self, pose: Pose) {
        if matches!(pose, Pose::Image { .. }) {
            self.camera = Controller::new(pose);
        }
    }

    /// Shows all of the image.
    pub fn fit(&mut self) {
        self.set_pose(Pose::first(Scene::Image));
    }

    /// Columns and rows of the image, once there is one.
    pub fn size(&self) -> Option<[u32; 2]> {
        self.shown.as_ref().map(|shown| shown.size)
    }

    /// The texel below a place of the window, in points, as it was drawn last, with its stored value; `None`
    /// beside the image.
    pub fn texel_at(&self, place: Pos2) -> Option<InspectedTexel> {
        let ((canvas, _), shown) = (self.canvas.as_ref()?, self.shown.as_ref()?);
        let share = (place - self.place.min) / self.place.size();
        let [width, height] = canvas.size().map(f64::from);
        let pixel = DVec2::new(f64::from(share.x) * width, f64::from(share.y) * height);
        let sizes = (canvas.size(), shown.size);
        let asked = (&shown.renderer, shown.renderer.layer());
        texel_at(&self.textures, asked, &self.camera.pose(), sizes, pixel)
    }

    /// The textures, to ask about them and to tell them something.
    pub fn textures(&mut self) -> &mut Textures {
        &mut self.textures
    }

    /// What went wrong in the last frame, if anything did.
    pub fn error(&self) -> Option<&str> {
        self.error.as_deref()
    }

    /// Why the tile could not be had that failed last, while a coarser one is shown in its place. Such
    /// tiles are tried again in ever longer intervals.
    pub fn fault(&self) -> Option<&str> {
        self.fault.as_deref()
    }

    /// Returns true if the picture stays as it is: everything in view is there, or could not be had so far
    /// ([`VastexImage::fault`]).
    pub fn is_settled(&self) -> bool {
        let stats = self.textures.stats();
        self.unsettled == 0 && stats.converged && stats.fading == 0
    }

    /// Returns true if tiles in view could not be had, and are to be tried again.
    fn has_failed(&self) -> bool {
        self.textures.stats().pager.failed > 0
    }

    /// Draws a frame, unless the last one would be drawn again and nothing is to be tried again.
    fn draw(&mut self, ui: &Ui, picture: [u32; 2]) -> Result<(), vastex::Error> {
        let pose = self.camera.pose();
        let is_resized = self.canvas.as_ref().is_none_or(|(canvas, _)| canvas.size() != picture);
        if is_resized {
            self.resize(picture)?;
        }
        if is_resized || self.drawn != Some(pose) {
            self.unsettled = UNSETTLED_FRAMES;
        }
        if self.is_settled() && !self.has_failed() {
            return Ok(());
        }
        let time = Duration::try_from_secs_f32(ui.input(|input| input.stable_dt)).unwrap_or_default();
        self.textures.set_frame_time(time.min(Duration::from_millis(100)));
        let (Some((canvas, _)), Some(shown)) = (&self.canvas, &mut self.shown) else { return Ok(()) };
        shown.follow(&self.gpu, &self.textures, pose.magnification(picture, shown.size))?;
        let renderer = &shown.renderer;
        let views = [StageView { view: ViewId::MAIN, camera: renderer.camera(), pose }];
        let pictures = Pictures::Always;
        let frame = Frame { views: &views, expected: None, picture, has_feedback: true, pictures };
        let target = canvas.target();
        let encoder = frame.record(&self.gpu, &mut self.textures, renderer, &target, |_, _| Ok(()))?;
        self.gpu.queue.submit([encoder.finish()]);
        // A tile that failed is shown by a coarser one, and is tried again.
        while let Some(event) = self.textures.poll_event() {
            if matches!(event, Event::Failed { .. }) {
                self.fault = Some(event.to_string());
            }
        }
        (self.drawn, self.error) = (Some(pose), None);
        self.unsettled = self.unsettled.saturating_sub(1);
        if self.is_settled() && !self.has_failed() {
            self.fault = None;
        }
        Ok(())
    }

    fn resize(&mut self, picture: [u32; 2]) -> Result<(), vastex::Error> {
        let canvas = Canvas::new(&self.gpu, picture, PICTURE, TargetKind::Linear);
        let view = canvas.picture().create_view(&Default::default());
        let mut painter = self.painter.write();
        let nearest = wgpu::FilterMode::Nearest;
        let texture = match &self.canvas {
            Some((_, texture)) => {
                painter.update_egui_texture_from_wgpu_texture(&self.gpu.device, &view, nearest, *texture);
                *texture
            }
            None => painter.register_native_texture(&self.gpu.device, &view, nearest),
        };
        drop(painter);
        self.canvas = Some((canvas, texture));
        if self.textures.inspect().settings().picture != picture {
            self.textures.memory().set_picture(picture)?;
        }
        Ok(())
    }
}

impl Shown {
    fn new(gpu: &Gpu, textures: &Textures, texture: TextureId) -> Result<Shown, vastex::Error> {
        let described = textures.texture(texture)?.description();
        let [width, height, _] = described.geometry.size();
        let layers = Layers::one(ShownLayer::new(texture.into(), &described.layers[0]));
        let tiling = Tiling::default();
        let desc = SceneDesc {
            scene: Scene::Image,
            layers,
            relief: None,
            tiling,
            always_fixed: false,
            light: Default::default(),
        };
        let renderer = SceneRenderer::new(gpu, textures, desc, TargetKind::Linear.drawn_format(PICTURE))?;
        Ok(Shown { texture, renderer, size: [width, height], is_crisp: false })
    }

    /// Shows large texels as they are, blended with nothing, and blends smaller ones.
    fn follow(
        &mut self,
        gpu: &Gpu,
        textures: &Textures,
        magnification: Option<f64>,
    ) -> Result<(), vastex::Error> {
        let is_crisp = shows_large_texels(magnification.unwrap_or_default(), self.is_crisp);
        if is_crisp != self.is_crisp {
            let described = &textures.texture(self.texture)?.description().layers[0];
            let shown = ShownLayer::new(self.texture.into(), described);
            let filter = is_crisp.then_some(Filter::Nearest);
            let layers = Layers::one(ShownLayer { filter, ..shown });
            self.renderer = self.renderer.with_layers(gpu, textures, layers)?;
            self.is_crisp = is_crisp;
        }
        Ok(())
    }
}

/// egui forgets the texture.
impl Drop for VastexImage {
    fn drop(&mut self) {
        if let Some((_, texture)) = &self.canvas {
            self.painter.write().free_texture(texture);
        }
    }
}
