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

fn compare(image: Image, scene: Scene, path: Path, filter: Filter) -> Comparison {
    let (_directory, file) = image.build();
    let mut offscreen = converged(vastex::open(file).unwrap(), scene, [320, 180], path, settings(16, filter));
    assert_eq!(offscreen.share_at_wanted_level().unwrap(), 1.0, "{image:?} {scene:?}");
    offscreen.compare().unwrap().0
}

#[test]
fn every_scene_of_every_shape_equals_an_ordinary_texture() {
    for (width, height) in [(1000, 777), (777, 1000), (1, 1)] {
        for page in [128, 254] {
            for scene in Scene::SMOOTH {
                let image = Image::new(width, height, page);
                assert_alike(
                    &compare(image, scene, Path::Still, Filter::Trilinear),
                    &format!("{image:?} {scene:?}"),
                );
            }
        }
    }
}

#[test]
fn close_up_and_every_filter() {
    // Each filter in one scene, and in each scene one filter at least.
    for (filter, scene) in Filter::KINDS.into_iter().zip(Scene::SMOOTH.into_iter().cycle()) {
        let image = Image::new(1000, 777, 128);
        assert_alike(&compare(image, scene, Path::Zoom, filter), &format!("{filter:?} {scene:?}"));
    }
}

#[test]
fn every_address_mode() {
    for mode in [AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border] {
        for (width, height) in [(1000, 777), (1024, 512)] {
            let image = Image { address: [mode; 2], ..Image::new(width, height, 128) };
            assert_alike(&compare(image, Scene::Globe, Path::Fly, Filter::Trilinear), &format!("{image:?}"));
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
        assert_alike(&compare(image, Scene::Plane, Path::Still, Filter::Trilinear), &format!("{image:?}"));
    }
}

#[test]
fn the_cpu_twin_draws_the_same_picture() {
    for filter in Filter::KINDS {
        let image = Image { address: [AddressMode::Wrap, AddressMode::Clamp], ..Image::new(1000, 777, 128) };
        let (_directory, file) = image.build();
        let source = vastex::open(file).unwrap();
        let offscreen = converged(source, Scene::Globe, [320, 180], Path::Still, settings(16, filter));
        let comparison = Comparison::of(&offscreen.picture(), &offscreen.cpu_picture().unwrap());
        assert_alike(&comparison, &format!("{filter:?}"));
    }
}
