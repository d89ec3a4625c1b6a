//! From the GPU to the CPU: buffers that are mapped once the commands before are done.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

use crate::device::{poll_device, refused};
use crate::error::GpuError;

/// A buffer on its way to being readable.
#[derive(Debug)]
pub(crate) struct Mapping {
    answer: Arc<AtomicU8>,
    size: u64,
}

/// What has become of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// Nothing yet: the commands are not submitted, or not done.
    None,
    /// The bytes are there.
    Mapped,
    /// The commands were dropped, and can be submitted no more.
    Dropped,
}

/// What the encoder keeps until its commands are done. It is dropped with the encoder where they never are.
struct Reporter(Arc<AtomicU8>);

impl Reporter {
    fn report(self, is_mapped: bool) {
        self.0.store(if is_mapped { Mapping::MAPPED } else { Mapping::FAILED }, Ordering::Release);
    }
}

impl Drop for Reporter {
    fn drop(&mut self) {
        // One that has reported something keeps to it.
        let _ =
            self.0.compare_exchange(Mapping::NONE, Mapping::DROPPED, Ordering::Release, Ordering::Relaxed);
    }
}

impl Mapping {
    const NONE: u8 = 0;
    const MAPPED: u8 = 1;
    const FAILED: u8 = 2;
    const DROPPED: u8 = 3;
    /// Milliseconds that an answer may be in the hands of another thread.
    const PATIENCE: u32 = 1000;

    /// Maps the first `size` bytes once the encoder's commands are submitted and done.
    pub(crate) fn on_submit(encoder: &wgpu::CommandEncoder, buffer: &wgpu::Buffer, size: u64) -> Mapping {
        let answer = Arc::new(AtomicU8::new(Self::NONE));
        let reporter = Reporter(Arc::clone(&answer));
        encoder.map_buffer_on_submit(buffer, wgpu::MapMode::Read, 0..size, move |result| {
            reporter.report(result.is_ok());
        });
        Mapping { answer, size }
    }

    /// What has become of it. A buffer used as here fails to be mapped only when its device is lost.
    pub(crate) fn answer(&self) -> Result<Answer, GpuError> {
        match self.answer.load(Ordering::Acquire) {
            Self::MAPPED => Ok(Answer::Mapped),
            Self::FAILED => Err(GpuError::DeviceLost),
            Self::DROPPED => Ok(Answer::Dropped),
            _ => Ok(Answer::None),
        }
    }

    /// Waits until the GPU is done, if the commands were submitted, and says what has become of it.
    pub(crate) fn wait(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        buffer: &wgpu::Buffer,
    ) -> Result<Answer, GpuError> {
        if self.answer()? == Answer::None {
            poll_device(device, wgpu::PollType::wait_indefinitely())?;
        }
        if self.answer()? == Answer::None && !is_submitted(device, queue, buffer) {
            return Ok(Answer::None);
        }
        // Where another thread polls the same device, the answer may be in its hands for a moment longer.
        for _ in 0..Self::PATIENCE {
            if self.answer()? != Answer::None {
                break;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        self.answer()
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

/// Returns true if commands that map this buffer were submitted: from then on no other commands may use it.
/// Where they were not, it is cleared.
fn is_submitted(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &wgpu::Buffer) -> bool {
    refused(device, || {
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.clear_buffer(buffer, 0, Some(wgpu::COPY_BUFFER_ALIGNMENT));
        queue.submit([encoder.finish()]);
    })
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
