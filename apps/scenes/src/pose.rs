//! Where a camera is, in the words of its scene, and the matrix that follows from it.
//!
//! How poses follow one another is `path`'s business, what is drawn `draw`'s.

use glam::camera::rh::{proj::directx as projection, view::look_at_mat4};
use glam::{Mat4, Vec2, Vec3};

use crate::scene::{Scene, direction};

/// A camera in one of the scenes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pose {
    /// Looking straight at the image.
    Image {
        /// The point of the image in the middle of the view, in uv.
        centre: Vec2,
        /// How much of the view the whole image fills: 1 fits it in, 10 shows a tenth of it.
        zoom: f32,
    },
    /// Standing over the rectangle of 2 by 2h/w at z = 0, whose centre is the origin, or over a terrain on it.
    Plane {
        /// Where the camera is; z from the ground below it.
        eye: Vec3,
        /// Turn to the left from +y, in radians.
        yaw: f32,
        /// Turn downwards from the horizon, in radians.
        pitch: f32,
    },
    /// Over the unit sphere, looking at its centre, north up.
    Globe {
        /// Longitude below the camera, in radians; 0 is in the middle of the image.
        longitude: f32,
        /// Latitude below the camera, in radians, north positive.
        latitude: f32,
        /// Height above the ground, in radii.
        altitude: f32,
    },
}

/// Vertical field of view of the scenes with perspective: 60 degrees.
const FIELD_OF_VIEW: f32 = std::f32::consts::FRAC_PI_3;
/// How close a latitude may come to a pole, so that north stays up.
const LATITUDE_LIMIT: f32 = 1.55;

impl Pose {
    /// The pose in which a window opens and `still` stays.
    pub fn first(scene: Scene) -> Pose {
        match scene {
            Scene::Image => Pose::Image { centre: Vec2::splat(0.5), zoom: 1.0 },
            Scene::Plane => {
                Pose::Plane { eye: Vec3::new(0.0, -0.45, 0.29), yaw: 0.0, pitch: std::f32::consts::FRAC_PI_4 }
            }
            Scene::Terrain => Pose::Plane { eye: Vec3::new(0.0, -0.6, 0.16), yaw: 0.0, pitch: 0.3 },
            Scene::Globe => Pose::Globe { longitude: 0.2, latitude: 0.5, altitude: 1.3 },
        }
    }

    /// Clip space from world space. `view` and `image` are width over height.
    pub fn clip_from_world(&self, view: f32, image: f32) -> Mat4 {
        self.clip_from_world_over(view, image, 0.0)
    }

    /// The same where the ground below the camera is higher than the surface would be without heights.
    pub(crate) fn clip_from_world_over(&self, view: f32, image: f32, ground: f32) -> Mat4 {
        match *self {
            Pose::Image { centre, zoom } => {
                // The image is 2 wide and 2 / image high; the fit leaves no part of it out.
                let half_width = (view / image).max(1.0) / zoom;
                let middle = Vec2::new(2.0 * centre.x - 1.0, (1.0 - 2.0 * centre.y) / image);
                let half = Vec2::new(half_width, half_width / view);
                let (low, high) = (middle - half, middle + half);
                projection::orthographic(low.x, high.x, low.y, high.y, -1.0, 1.0)
            }
            Pose::Plane { eye, yaw, pitch } => {
                let forward = Vec3::new(-yaw.sin() * pitch.cos(), yaw.cos() * pitch.cos(), -pitch.sin());
                let (near, eye) = (0.01 * eye.z.abs().max(0.01), eye + ground * Vec3::Z);
                perspective(view, eye, eye + forward, near, 20.0)
            }
            Pose::Globe { longitude, latitude, altitude } => {
                let down = direction(longitude, latitude);
                let eye = down * (1.0 + ground + altitude);
                perspective(view, eye, Vec3::ZERO, 0.1 * altitude, eye.length() + 1.0)
            }
        }
    }

