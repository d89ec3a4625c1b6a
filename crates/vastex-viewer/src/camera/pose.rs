//! Where a camera is, in the words of its scene, and the matrix that follows from it.
//!
//! How poses follow one another is `path`'s business, what is drawn `surface`'s.

use glam::camera::rh::{proj::directx as projection, view::look_at_mat4};
use glam::{DMat2, DVec2, DVec3, Mat4, Vec2, Vec3};

use super::aim::{Aim, world_from_local};
use super::orientation::Orientation;
use crate::scene::{Scene, direction, direction_f64};

/// A camera in one of the scenes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pose {
    /// Looking straight at the image.
    Image {
        /// The point of the image in the middle of the view, in uv.
        centre: DVec2,
        /// How much of the view the whole image fills: 1 fits it in, 10 shows a tenth of it.
        zoom: f64,
        /// How the image is turned.
        orientation: Orientation,
    },
    /// Standing over the rectangle of 2 by 2h/w at z = 0, whose centre is the origin, or over a terrain on
    /// it.
    Plane {
        /// Where the camera is; z from the ground below it.
        eye: DVec3,
        /// Turn to the left from +y, in radians.
        yaw: f64,
        /// Turn downwards from the horizon, in radians.
        pitch: f64,
    },
    /// Over the unit sphere.
    Globe {
        /// Longitude below the camera, in radians; 0 is in the middle of the image.
        longitude: f64,
        /// Latitude below the camera, in radians, north positive.
        latitude: f64,
        /// Height above the ground, in radii.
        altitude: f64,
        /// Where the camera looks.
        aim: Aim,
    },
}

/// Vertical field of view of the scenes with perspective: 60 degrees.
pub(crate) const FIELD_OF_VIEW: f64 = std::f64::consts::FRAC_PI_3;
/// Pixels of 2^31 texels at 1000 pixels a texel, in a picture of 1000.
const MOST_ZOOM: f64 = 4e9;
/// A thousandth of a texel of 2^31 round the globe, about.
pub(super) const LEAST_ALTITUDE: f64 = 1e-10;
/// How far from the ground a camera over a globe goes, in radii.
pub(super) const MOST_ALTITUDE: f64 = 20.0;
/// Over a plane: how near to the ground a camera comes, and how far it goes.
pub(super) const LEAST_HEIGHT: f64 = 0.0005;
pub(super) const MOST_HEIGHT: f64 = 10.0;
/// Radii of the Earth in a metre.
pub(crate) const METRE: f64 = 1.0 / 6_371_000.0;
/// How close a latitude may come to a pole, so that north stays up.
const LATITUDE_LIMIT: f64 = std::f64::consts::FRAC_PI_2 - 1e-9;

impl Pose {
    /// Looking at an image as it is stored: the uv in the middle of the view, and how much of the view all of
    /// the image fills.
    pub const fn image(centre: DVec2, zoom: f64) -> Pose {
        Pose::Image { centre, zoom, orientation: Orientation::UPRIGHT }
    }

    /// Over the unit sphere, looking at its centre, north up: longitude and latitude in radians, altitude in
    /// radii.
    pub const fn globe(longitude: f64, latitude: f64, altitude: f64) -> Pose {
        Pose::Globe { longitude, latitude, altitude, aim: Aim::DOWN }
    }

    /// This camera, looking elsewhere; only one over a globe can.
    #[must_use]
    pub fn with_aim(self, aim: Aim) -> Pose {
        match self {
            Pose::Globe { longitude, latitude, altitude, .. } => {
                Pose::Globe { longitude, latitude, altitude, aim }
            }
            other => other,
        }
    }

    /// The scene that it is a pose of. Those of plane and terrain are alike, and those of globe and planet:
    /// it is that of the two which is displayed, else the first.
    pub fn scene(&self, displayed: Scene) -> Scene {
        match self {
            Pose::Image { .. } => Scene::Image,
            Pose::Globe { .. } if displayed == Scene::Planet => Scene::Planet,
            Pose::Globe { .. } => Scene::Globe,
            Pose::Plane { .. } if displayed == Scene::Terrain => Scene::Terrain,
            Pose::Plane { .. } => Scene::Plane,
        }
    }

