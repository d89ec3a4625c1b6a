//! The way back of feedback to the CPU: compacted on the GPU (`lists`), or whole where there is no compute
//! (`raw_ring`).
//!
//! Both give the same, in a ring that never makes a frame wait. In real time [`Readback::poll`] takes what
//! has arrived; in lock-step [`Readback::wait`] blocks until one frame's feedback is whole, so that a run is
//! the same each time.

mod lists;
mod raw_ring;

use vastex_core::Feedback;

use self::lists::ListRing;
use self::raw_ring::RawRing;
use crate::compact::{CompactionPipelines, Compactor};
use crate::device::alive;
use crate::error::GpuError;
use crate::feedback_mode::FeedbackMode;
use crate::raw::RawTexture;

/// Frames whose feedback can be under way at once: what a GPU is behind by, and what an application records
/// ahead.
const RING: usize = 6;

/// Compacts the feedback of one target, frame after frame, and reads it back.
#[derive(Debug)]
pub struct Readback {
    ring: Ring,
}

#[derive(Debug)]
enum Ring {
    Lists(ListRing),
    Raw(RawRing),
}

/// Pipelines that read feedback back on a device; one for all targets. Compiles a shader if the mode has one.
#[derive(Clone, Debug)]
pub struct ReadbackPipelines(Option<CompactionPipelines>);

impl ReadbackPipelines {
    /// For a mode that the device has.
    pub fn new(device: &wgpu::Device, mode: FeedbackMode) -> ReadbackPipelines {
        ReadbackPipelines((mode != FeedbackMode::Raw).then(|| CompactionPipelines::new(device)))
    }
}

impl Readback {
    /// A ring of buffers for one target; a new target needs a new ring, and feedback still on its way in the
    /// old one is dropped.
    pub fn new(
        device: &wgpu::Device,
        pipelines: &ReadbackPipelines,
        raw: &RawTexture,
    ) -> Result<Readback, GpuError> {
        alive(device)?;
        let ring = match &pipelines.0 {
            Some(pipelines) => {
                Compactor::check(&device.limits(), raw.size())?;
                Ring::Lists(ListRing::new(device, pipelines, raw))
            }
            None => Ring::Raw(RawRing::new(device, raw)),
        };
        Ok(Readback { ring })
    }

    /// Records the commands that read back the target's pixels, as they then are. `frame` grows from call to
    /// call.
    ///
    /// Returns true if there was room: while the GPU is several frames behind, a frame's feedback is left out
    /// rather than waited for. If the commands are dropped instead of submitted, the frame's feedback is lost
    /// ([`Readback::take_lost`]), and so it is if they are submitted after those of a later frame have been
    /// read back.
    pub fn record(&mut self, device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder, frame: u64) -> bool {
        match &mut self.ring {
            Ring::Lists(ring) => ring.record(device, encoder, frame),
            Ring::Raw(ring) => ring.record(device, encoder, frame),
        }
    }

    /// The feedback of the oldest frame under way, if it has arrived whole. Never waits; to be called until
    /// it gives nothing. What has arrived shows when the device is [polled](crate::poll).
    pub fn poll(&mut self) -> Result<Option<Feedback>, GpuError> {
        match &mut self.ring {
            Ring::Lists(ring) => ring.poll(),
            Ring::Raw(ring) => ring.poll(),
        }
    }

    /// The feedback of one frame, recorded and submitted before. Blocks until it has arrived whole; left-over
    /// entries are fetched by a submission of their own. Fails with [`GpuError::NoFeedback`] if its commands
    /// were not submitted. Not for browsers, where nothing can be waited for.
    pub fn wait(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: u64,
    ) -> Result<Feedback, GpuError> {
        match &mut self.ring {
            Ring::Lists(ring) => ring.wait(device, queue, frame),
            Ring::Raw(ring) => ring.wait(device, queue, frame),
        }
    }

    /// Returns true if feedback of a frame may still come.
    pub fn is_under_way(&self, frame: u64) -> bool {
        match &self.ring {
            Ring::Lists(ring) => ring.is_under_way(frame),
            Ring::Raw(ring) => ring.is_under_way(frame),
        }
    }

    /// The frames whose feedback was lost since the last call, in any order: of each the place in the ring is
    /// free again.
    pub fn take_lost(&mut self) -> Vec<u64> {
        match &mut self.ring {
            Ring::Lists(ring) => ring.take_lost(),
            Ring::Raw(ring) => ring.take_lost(),
        }
    }

    /// The oldest frame whose feedback is to come or has not been taken.
    pub fn oldest(&self) -> Option<u64> {
        match &self.ring {
            Ring::Lists(ring) => ring.oldest(),
            Ring::Raw(ring) => ring.oldest(),
        }
    }

    /// Bytes brought back since the ring was made.
    pub fn bytes_read(&self) -> u64 {
        match &self.ring {
            Ring::Lists(ring) => ring.bytes_read(),
            Ring::Raw(ring) => ring.bytes_read(),
        }
    }
}
