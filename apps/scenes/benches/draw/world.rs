//! What the sections share: the device with its clock, and textures that are all resident.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use vastex::{Filter, Geometry, Pace, PoolSettings, Region, Settings, TextureId, TileSource};
use vastex_build::{BuildOptions, Compression};
use vastex_core::{AddressMode, GeometrySpec};
use vastex_scenes::{Gpu, GpuClock, Offscreen, Pose, Scene, headless_gpu, planet_image};
use vastex_tiles::PropertySource;

/// The device and what tells its time.
pub(crate) struct Bench {
    pub(crate) gpu: Gpu,
    pub(crate) clock: GpuClock,
}

/// The generated texture's side in texels: an ordinary texture of that size is there on every adapter.
const SIDE: u32 = 4096;
/// Texels of border: as far as anisotropic filters reach.
const BORDER: u32 = 8;
/// Frames within which all of it is in the pool.
const PATIENCE_FRAMES: u64 = 5000;

/// A device with timestamps where the adapter has them.
pub(crate) fn gpu() -> Result<Gpu> {
    let gpu = headless_gpu()?;
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("bench"),
        required_features: gpu.device.features() | GpuClock::features(&gpu.adapter),
        required_limits: gpu.adapter.limits(),
        ..Default::default()
    };
    let (device, queue) = pollster::block_on(gpu.adapter.request_device(&descriptor))?;
    Ok(Gpu::new(gpu.instance, gpu.adapter, device, queue))
}

/// Pixels of a picture: as many as a screen has, fewer where the adapter is a processor.
pub(crate) fn picture(gpu: &Gpu) -> [u32; 2] {
    if gpu.is_processor() { [320, 180] } else { [1920, 1080] }
}

/// What a section gives: its part of the page, and whether what it asks for holds.
pub(crate) type Part = (String, Vec<Verdict>);

/// Whether something that is asked for holds.
pub(crate) struct Verdict {
    what: String,
    found: f64,
    asked: f64,
}

impl Verdict {
    /// What was found is to be `asked` at most.
    pub(crate) fn at_most(asked: f64, what: impl Into<String>, found: f64) -> Verdict {
        Verdict { what: what.into(), found, asked }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Verdict { what, found, asked } = self;
        let verdict = if found <= asked { "HOLDS" } else { "MISSED" };
        write!(f, "{verdict}: {what}: {found:.2}, where at most {asked} is asked for")
    }
}

/// Processor time of this thread.
#[cfg(target_os = "linux")]
pub(crate) fn thread_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// Where the system does not tell it, the time that passes.
#[cfg(not(target_os = "linux"))]
pub(crate) fn thread_time() -> Duration {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed()
}

/// A generated texture.
pub(crate) fn property() -> Result<Arc<dyn TileSource>> {
    let address = [AddressMode::Wrap, AddressMode::Clamp, AddressMode::Clamp];
    let spec = GeometrySpec { border: BORDER, address, ..GeometrySpec::image(SIDE, SIDE / 2) };
    Ok(Arc::new(PropertySource::new(Geometry::new(spec)?)))
}

/// The Earth, at a quarter of the asset's resolution.
pub(crate) fn earth() -> Result<Arc<dyn TileSource>> {
    let asset = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-color-10800x5400.jpg");
    let directory = tempfile::tempdir()?;
    let [whole, png, quarter] =
        ["whole.vastex", "quarter.png", "quarter.vastex"].map(|name| directory.path().join(name));
    let address = [AddressMode::Wrap, AddressMode::Clamp];
    let options =
        BuildOptions { address, border: BORDER, compression: Compression::None, ..Default::default() };
    vastex_build::build(&[asset], &whole, &options, &())?;
    let image = planet_image(&*vastex::open(&whole)?)?;
    let mut encoder = png::Encoder::new(std::fs::File::create(&png)?, image.size[0], image.size[1]);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_compression(png::Compression::Fast);
    encoder.write_header()?.write_image_data(image.texels.as_flattened())?;
    vastex_build::build(&[&png], &quarter, &options, &())?;
    // On Linux the file lives as long as it is open; elsewhere the system clears it away some day.
    Ok(vastex::open(&quarter)?)
}

/// A view of a texture, of which every page is in the pool.
pub(crate) fn resident(
    bench: &Bench,
    source: Arc<dyn TileSource>,
    filter: Filter,
    scene: Scene,
    pose: Pose,
) -> Result<Offscreen> {
    let mut offscreen = new_studio(bench, source, filter, scene, Duration::ZERO)?;
    fetch(&mut offscreen, pose, &Region::whole())?;
    Ok(offscreen)
}

/// A texture, of which nothing is in the pool yet, with tiles that fade in over so much time.
pub(crate) fn new_studio(
    bench: &Bench,
    source: Arc<dyn TileSource>,
    filter: Filter,
    scene: Scene,
    fade: Duration,
) -> Result<Offscreen> {
    let settings = Settings {
        pools: PoolSettings::of_bytes(160 << 20),
        upload_bytes_per_frame: 8 << 20,
        pace: Pace::LockStep { latency_frames: 1 },
        filter,
        fade,
        ..Settings::default()
    };
    Ok(Offscreen::new(&bench.gpu, source, scene, picture(&bench.gpu), settings)?)
}

/// The first texture of a scene without a window.
pub(crate) fn texture(offscreen: &Offscreen) -> Result<TextureId> {
    offscreen.textures().inspect().textures().next().context("there is a first texture")
}

/// Frames until every page of a region is in the pool, where it stays.
pub(crate) fn fetch(offscreen: &mut Offscreen, pose: Pose, region: &Region) -> Result<()> {
    let texture = texture(offscreen)?;
    let ticket = offscreen.textures_mut().ahead().pin(texture, region)?;
    for _ in 0..PATIENCE_FRAMES {
        offscreen.frame(pose)?;
        let progress = ticket.progress();
        if progress.resident == progress.pages {
            return Ok(());
        }
    }
    bail!("not all pages came: {:?}", ticket.progress())
}
