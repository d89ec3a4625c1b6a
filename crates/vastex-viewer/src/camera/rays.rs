//! Rays from a camera through places of its view, and where on the ground they lead. In f64.
//!
//! Places and directions are told by their parts to the east, to the north and upwards, from the point of the
//! ground below the camera; over a plane these are x, y and z. So what is near has small numbers, and keeps
//! all of its digits however large the ground is.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::ground::{axes_of_plane, view_ray};
use super::pose::{FIELD_OF_VIEW, Pose};

/// How far from the camera a plane is seen.
const HORIZON: f64 = 40.0;

/// A ray from a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ray {
    /// Where it begins.
    pub(crate) from: DVec3,
    /// Where it goes; of length 1.
    pub(crate) direction: DVec3,
    /// How much farther ahead of the camera it comes for each unit of its length.
    pub(crate) ahead: f64,
}

impl Ray {
    /// The place so far along.
    pub(crate) fn at(&self, distance: f64) -> DVec3 {
        self.from + self.direction * distance
    }
}

/// The ground without heights, from the point of it below a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ground {
    /// The rectangle of 2 by 2h/w whose middle is the origin of the plane, for an image of w/h.
    Flat {
        /// The point below the camera, on the plane.
        below: DVec2,
        /// Width over height of the image.
        image: f64,
    },
    /// The unit sphere.
    Globe {
        /// Longitude below the camera, in radians.
        longitude: f64,
        /// Latitude below it.
        latitude: f64,
    },
}

impl Pose {
    /// The ground below a camera, for an image of `image` (width over height); `None` for the pose of an
    /// image, which looks at no ground.
    pub(crate) fn ground(&self, image: f64) -> Option<Ground> {
        match *self {
            Pose::Image { .. } => None,
            Pose::Plane { eye, .. } => Some(Ground::Flat { below: eye.truncate(), image }),
            Pose::Globe { longitude, latitude, .. } => Some(Ground::Globe { longitude, latitude }),
        }
    }

    /// The ray through a place of the view, told in view heights from its middle, x to the right and y
    /// downwards; `None` for the pose of an image.
    pub(crate) fn ray(&self, point: DVec2) -> Option<Ray> {
        let (height, turned) = match *self {
            Pose::Image { .. } => return None,
            Pose::Plane { eye, yaw, pitch } => (eye.z, axes_of_plane(yaw, pitch) * view_ray(point)),
            Pose::Globe { altitude, aim, .. } => (altitude, aim.local_from_view() * view_ray(point)),
        };
        let length = turned.length();
        Some(Ray { from: DVec3::new(0.0, 0.0, height), direction: turned / length, ahead: 1.0 / length })
    }

    /// How large a pixel is at a distance ahead of the camera of 1, in a picture of so many rows.
    pub(crate) fn pixel_at_1(rows: u32) -> f64 {
        2.0 * (FIELD_OF_VIEW / 2.0).tan() / f64::from(rows.max(1))
    }
}

impl Ground {
    /// How high a place lies above the ground.
    pub(crate) fn height(&self, place: DVec3) -> f64 {
        match self {
            Ground::Flat { .. } => place.z,
            Ground::Globe { .. } => {
                // Without a difference of numbers that are nearly the same.
                let beyond = place.length_squared() + 2.0 * place.z;
                beyond / (1.0 + (1.0 + beyond).max(0.0).sqrt())
            }
        }
    }

    /// The direction upwards at a place.
    pub(crate) fn up(&self, place: DVec3) -> DVec3 {
        match self {
            Ground::Flat { .. } => DVec3::Z,
            Ground::Globe { .. } => (place + DVec3::Z).normalize_or(DVec3::Z),
        }
    }

    /// The point of the ground below a place.
    pub(crate) fn below(&self, place: DVec3) -> DVec3 {
        match self {
            Ground::Flat { .. } => place.with_z(0.0),
            Ground::Globe { .. } => self.up(place) - DVec3::Z,
        }
    }

