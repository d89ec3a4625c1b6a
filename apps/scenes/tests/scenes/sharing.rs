//! Pages of the same content share a slot: the picture is that of an ordinary texture, in a pool far smaller
//! than it has pages.

use std::path::PathBuf;

use crate::common::{gpu, settings};
use crate::pictures::assert_alike;
use vastex::diagnostics::FrameStats;
use vastex::{Filter, PoolSettings, Settings};
use vastex_build::BuildOptions;
use vastex_scenes::{Comparison, Offscreen, Path, Scene, Until};

const SIZE: [u32; 2] = [4096, 2048];
const PAGE: u32 = 32;
/// Of one layer of 8 bits, with a border of 4.
const TILE_BYTES: u64 = 40 * 40;
/// Of a pool; the texture has over ten thousand pages.
const SLOTS: u64 = 300;

/// An island of grain in a sea of one colour, and a black frame with a pattern that repeats from page to
/// page.
fn texel(x: u32, y: u32) -> u8 {
    let from_middle = (i64::from(x) - 2048).pow(2) + (i64::from(y) - 1024).pow(2);
    match from_middle {
        0..40_000 => (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca6b))
            .wrapping_mul(0xc2b2_ae35)
            .to_be_bytes()[0],
        40_000..700_000 => 60,
        _ if (x / PAGE + y / PAGE).is_multiple_of(2) => (x % PAGE * 3 + y % PAGE * 4) as u8,
        _ => (x % PAGE * 3 + y % PAGE * 4 + 20) as u8,
    }
}

fn build() -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let (input, output) = (directory.path().join("in.png"), directory.path().join("out.vastex"));
    let [width, height] = SIZE;
    let file = std::io::BufWriter::new(std::fs::File::create(&input).unwrap());
    let mut encoder = png::Encoder::new(file, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    let texels: Vec<u8> = (0..height).flat_map(|y| (0..width).map(move |x| texel(x, y))).collect();
    encoder.write_header().unwrap().write_image_data(&texels).unwrap();
    let options = BuildOptions { page: PAGE, threads: 1, ..BuildOptions::default() };
    vastex_build::build(&[input], &output, &options, &()).unwrap();
    (directory, output)
}

/// The picture of the whole image, so that levels 2 and 3 are seen, or where a path ends.
fn shown(
    file: &std::path::Path,
    scene: Scene,
    path: Path,
    slots: u64,
    share_contents: bool,
) -> (Offscreen, FrameStats) {
    let pools = PoolSettings::of_bytes(slots * TILE_BYTES);
    let settings = Settings { pools, share_contents, ..settings(1, Filter::Trilinear) };
    let mut offscreen =
        Offscreen::new(gpu(), vastex::open(file).unwrap(), scene, [640, 360], settings).unwrap();
    let outcome = offscreen.run(path, Until::Converged, |_, _| ()).unwrap();
    assert!(outcome.converged, "{scene:?} {path:?}: {:?}", outcome.stats);
    (offscreen, outcome.stats)
}

#[test]
fn a_pool_far_smaller_than_the_texture_shows_what_an_ordinary_texture_does() {
    let (_directory, file) = build();
    for (scene, path) in [Scene::Image, Scene::Globe, Scene::Plane].map(|scene| (scene, Path::Still)) {
        let (mut offscreen, stats) = shown(&file, scene, path, SLOTS, true);
        let what = format!("{scene:?} {path:?}");
        assert_eq!((stats.pager.bias_eighths, stats.pager.reloaded), (0, 0), "{what}: {stats:?}");
        assert!(u64::from(stats.pager.occupied) <= SLOTS && stats.pager.shared > 0, "{what}: {stats:?}");
        assert!(offscreen.share_at_wanted_level().unwrap() > 0.999, "{what}");
        assert_alike(&offscreen.compare().unwrap().0, &what);
        // Alone, each page takes a load and a slot.
        let (mut alone, without) = shown(&file, scene, path, 4000, false);
        assert!(alone.share_at_wanted_level().unwrap() > 0.999, "{what}");
        assert!(
            Comparison::of(&offscreen.picture(), &alone.picture()).max_error <= 1,
            "{what}: weights round otherwise in other slots"
        );
        assert_eq!((without.pager.shared, without.pager.resident), (0, without.pager.occupied), "{what}");
        assert!(without.pager.loaded > stats.pager.loaded, "{what}: {without:?} {stats:?}");
    }
}
