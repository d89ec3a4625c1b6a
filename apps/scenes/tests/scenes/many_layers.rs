//! As many layers as a list may have, by filters of several taps, which a driver in software must not take
//! long to compile: one over the other, whether they are sampled by the same lines or each by lines of its
//! own.

use glam::{DVec2, DVec3};
use vastex::{Filter, Textures};
use vastex_scenes::{Picture, Pose, Scene};
use vastex_viewer::layers::MOST_LAYERS;
use vastex_viewer::{Layers, ShownLayer};

use crate::common::{Image, gpu, settings};
use crate::shown_layers::{draw_list, encoded, linear};

/// Images of one shape, of which no two look alike.
fn images(is_apart: bool) -> Vec<Image> {
    let image = |n: usize| {
        let (width, height) = (150 + 30 * n as u32, 100 + 20 * n as u32);
        // Textures of other pages, or of other channels, lie in other pools.
        let page = if is_apart { 32 << (n % 4) } else { 64 };
        let channels = if is_apart && n >= 4 { png::ColorType::Grayscale } else { png::ColorType::Rgb };
        Image { channels, ..Image::new(width, height, page) }
    };
    (0..MOST_LAYERS).map(image).collect()
}

#[test]
fn eight_layers_by_filters_of_several_taps_are_one_over_the_other() {
    let aslant = Pose::Plane { eye: DVec3::new(0.1, -0.9, 0.3), yaw: 0.2, pitch: 0.35 };
    let near = Pose::image(DVec2::new(0.45, 0.55), 6.0);
    for is_apart in [false, true] {
        let built: Vec<_> = images(is_apart).iter().map(Image::build).collect();
        for (filter, scene, pose) in
            [(Filter::KINDS[3], Scene::Plane, aslant), (Filter::Bicubic, Scene::Image, near)]
        {
            let mut textures = Textures::new(&gpu().device, &gpu().queue, settings(8, filter)).unwrap();
            let mut shown = Vec::new();
            for (_, file) in &built {
                let texture = textures.add_blocking(vastex::open(file).unwrap()).unwrap();
                let layer = &textures.texture(texture).unwrap().description().layers[0];
                shown.push(ShownLayer::new(texture.into(), layer));
            }
            let alone: Vec<Picture> = shown
                .iter()
                .map(|layer| draw_list(&mut textures, Layers::one(*layer), scene, (pose, false)))
                .collect();
            for (n, layer) in shown.iter_mut().enumerate().skip(1) {
                layer.opacity = 0.3 + 0.05 * n as f32;
            }
            let expected = over_one_another(&alone, &shown);
            let what = format!("apart {is_apart}, {filter}");
            // The image is drawn in fixed point too, by the lines of one texture.
            for always_fixed in
                [false, true].into_iter().take(if scene == Scene::Image && !is_apart { 2 } else { 1 })
            {
                let layers = Layers::new(&mut textures, shown.clone(), None).unwrap();
                let text = layers.text_of(&layers.kinds(&textures).unwrap());
                assert_eq!(text.breaks, if is_apart { 0b1111_1110 } else { 0 }, "{what}");
                let found = draw_list(&mut textures, layers.clone(), scene, (pose, always_fixed));
                layers.remove(&mut textures);
                assert_near(&found, &expected, &what);
            }
        }
    }
}

/// What pictures of layers make one over the other, in steps of 1/255; `None` where one of them shows
/// nothing, or may be darker or lighter than a picture can be: what several texels are blended to goes beyond
/// them.
fn over_one_another(alone: &[Picture], shown: &[ShownLayer]) -> Vec<Option<[f64; 3]>> {
    let pixel = |n: usize| {
        let of = |picture: &Picture| <[u8; 4]>::try_from(&picture.rgba[4 * n..4 * n + 4]).unwrap();
        let mut sum = [0.0; 3];
        for (picture, layer) in alone.iter().zip(shown) {
            let value = of(picture);
            if value[3] < 255 || value[..3].iter().any(|value| matches!(value, 0 | 255)) {
                return None;
            }
            let opacity = f64::from(layer.opacity);
            sum = [0, 1, 2].map(|c| sum[c] * (1.0 - opacity) + linear(value[c]) * opacity);
        }
        Some(sum.map(encoded))
    };
    (0..alone[0].rgba.len() / 4).map(pixel).collect()
}

/// Each of the pictures is rounded to a step, of which one of light is several of what is dark.
fn assert_near(found: &Picture, expected: &[Option<[f64; 3]>], what: &str) {
    let (mut worst, mut seen, mut apart) = (0f64, 0, 0.0);
    for (found, expected) in found.rgba.chunks_exact(4).zip(expected) {
        let Some(expected) = expected else { continue };
        let steps = [0, 1, 2].map(|c| (f64::from(found[c]) - expected[c]).abs());
        worst = steps.into_iter().fold(worst, f64::max);
        apart += steps.iter().sum::<f64>() / 3.0;
        seen += 1;
    }
    assert!(
        seen > 3000 && worst <= 3.0 && apart / f64::from(seen) < 0.6,
        "{what}: {worst}, {apart} of {seen}"
    );
}
