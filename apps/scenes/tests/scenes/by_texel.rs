//! Images of unlike size that lie over one another texel upon texel from the upper left corner, and are
//! compared so.

use std::sync::Arc;

use glam::DVec2;
use vastex::{Filter, ImageOptions, ImageSource, LayerFormat, TextureId, Textures, TileSource};
use vastex_scenes::{DisplayOptions, LayerOptions, Picture, Pose, Scene};
use vastex_viewer::inspect::texel_at;
use vastex_viewer::layers::{BACKGROUND, CompareMode, Placement};
use vastex_viewer::{Layers, SceneRenderer};

use crate::common::{gpu, settings};
use crate::shown_layers::{draw_list, encoded};

/// Pixels of the pictures.
const PICTURE: [u32; 2] = [120, 80];
const BELOW: [u32; 2] = [700, 500];
/// Its right edge and its lower edge lie within pages of the other, which has more columns and rows.
const ABOVE: [u32; 2] = [333, 450];
/// Pixels a texel.
const SCALE: f64 = 2.0;

/// A texel of one of the two images, of which no two that are near are alike.
fn texel(image: usize, [x, y]: [u32; 2]) -> [u8; 3] {
    let [x, y] = [x as usize, y as usize];
    [x * 3 + y + 40 * image, y * 5 + 90 * image, (x ^ y) * (image + 1)].map(|value| (value % 256) as u8)
}

/// The two, and how they are shown: as they are where they are magnified.
fn textures() -> (Textures, [TextureId; 2]) {
    let mut textures = Textures::new(&gpu().device, &gpu().queue, settings(16, Filter::Nearest)).unwrap();
    let mut add = |image: usize, [width, height]: [u32; 2]| {
        let places = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        let texels: Vec<u8> = places.flat_map(|at| [&texel(image, at)[..], &[255]].concat()).collect();
        let options = ImageOptions::default();
        let source = ImageSource::new(LayerFormat::Rgba8Srgb, [width, height], texels, &options).unwrap();
        let source: Arc<dyn TileSource> = Arc::new(source);
        textures.add_blocking(source).unwrap()
    };
    let shown = [add(0, BELOW), add(1, ABOVE)];
    (textures, shown)
}

fn options(placement: Placement, compare_mode: CompareMode) -> DisplayOptions {
    DisplayOptions { placement, compare_mode, ..DisplayOptions::default() }
}

/// The layers of an image as they are asked to be shown.
fn layers(textures: &mut Textures, shown: [TextureId; 2], options: &DisplayOptions, scene: Scene) -> Layers {
    let list = options.layers_of(textures, &shown).unwrap();
    options.describe(scene, textures, &shown, list, None).unwrap().layers
}

/// A pose with a texel's upper left corner in the middle of a picture, or of a pane of it.
fn pose(middle: [u32; 2], width: u32) -> Pose {
    let [columns, rows] = BELOW.map(f64::from);
    let fitted = (f64::from(width) / columns).min(f64::from(PICTURE[1]) / rows);
    Pose::image(DVec2::from(middle.map(f64::from)) / DVec2::new(columns, rows), SCALE / fitted)
}

/// The texel of the lower image at a pixel of a picture, or of a pane of it.
fn place(middle: [u32; 2], width: u32, [x, y]: [u32; 2]) -> [i64; 2] {
    let at = |middle: u32, side: u32, pixel: u32| {
        i64::from(middle) + (i64::from(pixel) - i64::from(side / 2)).div_euclid(SCALE as i64)
    };
    [at(middle[0], width, x), at(middle[1], PICTURE[1], y)]
}

/// What is expected of a pixel: a texel of either image, or the ground.
type Expected<'a> = dyn Fn([u32; 2], Option<[u8; 3]>, Option<[u8; 3]>) -> Option<[u8; 3]> + 'a;

/// Compares a picture of so many panes with what is expected of the texels of either image at each pixel, if
/// it has one there. Returns how many pixels show the ground, and how many do not.
fn check(picture: &Picture, middle: [u32; 2], width: u32, expected: &Expected<'_>, what: &str) -> [usize; 2] {
    let ground = BACKGROUND.truncate().to_array().map(|light| encoded(light.into()).round() as u8);
    let mut counts = [0, 0];
    for (n, pixel) in picture.rgba.chunks_exact(4).enumerate() {
        let at = [n as u32 % PICTURE[0], n as u32 / PICTURE[0]];
        let [column, row] = place(middle, width, [at[0] % width, at[1]]);
        let of = |image: usize, size: [u32; 2]| {
            let within = |place: i64, side: u32| u32::try_from(place).ok().filter(|place| *place < side);
            Some(texel(image, [within(column, size[0])?, within(row, size[1])?]))
        };
        let (below, above) = (of(0, BELOW), of(1, ABOVE));
        if below.is_none() {
            continue; // beside the image
        }
        let expected = expected(at, below, above);
        counts[usize::from(expected.is_some())] += 1;
        let is_near = expected
            .unwrap_or(ground)
            .iter()
            .zip(pixel)
            .all(|(expected, found)| expected.abs_diff(*found) <= 1);
        assert!(is_near, "{what}, {at:?}, texel {column},{row}: {pixel:?} in place of {expected:?}");
    }
    counts
}

