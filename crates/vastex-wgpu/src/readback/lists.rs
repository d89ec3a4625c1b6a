//! The way of compacted feedback, lists of wanted pages, back to the CPU: a ring of buffers.
//!
//! Of a frame's list at least [`LEAST_ENTRIES`] are copied, and more where the last known count suggests it;
//! what is left over is copied with the next frame. A place whose commands were dropped is free again at
//! once. One whose commands are kept, while those of later frames are done, is overtaken: nothing waits for
//! it, and where its room is needed it is given up.

use vastex_core::{Feedback, PageId, WantedPage, shader_constants};

use super::RING;
use crate::compact::{CompactionPipelines, Compactor, HEAD_BYTES, List, WANTED_BYTES};
use crate::error::GpuError;
use crate::mapping::{Answer, Mapping, read_buffer};
use crate::mirror::{ListHead, Wanted};
use crate::raw::RawTexture;

/// Entries that are copied at least, 48 KiB of them, where the target has as many pixels: after a cut of the
/// camera the last count says nothing, and a second copy comes a whole way later.
pub(crate) const LEAST_ENTRIES: u32 = 4096;
/// Entries that are copied beyond what the last count suggests, for what a move of the camera brings.
const SPARE: u32 = 16;

/// Compacts the feedback of one target, frame after frame, and brings it back.
#[derive(Debug)]
pub(crate) struct ListRing {
    compactor: Compactor,
    ring: Vec<Place>,
    last_count: u32,
    bytes_read: u64,
    /// The newest frame of which something has arrived.
    newest: Option<u64>,
    /// The newest frame that was handed out.
    taken: Option<u64>,
    lost: Vec<u64>,
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
    pub(crate) fn new(device: &wgpu::Device, pipelines: &CompactionPipelines, raw: &RawTexture) -> ListRing {
        let compactor = Compactor::new(device, pipelines, raw);
        let ring = (0..RING).map(|_| Place::new(device, &compactor)).collect();
        let (newest, taken, lost) = (None, None, Vec::new());
        ListRing { compactor, ring, last_count: 0, bytes_read: 0, newest, taken, lost }
    }

    pub(crate) fn record(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        frame: u64,
    ) -> bool {
        self.release_dropped();
        for place in &mut self.ring {
            place.copy_left_over(encoder);
        }
        let suggested = self.last_count.saturating_add(self.last_count / 4).saturating_add(SPARE);
        let entries = suggested.max(LEAST_ENTRIES).min(self.compactor.capacity());
        let Some(place) = self.free_place(device) else {
            tracing::debug!(frame, "no room for feedback; the GPU is behind");
            return false;
        };
        let place = &mut self.ring[place];
        self.compactor.record(encoder, &place.list);
        let gathered = Gathered { frame, head: None, pages: Vec::new(), entries: 0 };
        place.copy(encoder, gathered, 0, HEAD_BYTES, entries);
        true
    }

    /// A place that is free, or another in the place of one that was overtaken; its commands keep their own.
    fn free_place(&mut self, device: &wgpu::Device) -> Option<usize> {
        let is_free = |place: &Place| matches!(place.state, State::Free);
        if let Some(free) = self.ring.iter().position(is_free) {
            return Some(free);
        }
        let overtaken = self.ring.iter().position(|place| place.is_overtaken_by(self.newest))?;
        self.lost.extend(self.ring[overtaken].frame());
        self.ring[overtaken] = Place::new(device, &self.compactor);
        Some(overtaken)
    }

