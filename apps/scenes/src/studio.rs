//! A scene without a window: frames are drawn, pictures are read back. `render` and the tests use it.
//!
//! It calls the frame loop of `vastex` as any application does.

use std::sync::Arc;

use vastex::{
    BindGroups, CpuTexture, Event, Explanation, Feedback, FeedbackWay, FrameStats, PrefetchSets, Settings,
    Textures, TileSource, ViewId, ViewSettings,
};

use crate::ahead::Ahead;
use crate::compare::{Comparison, Picture};
use crate::cpu_picture::cpu_picture;
use crate::draw::{Drawn, PictureTarget, SceneRenderer, depth_view};
use crate::estimate::Estimating;
use crate::eye::Eye;
use crate::gpu::Gpu;
use crate::look::{Look, Shown, UnknownLayer};
use crate::overlay::{Overlay, OverlayRenderer};
use crate::path::Path;
use crate::pose::Pose;
use crate::read::read_texture;
use crate::reference::{Reference, ReferenceError, Taps};
use crate::relief::HeightsError;
use crate::scene::Scene;
use crate::views::{Views, side_by_side};

mod costs;

pub use costs::{CostsBeside, DrawCosts};

/// Frames after the end of a path within which a view must converge.
pub const PATIENCE_FRAMES: u64 = 10_000;

/// Frames after which feedback acts.
const FEEDBACK_FRAMES: u64 = 2;

/// Why a picture could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum StudioError {
    /// The library said so.
    #[error(transparent)]
    Vastex(#[from] vastex::Error),
    /// The layer to be shown is not there.
    #[error(transparent)]
    Layer(#[from] UnknownLayer),
    /// The heights are not there.
    #[error(transparent)]
    Heights(#[from] HeightsError),
    /// The picture is larger than the device's textures.
    #[error("a picture of {width}x{height} pixels: this adapter draws 1 to {max} pixels per side")]
    PictureSize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Pixels per side that the device allows.
        max: u32,
    },
    /// The prefetch sets were learnt of something else.
    #[error(
        "the prefetch sets were learnt of a texture of another shape; learn them from traces of this one"
    )]
    OtherTexture,
    /// The picture from an ordinary texture could not be had.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
}

/// When a run ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Until {
    /// After so many frames.
    Frames(u64),
    /// When the path is at its end, the view has converged and no tile fades in any more; it gives up [`PATIENCE_FRAMES`] after the end.
    Converged,
}

/// How the picture to compare with was drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceKind {
    /// From an ordinary mip-mapped texture, on the same device.
    Gpu,
    /// By the CPU twin of the shaders, where the texture is beyond the device's limits or 1 GiB, of a format that the device
    /// does not filter, or lacks tiles.
    Cpu,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Whether the last view had converged, with all its tiles there.
    pub converged: bool,
    /// The loop at the end.
    pub stats: FrameStats,
}

/// See the head of the file.
pub struct Studio {
    gpu: Gpu,
    textures: Textures,
    renderer: SceneRenderer,
    size: [u32; 2],
    pose: Pose,
    estimating: Option<Estimating>,
    prefetch_sets: Option<PrefetchSets>,
    views: Views,
    /// The second view, if there is one.
    beside: Option<(ViewId, Eye)>,
    /// While the camera is looked ahead of.
    ahead: Option<Ahead>,
    /// Frames so far.
    frame: u64,
    canvas: Canvas,
    source: Arc<dyn TileSource>,
}

/// What a view's picture is drawn on.
struct Canvas {
    size: [u32; 2],
    colour: wgpu::Texture,
    colour_view: wgpu::TextureView,
    depth_view: wgpu::TextureView,
}

impl Canvas {
    fn new(gpu: &Gpu, size: [u32; 2], format: wgpu::TextureFormat) -> Canvas {
        let colour = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let colour_view = colour.create_view(&Default::default());
        Canvas { size, colour, colour_view, depth_view: depth_view(&gpu.device, size) }
    }
}

impl Studio {
    /// Sets up a scene with the first layer of a texture for pictures of `size` pixels.
    pub fn new(
        gpu: &Gpu,
        source: Arc<dyn TileSource>,
        scene: Scene,
        size: [u32; 2],
        settings: Settings,
    ) -> Result<Studio, StudioError> {
        Studio::showing(&Shown::default(), gpu, source, scene, size, settings)
    }

