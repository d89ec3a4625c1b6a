//! What values mean, and what is done to them before they are mixed and after.

use vastex_core::LayerFormat;

use crate::texels::texel::is_float;

/// What the values of a layer are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Meaning {
    /// Numbers, each channel by itself, mixed as they are stored.
    #[default]
    Stored,
    /// Colour: mixed as light where it is sRGB-encoded, and weighted by alpha.
    LinearColor,
    /// Vectors of length 1: mixed as such and made as long again. Values of 0 to 1 stand for -1 to 1, floats
    /// for themselves; of two channels the third is found, and is not negative; a fourth is mixed by itself.
    Normal,
}

/// Added to alpha as a weight, so that the colours of texels that are all transparent count alike. Too little
/// to show beside the least alpha that a format of 8 bits holds.
pub(crate) const LEAST_WEIGHT: f32 = 1.0 / (1 << 20) as f32;

impl Meaning {
    /// Every meaning.
    pub const ALL: [Meaning; 3] = [Meaning::Stored, Meaning::LinearColor, Meaning::Normal];

    /// What follows the kernel in the name of a filter.
    pub const fn suffix(self) -> &'static str {
        match self {
            Meaning::Stored => "",
            Meaning::LinearColor => "-linear",
            Meaning::Normal => "-normal",
        }
    }

    /// Returns true if values of a format can have this meaning.
    pub const fn suits(self, format: LayerFormat) -> bool {
        match self {
            Meaning::Stored => true,
            Meaning::LinearColor => format.decoded().channels() == 4,
            Meaning::Normal => format.channels() >= 2 && !format.is_srgb(),
        }
    }

    /// Channels that are mixed, for a format that is not compressed.
    pub(crate) fn channels(self, format: LayerFormat) -> usize {
        match self {
            Meaning::Normal => format.channels().max(3),
            _ => format.channels(),
        }
    }

    /// Makes `mixed` ready to be mixed, from the values of texels.
    pub(super) fn prepare(self, format: LayerFormat, values: &[f32], mixed: &mut [f32]) {
        match self {
            Meaning::Stored => mixed.copy_from_slice(values),
            Meaning::LinearColor => {
                for (to, &[r, g, b, a]) in
                    mixed.as_chunks_mut::<4>().0.iter_mut().zip(values.as_chunks::<4>().0)
                {
                    let weight = a.max(0.0) + LEAST_WEIGHT;
                    *to = [r * weight, g * weight, b * weight, weight];
                }
            }
            Meaning::Normal => {
                let vector = |value: f32| if is_float(format) { value } else { 2.0 * value - 1.0 };
                let texels = values.chunks_exact(format.channels());
                for (to, texel) in mixed.chunks_exact_mut(self.channels(format)).zip(texels) {
                    let (x, y) = (vector(texel[0]), vector(texel[1]));
                    (to[0], to[1]) = (x, y);
                    to[2] = match texel.get(2) {
                        Some(&z) => vector(z),
                        None => (1.0 - x * x - y * y).max(0.0).sqrt(),
                    };
                    if let Some(&fourth) = texel.get(3) {
                        to[3] = fourth;
                    }
                }
            }
        }
    }

    /// The values of texels, from what was mixed.
    pub(super) fn finish(self, format: LayerFormat, mixed: &[f32], values: &mut [f32]) {
        match self {
            Meaning::Stored => values.copy_from_slice(mixed),
            Meaning::LinearColor => {
                for (to, &[r, g, b, weight]) in
                    values.as_chunks_mut::<4>().0.iter_mut().zip(mixed.as_chunks::<4>().0)
                {
                    // Kernels with negative weights can leave less than nothing; colour and alpha then have
                    // the same sign.
                    let part = if weight.abs() >= LEAST_WEIGHT / 2.0 { 1.0 / weight } else { 0.0 };
                    *to = [r * part, g * part, b * part, (weight - LEAST_WEIGHT).max(0.0)];
                }
            }
            Meaning::Normal => {
                let stored = |value: f32| if is_float(format) { value } else { 0.5 * value + 0.5 };
                let channels = format.channels();
                for (to, from) in
                    values.chunks_exact_mut(channels).zip(mixed.chunks_exact(self.channels(format)))
                {
                    let unit = unit([from[0], from[1], from[2]]).map(stored);
                    let vector = channels.min(3);
                    to[..vector].copy_from_slice(&unit[..vector]);
                    to[vector..].copy_from_slice(&from[vector.max(3)..]);
                }
            }
        }
    }
}

/// A vector of length 1; what has no direction points along z.
pub(crate) fn unit([x, y, z]: [f32; 3]) -> [f32; 3] {
    let length = (x * x + y * y + z * z).sqrt();
    if length > 1e-6 { [x / length, y / length, z / length] } else { [0.0, 0.0, 1.0] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn through(meaning: Meaning, format: LayerFormat, texels: &[&[f32]], weights: &[f32]) -> Vec<f32> {
        let mut sum = vec![0.0; meaning.channels(format)];
        for (texel, weight) in texels.iter().zip(weights) {
            let mut mixed = sum.clone();
            meaning.prepare(format, texel, &mut mixed);
            sum.iter_mut().zip(&mixed).for_each(|(sum, value)| *sum += weight * value);
        }
        let mut out = vec![0.0; format.channels()];
        meaning.finish(format, &sum, &mut out);
        out
    }

    fn assert_near(values: &[f32], expected: &[f32]) {
        assert_eq!(values.len(), expected.len());
        assert!(values.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3), "{values:?} {expected:?}");
    }

    #[test]
    fn colour_is_weighted_by_alpha_and_survives_without_it() {
        let mix = |texels: &[&[f32]], weights: &[f32]| {
            through(Meaning::LinearColor, LayerFormat::Rgba8, texels, weights)
        };
        let (red, clear) = (&[0.8, 0.0, 0.0, 1.0][..], &[0.0, 0.4, 0.0, 0.0][..]);
        assert_near(&mix(&[red, clear], &[0.5; 2]), &[0.8, 0.0, 0.0, 0.5]);
        assert_near(&mix(&[clear, clear], &[0.5; 2]), &[0.0, 0.4, 0.0, 0.0]);
        // All that is opaque has a negative weight: no alpha, and the colour is still its own.
        assert_near(&mix(&[red, clear], &[-0.1, 1.1]), &[0.8, 0.0, 0.0, 0.0]);
        let faint = &[0.6, 0.2, 0.0, 1.0 / 255.0][..];
        assert_near(&mix(&[faint, clear, clear, clear], &[0.25; 4]), &[0.6, 0.2, 0.0, 0.25 / 255.0]);
    }

    #[test]
    fn vectors_keep_their_length() {
        let mix = |format, texels: &[&[f32]]| through(Meaning::Normal, format, texels, &[0.5; 2]);
        let half = 0.5 + 0.5 * 0.5f32.sqrt();
        assert_near(
            &mix(LayerFormat::Rgba8, &[&[1.0, 0.5, 0.5, 0.2], &[0.5, 0.5, 1.0, 0.4]]),
            &[half, 0.5, half, 0.3],
        );
        assert_near(&mix(LayerFormat::Rg8, &[&[1.0, 0.5], &[0.5, 0.5]]), &[half, 0.5]);
        assert_near(
            &mix(LayerFormat::Rgba16Float, &[&[1.0, 0.0, 0.0, 0.0], &[-1.0, 0.0, 0.0, 0.0]]),
            &[0.0, 0.0, 1.0, 0.0],
        );
    }
}
