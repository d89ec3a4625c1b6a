//! Looking ahead: feedback of the view that a moving camera will have when tiles that are asked for now are here.
//!
//! It goes the way of any view's feedback, but what it wants comes after everything in view (`vastex_core::Pager::expect`).

use vastex_core::ViewId;

use super::Textures;
use crate::error::Error;
use crate::gpu::{BindGroups, FEEDBACK_FRAMES};

/// Frames that a tile is thought to take before any has come.
const FIRST_GUESS: u64 = 4;

impl Textures {
    /// Frames ahead of which a view should be expected: what feedback takes, and what 95 % of the last tiles have taken from their
    /// request on. Where a camera will be then, [`vastex_core::Motion`] works out.
    pub fn frames_ahead(&self) -> u64 {
        FEEDBACK_FRAMES + self.paging.pager().arrival_frames().map_or(FIRST_GUESS, u64::from)
    }

    /// Whether [`Textures::feedback_expected`] would draw: not while pages in view wait for the in-flight budget.
    pub fn can_look_ahead(&self) -> bool {
        !self.paging.pager().is_short_of_bandwidth()
    }

    /// Draws what is expected to be seen in [`Textures::frames_ahead`] frames, as [`Textures::feedback`] does what is seen, but at a
    /// quarter of the cost; its pages are loaded after everything in view. At most once per frame, with the bind groups that `draw`
    /// is given. Where bandwidth is short for the view itself it draws nothing, and costs nothing; says whether it has drawn.
    ///
    /// ```no_run
    /// # fn draw(_: &mut wgpu::RenderPass<'_>, _: &wgpu::BindGroup, _camera: [f64; 3]) {}
    /// # fn frame(textures: &mut vastex::Textures, encoder: &mut wgpu::CommandEncoder, earth: vastex::TextureId,
    /// #     before: [[f64; 3]; 2], now: [f64; 3]) -> Result<(), vastex::Error> {
    /// textures.feedback(encoder, [1280, 720], |pass, groups| draw(pass, &groups[earth], now))?;
    /// let motion = vastex::Motion::through([before[0], before[1], now]);
    /// let then = motion.position_after(textures.frames_ahead() as f64);
    /// textures.feedback_expected(encoder, [1280, 720], |pass, groups| draw(pass, &groups[earth], then))?;
    /// textures.update()?;
    /// # Ok(()) }
    /// ```
    pub fn feedback_expected(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<bool, Error> {
        let can = self.can_look_ahead();
        if can {
            if !self.gpu.has_view(ViewId::EXPECTED) {
                self.gpu.begin_view(ViewId::EXPECTED);
            }
            self.feedback_of(encoder, ViewId::EXPECTED, picture, draw)?;
        }
        Ok(can)
    }
}
