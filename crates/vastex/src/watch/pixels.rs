//! Questions about pixels: why does one show what it shows?
//!
//! What is asked here is drawn by the GPU and answered some frames later.

use std::collections::VecDeque;

use vastex_core::{Explanation, Feedback, FeedbackCompactor, Pager};
use vastex_wgpu::PixelReadback;

use crate::error::Error;

/// Questions that may be without an answer at once; of more, the oldest are dropped.
const MOST_ASKED: usize = 16;

/// Why a pixel shows what it shows.
#[derive(Clone, Debug, PartialEq)]
pub struct ExplainedPixel {
    /// The pixel, from the top left of the picture.
    pub pixel: [u32; 2],
    /// Of each texture that it wants a page of, so of every member of a group. `None` if no texture is.
    pub explanations: Vec<Explanation>,
}

/// A question about a pixel.
#[derive(Debug)]
struct AskedPixel {
    pixel: [u32; 2],
    frame: u64,
    /// Nothing for a pixel that the picture does not have.
    readback: Option<PixelReadback>,
}

/// The questions about pixels that have no answer yet, the oldest first.
#[derive(Debug, Default)]
pub(super) struct AskedPixels(VecDeque<AskedPixel>);

impl AskedPixels {
    /// The device that would have answered is gone.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    pub(super) fn ask(&mut self, pixel: [u32; 2], frame: u64, readback: Option<PixelReadback>) {
        if self.0.len() == MOST_ASKED {
            self.0.pop_front();
        }
        self.0.push_back(AskedPixel { pixel, frame, readback });
    }

    pub(super) fn poll(&mut self, pager: &Pager) -> Result<Option<ExplainedPixel>, Error> {
        let Some(asked) = self.0.front() else { return Ok(None) };
        let pixel = match &asked.readback {
            None => None,
            Some(readback) => match readback.poll()? {
                Some(pixel) => Some(pixel),
                None => return Ok(None),
            },
        };
        Ok(self.answer(pixel, pager))
    }

    pub(super) fn wait(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        pager: &Pager,
    ) -> Result<Option<ExplainedPixel>, Error> {
        let Some(asked) = self.0.front() else { return Ok(None) };
        let wait = |readback: &PixelReadback| readback.wait(device, queue);
        let pixel = asked.readback.as_ref().map(wait).transpose()?;
        Ok(self.answer(pixel, pager))
    }

    /// Takes the oldest question, whose pixel is this.
    fn answer(&mut self, pixel: Option<[u32; 4]>, pager: &Pager) -> Option<ExplainedPixel> {
        let AskedPixel { pixel: place, frame, .. } = self.0.pop_front()?;
        let mut feedback = Feedback::default();
        FeedbackCompactor::new().compact(frame, pixel.as_slice(), &mut feedback);
        let wanted = pager.of_members(&feedback).pages;
        let explanations = wanted.into_iter().filter_map(|wanted| pager.explain(wanted)).collect();
        Some(ExplainedPixel { pixel: place, explanations })
    }
}
