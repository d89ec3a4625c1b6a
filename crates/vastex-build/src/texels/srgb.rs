//! The transfer curve of sRGB for whatever prepares data: `linear_from_srgb` decodes a colour as it is stored
//! into the light that it stands for, `srgb_from_linear` encodes. No other file of this crate computes it;
//! sampling on the CPU has its own (`vastex-wgpu`, `twins/sample.rs`).
//!
//! Floats go through [`linear_from_srgb`] and [`srgb_from_linear`], which take 65,536 steps of either and
//! give a float. Whole numbers go through [`SRGB`], whose light has 16 bits. Both round as they always did:
//! the bytes of containers depend on it.

use std::sync::LazyLock;

/// The light of a stored value.
fn linear(stored: f64) -> f64 {
    if stored <= 0.04045 { stored / 12.92 } else { ((stored + 0.055) / 1.055).powf(2.4) }
}

/// The value that stores a light.
fn encoded(light: f64) -> f64 {
    if light <= 0.0031308 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// The greatest index of a table of floats.
const LAST: f32 = 65535.0;

static LINEAR_FROM_SRGB: LazyLock<Vec<f32>> = LazyLock::new(|| table(linear));

static SRGB_FROM_LINEAR: LazyLock<Vec<f32>> = LazyLock::new(|| table(encoded));

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

/// The curve in whole numbers: 8 bits stored, 16 bits of light.
pub(crate) struct Srgb {
    /// Linear, of 65535.
    pub(crate) linear_from_srgb: [u16; 256],
    /// For each of 65536 steps of light the nearest of the 256 values.
    pub(crate) srgb_from_linear: Box<[u8; 65536]>,
    /// Linear, 0 to 1: the same 16 bits.
    pub(super) light: [f32; 256],
}

/// See [`Srgb`].
pub(crate) static SRGB: LazyLock<Srgb> = LazyLock::new(|| {
    let linear_from_srgb: [u16; 256] =
        std::array::from_fn(|v| (linear(v as f64 / 255.0) * 65535.0).round() as u16);
    // A value is encoded as v where it lies between what v - 1/2 and v + 1/2 decode to.
    let mut srgb_from_linear = Box::new([0; 65536]);
    let mut start = 0;
    for v in 0..256 {
        let end = if v == 255 { 65536 } else { (linear((v as f64 + 0.5) / 255.0) * 65535.0).ceil() as usize };
        srgb_from_linear[start..end].fill(v as u8);
        start = end;
    }
    let light = linear_from_srgb.map(|v| f32::from(v) / 65535.0);
    Srgb { linear_from_srgb, srgb_from_linear, light }
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_undoes_decoding_and_never_falls() {
        for v in 0..=255u8 {
            assert_eq!(SRGB.srgb_from_linear[usize::from(SRGB.linear_from_srgb[usize::from(v)])], v);
        }
        assert!(SRGB.srgb_from_linear.is_sorted());
    }

    #[test]
    fn bytes_have_the_light_that_the_curve_gives_them() {
        for v in 0..=255u8 {
            let stored = f64::from(v) / 255.0;
            assert_eq!(linear_from_srgb(stored as f32), linear(stored) as f32);
            assert_eq!((encoded(linear(stored)) * 255.0).round() as u8, v);
        }
        let rounded = |light: usize| (encoded(light as f64 / 65535.0) * 255.0).round() as u8;
        assert!((0..=65535).all(|light| SRGB.srgb_from_linear[light] == rounded(light)));
    }
}
