//! A scene without a window: frames are drawn, pictures are read back. `render` and the tests use it.
//!
//! It calls the frame loop of `vastex` as any application does.

use std::sync::Arc;
use std::time::Duration;

use vastex::diagnostics::Explanation;
use vastex::prefetch::PrefetchSets;
use vastex::{
    BindGroups, CpuTexture, Event, Feedback, Settings, Textures, TileSource, Urgency, ViewId, ViewSettings,
};

use crate::compare::Comparison;
use crate::cpu_picture::cpu_picture;
use crate::error::OffscreenError;
use crate::estimate::Estimating;
use crate::places::places;
use crate::reference::{Reference, ReferenceError, Taps};
use crate::wait::read_texture;
use vastex_viewer::camera::Ahead;
use vastex_viewer::layers::ImageSizes;
use vastex_viewer::stage::{Canvas, Frame, Pictures, StageScene, StageView, TargetKind, draw_again};
use vastex_viewer::{
    CameraBinding, DisplayOptions, Gpu, Overlay, OverlayRenderer, Path, Picture, PlanetLight, Pose, Scene,
    SceneRenderer, ShownLayer, Target, Views, side_by_side,
};

mod costs;
mod parts;
mod scene_image;
mod until;

pub use costs::{CostsBeside, DrawCosts};
pub use scene_image::SceneImage;
pub use until::{Outcome, PATIENCE_FRAMES, Until, Watched};

/// How long is waited for what every pixel wants.
const MOST_LOADING: Duration = Duration::from_secs(60);

/// Frames after which feedback acts.
const FEEDBACK_FRAMES: u64 = 2;

/// How the picture to compare with was drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceKind {
    /// From an ordinary mip-mapped texture, on the same device.
    Gpu,
    /// By the CPU twin of the shaders, where the texture is beyond the device's limits or 1 GiB, of a format
    /// that the device does not filter, or lacks tiles.
    Cpu,
}

/// A scene without a window, whose frames are drawn into pictures that can be read.
pub struct Offscreen {
    gpu: Gpu,
    textures: Textures,
    renderer: SceneRenderer,
    size: [u32; 2],
    pose: Pose,
    /// What [`Path::Still`] shows in the place of its own pose.
    still: Option<Pose>,
    estimating: Option<Estimating>,
    prefetch_sets: Option<PrefetchSets>,
    views: Views,
    /// The second view, if there is one.
    beside: Option<(ViewId, CameraBinding)>,
    /// While the camera is looked ahead of.
    ahead: Option<(CameraBinding, Ahead)>,
    /// Frames so far.
    frame: u64,
    canvas: Canvas,
    /// The format of pictures, and what they are drawn into.
    drawn_as: (wgpu::TextureFormat, TargetKind),
    source: Arc<dyn TileSource>,
    /// Columns and rows of the image that the source is of.
    image: [u32; 2],
}

impl Offscreen {
    /// Sets up a scene with the first layer of a texture for pictures of `size` pixels.
    pub fn new(
        gpu: &Gpu,
        source: Arc<dyn TileSource>,
        scene: Scene,
        size: [u32; 2],
        settings: Settings,
    ) -> Result<Offscreen, OffscreenError> {
        Offscreen::showing(&DisplayOptions::default(), gpu, source, scene, size, settings)
    }

    /// The same with any layer.
    pub fn showing(
        shown: &DisplayOptions,
        gpu: &Gpu,
        source: Arc<dyn TileSource>,
        scene: Scene,
        size: [u32; 2],
        settings: Settings,
    ) -> Result<Offscreen, OffscreenError> {
        Offscreen::showing_together(shown, gpu, (source.into(), &[]), scene, size, settings)
    }