    /// The pose of a scene where nobody asks for another.
    pub fn first(scene: Scene) -> Pose {
        match scene {
            Scene::Image => Pose::image(DVec2::splat(0.5), 1.0),
            Scene::Plane => Pose::Plane {
                eye: DVec3::new(0.0, -0.45, 0.29),
                yaw: 0.0,
                pitch: std::f64::consts::FRAC_PI_4,
            },
            Scene::Terrain => Pose::Plane { eye: DVec3::new(0.0, -0.6, 0.16), yaw: 0.0, pitch: 0.3 },
            Scene::Globe | Scene::Planet => Pose::globe(0.2, 0.5, 1.3),
        }
    }

    /// Clip space from world space. `view` and `image` are width over height.
    pub fn clip_from_world(&self, view: f64, image: f64) -> Mat4 {
        self.clip_from_world_over(view, image, 0.0)
    }

    /// The same where the ground below the camera is higher than the surface would be without heights.
    ///
    /// In single precision, as the meshes are whose corners it places; what is seen so near that this would
    /// show is drawn in fixed point, from the pose itself.
    pub(crate) fn clip_from_world_over(&self, view: f64, image: f64, ground: f32) -> Mat4 {
        let (view, image) = (view as f32, image as f32);
        match *self {
            // The image is 2 wide and 2 / image high; the fit leaves no part of it out.
            Pose::Image { centre, orientation, .. } if orientation != Orientation::UPRIGHT => {
                let half_height = self.view_height(view.into(), image.into()) as f32;
                let half = Vec2::new(half_height * view, half_height);
                let centre = centre.as_vec2();
                let middle = Vec2::new(2.0 * centre.x - 1.0, (1.0 - 2.0 * centre.y) / image);
                // From steps to the right and downwards to those upwards.
                let DMat2 { x_axis, y_axis } = orientation.seen_from_image();
                let seen = Mat4::from_cols_array_2d(&[
                    [x_axis.x as f32, -x_axis.y as f32, 0.0, 0.0],
                    [-y_axis.x as f32, y_axis.y as f32, 0.0, 0.0],
                    [0.0, 0.0, 1.0, 0.0],
                    [0.0, 0.0, 0.0, 1.0],
                ]);
                projection::orthographic(-half.x, half.x, -half.y, half.y, -1.0, 1.0)
                    * seen
                    * Mat4::from_translation(-middle.extend(0.0))
            }
            Pose::Image { centre, zoom, .. } => {
                let half_width = (view / image).max(1.0) / zoom as f32;
                let centre = centre.as_vec2();
                let middle = Vec2::new(2.0 * centre.x - 1.0, (1.0 - 2.0 * centre.y) / image);
                let half = Vec2::new(half_width, half_width / view);
                let (low, high) = (middle - half, middle + half);
                projection::orthographic(low.x, high.x, low.y, high.y, -1.0, 1.0)
            }
            Pose::Plane { eye, yaw, pitch } => {
                let (eye, yaw, pitch) = (eye.as_vec3(), yaw as f32, pitch as f32);
                let forward = Vec3::new(-yaw.sin() * pitch.cos(), yaw.cos() * pitch.cos(), -pitch.sin());
                let (near, eye) = (0.01 * eye.z.abs().max(0.01), eye + ground * Vec3::Z);
                perspective(view, eye, eye + forward, near, 20.0)
            }
            Pose::Globe { longitude, latitude, altitude, aim } => {
                let down = direction(longitude as f32, latitude as f32);
                let altitude = altitude as f32;
                let eye = down * (1.0 + ground + altitude);
                let (near, far) = (0.1 * altitude, eye.length() + 1.0);
                if aim == Aim::DOWN {
                    return perspective(view, eye, Vec3::ZERO, near, far);
                }
                let [_, up, ahead] = self.axes().map(|axis| axis.as_vec3());
                projection::perspective(FIELD_OF_VIEW as f32, view, near, far)
                    * look_at_mat4(eye, eye + ahead, up)
            }
        }
    }

