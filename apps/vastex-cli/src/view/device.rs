//! The device that draws in the window, and what suits it.

use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result};
use vastex_scenes::Gpu;
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window;

use crate::gpu;

/// How long a tile fades in where nobody says: not at all where fading costs more than it is worth.
pub(super) fn default_fade(gpu: &Gpu) -> Duration {
    if gpu.is_processor() { Duration::ZERO } else { Duration::from_millis(150) }
}

/// A device that draws in the window, and the window's surface.
pub(super) fn device_for(
    window: &Arc<Window>,
    display: OwnedDisplayHandle,
) -> Result<(Gpu, wgpu::Surface<'static>)> {
    let described = wgpu::InstanceDescriptor::new_with_display_handle_from_env(Box::new(display));
    let instance = pollster::block_on(vastex::instance_for(described));
    let surface = instance.create_surface(window.clone()).context(
        "no graphics driver draws in this window; install a Vulkan driver (on Debian and Ubuntu the software driver is \
         the package mesa-vulkan-drivers)",
    )?;
    let gpu = pollster::block_on(Gpu::for_surface(instance, Some(&surface)))?;
    gpu::report_refusals(&gpu);
    Ok((gpu, surface))
}
