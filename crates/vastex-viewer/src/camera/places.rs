//! What camera paths lead through: places whose numbers can be mixed.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::aim::Aim;
use super::orientation::Orientation;
use super::pose::Pose;

/// Numbers of a place that can be mixed; a place that has fewer leaves the last ones 0.
pub type PathChannels = [f64; 20];

/// A place that a camera path leads through.
pub trait PathPlace: Copy + PartialEq {
    /// The first word of its text: those of one path have one.
    fn kind(&self) -> &'static str;
    /// What goes smoothly from one to the next.
    fn channels(&self) -> PathChannels;
    /// The place of channels; what cannot be mixed is that of this one.
    fn at(&self, channels: PathChannels) -> Self;
    /// Which channels are angles that go round, in radians.
    fn angles(&self) -> &'static [usize];
}

/// Channels of a place that has fewer than there are.
fn filled<const N: usize>(own: [f64; N]) -> PathChannels {
    std::array::from_fn(|nth| own.get(nth).copied().unwrap_or(0.0))
}

impl PathPlace for Pose {
    fn kind(&self) -> &'static str {
        match self {
            Pose::Image { .. } => "image",
            Pose::Plane { .. } => "plane",
            Pose::Globe { .. } => "globe",
        }
    }

    fn channels(&self) -> PathChannels {
        filled(match *self {
            Pose::Image { centre, zoom, orientation } => {
                [centre.x, centre.y, zoom.ln(), orientation.degrees().to_radians(), 0.0]
            }
            Pose::Plane { eye, yaw, pitch } => [eye.x, eye.y, eye.z, yaw, pitch],
            Pose::Globe { longitude, latitude, altitude, aim } => {
                [longitude, latitude, altitude.ln(), aim.heading(), aim.tilt()]
            }
        })
    }

    fn at(&self, [a, b, c, d, e, ..]: PathChannels) -> Pose {
        match self {
            Pose::Image { orientation, .. } => {
                let orientation = Orientation::new(d.to_degrees(), orientation.is_mirrored());
                Pose::Image { centre: DVec2::new(a, b), zoom: c.exp(), orientation }
            }
            Pose::Plane { .. } => Pose::Plane { eye: DVec3::new(a, b, c), yaw: d, pitch: e },
            Pose::Globe { .. } => {
                // From the middle of the image, as every longitude is.
                let longitude = (a + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
                Pose::globe(longitude, b, c.exp()).with_aim(Aim::new(d, e))
            }
        }
    }

    fn angles(&self) -> &'static [usize] {
        match self {
            Pose::Globe { .. } => &[0, 3],
            Pose::Image { .. } | Pose::Plane { .. } => &[3],
        }
    }
}
