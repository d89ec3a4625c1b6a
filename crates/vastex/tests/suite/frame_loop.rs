//! The frame loop at its edges: what it refuses, what it survives, and that its budgets hold.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::common::{Mapping, PICTURE, Screen, add_with, property, settings};
use vastex::diagnostics::PageState;
use vastex::{
    AddressMode, Error, GpuError, LevelRule, Pace, PoolSettings, Settings, TableChoice, TextureSettings,
    Textures, TileSource, ViewId,
};
use vastex_core::{Description, Dims, Geometry, GeometrySpec, PagePos, PoolError, WantedPage};
use vastex_tiles::{PropertySource, ReadFuture};
use vastex_wgpu::test_device::TestDevice;

const SIZE: [u32; 2] = [1000, 777];
const PAGE: u32 = 32;
/// Bytes of a tile with the usual border.
const TILE_BYTES: u64 = 40 * 40 * 4;

fn small_pages() -> Arc<dyn TileSource> {
    property(SIZE, PAGE, AddressMode::Clamp)
}

/// About 30 pages around a place of the texture.
fn around(centre: [f64; 2]) -> Mapping {
    Mapping::new(SIZE, centre, 1.1, 1.0, 0.2)
}

/// Every page that a jitter cycle cannot miss, since it has more pixels than a block, is there.
fn check_resident(screen: &Screen, wanted: &[WantedPage]) {
    let certain = || wanted.iter().filter(|wanted| wanted.pixels > 64);
    assert!(certain().count() > 5, "{wanted:?}");
    for wanted in certain() {
        assert!(matches!(screen.textures.inspect().state(wanted.page), PageState::Resident(_)), "{wanted:?}");
    }
}

/// A source that is another one, but counts its reads or lies about its format.
struct Wrapped {
    source: Arc<dyn TileSource>,
    description: Arc<Description>,
    reads: Mutex<HashMap<PagePos, u32>>,
}

impl Wrapped {
    fn new(source: Arc<dyn TileSource>) -> Wrapped {
        Wrapped { description: source.description().clone(), source, reads: Mutex::default() }
    }

    fn reads(&self) -> MutexGuard<'_, HashMap<PagePos, u32>> {
        self.reads.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads of pages that were read before.
    fn repeated_reads(&self) -> u32 {
        self.reads().values().map(|reads| reads - 1).sum()
    }
}

impl TileSource for Wrapped {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        *self.reads().entry(pos).or_default() += 1;
        self.source.read(pos)
    }
}

#[test]
fn after_a_lost_device_the_same_picture_comes_on_another() {
    for pace in [Pace::Realtime, Pace::LockStep { latency_frames: 1 }] {
        let source = Arc::new(Wrapped::new(small_pages()));
        let sources: [Arc<dyn TileSource>; 1] = [source.clone()];
        let mut screen = Screen::new(&sources, Settings { pace, ..settings() });
        let mapping = around([0.5, 0.5]);
        screen.set_mapping(0, &mapping);
        let texture = screen.texture(0);
        screen
            .textures
            .texture_mut(texture)
            .unwrap()
            .set_levels(LevelRule { finest: 1, ..LevelRule::default() });
        screen.converge();
        let (picture, reads) = (screen.picture(), source.repeated_reads());
        let wanted = screen.feedback_of_every_pixel().pages;
        screen.gpu.device.destroy();
        assert!((0..10).any(|_| screen.frame().is_err()));
        let mut screen = screen.on_another_device();
        screen.set_mapping(0, &mapping);
        assert_eq!(screen.textures.stats().pager.occupied, 1, "the tail is there at once");
        screen.converge();
        check_resident(&screen, &wanted);
        assert_eq!(screen.picture(), picture, "{pace:?}");
        assert_eq!(source.repeated_reads(), reads, "tiles came from the RAM cache");
    }
}

#[test]
fn a_lost_device_is_an_error() {
    for pace in [Pace::Realtime, Pace::LockStep { latency_frames: 1 }] {
        let mut screen = Screen::new(&[small_pages()], Settings { pace, ..settings() });
        screen.set_mapping(0, &around([0.5, 0.5]));
        for _ in 0..4 {
            screen.frame().unwrap();
        }
        screen.gpu.device.destroy();
        let error = (0..10).find_map(|_| screen.frame().err());
        assert!(matches!(error, Some(Error::Gpu(GpuError::DeviceLost))), "{pace:?}: {error:?}");
        assert!(error.is_some_and(|error| error.to_string().contains("create a new device")));
        let mut encoder = screen.gpu.device.create_command_encoder(&Default::default());
        let resized = screen.textures.feedback(&mut encoder, [64, 64], |_, _| ());
        assert!(matches!(resized, Err(Error::Gpu(GpuError::DeviceLost))), "{resized:?}");
    }
}

