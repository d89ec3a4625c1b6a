//! Moves of a camera over ground with heights: what is seen under the pointer, a mountain as well as a
//! valley, stays under it. In f64.
//!
//! A pose tells how high a camera is above the ground below it. Here it is told for a while how high it is
//! above the surface without heights, which does not change where it is moved over a slope; where the camera
//! ends, the ground below that is taken off again. So a drag goes straight on over hill and dale.

use glam::{DVec2, DVec3};

use super::aim::{Aim, world_from_local};
use super::ground::axes_of_plane;
use super::pose::{LEAST_ALTITUDE, LEAST_HEIGHT, MOST_ALTITUDE, MOST_HEIGHT, Pose};
use super::rays::{Ground, Ray};

/// By how much longer or shorter the way to what is held may become by a drag: along a slope that is seen
/// from its side there is no good place for the camera.
const MOST_STRETCHED: f64 = 4.0;

/// The heights of the ground, as the moves of a camera ask for them; in the world, in which a globe has a
/// radius of 1 and a plane a width of 2.
pub trait GroundHeights {
    /// How high the ground is below the camera of a pose, above the surface without heights.
    fn below(&mut self, pose: &Pose) -> f64;

    /// How far from the camera of a pose the ground is met by the ray through a place of the view, told in
    /// view heights from its middle, x to the right and y downwards; `None` where no ground is seen.
    fn distance(&mut self, pose: &Pose, point: DVec2) -> Option<f64>;
}

/// A point of the ground that is held.
struct Held {
    /// The camera, as high above the surface without heights as its pose says.
    camera: Pose,
    ray: Ray,
    ground: Ground,
    /// How far it is from the camera.
    distance: f64,
    /// How high it lies, and where: on a globe from its middle, on a plane from its origin.
    height: f64,
    place: DVec3,
}

impl Held {
    fn new(pose: Pose, point: DVec2, heights: &mut dyn GroundHeights) -> Option<Held> {
        let distance = heights.distance(&pose, point).filter(|distance| *distance > 0.0)?;
        let camera = pose.risen(heights.below(&pose));
        let (ray, ground) = (camera.ray(point)?, camera.ground(1.0)?);
        let met = ray.at(distance);
        let place = match camera {
            Pose::Image { .. } => return None,
            Pose::Plane { eye, .. } => met + eye.with_z(0.0),
            Pose::Globe { longitude, latitude, .. } => {
                world_from_local(longitude, latitude) * (met + DVec3::Z)
            }
        };
        Some(Held { camera, ray, ground, distance, height: ground.height(met), place })
    }

    /// The camera at such a height and with such an aim that sees it at a place of the view, from about as
    /// far away as `away`.
    fn seen_by(&self, camera: Pose, point: DVec2, away: f64) -> Option<Pose> {
        let (ray, ground) = (camera.ray(point)?, camera.ground(1.0)?);
        match camera {
            Pose::Image { .. } => None,
            Pose::Plane { eye, yaw, pitch } => {
                let along = (self.height - eye.z) / ray.direction.z;
                let is_near = (away / MOST_STRETCHED..away * MOST_STRETCHED).contains(&along);
                let eye = (self.place - ray.direction * along).truncate().extend(eye.z);
                (is_near && eye.is_finite()).then_some(Pose::Plane { eye, yaw, pitch })
            }
            Pose::Globe { .. } => {
                let [near, far] = ground.beneath(&ray, self.height)?;
                let is_near = near > 0.0 && (near - away).abs() <= (far - away).abs();
                let along = if is_near { near } else { far };
                let is_alike = (away / MOST_STRETCHED..away * MOST_STRETCHED).contains(&along);
                camera.with_place_at(ray.at(along), self.place).filter(|_| is_alike)
            }
        }
    }
}

impl Pose {
    /// The camera so much higher.
    fn risen(self, by: f64) -> Pose {
        match self {
            Pose::Image { .. } => self,
            Pose::Plane { eye, yaw, pitch } => Pose::Plane { eye: eye.with_z(eye.z + by), yaw, pitch },
            Pose::Globe { longitude, latitude, altitude, aim } => {
                Pose::Globe { longitude, latitude, altitude: altitude + by, aim }
            }
        }
    }

    /// How high the camera is by its pose.
    fn height(&self) -> f64 {
        match *self {
            Pose::Image { .. } => 0.0,
            Pose::Plane { eye, .. } => eye.z,
            Pose::Globe { altitude, .. } => altitude,
        }
    }

    /// How near to the ground a camera comes, and how far away it goes.
    fn heights_allowed(&self) -> [f64; 2] {
        match self {
            Pose::Globe { .. } => [LEAST_ALTITUDE, MOST_ALTITUDE],
            Pose::Image { .. } | Pose::Plane { .. } => [LEAST_HEIGHT, MOST_HEIGHT],
        }
    }

