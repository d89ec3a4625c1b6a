//! The image and the globe of any size: every pixel sees the place of the texture that f64 says, to a
//! hundredth of a pixel, from the whole to 64 pixels a texel, and the picture has the colours that lie there.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use vastex::source::{PlanetImage, PlanetSource};
use vastex::{Filter, TileSource};
use vastex_scenes::{DisplayOptions, Offscreen, Pose, Scene};
use vastex_viewer::camera::{Aim, Controller, Move, Orientation};

use crate::common::{gpu, settings};

const SIZE: [u32; 2] = [160, 90];
const TANGENT: f64 = 0.577_350_269_189_625_8;

fn planet(bits: u32) -> Arc<PlanetSource> {
    let texel = |n: u32| match (n % 64 / 7 + n / 64 / 5) % 3 {
        0 => [24, 48, 110, 255],
        1 => [150, 130, 80, 255],
        _ => [70, 110, 50, 255],
    };
    let image = PlanetImage { size: [64, 32], texels: (0..64 * 32).map(texel).collect() };
    Arc::new(PlanetSource::new(image, bits).unwrap())
}

fn scene(bits: u32, scene: Scene, filter: Filter) -> Offscreen {
    let shown = DisplayOptions { always_fixed: true, ..DisplayOptions::default() };
    Offscreen::showing(&shown, gpu(), planet(bits), scene, SIZE, settings(24, filter)).unwrap()
}

/// From all of it to 64 pixels a texel, by this factor.
fn magnifications(texels: f64) -> Vec<f64> {
    let whole = f64::from(SIZE[0]) / texels;
    let steps = ((64.0 / whole).log2() / 3.0).ceil();
    (0..=steps as i32).map(|n| whole * (64.0 / whole).powf(f64::from(n) / steps)).collect()
}

fn pixels() -> impl Iterator<Item = DVec2> {
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| DVec2::new(x.into(), y.into()) + 0.5))
}

/// By how many pixels texels stand beside their places in the picture of an image, at most.
fn error_on_image(offscreen: &Offscreen, pose: &Pose, texels: DVec2) -> f64 {
    let Pose::Image { centre, zoom, orientation } = *pose else { panic!("{pose:?}") };
    let (sine, cosine) = orientation.degrees().to_radians().sin_cos();
    // What the image takes when it is turned.
    let across = cosine.abs() * texels.x + sine.abs() * texels.y;
    let down = sine.abs() * texels.x + cosine.abs() * texels.y;
    let magnification = zoom * (f64::from(SIZE[0]) / across).min(f64::from(SIZE[1]) / down);
    // A step in the picture, y downwards, turned back and mirrored back.
    let in_image = |step: DVec2| {
        let turned_back = DVec2::new(cosine * step.x + sine * step.y, cosine * step.y - sine * step.x);
        if orientation.is_mirrored() { turned_back * DVec2::new(-1.0, 1.0) } else { turned_back }
    };
    let middle = DVec2::new(SIZE[0].into(), SIZE[1].into()) / 2.0;
    let mut worst = 0f64;
    for (at, place) in pixels().zip(offscreen.places(pose)) {
        let expected = centre * texels + in_image(at - middle) / magnification;
        let beside = expected.min(texels - expected).min_element() * magnification;
        assert!(beside.abs() < 0.01 || place.is_some() == (beside > 0.0), "{pose:?}: {at} sees {place:?}");
        if let Some(place) = place {
            worst = worst.max((place - expected).length() * magnification);
        }
    }
    worst
}

#[test]
fn texels_of_an_image_stand_where_they_should() {
    for bits in [12, 20, 31] {
        let texels = DVec2::new(2f64.powi(bits), 2f64.powi(bits - 1));
        let offscreen = scene(bits as u32, Scene::Image, Filter::Nearest);
        let fit = (f64::from(SIZE[0]) / texels.x).min(f64::from(SIZE[1]) / texels.y);
        for magnification in magnifications(texels.x) {
            for centre in
                [DVec2::new(0.5, 0.5), DVec2::new(0.987_654_321, 0.123_456_789), DVec2::ONE, DVec2::ZERO]
            {
                let pose = Pose::image(centre, magnification / fit);
                let error = error_on_image(&offscreen, &pose, texels);
                assert!(error < 0.01, "2^{bits} at {magnification} pixels a texel, {centre}: {error}");
            }
        }
    }
}