    /// The same with any layer.
    pub fn showing(
        shown: &Shown,
        gpu: &Gpu,
        source: Arc<dyn TileSource>,
        scene: Scene,
        size: [u32; 2],
        settings: Settings,
    ) -> Result<Studio, StudioError> {
        let max = gpu.device.limits().max_texture_dimension_2d;
        if size.iter().any(|side| !(1..=max).contains(side)) {
            return Err(StudioError::PictureSize { width: size[0], height: size[1], max });
        }
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings)?;
        let texture = textures.add(source.clone())?;
        let layer = shown.layer_of(&textures, texture)?;
        let look = Look::new(&textures.description(texture).layers[layer.index()], shown.range);
        let format = look.picture_format();
        let relief = shown.relief_of(scene, &mut textures, layer)?;
        let drawn = Drawn { scene, layer, look, relief, tiling: shown.tiling };
        let renderer = SceneRenderer::new(&gpu.device, &gpu.queue, &textures, drawn, format);
        Ok(Studio {
            pose: Pose::first(scene),
            estimating: None,
            prefetch_sets: None,
            views: Views::One,
            beside: None,
            ahead: None,
            frame: 0,
            canvas: Canvas::new(gpu, size, format),
            gpu: gpu.clone(),
            textures,
            renderer,
            size,
            source,
        })
    }

    /// From the next frame on, estimates what the view wants, in place of the feedback pass or beside it.
    pub fn estimate(&mut self, estimating: Estimating) {
        self.estimating = Some(estimating);
    }

    /// From the next frame on, expects what was wanted before where the camera is and where it is heading.
    pub fn prefetch_by(&mut self, sets: PrefetchSets) -> Result<(), StudioError> {
        let texture = self.textures.description(self.renderer.layer().texture());
        let of_this = sets.geometries().first().is_some_and(|shape| **shape == texture.geometry);
        if !of_this {
            return Err(StudioError::OtherTexture);
        }
        self.prefetch_sets = Some(sets);
        Ok(())
    }

    /// What the pictures show from the next frame on. Two views share the size of the picture.
    pub fn show(&mut self, views: Views) -> Result<(), StudioError> {
        if let Some((view, _)) = self.beside.take() {
            self.textures.remove_view(view);
        }
        if views != Views::One {
            let view = self.textures.add_view(ViewSettings::default().with_weight(views.weight()))?;
            self.beside = Some((view, self.renderer.new_eye(&self.gpu.device)));
        }
        self.views = views;
        self.canvas = Canvas::new(&self.gpu, views.size_of_each(self.size), self.renderer.format());
        Ok(())
    }

    /// Whether what the main view is expected to see is loaded ahead, from the next frame on.
    pub fn look_ahead(&mut self, ahead: bool) {
        self.ahead = ahead.then(|| Ahead::new(self.renderer.new_eye(&self.gpu.device)));
    }

    /// Plays a path; `watch` sees the textures after every frame, and every event in it.
    pub fn run(
        &mut self,
        path: Path,
        until: Until,
        mut watch: impl FnMut(&Textures, Vec<Event>),
    ) -> Result<Outcome, StudioError> {
        let mut frame = 0;
        loop {
            let stats = self.textures.stats();
            let converged = stats.converged && stats.fading == 0;
            let done = match until {
                Until::Frames(frames) => frame >= frames,
                Until::Converged => {
                    // What has converged before the last pose was held for a cycle says nothing of it.
                    let held = u64::from(vastex::JITTER_CYCLE) * self.views.every() + FEEDBACK_FRAMES;
                    let settled = converged && frame >= path.frames() + held;
                    settled || frame >= path.frames() + PATIENCE_FRAMES
                }
            };
            if done {
                return Ok(Outcome { converged, stats });
            }
            self.frame(path.pose(self.renderer.scene(), self.renderer.image_aspect(), frame))?;
            let events = std::iter::from_fn(|| self.textures.poll_event()).collect();
            watch(&self.textures, events);
            frame += 1;
        }
    }

    /// Plays one frame, but for the picture.
    pub fn frame(&mut self, pose: Pose) -> Result<(), StudioError> {
        self.expect_what_was_learnt(&pose);
        self.pose = pose;
        let (queue, size) = (&self.gpu.queue, self.canvas.size);
        let (renderer, sampled) = (&self.renderer, self.renderer.sampled());
        let (main, beside) = self.views.poses(pose);
        renderer.set_pose(queue, &self.textures, &main, size);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        if let Some(estimating) = self.estimating {
            estimating.tell(&mut self.textures, &mut encoder, renderer, &main, size)?;
        }
        if self.estimating.is_none_or(|estimating| estimating.beside) {
            self.textures.feedback(&mut encoder, size, |pass, groups| {
                renderer.draw_wanted(pass, &groups[sampled]);
            })?;
        }
        if let (Some((view, eye)), Some(pose)) = (&self.beside, beside)
            && self.views.is_due(self.frame)
        {
            renderer.set_pose_of(eye, queue, &self.textures, &pose, size);
            self.textures.feedback_of(&mut encoder, *view, size, |pass, groups| {
                renderer.draw_wanted_of(eye, pass, &groups[sampled]);
            })?;
        }
        if let Some(ahead) = &mut self.ahead
            && let Some(expected) = ahead.expect(main, self.textures.frames_ahead())
        {
            renderer.set_pose_of(&ahead.eye, queue, &self.textures, &expected, size);
            self.textures.feedback_expected(&mut encoder, size, |pass, groups| {
                renderer.draw_wanted_of(&ahead.eye, pass, &groups[sampled]);
            })?;
        }
        self.textures.update()?;
        let beside = self.beside.as_ref().filter(|_| self.views.is_due(self.frame));
        let told = [(ViewId::MAIN, renderer.eye())].into_iter();
        let told = told.chain(beside.map(|(view, eye)| (*view, eye)));
        // Otherwise a picture is drawn when it is asked for.
        let is_told = self.textures.feedback_way() == FeedbackWay::Inline
            && self.estimating.is_none_or(|estimating| estimating.beside);
        for (view, eye) in told.filter(|_| is_told) {
            let Canvas { colour_view: colour, depth_view: depth, .. } = &self.canvas;
            self.textures.main_pass_of(&mut encoder, view, size, |encoder, groups| {
                renderer.draw_picture_of(eye, encoder, &groups[sampled], &PictureTarget { colour, depth });
            })?;
        }
        queue.submit([encoder.finish()]);
        self.frame += 1;
        Ok(())
    }

    fn expect_what_was_learnt(&mut self, pose: &Pose) {
        let (place, before) = (pose.place(), self.pose.place());
        self.textures.set_place(place);
        if let Some(sets) = &self.prefetch_sets {
            let step = std::array::from_fn(|axis| place[axis] - before[axis]);
            self.textures.expect(&sets.expected(place, step, &[self.renderer.layer().texture()]));
        }
    }

    /// The picture of the last frame, from what is in the pool now.
    pub fn picture(&self) -> Picture {
        self.draw_and_read(|encoder, target| self.renderer.draw_picture(encoder, &self.textures, &target))
    }

    /// An overlay of the last frame in the place of its picture.
    pub fn overlay(&self, overlay: Overlay) -> Result<Picture, StudioError> {
        let Gpu { device, queue, .. } = &self.gpu;
        let mut drawn = OverlayRenderer::new(device, &self.textures, &self.renderer, overlay);
        let mut pictures = Vec::new();
        let (main, beside) = self.views.poses(self.pose);
        for pose in std::iter::once(main).chain(beside) {
            self.renderer.set_pose(queue, &self.textures, &pose, self.canvas.size);
            drawn.look(device, queue, &self.textures, &self.renderer, self.canvas.size)?;
            pictures.push(self.draw_and_read_one(|encoder, target| {
                drawn.draw(encoder, &self.renderer, &self.textures, &target);
            }));
        }
        Ok(side_by_side(&pictures, self.size))
    }

    /// Why a pixel of the last frame's picture shows what it shows; nothing where no texture is.
    pub fn explain(&mut self, [x, y]: [u32; 2]) -> Result<Vec<Explanation>, StudioError> {
        let (main, beside) = self.views.poses(self.pose);
        let (pose, left) = match beside {
            Some(beside) if x >= self.canvas.size[0] => (beside, self.canvas.size[0]),
            _ => (main, 0),
        };
        let (renderer, sampled) = (&self.renderer, self.renderer.sampled());
        renderer.set_pose(&self.gpu.queue, &self.textures, &pose, self.canvas.size);
        self.textures.explain_pixel(self.canvas.size, [x - left, y], |pass, groups| {
            renderer.draw_wanted(pass, &groups[sampled]);
        })?;
        Ok(self.textures.wait_explained()?.map(|explained| explained.explanations).unwrap_or_default())
    }

    /// How alike the picture of the last frame is to the same scene drawn from an ordinary texture, and how that was drawn.
    ///
    /// Of a scene that heights displace the colours are compared, on the ground as it is: by the CPU twin.
    pub fn compare(&self) -> Result<(Comparison, ReferenceKind), StudioError> {
        let (expected, kind) = self.expected_picture()?;
        Ok((self.picture().compare(&expected), kind))
    }

    /// The picture that the last frame's is compared with, and how it was drawn.
    pub fn expected_picture(&self) -> Result<(Picture, ReferenceKind), StudioError> {
        if self.renderer.has_relief() {
            return Ok((self.cpu_picture()?, ReferenceKind::Cpu));
        }
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        match Reference::new(device, queue, &self.textures, &self.renderer, &*self.source, Taps::Same) {
            Ok(reference) => {
                let picture = self.draw_and_read(|encoder, target| {
                    reference.draw(encoder, &self.renderer, &self.textures, &target);
                });
                Ok((picture, ReferenceKind::Gpu))
            }
            Err(ReferenceError::TooLarge { .. } | ReferenceError::Format(_) | ReferenceError::Sparse) => {
                Ok((self.cpu_picture()?, ReferenceKind::Cpu))
            }
            Err(error) => Err(error.into()),
        }
    }

    /// The picture of the last frame by the CPU twin of the shaders, at the mip bias in force.
    pub fn cpu_picture(&self) -> Result<Picture, StudioError> {
        let layer = self.renderer.layer();
        let bias = self.textures.bias_eighths(layer.texture());
        let filter = self.textures.filter(layer);
        let texture = CpuTexture::new(self.source.clone(), layer.index(), filter, bias)?
            .with_levels(self.textures.levels(layer.texture()).unwrap_or_default());
        let draw = || cpu_picture(&self.gpu, &self.textures, &self.renderer, &texture, self.canvas.size);
        let pictures: Vec<Picture> = self.through_each(draw).collect::<Result<_, _>>()?;
        Ok(side_by_side(&pictures, self.size))
    }

    /// Share of the covered pixels whose wanted page, at mip bias 0, is resident. 1 where nothing is covered.
    pub fn share_at_wanted_level(&mut self) -> Result<f64, StudioError> {
        let (mut wanted, mut resident) = (0u64, 0u64);
        let (main, beside) = self.views.poses(self.pose);
        for pose in std::iter::once(main).chain(beside) {
            for page in &self.wanted_by_every_pixel(pose)?.pages {
                wanted += u64::from(page.pixels);
                if matches!(self.textures.state(page.page), vastex::PageState::Resident(_)) {
                    resident += u64::from(page.pixels);
                }
            }
        }
        Ok(if wanted == 0 { 1.0 } else { resident as f64 / wanted as f64 })
    }

    /// What every pixel of a view wants that has this pose.
    pub fn wanted_by_every_pixel(&mut self, pose: Pose) -> Result<Feedback, StudioError> {
        let (renderer, sampled) = (&self.renderer, self.renderer.sampled());
        renderer.set_pose(&self.gpu.queue, &self.textures, &pose, self.canvas.size);
        let draw = |pass: &mut wgpu::RenderPass<'_>, groups: &BindGroups| {
            renderer.draw_wanted(pass, &groups[sampled]);
        };
        Ok(self.textures.feedback_of_every_pixel(self.canvas.size, draw)?)
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
    fn through_each<T>(&self, mut draw: impl FnMut() -> T) -> impl Iterator<Item = T> {
        let (main, beside) = self.views.poses(self.pose);
        std::iter::once(main).chain(beside).map(move |pose| {
            self.renderer.set_pose(&self.gpu.queue, &self.textures, &pose, self.canvas.size);
            draw()
        })
    }

    fn draw_and_read(&self, draw: impl Fn(&mut wgpu::CommandEncoder, PictureTarget<'_>)) -> Picture {
        let pictures: Vec<Picture> = self.through_each(|| self.draw_and_read_one(&draw)).collect();
        side_by_side(&pictures, self.size)
    }

    fn draw_and_read_one(&self, draw: impl Fn(&mut wgpu::CommandEncoder, PictureTarget<'_>)) -> Picture {
        let Canvas { size, colour, colour_view, depth_view } = &self.canvas;
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        draw(&mut encoder, PictureTarget { colour: colour_view, depth: depth_view });
        Picture { size: *size, rgba: read_texture(&self.gpu, encoder, colour, 4) }
    }
}
