//! The images of the materials: wood, an inlaid board, two marbles, lead. Each repeats without a seam, and
//! leaves out on each level what is finer than its texels.

use std::f32::consts::TAU;

use glam::Vec3;
use vastex::{AddressMode, GeometryError, GeometrySpec, LayerFormat};

use super::common::painted::Painted;

/// The colour at a place, from 0 to 1 along each axis, for a texel of such a width.
type Colour = fn([f32; 2], f32) -> Vec3;

/// An image of `side` texels along each axis.
pub(crate) fn image(colour: Colour, side: u32, page: u32) -> Result<Painted, GeometryError> {
    let address = [AddressMode::Wrap, AddressMode::Wrap, AddressMode::Clamp];
    let spec = GeometrySpec { page, address, ..GeometrySpec::image(side, side) };
    let of_side = 1.0 / side as f32;
    Painted::new(spec, LayerFormat::Rgba8Srgb, move |at, scale| {
        let colour = colour(at.map(|n| n * of_side), scale * of_side);
        let [r, g, b] = (colour.clamp(Vec3::ZERO, Vec3::ONE) * 255.0).round().as_u8vec3().to_array();
        [r, g, b, 255]
    })
}

/// Planks of walnut.
pub(crate) fn planks([u, v]: [f32; 2], width: f32) -> Vec3 {
    const COUNT: f32 = 12.0;
    let plank = (v * COUNT).floor();
    let own = random(plank as u32, 77);
    let grain = clouds([u, v], [4, 96], width, 0.62) + 0.35 * clouds([u, v], [16, 512], width, 0.6);
    let light = 0.62 + 0.22 * (own - 0.5) + 0.75 * (grain - 0.68);
    let from_gap = 0.5 - ((v * COUNT).fract() - 0.5).abs();
    let gap = line(from_gap / COUNT, 0.0012, width);
    Vec3::new(0.33, 0.21, 0.135).lerp(Vec3::new(0.60, 0.42, 0.28), light) * (1.0 - 0.7 * gap)
}

/// A chessboard of maple and mahogany in a frame of rosewood, with a line of brass between.
pub(crate) fn board(at: [f32; 2], width: f32) -> Vec3 {
    const FRAME: f32 = 1.0 / 18.0;
    let [x, y] = at.map(|n| (n - FRAME) / (1.0 - 2.0 * FRAME) * 8.0);
    let is_inside = (0.0..8.0).contains(&x) && (0.0..8.0).contains(&y);
    let is_light = (x.floor() + y.floor()) as i32 % 2 != 0;
    // The grain of neighbours runs crosswise.
    let along = if is_light { at } else { [at[1], at[0]] };
    let grain = clouds(along, [8, 128], width, 0.66) + 0.5 * clouds(along, [32, 1024], width, 0.6) - 0.75;
    let (dark, light) = match (is_inside, is_light) {
        (true, true) => (Vec3::new(0.68, 0.54, 0.37), Vec3::new(0.86, 0.74, 0.56)),
        (true, false) => (Vec3::new(0.26, 0.15, 0.09), Vec3::new(0.42, 0.26, 0.16)),
        _ => (Vec3::new(0.17, 0.085, 0.06), Vec3::new(0.30, 0.155, 0.105)),
    };
    let from_line = at.map(|n| (n.min(1.0 - n) - FRAME).abs());
    let beside = at.map(|n| n.min(1.0 - n) > FRAME - 0.002);
    let inlay = [0, 1].map(|a| if beside[1 - a] { line(from_line[a], 0.0016, width) } else { 0.0 });
    let wood = dark.lerp(light, 0.5 + 1.1 * grain);
    wood.lerp(Vec3::new(0.83, 0.66, 0.33), inlay[0].max(inlay[1]))
}

/// White marble with grey veins.
pub(crate) fn white(at: [f32; 2], width: f32) -> Vec3 {
    let [vein, cloud] = veins(at, width);
    Vec3::new(0.93, 0.905, 0.86) * (0.9 + 0.18 * cloud) - Vec3::new(0.42, 0.43, 0.42) * vein
}

/// Black marble with veins of gold.
pub(crate) fn black(at: [f32; 2], width: f32) -> Vec3 {
    let [vein, cloud] = veins([at[1], 1.0 - at[0]], width);
    Vec3::new(0.15, 0.15, 0.17) * (0.5 + cloud) + Vec3::new(0.62, 0.50, 0.30) * vein
}

/// Lead.
pub(crate) fn lead(at: [f32; 2], width: f32) -> Vec3 {
    Vec3::new(0.35, 0.36, 0.4) * (0.6 + 0.8 * clouds(at, [8, 8], width, 0.7))
}

/// How much of a place is vein, and how bright the stone is.
fn veins([u, v]: [f32; 2], width: f32) -> [f32; 2] {
    let cloud = clouds([u, v], [3, 3], width, 0.58);
    let vein = |turns: f32, turn: f32, sharp: f32| {
        let wave = (TAU * (turns * v + u) + turn * (cloud - 0.5)).sin();
        (1.0 - wave.abs()).powf(sharp)
    };
    [0.75 * vein(1.0, 14.0, 9.0) + 0.35 * vein(3.0, 24.0, 16.0), cloud]
}

/// Whether a place so far from a line of such a width lies on it: in part, where a texel is wider.
fn line(from: f32, half_width: f32, texel: f32) -> f32 {
    let edge = texel.max(1e-6);
    (0.5 + (half_width - from) / edge).clamp(0.0, 1.0) * (2.0 * half_width / edge).min(1.0)
}

/// Smooth noise from 0 to 1, of waves from `cells` to the image's sides down to those of two texels, each a
/// part as high as the one before.
fn clouds(at: [f32; 2], mut cells: [u32; 2], width: f32, part: f32) -> f32 {
    let (mut sum, mut height) = (0.5, 1.0 - part);
    while cells.iter().all(|&cells| 2.0 * width * (cells as f32) < 1.0) && height > 0.004 {
        sum += height * (noise(at, cells) - 0.5) * 1.6;
        (cells, height) = (cells.map(|cells| 2 * cells), height * part);
    }
    sum
}

fn noise(at: [f32; 2], cells: [u32; 2]) -> f32 {
    let [x, y] = [0, 1].map(|a| at[a] * cells[a] as f32);
    let [u, v] = [x, y].map(f32::fract).map(|t| t * t * (3.0 - 2.0 * t));
    let [column, row] = [x, y].map(|n| n as u32);
    let value = |x: u32, y: u32| random(x % cells[0], (y % cells[1]).wrapping_add(cells[1] << 16));
    let along = |y: u32| value(column, y) + (value(column + 1, y) - value(column, y)) * u;
    along(row) + (along(row + 1) - along(row)) * v
}

fn random(x: u32, y: u32) -> f32 {
    let mixed = (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35);
    ((mixed ^ (mixed >> 15)).wrapping_mul(0x27d4_eb2f) >> 8) as f32 / (1 << 24) as f32
}
