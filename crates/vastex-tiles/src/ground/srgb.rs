//! The transfer curve of sRGB, for whatever makes texels: builds, and coarser levels of pixels in memory.
//! What a GPU decodes by itself has a twin of its own (`vastex-wgpu`, `twins/sample.rs`).
//!
//! Both directions round as they always did: the bytes of containers depend on it.

use std::sync::LazyLock;

/// The light that a stored value stands for, both 0 to 1.
pub fn linear_from_srgb(stored: f64) -> f64 {
    if stored <= 0.04045 { stored / 12.92 } else { ((stored + 0.055) / 1.055).powf(2.4) }
}

/// The value that stores a light, both 0 to 1.
pub fn srgb_from_linear(light: f64) -> f64 {
    if light <= 0.0031308 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// The curve in whole numbers: 8 bits stored, 16 bits of light.
#[derive(Debug)]
pub struct Srgb {
    /// The light of each stored value, of 65535.
    pub linear_from_srgb: [u16; 256],
    /// For each of 65536 steps of light the nearest of the 256 stored values.
    pub srgb_from_linear: Box<[u8; 65536]>,
    /// The light of each stored value, 0 to 1: the same 16 bits.
    pub light: [f32; 256],
}

/// The one table of the curve in whole numbers.
pub static SRGB: LazyLock<Srgb> = LazyLock::new(|| {
    let light_of = |v: f64| linear_from_srgb(v / 255.0) * 65535.0;
    let linear_from_srgb: [u16; 256] = std::array::from_fn(|v| light_of(v as f64).round() as u16);
    // A value is stored as v where it lies between what v - 1/2 and v + 1/2 stand for.
    let mut srgb_from_linear = Box::new([0; 65536]);
    let mut start = 0;
    for v in 0..=255u8 {
        let end = if v == 255 { 65536 } else { light_of(f64::from(v) + 0.5).ceil() as usize };
        srgb_from_linear[start..end].fill(v);
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
            let stored = f64::from(v) / 255.0;
            assert_eq!((srgb_from_linear(linear_from_srgb(stored)) * 255.0).round() as u8, v);
        }
        assert!(SRGB.srgb_from_linear.is_sorted());
    }

    #[test]
    fn each_step_of_light_is_stored_as_the_nearest_value() {
        let rounded = |light: usize| (srgb_from_linear(light as f64 / 65535.0) * 255.0).round() as u8;
        assert!((0..=65535).all(|light| SRGB.srgb_from_linear[light] == rounded(light)));
    }
}
