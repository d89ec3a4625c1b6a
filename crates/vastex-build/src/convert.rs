//! From the texels of an image file to those of a layer.
//!
//! | in the file | layer |
//! |---|---|
//! | grey, 8 bits | `R8` |
//! | grey, 16 bits | `R16`, exact |
//! | grey and alpha | `RG8` |
//! | RGB, RGBA | `RGBA8`, sRGB unless the file says linear; without alpha it is 255 |
//! | grey, a float of 16 or 32 bits | `R16F`, `R32F`, exact |
//! | any other float | `RGBA16F`, to the nearest |
//!
//! 16 bits become 8 by `round(v / 257)`, where grey stands with alpha or colour is meant.

use half::f16;
use vastex_core::LayerFormat;

use crate::readers::{ImageHeader, PixelFormat, Sample};

/// The layer that holds an image.
pub(crate) fn layer_format(header: &ImageHeader) -> LayerFormat {
    match (header.format.channels(), header.format.sample()) {
        (1, Sample::U8) => LayerFormat::R8,
        (1, Sample::U16) => LayerFormat::R16,
        (1, Sample::F16) => LayerFormat::R16Float,
        (1, Sample::F32) => LayerFormat::R32Float,
        (_, Sample::F16 | Sample::F32) => LayerFormat::Rgba16Float,
        (2, _) => LayerFormat::Rg8,
        _ if header.linear => LayerFormat::Rgba8,
        _ => LayerFormat::Rgba8Srgb,
    }
}

/// Turns a row of an image into a row of its layer. Both have the same number of texels.
pub(crate) fn layer_row_from_image_row(layer: &mut [u8], image: &[u8], format: PixelFormat) {
    match (format.channels(), format.sample()) {
        (1, _) | (2 | 4, Sample::U8) | (4, Sample::F16) => layer.copy_from_slice(image),
        (_, Sample::U8) => {
            for (to, &[r, g, b]) in layer.as_chunks_mut::<4>().0.iter_mut().zip(image.as_chunks::<3>().0) {
                *to = [r, g, b, 255];
            }
        }
        (2 | 4, Sample::U16) => {
            for (to, &sample) in layer.iter_mut().zip(image.as_chunks::<2>().0) {
                *to = eight_bits(sample);
            }
        }
        (_, Sample::U16) => {
            for (to, &[r0, r1, g0, g1, b0, b1]) in
                layer.as_chunks_mut::<4>().0.iter_mut().zip(image.as_chunks::<6>().0)
            {
                *to = [eight_bits([r0, r1]), eight_bits([g0, g1]), eight_bits([b0, b1]), 255];
            }
        }
        (channels, Sample::F16) => four_halves(layer, image, channels, |[a, b]: &[u8; 2]| [*a, *b]),
        (channels, Sample::F32) => four_halves(layer, image, channels, |&sample: &[u8; 4]| {
            f16::from_f32(f32::from_le_bytes(sample)).to_le_bytes()
        }),
    }
}

/// Texels of four 16-bit floats; grey goes into all colours, alpha that is missing is 1.
fn four_halves<const B: usize>(
    layer: &mut [u8],
    image: &[u8],
    channels: u8,
    half: impl Fn(&[u8; B]) -> [u8; 2],
) {
    let texels = image.as_chunks::<B>().0.chunks_exact(usize::from(channels));
    for (to, texel) in layer.chunks_exact_mut(8).zip(texels) {
        let one = f16::ONE.to_le_bytes();
        let [r, g, b, a] = match texel {
            [r, g, b, a] => [half(r), half(g), half(b), half(a)],
            [r, g, b] => [half(r), half(g), half(b), one],
            [grey, alpha] => [half(grey), half(grey), half(grey), half(alpha)],
            others => [others.first().map_or(one, &half); 4],
        };
        for (to, sample) in to.as_chunks_mut::<2>().0.iter_mut().zip([r, g, b, a]) {
            *to = sample;
        }
    }
}

fn eight_bits(sample: [u8; 2]) -> u8 {
    ((u32::from(u16::from_le_bytes(sample)) + 128) / 257) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_bits_round_to_the_nearest_eight() {
        for v in 0..=u16::MAX {
            let nearest = (f64::from(v) / 257.0).round() as u8;
            assert_eq!(eight_bits(v.to_le_bytes()), nearest, "{v}");
        }
    }

    #[test]
    fn colour_without_alpha_is_opaque() {
        let mut layer = [0; 8];
        layer_row_from_image_row(&mut layer, &[1, 2, 3, 4, 5, 6], PixelFormat::RGB8);
        assert_eq!(layer, [1, 2, 3, 255, 4, 5, 6, 255]);
        layer_row_from_image_row(&mut layer[..4], &[0xff, 0xff, 0x80, 0x80, 0x7f, 0x00], PixelFormat::RGB16);
        assert_eq!(layer[..4], [255, 128, 0, 255]);
    }
}
