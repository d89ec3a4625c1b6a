//! What a program that has nothing else to do waits for: a device, and pictures that are read back.

use vastex_viewer::stage::TextureRead;
use vastex_viewer::{Gpu, GpuSetupError};

/// A device without a window, as [`Gpu::headless`] gives it; waits for it.
pub fn headless_gpu() -> Result<Gpu, GpuSetupError> {
    pollster::block_on(Gpu::headless())
}

/// Submits the encoder's commands and reads a texture of so many bytes a pixel, row by row without padding.
/// Waits.
///
/// A device that is lost gives zeros; the next call of the frame loop says why.
pub(crate) fn read_texture(
    gpu: &Gpu,
    encoder: wgpu::CommandEncoder,
    texture: &wgpu::Texture,
    pixel_bytes: u32,
) -> Vec<u8> {
    let read = TextureRead::submit(gpu, encoder, texture, pixel_bytes);
    let zeros = || vec![0; (texture.width() * texture.height() * pixel_bytes) as usize];
    loop {
        if gpu.device.poll(wgpu::PollType::wait_indefinitely()).is_err() {
            tracing::error!("the device does not answer");
            return zeros();
        }
        if let Some(bytes) = read.take() {
            return bytes.unwrap_or_else(|_| zeros());
        }
        // Another thread that polls the same device has taken the answer, and is about to hand it over.
        std::thread::yield_now();
    }
}
