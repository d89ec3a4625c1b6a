//! The pixels of a feedback target, read as they are: for statistics of a whole picture, and for tests.

use crate::device::alive;
use crate::error::GpuError;
use crate::feedback::FeedbackTarget;
use crate::mapping::{Mapping, read_buffer};

/// The pixels of a feedback target, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawFeedback {
    /// Size in pixels.
    pub size: [u32; 2],
    /// Each pixel as `vastex_feedback` wrote it: page id low, page id high, eighth, flag.
    pub pixels: Vec<[u32; 4]>,
}

impl RawFeedback {
    /// Reads a target after its pass was submitted. Blocks; for statistics and tests, at 16 bytes a pixel.
    pub fn read(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        target: &FeedbackTarget,
    ) -> Result<RawFeedback, GpuError> {
        alive(device)?;
        let [width, height] = target.size();
        let row = (width * 16).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let size = u64::from(row) * u64::from(height);
        let buffer = read_buffer(device, size);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            target.raw().as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
        let mapping = Mapping::on_submit(&encoder, &buffer, size);
        queue.submit([encoder.finish()]);
        if !mapping.wait(device)? {
            return Err(GpuError::DeviceLost);
        }
        let pixels = mapping.read(&buffer, |bytes| {
            let rows = bytes.chunks_exact(row as usize);
            rows.flat_map(|row| row[..width as usize * 16].chunks_exact(16))
                .map(bytemuck::pod_read_unaligned)
                .collect()
        })?;
        Ok(RawFeedback { size: [width, height], pixels })
    }
}
