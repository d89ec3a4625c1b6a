//! What numbers lose on their way into a layer of 16-bit floats: those of more than 11 significant bits are
//! rounded, and those beyond the largest become infinite.

use std::sync::atomic::{AtomicBool, Ordering};

use half::f16;
use vastex_core::LayerFormat;

use super::convert::Conversion;
use crate::image::Notice;

/// The least magnitude that is rounded to infinity: half a step beyond 65504.
const BEYOND: f32 = 65520.0;

/// What was lost of an image's numbers. Threads note it side by side.
#[derive(Debug, Default)]
pub(crate) struct HalfLoss {
    rounded: AtomicBool,
    infinite: AtomicBool,
}

impl HalfLoss {
    /// Looks at rows of an image for numbers that its conversion changes. Takes no time where it keeps them,
    /// and little once a number of each kind was found.
    pub(crate) fn look_at(&self, conversion: &Conversion, image: &[u8]) {
        let Some(nodata) = conversion.narrows() else { return };
        let numbers = || image.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
        // What stands for no data, or is no number, loses nothing that anybody would look for.
        let numbers = || numbers().filter(|value| value.is_finite() && Some(*value) != nodata);
        let find = |found: &AtomicBool, is: fn(f32) -> bool| {
            if !found.load(Ordering::Relaxed) && numbers().any(is) {
                found.store(true, Ordering::Relaxed);
            }
        };
        find(&self.rounded, |value| value.abs() < BEYOND && f16::from_f32(value).to_f32() != value);
        find(&self.infinite, |value| value.abs() >= BEYOND);
    }

    /// What there is to say of a layer of that format.
    pub(crate) fn notices(&self, format: LayerFormat) -> impl Iterator<Item = Notice> + use<> {
        // Blocks are near what they are made of, and nobody expects more.
        let is_rounded = self.rounded.load(Ordering::Relaxed) && !format.is_compressed();
        let infinite = self.infinite.load(Ordering::Relaxed).then_some(Notice::HalfsInfinite(format));
        infinite.into_iter().chain(is_rounded.then_some(Notice::HalfsRounded(format)))
    }
}
