//! Looking into the machine: why a pixel shows what it shows, what the feedback pass sees, what is in the slots.
//!
//! For people and tools. What shaders can tell of a place is `vastex_inspect`'s business.

use vastex_core::{Explanation, Feedback, FeedbackCompactor, PageId, SlotUsage, TextureId, WantedPage};
use vastex_wgpu::{FeedbackScale, FeedbackTarget};

use super::Textures;
use crate::error::Error;
use crate::gpu::BindGroups;
use crate::watch::ExplainedPixel;

impl Textures {
    /// Asks why a pixel of the main view shows what it shows. `pixel` counts from the top left of the picture; `draw` is what is given to
    /// [`Textures::feedback`]. [`Textures::poll_explained`] has the answer some frames later.
    ///
    /// Draws a feedback pass of one pixel and brings back its 16 bytes, by a submission of its own; never waits.
    pub fn explain_pixel(
        &mut self,
        picture: [u32; 2],
        pixel: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<(), Error> {
        self.catch_up()?;
        let is_inside = pixel[0] < picture[0] && pixel[1] < picture[1];
        let readback =
            is_inside.then(|| self.gpu.draw_pixel(self.paging.frame(), picture, pixel, draw)).transpose()?;
        self.watch.ask_pixel(pixel, self.paging.frame(), readback);
        Ok(())
    }

    /// The answer to the oldest question of [`Textures::explain_pixel`], as the pager has it now; nothing where it has not arrived, or
    /// nothing was asked. Never waits. To be called each frame, until it gives nothing.
    pub fn poll_explained(&mut self) -> Result<Option<ExplainedPixel>, Error> {
        self.watch.poll_explained(self.paging.pager())
    }

    /// The same, for which it waits; nothing where nothing was asked. Not for browsers, where nothing can be waited for.
    pub fn wait_explained(&mut self) -> Result<Option<ExplainedPixel>, Error> {
        self.watch.wait_explained(self.gpu.device(), self.gpu.queue(), self.paging.pager())
    }

    /// Pixels that were asked about and have no answer yet.
    pub fn asked_pixels(&self) -> usize {
        self.watch.asked_pixels()
    }

    /// Why a place of a texture shows what it shows where this page is wanted, at mip bias 0; nothing where there is no such page.
    pub fn explain(&self, page: PageId) -> Option<Explanation> {
        self.paging.pager().explain(WantedPage { page, pixels: 1, eighth: 0 })
    }

    /// The feedback of the main view in this frame, drawn once more to be looked at: nothing follows from it. Its texture holds what
    /// the shaders wrote, row by row: page id low, page id high, eighth, flag.
    ///
    /// Submits a pass of its own, so the frame's own feedback must not be in an encoder that is not submitted yet.
    pub fn feedback_to_look_at(
        &self,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<FeedbackTarget, Error> {
        self.gpu.draw_feedback_to_look_at(self.paging.frame(), picture, FeedbackScale::Reduced, draw)
    }

    /// What is in each slot of a texture's pool, that of other textures too; nothing where one is free. Empty where there is no such texture.
    pub fn slots_beside(&self, texture: TextureId) -> Vec<Option<SlotUsage>> {
        self.pool_of(texture).map_or_else(Vec::new, |pool| self.paging.pager().pool(pool).slots())
    }

    /// What every pixel of a picture wants, of each texture by itself, without acting on it: for statistics. Draws as
    /// [`Textures::feedback`] does, whichever the way, at full resolution, and waits for the answer.
    pub fn feedback_of_every_pixel(
        &mut self,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<Feedback, Error> {
        self.catch_up()?;
        let (frame, scale) = (self.paging.frame(), FeedbackScale::Full);
        let target = self.gpu.draw_feedback_to_look_at(frame, picture, scale, draw)?;
        let raw = self.gpu.read_feedback(&target)?;
        let mut feedback = Feedback::default();
        FeedbackCompactor::new().compact(frame, &raw.pixels, &mut feedback);
        Ok(self.paging.pager().of_members(&feedback))
    }
}