    /// Pixels of a picture along a texel of level 0 of an image of so many; `None` if perspective makes them
    /// differ.
    pub fn magnification(&self, picture: [u32; 2], image: [u32; 2]) -> Option<f64> {
        let Pose::Image { zoom, orientation, .. } = *self else { return None };
        // What of the image fits into the picture at a zoom of 1.
        let extent = orientation.extent(DVec2::from(image.map(|side| f64::from(side.max(1)))));
        let fitting = |axis: usize| f64::from(picture[axis].max(1)) / extent[axis];
        Some(zoom * fitting(0).min(fitting(1)))
    }

    /// The pose in which all of an image of so many columns and rows fits into a part of a picture, upright
    /// and in its middle: into `free`, the part's corners in pixels from the top left, and not beyond.
    ///
    /// The middle of the picture always shows some of the image. Where that lies nearer to an edge of the
    /// part than half the image, the image is as near to the part's middle as this allows; where it lies
    /// outside the part, the image fits into what reaches from it to the part's far end, for that shows more
    /// of the image than any other pose.
    pub fn fitted(picture: [u32; 2], image: [u32; 2], [low, high]: [DVec2; 2]) -> Pose {
        let sides = |sides: [u32; 2]| DVec2::from(sides.map(|side| f64::from(side.max(1))));
        let (picture, image) = (sides(picture), sides(image));
        let (low, high) = (low.min(picture / 2.0), high.max(picture / 2.0));
        // Pixels a texel.
        let scale = ((high - low).max(DVec2::ONE) / image).min_element();
        let beside = (picture - (low + high)) / 2.0;
        let centre = (DVec2::splat(0.5) + beside / (scale * image)).clamp(DVec2::ZERO, DVec2::ONE);
        Pose::image(centre, scale / (picture / image).min_element())
    }

    /// Height of the view of an image, in widths of the image; 0 in scenes with perspective. `view` and
    /// `image` are width over height.
    pub(super) fn view_height(&self, view: f64, image: f64) -> f64 {
        let Pose::Image { zoom, orientation, .. } = *self else { return 0.0 };
        let extent = orientation.extent(DVec2::new(1.0, 1.0 / image));
        (extent.x / view).max(extent.y) / zoom
    }

    /// The nearest pose of an image in which the corner of a pixel lies on the corner of the image's first
    /// texel, or would if there were more of the image. One that is turned by no whole quarter stays as it
    /// is.
    pub(crate) fn aligned(self, picture: [u32; 2], image: [u32; 2]) -> Pose {
        let (Pose::Image { centre, zoom, orientation }, Some(scale)) =
            (self, self.magnification(picture, image))
        else {
            return self;
        };
        if !orientation.is_axis_aligned() {
            return self;
        }
        let picture = orientation.extent(DVec2::from(picture.map(f64::from)));
        let [centre_x, centre_y] = [0, 1].map(|axis| {
            let (middle, pixels) = (picture[axis] / 2.0, f64::from(image[axis]) * scale);
            // Of the pixels whose middle view lies over the image, the nearest.
            let (first, last) = ((-middle).ceil(), (pixels - middle).floor());
            let edge = (centre[axis] * pixels - middle).round().clamp(first.min(last), last.max(first));
            ((edge + middle) / pixels).clamp(0.0, 1.0)
        });
        Pose::Image { centre: DVec2::new(centre_x, centre_y), zoom, orientation }
    }

    /// Where the camera is in the world, the ground below it not being counted.
    pub(crate) fn eye(&self) -> DVec3 {
        match *self {
            Pose::Image { centre, zoom, .. } => (2.0 * centre - 1.0).extend(1.0 / zoom),
            Pose::Plane { eye, .. } => eye,
            Pose::Globe { longitude, latitude, altitude, .. } => {
                direction_f64(longitude, latitude) * (1.0 + altitude)
            }
        }
    }

    /// Directions of a camera over a globe, in the world: to the right, upwards in the picture and ahead. Of
    /// other cameras those of one that looks down.
    pub(crate) fn axes(&self) -> [DVec3; 3] {
        let Pose::Globe { longitude, latitude, aim, .. } = *self else {
            return [DVec3::X, DVec3::Y, -DVec3::Z];
        };
        let axes = world_from_local(longitude, latitude) * aim.local_from_view();
        [axes.x_axis, axes.y_axis, axes.z_axis]
    }

