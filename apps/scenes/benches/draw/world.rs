//! What the sections share: the device with its clock, and a texture that is all resident.

use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use vastex::{Filter, Geometry, Pace, PoolSettings, Region, Settings, TextureId, TileSource};
use vastex_core::{AddressMode, GeometrySpec};
use vastex_scenes::{Gpu, GpuClock, Pose, Scene, Studio};
use vastex_tiles::PropertySource;

/// The device and what tells its time.
pub(crate) struct Bench {
    pub(crate) gpu: Gpu,
    pub(crate) clock: GpuClock,
}

/// The texture's side in texels: an ordinary texture of that size is there on every adapter.
const SIDE: u32 = 4096;
/// Frames within which all of it is in the pool.
const PATIENCE_FRAMES: u64 = 5000;

/// A device with timestamps where the adapter has them.
pub(crate) fn gpu() -> Result<Gpu> {
    let gpu = Gpu::headless()?;
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("bench"),
        required_features: gpu.device.features() | GpuClock::features(&gpu.adapter),
        required_limits: gpu.adapter.limits(),
        ..Default::default()
    };
    let (device, queue) = pollster::block_on(gpu.adapter.request_device(&descriptor))?;
    Ok(Gpu { device, queue, ..gpu })
}

/// Pixels of a picture: as many as a screen has, fewer where the adapter is a processor.
pub(crate) fn picture(gpu: &Gpu) -> [u32; 2] {
    match gpu.adapter.get_info().device_type {
        wgpu::DeviceType::Cpu => [320, 180],
        _ => [1920, 1080],
    }
}

/// A view of the texture, of which every page is in the pool, with borders of 8 texels.
pub(crate) fn resident(bench: &Bench, filter: Filter, scene: Scene, pose: Pose) -> Result<Studio> {
    let mut studio = new_studio(bench, filter, scene, Duration::ZERO)?;
    fetch(&mut studio, pose, &Region::whole())?;
    Ok(studio)
}

/// The texture, of which nothing is in the pool yet, with tiles that fade in over so much time.
pub(crate) fn new_studio(bench: &Bench, filter: Filter, scene: Scene, fade: Duration) -> Result<Studio> {
    let address = [AddressMode::Wrap, AddressMode::Clamp, AddressMode::Clamp];
    let spec = GeometrySpec { border: 8, address, ..GeometrySpec::image(SIDE, SIDE / 2) };
    let source: Arc<dyn TileSource> = Arc::new(PropertySource::new(Geometry::new(spec)?));
    let settings = Settings {
        pools: PoolSettings::of_bytes(160 << 20),
        upload_bytes_per_frame: 8 << 20,
        pace: Pace::LockStep { latency_frames: 1 },
        filter,
        fade,
        ..Settings::default()
    };
    Ok(Studio::new(&bench.gpu, source, scene, picture(&bench.gpu), settings)?)
}

/// The first texture of a studio.
pub(crate) fn texture() -> Result<TextureId> {
    TextureId::new(0).context("there is a first texture")
}

/// Frames until every page of a region is in the pool, where it stays.
pub(crate) fn fetch(studio: &mut Studio, pose: Pose, region: &Region) -> Result<()> {
    let ticket = studio.textures_mut().pin(texture()?, region)?;
    for _ in 0..PATIENCE_FRAMES {
        studio.frame(pose)?;
        let progress = ticket.progress();
        if progress.resident == progress.pages {
            return Ok(());
        }
    }
    ensure!(false, "not all pages came: {:?}", ticket.progress());
    Ok(())
}