#[test]
fn texels_of_an_image_stand_where_they_should_however_it_is_turned() {
    let orientations = [(90.0, false), (180.0, true), (270.0, true), (33.0, false), (123.456, true)];
    for (bits, always_fixed, most) in [(12, true, 0.01), (31, true, 0.01), (12, false, 0.02)] {
        let texels = DVec2::new(2f64.powi(bits), 2f64.powi(bits - 1));
        let shown = DisplayOptions { always_fixed, ..DisplayOptions::default() };
        let settings = settings(24, Filter::Nearest);
        let source = planet(bits as u32);
        let offscreen = Offscreen::showing(&shown, gpu(), source, Scene::Image, SIZE, settings).unwrap();
        for (degrees, is_mirrored) in orientations {
            let orientation = Orientation::new(degrees, is_mirrored);
            for (centre, zoom) in [(DVec2::splat(0.5), 1.0), (DVec2::new(0.987_654, 0.123_456), 9.0)] {
                let pose = Pose::Image { centre, zoom, orientation };
                assert_eq!(offscreen.is_in_fixed_point(&pose), always_fixed);
                let error = error_on_image(&offscreen, &pose, texels);
                assert!(error < most, "2^{bits}, {pose:?}: {error}");
                // What is told of a pixel on the CPU is what is drawn there.
                let placed = pose.placement(SIZE, [texels.x as u32, texels.y as u32]).unwrap();
                let told = pixels().zip(offscreen.places(&pose)).filter_map(|(at, place)| Some((at, place?)));
                let apart = told.map(|(at, place)| (placed.texel(at) - place).length() * placed.scale);
                assert!(apart.fold(0.0, f64::max) < most, "2^{bits}, {pose:?}");
            }
        }
    }
}

/// Where a place of the globe is in the picture, in pixels, and the cosine between the ray there and straight
/// down at the place.
fn on_screen(pose: &Pose, longitude: f64, latitude: f64) -> (DVec2, f64) {
    let Pose::Globe { longitude: lon, latitude: lat, altitude, aim } = *pose else { panic!("{pose:?}") };
    // East, north and up from the ground below the camera, by half angles so that of small ones nothing is
    // lost.
    let east = (longitude - lon + PI).rem_euclid(TAU) - PI;
    let versed = 2.0 * (east / 2.0).sin().powi(2);
    let (half_sum, half) = ((latitude + lat) / 2.0, (latitude - lat) / 2.0);
    let chord = DVec2::new(-2.0 * half_sum.sin() * half.sin(), 2.0 * half_sum.cos() * half.sin()); // of cosine and sine
    let point = DVec3::new(
        latitude.cos() * east.sin(),
        chord.y * lat.cos() - chord.x * lat.sin() + latitude.cos() * versed * lat.sin(),
        chord.x * lat.cos() + chord.y * lat.sin() - latitude.cos() * versed * lat.cos(),
    );
    let ray = point - DVec3::Z * altitude;
    let (along, (sine, cosine)) =
        (DVec2::from_angle(FRAC_PI_2 - aim.heading()).extend(0.0), aim.tilt().sin_cos());
    let (above, ahead) = (along * cosine + DVec3::Z * sine, along * sine - DVec3::Z * cosine);
    let seen = DVec2::new(ray.dot(ahead.cross(above)), ray.dot(above)) / ray.dot(ahead) / TANGENT;
    let [width, height] = SIZE.map(f64::from);
    let at = DVec2::new(width / 2.0 + seen.x * height / 2.0, height / 2.0 - seen.y * height / 2.0);
    (at, -ray.normalize().dot(point + DVec3::Z))
}

