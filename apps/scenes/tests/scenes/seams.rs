//! Seams that are not there: a plane that a texture tiles, a globe turned by half, with the date line in the
//! middle of the picture and running into the poles. The shader folds uv, so that it jumps, and the picture
//! and what is wanted are those of uv that goes on.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use glam::{BVec2, DVec3, Vec2};
use vastex::{AddressMode, Dims, Feedback, Filter, Region, TileSource};
use vastex_scenes::{DisplayOptions, Offscreen, Pose, Scene, Tiling};

use crate::common::{Image, gpu, settings};
use crate::filters::{SIZE, filters, texture};
use crate::pictures::assert_alike;

/// Along a tiled plane, and turned, so that the seams run in both directions; far off a pixel is a quarter of
/// a tile, since from half a tile on nobody knows which way round neighbours lie.
const PLANE: [Pose; 2] = [
    Pose::Plane { eye: DVec3::new(0.1, -0.9, 0.25), yaw: 0.0, pitch: 0.2 },
    Pose::Plane { eye: DVec3::new(0.5, -0.7, 0.2), yaw: 0.6, pitch: 0.3 },
];
/// The date line, upright and seen along, and both poles.
const GLOBE: [Pose; 4] = [
    Pose::globe(0.0, 0.2, 0.4),
    Pose::globe(0.9, -0.3, 0.2),
    Pose::globe(0.3, FRAC_PI_2 - 0.03, 0.15),
    Pose::globe(-0.2, 0.03 - FRAC_PI_2, 0.15),
];

/// A scene with a texture laid on it, all of it resident.
fn offscreen(source: &Arc<dyn TileSource>, scene: Scene, tiling: Tiling, filter: Filter) -> Offscreen {
    let shown = DisplayOptions { tiling, ..DisplayOptions::default() };
    let settings = settings(64, filter);
    let mut offscreen = Offscreen::showing(&shown, gpu(), source.clone(), scene, SIZE, settings).unwrap();
    let texture = texture(&offscreen);
    let ticket = offscreen.textures_mut().ahead().pin(texture, &Region::whole()).unwrap();
    while ticket.progress().resident < ticket.progress().pages {
        offscreen.frame(Pose::first(scene)).unwrap();
    }
    offscreen
}

/// By every filter the picture equals that of an ordinary texture at every pose.
fn check(image: &Image, scene: Scene, poses: &[Pose], tiling: Tiling) {
    let (_directory, file) = image.build();
    let source = vastex::open(file).unwrap();
    for filter in filters() {
        let mut offscreen = offscreen(&source, scene, tiling, filter);
        for &pose in poses {
            // Everything is there.
            offscreen.frame(pose).unwrap();
            assert_alike(&offscreen.compare().unwrap().0, &format!("{filter} {image:?} {tiling:?} {pose:?}"));
        }
    }
}

fn tiled(folded: BVec2) -> Tiling {
    Tiling { repeats: Vec2::new(3.0, 2.5), first: Vec2::new(-0.4, 0.3), folded }
}

fn turned(folded: BVec2) -> Tiling {
    Tiling { first: Vec2::new(0.5, 0.0), folded, ..Tiling::default() }
}

#[test]
fn a_tiled_plane_has_no_seams() {
    let image = Image { address: [AddressMode::Wrap; 2], ..Image::new(500, 333, 64) };
    check(&image, Scene::Plane, &PLANE, tiled(BVec2::TRUE));
}

#[test]
fn beyond_its_edges_a_plane_follows_every_address_mode() {
    use AddressMode::{Border, Clamp, Mirror, Wrap};
    for address in [[Mirror, Clamp], [Border, Mirror], [Clamp, Wrap]] {
        let image = Image { address, ..Image::new(500, 333, 64) };
        check(&image, Scene::Plane, &PLANE, tiled(BVec2::FALSE));
    }
}

#[test]
fn a_globe_turned_by_half_has_no_seam_and_no_poles() {
    let image = Image { address: [AddressMode::Wrap, AddressMode::Clamp], ..Image::new(700, 350, 64) };
    check(&image, Scene::Globe, &GLOBE, turned(BVec2::new(true, false)));
}

/// How many pixels want each level.
fn pixels_by_level(wanted: &Feedback) -> BTreeMap<u8, u64> {
    let mut pixels = BTreeMap::new();
    for page in &wanted.pages {
        *pixels.entry(page.page.pos(Dims::D2).level).or_default() += u64::from(page.pixels);
    }
    pixels
}

/// The jump itself, a whole turn within a pixel, would ask for the coarsest level along all of the seam, and
/// beside it neighbours that are taken for near ones for finer levels than any.
#[test]
fn a_seam_wants_no_levels_that_its_jump_would_ask_for() {
    // Over a crossing of seams, near enough for none but fine levels.
    let near = [Pose::Plane { eye: DVec3::new(-0.1, -0.4, 0.2), yaw: 0.0, pitch: 0.9 }];
    let image = Image { address: [AddressMode::Wrap; 2], ..Image::new(1024, 512, 32) };
    let (_directory, file) = image.build();
    let source = vastex::open(file).unwrap();
    for filter in [Filter::Trilinear, Filter::KINDS[3]] {
        for scene in [Scene::Plane, Scene::Globe] {
            let (poses, laid, folded): (&[Pose], fn(BVec2) -> Tiling, _) = match scene {
                Scene::Globe => (&GLOBE, turned, BVec2::new(true, false)),
                _ => (&near, tiled, BVec2::TRUE),
            };
            let [mut seamed, mut seamless] =
                [folded, BVec2::FALSE].map(|folded| offscreen(&source, scene, laid(folded), filter));
            for &pose in poses {
                let [found, expected] = [&mut seamed, &mut seamless]
                    .map(|offscreen| pixels_by_level(&offscreen.wanted_by_every_pixel(pose).unwrap()));
                let what = format!("{filter} {pose:?}: {found:?} with a seam, {expected:?} without");
                // Some may be missing at the limb, where a pixel is the only one of its level.
                assert!(found.keys().all(|level| expected.contains_key(level)), "{what}");
                // Differences between two pixels, here, are not quite the gradients at one of them, there.
                let moved: u64 = expected
                    .iter()
                    .map(|(level, &pixels)| pixels.abs_diff(found.get(level).copied().unwrap_or(0)))
                    .sum();
                assert!(100 * moved <= 4 * expected.values().sum::<u64>(), "{what}");
            }
        }
    }
}
