//! Stored texels of integers as sums of others, each with its weight; all weights of a sum come to 1.
//!
//! Colour is blended in linear light and weighted by alpha, everything else as it is stored. Levels are made
//! by [`super::filter`] instead, and images of another size by [`super::scaled`]: each rounds in its own way,
//! on which the bytes of what it makes depend.

use vastex_core::LayerFormat;

use super::srgb::{SRGB, linear_from_srgb};

/// Adds a row, weighted. Colours come linear and multiplied by alpha.
pub(crate) fn add_weighted(sum: &mut [f32], row: &[u8], format: LayerFormat, weight: f32) {
    match format {
        LayerFormat::R16 => {
            for (sum, sample) in sum.iter_mut().zip(row.as_chunks::<2>().0) {
                *sum += weight * f32::from(u16::from_le_bytes(*sample));
            }
        }
        LayerFormat::Rgba16 => {
            for (sum, texel) in sum.as_chunks_mut::<4>().0.iter_mut().zip(row.as_chunks::<8>().0) {
                let [r, g, b, a] =
                    std::array::from_fn(|c| f32::from(u16::from_le_bytes([texel[2 * c], texel[2 * c + 1]])));
                let alpha = weight * a;
                for (sum, value) in sum.iter_mut().zip([r, g, b]) {
                    *sum += alpha * (value / 65535.0);
                }
                sum[3] += alpha;
            }
        }
        LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb => {
            let is_srgb = format == LayerFormat::Rgba8Srgb;
            for (sum, &[r, g, b, a]) in sum.as_chunks_mut::<4>().0.iter_mut().zip(row.as_chunks::<4>().0) {
                let alpha = weight * f32::from(a);
                for (sum, value) in sum.iter_mut().zip([r, g, b]) {
                    let stored = f32::from(value) / 255.0;
                    *sum += alpha * if is_srgb { linear_from_srgb(stored) } else { stored };
                }
                sum[3] += alpha;
            }
        }
        _ => {
            sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * f32::from(*value));
        }
    }
}

/// Appends the texel whose channels are such a sum.
pub(crate) fn append_sum(out: &mut Vec<u8>, texel: [f32; 4], format: LayerFormat) {
    let byte = |value: f32| (value + 0.5) as u8;
    let word = |value: f32| ((value + 0.5) as u16).to_le_bytes();
    match format {
        LayerFormat::R16 => out.extend_from_slice(&word(texel[0])),
        LayerFormat::Rgba16 => {
            let alpha = texel[3];
            let light = |c: usize| if alpha > 0.0 { texel[c] / alpha } else { 0.0 };
            out.extend([0, 1, 2].map(|c| word(light(c) * 65535.0)).as_flattened());
            out.extend(word(alpha));
        }
        LayerFormat::R8 => out.push(byte(texel[0])),
        LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb => {
            let alpha = texel[3];
            let color = |c: usize| {
                let linear = if alpha > 0.0 { texel[c] / alpha } else { 0.0 };
                match format {
                    LayerFormat::Rgba8Srgb => SRGB.srgb_from_linear[(linear * 65535.0 + 0.5) as u16 as usize],
                    _ => byte(linear * 255.0),
                }
            };
            out.extend([color(0), color(1), color(2), byte(alpha)]);
        }
        _ => out.extend([byte(texel[0]), byte(texel[1])]),
    }
}
