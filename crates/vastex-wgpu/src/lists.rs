//! The way of compacted feedback back to the CPU: a ring of lists.
//!
//! Of a frame's list as many entries are copied as the last known count suggests; what is left over is copied with
//! the next frame.

use vastex_core::{Feedback, PageId, WantedPage, shared};

use crate::compact::{Compactor, HEAD_BYTES, List, WANTED_BYTES};
use crate::error::GpuError;
use crate::mapping::{Mapping, poll_device, read_buffer};
use crate::mirror::{ListHead, Wanted};
use crate::raw::RawTexture;

/// Frames whose feedback can be under way at once.
const RING: usize = 4;
/// Entries that are copied beyond what the last count suggests, for what a move of the camera brings.
const SPARE: u32 = 16;

/// Compacts the feedback of one target, frame after frame, and brings it back.
#[derive(Debug)]
pub(crate) struct ListRing {
    compactor: Compactor,
    ring: Vec<Place>,
    last_count: u32,
    bytes_read: u64,
}

/// One place of the ring.
#[derive(Debug)]
struct Place {
    list: List,
    mapped: wgpu::Buffer,
    state: State,
}

/// How far the feedback of a place is.
#[derive(Debug)]
enum State {
    Free,
    /// A copy of `entries` list entries (and the head, in the first copy) is on its way.
    Copying {
        gathered: Gathered,
        entries: u32,
        mapping: Mapping,
    },
    /// What the last copy left over has still to be copied.
    LeftOver(Gathered),
    Complete(Feedback),
}

/// What is known of a frame's feedback.
#[derive(Debug)]
struct Gathered {
    frame: u64,
    head: Option<ListHead>,
    pages: Vec<WantedPage>,
    entries: u32,
}

impl ListRing {
    pub(crate) fn new(device: &wgpu::Device, raw: &RawTexture) -> ListRing {
        let compactor = Compactor::new(device, raw);
        let place = |_| Place {
            list: compactor.list(device),
            mapped: read_buffer(device, compactor.list_bytes()),
            state: State::Free,
        };
        let ring = (0..RING).map(place).collect();
        ListRing { compactor, ring, last_count: 0, bytes_read: 0 }
    }

    pub(crate) fn record(&mut self, encoder: &mut wgpu::CommandEncoder, frame: u64) -> bool {
        for place in &mut self.ring {
            place.copy_left_over(encoder);
        }
        let suggested = self.last_count.saturating_add(self.last_count / 4).saturating_add(SPARE);
        let entries = suggested.min(self.compactor.capacity());
        let Some(place) = self.ring.iter_mut().find(|place| matches!(place.state, State::Free)) else {
            tracing::debug!(frame, "no room for feedback; the GPU is behind");
            return false;
        };
        self.compactor.record(encoder, &place.list);
        let gathered = Gathered { frame, head: None, pages: Vec::new(), entries: 0 };
        place.copy(encoder, gathered, 0, HEAD_BYTES, entries);
        true
    }

    pub(crate) fn poll(&mut self, device: &wgpu::Device) -> Result<Option<Feedback>, GpuError> {
        poll_device(device, wgpu::PollType::Poll)?;
        self.advance()?;
        let oldest =
            self.ring.iter_mut().filter(|place| place.frame().is_some()).min_by_key(|place| place.frame());
        Ok(oldest.and_then(Place::take))
    }

    pub(crate) fn wait(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: u64,
    ) -> Result<Feedback, GpuError> {
        let missing = GpuError::NoFeedback { frame };
        let Some(index) = self.ring.iter().position(|place| place.frame() == Some(frame)) else {
            return Err(missing);
        };
        loop {
            // The other frames are left alone: what they leave over would go with commands that are not submitted when
            // they in turn are waited for.
            let place = &mut self.ring[index];
            place.wait(device)?;
            if let Some(arrived) = place.advance()? {
                self.bytes_read += arrived.bytes;
                self.last_count = arrived.count;
            }
            if let Some(feedback) = place.take() {
                return Ok(feedback);
            }
            if matches!(place.state, State::Copying { .. }) {
                return Err(missing);
            }
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            place.copy_left_over(&mut encoder);
            queue.submit([encoder.finish()]);
        }
    }

    pub(crate) fn oldest(&self) -> Option<u64> {
        self.ring.iter().filter_map(Place::frame).min()
    }

    pub(crate) fn bytes_read(&self) -> u64 {
        self.bytes_read
    }

