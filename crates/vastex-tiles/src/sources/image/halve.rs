//! Rows of texels made half as wide and half as many: four texels become one, as a build makes levels by
//! default.
//!
//! Whole numbers of 8 and 16 bits are mixed in whole numbers, halves rounded up; everything else in 32-bit
//! floats. A test of `vastex-build` holds both against the filters of builds, byte by byte, in every format.

use half::f16;
use vastex_core::LayerFormat;

use crate::ground::srgb::SRGB;

/// What the values of an image are, and so how four of them become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reduction {
    /// Colours: mixed as light where they are sRGB-encoded, and weighted by alpha. Of formats without alpha
    /// the same as [`Reduction::Values`].
    Color,
    /// Numbers: the mean of each channel, as it is stored.
    Values,
    /// Numbers of objects or classes: the one that is met most often; of several the smallest, its bytes read
    /// as a little-endian number. The layer is sampled texel by texel.
    Labels,
}

impl Reduction {
    /// The usual meaning of a format: colours if it has four channels, else numbers.
    pub fn usual(format: LayerFormat) -> Reduction {
        if format.channels() == 4 { Reduction::Color } else { Reduction::Values }
    }
}

/// Makes one texel of four, in one format.
#[derive(Clone, Copy, Debug)]
pub(super) struct Halving {
    format: LayerFormat,
    reduction: Reduction,
}

/// Added to alpha as a weight, so that the colours of texels that are all transparent count alike.
const LEAST_WEIGHT: f32 = 1.0 / (1 << 20) as f32;

impl Halving {
    pub(super) fn new(format: LayerFormat, reduction: Reduction) -> Halving {
        let has_alpha = format.channels() == 4;
        let reduction = match reduction {
            Reduction::Color if !has_alpha => Reduction::Values,
            reduction => reduction,
        };
        Halving { format, reduction }
    }

    /// Fills a row from the two that lie under it, which hold twice as many texels.
    pub(super) fn row(self, coarse: &mut [u8], upper: &[u8], lower: &[u8]) {
        use LayerFormat::{R8, R16, Rg8, Rgba8, Rgba8Srgb, Rgba16};
        let bytes = self.format.texel_bytes();
        match (self.reduction, self.format) {
            (Reduction::Labels, _) => each(coarse, upper, lower, bytes, most_frequent),
            (Reduction::Color, Rgba8) => each(coarse, upper, lower, bytes, |to, four| {
                color(to, four, u32::from, |mean| mean as u8);
            }),
            (Reduction::Color, Rgba8Srgb) => {
                let curve = &*SRGB;
                each(coarse, upper, lower, bytes, |to, four| {
                    let light = |v| u32::from(curve.linear_from_srgb[usize::from(v)]);
                    color(to, four, light, |mean| curve.srgb_from_linear[usize::from(mean as u16)]);
                });
            }
            (Reduction::Values, R8 | Rg8 | Rgba8 | Rgba8Srgb) => each(coarse, upper, lower, bytes, mean8),
            (Reduction::Values, R16 | Rgba16) => each(coarse, upper, lower, bytes, mean16),
            (reduction, format) => {
                let is_color = reduction == Reduction::Color;
                each(coarse, upper, lower, bytes, |to, four| floats(format, is_color, to, four));
            }
        }
    }
}

/// Calls `make` for each texel with the four that it is made of: two of the upper row, two of the lower.
fn each(coarse: &mut [u8], upper: &[u8], lower: &[u8], bytes: usize, make: impl Fn(&mut [u8], [&[u8]; 4])) {
    let pairs = upper.chunks_exact(2 * bytes).zip(lower.chunks_exact(2 * bytes));
    for (to, (above, below)) in coarse.chunks_exact_mut(bytes).zip(pairs) {
        let ((a, b), (c, d)) = (above.split_at(bytes), below.split_at(bytes));
        make(to, [a, b, c, d]);
    }
}

fn most_frequent(to: &mut [u8], four: [&[u8]; 4]) {
    let count = |texel: &[u8]| four.iter().filter(|other| **other == texel).count();
    let mut best = four[0];
    for next in &four[1..] {
        let (of_best, of_next) = (count(best), count(next));
        // The last byte counts most.
        let is_smaller = next.iter().rev().lt(best.iter().rev());
        if of_next > of_best || of_next == of_best && is_smaller {
            best = next;
        }
    }
    to.copy_from_slice(best);
}

fn mean8(to: &mut [u8], four: [&[u8]; 4]) {
    for (channel, to) in to.iter_mut().enumerate() {
        let sum: u16 = four.iter().map(|texel| u16::from(texel[channel])).sum();
        *to = ((sum + 2) >> 2) as u8;
    }
}

