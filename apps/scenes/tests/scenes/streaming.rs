//! The loop under pressure: small pools, small budgets, broken tiles, moving cameras.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::common::{Image, gpu, settings, settle};
use glam::DVec2;
use vastex::diagnostics::FrameStats;
use vastex::{Event, Filter, Geometry, Settings, TileSource};
use vastex_core::GeometrySpec;
use vastex_scenes::{Offscreen, Path, Pose, Scene, Until};
use vastex_tiles::{Faults, Injection, PropertySource, ReadError, ReadFuture, Tile};

/// A texture of 16384x8192 texels that takes no space.
fn huge() -> Arc<dyn TileSource> {
    Arc::new(PropertySource::new(Geometry::new(GeometrySpec::image(16384, 8192)).unwrap()))
}

fn pool(mib: u64) -> Settings {
    settings(mib, Filter::Trilinear)
}

/// Budgets hold in every frame.
fn check_budgets(stats: &FrameStats, settings: &Settings) {
    assert!(Some(stats.pool_bytes) <= settings.pools.default_pool.bytes, "{stats:?}");
    assert!(stats.pager.in_flight_bytes <= settings.in_flight_bytes, "{stats:?}");
    assert!(stats.pager.occupied <= stats.pager.slots, "{stats:?}");
    let uploaded =
        stats.frame * settings.upload_bytes_per_frame + 4 * settings.upload_bytes_per_frame.max(73_984);
    assert!(stats.pager.uploaded_bytes <= uploaded, "{stats:?}");
}

#[test]
fn too_small_a_pool_makes_the_picture_coarser_and_loads_nothing_twice() {
    for mib in [1, 2, 4] {
        let settings = pool(mib);
        let mut offscreen =
            Offscreen::new(gpu(), huge(), Scene::Plane, [1280, 720], settings.clone()).unwrap();
        let mut oversubscribed = 0;
        let outcome = offscreen.run(Path::Still, Until::Converged, |textures, events| {
            let stats = textures.stats();
            check_budgets(&stats, &settings);
            assert_eq!(stats.pager.reloaded, 0, "{mib} MiB: {stats:?}");
            assert!(!events.iter().any(|event| matches!(event, Event::Failed { .. })));
            oversubscribed +=
                events.iter().filter(|event| matches!(event, Event::Oversubscribed { .. })).count();
        });
        let stats = outcome.unwrap();
        assert!(stats.converged, "{mib} MiB: {stats:?}");
        let stats = stats.stats.pager;
        assert!(
            oversubscribed > 0 && stats.bias_eighths > 0 && stats.wanted > stats.slots,
            "{mib} MiB: {stats:?}"
        );
        assert!(2 * stats.occupied >= stats.slots, "{mib} MiB: {stats:?}");
        // It stays so.
        for _ in 0..100 {
            offscreen.frame(Path::Still.pose(Scene::Plane, 2.0, 0)).unwrap();
        }
        let later = offscreen.textures().stats().pager;
        assert_eq!((later.reloaded, later.loaded, later.bias_eighths), (0, stats.loaded, stats.bias_eighths));
    }
}

#[test]
fn every_path_keeps_its_budgets_and_converges_when_it_holds() {
    for (scene, path) in Scene::SMOOTH.into_iter().flat_map(|scene| Path::ALL.map(|path| (scene, path))) {
        let settings = Settings { in_flight_bytes: 1 << 20, ..pool(4) };
        let mut offscreen = Offscreen::new(gpu(), huge(), scene, [320, 180], settings.clone()).unwrap();
        let check = |textures: &vastex::Textures, _| check_budgets(&textures.stats(), &settings);
        // Three times as fast as paths are, which is harder on budgets and takes a third of the frames.
        let frames = path.frames().div_ceil(3);
        let outcome =
            offscreen.run_along(frames, |frame| path.pose(scene, 2.0, 3 * frame), Until::Converged, check);
        let outcome = outcome.unwrap();
        assert!(outcome.converged, "{scene:?} {path:?}: {:?}", outcome.stats);
    }
}

#[test]
fn an_upload_budget_below_one_tile_converges_later() {
    let frames = |upload_bytes_per_frame| {
        let settings = Settings { upload_bytes_per_frame, ..pool(16) };
        let mut offscreen = Offscreen::new(gpu(), huge(), Scene::Image, [320, 180], settings).unwrap();
        let outcome = offscreen.run(Path::Still, Until::Converged, |_, _| ()).unwrap();
        assert!(outcome.converged, "{:?}", outcome.stats);
        outcome.stats.frame
    };
    let (fast, slow) = (frames(2 << 20), frames(20 << 10));
    assert!(slow > fast, "{slow} frames at 20 KiB a frame, {fast} at 2 MiB");
}

