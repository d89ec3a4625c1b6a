//! The image and the globe in fixed point: what fixed.wgsl is told of a camera, and when it is needed, with
//! heights too (`fixed_relief`).
//!
//! Everything is worked out in f64 from the texel in the middle of the view. A mesh in uv, which is f32, is
//! exact enough for a texture that is some ten thousand pixels wide where it is seen; beyond that its texels
//! would stand, and tremble, beside their places.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, Vec2};

use crate::camera::{Aim, FIELD_OF_VIEW, Pose};

/// A texture that would be wider than so many pixels, seen whole as near as it is, is drawn in fixed point.
const MOST_PIXELS: f64 = 65_536.0;
/// And one of more texels along an axis always.
const MOST_TEXELS: u32 = 1 << 16;

/// What the shaders are told; laid out as `Fixed` in surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct FixedUniform {
    pub(super) anchor: [u32; 2],
    pub(super) fraction: Vec2,
    pub(super) low: Vec2,
    pub(super) high: Vec2,
    pub(super) half: Vec2,
    pub(super) texels_per_unit: Vec2,
    pub(super) sine_and_cosine: Vec2,
    pub(super) altitude: f32,
    pub(super) unused: f32,
    /// From steps to the right and upwards in the picture to those in the image, column by column.
    pub(super) turn: [[f32; 2]; 2],
    /// Of a globe, where the camera looks: sine and cosine of its heading, then of its tilt.
    pub(super) aim: [f32; 4],
}

impl FixedUniform {
    pub(crate) fn anchor(&self) -> [u32; 2] {
        self.anchor
    }
}

/// Returns true if a mesh in uv would show texels beside their places.
pub(crate) fn is_needed(pose: &Pose, size: [u32; 2], [width, height]: [u32; 2]) -> bool {
    let pixels = match *pose {
        Pose::Image { .. } => {
            pose.magnification([width, height], size).unwrap_or(0.0) * f64::from(size[0].max(size[1]))
        }
        Pose::Globe { altitude, .. } => {
            TAU * f64::from(height) / (2.0 * (FIELD_OF_VIEW / 2.0).tan() * altitude)
        }
        Pose::Plane { eye, .. } => {
            f64::from(height) / ((FIELD_OF_VIEW / 2.0).tan() * eye.z.abs().max(f64::MIN_POSITIVE))
        }
    };
    pixels > MOST_PIXELS || size[0].max(size[1]) > MOST_TEXELS
}

/// The uv in the middle of the view; `None` if perspective has none.
pub(super) fn middle(pose: &Pose) -> Option<DVec2> {
    match *pose {
        Pose::Image { centre, .. } => Some(centre),
        Pose::Globe { longitude, latitude, .. } => {
            Some(DVec2::new((longitude / TAU + 0.5).rem_euclid(1.0), 0.5 - latitude / PI))
        }
        Pose::Plane { .. } => None,
    }
}

/// A texture beside the one that is told of, where it has a size of its own; laid out as `LayerPlace` in
/// surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct LayerPlace {
    anchor: [u32; 2],
    fraction: Vec2,
    ratio: Vec2,
    end: Vec2,
}

impl LayerPlace {
    /// Of a texture of `size` texels beside one of `of` texels, over a place in uv, in which so many texels
    /// of its own would lie over all of the other.
    pub(super) fn new(middle: DVec2, (size, spread): ([u32; 2], DVec2), of: [u32; 2]) -> LayerPlace {
        let [texels, others] = [size, of].map(|size| DVec2::from(size.map(f64::from)));
        let (anchor, fraction) = anchored(middle * spread, texels);
        let end = texels - DVec2::from(anchor.map(f64::from));
        LayerPlace { anchor, fraction, ratio: (spread / others).as_vec2(), end: end.as_vec2() }
    }
}

/// The texel that a place of a texture lies in, or the nearest to it, and how far into it.
pub(super) fn anchored(place: DVec2, texels: DVec2) -> ([u32; 2], Vec2) {
    let anchor = place.floor().clamp(DVec2::ZERO, texels - 1.0);
    ([anchor.x as u32, anchor.y as u32], (place - anchor).as_vec2())
}

/// How a picture's steps are turned into those of the image that is seen, upwards as y.
fn turn(pose: &Pose) -> [[f32; 2]; 2] {
    let image_from_seen = pose.orientation().image_from_seen();
    let up = glam::DMat2::from_diagonal(DVec2::new(1.0, -1.0));
    (up * image_from_seen * up).to_cols_array_2d().map(|column| column.map(|number| number as f32))
}

/// Sine and cosine of the heading and of the tilt of a camera over a globe.
pub(super) fn told_aim(pose: &Pose) -> [f32; 4] {
    let aim = match *pose {
        Pose::Globe { aim, .. } => aim,
        _ => Aim::DOWN,
    };
    let ((sin_heading, cos_heading), (sin_tilt, cos_tilt)) = (aim.heading().sin_cos(), aim.tilt().sin_cos());
    [sin_heading, cos_heading, sin_tilt, cos_tilt].map(|number| number as f32)
}

/// What is told of a camera over a texture of `size` texels, for pictures of so many pixels. For poses of the
/// image and the globe.
pub(crate) fn uniform(pose: &Pose, size: [u32; 2], [width, height]: [u32; 2]) -> Option<FixedUniform> {
    let texels = DVec2::from(size.map(f64::from));
    let middle = middle(pose)? * texels;
    let view = f64::from(width) / f64::from(height);
    let (half, altitude, latitude) = match *pose {
        Pose::Image { .. } => {
            let magnification = pose.magnification([width, height], size)?;
            let half = DVec2::new(width.into(), height.into()) / (2.0 * magnification);
            (half, 1.0, 0.0)
        }
        Pose::Globe { latitude, altitude, .. } => {
            let tangent = (FIELD_OF_VIEW / 2.0).tan();
            (DVec2::new(tangent * view, tangent), altitude, latitude)
        }
        Pose::Plane { .. } => return None,
    };
    let anchor = middle.floor().clamp(DVec2::ZERO, texels - 1.0);
    Some(FixedUniform {
        anchor: [anchor.x as u32, anchor.y as u32],
        fraction: (middle - anchor).as_vec2(),
        low: (-anchor).as_vec2(),
        high: (texels - anchor).as_vec2(),
        half: half.as_vec2(),
        texels_per_unit: (texels / DVec2::new(TAU, PI)).as_vec2(),
        sine_and_cosine: DVec2::new(latitude.sin(), latitude.cos()).as_vec2(),
        altitude: altitude as f32,
        unused: 0.0,
        turn: turn(pose),
        aim: told_aim(pose),
    })
}
