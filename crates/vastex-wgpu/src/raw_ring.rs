//! The way of feedback back to the CPU without compute: whole targets, compacted when they are there.

use vastex_core::{Feedback, FeedbackCompactor};

use crate::error::GpuError;
use crate::mapping::{Mapping, poll_device, read_buffer};
use crate::raw::RawTexture;

/// Frames whose feedback can be under way at once.
const RING: usize = 4;

/// Brings a target back, frame after frame. 16 bytes a pixel, in each of four buffers.
#[derive(Debug)]
pub(crate) struct RawRing {
    raw: RawTexture,
    ring: Vec<Place>,
    compactor: FeedbackCompactor,
    bytes_read: u64,
}

/// One place of the ring.
#[derive(Debug)]
struct Place {
    mapped: wgpu::Buffer,
    under_way: Option<(u64, Mapping)>,
}

impl Place {
    fn frame(&self) -> Option<u64> {
        self.under_way.as_ref().map(|(frame, _)| *frame)
    }
}

impl RawRing {
    pub(crate) fn new(device: &wgpu::Device, raw: &RawTexture) -> RawRing {
        let place = |_| Place { mapped: read_buffer(device, raw.copy_bytes()), under_way: None };
        let ring = (0..RING).map(place).collect();
        RawRing { raw: raw.clone(), ring, compactor: FeedbackCompactor::new(), bytes_read: 0 }
    }

    pub(crate) fn record(&mut self, encoder: &mut wgpu::CommandEncoder, frame: u64) -> bool {
        let Some(place) = self.ring.iter_mut().find(|place| place.under_way.is_none()) else {
            tracing::debug!(frame, "no room for feedback; the GPU is behind");
            return false;
        };
        place.under_way = Some((frame, self.raw.copy_to(encoder, &place.mapped)));
        true
    }

    pub(crate) fn poll(&mut self, device: &wgpu::Device) -> Result<Option<Feedback>, GpuError> {
        poll_device(device, wgpu::PollType::Poll)?;
        match self.oldest() {
            Some(frame) => self.take(frame),
            None => Ok(None),
        }
    }

    pub(crate) fn wait(&mut self, device: &wgpu::Device, frame: u64) -> Result<Feedback, GpuError> {
        let of_frame = self.ring.iter().filter_map(|place| place.under_way.as_ref());
        if let Some((_, mapping)) = of_frame.into_iter().find(|(of, _)| *of == frame) {
            mapping.wait(device)?;
        }
        self.take(frame)?.ok_or(GpuError::NoFeedback { frame })
    }

    pub(crate) fn oldest(&self) -> Option<u64> {
        self.ring.iter().filter_map(Place::frame).min()
    }

    pub(crate) fn bytes_read(&self) -> u64 {
        self.bytes_read
    }

    /// The feedback of a frame, if it has arrived.
    fn take(&mut self, frame: u64) -> Result<Option<Feedback>, GpuError> {
        let Some(place) = self.ring.iter_mut().find(|place| place.frame() == Some(frame)) else {
            return Ok(None);
        };
        let Some((_, mapping)) = place.under_way.take_if(|(_, mapping)| mapping.arrived() != Ok(false))
        else {
            return Ok(None);
        };
        mapping.arrived()?;
        let pixels = mapping.read(&place.mapped, |bytes| self.raw.pixels(bytes))?;
        self.bytes_read += mapping.size();
        let mut feedback = Feedback::default();
        self.compactor.compact(frame, &pixels, &mut feedback);
        Ok(Some(feedback))
    }
}
