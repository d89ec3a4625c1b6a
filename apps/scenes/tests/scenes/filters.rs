//! Every filter equals the same taps of an ordinary texture: close up, at grazing angles, across page edges,
//! at the date line and the poles, and where a mode of address decides what lies beyond an edge.

use std::f64::consts::PI;

use vastex::{AddressMode, Filter, MaxTaps, Region, TextureId};
use vastex_scenes::{Offscreen, Pose, Scene};

use crate::common::{Image, gpu, settings, settle};
use crate::pictures::assert_alike;
use glam::{DVec2, DVec3};

pub(crate) const SIZE: [u32; 2] = [128, 72];
/// The only texture of a scene without a window.
pub(crate) fn texture(offscreen: &Offscreen) -> TextureId {
    offscreen.textures().inspect().textures().next().unwrap()
}

/// One of each kind, and the most taps, which reach beyond the border of 4 that the images have.
pub(crate) fn filters() -> impl Iterator<Item = Filter> {
    Filter::KINDS.into_iter().chain(MaxTaps::new(16).map(Filter::Anisotropic))
}

/// Views that are hard on filters.
fn poses(scene: Scene) -> Vec<Pose> {
    match scene {
        // A texel on 3 and on 20 pixels, and 4 texels on a pixel.
        Scene::Image => [3.0, 30.0, 1.2].map(|zoom| Pose::image(DVec2::new(0.43, 0.52), zoom)).to_vec(),
        // Along the ground, straight and turned, and just over it at the edge.
        Scene::Plane | Scene::Terrain => {
            [(-0.9, 0.12, 0.0, 0.1), (-0.4, 0.05, 0.7, 0.2), (-0.74, 0.01, 0.3, 0.3)]
                .map(|(y, z, yaw, pitch)| Pose::Plane { eye: DVec3::new(0.1, y, z), yaw, pitch })
                .to_vec()
        }
        // The date line, a pole, and the limb.
        Scene::Globe | Scene::Planet => [(PI, 0.2, 0.4), (PI - 0.1, 1.54, 0.15), (-PI, -1.2, 0.05)]
            .map(|(longitude, latitude, altitude)| Pose::globe(longitude, latitude, altitude))
            .to_vec(),
    }
}

fn check(image: Image, scenes: &[Scene], filters: impl Iterator<Item = Filter>) {
    let (_directory, file) = image.build();
    let source = vastex::open(file).unwrap();
    for filter in filters {
        for &scene in scenes {
            let mut offscreen =
                Offscreen::new(gpu(), source.clone(), scene, SIZE, settings(16, filter)).unwrap();
            // All of it, since so small a picture may do without a page that a single pixel wants.
            let texture = texture(&offscreen);
            let ticket = offscreen.textures_mut().ahead().pin(texture, &Region::whole()).unwrap();
            while ticket.progress().resident < ticket.progress().pages {
                offscreen.frame(poses(scene)[0]).unwrap();
            }
            for pose in poses(scene) {
                settle(&mut offscreen, pose);
                let what = format!("{filter} {image:?} {pose:?}");
                assert_eq!(offscreen.share_at_wanted_level().unwrap(), 1.0, "{what}");
                assert_alike(&offscreen.compare().unwrap().0, &what);
            }
        }
    }
}

#[test]
fn every_filter_in_every_scene() {
    let image = Image { address: [AddressMode::Wrap, AddressMode::Clamp], ..Image::new(700, 500, 64) };
    check(image, &Scene::SMOOTH, filters());
}

#[test]
fn filters_that_reach_far_in_every_address_mode() {
    use AddressMode::{Border, Clamp, Mirror, Wrap};
    for address in [[Wrap, Mirror], [Mirror, Border], [Border, Wrap], [Clamp, Mirror]] {
        // Neither side divides: round a wrapping one levels do not meet exactly (ARCHITECTURE.md,
        // "Coordinates").
        let image = Image { address, ..Image::new(500, 333, 64) };
        check(image, &[Scene::Plane], filters().skip(3));
    }
}

/// The taps along an axis show what one tap cannot.
#[test]
fn an_anisotropic_filter_is_sharper_at_a_grazing_angle() {
    let (_directory, file) = Image::new(700, 500, 64).build();
    let source = vastex::open(file).unwrap();
    let pose = poses(Scene::Plane)[1];
    let contrast = |filter| {
        let mut offscreen =
            Offscreen::new(gpu(), source.clone(), Scene::Plane, SIZE, settings(16, filter)).unwrap();
        settle(&mut offscreen, pose);
        let picture = offscreen.picture();
        let steps = picture.rgba.chunks_exact(4).zip(picture.rgba.chunks_exact(4).skip(1));
        steps
            .filter(|(a, b)| a[3] == 255 && b[3] == 255)
            .map(|(a, b)| u64::from(a[0].abs_diff(b[0])))
            .sum::<u64>()
    };
    let [one, eight] = [Filter::Trilinear, Filter::KINDS[3]].map(contrast);
    assert!(eight as f64 > 1.3 * one as f64, "{one} with one tap, {eight} with up to 8");
}
