//! Looking ahead of a moving camera: what it gains at equal bandwidth, drawn by the GPU, and that it costs
//! the view nothing.

use std::sync::Arc;

use crate::common::{gpu, settings};
use vastex::{AddressMode, Filter, Geometry, GeometrySpec, Pace, Settings, TileSource};
use vastex_scenes::{Offscreen, Path, Scene, Until};
use vastex_tiles::PropertySource;

fn huge() -> Arc<dyn TileSource> {
    let spec = GeometrySpec { address: [AddressMode::Clamp; 3], ..GeometrySpec::image(32768, 16384) };
    Arc::new(PropertySource::new(Geometry::new(spec).unwrap()))
}

/// Frames for which pages in view were missing, summed over them, and tiles loaded, over a path.
fn waited(scene: Scene, path: Path, upload_bytes_per_frame: u64, ahead: bool) -> (u64, u64) {
    let settings = Settings {
        upload_bytes_per_frame,
        pace: Pace::LockStep { latency_frames: 4 },
        ..settings(64, Filter::Trilinear)
    };
    let mut offscreen = Offscreen::new(gpu(), huge(), scene, [320, 180], settings).unwrap();
    offscreen.look_ahead(ahead);
    let mut waited = 0;
    let note = |textures: &vastex::Textures, _| waited += u64::from(textures.stats().pager.missing);
    let outcome = offscreen.run(path, Until::Frames(path.frames().min(200)), note).unwrap();
    (waited, outcome.stats.pager.loaded)
}

#[test]
fn on_fly_and_spin_pages_wait_a_third_less_at_equal_bandwidth() {
    for path in [Path::Fly, Path::Spin] {
        let [(without, loads), (with, more)] =
            [false, true].map(|ahead| waited(Scene::Plane, path, 2 << 20, ahead));
        println!("{path:?}: {without} page-frames without, {with} with; {loads} and {more} loads");
        assert!(without > 100 && with * 3 <= without * 2, "{path:?}: {without} page-frames, and {with}");
        assert!(more * 10 <= loads * 12, "{path:?}: {loads} loads, and {more}");
    }
}

#[test]
fn where_bandwidth_is_short_the_view_loses_nothing() {
    // About a tile in every second frame.
    let [(without, _), (with, _)] = [false, true].map(|ahead| waited(Scene::Plane, Path::Fly, 40_000, ahead));
    println!("{without} page-frames without, {with} with");
    assert!(with * 100 <= without * 102, "{without} page-frames, and {with}");
}
