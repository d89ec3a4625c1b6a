//! Images of unlike size that lie over one another texel upon texel from the upper left corner, and are
//! compared so.

use std::sync::Arc;

use glam::DVec2;
use vastex::{Filter, ImageOptions, ImageSource, LayerFormat, TextureId, Textures, TileSource};
use vastex_scenes::{DisplayOptions, LayerOptions, Picture, Pose, Scene};
use vastex_viewer::inspect::{Histogram, Thumbnail, texel_at};
use vastex_viewer::layers::{BACKGROUND, CompareMode, ImageSizes, Placement};
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

/// How often each of the two is halved, of which a coarser level alone is there.
type Halvings = [u32; 2];
const WHOLE: Halvings = [0, 0];

/// Columns and rows of what is there of an image.
fn held(image: [u32; 2], halvings: u32) -> [u32; 2] {
    image.map(|side| side.div_ceil(1 << halvings))
}

/// A texture of an image.
fn add(textures: &mut Textures, [width, height]: [u32; 2], texel: impl Fn([u32; 2]) -> [u8; 3]) -> TextureId {
    let places = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    let texels: Vec<u8> = places.flat_map(|at| [&texel(at)[..], &[255]].concat()).collect();
    let options = ImageOptions::default();
    let source = ImageSource::new(LayerFormat::Rgba8Srgb, [width, height], texels, &options).unwrap();
    let source: Arc<dyn TileSource> = Arc::new(source);
    textures.add_blocking(source).unwrap()
}

/// The two of these texels, or what there is of them. They are shown as they are where they are magnified.
fn textures_of(
    halvings: Halvings,
    texel: impl Fn(usize, [u32; 2]) -> [u8; 3],
) -> (Textures, [TextureId; 2], ImageSizes) {
    let mut textures = Textures::new(&gpu().device, &gpu().queue, settings(16, Filter::Nearest)).unwrap();
    let shown = [0, 1].map(|image| {
        let size = held([BELOW, ABOVE][image], halvings[image]);
        add(&mut textures, size, |at| texel(image, at))
    });
    let images = shown.into_iter().zip([BELOW, ABOVE]).collect();
    (textures, shown, images)
}

/// The two, whole.
fn textures() -> (Textures, [TextureId; 2]) {
    let (textures, shown, _) = textures_of(WHOLE, texel);
    (textures, shown)
}

fn options(placement: Placement, compare_mode: CompareMode) -> DisplayOptions {
    DisplayOptions { placement, compare_mode, ..DisplayOptions::default() }
}

/// The layers of an image as they are asked to be shown.
fn layers(textures: &mut Textures, shown: [TextureId; 2], options: &DisplayOptions, scene: Scene) -> Layers {
    layers_of(textures, (shown, &ImageSizes::default()), options, scene)
}

