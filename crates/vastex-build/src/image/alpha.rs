//! Colours that a file holds multiplied by alpha, divided by it again: layers hold colours as they are where
//! nothing is transparent, and filters weight them by alpha themselves.

use half::f16;

use crate::image::{PixelFormat, Sample};

/// Divides the colours of texels by their alpha, as the file stores both: whoever writes such a file
/// multiplies the numbers that he stores, so sRGB-encoded ones are divided before they become light.
///
/// Where alpha is 0 or less, colours stay as they are; what would come out beyond the range of the samples
/// becomes the largest. The format has alpha.
pub(super) fn unpremultiply(format: PixelFormat, texels: &mut [u8]) {
    let bytes = format.texel_bytes();
    match format.sample() {
        Sample::U8 => divide(texels, bytes, |[v]: [u8; 1], [a]| [whole(v.into(), a.into(), 255) as u8]),
        Sample::U16 => divide(texels, bytes, |v, a| {
            (whole(u16::from_le_bytes(v).into(), u16::from_le_bytes(a).into(), 65535) as u16).to_le_bytes()
        }),
        Sample::F16 => divide(texels, bytes, |v, a| {
            let [v, a] = [v, a].map(|bytes| f16::from_le_bytes(bytes).to_f32());
            f16::from_f32(float(v, a).clamp(f16::MIN.to_f32(), f16::MAX.to_f32())).to_le_bytes()
        }),
        Sample::F32 => divide(texels, bytes, |v, a| {
            let [v, a] = [v, a].map(f32::from_le_bytes);
            float(v, a).clamp(f32::MIN, f32::MAX).to_le_bytes()
        }),
    }
}

/// Each colour with the alpha behind it, of texels of so many bytes.
fn divide<const B: usize>(texels: &mut [u8], bytes: usize, quotient: impl Fn([u8; B], [u8; B]) -> [u8; B]) {
    for texel in texels.chunks_exact_mut(bytes) {
        if let Some((alpha, colors)) = texel.as_chunks_mut::<B>().0.split_last_mut() {
            colors.iter_mut().for_each(|color| *color = quotient(*color, *alpha));
        }
    }
}

/// The nearest whole number of `most` steps.
fn whole(value: u32, alpha: u32, most: u32) -> u32 {
    match alpha {
        0 => value,
        _ => ((value * most + alpha / 2) / alpha).min(most),
    }
}

fn float(value: f32, alpha: f32) -> f32 {
    if alpha > 0.0 { value / alpha } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_come_back_to_the_nearest() {
        for alpha in 0..=255u32 {
            for value in 0..=255u32 {
                let stored = (value * alpha + 127) / 255;
                let mut texel = [stored as u8, 0, 255, alpha as u8];
                unpremultiply(PixelFormat::RGBA8, &mut texel);
                if alpha == 0 {
                    assert_eq!(texel, [stored as u8, 0, 255, 0]);
                    continue;
                }
                // Half a step of what was stored, and half a step of rounding.
                let error = f64::from(texel[0]) - f64::from(value);
                assert!(error.abs() <= 0.5 * 255.0 / f64::from(alpha) + 0.5, "{value} {alpha}: {texel:?}");
                assert_eq!(texel[1..], [0, 255, alpha as u8]);
            }
        }
        let mut texel = [1000u16, 65535, 2000, 65535].map(u16::to_le_bytes);
        unpremultiply(PixelFormat::RGBA16, texel.as_flattened_mut());
        assert_eq!(texel.map(u16::from_le_bytes), [1000, 65535, 2000, 65535]);
        let mut texel = [3000u16, 1000].map(u16::to_le_bytes);
        unpremultiply(PixelFormat::GREY_ALPHA16, texel.as_flattened_mut());
        assert_eq!(texel.map(u16::from_le_bytes), [65535, 1000]);
    }

    #[test]
    fn floats_are_divided_and_stay_finite() {
        let divided = |texel: [f32; 4]| {
            let mut texel = texel.map(f32::to_le_bytes);
            unpremultiply(PixelFormat::RGBA8.with_sample(Sample::F32), texel.as_flattened_mut());
            texel.map(f32::from_le_bytes)
        };
        assert_eq!(divided([0.25, 3.0, -0.5, 0.5]), [0.5, 6.0, -1.0, 0.5]);
        assert_eq!(divided([0.25, 3.0, -0.5, 0.0]), [0.25, 3.0, -0.5, 0.0]);
        assert_eq!(divided([1e30, 0.0, 0.0, 1e-30])[0], f32::MAX);
        let mut texel = [f16::from_f32(60000.0), f16::from_f32(0.25)].map(f16::to_le_bytes);
        unpremultiply(PixelFormat::GREY_ALPHA8.with_sample(Sample::F16), texel.as_flattened_mut());
        assert_eq!(f16::from_le_bytes(texel[0]), f16::MAX);
    }
}
