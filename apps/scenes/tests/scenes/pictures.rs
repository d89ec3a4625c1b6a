//! The picture from a virtual texture equals the picture from an ordinary one.

use crate::common::{Image, converged, settings};
use vastex::{AddressMode, Filter};
use vastex_scenes::{Comparison, Path, Scene};

/// What a picture may differ by: 99.9 % of the pixels by one step of 1/255, one pixel in 10,000 by more than
/// three. The filters of an atlas and of a whole texture round their weights at different places.
pub(crate) fn assert_alike(comparison: &Comparison, what: &str) {
    assert!(comparison.share_within_1_255 >= 0.999, "{what}: {comparison:?}");
    assert!(comparison.share_beyond_3_255 <= 1e-4, "{what}: {comparison:?}");
}

/// Compares pictures of an image, which is built once: of scenes, at the end of paths, by filters.
fn compare(image: Image, shown: impl IntoIterator<Item = (Scene, Path, Filter)>) {
    let (_directory, file) = image.build();
    for (scene, path, filter) in shown {
        let source = vastex::open(&file).unwrap();
        let mut offscreen = converged(source, scene, [320, 180], path, settings(16, filter));
        let what = format!("{image:?} {scene:?} {filter:?}");
        assert_eq!(offscreen.share_at_wanted_level().unwrap(), 1.0, "{what}");
        assert_alike(&offscreen.compare().unwrap().0, &what);
    }
}

#[test]
fn every_scene_of_every_shape_equals_an_ordinary_texture() {
    for (width, height) in [(1000, 777), (777, 1000), (1, 1)] {
        for page in [128, 254] {
            let shown = Scene::SMOOTH.map(|scene| (scene, Path::Still, Filter::Trilinear));
            compare(Image::new(width, height, page), shown);
        }
    }
}

#[test]
fn close_up_and_every_filter() {
    // Each filter in one scene, and in each scene one filter at least.
    let pairs = Filter::KINDS.into_iter().zip(Scene::SMOOTH.into_iter().cycle());
    compare(Image::new(1000, 777, 128), pairs.map(|(filter, scene)| (scene, Path::Zoom, filter)));
}

#[test]
fn every_address_mode() {
    for mode in [AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border] {
        for (width, height) in [(1000, 777), (1024, 512)] {
            let image = Image { address: [mode; 2], ..Image::new(width, height, 128) };
            compare(image, [(Scene::Globe, Path::Fly, Filter::Trilinear)]);
        }
    }
}

#[test]
fn every_format() {
    use png::ColorType::{Grayscale, GrayscaleAlpha, Rgb, Rgba};
    for (channels, sixteen_bit) in
        [(Grayscale, false), (GrayscaleAlpha, false), (Rgb, false), (Rgba, false), (Grayscale, true)]
    {
        let image = Image { channels, sixteen_bit, ..Image::new(500, 400, 128) };
        compare(image, [(Scene::Plane, Path::Still, Filter::Trilinear)]);
    }
}

#[test]
fn the_cpu_twin_draws_the_same_picture() {
    let image = Image { address: [AddressMode::Wrap, AddressMode::Clamp], ..Image::new(1000, 777, 128) };
    let (_directory, file) = image.build();
    for filter in Filter::KINDS {
        let source = vastex::open(&file).unwrap();
        let offscreen = converged(source, Scene::Globe, [320, 180], Path::Still, settings(16, filter));
        let comparison = Comparison::of(&offscreen.picture(), &offscreen.cpu_picture().unwrap());
        assert_alike(&comparison, &format!("{filter:?}"));
    }
}
