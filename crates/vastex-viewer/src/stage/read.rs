//! Brings what was drawn back to the CPU, without waiting for it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use crate::gpu::Gpu;

/// A texture that is not read back: the device is lost, or refused the buffer for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "what was drawn cannot be read back: the graphics device is lost or out of memory; try a smaller picture"
)]
pub struct ReadBackError;

const WAITING: u8 = 0;
const MAPPED: u8 = 1;
const FAILED: u8 = 2;

/// The bytes of a texture on their way to the CPU.
#[derive(Debug)]
pub struct TextureRead {
    buffer: wgpu::Buffer,
    state: Arc<AtomicU8>,
    /// Bytes of a row of texels, and of a row in the buffer.
    line: usize,
    row: usize,
    height: usize,
}

impl TextureRead {
    /// Adds a copy of a texture, of so many bytes a pixel, to the encoder's commands and submits them. The
    /// texture needs [`wgpu::TextureUsages::COPY_SRC`].
    pub fn submit(
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
        texture: &wgpu::Texture,
        pixel_bytes: u32,
    ) -> TextureRead {
        let line = texture.width() * pixel_bytes;
        let row = line.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(row) * u64::from(texture.height()),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
        gpu.queue.submit([encoder.finish()]);
        let state = Arc::new(AtomicU8::new(WAITING));
        let mapped = state.clone();
        buffer.map_async(wgpu::MapMode::Read, .., move |outcome| {
            mapped.store(if outcome.is_ok() { MAPPED } else { FAILED }, Ordering::Release);
        });
        TextureRead {
            buffer,
            state,
            line: line as usize,
            row: row as usize,
            height: texture.height() as usize,
        }
    }

    /// The bytes row by row without padding, once they are here; `None` before. They come while the device
    /// is polled, which every frame of the textures does; [`wgpu::Device::poll`] does it for those who wait.
    pub fn take(&self) -> Option<Result<Vec<u8>, ReadBackError>> {
        match self.state.load(Ordering::Acquire) {
            WAITING => None,
            FAILED => Some(Err(ReadBackError)),
            _ => Some(self.bytes()),
        }
    }

    fn bytes(&self) -> Result<Vec<u8>, ReadBackError> {
        let bytes = self.buffer.get_mapped_range(..).map_err(|_| ReadBackError)?;
        let mut pixels = Vec::with_capacity(self.line * self.height);
        bytes.chunks(self.row).for_each(|row| pixels.extend_from_slice(&row[..self.line]));
        Ok(pixels)
    }
}
