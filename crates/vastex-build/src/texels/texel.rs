//! Rows of texels as floats, and back: for whatever mixes them.
//!
//! - Integers stand for 0 to 1; every value comes back as it was. Values outside become the nearest end.
//! - sRGB-encoded channels come as they are stored or as light, of which 16 bits are kept; alpha is never
//!   encoded.
//! - Floats stand for themselves, those of 16 bits exactly. NaN counts as 0, infinity as the largest number
//!   of the format, so that one bad texel does not spread over a level; neither is ever made.

use half::f16;
use vastex_core::LayerFormat;

use super::srgb::SRGB;

/// How sRGB-encoded values are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Light {
    /// As they are stored.
    Stored,
    /// Decoded.
    Linear,
}

/// The channels of a row of texels of a format that is not compressed.
pub(crate) fn decode(format: LayerFormat, light: Light, row: &[u8], values: &mut [f32]) {
    match format {
        LayerFormat::R16 | LayerFormat::Rgba16 => {
            each(values, row, |v| f32::from(u16::from_le_bytes(v)) / 65535.0);
        }
        LayerFormat::R16Float | LayerFormat::Rgba16Float => {
            each(values, row, |v| finite(f16::from_le_bytes(v).to_f32(), f16::MAX.to_f32()));
        }
        LayerFormat::R32Float => each(values, row, |v| finite(f32::from_le_bytes(v), f32::MAX)),
        LayerFormat::Rgba8Srgb if light == Light::Linear => {
            let light = &SRGB.light;
            for (to, &[r, g, b, a]) in values.as_chunks_mut::<4>().0.iter_mut().zip(row.as_chunks::<4>().0) {
                let [r, g, b] = [r, g, b].map(|v| light[usize::from(v)]);
                *to = [r, g, b, f32::from(a) / 255.0];
            }
        }
        _ => each(values, row, |[v]| f32::from(v) / 255.0),
    }
}

/// A row of texels of a format that is not compressed, each channel rounded to the nearest that the format
/// has.
pub(crate) fn encode(format: LayerFormat, light: Light, values: &[f32], row: &mut [u8]) {
    match format {
        LayerFormat::R16 | LayerFormat::Rgba16 => {
            each_back(row, values, |v| whole(v, 65535.0).to_le_bytes());
        }
        LayerFormat::R16Float | LayerFormat::Rgba16Float => {
            each_back(row, values, |v| f16::from_f32(finite(v, f16::MAX.to_f32())).to_le_bytes());
        }
        LayerFormat::R32Float => each_back(row, values, |v| finite(v, f32::MAX).to_le_bytes()),
        LayerFormat::Rgba8Srgb if light == Light::Linear => {
            let stored = &SRGB.srgb_from_linear;
            for (to, &[r, g, b, a]) in row.as_chunks_mut::<4>().0.iter_mut().zip(values.as_chunks::<4>().0) {
                let [r, g, b] = [r, g, b].map(|v| stored[usize::from(whole(v, 65535.0))]);
                *to = [r, g, b, byte(a)];
            }
        }
        _ => each_back(row, values, |v| [byte(v)]),
    }
}

/// A colour of four bytes in a format that is not compressed, which takes as many channels as it has.
pub(crate) fn texel_of_color(format: LayerFormat, color: [u8; 4]) -> Vec<u8> {
    let values = color.map(|v| f32::from(v) / 255.0);
    let mut texel = vec![0; format.texel_bytes()];
    encode(format, Light::Stored, &values[..format.channels()], &mut texel);
    texel
}

/// Returns true if the channels of a format that is not compressed are floats.
pub(super) fn is_float(format: LayerFormat) -> bool {
    matches!(format, LayerFormat::R16Float | LayerFormat::Rgba16Float | LayerFormat::R32Float)
}

/// The nearest of `most` whole steps for 0 to 1; for what is no number, 0.
pub(super) fn whole(value: f32, most: f32) -> u16 {
    (value.clamp(0.0, 1.0) * most + 0.5) as u16
}

fn byte(value: f32) -> u8 {
    whole(value, 255.0) as u8
}

/// 0 for what is no number, and what is infinite as `most`, so that one bad texel does not spread.
pub(super) fn finite(value: f32, most: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(-most, most) }
}

/// Decodes samples of `B` bytes.
pub(super) fn each<const B: usize>(values: &mut [f32], row: &[u8], decode: impl Fn([u8; B]) -> f32) {
    values.iter_mut().zip(row.as_chunks::<B>().0).for_each(|(to, &from)| *to = decode(from));
}

/// Encodes samples of `B` bytes.
pub(super) fn each_back<const B: usize>(row: &mut [u8], values: &[f32], encode: impl Fn(f32) -> [u8; B]) {
    row.as_chunks_mut::<B>().0.iter_mut().zip(values).for_each(|(to, &from)| *to = encode(from));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn there_and_back(format: LayerFormat, light: Light, row: &[u8]) -> Vec<u8> {
        let mut values = vec![0.0; row.len() / format.texel_bytes() * format.channels()];
        decode(format, light, row, &mut values);
        let mut back = vec![0; row.len()];
        encode(format, light, &values, &mut back);
        back
    }

    #[test]
    fn every_value_comes_back() {
        let bytes: Vec<u8> = (0..=255).collect();
        let words: Vec<u8> = (0..=u16::MAX).flat_map(u16::to_le_bytes).collect();
        for format in [LayerFormat::R8, LayerFormat::Rg8, LayerFormat::Rgba8, LayerFormat::Rgba8Srgb] {
            for light in [Light::Stored, Light::Linear] {
                assert_eq!(there_and_back(format, light, &bytes), bytes, "{format:?} {light:?}");
            }
        }
        for format in [LayerFormat::R16, LayerFormat::Rgba16] {
            assert!(there_and_back(format, Light::Linear, &words) == words, "{format:?}");
        }
        let halves: Vec<u8> =
            (0..=u16::MAX).filter(|&v| f16::from_bits(v).is_finite()).flat_map(u16::to_le_bytes).collect();
        assert!(there_and_back(LayerFormat::R16Float, Light::Linear, &halves) == halves);
        let floats: Vec<u8> =
            [0.0, -0.0, 1e-40, -3.5e7, f32::MAX].iter().flat_map(|v: &f32| v.to_le_bytes()).collect();
        assert_eq!(there_and_back(LayerFormat::R32Float, Light::Linear, &floats), floats);
    }

    #[test]
    fn what_is_no_number_is_not_spread() {
        let floats = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].map(f32::to_le_bytes).concat();
        let back = there_and_back(LayerFormat::R32Float, Light::Linear, &floats);
        assert_eq!(back, [0.0, f32::MAX, f32::MIN].map(f32::to_le_bytes).concat());
        let halves = [f16::NAN, f16::INFINITY, f16::NEG_INFINITY].map(f16::to_le_bytes).concat();
        let back = there_and_back(LayerFormat::R16Float, Light::Linear, &halves);
        assert_eq!(back, [f16::ZERO, f16::MAX, f16::MIN].map(f16::to_le_bytes).concat());
    }

    #[test]
    fn a_colour_fills_the_channels_that_there_are() {
        let color = [255, 128, 3, 64];
        assert_eq!(texel_of_color(LayerFormat::Rg8, color), [255, 128]);
        assert_eq!(texel_of_color(LayerFormat::Rgba8Srgb, color), color);
        assert_eq!(texel_of_color(LayerFormat::R16, [128, 0, 0, 0]), (128u16 * 257).to_le_bytes());
        assert_eq!(texel_of_color(LayerFormat::R32Float, color), 1f32.to_le_bytes());
    }
}
