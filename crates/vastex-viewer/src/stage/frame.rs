//! How a frame is drawn: poses, what the views want, the update of the textures, the picture, and its
//! encoding. Volumes in a window are drawn in parts, by `volume_scene`.
//!
//! A kind of scene is a type with [`StageScene`]. A program brings the poses and the target; when a frame is
//! due, and what time it is, is the program's business.

use vastex::{Error, FeedbackMode, Sampled, Textures, ViewId};

use super::target::Target;
use crate::gpu::Gpu;

/// A kind of scene: what a stage needs of it to draw its frames.
pub trait StageScene {
    /// Where a camera of this kind of scene is.
    type Pose;
    /// What a pass sees the scene through: buffers that hold one pose.
    type Camera;

    /// What the shaders of the scene sample, and so whose bind group the methods that draw are given.
    fn sampled(&self) -> Sampled;

    /// Moves a camera to a pose, for a picture of so many pixels, in whatever is submitted to the queue from
    /// here on.
    fn place(
        &self,
        camera: &Self::Camera,
        queue: &wgpu::Queue,
        textures: &Textures,
        pose: &Self::Pose,
        picture: [u32; 2],
    );

    /// Bricks that a ray of the scene's shaders meets, about and at most, for a camera that was just placed;
    /// 0 where they show surfaces ([`vastex::ViewMut::set_bricks_of_a_ray`]).
    fn bricks_of_a_ray(&self, camera: &Self::Camera) -> u32 {
        let _ = camera;
        0
    }

    /// Returns true if a camera that was just placed sees what it saw before, by rays: then every pixel is
    /// looked at before all is there ([`vastex::ViewMut::set_resting`]).
    fn rests(&self, camera: &Self::Camera) -> bool {
        let _ = camera;
        false
    }

    /// Draws what a camera wants to see, into a pass of [`vastex::ViewMut::feedback`].
    fn draw_wanted(&self, camera: &Self::Camera, pass: &mut wgpu::RenderPass<'_>, textures: &wgpu::BindGroup);

    /// Draws what a camera sees: every pixel of the target. In [`vastex::ViewMut::main_pass`] the picture
    /// also reports what it wants.
    fn draw_picture(
        &self,
        camera: &Self::Camera,
        encoder: &mut wgpu::CommandEncoder,
        textures: &wgpu::BindGroup,
        target: &Target<'_>,
    );
}

/// A view of a scene in one frame.
#[derive(Debug)]
pub struct StageView<'a, S: StageScene + ?Sized> {
    /// The view of the textures.
    pub view: ViewId,
    /// The camera that the view is seen through.
    pub camera: &'a S::Camera,
    /// Where the camera is.
    pub pose: S::Pose,
}

/// When frames draw pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pictures {
    /// In every frame.
    Always,
    /// If pictures say what they want ([`FeedbackMode::Inline`]); otherwise something else is shown, or
    /// nothing.
    ForFeedback,
    /// In no frame.
    Never,
}

/// What is drawn in one frame.
#[derive(Debug)]
pub struct Frame<'a, S: StageScene + ?Sized> {
    /// The views that say what they want in this frame, the main one first.
    pub views: &'a [StageView<'a, S>],
    /// Where the main camera is expected to be when what is asked for now has arrived.
    pub expected: Option<(&'a S::Camera, S::Pose)>,
    /// Width and height of a view in pixels.
    pub picture: [u32; 2],
    /// True if a feedback pass asks views what they want.
    pub has_feedback: bool,
    /// When pictures are drawn.
    pub pictures: Pictures,
}

/// How long the GPU took for a part of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct PartTime {
    /// What the part is called.
    pub part: String,
    /// Milliseconds.
    pub ms: f32,
}