    /// Where the camera is, as traces say it: over which point of the surface, and the logarithm of how near,
    /// in levels.
    pub fn place(&self) -> [f32; 3] {
        let place = match *self {
            Pose::Image { centre, zoom, .. } => [centre.x, centre.y, zoom.log2()],
            Pose::Plane { eye, .. } => [eye.x, eye.y, eye.z.abs().max(f64::MIN_POSITIVE).log2()],
            Pose::Globe { longitude, latitude, altitude, .. } => [longitude, latitude, altitude.log2()],
        };
        place.map(|number| number as f32)
    }

    /// The pose after the pointer was dragged by `delta`, in view heights (x right, y down).
    pub fn dragged(self, delta: DVec2, view: f64, image: f64) -> Pose {
        match self {
            Pose::Plane { eye, yaw, pitch } => {
                let (yaw, pitch) = (yaw + delta.x * FIELD_OF_VIEW, pitch - delta.y * FIELD_OF_VIEW);
                Pose::Plane { eye, yaw, pitch: pitch.clamp(-1.5, 1.5) }
            }
            _ => self.at(self.over() + self.drag(delta, view, image)),
        }
    }

    /// By how much a drag by `delta` moves what the camera of an image or a globe is over ([`Pose::over`]).
    pub(crate) fn drag(self, delta: DVec2, view: f64, image: f64) -> DVec2 {
        match self {
            Pose::Image { orientation, .. } => {
                let height = self.view_height(view, image);
                -(orientation.image_from_seen() * delta) * DVec2::new(height, height * image)
            }
            Pose::Globe { latitude, altitude, aim, .. } => {
                // What lies under the pointer stays there, near the middle of the view.
                let angle = delta * altitude * 2.0 * (FIELD_OF_VIEW / 2.0).tan();
                let (sine, cosine) = aim.heading().sin_cos();
                let east = angle.y * sine - angle.x * cosine;
                DVec2::new(east / latitude.cos().max(0.1), angle.y * cosine + angle.x * sine)
            }
            Pose::Plane { .. } => DVec2::ZERO,
        }
    }

    /// What a camera is over: uv of an image, x and y of the plane, longitude and latitude of the globe.
    pub(crate) fn over(self) -> DVec2 {
        match self {
            Pose::Image { centre, .. } => centre,
            Pose::Plane { eye, .. } => eye.truncate(),
            Pose::Globe { longitude, latitude, .. } => DVec2::new(longitude, latitude),
        }
    }

    /// This camera over another point, or the nearest to it that it may be over.
    pub(crate) fn at(self, over: DVec2) -> Pose {
        match self {
            Pose::Image { zoom, orientation, .. } => {
                Pose::Image { centre: over.clamp(DVec2::ZERO, DVec2::ONE), zoom, orientation }
            }
            Pose::Plane { eye, yaw, pitch } => Pose::Plane { eye: over.extend(eye.z), yaw, pitch },
            Pose::Globe { altitude, aim, .. } => {
                let latitude = over.y.clamp(-LATITUDE_LIMIT, LATITUDE_LIMIT);
                Pose::Globe { longitude: over.x, latitude, altitude, aim }
            }
        }
    }

    /// This camera with a place of the image, in uv, in the middle of its view; over a globe, above it.
    /// `image` is the image's width over its height. `None` where a camera that looks so sees no such place
    /// there.
    #[cfg(feature = "egui")]
    pub(crate) fn over_uv(self, uv: DVec2, image: f64) -> Option<Pose> {
        use std::f64::consts::{PI, TAU};
        match self {
            Pose::Image { .. } => Some(self.at(uv)),
            Pose::Globe { .. } => Some(self.at(DVec2::new((uv.x - 0.5) * TAU, (0.5 - uv.y) * PI))),
            Pose::Plane { .. } => {
                let place = DVec3::new(2.0 * uv.x - 1.0, (1.0 - 2.0 * uv.y) / image, 0.0);
                self.seeing(place, DVec2::ZERO)
            }
        }
    }