    /// The same with further images over the first one, which says how wide the picture's image is and is the
    /// one that pictures are compared with.
    pub fn showing_together(
        shown: &DisplayOptions,
        gpu: &Gpu,
        (lowest, over): (SceneImage, &[SceneImage]),
        scene: Scene,
        size: [u32; 2],
        settings: Settings,
    ) -> Result<Offscreen, OffscreenError> {
        let max = gpu.device.limits().max_texture_dimension_2d;
        if size.iter().any(|side| !(1..=max).contains(side)) {
            return Err(OffscreenError::PictureSize { width: size[0], height: size[1], max });
        }
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings)?;
        let (mut added, mut images) = (Vec::new(), Vec::new());
        for SceneImage { tiles, size } in std::iter::once(&lowest).chain(over) {
            let texture = textures.add_blocking(tiles.clone())?;
            added.push(texture);
            images.push((texture, *size));
        }
        let layers = shown.layers_of(&textures, &added)?;
        let images: ImageSizes = images.into_iter().collect();
        let drawn = shown.describe(scene, &mut textures, (&added, &images), layers, None)?;
        let kind = shown.target.unwrap_or_else(|| SceneRenderer::target_kind(&gpu.adapter, &drawn.layers));
        let picture = drawn.layers.picture_format();
        let renderer = SceneRenderer::new(gpu, &textures, drawn, kind.drawn_format(picture))?;
        Ok(Offscreen {
            pose: Pose::first(scene),
            still: None,
            estimating: None,
            prefetch_sets: None,
            views: Views::One,
            beside: None,
            ahead: None,
            frame: 0,
            canvas: Canvas::new(gpu, size, picture, kind),
            drawn_as: (picture, kind),
            gpu: gpu.clone(),
            textures,
            renderer,
            size,
            source: lowest.tiles,
            image: lowest.size,
        })
    }

    /// How a planet is lit from the next frame on.
    pub fn light(&mut self, light: PlanetLight) {
        self.renderer.set_light(light);
    }

    /// From the next frame on, estimates what the view wants, in place of the feedback pass or beside it.
    pub fn estimate(&mut self, estimating: Estimating) {
        self.estimating = Some(estimating);
    }

    /// From the next frame on, expects what was wanted before where the camera is and where it is heading.
    pub fn prefetch_by(&mut self, sets: PrefetchSets) -> Result<(), OffscreenError> {
        let texture = self.textures.texture(self.renderer.layer().texture())?.description();
        let of_this = sets.geometries().first().is_some_and(|shape| **shape == texture.geometry);
        if !of_this {
            return Err(OffscreenError::OtherTexture);
        }
        self.prefetch_sets = Some(sets);
        Ok(())
    }

    /// What the pictures show from the next frame on. Two views share the size of the picture.
    pub fn show(&mut self, views: Views) -> Result<(), OffscreenError> {
        // Its target and its pipelines stay.
        if self.views == Views::One && views == Views::One {
            return Ok(());
        }
        if let Some((view, _)) = self.beside.take() {
            self.textures.view_mut(view)?.remove();
        }
        if views != Views::One {
            let view = self.textures.add_view(ViewSettings::default().with_weight(views.weight()))?;
            let number = self.textures.view(view)?.number();
            self.beside = Some((view, self.renderer.new_camera(&self.gpu.device).with_view(number)));
        }
        self.views = views;
        let (picture, kind) = self.drawn_as;
        self.canvas = Canvas::new(&self.gpu, views.size_of_each(self.size), picture, kind);
        Ok(())
    }

    /// Whether what the main view is expected to see is loaded ahead, from the next frame on.
    pub fn look_ahead(&mut self, ahead: bool) {
        self.ahead = ahead.then(|| (self.renderer.new_camera(&self.gpu.device), Ahead::default()));
    }

    /// Where the camera is in runs of [`Path::Still`], in the place of the first pose of the scene; other
    /// paths go their own way. The pose must be of this scene ([`Pose::scene`]).
    pub fn stand_at(&mut self, pose: Pose) {
        self.still = Some(pose);
    }

    /// Columns and rows of the image that the poses of an image are told of: the first one.
    pub fn image_size(&self) -> [u32; 2] {
        self.image
    }

    /// Plays a path; `watch` sees the textures after every frame, and every event in it, and may end the run.
    pub fn run<W: Watched>(
        &mut self,
        path: Path,
        until: Until,
        watch: impl FnMut(&Textures, Vec<Event>) -> W,
    ) -> Result<Outcome, OffscreenError> {
        let (scene, image) = (self.renderer.scene(), self.renderer.image_aspect());
        let still = self.still.filter(|_| path == Path::Still);
        let pose = |frame| still.unwrap_or_else(|| path.pose(scene, image, frame));
        self.run_along(path.frames(), pose, until, watch)
    }

    /// The same with a camera that has a pose in each frame, counted from 0, and is at its last place after
    /// `frames` of them. Poses must be of this scene ([`Pose::scene`]).
    pub fn run_along<W: Watched>(
        &mut self,
        frames: u64,
        pose: impl Fn(u64) -> Pose,
        until: Until,
        mut watch: impl FnMut(&Textures, Vec<Event>) -> W,
    ) -> Result<Outcome, OffscreenError> {
        let mut frame = 0;
        loop {
            let stats = self.textures.stats();
            let converged = stats.converged && stats.fading == 0;
            let done = match until {
                Until::Frames(frames) => frame >= frames,
                Until::Converged => {
                    // What has converged before the last pose was held for a cycle says nothing of it.
                    let held = u64::from(vastex::JITTER_CYCLE) * self.views.every() + FEEDBACK_FRAMES;
                    let settled = converged && frame >= frames + held;
                    settled || frame >= frames + PATIENCE_FRAMES
                }
            };
            if done {
                return Ok(Outcome { converged, stats });
            }
            self.frame(pose(frame))?;
            let events = std::iter::from_fn(|| self.textures.poll_event()).collect();
            if watch(&self.textures, events).ends() {
                return Ok(Outcome { converged: false, stats: self.textures.stats() });
            }
            frame += 1;
        }
    }

    /// Where the camera was in the last frame.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// What is drawn, to ask about it.
    pub fn renderer(&self) -> &SceneRenderer {
        &self.renderer
    }

    /// Plays one frame, but for the picture.
    pub fn frame(&mut self, pose: Pose) -> Result<(), OffscreenError> {
        self.expect_what_was_learnt(&pose);
        self.pose = pose;
        let (renderer, size, estimating) = (&self.renderer, self.canvas.size(), self.estimating);
        let (main, beside) = self.views.poses(pose);
        let mut views = vec![StageView { view: ViewId::MAIN, camera: renderer.camera(), pose: main }];
        let beside = self.beside.as_ref().zip(beside).filter(|_| self.views.is_due(self.frame));
        views.extend(beside.map(|((view, camera), pose)| StageView { view: *view, camera, pose }));
        let frames_ahead = self.textures.ahead().frames();
        let expected = self.ahead.as_mut().and_then(|(camera, ahead)| {
            let expected = ahead.expect(main, frames_ahead)?;
            Some((&*camera, expected))
        });
        let has_feedback = estimating.is_none_or(|estimating| estimating.beside);
        // Otherwise a picture is drawn when it is asked for.
        let pictures = if has_feedback { Pictures::ForFeedback } else { Pictures::Never };
        let frame = Frame { views: &views, expected, picture: size, has_feedback, pictures };
        let report = |textures: &mut Textures, encoder: &mut _| match estimating {
            Some(estimating) => estimating.report(textures, encoder, renderer, &main, size),
            None => Ok(()),
        };
        let target = self.canvas.target();
        let encoder = frame.record(&self.gpu, &mut self.textures, renderer, &target, report)?;
        self.gpu.queue.submit([encoder.finish()]);
        self.frame += 1;
        Ok(())
    }

    fn expect_what_was_learnt(&mut self, pose: &Pose) {
        let (place, before) = (pose.place(), self.pose.place());
        self.textures.ahead().trace().set_camera_position(place);
        if let Some(sets) = &self.prefetch_sets {
            let step = std::array::from_fn(|axis| place[axis] - before[axis]);
            self.textures.ahead().expect(&sets.expected(
                place,
                step,
                &[self.renderer.layer().texture().number()],
            ));
        }
    }

    /// The picture of the last frame, from what is in the pool now.
    pub fn picture(&self) -> Picture {
        self.draw_and_read(|encoder, _| self.draw_again(encoder))
    }

    /// An overlay of the last frame in the place of its picture.
    pub fn overlay(&self, overlay: Overlay) -> Result<Picture, OffscreenError> {
        let Gpu { device, queue, .. } = &self.gpu;
        let mut drawn = OverlayRenderer::new(device, &self.textures, &self.renderer, overlay)?;
        let mut pictures = Vec::new();
        let (main, beside) = self.views.poses(self.pose);
        for pose in std::iter::once(main).chain(beside) {
            self.renderer.set_pose(queue, &self.textures, &pose, self.canvas.size());
            drawn.look(device, queue, &self.textures, &self.renderer, self.canvas.size())?;
            pictures.push(self.draw_and_read_one(|encoder, target| {
                drawn.draw(encoder, &self.renderer, &self.textures, &target);
                target.encode(encoder);
            }));
        }
        Ok(side_by_side(&pictures, self.size))
    }

    /// Why a pixel of the last frame's picture shows what it shows; empty if it shows no texture.
    pub fn explain(&mut self, [x, y]: [u32; 2]) -> Result<Vec<Explanation>, OffscreenError> {
        let (main, beside) = self.views.poses(self.pose);
        let (pose, left) = match beside {
            Some(beside) if x >= self.canvas.size()[0] => (beside, self.canvas.size()[0]),
            _ => (main, 0),
        };
        let (renderer, sampled) = (&self.renderer, self.renderer.sampled());
        renderer.set_pose(&self.gpu.queue, &self.textures, &pose, self.canvas.size());
        self.textures.pixels().explain(self.canvas.size(), [x - left, y], |pass, groups| {
            if let Some(group) = groups.get(sampled) {
                renderer.draw_wanted(renderer.camera(), pass, group);
            }
        })?;
        Ok(self.textures.pixels().wait()?.map(|explained| explained.explanations).unwrap_or_default())
    }

    /// How alike the last frame's picture is to one from an ordinary texture, and how that was drawn.
    ///
    /// Of a scene that heights displace the colours are compared, on the ground as it is: by the CPU twin.
    pub fn compare(&self) -> Result<(Comparison, ReferenceKind), OffscreenError> {
        let (expected, kind) = self.expected_picture()?;
        Ok((Comparison::of(&self.picture(), &expected), kind))
    }

    /// The picture that the last frame's is compared with, and how it was drawn.
    pub fn expected_picture(&self) -> Result<(Picture, ReferenceKind), OffscreenError> {
        if !self.renderer.layers().is_single() {
            return Err(OffscreenError::SeveralLayers);
        }
        if self.renderer.has_relief() {
            return Ok((self.cpu_picture()?, ReferenceKind::Cpu));
        }
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        match Reference::new(device, queue, &self.textures, &self.renderer, &*self.source, Taps::Same) {
            Ok(reference) => {
                let picture = self.draw_and_read(|encoder, target| {
                    reference.draw(encoder, &self.renderer, &self.textures, &target);
                    target.encode(encoder);
                });
                Ok((picture, ReferenceKind::Gpu))
            }
            Err(ReferenceError::TooLarge { .. } | ReferenceError::Format(_) | ReferenceError::Sparse) => {
                Ok((self.cpu_picture()?, ReferenceKind::Cpu))
            }
            Err(error) => Err(error.into()),
        }
    }

    /// The last frame's picture by the shaders' CPU twin, at the mip bias in force. Of one opaque layer.
    pub fn cpu_picture(&self) -> Result<Picture, OffscreenError> {
        if !self.renderer.layers().is_single() {
            return Err(OffscreenError::SeveralLayers);
        }
        let layer = self.renderer.layer();
        let bias = self.textures.texture(layer.texture())?.bias_eighths();
        let filter = self.renderer.layers().inspected().filter_in(&self.textures);
        let texture = CpuTexture::new(self.source.clone(), layer.index(), filter, bias)?
            .with_levels(self.textures.texture(layer.texture())?.levels());
        let draw = |pose: &Pose| {
            cpu_picture((&self.gpu, &self.textures, &self.renderer), pose, &texture, self.canvas.size())
        };
        let pictures: Vec<Picture> = self.through_each(draw).collect::<Result<_, _>>()?;
        Ok(side_by_side(&pictures, self.size))
    }

    /// Share of the covered pixels whose wanted page, at mip bias 0, is resident. 1 where nothing is covered.
    pub fn share_at_wanted_level(&mut self) -> Result<f64, OffscreenError> {
        let (mut wanted, mut resident) = (0u64, 0u64);
        let (main, beside) = self.views.poses(self.pose);
        for pose in std::iter::once(main).chain(beside) {
            for page in &self.wanted_by_every_pixel(pose)?.pages {
                wanted += u64::from(page.pixels);
                if matches!(
                    self.textures.inspect().state(page.page),
                    vastex::diagnostics::PageState::Resident(_)
                ) {
                    resident += u64::from(page.pixels);
                }
            }
        }
        Ok(if wanted == 0 { 1.0 } else { resident as f64 / wanted as f64 })
    }

    /// What every pixel of a view wants that has this pose.
    pub fn wanted_by_every_pixel(&mut self, pose: Pose) -> Result<Feedback, OffscreenError> {
        let (renderer, sampled) = (&self.renderer, self.renderer.sampled());
        renderer.set_pose(&self.gpu.queue, &self.textures, &pose, self.canvas.size());
        let draw = |pass: &mut wgpu::RenderPass<'_>, groups: &BindGroups| {
            if let Some(group) = groups.get(sampled) {
                renderer.draw_wanted(renderer.camera(), pass, group);
            }
        };
        Ok(self.textures.pixels().feedback_of_every(self.canvas.size(), draw)?)
    }

    /// Loads what every pixel of the views wants. Feedback asks one in four, and may miss a page's corner.
    pub fn load_for_every_pixel(&mut self) -> Result<(), OffscreenError> {
        let (main, beside) = self.views.poses(self.pose);
        for pose in std::iter::once(main).chain(beside) {
            let wanted = self.wanted_by_every_pixel(pose)?;
            let loading = self.textures.ahead().prefetch_view(&wanted, Urgency::default());
            self.textures.finish(&loading.map_err(vastex::Error::from)?, MOST_LOADING)?;
        }
        Ok(())
    }

    /// Where on its texture each pixel of a view is that has this pose, in texels of level 0, row by row;
    /// `None` for a pixel that does not see it.
    pub fn places(&self, pose: &Pose) -> Vec<Option<glam::DVec2>> {
        self.renderer.set_pose(&self.gpu.queue, &self.textures, pose, self.canvas.size());
        let shown = (&self.gpu, &self.textures, &self.renderer);
        places(shown, pose, self.canvas.size()).into_iter().map(|place| Some(place?.texels)).collect()
    }

    /// Returns true if a view of this pose is drawn in fixed point.
    pub fn is_in_fixed_point(&self, pose: &Pose) -> bool {
        self.renderer.anchor(&self.textures, pose, self.canvas.size()).is_some()
    }

    /// From the next frame on shows a layer as `change` makes it: that of this number, from the lowest.
    pub fn change_layer(
        &mut self,
        n: usize,
        change: impl FnOnce(ShownLayer) -> ShownLayer,
    ) -> Result<(), OffscreenError> {
        let mut layers = self.renderer.layers().clone();
        let Some(shown) = layers.iter().nth(n).copied() else { return Ok(()) };
        let is_new = layers.set(&mut self.textures, n, change(shown))?;
        match is_new {
            false => self.renderer.set_layers(&self.gpu.queue, &self.textures, &layers),
            true => self.renderer = self.renderer.with_layers(&self.gpu, &self.textures, layers)?,
        }
        Ok(())
    }

    /// The textures, to ask about them.
    pub fn textures(&self) -> &Textures {
        &self.textures
    }

    /// The textures, to tell them something.
    pub fn textures_mut(&mut self) -> &mut Textures {
        &mut self.textures
    }

    /// What `draw` gives for each view, with the scene's camera where that view's is.
    fn through_each<T>(&self, mut draw: impl FnMut(&Pose) -> T) -> impl Iterator<Item = T> {
        let (main, beside) = self.views.poses(self.pose);
        std::iter::once(main).chain(beside).map(move |pose| {
            self.renderer.set_pose(&self.gpu.queue, &self.textures, &pose, self.canvas.size());
            draw(&pose)
        })
    }

    fn draw_and_read(&self, draw: impl Fn(&mut wgpu::CommandEncoder, Target<'_>)) -> Picture {
        let pictures: Vec<Picture> = self.through_each(|_| self.draw_and_read_one(&draw)).collect();
        side_by_side(&pictures, self.size)
    }

    fn draw_and_read_one(&self, draw: impl Fn(&mut wgpu::CommandEncoder, Target<'_>)) -> Picture {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        draw(&mut encoder, self.canvas.target());
        Picture { size: self.canvas.size(), rgba: read_texture(&self.gpu, encoder, self.canvas.picture(), 4) }
    }
}
