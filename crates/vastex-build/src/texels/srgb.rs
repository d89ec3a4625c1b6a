//! The transfer curve of sRGB, as tables of 65536 steps from 0 to 1: between a colour as it is stored in 8 bits and the
//! light that it stands for.

use std::sync::LazyLock;

/// The greatest index of a table.
const LAST: f32 = 65535.0;

static LINEAR_FROM_SRGB: LazyLock<Vec<f32>> =
    LazyLock::new(|| table(|s| if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }));

static SRGB_FROM_LINEAR: LazyLock<Vec<f32>> =
    LazyLock::new(|| table(|l| if l <= 0.0031308 { l * 12.92 } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 }));

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
