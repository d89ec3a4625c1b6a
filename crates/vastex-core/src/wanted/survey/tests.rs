//! Surveys against what every pixel wants: nothing is missing, and not too much is there.

use std::f64::consts::{FRAC_PI_3, PI, TAU};

use proptest::prelude::*;
use rustc_hash::FxHashMap;

use super::*;
use crate::texture::geometry::GeometrySpec;
use crate::wanted::vector::{cross, dot, length, sub_scaled};

const PICTURE: [u32; 2] = [320, 180];

/// A camera at `eye` that looks at `target`, z up, with a vertical field of view of 60 degrees.
fn look_at(eye: [f64; 3], target: [f64; 3]) -> Camera {
    let unit = |a: [f64; 3]| a.map(|n| n / length(a));
    let forward = unit(sub_scaled(target, 1.0, eye));
    let right = unit(cross(forward, [0.0, 0.0, 1.0]));
    let up = cross(right, forward);
    let focal = 1.0 / (FRAC_PI_3 / 2.0).tan();
    let aspect = f64::from(PICTURE[0]) / f64::from(PICTURE[1]);
    let row = |axis: [f64; 3], scale: f64, offset: f64| {
        [axis[0] * scale, axis[1] * scale, axis[2] * scale, offset - scale * dot(axis, eye)]
    };
    let rows = [
        row(right, focal / aspect, 0.0),
        row(up, focal, 0.0),
        row(forward, 1.0, -1e-3),
        row(forward, 1.0, 0.0),
    ];
    Camera::new(std::array::from_fn(|column| rows.map(|row| row[column] as f32)), PICTURE)
}

/// The ray through a point of the picture.
fn ray(camera: &Camera, at: [f64; 2]) -> [f64; 3] {
    camera.ray_through([0, 1].map(|axis| at[axis] / f64::from(PICTURE[axis])))
}

type Hit = fn([f64; 3], [f64; 3]) -> Option<[f64; 2]>;

/// A plane of 2 by 1 at z = 0 around the origin.
fn hit_plane(eye: [f64; 3], ray: [f64; 3]) -> Option<[f64; 2]> {
    let steps = -eye[2] / ray[2];
    let at = sub_scaled(eye, -steps, ray);
    let uv = [(at[0] + 1.0) / 2.0, 0.5 - at[1]];
    (steps > 0.0 && uv.iter().all(|uv| (0.0..1.0).contains(uv))).then_some(uv)
}

/// The unit sphere.
fn hit_globe(eye: [f64; 3], ray: [f64; 3]) -> Option<[f64; 2]> {
    let ray = ray.map(|n| n / length(ray));
    let closest = -dot(eye, ray);
    let depth_squared = closest * closest - dot(eye, eye) + 1.0;
    if depth_squared < 0.0 || closest < 0.0 {
        return None;
    }
    let at = sub_scaled(eye, -(closest - depth_squared.sqrt()), ray);
    Some([at[1].atan2(at[0]) / TAU + 0.5, 0.5 - at[2].clamp(-1.0, 1.0).asin() / PI])
}

/// Each page that a pixel wants, by gradients taken over a hundredth of a pixel, and the sharpest level.
fn wanted_by_pixels(camera: &Camera, geometry: &Geometry, hit: Hit) -> FxHashMap<PagePos, f64> {
    let (eye, mut wanted) = (camera.eye().unwrap(), FxHashMap::default());
    let size = [0, 1].map(|axis| f64::from(geometry.size()[axis]));
    for (y, x) in (0..PICTURE[1]).flat_map(|y| (0..PICTURE[0]).map(move |x| (y, x))) {
        let at = [f64::from(x) + 0.5, f64::from(y) + 0.5];
        let place = |dx: f64, dy: f64| hit(eye, ray(camera, [at[0] + dx, at[1] + dy]));
        let (Some(here), Some(right), Some(below)) = (place(0.0, 0.0), place(0.01, 0.0), place(0.0, 0.01))
        else {
            continue;
        };
        let texels = |there: [f64; 2]| {
            let d = [0, 1].map(|a| (there[a] - here[a]) * 100.0 * size[a]);
            d[0].hypot(d[1])
        };
        if (right[0] - here[0]).abs() > 0.5 || (below[0] - here[0]).abs() > 0.5 {
            continue; // across the date line
        }
        let lambda = texels(right).max(texels(below)).log2().clamp(0.0, f64::from(geometry.coarsest()));
        let level = lambda as u8;
        let finest = PagePos::new_2d(
            0,
            (here[0] * size[0]) as u32 / geometry.page()[0],
            (here[1] * size[1]) as u32 / geometry.page()[1],
        );
        let sharpest = wanted.entry(geometry.ancestor(finest, level)).or_insert(lambda);
        *sharpest = lambda.min(*sharpest);
    }
    wanted
}

