//! Feedback: how a view says what it wants, in a pass of its own or from its main pass.

use vastex_core::{Feedback, SurveySettings, TextureId, ViewId};
#[cfg(doc)]
use vastex_wgpu::FeedbackWay;

use super::Textures;
use crate::error::Error;
use crate::gpu::{BindGroups, FeedbackPass};

impl Textures {
    /// Draws the main view's feedback pass of this frame, for a picture of so many pixels: `draw` draws the scene with a pipeline
    /// whose vertex shader ends in `vastex_feedback_clip(view, clip)` and whose fragment shader returns `vastex_feedback(id, view, uv)`, into
    /// [`Textures::FEEDBACK_FORMAT`] and [`Textures::FEEDBACK_DEPTH_FORMAT`] (cleared to 1, or where depth is reversed to 0).
    ///
    /// To be called before [`Textures::update`], once per frame; a frame without it keeps what was wanted. Draws nothing where the way is
    /// [`FeedbackWay::Inline`]; [`Textures::main_pass`] does it then.
    pub fn feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<(), Error> {
        self.feedback_of(encoder, ViewId::MAIN, picture, draw)
    }

    /// Draws the feedback pass of any view, else as [`Textures::feedback`]: at most once per view and frame, by
    /// shaders that are given [the view's number](Textures::view_number). A view need not be drawn in every frame: what it wanted in its last 16 feedbacks
    /// stays wanted. Draws nothing for a view that there is not.
    pub fn feedback_of(
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

    /// The same for a pass that the application begins itself, as a render graph does: points the view's shaders at its feedback target,
    /// by a command in `encoder`, and says what the pass is begun with. To be recorded in front of the pass, and
    /// [`Textures::end_feedback`] behind it, in the same encoder or in another that is submitted later, both before [`Textures::update`].
    /// Nothing where the way is [`FeedbackWay::Inline`]. Of [`ViewId::EXPECTED`] it is the pass of [`Textures::feedback_expected`], which is
    /// not worth drawing where [`Textures::can_look_ahead`] says so.
    ///
    /// Fails where there is no such view, where the picture has no pixels or too many, and where the view's pass before was not ended: that is
    /// given up, and the next call is good.
    ///
    /// ```no_run
    /// # fn draw(_: &mut wgpu::RenderPass<'_>) {}
    /// # fn frame(textures: &mut vastex::Textures, encoder: &mut wgpu::CommandEncoder) -> Result<(), vastex::Error> {
    /// if let Some(begun) = textures.begin_feedback(encoder, vastex::ViewId::MAIN, [1280, 720])? {
    ///     let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
    ///         color_attachments: &[Some(begun.color_attachment())],
    ///         depth_stencil_attachment: Some(begun.depth_attachment()),
    ///         ..Default::default()
    ///     });
    ///     let [x, y, width, height] = begun.scissor();
    ///     pass.set_scissor_rect(x, y, width, height);
    ///     draw(&mut pass);
    ///     drop(pass);
    ///     textures.end_feedback(encoder, vastex::ViewId::MAIN)?;
    /// }
    /// # Ok(()) }
    /// ```
    pub fn begin_feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: ViewId,
        picture: [u32; 2],
    ) -> Result<Option<FeedbackPass>, Error> {
        if view == ViewId::EXPECTED && !self.gpu.has_view(view) {
            self.gpu.begin_view(view);
        }
        if self.gpu.needs_feedback_path(view, picture) {
            self.catch_up()?;
        }
        self.gpu.begin_feedback(encoder, view, picture, self.paging.frame())
    }

    /// Records compaction and the way back of what the pass has drawn that [`Textures::begin_feedback`] was called for. Fails where there is no
    /// such pass.
    pub fn end_feedback(&mut self, encoder: &mut wgpu::CommandEncoder, view: ViewId) -> Result<(), Error> {
        self.gpu.end_feedback(encoder, view)
    }

    /// Draws the main view's picture of so many pixels: `draw` records the passes that the application draws it with. Where the way is
    /// [`FeedbackWay::Inline`], the picture says by itself what it wants: its fragment shaders call `vastex_tell(view, position, wanted)`, and it
    /// begins at the first pixel of its target. Otherwise nothing but `draw` happens, so that an application that calls both this
    /// and [`Textures::feedback`] serves every way.
    ///
    /// To be called after [`Textures::update`], once per frame.
    pub fn main_pass(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::CommandEncoder, &BindGroups),
    ) -> Result<(), Error> {
        self.main_pass_of(encoder, ViewId::MAIN, picture, draw)
    }

    /// Draws any view's picture, else as [`Textures::main_pass`]: at most once per view and frame, by shaders that are
    /// given [the view's number](Textures::view_number). Draws nothing for a view that there is not.
    pub fn main_pass_of(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: ViewId,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::CommandEncoder, &BindGroups),
    ) -> Result<(), Error> {
        self.catch_up()?;
        self.gpu.main_pass(encoder, view, picture, self.paging.frame(), draw)
    }

    /// Draws the level that the view needs of each part of a texture, in texture space, and says what the view wants by the last of
    /// them that have come back, about two frames old: nothing in the first frames. To be given to [`Textures::want`], or beside
    /// feedback to [`Textures::expect`]; those of several textures together, by [`Feedback::of_pages`].
    ///
    /// `draw` draws every surface that shows the texture, with a pipeline whose vertex shader gives `vastex_texture_space_clip(uv)` as
    /// the position and the picture's clip position to its fragment shader, which returns `vastex_texture_space(id, uv, clip, picture)`; into
    /// [`Textures::TEXTURE_SPACE_FORMAT`], blended by [`Textures::TEXTURE_SPACE_BLEND`], without culling and without depth. `uv`
    /// is 0 to 1. What is hidden is wanted as well. Of [`SurveySettings`] only the number of pages counts. Costs the GPU at most
    /// 65,536 fragments, whatever the picture's size; to be called once per frame and texture, before [`Textures::update`].
    pub fn texture_space(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        texture: TextureId,
        settings: SurveySettings,
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<Option<Feedback>, Error> {
        let Some(state) = self.paging.texture(texture) else { return Ok(None) };
        let of = (texture, &state.description.geometry);
        self.gpu.texture_space(encoder, of, settings.max_pages, self.paging.frame(), draw)
    }
}