    /// Takes in every copy that has arrived.
    fn advance(&mut self) -> Result<(), GpuError> {
        for place in &mut self.ring {
            if let Some(arrived) = place.advance()? {
                self.bytes_read += arrived.bytes;
                self.last_count = arrived.count;
            }
        }
        Ok(())
    }
}

/// What one copy brought.
struct Arrived {
    bytes: u64,
    count: u32,
}

impl Place {
    fn frame(&self) -> Option<u64> {
        match &self.state {
            State::Free => None,
            State::Copying { gathered, .. } | State::LeftOver(gathered) => Some(gathered.frame),
            State::Complete(feedback) => Some(feedback.frame),
        }
    }

    /// Records a copy of `head` bytes and `entries` entries from byte `from` of the list on.
    fn copy(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        gathered: Gathered,
        from: u64,
        head: u64,
        entries: u32,
    ) {
        let size = head + u64::from(entries) * WANTED_BYTES;
        encoder.copy_buffer_to_buffer(&self.list.buffer, from, &self.mapped, 0, size);
        let mapping = Mapping::on_submit(encoder, &self.mapped, size);
        self.state = State::Copying { gathered, entries, mapping };
    }

    fn copy_left_over(&mut self, encoder: &mut wgpu::CommandEncoder) {
        self.state = match std::mem::replace(&mut self.state, State::Free) {
            State::LeftOver(gathered) => {
                let rest = gathered.count() - gathered.entries;
                let from = HEAD_BYTES + u64::from(gathered.entries) * WANTED_BYTES;
                return self.copy(encoder, gathered, from, 0, rest);
            }
            other => other,
        };
    }

    fn take(&mut self) -> Option<Feedback> {
        match std::mem::replace(&mut self.state, State::Free) {
            State::Complete(feedback) => Some(feedback),
            other => {
                self.state = other;
                None
            }
        }
    }

    /// Waits for the copy under way, if there is one.
    fn wait(&self, device: &wgpu::Device) -> Result<(), GpuError> {
        match &self.state {
            State::Copying { mapping, .. } => mapping.wait(device).map(|_| ()),
            _ => Ok(()),
        }
    }

    /// Takes in the copy under way, if it has arrived.
    fn advance(&mut self) -> Result<Option<Arrived>, GpuError> {
        let State::Copying { mapping, .. } = &self.state else { return Ok(None) };
        if !mapping.arrived()? {
            return Ok(None);
        }
        let State::Copying { mut gathered, entries, mapping } =
            std::mem::replace(&mut self.state, State::Free)
        else {
            return Ok(None);
        };
        mapping.read(&self.mapped, |bytes| gathered.add(bytes, entries))?;
        let arrived = Arrived { bytes: mapping.size(), count: gathered.count() };
        let whole = gathered.entries == gathered.count();
        self.state =
            if whole { State::Complete(gathered.into_feedback()) } else { State::LeftOver(gathered) };
        Ok(Some(arrived))
    }
}

impl Gathered {
    fn count(&self) -> u32 {
        self.head.map_or(0, |head| head.pages)
    }

    /// Adds a copy: the head if it is the first, and up to `entries` entries.
    fn add(&mut self, mut bytes: &[u8], entries: u32) {
        if self.head.is_none() {
            let (head, rest) = bytes.split_at(HEAD_BYTES as usize);
            self.head = Some(bytemuck::pod_read_unaligned(head));
            bytes = rest;
        }
        let fresh = entries.min(self.count() - self.entries);
        self.entries += fresh;
        let wanted = bytes.chunks_exact(WANTED_BYTES as usize).take(fresh as usize);
        self.pages.extend(wanted.filter_map(|bytes| page_from_wanted(bytemuck::pod_read_unaligned(bytes))));
    }

    fn into_feedback(mut self) -> Feedback {
        self.pages.sort_unstable();
        let degenerate = self.head.map_or(0, |head| head.degenerate);
        Feedback { frame: self.frame, pages: self.pages, degenerate, ..Feedback::default() }
    }
}

/// An entry of the list, or nothing where a shader wrote what is no page.
fn page_from_wanted(wanted: Wanted) -> Option<WantedPage> {
    let page = PageId::from_bits(u64::from(wanted.page_high) << 32 | u64::from(wanted.page_low))?;
    let eighth = (wanted.pixels_and_eighth & (shared::STEPS_PER_LEVEL - 1)) as u8;
    Some(WantedPage { page, pixels: wanted.pixels_and_eighth >> shared::STEP_BITS, eighth })
}
