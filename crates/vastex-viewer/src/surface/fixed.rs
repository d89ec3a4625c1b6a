//! The image and the globe in fixed point: what fixed.wgsl is told of a camera, and when it is needed.
//!
//! Everything is worked out in f64 from the texel in the middle of the view. A mesh in uv, which is f32, is exact enough for a texture
//! that is some ten thousand pixels wide where it is seen; beyond that its texels would stand, and tremble, beside their places.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, Vec2};

use crate::camera::{FIELD_OF_VIEW, Pose};

/// A texture that would be wider than so many pixels, seen whole as near as it is, is drawn in fixed point.
const MOST_PIXELS: f64 = 65_536.0;
/// And one of more texels along an axis always.
const MOST_TEXELS: u32 = 1 << 16;

/// What the shaders are told; laid out as `Fixed` in surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct FixedUniform {
    anchor: [u32; 2],
    fraction: Vec2,
    low: Vec2,
    high: Vec2,
    half: Vec2,
    texels_per_radian: Vec2,
    sine_and_cosine: Vec2,
    altitude: f32,
    unused: f32,
}

impl FixedUniform {
    pub(crate) fn anchor(&self) -> [u32; 2] {
        self.anchor
    }
}

/// Whether a mesh in uv would show texels beside their places; nothing where a pose has no other way of being drawn.
pub(crate) fn is_needed(pose: &Pose, size: [u32; 2], [width, height]: [u32; 2]) -> bool {
    let pixels = match *pose {
        Pose::Image { .. } => {
            pose.magnification([width, height], size).unwrap_or(0.0) * f64::from(size[0].max(size[1]))
        }
        Pose::Globe { altitude, .. } => {
            TAU * f64::from(height) / (2.0 * (FIELD_OF_VIEW / 2.0).tan() * altitude)
        }
        Pose::Plane { .. } => return false,
    };
    pixels > MOST_PIXELS || size[0].max(size[1]) > MOST_TEXELS
}

/// What is told of a camera over a texture of `size` texels, for pictures of so many pixels. For poses of the image and the globe.
pub(crate) fn uniform(pose: &Pose, size: [u32; 2], [width, height]: [u32; 2]) -> Option<FixedUniform> {
    let texels = DVec2::from(size.map(f64::from));
    let view = f64::from(width) / f64::from(height);
    let (middle, half, altitude, latitude) = match *pose {
        Pose::Image { centre, .. } => {
            let magnification = pose.magnification([width, height], size)?;
            let half = DVec2::new(width.into(), height.into()) / (2.0 * magnification);
            (centre * texels, half, 1.0, 0.0)
        }
        Pose::Globe { longitude, latitude, altitude } => {
            let middle = DVec2::new((longitude / TAU + 0.5).rem_euclid(1.0), 0.5 - latitude / PI);
            let tangent = (FIELD_OF_VIEW / 2.0).tan();
            (middle * texels, DVec2::new(tangent * view, tangent), altitude, latitude)
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
        texels_per_radian: (texels / DVec2::new(TAU, PI)).as_vec2(),
        sine_and_cosine: DVec2::new(latitude.sin(), latitude.cos()).as_vec2(),
        altitude: altitude as f32,
        unused: 0.0,
    })
}