    /// The uv below a place: of a globe within 0 to 1, of a plane also beside the image.
    pub(crate) fn uv(&self, place: DVec3) -> DVec2 {
        match *self {
            Ground::Flat { below, image } => {
                let at = below + place.truncate();
                DVec2::new(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y * image)
            }
            Ground::Globe { longitude, latitude } => {
                let (sine, cosine) = latitude.sin_cos();
                let (east, north, up) = (place.x, place.y, 1.0 + place.z);
                let (meridian, axis) = (up * cosine - north * sine, up * sine + north * cosine);
                let (lon, lat) = (longitude + east.atan2(meridian), axis.atan2(meridian.hypot(east)));
                DVec2::new((lon / TAU + 0.5).rem_euclid(1.0), 0.5 - lat / PI)
            }
        }
    }

    /// In the world, for a step of 1 in uv; on the globe at the equator.
    pub(crate) fn extent(&self) -> DVec2 {
        match *self {
            Ground::Flat { image, .. } => DVec2::new(2.0, 2.0 / image),
            Ground::Globe { .. } => DVec2::new(TAU, PI),
        }
    }

    /// Between which distances a ray is no higher than `height` above the ground, whatever lies beneath;
    /// `None` if it never is. Of a plane, only as far as it is seen.
    pub(crate) fn beneath(&self, ray: &Ray, height: f64) -> Option<[f64; 2]> {
        let above = ray.from.z - height;
        match self {
            Ground::Flat { .. } => {
                let fall = -ray.direction.z;
                let [begin, end] = match () {
                    () if fall > 0.0 => [above / fall, f64::INFINITY],
                    () if above > 0.0 => return None,
                    () if fall < 0.0 => [0.0, above / fall],
                    () => [0.0, f64::INFINITY],
                };
                let [begin, end] = [begin.max(0.0), end.min(HORIZON)];
                (begin < end).then_some([begin, end])
            }
            Ground::Globe { .. } => {
                let closest = -ray.direction.z * (1.0 + ray.from.z);
                let power = above * (2.0 + ray.from.z + height);
                let root = closest * closest - power;
                if root < 0.0 {
                    return None;
                }
                // The product of both distances is the power; the larger one has no difference in it.
                let root = root.sqrt();
                let [begin, end] = match closest >= 0.0 {
                    true => [power / (closest + root), closest + root],
                    false => [closest - root, power / (closest - root)],
                };
                (end > 0.0).then_some([begin.max(0.0), end])
            }
        }
    }