fn mean16(to: &mut [u8], four: [&[u8]; 4]) {
    for (channel, to) in to.as_chunks_mut::<2>().0.iter_mut().enumerate() {
        let sum: u32 =
            four.iter().map(|texel| u32::from(u16::from_le_bytes(texel.as_chunks().0[channel]))).sum();
        *to = (((sum + 2) >> 2) as u16).to_le_bytes();
    }
}

/// Of four colours with alpha, each of which counts as much as it is opaque.
fn color(to: &mut [u8], four: [&[u8]; 4], light: impl Fn(u8) -> u32, stored: impl Fn(u32) -> u8) {
    let alphas = four.map(|texel| u32::from(texel[3]));
    let alpha: u32 = alphas.iter().sum();
    let (weights, total) = if alpha == 0 { ([1; 4], 4) } else { (alphas, alpha) };
    for (channel, to) in to[..3].iter_mut().enumerate() {
        let sum: u32 = four.iter().zip(&weights).map(|(texel, weight)| light(texel[channel]) * weight).sum();
        *to = stored((sum + total / 2) / total);
    }
    to[3] = ((alpha + 2) >> 2) as u8;
}

/// Of four texels of any other format: along the rows first, then across them.
fn floats(format: LayerFormat, is_color: bool, to: &mut [u8], four: [&[u8]; 4]) {
    let [a, b, c, d] = four.map(|texel| {
        let mut values = decode(format, texel);
        if is_color {
            let weight = values[3].max(0.0) + LEAST_WEIGHT;
            values[..3].iter_mut().for_each(|value| *value *= weight);
            values[3] = weight;
        }
        values
    });
    let mean = |a: f32, b: f32| 0.5 * a + 0.5 * b;
    let mut values: [f32; 4] = std::array::from_fn(|n| mean(mean(a[n], b[n]), mean(c[n], d[n])));
    if is_color {
        let weight = values[3];
        let part = if weight.abs() >= LEAST_WEIGHT / 2.0 { 1.0 / weight } else { 0.0 };
        values[..3].iter_mut().for_each(|value| *value *= part);
        values[3] = (weight - LEAST_WEIGHT).max(0.0);
    }
    encode(format, values, to);
}

/// The channels of a texel of 16-bit whole numbers or of floats; what it has not is 0. What is no number
/// counts as 0, and what is infinite as the largest number, so that one bad texel does not spread over a
/// level.
fn decode(format: LayerFormat, texel: &[u8]) -> [f32; 4] {
    let mut values = [0.0; 4];
    match format {
        LayerFormat::R16Float | LayerFormat::Rgba16Float => {
            for (to, &from) in values.iter_mut().zip(texel.as_chunks().0) {
                *to = finite(f16::from_le_bytes(from).to_f32(), f16::MAX.to_f32());
            }
        }
        LayerFormat::R32Float => {
            for (to, &from) in values.iter_mut().zip(texel.as_chunks().0) {
                *to = finite(f32::from_le_bytes(from), f32::MAX);
            }
        }
        _ => {
            for (to, &from) in values.iter_mut().zip(texel.as_chunks().0) {
                *to = f32::from(u16::from_le_bytes(from)) / 65535.0;
            }
        }
    }
    values
}

fn encode(format: LayerFormat, values: [f32; 4], texel: &mut [u8]) {
    match format {
        LayerFormat::R16Float | LayerFormat::Rgba16Float => {
            for (to, from) in texel.as_chunks_mut().0.iter_mut().zip(values) {
                *to = f16::from_f32(finite(from, f16::MAX.to_f32())).to_le_bytes();
            }
        }
        LayerFormat::R32Float => {
            for (to, from) in texel.as_chunks_mut().0.iter_mut().zip(values) {
                *to = finite(from, f32::MAX).to_le_bytes();
            }
        }
        _ => {
            for (to, from) in texel.as_chunks_mut().0.iter_mut().zip(values) {
                *to = ((from.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16).to_le_bytes();
            }
        }
    }
}

fn finite(value: f32, most: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(-most, most) }
}

/// A colour of four bytes as a texel of a format, which takes as many channels as it has.
pub(super) fn texel_of_color(format: LayerFormat, color: [u8; 4]) -> Vec<u8> {
    let mut texel = vec![0; format.texel_bytes()];
    match format {
        LayerFormat::R16
        | LayerFormat::Rgba16
        | LayerFormat::R16Float
        | LayerFormat::Rgba16Float
        | LayerFormat::R32Float => encode(format, color.map(|v| f32::from(v) / 255.0), &mut texel),
        _ => texel.iter_mut().zip(color).for_each(|(to, from)| *to = from),
    }
    texel
}