/// The same where images have more texels than their textures.
fn layers_of(
    textures: &mut Textures,
    (shown, images): ([TextureId; 2], &ImageSizes),
    options: &DisplayOptions,
    scene: Scene,
) -> Layers {
    let list = options.layers_of(textures, &shown).unwrap();
    options.describe(scene, textures, (&shown, images), list, None).unwrap().layers
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

/// Compares a picture of panes of `width` pixels with what is expected of the texels of either image at each
/// pixel, if it has one there. Returns how many pixels show the ground, and how many do not.
fn check(
    picture: &Picture,
    (middle, width): ([u32; 2], u32),
    halvings: Halvings,
    expected: &Expected<'_>,
    what: &str,
) -> [usize; 2] {
    let ground = BACKGROUND.truncate().to_array().map(|light| encoded(light.into()).round() as u8);
    let mut counts = [0, 0];
    for (n, pixel) in picture.rgba.chunks_exact(4).enumerate() {
        let at = [n as u32 % PICTURE[0], n as u32 / PICTURE[0]];
        let [column, row] = place(middle, width, [at[0] % width, at[1]]);
        let of = |image: usize, size: [u32; 2]| {
            let [columns, rows] = held(size, halvings[image]);
            let place = |place: i64| u32::try_from(place >> halvings[image]).ok();
            let within = |at: i64, side: u32| place(at).filter(|place| *place < side);
            Some(texel(image, [within(column, columns)?, within(row, rows)?]))
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
            let what = format!("{mode} at {middle:?}");
            let [ground, texels] = check(&picture, (middle, width), WHOLE, expected, &what);
            (shows_ground, drawn) = (shows_ground + ground, drawn + texels);
        }
    }
    assert!(shows_ground > 20_000 && drawn > 40_000, "{shows_ground}, {drawn}");
}

/// Texels are those of the images, whether or not all of them are there.
#[test]
fn images_of_which_a_coarser_level_is_there_lie_by_the_texels_of_the_images() {
    let mut drawn = [0, 0];
    for halvings in [[0, 1], [1, 0], [2, 1]] {
        let (mut textures, shown, images) = textures_of(halvings, texel);
        let middles = [[334, 448], [100, 90]];
        for (mode, expected, middle) in [
            (CompareMode::Off, &(|_, below, above: Option<_>| above.or(below)) as &Expected<'_>, middles[0]),
            (CompareMode::Flicker(0.5), &|_, _, above| above, middles[0]),
            (CompareMode::Difference(1.0), &|_, below, above| apart(below, above), middles[1]),
        ] {
            let options = options(Placement::ByTexel, mode);
            let list = layers_of(&mut textures, (shown, &images), &options, Scene::Image);
            assert!(list.is_by_texel());
            let seen = (pose(middle, PICTURE[0]), false);
            let picture = draw_list(&mut textures, list.clone(), Scene::Image, seen);
            list.remove(&mut textures);
            let what = format!("{mode}, halved {halvings:?} times");
            let [ground, texels] = check(&picture, (middle, PICTURE[0]), halvings, expected, &what);
            (drawn[0], drawn[1]) = (drawn[0] + ground, drawn[1] + texels);
        }
    }
    assert!(drawn[0] > 15_000 && drawn[1] > 50_000, "{drawn:?}");
}

/// The map shows a smaller image where the picture does, and beside it what lies beneath.
#[test]
fn a_map_has_images_where_they_lie() {
    let values = |image: usize, _| [[40, 80, 120], [200, 150, 100]][image];
    const MAP: [usize; 2] = [140, 100];
    for (placement, halvings) in [
        (Placement::ByTexel, WHOLE),
        (Placement::ByTexel, [1, 1]),
        (Placement::ByTexel, [0, 2]),
        (Placement::Stretched, WHOLE),
    ] {
        let (mut textures, shown, images) = textures_of(halvings, values);
        let options = options(placement, CompareMode::Off);
        let list = layers_of(&mut textures, (shown, &images), &options, Scene::Image);
        let map = Thumbnail::of_layers(&textures, &list, BELOW, MAP).unwrap();
        let [columns, rows] = match placement {
            Placement::ByTexel => [0, 1].map(|axis| f64::from(ABOVE[axis]) / f64::from(BELOW[axis])),
            Placement::Stretched => [1.0, 1.0],
        }
        .map(|share| share * map.size[0] as f64);
        let rows = rows * map.size[1] as f64 / map.size[0] as f64;
        let mut counts = [0, 0];
        for (n, pixel) in map.pixels.iter().enumerate() {
            let [x, y] = [n % map.size[0], n / map.size[0]].map(|at| at as f64 + 0.5);
            if (x - columns).abs() < 1.5 || (y - rows).abs() < 1.5 {
                continue; // at an edge
            }
            let image = usize::from(x < columns && y < rows);
            counts[image] += 1;
            assert_eq!(pixel[..3], values(image, [0, 0]), "{placement} {halvings:?} {x},{y}");
        }
        assert!(counts[1] > 1000 && (counts[0] > 1000) == (placement == Placement::ByTexel), "{counts:?}");
        // Of each a level is in memory that fits into a page: counted in levels of the images the third.
        let is_third = map.levels.iter().all(|level| *level == 3);
        assert!(
            is_third || placement == Placement::Stretched,
            "halved {halvings:?} times: {:?}",
            map.levels[0]
        );
        list.remove(&mut textures);
    }
}

/// Values in view are those of the part of the smaller image that is in view.
#[test]
fn a_histogram_has_the_values_that_a_smaller_image_has_in_view() {
    // Its columns are counted by its values.
    let values = |image: usize, [x, _]: [u32; 2]| if image == 0 { [0; 3] } else { [(x / 2) as u8; 3] };
    let halved = |image: usize, [x, y]: [u32; 2]| values(image, [x * 2, y]);
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    for (placement, halvings) in
        [(Placement::ByTexel, WHOLE), (Placement::ByTexel, [0, 1]), (Placement::Stretched, WHOLE)]
    {
        let (mut textures, shown, images) = match halvings {
            WHOLE => textures_of(halvings, values),
            _ => textures_of(halvings, halved),
        };
        let options = options(placement, CompareMode::Off);
        let list = options.layers_of(&textures, &shown).unwrap();
        let described = options.describe(Scene::Image, &mut textures, (&shown, &images), list, None).unwrap();
        let renderer = SceneRenderer::new(gpu(), &textures, described, format).unwrap();
        let above = *renderer.layers().inspected();
        let seen = |middle: [u32; 2]| {
            let (layer, sizes) = ((above.layer, &above.color_map), (PICTURE, BELOW));
            let pose = pose(middle, PICTURE[0]);
            let seen = Histogram::of_view(&textures, &renderer, layer, &pose, sizes, None)?;
            // Light, of values that are encoded.
            Some(seen.extent()?.map(|light| encoded(light.into()) * 2.0))
        };
        for (middle, columns) in [([120, 200], [90.0, 150.0]), ([333, 200], [303.0, 333.0])] {
            let columns = match placement {
                Placement::ByTexel => columns,
                Placement::Stretched => [-30.0, 30.0]
                    .map(|side| (f64::from(middle[0]) + side) * f64::from(ABOVE[0]) / f64::from(BELOW[0])),
            };
            let ([low, high], [first, last]) = (seen(middle).unwrap(), columns);
            let is_near = (low - first).abs() < 12.0 && (high - last).abs() < 12.0;
            assert!(
                is_near,
                "{placement} {halvings:?} at {middle:?}: {low} to {high}, not {first} to {last}"
            );
        }
        assert_eq!(seen([600, 200]).is_some(), placement == Placement::Stretched, "beside it");
        renderer.layers().clone().remove(&mut textures);
    }
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
        let images = ImageSizes::default();
        let described = options.describe(Scene::Image, &mut textures, (&shown, &images), list, None).unwrap();
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
