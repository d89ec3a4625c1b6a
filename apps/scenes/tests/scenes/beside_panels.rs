//! Scenes in a picture of which panels leave a part free: the camera looks at the middle of that part, which
//! shows what a picture of its own would show; around it there is more, and what is asked of a pixel is
//! answered as it is drawn.

use std::f64::consts::{PI, TAU};
use std::time::Duration;

use glam::{DVec2, DVec3};
use vastex::{Filter, Region, Settings, Urgency};
use vastex_scenes::{DisplayOptions, Offscreen, PlanetLight, PlanetOptions, Pose, Scene};
use vastex_viewer::PicturePart;
use vastex_viewer::camera::{Aim, Controller, GroundHeights, Move};
use vastex_viewer::inspect::texel_at;

use crate::common::{gpu, settings, settle};
use crate::values::{Ground, SIZE, look, seen_in, with_heights};

const PICTURE: [u32; 2] = [128, 80];

/// Beside a panel at the right, and between two, where it begins at an even pixel: shaders take differences
/// between the pixels of a square of four, which then are the same four as in a picture of its own.
fn free_parts() -> [PicturePart; 2] {
    let part = |low: [f64; 2], high: [f64; 2]| PicturePart::around(PICTURE, [low.into(), high.into()]);
    [part([0.0, 0.0], [96.0, 80.0]), part([36.0, 6.0], [96.0, 78.0])]
}

fn offscreen(scene: Scene, options: &DisplayOptions, size: [u32; 2]) -> Offscreen {
    let settings = Settings { fade: Duration::ZERO, ..settings(32, Filter::Trilinear) };
    Offscreen::showing(options, gpu(), Ground::new(), scene, size, settings).unwrap()
}

fn load_all(offscreen: &mut Offscreen) {
    let texture = offscreen.renderer().layer().texture();
    let textures = offscreen.textures_mut();
    let ticket = textures.ahead().prefetch(texture, &Region::whole(), Urgency::default()).unwrap();
    textures.finish(&ticket, Duration::from_secs(60)).unwrap();
}

/// The middle of what is free, in pixels.
fn middle(view: &PicturePart) -> DVec2 {
    let at = DVec2::new(view.at[0] as f64, view.at[1] as f64);
    0.5 * DVec2::from(view.whole.map(f64::from)) - at
}

/// Ground without heights, of which another arithmetic than the viewer's says what is seen where.
#[test]
fn the_camera_looks_at_the_middle_of_what_is_free_and_texels_lie_where_they_are_told() {
    let still = PlanetLight { exaggeration: 0.0, ..PlanetLight::default() };
    let still = PlanetOptions { light: still, ..PlanetOptions::default() };
    let still = DisplayOptions { planet: still, ..DisplayOptions::default() };
    let globe = Pose::globe(0.4, 0.3, 0.9);
    let plane = Pose::Plane { eye: DVec3::new(0.2, -0.5, 0.3), yaw: 0.2, pitch: 0.7 };
    let ahead = DVec3::new(-0.2_f64.sin() * 0.7_f64.cos(), 0.2_f64.cos() * 0.7_f64.cos(), -0.7_f64.sin());
    let (below, on_plane) =
        (DVec2::new(0.4 / TAU + 0.5, 0.5 - 0.3 / PI), DVec3::new(0.2, -0.5, 0.3) - ahead * 0.3 / ahead.z);
    let on_plane = DVec2::new(0.5 + 0.5 * on_plane.x, 0.5 - on_plane.y);
    for (scene, options, pose, aimed) in [
        (Scene::Globe, DisplayOptions::default(), globe, below),
        (Scene::Planet, still, globe, below),
        (Scene::Plane, DisplayOptions::default(), plane, on_plane),
        (Scene::Terrain, with_heights(0.0), plane, on_plane),
    ] {
        let mut drawn = offscreen(scene, &options, PICTURE);
        load_all(&mut drawn);
        for view in free_parts() {
            drawn.set_view(Some(view));
            let (textures, renderer) = (drawn.textures(), drawn.renderer());
            let mut sight = renderer.sight(textures, &pose, (PICTURE, SIZE));
            let asked = (renderer, renderer.layer());
            let at = sight.at(middle(&view)).unwrap();
            let off = at.texel.distance(aimed * DVec2::from(SIZE.map(f64::from))) / at.texels_a_pixel;
            assert!(off < 0.01, "{scene:?} {view:?}: {off} pixels beside what is aimed at");
            let corner = DVec2::new(view.at[0] as f64, view.at[1] as f64);
            let mut count = 0;
            for (y, x) in (0..SIZE[1]).step_by(5).flat_map(|y| (0..SIZE[0]).step_by(7).map(move |x| (y, x))) {
                let place = DVec2::new(x.into(), y.into()) + 0.5;
                // In a picture of the free part alone.
                let Some((pixel, _)) = seen_in(view.whole, &pose, scene, place) else { continue };
                let found = sight.at(pixel - corner).unwrap();
                // Where meridians are near, a pixel has more columns than rows.
                let off = (found.texel - place) / found.texels_a_pixel;
                let across = if scene.is_round() { (place.y / 512.0 * PI).sin() } else { 1.0 };
                let off = off * DVec2::new(across, 1.0);
                assert!(off.length() < 0.01, "{scene:?} {view:?}: {off} pixels beside {place}");
                let texel = texel_at(textures, asked, &pose, (PICTURE, SIZE), pixel - corner).unwrap();
                assert_eq!(texel.texel, [x, y], "{scene:?} {view:?}");
                count += 1;
            }
            assert!(count > 50, "{scene:?} {view:?}: {count} texels are seen");
            // What is below the pointer stays there.
            let pixel = middle(&view) + DVec2::new(-21.0, 13.0);
            let held = sight.at(pixel).unwrap().texel;
            let aspects = [1.6, renderer.image_aspect()];
            let mut camera = Controller::new(pose);
            for moved in [Move::ZoomTo(1.4, view.point(pixel)), Move::ZoomTo(0.6, view.point(pixel))] {
                let mut heights = renderer.heights(textures, PICTURE);
                let heights = heights.as_mut().map(|heights| heights as &mut dyn GroundHeights);
                camera.apply_over(moved, aspects, heights);
                let there = renderer.sight(textures, &camera.pose(), (PICTURE, SIZE)).at(pixel).unwrap();
                let off = there.texel.distance(held) / there.texels_a_pixel;
                assert!(off < 0.05, "{scene:?} {view:?} {moved:?}: {off} pixels");
            }
        }
    }
}