    /// A camera whose height is told from the surface without heights, told from the ground. Where the ground
    /// is higher than it, as low above it as cameras come.
    fn on_ground(self, heights: &mut dyn GroundHeights) -> Pose {
        let [least, _] = self.heights_allowed();
        let above = |below: f64| self.risen(-below).risen((least - (self.height() - below)).max(0.0));
        // How exactly the ground is known there depends on how near it is.
        let about = above(heights.below(&self));
        above(heights.below(&about))
    }

    /// The camera after it came nearer by `factor` to the ground that is seen at a place of the view. `None`
    /// where none is, where the camera would go too far away, and where it goes away from what is no lower
    /// than itself, and so would come to the ground.
    pub(super) fn zoomed_over(
        self,
        factor: f64,
        point: DVec2,
        heights: &mut dyn GroundHeights,
    ) -> Option<Pose> {
        let held = Held::new(self, point, heights)?;
        let [least, most] = self.heights_allowed();
        let away = (held.distance / factor).max(least);
        if factor < 1.0 && held.ray.direction.z > -0.05 {
            return None;
        }
        let moved = held.ray.at(held.distance - away);
        let height = held.ground.height(moved);
        if !(height.is_finite() && height <= most) {
            return None;
        }
        let zoomed = match held.camera {
            Pose::Image { .. } => return None,
            Pose::Plane { eye, yaw, pitch } => {
                Pose::Plane { eye: (eye.truncate() + moved.truncate()).extend(height), yaw, pitch }
            }
            Pose::Globe { longitude, latitude, aim, .. } => {
                let camera = Pose::Globe { longitude, latitude, altitude: height, aim };
                held.seen_by(camera, point, away)?
            }
        };
        Some(zoomed.on_ground(heights))
    }

    /// The camera, as high as before, that sees at a place of the view what it sees now at another one.
    /// `None` where it sees no ground, and where there is no such place that is about as far from it.
    pub(super) fn grabbed_over(
        self,
        from: DVec2,
        to: DVec2,
        heights: &mut dyn GroundHeights,
    ) -> Option<Pose> {
        let held = Held::new(self, from, heights)?;
        let seen = held.seen_by(held.camera, to, held.distance)?;
        Some(seen.on_ground(heights))
    }

    /// The camera turned to the right and tilted towards the horizon round the point of the ground in the
    /// middle of the view, as [`Pose::orbited`] does it without heights. It stays where it would come into a
    /// mountain. `None` where no ground is in the middle.
    pub(super) fn orbited_over(self, turn: f64, tilt: f64, heights: &mut dyn GroundHeights) -> Option<Pose> {
        let held = Held::new(self, DVec2::ZERO, heights)?;
        let away = held.distance;
        let turned = match held.camera {
            Pose::Image { .. } => return None,
            Pose::Plane { yaw, pitch, .. } => {
                let (yaw, pitch) = (yaw - turn, (pitch - tilt).clamp(0.02, 1.5));
                Pose::Plane { eye: held.place - axes_of_plane(yaw, pitch).z_axis * away, yaw, pitch }
            }
            Pose::Globe { longitude, latitude, aim, .. } => {
                let aim = Aim::new(aim.heading() + turn, aim.tilt() + tilt);
                // From the middle of the globe to the point, whose radius is 1 + height, and to the camera.
                let sine = away * aim.tilt().sin();
                let beyond = held.height * (2.0 + held.height) - sine * sine;
                if 1.0 + beyond <= 0.002 {
                    return Some(self);
                }
                let altitude = away * aim.tilt().cos() + beyond / (1.0 + (1.0 + beyond).sqrt());
                let camera = Pose::Globe { longitude, latitude, altitude, aim };
                match held.seen_by(camera, DVec2::ZERO, away) {
                    Some(seen) => seen,
                    None => return Some(self),
                }
            }
        };
        let [least, _] = self.heights_allowed();
        let is_above = turned.height() - heights.below(&turned) > least;
        Some(if is_above { turned.on_ground(heights) } else { self })
    }

    /// This camera, looking straight down, as [`Pose::uprighted`] does it without heights.
    pub(super) fn uprighted_over(self, heights: &mut dyn GroundHeights) -> Option<Pose> {
        match self {
            Pose::Image { .. } => None,
            Pose::Globe { aim, .. } => self.orbited_over(-aim.heading(), -aim.tilt(), heights),
            Pose::Plane { yaw, .. } => self.orbited_over(yaw, 0.0, heights),
        }
    }
}

#[cfg(test)]
mod tests;
