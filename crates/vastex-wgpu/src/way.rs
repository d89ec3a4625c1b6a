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

    /// The best way for a device: [`FeedbackWay::Separate`] wherever there are compute shaders and storage buffers for every stage. In a
    /// browser, which answers later than it is asked, that is as the limits say; who knows better says so in the settings.
    pub fn best(device: &wgpu::Device) -> FeedbackWay {
        if FeedbackWay::Separate.check(device).is_ok() { FeedbackWay::Separate } else { FeedbackWay::Raw }
    }

    /// The way that was asked for, if the device has it; where none was, [the best](FeedbackWay::best). In a browser whoever asks is believed,
    /// since its limits do not say all that its device has.
    pub fn choose(asked: Option<FeedbackWay>, device: &wgpu::Device) -> Result<FeedbackWay, GpuError> {
        let best = || FeedbackWay::best(device);
        FeedbackWay::chosen(asked, cfg!(target_family = "wasm"), best, |way| way.check(device))
    }

    fn chosen(
        asked: Option<FeedbackWay>,
        in_browser: bool,
        best: impl FnOnce() -> FeedbackWay,
        check: impl FnOnce(FeedbackWay) -> Result<(), GpuError>,
    ) -> Result<FeedbackWay, GpuError> {
        match asked {
            None => Ok(best()),
            Some(way) if in_browser => Ok(way),
            Some(way) => check(way).map(|()| way),
        }
    }

    /// Fails where the device has not what the way needs. Costs a bind group layout; in a browser nothing.
    pub fn check(self, device: &wgpu::Device) -> Result<(), GpuError> {
        let limits = device.limits();
        let stages =
            if cfg!(target_family = "wasm") { Stages::by_limits(&limits) } else { Stages::tried(device) };
        if self.is_there(&limits, stages) { Ok(()) } else { Err(GpuError::FeedbackWay { way: self.name() }) }
    }

    fn is_there(self, limits: &wgpu::Limits, stages: Stages) -> bool {
        let has_compute =
            limits.max_compute_invocations_per_workgroup >= vastex_core::shader_constants::WORKGROUP;
        let has_buffers = limits.max_storage_buffers_per_shader_stage >= 2;
        let is_separate = has_compute && has_buffers && stages.read_by_vertices;
        match self {
            FeedbackWay::Raw => true,
            FeedbackWay::Separate => is_separate,
            FeedbackWay::Inline => is_separate && stages.written_by_fragments,
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

    /// As a browser has it. One whose adapters may lack them in some stages (WebGPU's compatibility mode) has fewer for each stage
    /// than every other.
    fn by_limits(limits: &wgpu::Limits) -> Stages {
        let most = wgpu::Limits::default().max_storage_buffers_per_shader_stage;
        let is_whole = limits.max_storage_buffers_per_shader_stage >= most;
        Stages { read_by_vertices: is_whole, written_by_fragments: is_whole }
    }
}

/// Whether stages may see a storage buffer.
fn has_storage(device: &wgpu::Device, visibility: wgpu::ShaderStages, read_only: bool) -> bool {
    let ty = crate::bind::buffer(wgpu::BufferBindingType::Storage { read_only });
    let entry = wgpu::BindGroupLayoutEntry { binding: 0, visibility, ty, count: None };
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("vastex probe"), entries: &[entry] };
    !refused(device, || device.create_bind_group_layout(&descriptor))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ways that a browser with these limits has.
    fn ways(limits: &wgpu::Limits) -> Vec<FeedbackWay> {
        let stages = Stages::by_limits(limits);
        FeedbackWay::ALL.into_iter().filter(|way| way.is_there(limits, stages)).collect()
    }

    #[test]
    fn in_a_browser_limits_alone_say_which_ways_there_are() {
        let default = wgpu::Limits::default();
        assert_eq!(ways(&default), FeedbackWay::ALL);
        // WebGPU's compatibility mode has 4 storage buffers for each stage, and maybe none for vertices.
        let compatible = wgpu::Limits { max_storage_buffers_per_shader_stage: 4, ..default.clone() };
        assert_eq!(ways(&compatible), [FeedbackWay::Raw]);
        let no_compute = wgpu::Limits { max_compute_invocations_per_workgroup: 0, ..default };
        assert_eq!(ways(&no_compute), [FeedbackWay::Raw]);
        assert_eq!(ways(&wgpu::Limits::downlevel_webgl2_defaults()), [FeedbackWay::Raw]);
    }

    /// Whatever its limits say; elsewhere what the device has not is refused.
    #[test]
    fn in_a_browser_a_setting_overrides_what_limits_say() {
        let compatible = wgpu::Limits { max_storage_buffers_per_shader_stage: 4, ..wgpu::Limits::default() };
        let chosen = |asked, in_browser| {
            let has = ways(&compatible);
            let best = || {
                if has.contains(&FeedbackWay::Separate) { FeedbackWay::Separate } else { FeedbackWay::Raw }
            };
            let refused = |way: FeedbackWay| GpuError::FeedbackWay { way: way.name() };
            let check = |way| if has.contains(&way) { Ok(()) } else { Err(refused(way)) };
            FeedbackWay::chosen(asked, in_browser, best, check)
        };
        assert_eq!(chosen(None, true), Ok(FeedbackWay::Raw));
        for way in FeedbackWay::ALL {
            assert_eq!(chosen(Some(way), true), Ok(way));
            assert_eq!(chosen(Some(way), false).is_ok(), way == FeedbackWay::Raw);
        }
    }

    #[test]
    fn what_a_device_lacks_beside_its_limits_counts_too() {
        let limits = wgpu::Limits::default();
        let stages = Stages { read_by_vertices: true, written_by_fragments: false };
        assert!(
            FeedbackWay::Separate.is_there(&limits, stages) && !FeedbackWay::Inline.is_there(&limits, stages)
        );
        let stages = Stages { read_by_vertices: false, written_by_fragments: true };
        assert!(
            FeedbackWay::ALL.iter().all(|way| way.is_there(&limits, stages) == (*way == FeedbackWay::Raw))
        );
    }
}
