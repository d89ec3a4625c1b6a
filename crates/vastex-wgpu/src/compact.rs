//! Compaction of a feedback target on the GPU, to distinct pages with their pixel counts and sharpest
//! eighths.
//!
//! The same on the CPU is [`vastex_core::FeedbackCompactor`].

use vastex_core::shader_constants;

use crate::device::{compute_pipelines, dispatch_size, storage, whole_buffer};
use crate::error::GpuError;
use crate::mirror::{HASH_BUCKET_BYTES, ListHead, Wanted};
use crate::raw::RawTexture;
use crate::shader;

/// Bytes before the wanted pages of a list.
pub(crate) const HEAD_BYTES: u64 = size_of::<ListHead>() as u64;
/// Bytes of one wanted page.
pub(crate) const WANTED_BYTES: u64 = size_of::<Wanted>() as u64;

/// How feedback is compacted on a device, whatever the target.
#[derive(Clone, Debug)]
pub(crate) struct CompactionPipelines {
    layout: wgpu::BindGroupLayout,
    count: wgpu::ComputePipeline,
    append: wgpu::ComputePipeline,
}

impl CompactionPipelines {
    pub(crate) fn new(device: &wgpu::Device) -> CompactionPipelines {
        let bindings = [
            wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Uint,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            whole_buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            whole_buffer(wgpu::BufferBindingType::Storage { read_only: false }),
        ];
        let text = shader::compact_wgsl();
        let (layout, [count, append]) =
            compute_pipelines(device, "vastex compaction", text, &bindings, ["count", "append"]);
        CompactionPipelines { layout, count, append }
    }
}

/// Compacts one feedback target into lists of its own size.
#[derive(Debug)]
pub(crate) struct Compactor {
    pipelines: CompactionPipelines,
    raw: wgpu::TextureView,
    /// All zeros whenever a compaction begins: a new buffer is, and each compaction leaves it so.
    buckets: wgpu::Buffer,
    bucket_count: u32,
    pixels: u32,
}

/// A list on the GPU, with room for as many pages as the target has pixels.
#[derive(Debug)]
pub(crate) struct List {
    pub(crate) buffer: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
}

impl Compactor {
    /// Fails where a target has more pixels than its pages could be counted of on a device.
    pub(crate) fn check(limits: &wgpu::Limits, [width, height]: [u32; 2]) -> Result<(), GpuError> {
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let buckets = (2 * u64::from(width))
            .saturating_mul(u64::from(height))
            .checked_next_power_of_two()
            .unwrap_or(u64::MAX);
        let max = most / HASH_BUCKET_BYTES / 4;
        match buckets <= most / HASH_BUCKET_BYTES && buckets <= u64::from(u32::MAX) {
            true => Ok(()),
            false => Err(GpuError::TargetSize { width, height, max: max.isqrt() as u32 }),
        }
    }

    pub(crate) fn new(device: &wgpu::Device, pipelines: &CompactionPipelines, raw: &RawTexture) -> Compactor {
        let pixels = raw.size()[0] * raw.size()[1];
        // At most half full, so that probe sequences stay short and always end.
        let bucket_count = (2 * pixels).next_power_of_two();
        let buckets = storage(device, "vastex compaction", u64::from(bucket_count) * HASH_BUCKET_BYTES);
        Compactor { pipelines: pipelines.clone(), raw: raw.view().clone(), buckets, bucket_count, pixels }
    }

    /// The most pages that a list can hold.
    pub(crate) fn capacity(&self) -> u32 {
        self.pixels
    }

    /// Bytes of a list.
    pub(crate) fn list_bytes(&self) -> u64 {
        HEAD_BYTES + u64::from(self.pixels) * WANTED_BYTES
    }

    pub(crate) fn list(&self, device: &wgpu::Device) -> List {
        let buffer = storage(device, "vastex feedback list", self.list_bytes());
        let resources = [
            wgpu::BindingResource::TextureView(&self.raw),
            self.buckets.as_entire_binding(),
            buffer.as_entire_binding(),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("vastex compaction"),
            layout: &self.pipelines.layout,
            entries: &entries,
        });
        List { buffer, bind_group }
    }

    /// Records the compaction of what the target then holds into `list`.
    pub(crate) fn record(&self, encoder: &mut wgpu::CommandEncoder, list: &List) {
        encoder.clear_buffer(&list.buffer, 0, Some(HEAD_BYTES));
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("vastex compaction"),
            timestamp_writes: None,
        });
        pass.set_bind_group(0, &list.bind_group, &[]);
        let CompactionPipelines { count, append, .. } = &self.pipelines;
        for (pipeline, invocations) in [(count, self.pixels), (append, self.bucket_count)] {
            let [x, y] = dispatch_size(invocations.div_ceil(shader_constants::WORKGROUP));
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(x, y, 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_of_more_pixels_than_a_buffer_has_room_for_is_refused() {
        let limits = wgpu::Limits::default();
        assert!(Compactor::check(&limits, [2048, 1024]).is_ok());
        for size in [[8192, 1024], [65536, 65536], [u32::MAX, u32::MAX]] {
            assert!(matches!(Compactor::check(&limits, size), Err(GpuError::TargetSize { .. })), "{size:?}");
        }
    }
}