/// By how many pixels texels stand beside their places in the picture of a globe, at most.
fn error_on_globe(offscreen: &Offscreen, pose: &Pose, texels: DVec2) -> f64 {
    let Pose::Globe { altitude, .. } = *pose else { panic!("{pose:?}") };
    let [width, height] = SIZE.map(f64::from);
    let limb = 1.0 / (altitude * (2.0 + altitude)).sqrt() / TANGENT * height / 2.0;
    let (mut worst, mut seen) = (0f64, 0);
    for (at, place) in pixels().zip(offscreen.places(pose)) {
        let from_middle = (at - DVec2::new(width, height) / 2.0).length();
        if (from_middle - limb).abs() < 0.5 {
            continue; // the limb, where a texel is as long as one likes
        }
        assert_eq!(place.is_some(), from_middle < limb, "{pose:?}: {at}");
        if let Some(place) = place {
            let (longitude, latitude) = ((place.x / texels.x - 0.5) * TAU, (0.5 - place.y / texels.y) * PI);
            worst = worst.max((on_screen(pose, longitude, latitude).0 - at).length());
            seen += 1;
        }
    }
    assert!(seen > 1000, "{pose:?}: {seen}");
    worst
}

#[test]
fn texels_of_a_globe_stand_where_they_should() {
    for bits in [12, 20, 31] {
        let texels = DVec2::new(2f64.powi(bits), 2f64.powi(bits - 1));
        let offscreen = scene(bits as u32, Scene::Globe, Filter::Nearest);
        for magnification in magnifications(texels.x) {
            let altitude = f64::from(SIZE[1]) / (2.0 * TANGENT * magnification * texels.x / TAU);
            for (longitude, latitude) in
                [(0.3, 0.7), (PI - 1e-9, -0.2), (-PI, 1.2), (1.0, FRAC_PI_2 - 1e-9), (2.0, 1e-3 - FRAC_PI_2)]
            {
                let pose = Pose::globe(longitude, latitude, altitude);
                let error = error_on_globe(&offscreen, &pose, texels);
                assert!(error < 0.01, "2^{bits} at {magnification} pixels a texel, {pose:?}: {error}");
            }
        }
    }
}

#[test]
fn texels_of_a_globe_stand_where_they_should_when_the_camera_looks_aslant() {
    for bits in [12, 31] {
        let texels = DVec2::new(2f64.powi(bits), 2f64.powi(bits - 1));
        let offscreen = scene(bits as u32, Scene::Globe, Filter::Nearest);
        for magnification in magnifications(texels.x).into_iter().step_by(3) {
            let altitude = f64::from(SIZE[1]) / (2.0 * TANGENT * magnification * texels.x / TAU);
            if altitude > 0.1 {
                continue; // the camera looks past the globe
            }
            for (longitude, latitude, aim) in [
                (0.3, 0.7, Aim::new(0.7, 0.3)),
                (PI - 1e-9, -0.2, Aim::new(4.0, 0.9)),
                (1.0, FRAC_PI_2 - 1e-9, Aim::new(2.5, 1.2)),
            ] {
                let pose = Pose::Globe { longitude, latitude, altitude, aim };
                let (mut worst, mut seen) = (0f64, 0);
                for (pixel, place) in pixels().zip(offscreen.places(&pose)) {
                    let Some(place) = place else { continue };
                    let east = (place.x / texels.x - 0.5) * TAU;
                    let (at, steepness) = on_screen(&pose, east, (0.5 - place.y / texels.y) * PI);
                    // At the limb a texel is as long as one likes.
                    if steepness > 0.02 {
                        worst = worst.max((at - pixel).length());
                        seen += 1;
                    }
                }
                assert!(seen > 1000, "{pose:?}: {seen}");
                assert!(worst < 0.01, "2^{bits} at {magnification} pixels a texel, {pose:?}: {worst}");
            }
        }
    }
}

