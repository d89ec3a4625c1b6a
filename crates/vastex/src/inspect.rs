//! Looking into the machine: why a pixel shows what it shows, what the feedback pass sees, what is in the slots.
//!
//! For people and tools, and as slow as that allows. What shaders can tell of a place is `vastex_inspect`'s business.

use vastex_core::{Explanation, Feedback, PageId, SlotUsage, TextureId, WantedPage};
use vastex_wgpu::{FeedbackScale, FeedbackTarget, RawFeedback};

use crate::error::Error;
use crate::textures::{BindGroups, Textures};

impl Textures {
    /// Why a pixel of the main view shows what it shows: of each texture that it wants a page of, so of every member of a group.
    /// Nothing where no texture is. `pixel` counts from the top left of the picture; `draw` is what is given to [`Textures::feedback`].
    ///
    /// Draws a feedback pass of every pixel and waits for it, at 16 bytes a pixel.
    pub fn explain_pixel(
        &self,
        picture: [u32; 2],
        pixel: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<Vec<Explanation>, Error> {
        let target = self.draw_feedback_to_look_at(picture, FeedbackScale::Full, draw)?;
        let RawFeedback { size: [width, height], pixels } =
            RawFeedback::read(&self.device, &self.queue, target.raw())?;
        if pixel[0] >= width || pixel[1] >= height {
            return Ok(Vec::new());
        }
        let mut feedback = Feedback::default();
        let of_pixel = [pixels[(pixel[1] * width + pixel[0]) as usize]];
        vastex_core::FeedbackCompactor::new().compact(self.frame, &of_pixel, &mut feedback);
        let wanted = self.pagers.of_members(&feedback).pages;
        Ok(wanted.into_iter().filter_map(|wanted| self.pagers.explain(wanted)).collect())
    }

    /// Why a place of a texture shows what it shows where this page is wanted, at mip bias 0; nothing where there is no such page.
    pub fn explain(&self, page: PageId) -> Option<Explanation> {
        self.pagers.explain(WantedPage { page, pixels: 1, eighth: 0 })
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
        self.draw_feedback_to_look_at(picture, FeedbackScale::Reduced, draw)
    }

    /// What is in each slot of a texture's pool, that of other textures too; nothing where one is free. Empty where there is no such texture.
    pub fn slots_beside(&self, texture: TextureId) -> Vec<Option<SlotUsage>> {
        self.pagers.pool_of(texture).map_or_else(Vec::new, |pool| self.pagers.pager(pool).slots())
    }

    /// Draws the feedback of the main view into a target of its own, and submits that.
    pub(crate) fn draw_feedback_to_look_at(
        &self,
        picture: [u32; 2],
        scale: FeedbackScale,
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<FeedbackTarget, Error> {
        let target = FeedbackTarget::new(&self.device, picture, scale)?;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let (main, clear_depth) = (&self.views[0], self.clear_depth());
        let mut pass = target.begin(&self.device, &mut encoder, &main.params, self.frame, clear_depth);
        draw(&mut pass, &main.groups);
        drop(pass);
        self.queue.submit([encoder.finish()]);
        Ok(target)
    }
}