    /// The part of a ray between two distances that lies over the image: all of it over a globe.
    pub(crate) fn over_image(&self, ray: &Ray, [begin, end]: [f64; 2]) -> Option<[f64; 2]> {
        let Ground::Flat { below, image } = *self else { return Some([begin, end]) };
        let half = DVec2::new(1.0, 1.0 / image);
        let mut part = [begin, end];
        for axis in 0..2 {
            let (at, way) = (below[axis] + ray.from[axis], ray.direction[axis]);
            if way == 0.0 && at.abs() > half[axis] {
                return None;
            }
            if way != 0.0 {
                let edges = [(-half[axis] - at) / way, (half[axis] - at) / way];
                part = [part[0].max(edges[0].min(edges[1])), part[1].min(edges[0].max(edges[1]))];
            }
        }
        (part[0] <= part[1]).then_some(part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Aim;
    use crate::scene::direction_f64;

    /// Where the ray meets the ground without heights.
    fn met(pose: Pose, image: f64, point: DVec2) -> Option<DVec2> {
        let (ground, ray) = (pose.ground(image).unwrap(), pose.ray(point).unwrap());
        Some(ground.uv(ray.at(ground.beneath(&ray, 0.0)?[0])))
    }

    /// The point of the sphere or the plane at a uv, seen through the matrix that draws meshes.
    #[test]
    fn rays_lead_where_meshes_are_drawn() {
        let (view, image) = (1.6, 2.0);
        let poses = [
            Pose::globe(0.2, 0.5, 1.3),
            Pose::globe(3.1, -1.2, 0.4).with_aim(Aim::new(2.0, 0.5)),
            Pose::Plane { eye: DVec3::new(0.1, -0.45, 0.29), yaw: 0.3, pitch: 0.7 },
        ];
        for pose in poses {
            let clip_from_world = pose.clip_from_world(view, image).as_dmat4();
            for (x, y) in [(0.0, 0.0), (0.2, 0.1), (-0.3, 0.15), (0.1, -0.2)] {
                let point = DVec2::new(x, y);
                let uv = met(pose, image, point).unwrap_or_else(|| panic!("{pose:?} {point}"));
                let world = match pose {
                    Pose::Globe { .. } => direction_f64((uv.x - 0.5) * TAU, (0.5 - uv.y) * PI),
                    _ => DVec3::new(2.0 * uv.x - 1.0, (1.0 - 2.0 * uv.y) / image, 0.0),
                };
                let clip = clip_from_world * world.extend(1.0);
                let seen = DVec2::new(clip.x * view, -clip.y) / (2.0 * clip.w);
                assert!((seen - point).length() < 1e-5, "{pose:?}: {seen} for {point}");
            }
        }
    }

    #[test]
    fn beside_a_globe_and_above_a_horizon_is_nothing() {
        let globe = Pose::globe(0.2, 0.5, 1.3);
        assert!(met(globe, 2.0, DVec2::new(0.9, 0.0)).is_none());
        let plane = Pose::Plane { eye: DVec3::new(0.0, 0.0, 0.3), yaw: 0.0, pitch: 0.2 };
        assert!(met(plane, 2.0, DVec2::new(0.0, -0.4)).is_none());
        let backwards = Pose::globe(0.2, 0.5, 1.3).with_aim(Aim::new(0.0, 1.4));
        assert!(met(backwards, 2.0, DVec2::new(0.0, -0.4)).is_none());
    }

    /// A centimetre of 2^31 texels round the globe.
    #[test]
    fn near_the_ground_no_texel_is_mistaken() {
        let (longitude, latitude, altitude) = (0.3, -0.7, 1e-9);
        let pose = Pose::globe(longitude, latitude, altitude);
        let uv = met(pose, 2.0, DVec2::new(0.25, -0.125)).unwrap();
        let step = 2.0 * (FIELD_OF_VIEW / 2.0).tan() * altitude;
        let expected = DVec2::new(
            (longitude + 0.25 * step / latitude.cos()) / TAU + 0.5,
            0.5 - (latitude + 0.125 * step) / PI,
        );
        let texels = (uv - expected) * DVec2::new((1u64 << 31) as f64, (1u64 << 30) as f64);
        assert!(texels.length() < 1e-5, "{texels}");
    }

    #[test]
    fn a_ray_is_beneath_a_height_between_where_it_comes_and_where_it_goes() {
        let pose = Pose::globe(0.0, 0.0, 0.5).with_aim(Aim::new(0.0, 1.2));
        let (ground, ray) = (pose.ground(2.0).unwrap(), pose.ray(DVec2::ZERO).unwrap());
        for height in [0.6, 0.4] {
            let Some([begin, end]) = ground.beneath(&ray, height) else {
                assert!(height < 0.5);
                continue;
            };
            assert!(begin < end && (begin == 0.0) == (height > 0.5), "{begin} {end}");
            assert!((ground.height(ray.at(end)) - height).abs() < 1e-12);
        }
        let flat = Pose::Plane { eye: DVec3::new(0.0, 0.0, 0.1), yaw: 0.0, pitch: -0.5 };
        let (ground, ray) = (flat.ground(2.0).unwrap(), flat.ray(DVec2::ZERO).unwrap());
        let [begin, end] = ground.beneath(&ray, 0.2).unwrap();
        assert!(begin == 0.0 && (ray.at(end).z - 0.2).abs() < 1e-12);
        assert_eq!(ground.beneath(&ray, 0.05), None, "it rises");
        let [_, end] = ground.over_image(&ray, [0.0, 30.0]).unwrap();
        assert!((ray.at(end).y - 0.5).abs() < 1e-12, "to the edge of the image");
    }
}