    /// The pose after zooming in by `factor` (above 1) or out (below 1).
    pub fn zoomed(self, factor: f64) -> Pose {
        match self {
            Pose::Image { centre, zoom, orientation } => {
                // A small image may be smaller already, at a pixel a texel.
                let zoom = (zoom * factor).clamp(zoom.min(0.1), MOST_ZOOM);
                Pose::Image { centre, zoom, orientation }
            }
            Pose::Plane { eye, yaw, pitch } => {
                Pose::Plane { eye: eye.with_z((eye.z / factor).clamp(LEAST_HEIGHT, MOST_HEIGHT)), yaw, pitch }
            }
            Pose::Globe { longitude, latitude, altitude, aim } => {
                let altitude = (altitude / factor).clamp(LEAST_ALTITUDE, MOST_ALTITUDE);
                Pose::Globe { longitude, latitude, altitude, aim }
            }
        }
    }

    /// Looking the other way: at what lies behind, on the other side of the globe, or at the image's opposite
    /// part.
    pub fn turned_round(self) -> Pose {
        match self {
            Pose::Image { centre, zoom, orientation } => {
                Pose::Image { centre: DVec2::ONE - centre, zoom, orientation }
            }
            Pose::Plane { eye, yaw, pitch } => Pose::Plane { eye, yaw: yaw + std::f64::consts::PI, pitch },
            Pose::Globe { longitude, latitude, altitude, aim } => {
                let longitude = longitude + std::f64::consts::PI;
                Pose::Globe { longitude, latitude: -latitude, altitude, aim }
            }
        }
    }

    /// The pose after a step of `step` (x to the right, y forward, as they are seen), in units that suit the
    /// height above what is seen: of an image in its longer side over the zoom. `image` is the image's width
    /// over its height; other scenes have no use for it.
    pub fn walked(self, step: DVec2, image: f64) -> Pose {
        match self {
            Pose::Image { centre, zoom, orientation } => {
                // Steps along columns and rows are of one length in texels, and turn into shares of the width
                // and the height after that.
                let shares = image.max(1.0) * DVec2::new(1.0 / image, 1.0);
                let moved =
                    centre + orientation.image_from_seen() * DVec2::new(step.x, -step.y) * shares / zoom;
                Pose::Image { centre: moved.clamp(DVec2::ZERO, DVec2::ONE), zoom, orientation }
            }
            Pose::Plane { eye, yaw, pitch } => {
                let (sin, cos) = yaw.sin_cos();
                let along = DVec3::new(step.x * cos - step.y * sin, step.x * sin + step.y * cos, 0.0);
                Pose::Plane { eye: eye + along * 2.0 * eye.z.abs().max(0.001), yaw, pitch }
            }
            Pose::Globe { longitude, latitude, altitude, aim } => {
                let (sine, cosine) = aim.heading().sin_cos();
                let (east, north) = (step.x * cosine + step.y * sine, step.y * cosine - step.x * sine);
                let longitude = longitude + east * altitude / latitude.cos().max(0.1);
                let latitude = (latitude + north * altitude).clamp(-LATITUDE_LIMIT, LATITUDE_LIMIT);
                Pose::Globe { longitude, latitude, altitude, aim }
            }
        }
    }
}