#[test]
fn volumes_and_images_have_pools_of_their_own() {
    let gpu = TestDevice::new();
    let mut textures = Textures::new(&gpu.device, &gpu.queue, settings()).unwrap();
    let spec = GeometrySpec { dims: Dims::D3, size: [50, 40, 30], page: 16, ..GeometrySpec::image(50, 40) };
    let volume = Arc::new(PropertySource::new(Geometry::new(spec).unwrap()));
    let volume = textures.add_blocking(volume).unwrap();
    let image = textures.add_blocking(small_pages()).unwrap();
    let pool = |texture| textures.texture(texture).unwrap().pool();
    assert_ne!(pool(volume), pool(image));
    let tiles: Vec<_> = textures.stats().pools.iter().map(|pool| pool.tiles.to_string()).collect();
    assert!(tiles[0].contains("24x24x24 voxels"), "{tiles:?}");
}

#[test]
fn a_texture_that_is_refused_leaves_everything_as_it_was() {
    let device = TestDevice::new();
    let mut textures = Textures::new(&device.device, &device.queue, settings()).unwrap();
    let endless = Geometry::new(GeometrySpec::image(1 << 31, 1 << 31)).unwrap();
    let direct = TextureSettings { page_table: TableChoice::Direct, ..Default::default() };
    for _ in 0..2 {
        let refused = add_with(&mut textures, Arc::new(PropertySource::new(endless.clone())), direct.clone());
        assert!(matches!(refused, Err(Error::Gpu(GpuError::TableTooLarge { .. }))), "{refused:?}");
    }
    // Neither its number nor its pool is kept: the next one is the first.
    let first = textures.add_blocking(small_pages()).unwrap();
    assert_eq!((first.number().number(), textures.stats().pools.len()), (0, 1));
    assert_eq!(textures.texture(first).unwrap().description().geometry.spec().page, PAGE);
    let refused = add_with(&mut textures, Arc::new(PropertySource::new(endless)), direct);
    assert!(refused.is_err());
    assert_eq!(textures.add_blocking(small_pages()).unwrap().number().number(), 1);
}

#[test]
fn a_pool_that_holds_not_even_the_tails_is_refused_with_a_remedy() {
    let gpu = TestDevice::new();
    let textures = |bytes| {
        let settings = Settings { pools: PoolSettings::of_bytes(bytes), ..settings() };
        Textures::new(&gpu.device, &gpu.queue, settings).unwrap()
    };
    let error = textures(TILE_BYTES).add_blocking(small_pages()).unwrap_err();
    assert!(matches!(error, Error::Pool(PoolError::TooSmall { .. })), "{error:?}");
    let remedy = format!("make the pool at least {} bytes", 2 * TILE_BYTES);
    assert!(error.to_string().contains(&remedy), "{error}");

    let mut enough_for_one = textures(2 * TILE_BYTES);
    enough_for_one.add_blocking(small_pages()).unwrap();
    let error = enough_for_one.add_blocking(small_pages()).unwrap_err();
    assert!(matches!(error, Error::Pool(PoolError::TooSmall { .. })), "{error:?}");
}

#[test]
fn a_loop_without_textures_is_harmless() {
    let gpu = TestDevice::new();
    for pace in [Pace::Realtime, Pace::LockStep { latency_frames: 1 }] {
        let mut textures = Textures::new(&gpu.device, &gpu.queue, Settings { pace, ..settings() }).unwrap();
        for _ in 0..5 {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            textures.feedback(&mut encoder, PICTURE, |_, _| ()).unwrap();
            textures.update().unwrap();
            gpu.queue.submit([encoder.finish()]);
            textures.view_mut(ViewId::MAIN).unwrap().cut();
            assert!(textures.poll_event().is_none());
        }
        assert!(textures.pixels().feedback_of_every(PICTURE, |_, _| ()).unwrap().pages.is_empty());
        assert!(textures.inspect().failed_pages().is_empty());
        assert!(!textures.stats().converged);
    }
}

