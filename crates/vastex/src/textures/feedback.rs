//! Feedback: how the main view says what it wants, in a pass of its own or from its main pass. Any other is a
//! handle of its own (`views`).

use vastex_core::ViewId;
#[cfg(doc)]
use vastex_wgpu::FeedbackMode;

use super::Textures;
use crate::error::Error;
use crate::gpu::BindGroups;

impl Textures {
    /// Draws the main view's feedback pass of this frame, for a picture of so many pixels: `draw` draws the
    /// scene with a pipeline whose vertex shader ends in `vastex_feedback_clip(view, clip)` and whose
    /// fragment shader returns `vastex_feedback(id, view, uv)`, into [`Textures::FEEDBACK_FORMAT`] and
    /// [`Textures::FEEDBACK_DEPTH_FORMAT`] (cleared to 1, or where depth is reversed to 0).
    ///
    /// To be called before [`Textures::update`], once per frame; in a frame without it, the pages of the last
    /// frames stay wanted. With [`FeedbackMode::Inline`] this call draws nothing, and [`Textures::main_pass`]
    /// does its work, unless the main view is one of rays
    /// ([`ViewMut::set_bricks_of_a_ray`](crate::ViewMut::set_bricks_of_a_ray)).
    ///
    /// Fails if the picture has no pixels or more than a target can have, if the view's feedback of this
    /// frame is recorded already ([`Error::FeedbackTwice`]), and if a pass of
    /// [`ViewMut::begin_feedback`](crate::ViewMut::begin_feedback) was not ended
    /// ([`Error::FeedbackNotEnded`], once). A picture of another size than before costs a new target and new
    /// read-back buffers.
    pub fn feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<(), Error> {
        self.draw_feedback(encoder, ViewId::MAIN, picture, draw)
    }

    /// Draws the feedback pass of any view.
    pub(super) fn draw_feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: ViewId,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<(), Error> {
        self.gpu.check_ended(view)?;
        if self.gpu.needs_feedback_path(view, picture) {
            self.catch_up()?;
        }
        self.gpu.feedback(encoder, view, picture, self.paging.frame(), draw)
    }

    /// Draws the main view's picture of so many pixels: `draw` records the passes that the application draws
    /// it with. In [`FeedbackMode::Inline`] the picture itself says what it wants: its fragment shaders call
    /// `vastex_report(view, position, wanted)`, and it begins at the first pixel of its target. In other
    /// modes, and where the main view is one of rays, only `draw` is called, so that an application that
    /// calls both this and [`Textures::feedback`] serves every mode.
    ///
    /// To be called after [`Textures::update`], once per frame. Fails as [`Textures::feedback`] does, where
    /// the mode is [`FeedbackMode::Inline`]; `draw` is not called then.
    pub fn main_pass(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::CommandEncoder, &BindGroups),
    ) -> Result<(), Error> {
        self.draw_main_pass(encoder, ViewId::MAIN, picture, draw)
    }

    /// Draws the picture of any view.
    pub(super) fn draw_main_pass(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: ViewId,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::CommandEncoder, &BindGroups),
    ) -> Result<(), Error> {
        self.catch_up()?;
        self.gpu.main_pass(encoder, view, picture, self.paging.frame(), draw)
    }
}