    /// Pixels of a picture along a texel of level 0 of an image of so many; nothing where perspective makes them differ.
    pub fn magnification(&self, picture: [u32; 2], image: [u32; 2]) -> Option<f64> {
        let Pose::Image { zoom, .. } = *self else { return None };
        // What of the image fits into the picture at a zoom of 1.
        let fitting = |axis: usize| f64::from(picture[axis].max(1)) / f64::from(image[axis].max(1));
        Some(f64::from(zoom) * fitting(0).min(fitting(1)))
    }

    /// Where the camera is in the world, the ground below it not being counted.
    pub(crate) fn eye(&self) -> Vec3 {
        match *self {
            Pose::Image { centre, zoom } => (2.0 * centre - 1.0).extend(1.0 / zoom),
            Pose::Plane { eye, .. } => eye,
            Pose::Globe { longitude, latitude, altitude } => {
                direction(longitude, latitude) * (1.0 + altitude)
            }
        }
    }

    /// Where the camera is, as traces say it: over which point of the surface, and the logarithm of how near, in levels.
    pub fn place(&self) -> [f32; 3] {
        match *self {
            Pose::Image { centre, zoom } => [centre.x, centre.y, zoom.log2()],
            Pose::Plane { eye, .. } => [eye.x, eye.y, eye.z.abs().max(f32::MIN_POSITIVE).log2()],
            Pose::Globe { longitude, latitude, altitude } => [longitude, latitude, altitude.log2()],
        }
    }

    /// The pose after the pointer was dragged by `delta`, in view heights (x right, y down).
    pub fn dragged(self, delta: Vec2, view: f32, image: f32) -> Pose {
        match self {
            Pose::Image { centre, zoom } => {
                let height = (view / image).max(1.0) / zoom / view; // half the view's height, in half image widths
                let moved = centre - delta * Vec2::new(height, height * image);
                Pose::Image { centre: moved.clamp(Vec2::ZERO, Vec2::ONE), zoom }
            }
            Pose::Plane { eye, yaw, pitch } => {
                let (yaw, pitch) = (yaw + delta.x * FIELD_OF_VIEW, pitch - delta.y * FIELD_OF_VIEW);
                Pose::Plane { eye, yaw, pitch: pitch.clamp(-1.5, 1.5) }
            }
            Pose::Globe { longitude, latitude, altitude } => {
                // What lies under the pointer stays there, near the middle of the view.
                let angle = delta * altitude * 2.0 * (FIELD_OF_VIEW / 2.0).tan();
                Pose::Globe {
                    longitude: longitude - angle.x / latitude.cos().max(0.1),
                    latitude: (latitude + angle.y).clamp(-LATITUDE_LIMIT, LATITUDE_LIMIT),
                    altitude,
                }
            }
        }
    }

    /// The pose after zooming in by `factor` (above 1) or out (below 1).
    pub fn zoomed(self, factor: f32) -> Pose {
        match self {
            Pose::Image { centre, zoom } => Pose::Image { centre, zoom: (zoom * factor).clamp(0.1, 1e5) },
            Pose::Plane { eye, yaw, pitch } => {
                Pose::Plane { eye: eye.with_z((eye.z / factor).clamp(0.0005, 10.0)), yaw, pitch }
            }
            Pose::Globe { longitude, latitude, altitude } => {
                Pose::Globe { longitude, latitude, altitude: (altitude / factor).clamp(0.0005, 20.0) }
            }
        }
    }

    /// Looking the other way: at what lies behind, on the other side of the globe, or at the image's opposite part.
    pub fn turned_round(self) -> Pose {
        match self {
            Pose::Image { centre, zoom } => Pose::Image { centre: Vec2::ONE - centre, zoom },
            Pose::Plane { eye, yaw, pitch } => Pose::Plane { eye, yaw: yaw + std::f32::consts::PI, pitch },
            Pose::Globe { longitude, latitude, altitude } => {
                Pose::Globe { longitude: longitude + std::f32::consts::PI, latitude: -latitude, altitude }
            }
        }
    }