#[test]
fn real_time_converges_too() {
    let mut screen = Screen::new(&[small_pages()], Settings { pace: Pace::Realtime, ..settings() });
    screen.set_mapping(0, &around([0.5, 0.5]));
    let converged = (0..1500).any(|_| {
        screen.frame().unwrap();
        std::thread::sleep(Duration::from_millis(1));
        screen.textures.stats().converged
    });
    assert!(converged, "{:?}", screen.textures.stats());
    let wanted = screen.feedback_of_every_pixel().pages;
    check_resident(&screen, &wanted);
}

#[test]
fn after_a_cut_the_old_view_is_no_longer_wanted() {
    // Half of the view stays, so that the jump is not seen unless it is declared.
    let wanted_after_jump = |cut: bool| {
        let mut screen = Screen::new(&[small_pages()], settings());
        screen.set_mapping(0, &around([0.5, 0.5]));
        screen.converge();
        screen.set_mapping(0, &around([0.58, 0.5]));
        if cut {
            screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
        }
        (0..5).for_each(|_| drop(screen.frame().unwrap()));
        screen.textures.stats().pager.wanted
    };
    let (without, with) = (wanted_after_jump(false), wanted_after_jump(true));
    assert!(with < without, "wanted pages: {with} with a cut, {without} without");
}

#[test]
fn what_the_ram_cache_holds_is_not_read_again() {
    // The pool holds one of the two views, so that each has to be loaded again.
    let repeated_reads = |ram_cache_bytes| {
        let source = Arc::new(Wrapped::new(small_pages()));
        let settings =
            Settings { pools: PoolSettings::of_bytes(64 * TILE_BYTES), ram_cache_bytes, ..settings() };
        let mut screen = Screen::new(&[source.clone() as Arc<dyn TileSource>], settings);
        for centre in [[0.2, 0.2], [0.8, 0.8], [0.2, 0.2], [0.8, 0.8]] {
            screen.set_mapping(0, &around(centre));
            screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
            screen.converge();
        }
        assert!(screen.textures.stats().pager.evicted > 0, "{:?}", screen.textures.stats());
        source.repeated_reads()
    };
    let [none, some, ample] = [0, 24 * TILE_BYTES, 1 << 30].map(repeated_reads);
    assert_eq!(ample, 0, "the tail included, which is read when the texture is added");
    assert!(none >= some && some > ample, "{none} without a cache, {some} with a small one");
}

#[test]
fn budgets_hold_in_every_frame() {
    let pool_bytes = 40 * TILE_BYTES + 17;
    let limits = Settings {
        pools: PoolSettings::of_bytes(pool_bytes),
        upload_bytes_per_frame: TILE_BYTES / 2,
        in_flight_bytes: 3 * TILE_BYTES,
        ..settings()
    };
    let mut screen = Screen::new(&[small_pages()], limits.clone());
    for frame in 1..=150u64 {
        let part = frame as f64 / 150.0;
        screen.set_mapping(0, &around([part, 0.5 + 0.3 * part]));
        screen.frame().unwrap();
        let stats = screen.textures.stats();
        assert!(stats.pool_bytes <= pool_bytes, "{stats:?}");
        assert!(stats.pager.in_flight_bytes <= limits.in_flight_bytes, "{stats:?}");
        let bucket =
            frame * limits.upload_bytes_per_frame + TILE_BYTES.max(4 * limits.upload_bytes_per_frame);
        assert!(stats.pager.uploaded_bytes <= bucket, "frame {frame}: {stats:?}");
    }
    assert!(screen.textures.stats().pager.loaded > 20, "{:?}", screen.textures.stats());
}

#[test]
fn all_textures_share_one_ram_cache() {
    let budget = 40 * TILE_BYTES;
    let pools = PoolSettings::of_bytes(64 * TILE_BYTES);
    let limits = Settings { pools, ram_cache_bytes: budget, ..settings() };
    let mut screen = Screen::new(&[small_pages(), small_pages()], limits);
    for step in 0..8 {
        screen.set_mapping(0, &around([0.2 + 0.08 * f64::from(step), 0.3]));
        screen.set_mapping(1, &around([0.5, 0.2 + 0.08 * f64::from(step)]));
        screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
        screen.converge();
    }
    let telemetry = screen.textures.inspect().telemetry();
    let held: u64 = telemetry.newest().map(|record| record.tiers.ram.bytes).sum();
    let evicted: u64 = telemetry.iter().map(|record| record.tiers.ram.evictions).sum();
    assert!(held <= budget && held > budget / 2 && evicted > 0, "{held} of {budget}, {evicted} evicted");
}