fn perspective(view: f32, eye: Vec3, target: Vec3, near: f32, far: f32) -> Mat4 {
    projection::perspective(FIELD_OF_VIEW as f32, view, near, far) * look_at_mat4(eye, target, Vec3::Z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn on_screen(pose: Pose, view: f64, image: f64, world: DVec3) -> DVec2 {
        let clip = pose.clip_from_world(view, image).as_dmat4() * world.extend(1.0);
        DVec2::new(clip.x, clip.y) / clip.w
    }

    #[test]
    fn the_magnification_is_that_of_the_picture() {
        let pose = |zoom| Pose::image(DVec2::splat(0.5), zoom);
        assert_eq!(pose(1.0).magnification([1000, 1000], [2000, 1000]), Some(0.5), "fitted by its width");
        assert_eq!(pose(3.0).magnification([1000, 250], [2000, 1000]), Some(0.75), "and by its height");
        let halves = on_screen(pose(3.0), 4.0, 2.0, DVec3::new(1.0, 0.5, 0.0)).y; // half the image, in half views
        assert!((halves * 250.0 / 1000.0 - 0.75).abs() < 1e-5, "as the matrix has it: {halves}");
        assert_eq!(Pose::first(Scene::Globe).magnification([1000, 1000], [2000, 1000]), None);
    }

    #[test]
    fn an_image_fits_into_the_part_of_a_picture_that_is_free() {
        let (picture, image) = ([1280, 800], [4000, 2000]);
        let corners = |low: [f64; 2], high: [f64; 2]| [DVec2::from(low), DVec2::from(high)];
        let whole = Pose::fitted(picture, image, corners([0.0; 2], [1280.0, 800.0]));
        assert_eq!(whole, Pose::first(Scene::Image), "nothing is covered");
        let pose = Pose::fitted(picture, image, corners([348.0, 0.0], [960.0, 800.0]));
        let pixel = |x: f64, y: f64| {
            let clip = on_screen(pose, 1.6, 2.0, DVec3::new(x, y / 2.0, 0.0));
            (clip * DVec2::new(0.5, -0.5) + 0.5) * DVec2::new(1280.0, 800.0)
        };
        let (first, last) = (pixel(-1.0, 1.0), pixel(1.0, -1.0));
        assert!((first - DVec2::new(348.0, 400.0 - 153.0)).length() < 0.1, "{first}");
        assert!((last - DVec2::new(960.0, 400.0 + 153.0)).length() < 0.1, "{last}");
    }

    #[test]
    fn of_an_image_beside_a_wide_panel_as_much_is_seen_as_can_be() {
        // The columns that a square, or an image four times as high as wide, takes in the picture.
        let columns = |picture: [u32; 2], image: [u32; 2], free: [f64; 2]| {
            let corners = [DVec2::new(free[0], 0.0), DVec2::new(free[1], picture[1].into())];
            let pose = Pose::fitted(picture, image, corners);
            let [width, height] = picture.map(f64::from);
            let [columns, rows] = image.map(f64::from);
            [-1.0, 1.0].map(|x| {
                let clip = on_screen(pose, width / height, columns / rows, DVec3::X * x);
                ((clip.x * 0.5 + 0.5) * width).round()
            })
        };
        let square = |picture: [u32; 2]| columns(picture, [2000, 2000], [348.0, picture[0].into()]);
        assert_eq!(square([420, 420]), [210.0, 420.0], "72 of 210");
        assert_eq!(square([512, 512]), [256.0, 512.0], "164 of 256");
        assert_eq!(square([640, 480]), [320.0, 640.0], "292 of 320");
        assert_eq!(square([320, 240]), [160.0, 320.0], "all is covered");
        assert_eq!(columns([600, 800], [500, 2000], [0.0, 280.0]), [100.0, 300.0], "180 of 200");
        // Nearer to the panel than to the other edge, and yet beside it.
        assert_eq!(columns([1000, 800], [500, 2000], [450.0, 1000.0]), [500.0, 700.0]);
    }

    #[test]
    fn an_image_fits_the_view_whatever_their_shapes() {
        for (view, image) in [(16.0 / 9.0, 2.0), (1.0, 2.0), (2.0, 0.5), (1.0, 1.0)] {
            let corner = on_screen(Pose::first(Scene::Image), view, image, DVec3::new(1.0, 1.0 / image, 0.0));
            assert!((corner.max_element() - 1.0).abs() < 1e-5, "{corner} of {image} in {view}");
            assert!(corner.min_element() > 0.0);
        }
    }

    #[test]
    fn a_dragged_image_follows_the_pointer() {
        let (view, image) = (1.5, 2.0);
        let pose = Pose::image(DVec2::splat(0.5), 4.0);
        let before = on_screen(pose, view, image, DVec3::ZERO);
        let after = on_screen(pose.dragged(DVec2::new(0.1, 0.05), view, image), view, image, DVec3::ZERO);
        let moved = (after - before) * DVec2::new(view, -1.0) / 2.0; // from clip units to view heights, y down
        assert!((moved - DVec2::new(0.1, 0.05)).length() < 1e-5, "{moved}");
    }

    #[test]
    fn the_globe_is_in_the_middle_with_north_up() {
        let pose = Pose::first(Scene::Globe);
        assert!(on_screen(pose, 1.6, 2.0, DVec3::ZERO).length() < 1e-5);
        assert!(on_screen(pose, 1.6, 2.0, DVec3::Z).y > 0.0);
    }
}