fn geometry() -> Geometry {
    Geometry::new(GeometrySpec::image(16384, 8192)).unwrap()
}

fn texture() -> TextureNumber {
    TextureNumber::new(5).unwrap()
}

fn survey(camera: Camera, geometry: &Geometry, surface: &dyn Surface, settings: SurveySettings) -> Surveyed {
    let mut survey = Survey::new(camera, settings);
    survey.surface(SurveyedTexture::new(texture(), geometry), surface);
    survey.finish(3)
}

fn positions(geometry: &Geometry, feedback: &Feedback) -> Vec<PagePos> {
    feedback.pages.iter().map(|wanted| wanted.page.pos(geometry.dims())).collect()
}

/// Pages of a list with all their ancestors.
fn set_of(geometry: &Geometry, pages: impl Iterator<Item = PagePos>) -> std::collections::BTreeSet<PagePos> {
    pages.flat_map(|page| std::iter::successors(Some(page), |&page| geometry.parent(page))).collect()
}

fn plane() -> FlatSurface {
    FlatSurface::new([-1.0, 0.5, 0.0], [[2.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
}

fn globe() -> GlobeSurface {
    GlobeSurface::sphere([0.0; 3], 1.0)
}

/// Checks one view; gives the pages of the set that pixels want and of the one surveyed.
fn check(camera: Camera, surface: &dyn Surface, hit: Hit) -> (usize, usize) {
    let geometry = geometry();
    let wanted = wanted_by_pixels(&camera, &geometry, hit);
    let surveyed =
        survey(camera, &geometry, surface, SurveySettings { max_pages: 1 << 20, ..Default::default() });
    let found = set_of(&geometry, positions(&geometry, &surveyed.seen).into_iter());
    for (page, lambda) in &wanted {
        // An eighth of a level below the next one is not worth its pages.
        let nearly_coarser = *lambda > f64::from(page.level) + 0.875;
        let is_there = found.contains(page)
            || nearly_coarser && geometry.parent(*page).is_none_or(|parent| found.contains(&parent));
        assert!(is_there, "{page} is wanted at {lambda} and was not found; camera {camera:?}");
    }
    (set_of(&geometry, wanted.into_keys()).len(), found.len())
}

#[test]
fn a_survey_finds_what_pixels_want_and_not_twice_as_much() {
    let (mut wanted, mut found) = (0, 0);
    for height in [0.02, 0.1, 0.4, 1.5] {
        for [x, y, ahead] in [[0.0, 0.0, 0.5], [-0.5, 0.2, 3.0], [0.8, -0.4, 0.1]] {
            let camera = look_at([x, y, height], [x + 0.2 * height, y + ahead * height, 0.0]);
            let (w, f) = check(camera, &plane(), hit_plane);
            (wanted, found) = (wanted + w, found + f);
        }
    }
    assert!(found < 2 * wanted, "plane: {found} pages found, {wanted} wanted");
    println!("plane: {:.2} times the pages", found as f64 / wanted as f64);
    let (mut wanted, mut found) = (0, 0);
    for height in [0.05, 0.3, 1.0, 4.0] {
        for [longitude, latitude] in [[0.3f64, 0.2f64], [2.0, -0.9], [-1.0, 1.3]] {
            let out = [longitude.cos() * latitude.cos(), longitude.sin() * latitude.cos(), latitude.sin()];
            let (w, f) = check(look_at(out.map(|n| n * (1.0 + height)), [0.0; 3]), &globe(), hit_globe);
            (wanted, found) = (wanted + w, found + f);
        }
    }
    assert!(found < 2 * wanted, "globe: {found} pages found, {wanted} wanted");
    println!("globe: {:.2} times the pages", found as f64 / wanted as f64);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn from_anywhere_nothing_that_pixels_want_is_missing(
        x in -1.2f64..1.2, y in -0.7f64..0.7, height in 0.01f64..2.0, ahead in -1.0f64..1.0, aside in -1.0f64..1.0,
    ) {
        check(look_at([x, y, height], [x + aside, y + ahead, 0.0]), &plane(), hit_plane);
        let eye = [x, y, height].map(|n| n * (1.0 + height) / length([x, y, height]));
        check(look_at(eye, [aside, ahead, 0.0].map(|n| n * 0.9)), &globe(), hit_globe);
    }
}

#[test]
fn what_is_behind_the_camera_is_found_apart_and_coarser() {
    let (geometry, camera) = (geometry(), look_at([0.0, -0.1, 0.1], [0.0, 0.4, 0.0]));
    let only_seen = survey(camera, &geometry, &plane(), SurveySettings::default());
    assert!(only_seen.unseen.pages.is_empty() && !only_seen.seen.pages.is_empty());
    assert_eq!(only_seen.seen.frame, 3);
    let pages = |unseen: f32| {
        let settings = SurveySettings { unseen: Some(unseen), ..Default::default() };
        let surveyed = survey(camera, &geometry, &plane(), settings);
        assert_eq!(surveyed.seen, only_seen.seen);
        positions(&geometry, &surveyed.unseen)
    };
    let (as_sharp, coarser) = (pages(0.0), pages(2.0));
    // Just below and behind the eye.
    let below = PagePos::new_2d(0, 64, (0.62 * 8192.0) as u32 / 128);
    let level = |pages: &[PagePos]| {
        let covers = |page: &&PagePos| geometry.ancestor(below, page.level) == **page;
        pages.iter().filter(covers).map(|page| page.level).min().unwrap()
    };
    assert!(level(&coarser) > level(&as_sharp), "{} and {}", level(&coarser), level(&as_sharp));
    assert!(coarser.len() < as_sharp.len() / 2, "{} and {}", coarser.len(), as_sharp.len());
}

#[test]
fn the_far_side_of_a_globe_is_turned_away() {
    let (geometry, camera) = (geometry(), look_at([3.0, 0.0, 0.0], [0.0; 3]));
    let seen = survey(camera, &geometry, &globe(), SurveySettings::default()).seen;
    // Longitude 180 degrees is at both ends of u; a page of level 5 spans a quarter of it.
    let far = |page: &PagePos| page.level < 6 && page.x == 0;
    assert!(!positions(&geometry, &seen).iter().any(far), "{seen:?}");
}

#[test]
fn there_is_an_end_to_what_may_be_wanted_and_the_finest_goes_first() {
    let (geometry, camera) = (geometry(), look_at([0.0, -0.02, 0.02], [0.0, 0.3, 0.0]));
    let count = |max_pages| {
        let settings = SurveySettings { max_pages, ..Default::default() };
        let pages = positions(&geometry, &survey(camera, &geometry, &plane(), settings).seen);
        assert!(pages.len() <= max_pages);
        let finest = pages.iter().map(|page| page.level).min().unwrap();
        (pages.len(), finest)
    };
    let (all, finest) = count(1 << 20);
    let (few, coarser) = count(all / 4);
    assert!(few > all / 16 && coarser > finest, "{few} of {all} pages from level {coarser}, {finest}");
    assert_eq!(count(1), (1, geometry.tail().first_level()));
}

#[test]
fn an_object_is_wanted_whole_at_the_level_of_its_nearest_point() {
    let (geometry, camera) = (geometry(), look_at([0.0, -10.0, 0.0], [0.0; 3]));
    let object = |distance: f64| SurveyedObject {
        centre: [0.0, distance - 10.0, 0.0],
        radius: 0.5,
        uv: [[0.25, 0.25], [0.5, 0.5]],
        texels_per_unit: 4096.0,
    };
    let survey = |object: SurveyedObject, max_pages: usize| {
        let mut survey = Survey::new(camera, SurveySettings { unseen: Some(1.0), max_pages });
        survey.object(SurveyedTexture::new(texture(), &geometry), &object);
        survey.finish(0)
    };
    // 180 pixels high at 60 degrees: 156 pixels for a unit at distance 1. 4096 texels a unit, 2 away: 52
    // texels a pixel.
    let surveyed = survey(object(2.5), 4096);
    let wanted = &surveyed.seen.pages;
    let first = wanted[0];
    assert_eq!((first.page.level(), first.eighth), (5, 5), "log2 of 52.5 is 5.7");
    // The texture has 4 by 2 pages on level 5; a sphere of radius 39 pixels covers 75 of the feedback's.
    assert_eq!((wanted.len(), wanted[0].pixels), (1, 74), "{wanted:?}");
    assert!(wanted.iter().all(|wanted| wanted.page.texture() == texture()));
    let behind = survey(object(-2.5), 4096);
    assert!(behind.seen.pages.is_empty());
    assert_eq!((behind.unseen.pages[0].page.level(), behind.unseen.pages[0].eighth), (6, 5));
    // So near that the eye is within: level 0 has 32 by 16 pages of the region.
    assert_eq!(survey(object(0.2), 512).seen.pages.len(), 512);
    let capped = survey(object(0.2), 511).seen;
    assert_eq!((capped.pages.len(), capped.pages[0].page.level()), (128, 1));
}

#[test]
fn objects_cut_from_a_surface_want_at_least_what_it_wants() {
    let (geometry, camera) = (geometry(), look_at([0.1, -0.3, 0.2], [0.0, 0.2, 0.0]));
    let by_surface = survey(camera, &geometry, &plane(), SurveySettings::default()).seen;
    let mut by_objects = Survey::new(camera, SurveySettings::default());
    for object in SurveyedObject::grid(&plane(), [16384, 8192], [32, 16]) {
        by_objects.object(SurveyedTexture::new(texture(), &geometry), &object);
    }
    let by_objects = set_of(&geometry, positions(&geometry, &by_objects.finish(0).seen).into_iter());
    let missing: Vec<_> =
        positions(&geometry, &by_surface).into_iter().filter(|page| !by_objects.contains(page)).collect();
    assert!(missing.is_empty(), "{missing:?}");
    assert!(by_objects.len() > by_surface.pages.len());
}

#[test]
fn a_rule_of_levels_holds_in_a_survey_too() {
    let (geometry, camera) = (geometry(), look_at([0.0, -0.1, 0.1], [0.0, 0.4, 0.0]));
    let mut survey = Survey::new(camera, SurveySettings::default());
    let rule = LevelRule { bias: 1.0, finest: 3, coarsest: 4 };
    let texture = SurveyedTexture { rule, ..SurveyedTexture::new(texture(), &geometry) };
    survey.surface(texture, &plane());
    let levels: Vec<u8> = survey.finish(0).seen.pages.iter().map(|wanted| wanted.page.level()).collect();
    assert!(levels.contains(&3) && levels.iter().all(|level| (3..=4).contains(level)), "{levels:?}");
}

#[test]
fn numbers_that_are_none_want_nothing_and_do_no_harm() {
    let geometry = geometry();
    let broken = Camera::new([[f32::NAN; 4]; 4], PICTURE);
    let settings = SurveySettings { unseen: Some(0.0), max_pages: 100 };
    assert!(survey(broken, &geometry, &plane(), settings).seen.pages.is_empty());
    let nowhere = FlatSurface::new([f64::NAN; 3], [[0.0; 3]; 2]);
    let camera = look_at([0.0, -0.1, 0.1], [0.0, 0.4, 0.0]);
    assert!(survey(camera, &geometry, &nowhere, settings).seen.pages.is_empty());
    let volume = Geometry::new(GeometrySpec::volume([64; 3])).unwrap();
    assert_eq!(
        survey(camera, &volume, &plane(), settings),
        Surveyed {
            seen: Feedback { frame: 3, ..Feedback::default() },
            unseen: Feedback { frame: 3, ..Feedback::default() },
        }
    );
}
