//! What the picture tests share: a device, and images that are hard on filters.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock};

use vastex::source::{Codec, Tile};
use vastex::{AddressMode, Filter, Pace, PagePos, PoolSettings, Settings, TileSource};
use vastex_build::{BuildOptions, Compression};
use vastex_scenes::{Gpu, Offscreen, Outcome, Path, Pose, Scene, Until, headless_gpu};
use vastex_wgpu::test_device::check_adapter;

/// The device that all tests of a process share. There is always one: `cargo xtask test` installs a driver.
pub(crate) fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| {
        let gpu = headless_gpu().unwrap_or_else(|why| panic!("{why}; `cargo xtask test` installs one"));
        check_adapter(&gpu.adapter.get_info());
        gpu
    })
}

/// Returns true if what draws is a software driver, whose pictures of the same texels at different places are
/// the same. What those of a GPU may differ by stands in docs/draw-checks.md, "What a GPU may differ by".
pub(crate) fn is_processor() -> bool {
    gpu().is_processor()
}

/// The tiles that a source has made, which many pictures are drawn of: to make one takes longer than to draw
/// it.
#[derive(Default)]
pub(crate) struct Tiles(Mutex<HashMap<PagePos, Tile>>);

impl Tiles {
    /// The tile of a page, which `make` makes where it is asked for the first time.
    pub(crate) fn get(&self, pos: PagePos, make: impl FnOnce() -> Vec<u8>) -> Tile {
        let made = self.0.lock().unwrap().get(&pos).cloned();
        made.unwrap_or_else(|| {
            let tile = Tile { codec: Codec::Raw, bytes: make().into() };
            self.0.lock().unwrap().insert(pos, tile.clone());
            tile
        })
    }
}

/// What an image is made and built with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Image {
    pub(crate) size: [u32; 2],
    pub(crate) page: u32,
    pub(crate) address: [AddressMode; 2],
    pub(crate) channels: png::ColorType,
    pub(crate) sixteen_bit: bool,
}

impl Image {
    pub(crate) fn new(width: u32, height: u32, page: u32) -> Image {
        let (address, channels) = ([AddressMode::Clamp; 2], png::ColorType::Rgb);
        Image { size: [width, height], page, address, channels, sixteen_bit: false }
    }

    /// A container of the image, in a directory that goes with the test.
    pub(crate) fn build(&self) -> (tempfile::TempDir, PathBuf) {
        let directory = tempfile::tempdir().unwrap();
        let (input, output) = (directory.path().join("in.png"), directory.path().join("out.vastex"));
        self.write_png(&input);
        let options = BuildOptions {
            page: self.page,
            address: self.address,
            compression: Compression::None,
            threads: 1,
            // Not black, where a step of linear light is thirteen of sRGB.
            border_color: [150, 110, 120, 255],
            ..BuildOptions::default()
        };
        vastex_build::build(&[input], &output, &options, &()).unwrap();
        (directory, output)
    }

    /// Smooth shades with hard edges and grain on them: every filter mistake shows.
    fn write_png(&self, path: &std::path::Path) {
        let [width, height] = self.size;
        let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
        let mut encoder = png::Encoder::new(file, width, height);
        encoder.set_color(self.channels);
        encoder.set_depth(if self.sixteen_bit { png::BitDepth::Sixteen } else { png::BitDepth::Eight });
        let channels = self.channels.samples();
        let mut bytes = Vec::new();
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            for channel in 0..channels as u32 {
                let grain = (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca6b) ^ channel << 13)
                    .wrapping_mul(0xc2b2_ae35)
                    >> 26;
                let check = if (x / 37 + y / 23 + channel) % 2 == 0 { 90 } else { 0 };
                let shade = (x * (channel + 1) / 7 + y / 5) % 100;
                let value = (grain + check + shade) as u16;
                match self.sixteen_bit {
                    true => bytes.extend((value * 257).to_be_bytes()),
                    false => bytes.push(value as u8),
                }
            }
        }
        encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
    }
}

/// Settings under which a run is the same each time.
pub(crate) fn settings(pool_mib: u64, filter: Filter) -> Settings {
    Settings {
        pools: PoolSettings::of_bytes(pool_mib << 20),
        filter,
        pace: Pace::LockStep { latency_frames: 1 },
        ..Settings::default()
    }
}

/// A offscreen whose view has converged.
pub(crate) fn converged(
    source: Arc<dyn TileSource>,
    scene: Scene,
    size: [u32; 2],
    path: Path,
    settings: Settings,
) -> Offscreen {
    let mut offscreen = Offscreen::new(gpu(), source, scene, size, settings).unwrap();
    play(&mut offscreen, path);
    offscreen
}

/// Plays one frame in ten of a path, and stays at its end until all is there: only the last picture is looked
/// at, and what was seen on the way there is what may be left behind.
pub(crate) fn play(offscreen: &mut Offscreen, path: Path) -> Outcome {
    const EVERY: u64 = 10;
    let (scene, image) = (offscreen.renderer().scene(), offscreen.renderer().image_aspect());
    let pose = |frame| path.pose(scene, image, EVERY * frame);
    let frames = path.frames().div_ceil(EVERY);
    let outcome = offscreen.run_along(frames, pose, Until::Converged, |_, _| ()).unwrap();
    assert!(outcome.converged, "{scene:?} {path:?}: {:?}", outcome.stats);
    outcome
}

/// Draws until everything that the pose wants is there.
pub(crate) fn settle(offscreen: &mut Offscreen, pose: Pose) {
    for frame in 0..2000 {
        offscreen.frame(pose).unwrap();
        if frame > 20 && offscreen.textures().stats().converged {
            return;
        }
    }
    panic!("{pose:?} has not converged: {:?}", offscreen.textures().stats());
}
