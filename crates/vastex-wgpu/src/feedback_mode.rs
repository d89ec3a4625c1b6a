//! The modes in which feedback is gathered, and which of them a device has.
//!
//! What each does is said in `feedback` and `inline` (how a view's cells are filled) and in `readback` (how
//! they come back).

use crate::device::{refused, whole_buffer};
use crate::error::GpuError;

/// How a view says which pages it wants, and how that comes back to the CPU. All modes give the same
/// feedback.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FeedbackMode {
    /// The scene is drawn once more, small, and compacted on the GPU. The cheapest where the scene's vertices
    /// are few.
    #[default]
    Separate,
    /// A few pixels of the main pass report it by themselves (`vastex_report`), so that nothing is drawn
    /// twice. Needs fragment shaders that write to a storage buffer, one more than the page tables that they
    /// read; unless the application asks for an early depth test, the main pass may have to do without.
    Inline,
    /// As [`FeedbackMode::Separate`], but read back whole and compacted on the CPU, and page tables are
    /// textures. For devices without compute shaders or storage buffers, such as those of OpenGL ES 3 and
    /// WebGL 2.
    Raw,
}

impl FeedbackMode {
    /// Every mode.
    pub const ALL: [FeedbackMode; 3] = [FeedbackMode::Separate, FeedbackMode::Inline, FeedbackMode::Raw];

    /// The name of the mode, for settings and people.
    pub const fn name(self) -> &'static str {
        match self {
            FeedbackMode::Separate => "separate",
            FeedbackMode::Inline => "inline",
            FeedbackMode::Raw => "raw",
        }
    }

    /// The best mode for a device: [`FeedbackMode::Separate`] wherever there are compute shaders and storage
    /// buffers for every stage. In a browser, which answers later than it is asked, that is as the limits
    /// say; who knows better says so in the settings.
    pub fn best(device: &wgpu::Device) -> FeedbackMode {
        if FeedbackMode::Separate.check(device).is_ok() { FeedbackMode::Separate } else { FeedbackMode::Raw }
    }

    /// The mode that was asked for, if the device has it; where none was, [the best](FeedbackMode::best). In
    /// a browser whoever asks is believed, since its limits do not say all that its device has.
    pub fn choose(asked: Option<FeedbackMode>, device: &wgpu::Device) -> Result<FeedbackMode, GpuError> {
        let best = || FeedbackMode::best(device);
        FeedbackMode::chosen(asked, cfg!(target_family = "wasm"), best, |mode| mode.check(device))
    }

    fn chosen(
        asked: Option<FeedbackMode>,
        in_browser: bool,
        best: impl FnOnce() -> FeedbackMode,
        check: impl FnOnce(FeedbackMode) -> Result<(), GpuError>,
    ) -> Result<FeedbackMode, GpuError> {
        match asked {
            None => Ok(best()),
            Some(mode) if in_browser => Ok(mode),
            Some(mode) => check(mode).map(|()| mode),
        }
    }

    /// Fails where the device has not what the mode needs. Costs a bind group layout; in a browser nothing.
    pub fn check(self, device: &wgpu::Device) -> Result<(), GpuError> {
        let limits = device.limits();
        let stages =
            if cfg!(target_family = "wasm") { Stages::by_limits(&limits) } else { Stages::tried(device) };
        if self.is_there(&limits, stages) {
            Ok(())
        } else {
            Err(GpuError::FeedbackMode { mode: self.name() })
        }
    }

    fn is_there(self, limits: &wgpu::Limits, stages: Stages) -> bool {
        let has_compute =
            limits.max_compute_invocations_per_workgroup >= vastex_core::shader_constants::WORKGROUP;
        let has_buffers = limits.max_storage_buffers_per_shader_stage >= 2;
        let is_separate = has_compute && has_buffers && stages.read_by_vertices;
        match self {
            FeedbackMode::Raw => true,
            FeedbackMode::Separate => is_separate,
            FeedbackMode::Inline => is_separate && stages.written_by_fragments,
        }
    }
}

/// Which stages see storage buffers, for which adapters have no limits.
#[derive(Clone, Copy, Debug)]
struct Stages {
    read_by_vertices: bool,
    written_by_fragments: bool,
}

