//! The ways in which feedback is gathered, and which of them a device has.
//!
//! What each does is told in `feedback` and `inline` (how a view's cells are filled) and in `readback` (how they come back).

use crate::device::refused;
use crate::error::GpuError;

/// How a view says which pages it wants, and how that comes back to the CPU. All ways give the same feedback.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FeedbackWay {
    /// The scene is drawn once more, small, and compacted on the GPU. The cheapest where the scene's vertices are few.
    #[default]
    Separate,
    /// A few pixels of the main pass say it by themselves (`vastex_tell`), so that nothing is drawn twice. Needs fragment shaders that
    /// write to a storage buffer, one more than the page tables that they read; unless the application asks for an early depth
    /// test, the main pass may have to do without.
    Inline,
    /// As [`FeedbackWay::Separate`], but read back whole and compacted on the CPU, and page tables are textures. For devices without compute
    /// shaders or storage buffers, such as those of OpenGL ES 3 and WebGL 2.
    Raw,
}

impl FeedbackWay {
    /// Every way.
    pub const ALL: [FeedbackWay; 3] = [FeedbackWay::Separate, FeedbackWay::Inline, FeedbackWay::Raw];

    /// The way's name, for settings and people.
    pub const fn name(self) -> &'static str {
        match self {
            FeedbackWay::Separate => "separate",
            FeedbackWay::Inline => "inline",
            FeedbackWay::Raw => "raw",
        }
    }

    /// The best way for a device: [`FeedbackWay::Separate`] wherever there are compute shaders and storage buffers for every stage.
    pub fn best(device: &wgpu::Device) -> FeedbackWay {
        if FeedbackWay::Separate.check(device).is_ok() { FeedbackWay::Separate } else { FeedbackWay::Raw }
    }

    /// Fails where the device has not what the way needs. Costs a bind group layout.
    pub fn check(self, device: &wgpu::Device) -> Result<(), GpuError> {
        let limits = device.limits();
        let has_compute = limits.max_compute_invocations_per_workgroup >= vastex_core::shared::WORKGROUP;
        let buffers = limits.max_storage_buffers_per_shader_stage;
        let vertex = wgpu::ShaderStages::VERTEX_FRAGMENT;
        // What an adapter lacks beside its limits is asked for by trying.
        let is_there = match self {
            FeedbackWay::Raw => true,
            FeedbackWay::Separate => has_compute && buffers >= 2 && has_storage(device, vertex, true),
            FeedbackWay::Inline => {
                FeedbackWay::Separate.check(device).is_ok()
                    && has_storage(device, wgpu::ShaderStages::FRAGMENT, false)
            }
        };
        if is_there { Ok(()) } else { Err(GpuError::FeedbackWay { way: self.name() }) }
    }
}

/// Whether stages may see a storage buffer.
fn has_storage(device: &wgpu::Device, visibility: wgpu::ShaderStages, read_only: bool) -> bool {
    let ty = crate::bind::buffer(wgpu::BufferBindingType::Storage { read_only });
    let entry = wgpu::BindGroupLayoutEntry { binding: 0, visibility, ty, count: None };
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("vastex probe"), entries: &[entry] };
    !refused(device, || device.create_bind_group_layout(&descriptor))
}
