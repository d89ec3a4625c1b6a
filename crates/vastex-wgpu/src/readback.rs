//! The way of feedback back to the CPU: compacted on the GPU (`lists`), or whole where there is no compute (`raw_ring`).
//!
//! Both give the same, in a ring that never makes a frame wait. In real time [`Readback::poll`] takes what has arrived; in
//! lock-step [`Readback::wait`] blocks until one frame's feedback is whole, so that a run is the same each time.

use vastex_core::Feedback;

use crate::device::alive;
use crate::error::GpuError;
use crate::lists::ListRing;
use crate::raw::RawTexture;
use crate::raw_ring::RawRing;
use crate::way::FeedbackWay;

/// Compacts the feedback of one target, frame after frame, and brings it back.
#[derive(Debug)]
pub struct Readback {
    ring: Ring,
}

#[derive(Debug)]
enum Ring {
    Lists(ListRing),
    Raw(RawRing),
}

impl Readback {
    /// A ring for one target; a new target needs a new ring, and what was under way in the old one is given up. The way is one that
    /// the device has.
    pub fn new(device: &wgpu::Device, raw: &RawTexture, way: FeedbackWay) -> Result<Readback, GpuError> {
        alive(device)?;
        let ring = match way {
            FeedbackWay::Separate | FeedbackWay::Inline => Ring::Lists(ListRing::new(device, raw)),
            FeedbackWay::Raw => Ring::Raw(RawRing::new(device, raw)),
        };
        Ok(Readback { ring })
    }

    /// Records what brings the target's pixels back, as they then are. `frame` grows from call to call.
    ///
    /// Returns whether there was room: where the GPU is several frames behind, a frame's feedback is left out rather
    /// than waited for. The commands must be submitted, in the order of frames: what never is holds its place forever.
    pub fn record(&mut self, encoder: &mut wgpu::CommandEncoder, frame: u64) -> bool {
        match &mut self.ring {
            Ring::Lists(ring) => ring.record(encoder, frame),
            Ring::Raw(ring) => ring.record(encoder, frame),
        }
    }

    /// The feedback of the oldest frame under way, if it has arrived whole. Never waits; to be called until it
    /// gives nothing.
    pub fn poll(&mut self, device: &wgpu::Device) -> Result<Option<Feedback>, GpuError> {
        match &mut self.ring {
            Ring::Lists(ring) => ring.poll(device),
            Ring::Raw(ring) => ring.poll(device),
        }
    }

    /// The feedback of one frame, recorded and submitted before. Blocks until it has arrived whole; left-over
    /// entries are fetched by a submission of their own. Not for browsers, where nothing can be waited for.
    pub fn wait(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: u64,
    ) -> Result<Feedback, GpuError> {
        match &mut self.ring {
            Ring::Lists(ring) => ring.wait(device, queue, frame),
            Ring::Raw(ring) => ring.wait(device, frame),
        }
    }

    /// The oldest frame whose feedback is under way or has not been taken.
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