    /// The pose after a step of `step` (x to the right, y forward), in units that suit the height above what is seen.
    pub fn walked(self, step: Vec2) -> Pose {
        match self {
            Pose::Image { centre, zoom } => {
                let moved = centre + Vec2::new(step.x, -step.y) / zoom;
                Pose::Image { centre: moved.clamp(Vec2::ZERO, Vec2::ONE), zoom }
            }
            Pose::Plane { eye, yaw, pitch } => {
                let (sin, cos) = yaw.sin_cos();
                let along = Vec3::new(step.x * cos - step.y * sin, step.x * sin + step.y * cos, 0.0);
                Pose::Plane { eye: eye + along * 2.0 * eye.z.abs().max(0.001), yaw, pitch }
            }
            Pose::Globe { longitude, latitude, altitude } => Pose::Globe {
                longitude: longitude + step.x * altitude / latitude.cos().max(0.1),
                latitude: (latitude + step.y * altitude).clamp(-LATITUDE_LIMIT, LATITUDE_LIMIT),
                altitude,
            },
        }
    }
}

fn perspective(view: f32, eye: Vec3, target: Vec3, near: f32, far: f32) -> Mat4 {
    projection::perspective(FIELD_OF_VIEW, view, near, far) * look_at_mat4(eye, target, Vec3::Z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn on_screen(pose: Pose, view: f32, image: f32, world: Vec3) -> Vec2 {
        let clip = pose.clip_from_world(view, image) * world.extend(1.0);
        Vec2::new(clip.x, clip.y) / clip.w
    }

    #[test]
    fn the_magnification_is_that_of_the_picture() {
        let pose = |zoom| Pose::Image { centre: Vec2::splat(0.5), zoom };
        assert_eq!(pose(1.0).magnification([1000, 1000], [2000, 1000]), Some(0.5), "fitted by its width");
        assert_eq!(pose(3.0).magnification([1000, 250], [2000, 1000]), Some(0.75), "and by its height");
        let halves = on_screen(pose(3.0), 4.0, 2.0, Vec3::new(1.0, 0.5, 0.0)).y; // half the image, in half views
        assert!((halves * 250.0 / 1000.0 - 0.75).abs() < 1e-5, "as the matrix has it: {halves}");
        assert_eq!(Pose::first(Scene::Globe).magnification([1000, 1000], [2000, 1000]), None);
    }

    #[test]
    fn an_image_fits_the_view_whatever_their_shapes() {
        for (view, image) in [(16.0 / 9.0, 2.0), (1.0, 2.0), (2.0, 0.5), (1.0, 1.0)] {
            let corner = on_screen(Pose::first(Scene::Image), view, image, Vec3::new(1.0, 1.0 / image, 0.0));
            assert!((corner.max_element() - 1.0).abs() < 1e-5, "{corner} of {image} in {view}");
            assert!(corner.min_element() > 0.0);
        }
    }

    #[test]
    fn a_dragged_image_follows_the_pointer() {
        let (view, image) = (1.5, 2.0);
        let pose = Pose::Image { centre: Vec2::splat(0.5), zoom: 4.0 };
        let before = on_screen(pose, view, image, Vec3::ZERO);
        let after = on_screen(pose.dragged(Vec2::new(0.1, 0.05), view, image), view, image, Vec3::ZERO);
        let moved = (after - before) * Vec2::new(view, -1.0) / 2.0; // from clip units to view heights, y down
        assert!((moved - Vec2::new(0.1, 0.05)).length() < 1e-5, "{moved}");
    }

    #[test]
    fn the_globe_is_in_the_middle_with_north_up() {
        let pose = Pose::first(Scene::Globe);
        assert!(on_screen(pose, 1.6, 2.0, Vec3::ZERO).length() < 1e-5);
        assert!(on_screen(pose, 1.6, 2.0, Vec3::Z).y > 0.0);
    }
}
