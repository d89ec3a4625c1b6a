//! Feedback passes that an application begins and ends itself, as render graphs do: what it needs for that,
//! and what is recorded behind it.

use vastex_core::ViewId;

use super::Gpu;
use super::feedback_path::Target;
use super::views::ViewState;
use crate::error::Error;

/// Attachments and scissor with which an application begins a feedback pass, for one pass of one frame;
/// [`ViewMut::begin_feedback`](crate::ViewMut::begin_feedback) returns it.
///
/// The pass has one colour and one depth attachment, of one sample each, both of [`FeedbackPass::size`]. Its
/// viewport is the whole target, its scissor rectangle [`FeedbackPass::scissor`].
#[derive(Clone, Debug)]
pub struct FeedbackPass {
    color: wgpu::TextureView,
    depth: wgpu::TextureView,
    size: [u32; 2],
    scissor: [u32; 4],
    clear_depth: f32,
    view_number: u32,
}

impl FeedbackPass {
    /// The colour target, of [`Textures::FEEDBACK_FORMAT`](crate::Textures::FEEDBACK_FORMAT); to be cleared
    /// to zeros and stored.
    pub fn color(&self) -> &wgpu::TextureView {
        &self.color
    }

    /// The pass's depth buffer, of
    /// [`Textures::FEEDBACK_DEPTH_FORMAT`](crate::Textures::FEEDBACK_DEPTH_FORMAT); to be cleared to
    /// [`FeedbackPass::clear_depth`], and not kept.
    pub fn depth(&self) -> &wgpu::TextureView {
        &self.depth
    }

    /// Width and height of both in pixels: an eighth of the picture's, of [`ViewId::EXPECTED`] a sixteenth,
    /// rounded up. A view of rays has as many times the rows as a ray answers at once, up to 8.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// First column and row, and how many of each: the scissor rectangle of this frame, without which pixels
    /// beyond the picture ask as well.
    pub fn scissor(&self) -> [u32; 4] {
        self.scissor
    }

    /// The farthest depth: 1, or 0 where [depth is reversed](crate::Settings::reversed_depth).
    pub fn clear_depth(&self) -> f32 {
        self.clear_depth
    }

    /// The number by which shaders know the view, as [`ViewRef::number`](crate::ViewRef::number) says it.
    pub fn view_number(&self) -> u32 {
        self.view_number
    }

    /// The colour attachment, cleared to zeros and stored.
    pub fn color_attachment(&self) -> wgpu::RenderPassColorAttachment<'_> {
        wgpu::RenderPassColorAttachment {
            view: &self.color,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                store: wgpu::StoreOp::Store,
            },
        }
    }

    /// The depth attachment, cleared to the farthest depth and discarded.
    pub fn depth_attachment(&self) -> wgpu::RenderPassDepthStencilAttachment<'_> {
        wgpu::RenderPassDepthStencilAttachment {
            view: &self.depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(self.clear_depth),
                store: wgpu::StoreOp::Discard,
            }),
            stencil_ops: None,
        }
    }
}

impl Gpu {
    /// Points a view at its target, for a pass that the application begins; `None` if the main pass says what
    /// it wants.
    pub(crate) fn begin_feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: ViewId,
        picture: [u32; 2],
        frame: u64,
    ) -> Result<Option<FeedbackPass>, Error> {
        if !self.has_view(view) {
            return Err(Error::NoView(view));
        }
        self.check_ended(view)?;
        if !self.is_drawn_apart(view) {
            return Ok(None);
        }
        self.check_number_is_free(view)?;
        self.fit_feedback_path(view, picture)?;
        self.check_once(view, frame)?;
        let (clear_depth, view_number) = (self.clear_depth(), self.view_number(view));
        let Some(state) = self.views.iter_mut().find(|state| state.view == view) else { return Ok(None) };
        let look = state.look();
        let ViewState { number, path: Some(path), begun, .. } = state else { return Ok(None) };
        let Target::Drawn(target) = &path.target else { return Ok(None) };
        let scissor = target.point(&self.device, encoder, &self.view_params, *number, look);
        *begun = Some((frame, look));
        let (color, depth, size) = (target.color().clone(), target.depth().clone(), target.size());
        Ok(Some(FeedbackPass { color, depth, size, scissor, clear_depth, view_number }))
    }

    /// Records what brings the feedback of a pass back that the application has begun, as that of the frame
    /// in which it did.
    pub(crate) fn end_feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: ViewId,
    ) -> Result<(), Error> {
        let is_apart = self.is_drawn_apart(view);
        let state = self.views.iter_mut().find(|state| state.view == view).ok_or(Error::NoView(view))?;
        let Some(drawn) = state.begun.take() else {
            // There is nothing to end where the main pass says what it wants.
            return if is_apart { Err(Error::FeedbackNotBegun(view)) } else { Ok(()) };
        };
        self.record_feedback(encoder, view, drawn);
        Ok(())
    }

    /// Fails where the last pass of a view was not ended: what that has drawn is given up then.
    pub(crate) fn check_ended(&mut self, view: ViewId) -> Result<(), Error> {
        let state = self.views.iter_mut().find(|state| state.view == view);
        match state.and_then(|state| state.begun.take()) {
            Some((frame, _)) => Err(Error::FeedbackNotEnded { view, frame }),
            None => Ok(()),
        }
    }

    /// Fails where the pass of another view that shaders know by the same number is begun and not ended: its
    /// draws would see this view. What that has drawn is given up.
    pub(super) fn check_number_is_free(&mut self, view: ViewId) -> Result<(), Error> {
        let number = self.view_number(view);
        let mut others = self.views.iter_mut().filter(|state| state.view != view && state.number == number);
        match others.find_map(|state| Some((state.view, state.begun.take()?))) {
            Some((view, (frame, _))) => Err(Error::FeedbackNotEnded { view, frame }),
            None => Ok(()),
        }
    }
}
