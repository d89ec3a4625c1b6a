//! How long the GPU takes for the parts of a frame, by its own clock: told some frames later, and never
//! waited for.

use wgpu_profiler::{GpuProfiler, GpuProfilerQuery, GpuProfilerSettings, GpuTimerQueryResult};

use super::frame::PartTime;
use crate::gpu::Gpu;

/// Measures the parts of frames on one device. On a device without timestamps it measures nothing, and costs
/// nothing.
pub struct GpuTimer {
    /// `None` if the device has no timestamps between passes.
    profiler: Option<GpuProfiler>,
    /// The part whose end is still to come.
    open: Option<GpuProfilerQuery>,
    period: f32,
    /// Of the newest frame whose times have come.
    times: Vec<PartTime>,
}

impl GpuTimer {
    /// Measures nothing yet.
    pub fn new(gpu: &Gpu) -> GpuTimer {
        let needed = wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        let settings = GpuProfilerSettings {
            enable_timer_queries: true,
            enable_debug_groups: false,
            max_num_pending_frames: 4,
        };
        let profiler = gpu
            .device
            .features()
            .contains(needed)
            .then(|| GpuProfiler::new(&gpu.device, settings).ok())
            .flatten();
        GpuTimer { profiler, open: None, period: gpu.queue.get_timestamp_period(), times: Vec::new() }
    }

    /// Returns true if the device tells times at all.
    pub fn is_able(&self) -> bool {
        self.profiler.is_some()
    }

    /// To be called in front of the commands of a part, and with nothing behind the last of them. Parts of
    /// the same name in one frame count together.
    pub fn mark(&mut self, encoder: &mut wgpu::CommandEncoder, part: Option<&str>) {
        let Some(profiler) = &self.profiler else { return };
        if let Some(open) = self.open.take() {
            profiler.end_query(encoder, open);
        }
        self.open = part.map(|part| profiler.begin_query(part, encoder));
    }

    /// At the end of a frame's commands, in the encoder that is submitted last: brings the times of the frame
    /// back.
    pub fn resolve(&mut self, encoder: &mut wgpu::CommandEncoder) {
        self.mark(encoder, None);
        if let Some(profiler) = &mut self.profiler {
            profiler.resolve_queries(encoder);
        }
    }

    /// After the frame was submitted: takes in what has come of earlier ones. Returns true if any has.
    pub fn end_frame(&mut self) -> bool {
        let Some(profiler) = &mut self.profiler else { return false };
        // A part that was left open counts in no frame.
        drop(profiler.end_frame());
        let mut has_come = false;
        while let Some(results) = profiler.process_finished_frame(self.period) {
            self.times = joined(&results);
            has_come = true;
        }
        has_come
    }

    /// The parts of the newest frame whose times have come, in their order.
    pub fn times(&self) -> &[PartTime] {
        &self.times
    }
}

/// The times of a frame's parts.
fn joined(results: &[GpuTimerQueryResult]) -> Vec<PartTime> {
    let mut times: Vec<PartTime> = Vec::new();
    for result in results {
        let Some(time) = &result.time else { continue };
        // A driver that counts coarsely may tell the end before the start.
        let ms = ((time.end - time.start) * 1000.0).max(0.0) as f32;
        match times.iter_mut().find(|known| known.part == result.label) {
            Some(known) => known.ms += ms,
            None => times.push(PartTime { part: result.label.clone(), ms }),
        }
    }
    times
}