impl<S: StageScene + ?Sized> Frame<'_, S> {
    /// Records a frame: places the cameras, has the views say what they want, updates the textures, and
    /// draws. `tell` may say in another way what is wanted, after the cameras are in place. What is given
    /// back is to be submitted before the next frame.
    pub fn record(
        &self,
        gpu: &Gpu,
        textures: &mut Textures,
        scene: &S,
        target: &Target<'_>,
        tell: impl FnOnce(&mut Textures, &mut wgpu::CommandEncoder) -> Result<(), Error>,
    ) -> Result<wgpu::CommandEncoder, Error> {
        let mut encoder = self.record_wanted(gpu, textures, scene, tell, |_, _| {})?;
        self.record_pictures(&mut encoder, textures, scene, target)?;
        Ok(encoder)
    }

    /// Records the pictures of a frame, as [`Frame::record`] does after [`Frame::record_wanted`].
    pub fn record_pictures(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        textures: &mut Textures,
        scene: &S,
        target: &Target<'_>,
    ) -> Result<(), Error> {
        let (picture, sampled) = (self.picture, scene.sampled());
        let is_drawn = match self.pictures {
            Pictures::Always => true,
            // Rays say what they want in a pass of their own.
            Pictures::ForFeedback => {
                let shows_surfaces = self.views.iter().any(|seen| scene.bricks_of_a_ray(seen.camera) == 0);
                shows_surfaces && textures.inspect().feedback_mode() == FeedbackMode::Inline
            }
            Pictures::Never => false,
        };
        for StageView { view, camera, .. } in self.views.iter().filter(|_| is_drawn) {
            textures.view_mut(*view)?.main_pass(encoder, picture, |encoder, groups| {
                if let Some(group) = groups.get(sampled) {
                    scene.draw_picture(camera, encoder, group, target);
                }
            })?;
        }
        if is_drawn {
            target.encode(encoder);
        }
        Ok(())
    }

    /// Records a frame without its picture: places the cameras, has the views say what they want, and updates
    /// the textures, as [`Frame::record`] does before it draws. `mark` is told in front of the commands of a
    /// part of the frame which part that is, and may add commands of its own that measure it.
    pub fn record_wanted(
        &self,
        gpu: &Gpu,
        textures: &mut Textures,
        scene: &S,
        tell: impl FnOnce(&mut Textures, &mut wgpu::CommandEncoder) -> Result<(), Error>,
        mut mark: impl FnMut(&mut wgpu::CommandEncoder, Option<&'static str>),
    ) -> Result<wgpu::CommandEncoder, Error> {
        let (picture, sampled) = (self.picture, scene.sampled());
        textures.bind_group(sampled)?;
        for StageView { camera, pose, .. } in self.views {
            scene.place(camera, &gpu.queue, textures, pose, picture);
        }
        for StageView { view, camera, .. } in self.views {
            let mut view = textures.view_mut(*view)?;
            view.set_bricks_of_a_ray(scene.bricks_of_a_ray(camera));
            view.set_resting(scene.rests(camera));
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        mark(&mut encoder, Some("feedback"));
        tell(textures, &mut encoder)?;
        for StageView { view, camera, .. } in self.views.iter().filter(|_| self.has_feedback) {
            textures.view_mut(*view)?.feedback(&mut encoder, picture, |pass, groups| {
                draw_wanted(scene, camera, pass, groups);
            })?;
        }
        if let Some((camera, pose)) = &self.expected {
            scene.place(camera, &gpu.queue, textures, pose, picture);
            textures.ahead().feedback(&mut encoder, picture, |pass, groups| {
                draw_wanted(scene, camera, pass, groups);
            })?;
        }
        textures.update()?;
        Ok(encoder)
    }
}

/// Draws what a camera sees from where it is, with the tiles that are in the pools now; requests nothing. If
/// a texture of the scene was removed, it draws nothing.
pub fn draw_again<S: StageScene + ?Sized>(
    encoder: &mut wgpu::CommandEncoder,
    textures: &Textures,
    scene: &S,
    camera: &S::Camera,
    target: &Target<'_>,
) {
    if let Ok(group) = textures.bind_group(scene.sampled()) {
        scene.draw_picture(camera, encoder, group, target);
        target.encode(encoder);
    }
}

fn draw_wanted<S: StageScene + ?Sized>(
    scene: &S,
    camera: &S::Camera,
    pass: &mut wgpu::RenderPass<'_>,
    groups: &vastex::BindGroups,
) {
    if let Some(group) = groups.get(scene.sampled()) {
        scene.draw_wanted(camera, pass, group);
    }
}
