//! How a planet is lit: where the sun stands, how high its mountains are made, how dense its air is, and how
//! bright its lights are.
//!
//! What becomes of it in a picture is in planet.wgsl; which textures its lights and clouds are, `layers` say.

use glam::{DVec3, Vec3};

use crate::camera::{FIELD_OF_VIEW, Pose};
use crate::picture::PicturePart;
use crate::scene::direction_f64;

/// How a planet is lit, and how much of its relief and its air is seen. Changing it compiles nothing, and
/// loads nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanetLight {
    /// Longitude and latitude over which the sun stands, in degrees. Without a sun all is as light as it can
    /// be.
    pub sun: Option<[f64; 2]>,
    /// By how much mountains are made higher than they are; 0 for a smooth ball.
    pub exaggeration: f32,
    /// How dense the air is, the Earth's being 1; 0 for none.
    pub atmosphere: f32,
    /// How bright lights on the ground are at night.
    pub night: f32,
}

impl Default for PlanetLight {
    fn default() -> PlanetLight {
        PlanetLight { sun: Some([-38.0, 14.0]), exaggeration: 10.0, atmosphere: 1.0, night: 1.0 }
    }
}

impl PlanetLight {
    /// The most of each number that texts and panels have.
    pub const MOST_EXAGGERATION: f32 = 1000.0;
    /// Twenty Earths' air.
    pub const MOST_ATMOSPHERE: f32 = 20.0;
    /// A hundred times as bright as lights are told.
    pub const MOST_NIGHT: f32 = 100.0;

    /// This light with the nearest numbers that texts may have; what is no number is as it is at first.
    #[must_use]
    pub fn within(self) -> PlanetLight {
        let usual = PlanetLight::default();
        let number = |number: f32, most: f32, usual: f32| {
            if number.is_nan() { usual } else { number.clamp(0.0, most) }
        };
        let is_place = |sun: &[f64; 2]| sun.iter().all(|angle| angle.is_finite());
        PlanetLight {
            // The same place by turns fewer.
            sun: self.sun.filter(is_place).map(|[longitude, latitude]| {
                let turned = if longitude.abs() > 360.0 { longitude % 360.0 } else { longitude };
                [turned, latitude.clamp(-90.0, 90.0)]
            }),
            exaggeration: number(self.exaggeration, PlanetLight::MOST_EXAGGERATION, usual.exaggeration),
            atmosphere: number(self.atmosphere, PlanetLight::MOST_ATMOSPHERE, usual.atmosphere),
            night: number(self.night, PlanetLight::MOST_NIGHT, usual.night),
        }
    }
}

/// What the shaders are told; laid out as `Planet` in surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct PlanetUniform {
    sun: Vec3,
    lit: f32,
    eye: Vec3,
    density: f32,
    ahead: Vec3,
    sea: f32,
    across: Vec3,
    night: f32,
    upward: Vec3,
    pixel: f32,
}

impl PlanetLight {
    /// What is told of a planet in a picture that is such a part of what a camera sees. `sea` is 1 over the
    /// value above the sea's at which nothing is sea, or 0 where there is none.
    pub(super) fn uniform(&self, pose: &Pose, view: &PicturePart, sea: f32) -> PlanetUniform {
        let [width, height] = view.whole;
        let [right, up, ahead] = pose.axes();
        let tangent = (FIELD_OF_VIEW / 2.0).tan();
        let aspect = f64::from(width.max(1)) / f64::from(height.max(1));
        let (across, upward) = (right * tangent * aspect, up * tangent);
        // The shaders have rays by places of the picture.
        let [scale, offset] = view.whole_from_part();
        let sun = self.sun.map_or(DVec3::X, |[longitude, latitude]| {
            direction_f64(longitude.to_radians(), latitude.to_radians())
        });
        PlanetUniform {
            sun: sun.as_vec3(),
            lit: f32::from(u8::from(self.sun.is_some())),
            eye: pose.eye().as_vec3(),
            density: self.atmosphere.max(0.0),
            ahead: (ahead + across * offset.x + upward * offset.y).as_vec3(),
            sea,
            across: (across * scale.x).as_vec3(),
            night: self.night.max(0.0),
            upward: (upward * scale.y).as_vec3(),
            pixel: (2.0 * tangent / f64::from(height.max(1))) as f32,
        }
    }
}