#[test]
fn ten_thousand_small_pans_end_where_their_sum_says() {
    let texels = DVec2::new(2f64.powi(31), 2f64.powi(30));
    let view = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let offscreen = scene(31, Scene::Image, Filter::Nearest);
    let fit = f64::from(SIZE[0]) / texels.x;
    let (first, pan) = (DVec2::new(0.6, 0.3), DVec2::new(0.013, -0.007));
    let mut pose = Pose::image(first, 64.0 / fit);
    let mut camera = Controller::new(pose);
    (0..10_000).for_each(|_| camera.apply(Move::Drag(pan), [view, 2.0]));
    pose = camera.pose();
    let Pose::Image { centre, .. } = pose else { panic!("{pose:?}") };
    let moved = pan * 10_000.0 * f64::from(SIZE[1]) / 64.0; // texels
    let error = (first * texels - moved - centre * texels).length() * 64.0;
    assert!(error < 0.01, "the camera is {error} pixels beside its place");
    assert!(error_on_image(&offscreen, &pose, texels) < 0.01);

    let offscreen = scene(31, Scene::Globe, Filter::Nearest);
    let altitude = f64::from(SIZE[1]) / (2.0 * TANGENT * 64.0 * texels.x / TAU);
    let mut pose = Pose::globe(PI - 1e-8, 0.0, altitude);
    let mut camera = Controller::new(pose);
    (0..10_000).for_each(|_| camera.apply(Move::Drag(DVec2::new(-pan.x, 0.0)), [view, 2.0]));
    pose = camera.pose();
    let Pose::Globe { longitude, .. } = pose else { panic!("{pose:?}") };
    let moved = pan.x * 10_000.0 * altitude * 2.0 * TANGENT;
    let error = (PI - 1e-8 + moved - longitude).abs() / TAU * texels.x * 64.0;
    assert!(error < 0.01, "the camera is {error} pixels beside its place");
    assert!(error_on_globe(&offscreen, &pose, texels) < 0.01);
}

/// Pixels in the middle of texels that are seen large have the colours of those texels, and everything that
/// is wanted comes.
#[test]
fn pictures_have_the_colours_of_their_places() {
    let source = planet(31);
    let texels = DVec2::new(2f64.powi(31), 2f64.powi(30));
    let altitude = |magnification: f64| f64::from(SIZE[1]) / (2.0 * TANGENT * magnification * texels.x / TAU);
    let fit = f64::from(SIZE[0]) / texels.x;
    let (image, globe) = (Scene::Image, Scene::Globe);
    for (what, pose) in [
        (image, Pose::image(DVec2::new(0.123_456, 0.654_321), 20.0 / fit)),
        (globe, Pose::globe(0.4, 0.3, altitude(16.0))),
        (globe, Pose::globe(PI, -0.3, altitude(16.0))),
    ] {
        let mut offscreen = scene(31, what, Filter::Nearest);
        crate::common::settle(&mut offscreen, pose);
        let picture = offscreen.picture();
        let (mut all, mut alike) = (0, 0);
        for (pixel, place) in picture.rgba.chunks_exact(4).zip(offscreen.places(&pose)) {
            let place = place.unwrap();
            let texel = place.floor();
            let x = texel.x.rem_euclid(texels.x) as u32;
            let expected = source.colors(0, &[x], &[texel.y as u32])[0];
            if (place - texel - 0.5).abs().max_element() < 0.4 {
                all += 1;
                alike += u32::from((0..3).all(|c| pixel[c].abs_diff(expected[c]) <= 1));
            }
        }
        assert!(all > 3000 && alike == all, "{pose:?}: {alike} of {all}");
        assert!(
            offscreen
                .textures()
                .texture(offscreen.textures().inspect().textures().next().unwrap())
                .unwrap()
                .description()
                .geometry
                .size()[0]
                == 1 << 31
        );
    }
    assert!(source.description().geometry.coarsest() > 20);
}
