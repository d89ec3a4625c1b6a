//! The ground that a camera sees at a place of its view, without heights, and the camera that sees a point of
//! it at another place. In f64.
//!
//! Places of the view are told in view heights from its middle, x to the right and y downwards, as moves are.

use glam::{DMat3, DVec2, DVec3};

use super::aim::{Aim, world_from_local};
use super::pose::{FIELD_OF_VIEW, Pose};

/// The ray through a place of the view, by its parts to the right, upwards and ahead; the last one is 1.
pub(super) fn view_ray(point: DVec2) -> DVec3 {
    let tangent = 2.0 * (FIELD_OF_VIEW / 2.0).tan();
    DVec3::new(point.x * tangent, -point.y * tangent, 1.0)
}

/// The point of the unit sphere that a camera sees so high above it, from the one below the camera: to the
/// east, to the north and upwards, and how far along the ray it is. Nothing beside the sphere.
fn on_sphere(altitude: f64, aim: Aim, point: DVec2) -> Option<(DVec3, f64)> {
    let ray = (aim.local_from_view() * view_ray(point)).normalize();
    // Along the ray, without a difference of large numbers that are nearly the same.
    let closest = -ray.z * (1.0 + altitude);
    let power = altitude * (2.0 + altitude);
    let rest = closest * closest - power;
    if closest <= 0.0 || rest < 0.0 {
        return None;
    }
    let along = power / (closest + rest.sqrt());
    Some((DVec3::new(0.0, 0.0, altitude) + ray * along, along))
}

/// What a camera sees of the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GroundPoint {
    /// In the world.
    pub(super) place: DVec3,
    /// How far the camera is from it.
    pub(super) distance: f64,
}

/// Directions of a camera over a plane: to the right, upwards in the picture and ahead.
pub(super) fn axes_of_plane(yaw: f64, pitch: f64) -> DMat3 {
    let ahead = DVec3::new(-yaw.sin() * pitch.cos(), yaw.cos() * pitch.cos(), -pitch.sin());
    let right = DVec3::new(yaw.cos(), yaw.sin(), 0.0);
    DMat3::from_cols(right, right.cross(ahead), ahead)
}

impl Pose {
    /// The point of the ground that is seen at a place of the view; `None` if none is, and of an image.
    pub(super) fn ground_at(&self, point: DVec2) -> Option<GroundPoint> {
        match *self {
            Pose::Image { .. } => None,
            Pose::Globe { longitude, latitude, altitude, aim } => {
                let (from_below, distance) = on_sphere(altitude, aim, point)?;
                let place = world_from_local(longitude, latitude) * (from_below + DVec3::Z);
                Some(GroundPoint { place, distance })
            }
            Pose::Plane { eye, yaw, pitch } => {
                let ray = (axes_of_plane(yaw, pitch) * view_ray(point)).normalize();
                let distance = -eye.z / ray.z;
                let place = eye + ray * distance;
                // The plane goes on, but not to where a pixel is a world.
                (distance > 0.0 && distance < 40.0).then_some(GroundPoint { place, distance })
            }
        }
    }

    /// The camera that looks in the same direction from the same height and sees a point of the ground at a
    /// place of the view; `None` if there is none.
    pub(super) fn seeing(self, ground: DVec3, point: DVec2) -> Option<Pose> {
        match self {
            Pose::Image { .. } => None,
            Pose::Globe { altitude, aim, .. } => {
                let (from_below, _) = on_sphere(altitude, aim, point)?;
                self.with_place_at(from_below, ground)
            }
            Pose::Plane { eye, yaw, pitch } => {
                let seen = self.ground_at(point)?;
                let moved = eye + (ground - seen.place).with_z(0.0);
                Some(Pose::Plane { eye: moved, yaw, pitch })
            }
        }
    }

    /// The camera over a globe, as high and looking in the same direction as this one, from which a place of
    /// the world is `from_below`: so far to the east, to the north and upwards of the point of the unit
    /// sphere below the camera. `None` if there is none, and of other cameras.
    pub(super) fn with_place_at(self, from_below: DVec3, place: DVec3) -> Option<Pose> {
        let Pose::Globe { longitude, latitude, .. } = self else { return None };
        let DVec3 { x: east, y: north, z: above } = from_below;
        let up = 1.0 + above;
        // Where the same parts make a point of the same distance from the equator.
        let length = north.hypot(up);
        if place.z.abs() > length {
            return None;
        }
        let (rise, lean) = ((place.z / length).asin(), north.atan2(up));
        // The one of the two that is nearer to where the camera is.
        let either = [rise - lean, std::f64::consts::PI - rise - lean];
        let apart = |latitude_of: &f64| (latitude_of - latitude).abs();
        let found = if apart(&either[0]) <= apart(&either[1]) { either[0] } else { either[1] };
        if found.abs() > std::f64::consts::FRAC_PI_2 {
            return None;
        }
        let meridian = up * found.cos() - north * found.sin();
        let found_longitude = place.y.atan2(place.x) - east.atan2(meridian);
        // As near as turns allow: what is remembered of a camera does not jump.
        let turns = ((longitude - found_longitude) / std::f64::consts::TAU).round();
        let longitude = found_longitude + turns * std::f64::consts::TAU;
        Some(self.at(DVec2::new(longitude, found)))
    }

    /// The camera turned to the right by `turn` and tilted towards the horizon by `tilt`, in radians, round
    /// the point in the middle of the view, which stays where it is; round itself where no ground is there.
    /// An image is not turned so.
    #[must_use]
    pub fn orbited(self, turn: f64, tilt: f64) -> Pose {
        let middle = self.ground_at(DVec2::ZERO);
        match self {
            Pose::Image { .. } => self,
            Pose::Globe { longitude, latitude, altitude, aim } => {
                let aimed = Aim::new(aim.heading() + turn, aim.tilt() + tilt);
                let turned = |altitude, aim| Pose::Globe { longitude, latitude, altitude, aim };
                let Some(middle) = middle else { return turned(altitude, aimed) };
                // As far from the point as before.
                let away = middle.distance;
                let sine = away * aimed.tilt().sin();
                if sine >= 0.999 {
                    return self;
                }
                let fall = sine * sine / (1.0 + (1.0 - sine * sine).sqrt());
                let altitude = (away * aimed.tilt().cos() - fall).max(super::pose::LEAST_ALTITUDE);
                turned(altitude, aimed).seeing(middle.place, DVec2::ZERO).unwrap_or(self)
            }
            Pose::Plane { eye, yaw, pitch } => {
                // A pitch is told from the horizon downwards.
                let (yaw, pitch) = (yaw - turn, (pitch - tilt).clamp(-1.5, 1.5));
                let Some(middle) = middle else { return Pose::Plane { eye, yaw, pitch } };
                // As far from the point as before, and not below the ground.
                let pitch = pitch.max(0.02);
                let eye = middle.place - axes_of_plane(yaw, pitch).z_axis * middle.distance;
                Pose::Plane { eye, yaw, pitch }
            }
        }
    }

    /// The camera that looks straight down, north upwards, on the point in the middle of its view, from as
    /// far as before; on a plane it looks north, as steeply as before.
    #[must_use]
    pub fn uprighted(self) -> Pose {
        match self {
            Pose::Image { .. } => self,
            Pose::Globe { aim, .. } => self.orbited(-aim.heading(), -aim.tilt()),
            Pose::Plane { yaw, .. } => self.orbited(yaw, 0.0),
        }
    }
}
