//! From the texels of an image file to those of a layer.
//!
//! | in the file | layer |
//! |---|---|
//! | grey, 8 bits | `R8` |
//! | grey, 16 bits | `R16`, exact |
//! | grey and alpha | `RG8` |
//! | RGB, RGBA | `RGBA8`, sRGB unless the file says linear; without alpha it is 255 |
//!
//! 16 bits become 8 by `round(v / 257)`, where grey stands with alpha or colour is meant.

use vastex_core::LayerFormat;

use crate::readers::{ImageHeader, PixelFormat};

/// The layer that holds an image.
pub(crate) fn layer_format(header: &ImageHeader) -> LayerFormat {
    match header.format {
        PixelFormat::Grey8 => LayerFormat::R8,
        PixelFormat::Grey16 => LayerFormat::R16,
        PixelFormat::GreyAlpha8 | PixelFormat::GreyAlpha16 => LayerFormat::Rg8,
        _ if header.linear => LayerFormat::Rgba8,
        _ => LayerFormat::Rgba8Srgb,
    }
}

/// Turns a row of an image into a row of its layer. Both have the same number of texels.
pub(crate) fn layer_row_from_image_row(layer: &mut [u8], image: &[u8], format: PixelFormat) {
    match format {
        PixelFormat::Grey8 | PixelFormat::GreyAlpha8 | PixelFormat::Rgba8 | PixelFormat::Grey16 => {
            layer.copy_from_slice(image);
        }
        PixelFormat::Rgb8 => {
            for (to, &[r, g, b]) in layer.as_chunks_mut::<4>().0.iter_mut().zip(image.as_chunks::<3>().0) {
                *to = [r, g, b, 255];
            }
        }
        PixelFormat::GreyAlpha16 | PixelFormat::Rgba16 => {
            for (to, &sample) in layer.iter_mut().zip(image.as_chunks::<2>().0) {
                *to = eight_bits(sample);
            }
        }
        PixelFormat::Rgb16 => {
            for (to, &[r0, r1, g0, g1, b0, b1]) in
                layer.as_chunks_mut::<4>().0.iter_mut().zip(image.as_chunks::<6>().0)
            {
                *to = [eight_bits([r0, r1]), eight_bits([g0, g1]), eight_bits([b0, b1]), 255];
            }
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
        layer_row_from_image_row(&mut layer, &[1, 2, 3, 4, 5, 6], PixelFormat::Rgb8);
        assert_eq!(layer, [1, 2, 3, 255, 4, 5, 6, 255]);
        layer_row_from_image_row(&mut layer[..4], &[0xff, 0xff, 0x80, 0x80, 0x7f, 0x00], PixelFormat::Rgb16);
        assert_eq!(layer[..4], [255, 128, 0, 255]);
    }
}