impl Stages {
    /// As the device has it, which is asked by trying.
    fn tried(device: &wgpu::Device) -> Stages {
        Stages {
            read_by_vertices: has_storage(device, wgpu::ShaderStages::VERTEX_FRAGMENT, true),
            written_by_fragments: has_storage(device, wgpu::ShaderStages::FRAGMENT, false),
        }
    }

    /// As a browser has it. One whose adapters may lack them in some stages (WebGPU's compatibility mode) has
    /// fewer for each stage than every other.
    fn by_limits(limits: &wgpu::Limits) -> Stages {
        let most = wgpu::Limits::default().max_storage_buffers_per_shader_stage;
        let is_whole = limits.max_storage_buffers_per_shader_stage >= most;
        Stages { read_by_vertices: is_whole, written_by_fragments: is_whole }
    }
}

/// Returns true if stages may see a storage buffer.
fn has_storage(device: &wgpu::Device, visibility: wgpu::ShaderStages, read_only: bool) -> bool {
    let ty = whole_buffer(wgpu::BufferBindingType::Storage { read_only });
    let entry = wgpu::BindGroupLayoutEntry { binding: 0, visibility, ty, count: None };
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("vastex probe"), entries: &[entry] };
    !refused(device, || device.create_bind_group_layout(&descriptor))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The modes that a browser with these limits has.
    fn modes(limits: &wgpu::Limits) -> Vec<FeedbackMode> {
        let stages = Stages::by_limits(limits);
        FeedbackMode::ALL.into_iter().filter(|mode| mode.is_there(limits, stages)).collect()
    }

    #[test]
    fn in_a_browser_limits_alone_say_which_modes_there_are() {
        let default = wgpu::Limits::default();
        assert_eq!(modes(&default), FeedbackMode::ALL);
        // WebGPU's compatibility mode has 4 storage buffers for each stage, and maybe none for vertices.
        let compatible = wgpu::Limits { max_storage_buffers_per_shader_stage: 4, ..default.clone() };
        assert_eq!(modes(&compatible), [FeedbackMode::Raw]);
        let no_compute = wgpu::Limits { max_compute_invocations_per_workgroup: 0, ..default };
        assert_eq!(modes(&no_compute), [FeedbackMode::Raw]);
        assert_eq!(modes(&wgpu::Limits::downlevel_webgl2_defaults()), [FeedbackMode::Raw]);
    }

    /// Whatever its limits say; elsewhere what the device has not is refused.
    #[test]
    fn in_a_browser_a_setting_overrides_what_limits_say() {
        let compatible = wgpu::Limits { max_storage_buffers_per_shader_stage: 4, ..wgpu::Limits::default() };
        let chosen = |asked, in_browser| {
            let has = modes(&compatible);
            let best = || {
                if has.contains(&FeedbackMode::Separate) { FeedbackMode::Separate } else { FeedbackMode::Raw }
            };
            let refused = |mode: FeedbackMode| GpuError::FeedbackMode { mode: mode.name() };
            let check = |mode| if has.contains(&mode) { Ok(()) } else { Err(refused(mode)) };
            FeedbackMode::chosen(asked, in_browser, best, check)
        };
        assert_eq!(chosen(None, true), Ok(FeedbackMode::Raw));
        for mode in FeedbackMode::ALL {
            assert_eq!(chosen(Some(mode), true), Ok(mode));
            assert_eq!(chosen(Some(mode), false).is_ok(), mode == FeedbackMode::Raw);
        }
    }

    #[test]
    fn what_a_device_lacks_beside_its_limits_counts_too() {
        let limits = wgpu::Limits::default();
        let stages = Stages { read_by_vertices: true, written_by_fragments: false };
        assert!(
            FeedbackMode::Separate.is_there(&limits, stages)
                && !FeedbackMode::Inline.is_there(&limits, stages)
        );
        let stages = Stages { read_by_vertices: false, written_by_fragments: true };
        assert!(
            FeedbackMode::ALL
                .iter()
                .all(|mode| mode.is_there(&limits, stages) == (*mode == FeedbackMode::Raw))
        );
    }
}
