//! A planet of several textures in one group looks as it does from ordinary textures.

use std::sync::Arc;

use vastex::{AddressMode, Filter, TileSource};
use vastex_scenes::{Attribute, Part, Path, Planet, Pose, Scene};

use crate::common::{Image, gpu, settings};
use crate::pictures::assert_alike;

const SIZE: [u32; 2] = [480, 270];

/// A texture of grain that goes round the planet.
fn part(
    attribute: Attribute,
    size: [u32; 2],
    page: u32,
    channels: png::ColorType,
    sixteen_bit: bool,
) -> Part {
    let address = [AddressMode::Wrap, AddressMode::Clamp];
    let image = Image { address, channels, sixteen_bit, ..Image::new(size[0], size[1], page) };
    let (_directory, file) = image.build();
    // Its name is no more when the directory is gone, but what was opened stays readable.
    let source: Arc<dyn TileSource> = vastex::open(file).unwrap();
    (attribute, source)
}

fn converge(planet: &mut Planet, pose: Pose) {
    for frame in 0..3000 {
        let stats = planet.frame(pose).unwrap();
        if frame > 20 && stats.converged {
            return;
        }
    }
    panic!("not converged: {:?}", planet.textures().stats());
}

#[test]
fn a_planet_of_four_textures_looks_as_from_ordinary_ones() {
    use png::ColorType::{Grayscale, Rgb};
    let parts = vec![
        part(Attribute::Height, [1024, 512], 64, Grayscale, true),
        part(Attribute::Color, [3000, 1500], 128, Rgb, false),
        part(Attribute::Night, [1500, 750], 128, Grayscale, false),
        part(Attribute::Clouds, [700, 350], 50, Grayscale, false),
    ];
    let mut planet = Planet::new(gpu(), parts, SIZE, settings(16, Filter::Trilinear)).unwrap();
    let first = Path::Still.pose(Scene::Globe, 2.0, 0);
    for (name, pose) in [
        ("whole", first),
        ("near", first.zoomed(12.0)),
        ("over the night", first.dragged(glam::DVec2::new(1.5, 0.0), 1.8, 2.0)),
    ] {
        converge(&mut planet, pose);
        assert_alike(&planet.compare().unwrap(), name);
    }
    let stats = planet.textures().stats();
    assert_eq!((stats.pools.len(), stats.pager.bias_eighths), (4, 0), "each has its own page size or format");
}

#[test]
fn attributes_may_be_left_out() {
    let parts = vec![part(Attribute::Night, [300, 150], 64, png::ColorType::Grayscale, false)];
    let mut planet = Planet::new(gpu(), parts, SIZE, settings(4, Filter::Trilinear)).unwrap();
    converge(&mut planet, Path::Still.pose(Scene::Globe, 2.0, 0));
    assert_alike(&planet.compare().unwrap(), "night alone");
}
