//! What is watched and kept for people and tools: telemetry, traces, names, questions about pixels, and what
//! is told of pools.

mod dump;
mod pixels;
mod recorder;
mod stats;
mod telemetry;

use std::collections::BTreeMap;
use std::sync::Arc;

use vastex_core::{CameraPosition, Description, Feedback, History, Pager, PoolId, TextureNumber, Trace};
use vastex_tiles::{Tiers, TileSource};
use vastex_wgpu::PixelReadback;

use crate::error::Error;
pub use dump::{DumpedPool, DumpedTexture, LevelPages, PoolDump};
use pixels::AskedPixels;
pub use pixels::ExplainedPixel;
use recorder::{Places, Recorder};
pub use stats::{FrameStats, PoolStats};
use telemetry::Telemetry;
pub use telemetry::{Cell, PoolRecord};

/// What is watched.
#[derive(Debug)]
pub(crate) struct Watch {
    telemetry: Telemetry,
    /// While a trace is recorded.
    recorder: Option<Recorder>,
    places: Places,
    pixels: AskedPixels,
    names: BTreeMap<TextureNumber, Arc<str>>,
    /// Pixels of the newest feedback whose gradients said nothing.
    degenerate: u32,
}

impl Watch {
    /// Keeps the telemetry of so many frames.
    pub(crate) fn new(telemetry_frames: u64) -> Watch {
        Watch {
            telemetry: Telemetry::new(telemetry_frames),
            recorder: None,
            places: Places::default(),
            pixels: AskedPixels::default(),
            names: BTreeMap::new(),
            degenerate: 0,
        }
    }

    /// Notes the feedback of all views of a frame, before the pager acts on it. `textures` are all there are.
    pub(crate) fn note_feedback<'a>(
        &mut self,
        views: &[Feedback],
        pager: &Pager,
        textures: impl Iterator<Item = (TextureNumber, &'a Arc<Description>)>,
    ) {
        self.degenerate = views.iter().map(|feedback| feedback.degenerate).sum();
        if let Some(recorder) = &mut self.recorder {
            recorder.note(views, &self.places, pager, &textures.collect::<Vec<_>>());
        }
    }

    /// Pixels of the newest feedback whose gradients said nothing.
    pub(crate) fn degenerate_pixels(&self) -> u32 {
        self.degenerate
    }

    pub(crate) fn set_camera_position(&mut self, frame: u64, place: CameraPosition) {
        self.places.note(frame, place);
    }

    pub(crate) fn record_trace(&mut self) {
        self.recorder = Some(Recorder::default());
    }

    pub(crate) fn take_trace(&mut self) -> Result<Option<Trace>, Error> {
        self.recorder.take().map(Recorder::finish).transpose()
    }

    pub(crate) fn telemetry(&self) -> &History<PoolRecord> {
        self.telemetry.history()
    }

    /// Adds a frame that has just been played.
    pub(crate) fn record_telemetry<'a>(
        &mut self,
        frame: u64,
        pager: &Pager,
        sources: impl Iterator<Item = (PoolId, &'a dyn TileSource)>,
    ) {
        self.telemetry.record(frame, pager, sources);
    }

    /// A texture of a pool is removed, whose tiers have done this.
    pub(crate) fn note_gone(&mut self, texture: TextureNumber, pool: PoolId, tiers: Tiers) {
        self.telemetry.note_gone(pool, tiers);
        self.names.remove(&texture);
    }

    pub(crate) fn set_name(&mut self, texture: TextureNumber, name: Arc<str>) {
        self.names.insert(texture, name);
    }

    pub(crate) fn name(&self, texture: TextureNumber) -> Option<&str> {
        self.names.get(&texture).map(|name| &**name)
    }

    /// Asks about a pixel; without a way back it is one that the picture does not have.
    pub(crate) fn ask_pixel(&mut self, pixel: [u32; 2], frame: u64, readback: Option<PixelReadback>) {
        self.pixels.ask(pixel, frame, readback);
    }

    pub(crate) fn poll_explained(&mut self, pager: &Pager) -> Result<Option<ExplainedPixel>, Error> {
        self.pixels.poll(pager)
    }

    pub(crate) fn wait_explained(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        pager: &Pager,
    ) -> Result<Option<ExplainedPixel>, Error> {
        self.pixels.wait(device, queue, pager)
    }

    pub(crate) fn asked_pixels(&self) -> usize {
        self.pixels.len()
    }

    /// The device that would have answered questions is gone.
    pub(crate) fn device_lost(&mut self) {
        self.pixels.clear();
    }
}