#[test]
fn what_is_free_shows_what_a_picture_of_its_own_would_show() {
    let globe = Pose::globe(PI - 0.1, 0.3, 0.5).with_aim(Aim::new(1.0, 0.7));
    let plane = Pose::Plane { eye: DVec3::new(0.1, -0.5, 0.16), yaw: 0.2, pitch: 0.35 };
    let near = Pose::globe(0.1, -0.5, 0.004).with_aim(Aim::new(5.0, 1.2));
    let fixed = DisplayOptions { always_fixed: true, ..DisplayOptions::default() };
    for (scene, options, pose) in [
        (Scene::Globe, DisplayOptions::default(), globe),
        (Scene::Globe, fixed, near),
        (Scene::Globe, with_heights(0.08), globe),
        (Scene::Plane, DisplayOptions::default(), plane),
        (Scene::Terrain, with_heights(0.06), plane),
        (Scene::Terrain, DisplayOptions { always_fixed: true, ..with_heights(0.06) }, plane),
        (Scene::Planet, with_heights(0.03), globe),
    ] {
        let view = free_parts()[1];
        // What it shows, feedback alone has found; but the ground below the camera, which says how high that
        // is, may be in no view.
        let mut whole = offscreen(scene, &options, PICTURE);
        whole.set_view(Some(view));
        if whole.renderer().has_relief() {
            load_all(&mut whole);
        }
        settle(&mut whole, pose);
        // Corners of pages that one pixel in four misses.
        whole.load_for_every_pixel().unwrap();
        settle(&mut whole, pose);
        let mut alone = offscreen(scene, &options, view.whole);
        load_all(&mut alone);
        look(&mut alone, pose);
        let (all, of_part) = (whole.picture(), alone.picture());
        let (width, mut covered, mut other, mut worst) = (view.whole[0] as usize, 0, 0, 0);
        let [left, top] = view.at.map(|at| -at as usize);
        for (n, expected) in of_part.rgba.chunks_exact(4).enumerate() {
            let at = (top + n / width) * PICTURE[0] as usize + left + n % width;
            let found = &all.rgba[at * 4..][..4];
            let off = found.iter().zip(expected).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
            covered += usize::from(expected[3] != 0);
            other += usize::from(off > 8);
            worst = worst.max(off);
        }
        let what = format!("{scene:?} {pose:?}: {other} of {covered} pixels differ, by {worst} at most");
        // Edges of hills lie in another pixel by rounding.
        assert!(covered > 1000 && other * 100 <= covered, "{what}");
        // And beside it there is more.
        let beside = all.rgba.chunks_exact(4).filter(|pixel| pixel[3] != 0).count();
        assert!(beside > covered + covered / 10, "{what}: {beside} in all");
        // Pixels are asked of both alike.
        let [mut of_whole, mut of_alone] = [(&whole, PICTURE), (&alone, view.whole)]
            .map(|(drawn, size)| drawn.renderer().sight(drawn.textures(), &pose, (size, SIZE)));
        for pixel in [[3.5, 40.5], [30.5, 51.5], [55.5, 30.25]].map(DVec2::from) {
            let corner = DVec2::new(left as f64, top as f64);
            let (found, expected) = (of_whole.at(pixel + corner), of_alone.at(pixel));
            let off = found.zip(expected).map(|(found, expected)| {
                found.texel.distance(expected.texel) + (found.texels_a_pixel - expected.texels_a_pixel).abs()
            });
            assert!(off.is_none_or(|off| off < 1e-3), "{what}: {off:?} at {pixel}");
            assert_eq!(found.is_some(), expected.is_some(), "{what}: at {pixel}");
        }
    }
}

/// An image's camera is moved instead.
#[test]
fn an_image_is_drawn_as_ever() {
    let pose = Pose::image(DVec2::new(0.4, 0.6), 3.0);
    let mut drawn = offscreen(Scene::Image, &DisplayOptions::default(), PICTURE);
    settle(&mut drawn, pose);
    let before = drawn.picture();
    drawn.set_view(Some(free_parts()[1]));
    settle(&mut drawn, pose);
    assert!(drawn.picture() == before);
    assert_eq!(drawn.renderer().view_in(PICTURE), PicturePart::all(PICTURE));
}
