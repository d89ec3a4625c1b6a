//! How long the GPU takes for what an encoder holds.

use std::time::{Duration, Instant};

use vastex_viewer::Gpu;

/// Tells time by what tells most of the work: the processor time of this process where the adapter is the
/// processor, which a busy machine disturbs less; the GPU's timestamps; or, where there is neither, the wall
/// from submitting to having waited.
#[derive(Debug)]
pub struct GpuClock {
    hand: Hand,
}

#[derive(Debug)]
enum Hand {
    Processor,
    Timestamps(Timestamps),
    Wall,
}

#[derive(Debug)]
struct Timestamps {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    read: wgpu::Buffer,
    nanoseconds: f32,
}

impl GpuClock {
    /// What a device must be made with, of what the adapter has, for timestamps.
    pub fn features(adapter: &wgpu::Adapter) -> wgpu::Features {
        let wanted = wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        if adapter.features().contains(wanted) { wanted } else { wgpu::Features::empty() }
    }

    /// The best of those that the device has.
    pub fn new(gpu: &Gpu) -> GpuClock {
        let features = GpuClock::features(&gpu.adapter);
        let hand = if gpu.is_processor() && processor_time().is_some() {
            Hand::Processor
        } else if !features.is_empty() && gpu.device.features().contains(features) {
            Hand::Timestamps(Timestamps::new(gpu))
        } else {
            Hand::Wall
        };
        GpuClock { hand }
    }

    /// What it tells time by, for people.
    pub fn told_by(&self) -> &'static str {
        match self.hand {
            Hand::Processor => "the processor time of the process",
            Hand::Timestamps(_) => "the GPU's timestamps",
            Hand::Wall => "the wall, from submitting to having waited",
        }
    }

    /// How long each of these takes, `rounds` times, one after another in each round: `[what][round]`. One
    /// round before them is not counted. Waits.
    pub fn in_turns(
        &self,
        gpu: &Gpu,
        recorded: &[&dyn Fn(&mut wgpu::CommandEncoder)],
        rounds: usize,
    ) -> Vec<Vec<Duration>> {
        let mut taken = vec![Vec::with_capacity(rounds); recorded.len()];
        for round in 0..=rounds {
            for (record, taken) in recorded.iter().zip(&mut taken) {
                let time = self.time(gpu, record);
                if round > 0 {
                    taken.push(time);
                }
            }
        }
        taken
    }

    /// How long the GPU takes for what is recorded. Waits.
    pub fn time(&self, gpu: &Gpu, mut record: impl FnMut(&mut wgpu::CommandEncoder)) -> Duration {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        match &self.hand {
            Hand::Timestamps(timestamps) => {
                encoder.write_timestamp(&timestamps.queries, 0);
                record(&mut encoder);
                encoder.write_timestamp(&timestamps.queries, 1);
                encoder.resolve_query_set(&timestamps.queries, 0..2, &timestamps.resolved, 0);
                encoder.copy_buffer_to_buffer(
                    &timestamps.resolved,
                    0,
                    &timestamps.read,
                    0,
                    Timestamps::BYTES,
                );
                gpu.queue.submit([encoder.finish()]);
                timestamps.difference(gpu)
            }
            Hand::Processor | Hand::Wall => {
                record(&mut encoder);
                let encoder = encoder.finish();
                let start = (Instant::now(), processor_time());
                gpu.queue.submit([encoder]);
                wait(gpu);
                match (&self.hand, start.1.zip(processor_time())) {
                    (Hand::Processor, Some((before, after))) => after.saturating_sub(before),
                    _ => start.0.elapsed(),
                }
            }
        }
    }
}

/// What this process has had of the processors, where the system says so.
#[cfg(target_os = "linux")]
fn processor_time() -> Option<Duration> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(Duration::new(u64::try_from(time.tv_sec).ok()?, u32::try_from(time.tv_nsec).ok()?))
}

/// What this process has had of the processors, where the system says so.
#[cfg(not(target_os = "linux"))]
fn processor_time() -> Option<Duration> {
    None
}

impl Timestamps {
    const BYTES: u64 = 2 * wgpu::QUERY_SIZE as u64;

    fn new(gpu: &Gpu) -> Timestamps {
        let buffer = |usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: Timestamps::BYTES,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        Timestamps {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            read: buffer(wgpu::BufferUsages::MAP_READ),
            nanoseconds: gpu.queue.get_timestamp_period(),
        }
    }

    /// Between the two timestamps that were read; nothing from a device that is lost.
    fn difference(&self, gpu: &Gpu) -> Duration {
        self.read.map_async(wgpu::MapMode::Read, .., |_| {});
        wait(gpu);
        let ticks = match self.read.get_mapped_range(..) {
            Ok(bytes) => bytemuck::pod_collect_to_vec::<u8, u64>(&bytes),
            Err(_) => vec![0; 2],
        };
        self.read.unmap();
        Duration::from_secs_f64(ticks[1].saturating_sub(ticks[0]) as f64 * f64::from(self.nanoseconds) * 1e-9)
    }
}

fn wait(gpu: &Gpu) {
    if gpu.device.poll(wgpu::PollType::wait_indefinitely()).is_err() {
        tracing::error!("the device does not answer");
    }
}
