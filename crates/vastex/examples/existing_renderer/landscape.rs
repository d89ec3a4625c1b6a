//! A landscape of 65,536 texels per side that is computed where it is looked at.

use vastex::{GeometryError, GeometrySpec, LayerFormat};

use super::common::painted::Painted;

/// Texels per side.
const SIDE: u32 = 65_536;
/// Colours from the sea floor to the peaks, at equal steps of height.
const RAMP: [[f32; 3]; 8] = [
    [14.0, 38.0, 76.0],
    [26.0, 78.0, 124.0],
    [92.0, 152.0, 168.0],
    [206.0, 190.0, 138.0],
    [104.0, 138.0, 66.0],
    [62.0, 96.0, 50.0],
    [120.0, 108.0, 96.0],
    [240.0, 242.0, 246.0],
];

/// The landscape, a source like any other (`painted`).
pub(crate) fn landscape() -> Result<Painted, GeometryError> {
    Painted::new(GeometrySpec::image(SIDE, SIDE), LayerFormat::Rgba8Srgb, colour)
}

/// The colour at a place, for a texel of so many texels of level 0.
fn colour(at: [f32; 2], scale: f32) -> [u8; 4] {
    // Waves shorter than two texels are left out, so that a level is a smooth picture of the one below it.
    let (mut height, mut length, mut share) = (0.5, SIDE as f32 / 5.0, 0.6);
    while length > 2.0 * scale {
        height += share * (noise(at.map(|n| n / length)) - 0.5);
        (length, share) = (length / 2.0, share * 0.68);
    }
    let step = height.clamp(0.0, 0.999) * (RAMP.len() - 1) as f32;
    let (lower, upper, part) = (RAMP[step as usize], RAMP[step as usize + 1], step.fract());
    let [r, g, b] = std::array::from_fn(|i| (lower[i] + (upper[i] - lower[i]) * part) as u8);
    [r, g, b, 255]
}

/// Smooth noise from 0 to 1, one wave for each unit.
fn noise(at: [f32; 2]) -> f32 {
    let corner = at.map(|n| n.floor() as u32);
    let [u, v] = at.map(f32::fract).map(|t| t * t * (3.0 - 2.0 * t));
    let random = |x: u32, y: u32| {
        let mixed = (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35);
        ((mixed ^ mixed >> 15).wrapping_mul(0x27d4_eb2f) >> 8) as f32 / (1 << 24) as f32
    };
    let row = |y: u32| {
        let (left, right) = (random(corner[0], y), random(corner[0] + 1, y));
        left + (right - left) * u
    };
    let (upper, lower) = (row(corner[1]), row(corner[1] + 1));
    upper + (lower - upper) * v
}