#[test]
fn a_broken_tile_leaves_its_ancestor_on_screen_and_is_named() {
    let broken = |pos: vastex::PagePos| pos.level == 4 && (pos.x + pos.y).is_multiple_of(3);
    let faulty = Faults::new(huge(), move |pos, _attempt| broken(pos).then_some(Injection::Fail));
    let mut offscreen = Offscreen::new(gpu(), Arc::new(faulty), Scene::Image, [640, 360], pool(16)).unwrap();
    let mut named = Vec::new();
    let outcome = offscreen.run(Path::Still, Until::Converged, |_, events| {
        named.extend(events.into_iter().filter_map(|event| match event {
            Event::Failed { page, why, .. } => Some((page, why)),
            _ => None,
        }));
    });
    let outcome = outcome.unwrap();
    assert!(outcome.converged, "{:?}", outcome.stats);
    let mut pages = offscreen.textures().inspect().failed_pages();
    pages.sort_unstable();
    assert!(!pages.is_empty() && pages.len() == outcome.stats.pager.failed as usize);
    assert!(named.iter().all(|(_, why)| why.contains("level 4")), "{named:?}");
    let mut reported: Vec<_> = named.into_iter().map(|(page, _)| page).collect();
    reported.sort_unstable();
    assert_eq!(reported, pages, "each is reported once");
    // Every pixel shows something: the property image's alpha is 255 - level, the background's 0.
    let share = offscreen.share_at_wanted_level().unwrap();
    assert!(share < 1.0, "the broken pages are not resident");
    let picture = offscreen.picture();
    let covered = picture.rgba.chunks_exact(4).filter(|pixel| pixel[3] != 0).count();
    assert_eq!(covered, 640 * 320, "a 2:1 image fills the width");
}

#[test]
fn the_same_run_gives_the_same_picture_and_the_same_counts() {
    let run = || {
        let mut offscreen = Offscreen::new(gpu(), huge(), Scene::Globe, [320, 180], pool(4)).unwrap();
        let outcome = offscreen.run(Path::Teleport, Until::Frames(100), |_, _| ()).unwrap();
        (offscreen.picture(), FrameStats { feedback_bytes_read: 0, ..outcome.stats })
    };
    assert_eq!(run(), run());
}

/// A source whose borders were cut off: black instead of the neighbours' texels.
struct BrokenBorders(Arc<dyn TileSource>);

impl TileSource for BrokenBorders {
    fn description(&self) -> &Arc<vastex::Description> {
        self.0.description()
    }

    fn read(&self, pos: vastex::PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            let tile = self.0.read(pos).await?;
            let description = self.description();
            let geometry = &description.geometry;
            if geometry.is_tail(pos) {
                return Ok(tile);
            }
            let damaged = |error: vastex::source::DecodeError| ReadError::Store {
                pos,
                place: String::new(),
                error: error.to_string(),
            };
            let mut texels = tile.decode(description).map_err(damaged)?.to_vec();
            let ([width, height, _], border) = (geometry.tile(), geometry.spec().border);
            for (index, texel) in texels.chunks_exact_mut(4).enumerate() {
                let (x, y) = (index as u32 % width, index as u32 / width);
                let inside = |at: u32, side: u32| (border..side - border).contains(&at);
                if !inside(x, width) || !inside(y, height) {
                    texel.fill(0);
                }
            }
            Ok(Tile { codec: vastex_tiles::Codec::Raw, bytes: texels.into() })
        })
    }
}

#[test]
fn a_broken_border_does_not_pass_the_comparison() {
    let (_directory, file) = Image::new(1000, 777, 128).build();
    let source = vastex::open(file).unwrap();
    let close_up = Pose::image(DVec2::splat(0.5), 6.0);
    for (filter, pose) in [
        (Filter::Trilinear, Pose::first(Scene::Image)),
        (Filter::KINDS[3], Pose::first(Scene::Plane)),
        (Filter::Bicubic, close_up),
    ] {
        let scene = if matches!(pose, Pose::Plane { .. }) { Scene::Plane } else { Scene::Image };
        for (broken, alike) in [(false, true), (true, false)] {
            let source: Arc<dyn TileSource> =
                if broken { Arc::new(BrokenBorders(source.clone())) } else { source.clone() };
            let mut offscreen =
                Offscreen::new(gpu(), source, scene, [320, 180], settings(16, filter)).unwrap();
            settle(&mut offscreen, pose);
            let (comparison, _) = offscreen.compare().unwrap();
            let passes = comparison.share_within_1_255 >= 0.999 && comparison.share_beyond_3_255 <= 1e-4;
            assert_eq!(passes, alike, "{filter}: {comparison:?}");
        }
    }
}

#[test]
fn an_open_window_may_change_its_size_in_any_frame() {
    let mut textures = vastex::Textures::new(&gpu().device, &gpu().queue, pool(4)).unwrap();
    textures.add_blocking(huge()).unwrap();
    for size in [[640, 360], [1, 1], [333, 777], [640, 360]] {
        for _ in 0..4 {
            let mut encoder = gpu().device.create_command_encoder(&Default::default());
            textures.feedback(&mut encoder, size, |_, _| ()).unwrap();
            textures.update().unwrap();
            gpu().queue.submit([encoder.finish()]);
        }
    }
    assert_eq!(textures.stats().frame, 16);
}

#[test]
fn who_watches_a_run_may_end_it() {
    let mut offscreen = Offscreen::new(gpu(), huge(), Scene::Plane, [64, 48], pool(4)).unwrap();
    let mut frames = 0;
    let outcome = offscreen.run(Path::Still, Until::Converged, |_, _| {
        frames += 1;
        if frames < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    assert_eq!((outcome.unwrap().converged, frames), (false, 3));
}
