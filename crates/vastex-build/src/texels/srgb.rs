//! The transfer curve of sRGB in floats, for whatever prepares data: `linear_from_srgb` decodes a colour as
//! it is stored into the light that it stands for, `srgb_from_linear` encodes. The curve itself, and its
//! table in whole numbers, [`SRGB`], are those of `vastex-tiles`.
//!
//! Both functions take 65,536 steps and give a float. They round as they always did: the bytes of containers
//! depend on it.

use std::sync::LazyLock;

pub(crate) use vastex_tiles::SRGB;

/// The greatest index of a table of floats.
const LAST: f32 = 65535.0;

static LINEAR_FROM_SRGB: LazyLock<Vec<f32>> = LazyLock::new(|| table(vastex_tiles::linear_from_srgb));

static SRGB_FROM_LINEAR: LazyLock<Vec<f32>> = LazyLock::new(|| table(vastex_tiles::srgb_from_linear));

fn table(curve: impl Fn(f64) -> f64) -> Vec<f32> {
    (0..=u16::MAX).map(|v| curve(f64::from(v) / f64::from(LAST)) as f32).collect()
}

/// The light of a stored value: exact for whole numbers of 8 and 16 bits. What lies beyond 0 to 1 is clamped.
pub(crate) fn linear_from_srgb(stored: f32) -> f32 {
    LINEAR_FROM_SRGB[index(stored)]
}

/// The value that stores a light, to a twentieth of a step of 8 bits. What lies beyond 0 to 1 is clamped.
pub(crate) fn srgb_from_linear(light: f32) -> f32 {
    SRGB_FROM_LINEAR[index(light)]
}

/// Of what is no number, 0.
fn index(value: f32) -> usize {
    usize::from((value * LAST + 0.5) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_the_light_that_the_curve_gives_them() {
        for v in 0..=255u8 {
            let stored = f64::from(v) / 255.0;
            assert_eq!(linear_from_srgb(stored as f32), vastex_tiles::linear_from_srgb(stored) as f32);
            assert_eq!((srgb_from_linear(linear_from_srgb(stored as f32)) * 255.0).round() as u8, v);
        }
    }
}
