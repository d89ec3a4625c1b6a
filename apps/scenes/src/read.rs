//! Brings what was drawn back to the CPU.

use crate::gpu::Gpu;

/// Submits the encoder's commands and reads a texture of so many bytes a pixel, row by row without padding. Waits.
///
/// A device that is lost gives zeros; the next call of the frame loop says why.
pub(crate) fn read_texture(
    gpu: &Gpu,
    mut encoder: wgpu::CommandEncoder,
    texture: &wgpu::Texture,
    pixel_bytes: u32,
) -> Vec<u8> {
    let line = texture.width() * pixel_bytes;
    let row = line.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("picture"),
        size: u64::from(row) * u64::from(texture.height()),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
    gpu.queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    if gpu.device.poll(wgpu::PollType::wait_indefinitely()).is_err() {
        tracing::error!("the device does not answer");
    }
    let mut pixels = Vec::with_capacity(line as usize * texture.height() as usize);
    match buffer.get_mapped_range(..) {
        Ok(bytes) => {
            bytes.chunks(row as usize).for_each(|bytes| pixels.extend_from_slice(&bytes[..line as usize]));
        }
        Err(_) => pixels.resize(line as usize * texture.height() as usize, 0),
    }
    pixels
}
