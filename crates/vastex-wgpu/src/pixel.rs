//! What one pixel of a picture wants, brought back without waiting, at 16 bytes.

use crate::device::alive;
use crate::error::GpuError;
use crate::feedback::FeedbackTarget;
use crate::mapping::{Answer, Mapping, read_buffer};
use crate::raw::PIXEL_BYTES;

/// The read-back of the pixel of a [target of one pixel](FeedbackTarget::of_pixel).
#[derive(Debug)]
pub struct PixelReadback {
    frame: u64,
    buffer: wgpu::Buffer,
    mapping: Mapping,
}

impl PixelReadback {
    /// Records the commands that read the pixel back, as it then is, of a frame.
    pub fn record(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        target: &FeedbackTarget,
        frame: u64,
    ) -> Result<PixelReadback, GpuError> {
        alive(device)?;
        let buffer = read_buffer(device, PIXEL_BYTES.into());
        let mapping = target.raw().copy_pixel_to(encoder, &buffer, target.place_of_pixel());
        Ok(PixelReadback { frame, buffer, mapping })
    }

    /// The pixel, once, if it has arrived: page id low, page id high, eighth, flag. Never waits; what has
    /// arrived shows when the device is [polled](crate::poll), which a submission does too. Fails with
    /// [`GpuError::NoFeedback`] where the commands were dropped.
    pub fn poll(&self) -> Result<Option<[u32; 4]>, GpuError> {
        match self.mapping.answer()? {
            Answer::Mapped => self.mapping.read(&self.buffer, bytemuck::pod_read_unaligned).map(Some),
            Answer::None => Ok(None),
            Answer::Dropped => Err(GpuError::NoFeedback { frame: self.frame }),
        }
    }

    /// The four words of the pixel, for which the call waits. Fails with [`GpuError::NoFeedback`] where the
    /// commands were not submitted, too. Not for browsers, where nothing can be waited for.
    pub fn wait(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<[u32; 4], GpuError> {
        self.mapping.wait(device, queue, &self.buffer)?;
        self.poll()?.ok_or(GpuError::NoFeedback { frame: self.frame })
    }
}