    pub(crate) fn poll(&mut self) -> Result<Option<Feedback>, GpuError> {
        for place in 0..self.ring.len() {
            self.advance(place)?;
        }
        let newest = self.newest;
        let in_order =
            self.ring.iter_mut().filter(|place| place.frame().is_some() && !place.is_overtaken_by(newest));
        let feedback = in_order.min_by_key(|place| place.frame()).and_then(Place::take);
        self.taken = self.taken.max(feedback.as_ref().map(|feedback| feedback.frame));
        Ok(feedback)
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
            // The other frames are left alone: what they leave over would go with commands that are not
            // submitted when they in turn are waited for.
            self.ring[index].wait(device, queue)?;
            self.advance(index)?;
            let place = &mut self.ring[index];
            if let Some(feedback) = place.take() {
                self.taken = self.taken.max(Some(frame));
                return Ok(feedback);
            }
            if !matches!(place.state, State::LeftOver(_)) {
                return Err(missing);
            }
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            place.copy_left_over(&mut encoder);
            queue.submit([encoder.finish()]);
        }
    }

    pub(crate) fn is_under_way(&self, frame: u64) -> bool {
        self.ring.iter().any(|place| place.frame() == Some(frame))
    }

    pub(crate) fn oldest(&self) -> Option<u64> {
        let in_order = self.ring.iter().filter(|place| !place.is_overtaken_by(self.newest));
        in_order.filter_map(Place::frame).min()
    }

    pub(crate) fn take_lost(&mut self) -> Vec<u64> {
        self.release_dropped();
        std::mem::take(&mut self.lost)
    }

    pub(crate) fn bytes_read(&self) -> u64 {
        self.bytes_read
    }

    /// Takes in the copy of a place, if it has arrived.
    fn advance(&mut self, place: usize) -> Result<(), GpuError> {
        self.lost.extend(self.ring[place].release_if_dropped());
        let place = &mut self.ring[place];
        let Some(arrived) = place.advance()? else { return Ok(()) };
        self.bytes_read += arrived.bytes;
        self.last_count = arrived.count;
        self.newest = self.newest.max(place.frame());
        // What is submitted after a later frame was taken in says nothing new.
        if place.frame() <= self.taken {
            self.lost.extend(place.frame());
            place.state = State::Free;
        }
        Ok(())
    }

    fn release_dropped(&mut self) {
        self.lost.extend(self.ring.iter_mut().filter_map(Place::release_if_dropped));
    }
}

/// What one copy brought.
struct Arrived {
    bytes: u64,
    count: u32,
}

impl Place {
    fn new(device: &wgpu::Device, compactor: &Compactor) -> Place {
        let mapped = read_buffer(device, compactor.list_bytes());
        Place { list: compactor.list(device), mapped, state: State::Free }
    }

    /// Returns true if nothing of its frame is there while something of a later one is.
    fn is_overtaken_by(&self, newest: Option<u64>) -> bool {
        match &self.state {
            State::Copying { gathered, .. } => gathered.head.is_none() && Some(gathered.frame) < newest,
            _ => false,
        }
    }

    /// Where the commands of its copy were dropped: gives its frame up, or copies again what is left over.
    /// Gives the frame that was given up.
    fn release_if_dropped(&mut self) -> Option<u64> {
        let State::Copying { mapping, .. } = &self.state else { return None };
        if mapping.answer() != Ok(Answer::Dropped) {
            return None;
        }
        let State::Copying { gathered, .. } = std::mem::replace(&mut self.state, State::Free) else {
            return None;
        };
        match gathered.head {
            None => Some(gathered.frame),
            Some(_) => {
                self.state = State::LeftOver(gathered);
                None
            }
        }
    }

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
    fn wait(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<(), GpuError> {
        match &self.state {
            State::Copying { mapping, .. } => mapping.wait(device, queue, &self.mapped).map(|_| ()),
            _ => Ok(()),
        }
    }

    /// Takes in the copy under way, if it has arrived.
    fn advance(&mut self) -> Result<Option<Arrived>, GpuError> {
        let State::Copying { mapping, .. } = &self.state else { return Ok(None) };
        if mapping.answer()? != Answer::Mapped {
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

/// An entry of the list, or `None` if a shader wrote what is no page.
fn page_from_wanted(wanted: Wanted) -> Option<WantedPage> {
    let page = PageId::from_bits(u64::from(wanted.page_high) << 32 | u64::from(wanted.page_low))?;
    let eighth = (wanted.pixels_and_eighth & (shader_constants::STEPS_PER_LEVEL - 1)) as u8;
    Some(WantedPage { page, pixels: wanted.pixels_and_eighth >> shader_constants::STEP_BITS, eighth })
}
