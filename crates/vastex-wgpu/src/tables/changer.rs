//! The compute shader that changes page tables in storage buffers, and the buffers that it changes.

use vastex_core::shader_constants;

use super::RECORDED_AHEAD;
use crate::device::{alive, compute_pipelines, dispatch_size, guarded, storage, whole_buffer};
use crate::error::GpuError;
use crate::feedback_mode::FeedbackMode;
use crate::shader;

/// Bytes of a buffer for changes at least.
const LEAST_ROOM: u64 = 4096;

/// Carries out changes of page tables; one for all pools of a device. Cheap to keep, costly to make: it
/// compiles a shader.
#[derive(Debug)]
pub struct PoolTableChanger {
    /// For tables in buffers.
    pub(super) pipelines: Option<Pipelines>,
}

#[derive(Debug)]
pub(super) struct Pipelines {
    layout: wgpu::BindGroupLayout,
    pub(super) fill: wgpu::ComputePipeline,
    pub(super) evict: wgpu::ComputePipeline,
    pub(super) load: wgpu::ComputePipeline,
    pub(super) write: wgpu::ComputePipeline,
}

impl PoolTableChanger {
    /// Compiles the shader, where the feedback mode has one.
    pub fn new(device: &wgpu::Device, mode: FeedbackMode) -> PoolTableChanger {
        PoolTableChanger { pipelines: (mode != FeedbackMode::Raw).then(|| Pipelines::new(device)) }
    }
}

impl Pipelines {
    fn new(device: &wgpu::Device) -> Pipelines {
        let bindings = [
            whole_buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            whole_buffer(wgpu::BufferBindingType::Storage { read_only: true }),
        ];
        let text = shader::pool_tables_wgsl();
        let steps = ["fill", "evict", "load", "write"];
        let (layout, [fill, evict, load, write]) =
            compute_pipelines(device, "vastex page tables", text, &bindings, steps);
        Pipelines { layout, fill, evict, load, write }
    }
}

/// A table in a storage buffer.
#[derive(Debug)]
pub(super) struct TableBuffer {
    pub(super) buffer: wgpu::Buffer,
    /// Sees the changes of that capacity's [`Room`].
    bind_group: Option<(u64, wgpu::BindGroup)>,
}

impl TableBuffer {
    pub(super) fn new(device: &wgpu::Device, words: u64) -> Result<TableBuffer, GpuError> {
        alive(device)?;
        let buffer = guarded(device, words * 4, || storage(device, "vastex page tables", words * 4))?;
        Ok(TableBuffer { buffer, bind_group: None })
    }
}

/// Where the changes of a frame are sent to; made anew, twice as large, where it is too small. One submission
/// may use it once.
#[derive(Debug, Default)]
pub(super) struct Room(Option<wgpu::Buffer>);

impl Room {
    /// Sends a batch, for the submission that comes next.
    pub(super) fn send(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        words: &[u32],
    ) -> Result<u64, GpuError> {
        let bytes: &[u8] = bytemuck::cast_slice(words);
        let sent = bytes.len() as u64;
        alive(device)?;
        if self.0.as_ref().map_or(0, wgpu::Buffer::size) < sent {
            let size = sent.next_power_of_two().max(LEAST_ROOM);
            self.0 = Some(guarded(device, size, || storage(device, "vastex table changes", size))?);
        }
        if let Some(buffer) = &self.0 {
            queue.write_buffer(buffer, 0, bytes);
        }
        Ok(sent)
    }

    /// Runs over the batch that was sent, in steps of so many workgroups each.
    pub(super) fn carry_out(
        &self,
        pipelines: &Pipelines,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        table: &mut TableBuffer,
        steps: &[(&wgpu::ComputePipeline, u32)],
    ) {
        let Some(room) = &self.0 else { return };
        table.bind_group.take_if(|(size, _)| *size != room.size());
        let (_, bind_group) = table.bind_group.get_or_insert_with(|| {
            let entries = [
                wgpu::BindGroupEntry { binding: 0, resource: table.buffer.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: room.as_entire_binding() },
            ];
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("vastex table changes"),
                layout: &pipelines.layout,
                entries: &entries,
            });
            (room.size(), group)
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("vastex table changes"),
            timestamp_writes: None,
        });
        pass.set_bind_group(0, &*bind_group, &[]);
        for (pipeline, chunks) in steps.iter().filter(|(_, chunks)| *chunks > 0) {
            let [x, y] = dispatch_size(*chunks);
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(x, y, 1);
        }
    }
}

/// Memory in which tables lay before they moved, which takes the same changes for some updates more.
#[derive(Debug)]
pub(crate) struct Before<T> {
    pub(crate) memory: T,
    updates_left: u8,
}

impl<T> Before<T> {
    pub(crate) fn new(memory: T) -> Before<T> {
        Before { memory, updates_left: RECORDED_AHEAD }
    }

    /// An update was submitted.
    pub(crate) fn count(all: &mut Vec<Before<T>>) {
        all.iter_mut().for_each(|before| before.updates_left -= 1);
        all.retain(|before| before.updates_left > 0);
    }
}

/// Workgroups for one invocation each of so many.
pub(super) fn chunks(count: usize) -> u32 {
    (count as u32).div_ceil(shader_constants::WORKGROUP)
}
