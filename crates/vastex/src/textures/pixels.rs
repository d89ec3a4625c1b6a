//! Questions about pixels: why one shows what it shows, and what each of a picture wants.

use vastex_core::{Feedback, FeedbackCompactor};
use vastex_wgpu::FeedbackScale;

use super::Textures;
use crate::error::Error;
use crate::gpu::BindGroups;
use crate::watch::ExplainedPixel;

/// Questions about pixels of the main view; returned by [`Textures::pixels`].
pub struct Pixels<'a> {
    textures: &'a mut Textures,
}

impl Textures {
    /// Questions about pixels of the main view: why they show what they show, and which pages they want.
    pub fn pixels(&mut self) -> Pixels<'_> {
        Pixels { textures: self }
    }
}

impl Pixels<'_> {
    /// Asks why a pixel of the main view shows what it shows. `pixel` counts from the top left of the
    /// picture; `draw` is what is given to [`Textures::feedback`]. [`Pixels::poll`] has the answer some
    /// frames later.
    ///
    /// Draws a feedback pass of one pixel and brings back its 16 bytes, by a submission of its own; never
    /// waits.
    pub fn explain(
        &mut self,
        picture: [u32; 2],
        pixel: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<(), Error> {
        self.textures.catch_up()?;
        let is_inside = pixel[0] < picture[0] && pixel[1] < picture[1];
        let readback = is_inside
            .then(|| self.textures.gpu.draw_pixel(self.textures.paging.frame(), picture, pixel, draw))
            .transpose()?;
        self.textures.watch.ask_pixel(pixel, self.textures.paging.frame(), readback);
        Ok(())
    }

    /// The answer to the oldest question of [`Pixels::explain`], as the pager has it now; `None` if it has
    /// not arrived, or nothing was asked. Never waits. To be called each frame, until it gives nothing.
    pub fn poll(&mut self) -> Result<Option<ExplainedPixel>, Error> {
        self.textures.watch.poll_explained(self.textures.paging.pager())
    }

    /// Waits for the answer to the oldest question of [`Pixels::explain`]; `None` if nothing was asked. Not
    /// for browsers, where nothing can be waited for.
    pub fn wait(&mut self) -> Result<Option<ExplainedPixel>, Error> {
        self.textures.watch.wait_explained(
            self.textures.gpu.device(),
            self.textures.gpu.queue(),
            self.textures.paging.pager(),
        )
    }

    /// Pixels that were asked about and have no answer yet.
    pub fn asked(&self) -> usize {
        self.textures.watch.asked_pixels()
    }

    /// What every pixel of a picture wants, of each texture by itself, without acting on it: for statistics.
    /// Draws as [`Textures::feedback`] does, whichever the mode, at full resolution, and waits for the
    /// answer.
    pub fn feedback_of_every(
        &mut self,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<Feedback, Error> {
        self.textures.catch_up()?;
        let (frame, scale) = (self.textures.paging.frame(), FeedbackScale::Full);
        let target = self.textures.gpu.draw_feedback_to_look_at(frame, picture, scale, draw)?;
        let raw = self.textures.gpu.read_feedback(&target)?;
        let mut feedback = Feedback::default();
        FeedbackCompactor::new().compact(frame, &raw.pixels, &mut feedback);
        Ok(self.textures.paging.pager().of_members(&feedback))
    }
}