fn apart(below: Option<[u8; 3]>, above: Option<[u8; 3]>) -> Option<[u8; 3]> {
    let (below, above) = (below?, above?);
    Some([0, 1, 2].map(|channel| below[channel].abs_diff(above[channel])))
}

#[test]
fn texels_of_compared_images_lie_upon_one_another() {
    let (mut textures, shown) = textures();
    // Within both images, over the corner of the smaller one, and beside it.
    let middles = [[100, 90], [334, 448], [600, 100]];
    let (mut shows_ground, mut drawn) = (0, 0);
    for (mode, expected) in [
        (CompareMode::Off, &(|_, below, above: Option<_>| above.or(below)) as &Expected<'_>),
        (CompareMode::Swipe(0.5), &|[x, _], below, above| if x < PICTURE[0] / 2 { below } else { above }),
        (CompareMode::Flicker(0.5), &|_, _, above| above),
        (CompareMode::Difference(1.0), &|_, below, above| apart(below, above)),
        (CompareMode::Beside, &|[x, _], below, above| if x < PICTURE[0] / 2 { below } else { above }),
    ] {
        for middle in middles {
            let width = if mode == CompareMode::Beside { PICTURE[0] / 2 } else { PICTURE[0] };
            let list = layers(&mut textures, shown, &options(Placement::ByTexel, mode), Scene::Image);
            assert!(list.is_by_texel());
            let seen = (pose(middle, width), false);
            let picture = draw_list(&mut textures, list.clone(), Scene::Image, seen);
            list.remove(&mut textures);
            let [ground, texels] = check(&picture, middle, width, expected, &format!("{mode} at {middle:?}"));
            (shows_ground, drawn) = (shows_ground + ground, drawn + texels);
        }
    }
    assert!(shows_ground > 20_000 && drawn > 40_000, "{shows_ground}, {drawn}");
}

#[test]
fn a_layer_below_that_is_smaller_ends_as_one_above_does() {
    let (mut textures, shown) = textures();
    let small_first = DisplayOptions {
        layers: vec![LayerOptions::first_of(1), LayerOptions::first_of(0)],
        ..options(Placement::ByTexel, CompareMode::Difference(1.0))
    };
    let list = layers(&mut textures, shown, &small_first, Scene::Image);
    // All of the smaller one, which says where the picture lies: nothing is shown beyond it.
    let picture = draw_list(&mut textures, list, Scene::Image, (Pose::image(DVec2::splat(0.5), 1.0), false));
    let covered = picture.rgba.chunks_exact(4).filter(|pixel| pixel[3] == 255).count() as f64;
    let expected = f64::from(PICTURE[1]).powi(2) * f64::from(ABOVE[0]) / f64::from(ABOVE[1]);
    assert!((covered / expected - 1.0).abs() < 0.03, "{covered} pixels, {expected} expected");
}

#[test]
fn stretched_images_and_other_scenes_are_as_ever() {
    let (mut textures, shown) = textures();
    for (placement, scene) in [
        (Placement::Stretched, Scene::Image),
        (Placement::ByTexel, Scene::Plane),
        (Placement::ByTexel, Scene::Globe),
    ] {
        let list = layers(&mut textures, shown, &options(placement, CompareMode::Off), scene);
        assert!(!list.is_by_texel(), "{scene:?}");
        list.remove(&mut textures);
    }
    // Of one size they lie the same in either way, and are drawn by what draws any list.
    let same =
        layers(&mut textures, [shown[0]; 2], &options(Placement::ByTexel, CompareMode::Off), Scene::Image);
    assert!(!same.is_by_texel() && same.count() == 2);
}

/// The pointer's value is that of the texel which is seen, and there is none where nothing is shown.
#[test]
fn values_are_those_of_the_texels_that_are_seen() {
    let (mut textures, shown) = textures();
    for (mode, beside) in [(CompareMode::Off, Some(0)), (CompareMode::Flicker(1.0), None)] {
        let options = options(Placement::ByTexel, mode);
        let list = options.layers_of(&textures, &shown).unwrap();
        let described = options.describe(Scene::Image, &mut textures, &shown, list, None).unwrap();
        let format = wgpu::TextureFormat::Rgba8UnormSrgb;
        let renderer = SceneRenderer::new(gpu(), &textures, described, format).unwrap();
        let middle = [333, 100];
        for (pixel, image) in [([59, 40], Some(1)), ([60, 40], beside)] {
            let at = DVec2::new(f64::from(pixel[0]) + 0.5, f64::from(pixel[1]) + 0.5);
            let asked = |layer| {
                let sizes = (PICTURE, BELOW);
                texel_at(&textures, (&renderer, layer), &pose(middle, PICTURE[0]), sizes, at)
            };
            let found = renderer.layers().seen_at(0.5).find_map(|shown| asked(shown.layer));
            let place = place(middle, PICTURE[0], pixel).map(|place| place as u32);
            assert_eq!(found.as_ref().map(|found| found.texel), image.map(|_| place), "{mode} {pixel:?}");
            // Nothing was drawn, so that the value is one of a coarse level.
            assert_eq!(found.is_some(), image.is_some());
        }
    }
}
