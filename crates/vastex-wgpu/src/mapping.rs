//! From the GPU to the CPU: buffers that are mapped once the commands before are done.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

use crate::error::GpuError;

/// A buffer on its way to being readable.
#[derive(Debug)]
pub(crate) struct Mapping {
    answer: Arc<AtomicU8>,
    size: u64,
}

impl Mapping {
    const MAPPED: u8 = 1;
    const FAILED: u8 = 2;
    /// Milliseconds that an answer may be in the hands of another thread.
    const PATIENCE: u32 = 1000;

    /// Maps the first `size` bytes once the encoder's commands are submitted and done.
    pub(crate) fn on_submit(encoder: &wgpu::CommandEncoder, buffer: &wgpu::Buffer, size: u64) -> Mapping {
        let answer = Arc::new(AtomicU8::new(0));
        let told = Arc::clone(&answer);
        encoder.map_buffer_on_submit(buffer, wgpu::MapMode::Read, 0..size, move |result| {
            told.store(if result.is_ok() { Self::MAPPED } else { Self::FAILED }, Ordering::Release);
        });
        Mapping { answer, size }
    }

    /// Whether the bytes are there. A buffer used as here fails to be mapped only when its device is lost.
    pub(crate) fn arrived(&self) -> Result<bool, GpuError> {
        match self.answer.load(Ordering::Acquire) {
            Self::MAPPED => Ok(true),
            Self::FAILED => Err(GpuError::DeviceLost),
            _ => Ok(false),
        }
    }

    /// Waits until the GPU is done; whether the bytes are there, which they are if the commands were submitted.
    pub(crate) fn wait(&self, device: &wgpu::Device) -> Result<bool, GpuError> {
        poll_device(device, wgpu::PollType::wait_indefinitely())?;
        // Where another thread polls the same device, the answer may be in its hands for a moment longer.
        for _ in 0..Self::PATIENCE {
            if self.arrived()? {
                return Ok(true);
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(false)
    }

    /// Bytes that are mapped.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// Reads the bytes and gives the buffer back.
    pub(crate) fn read<T>(
        &self,
        buffer: &wgpu::Buffer,
        read: impl FnOnce(&[u8]) -> T,
    ) -> Result<T, GpuError> {
        let view = buffer.get_mapped_range(0..self.size).map_err(|_| GpuError::DeviceLost)?;
        let value = read(&view);
        drop(view);
        buffer.unmap();
        Ok(value)
    }
}

/// A buffer that the GPU copies into and the CPU reads.
pub(crate) fn read_buffer(device: &wgpu::Device, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("vastex readback"),
        size,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Lets the device call back what is due; waits where `poll` says so.
pub(crate) fn poll_device(device: &wgpu::Device, poll: wgpu::PollType) -> Result<(), GpuError> {
    device.poll(poll).map(|_| ()).map_err(|_| GpuError::DeviceLost)
}
