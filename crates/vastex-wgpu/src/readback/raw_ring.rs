//! The way of feedback back to the CPU without compute: whole targets, compacted when they are there.

use vastex_core::{Feedback, FeedbackCompactor};

use super::RING;
use crate::error::GpuError;
use crate::mapping::{Answer, Mapping, read_buffer};
use crate::raw::RawTexture;

/// Brings a target back, frame after frame. 16 bytes a pixel, in each of [`RING`] buffers.
#[derive(Debug)]
pub(crate) struct RawRing {
    raw: RawTexture,
    ring: Vec<Place>,
    compactor: FeedbackCompactor,
    bytes_read: u64,
    /// The newest frame that was handed out.
    taken: Option<u64>,
    lost: Vec<u64>,
}

/// One place of the ring.
#[derive(Debug)]
struct Place {
    mapped: wgpu::Buffer,
    under_way: Option<(u64, Mapping)>,
}

impl Place {
    fn new(device: &wgpu::Device, raw: &RawTexture) -> Place {
        Place { mapped: read_buffer(device, raw.copy_bytes()), under_way: None }
    }

    fn frame(&self) -> Option<u64> {
        self.under_way.as_ref().map(|(frame, _)| *frame)
    }

    fn has_arrived(&self) -> bool {
        self.under_way.as_ref().is_some_and(|(_, mapping)| mapping.answer() == Ok(Answer::Mapped))
    }
}

impl RawRing {
    pub(crate) fn new(device: &wgpu::Device, raw: &RawTexture) -> RawRing {
        let ring = (0..RING).map(|_| Place::new(device, raw)).collect();
        let (taken, lost) = (None, Vec::new());
        RawRing { raw: raw.clone(), ring, compactor: FeedbackCompactor::new(), bytes_read: 0, taken, lost }
    }

    pub(crate) fn record(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        frame: u64,
    ) -> bool {
        self.release_dropped();
        let Some(place) = self.free_place(device) else {
            tracing::debug!(frame, "no room for feedback; the GPU is behind");
            return false;
        };
        let place = &mut self.ring[place];
        place.under_way = Some((frame, self.raw.copy_to(encoder, &place.mapped)));
        true
    }

    /// A place that is free, or another in the place of one that was overtaken; its commands keep their own.
    fn free_place(&mut self, device: &wgpu::Device) -> Option<usize> {
        if let Some(free) = self.ring.iter().position(|place| place.under_way.is_none()) {
            return Some(free);
        }
        let newest = self.newest();
        let is_overtaken = |place: &Place| !place.has_arrived() && place.frame() < newest;
        let overtaken = self.ring.iter().position(is_overtaken)?;
        self.lost.extend(self.ring[overtaken].frame());
        self.ring[overtaken] = Place::new(device, &self.raw);
        Some(overtaken)
    }

    /// The newest frame that has arrived.
    fn newest(&self) -> Option<u64> {
        let arrived = self.ring.iter().filter(|place| place.has_arrived()).filter_map(Place::frame);
        arrived.max().max(self.taken)
    }

    pub(crate) fn poll(&mut self) -> Result<Option<Feedback>, GpuError> {
        self.release_dropped();
        match self.oldest() {
            Some(frame) => self.take(frame),
            None => Ok(None),
        }
    }

    pub(crate) fn wait(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: u64,
    ) -> Result<Feedback, GpuError> {
        if let Some(place) = self.ring.iter().find(|place| place.frame() == Some(frame))
            && let Some((_, mapping)) = &place.under_way
        {
            mapping.wait(device, queue, &place.mapped)?;
        }
        self.release_dropped();
        self.take(frame)?.ok_or(GpuError::NoFeedback { frame })
    }

    pub(crate) fn is_under_way(&self, frame: u64) -> bool {
        self.ring.iter().any(|place| place.frame() == Some(frame))
    }

    /// The oldest frame under way that no later one has overtaken.
    pub(crate) fn oldest(&self) -> Option<u64> {
        let newest = self.newest();
        let in_order = self.ring.iter().filter(|place| place.has_arrived() || place.frame() > newest);
        in_order.filter_map(Place::frame).min()
    }

    pub(crate) fn take_lost(&mut self) -> Vec<u64> {
        self.release_dropped();
        std::mem::take(&mut self.lost)
    }

    pub(crate) fn bytes_read(&self) -> u64 {
        self.bytes_read
    }

    /// Frees the places whose commands were dropped, and those that were submitted after a later frame was
    /// taken.
    fn release_dropped(&mut self) {
        for place in &mut self.ring {
            let is_late = place.has_arrived() && place.frame() <= self.taken;
            let gone =
                place.under_way.take_if(|(_, mapping)| is_late || mapping.answer() == Ok(Answer::Dropped));
            if is_late {
                place.mapped.unmap();
            }
            self.lost.extend(gone.map(|(frame, _)| frame));
        }
    }

    /// The feedback of a frame, if it has arrived.
    fn take(&mut self, frame: u64) -> Result<Option<Feedback>, GpuError> {
        let Some(place) = self.ring.iter_mut().find(|place| place.frame() == Some(frame)) else {
            return Ok(None);
        };
        let is_there = |(_, mapping): &mut (u64, Mapping)| mapping.answer() != Ok(Answer::None);
        let Some((_, mapping)) = place.under_way.take_if(is_there) else {
            return Ok(None);
        };
        mapping.answer()?;
        let pixels = mapping.read(&place.mapped, |bytes| self.raw.pixels(bytes))?;
        self.bytes_read += mapping.size();
        self.taken = self.taken.max(Some(frame));
        let mut feedback = Feedback::default();
        self.compactor.compact(frame, &pixels, &mut feedback);
        Ok(Some(feedback))
    }
}
