//! Looking into the machine: why a pixel shows what it shows, what the feedback pass sees, what is in the slots.
//!
//! For people and tools. What shaders can tell of a place is `vastex_inspect`'s business.

use std::collections::VecDeque;

use vastex_core::{Explanation, Feedback, FeedbackCompactor, PageId, SlotUsage, TextureId, WantedPage};
use vastex_wgpu::{FeedbackScale, FeedbackTarget, PixelReadback};

use crate::error::Error;
use crate::textures::{BindGroups, Textures};

/// Questions that may be without an answer at once; of more, the oldest are dropped.
const MOST_ASKED: usize = 16;

/// Why a pixel shows what it shows.
#[derive(Clone, Debug, PartialEq)]
pub struct ExplainedPixel {
    /// The pixel, from the top left of the picture.
    pub pixel: [u32; 2],
    /// Of each texture that it wants a page of, so of every member of a group. Nothing where no texture is.
    pub explanations: Vec<Explanation>,
}

/// A question about a pixel.
#[derive(Debug)]
pub(crate) struct AskedPixel {
    pixel: [u32; 2],
    frame: u64,
    /// Nothing for a pixel that the picture does not have.
    readback: Option<PixelReadback>,
}

/// The questions about pixels that have no answer yet, the oldest first.
#[derive(Debug, Default)]
pub(crate) struct AskedPixels(VecDeque<AskedPixel>);

impl AskedPixels {
    /// The device that would have answered is gone.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }
}

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
        let is_inside = pixel[0] < picture[0] && pixel[1] < picture[1];
        let readback = is_inside.then(|| self.draw_pixel(picture, pixel, draw)).transpose()?;
        if self.asked_pixels.0.len() == MOST_ASKED {
            self.asked_pixels.0.pop_front();
        }
        self.asked_pixels.0.push_back(AskedPixel { pixel, frame: self.frame, readback });
        Ok(())
    }

    /// The answer to the oldest question of [`Textures::explain_pixel`], as the pager has it now; nothing where it has not arrived, or
    /// nothing was asked. Never waits. To be called each frame, until it gives nothing.
    pub fn poll_explained(&mut self) -> Result<Option<ExplainedPixel>, Error> {
        let Some(asked) = self.asked_pixels.0.front() else { return Ok(None) };
        let pixel = match &asked.readback {
            None => None,
            Some(readback) => match readback.poll()? {
                Some(pixel) => Some(pixel),
                None => return Ok(None),
            },
        };
        Ok(self.answer(pixel))
    }

    /// The same, for which it waits; nothing where nothing was asked. Not for browsers, where nothing can be waited for.
    pub fn wait_explained(&mut self) -> Result<Option<ExplainedPixel>, Error> {
        let Some(asked) = self.asked_pixels.0.front() else { return Ok(None) };
        let wait = |readback: &PixelReadback| readback.wait(&self.device, &self.queue);
        let pixel = asked.readback.as_ref().map(wait).transpose()?;
        Ok(self.answer(pixel))
    }

    /// Pixels that were asked about and have no answer yet.
    pub fn asked_pixels(&self) -> usize {
        self.asked_pixels.0.len()
    }

    /// Takes the oldest question, whose pixel is this.
    fn answer(&mut self, pixel: Option<[u32; 4]>) -> Option<ExplainedPixel> {
        let AskedPixel { pixel: place, frame, .. } = self.asked_pixels.0.pop_front()?;
        let mut feedback = Feedback::default();
        FeedbackCompactor::new().compact(frame, pixel.as_slice(), &mut feedback);
        let wanted = self.pager.of_members(&feedback).pages;
        let explanations = wanted.into_iter().filter_map(|wanted| self.pager.explain(wanted)).collect();
        Some(ExplainedPixel { pixel: place, explanations })
    }

    /// Draws what one pixel of the main view wants, and submits that.
    fn draw_pixel(
        &self,
        picture: [u32; 2],
        pixel: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<PixelReadback, Error> {
        let target = FeedbackTarget::of_pixel(&self.device, picture, pixel)?;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let (main, clear_depth) = (&self.views[0], self.clear_depth());
        let mut pass = target.begin(&self.device, &mut encoder, &main.params, self.frame, clear_depth);
        draw(&mut pass, &main.groups);
        drop(pass);
        let readback = PixelReadback::record(&self.device, &mut encoder, &target, self.frame)?;
        self.queue.submit([encoder.finish()]);
        Ok(readback)
    }

    /// Why a place of a texture shows what it shows where this page is wanted, at mip bias 0; nothing where there is no such page.
    pub fn explain(&self, page: PageId) -> Option<Explanation> {
        self.pager.explain(WantedPage { page, pixels: 1, eighth: 0 })
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
        self.pager.pool_of(texture).map_or_else(Vec::new, |pool| self.pager.pool(pool).slots())
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
