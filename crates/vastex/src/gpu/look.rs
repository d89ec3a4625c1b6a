//! Feedback that is drawn to be looked at: nothing follows from it.

use vastex_wgpu::{FeedbackScale, FeedbackTarget, PixelReadback, RawFeedback};

use super::views::MAIN;
use super::{BindGroups, Gpu};
use crate::error::Error;

impl Gpu {
    /// Draws what one pixel of the main view wants, and submits that.
    pub(crate) fn draw_pixel(
        &self,
        frame: u64,
        picture: [u32; 2],
        pixel: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<PixelReadback, Error> {
        let target = FeedbackTarget::of_pixel(&self.device, picture, pixel)?;
        let mut encoder = self.draw_into(&target, frame, draw);
        let readback = PixelReadback::record(&self.device, &mut encoder, &target, frame)?;
        self.queue.submit([encoder.finish()]);
        Ok(readback)
    }

    /// Draws the feedback of the main view into a target of its own, and submits that.
    pub(crate) fn draw_feedback_to_look_at(
        &self,
        frame: u64,
        picture: [u32; 2],
        scale: FeedbackScale,
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<FeedbackTarget, Error> {
        let target = FeedbackTarget::new(&self.device, picture, scale)?;
        let encoder = self.draw_into(&target, frame, draw);
        self.queue.submit([encoder.finish()]);
        Ok(target)
    }

    fn draw_into(
        &self,
        target: &FeedbackTarget,
        frame: u64,
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> wgpu::CommandEncoder {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let (views, clear_depth) = (&self.view_params, self.clear_depth());
        let mut pass = target.begin(&self.device, &mut encoder, views, MAIN, frame, clear_depth);
        draw(&mut pass, &self.bind_groups);
        drop(pass);
        views.end(&mut encoder, MAIN);
        encoder
    }

    /// What a target holds; waits for it.
    pub(crate) fn read_feedback(&self, target: &FeedbackTarget) -> Result<RawFeedback, Error> {
        Ok(RawFeedback::read(&self.device, &self.queue, target.raw())?)
    }
}
