//! What was found out of a texture's layers while tiles were made: what their formats cannot hold, and images
//! had.

use std::sync::atomic::{AtomicBool, Ordering};

use vastex_core::LayerFormat;

use crate::image::Notice;
use crate::texels::convert::Conversion;
use crate::texels::halfs::HalfLoss;

/// What was found, for each layer. Threads that make tiles note it side by side.
pub(crate) struct Findings(Vec<OfLayer>);

#[derive(Default)]
struct OfLayer {
    /// True if texels are not opaque, and the format keeps no alpha.
    transparency: AtomicBool,
    /// True if numbers are negative, and the format holds none.
    negatives: AtomicBool,
    /// What floats of 16 bits cannot hold.
    halfs: HalfLoss,
}

impl Findings {
    /// Nothing yet, of so many layers.
    pub(crate) fn new(layers: usize) -> Findings {
        Findings((0..layers).map(|_| OfLayer::default()).collect())
    }

    /// Looks at rows of a layer's image for transparency that its conversion drops, and for numbers that it
    /// changes.
    pub(crate) fn look_at(&self, layer: usize, conversion: &Conversion, image_rows: &[u8]) {
        let OfLayer { transparency: found, halfs, .. } = &self.0[layer];
        halfs.look_at(conversion, image_rows);
        if !found.load(Ordering::Relaxed) && conversion.loses_alpha_of(image_rows) {
            found.store(true, Ordering::Relaxed);
        }
    }

    /// A layer had negative numbers.
    pub(crate) fn note_negatives(&self, layer: usize) {
        self.0[layer].negatives.store(true, Ordering::Relaxed);
    }

    /// What there is to say of a layer of that format.
    pub(crate) fn notices(&self, layer: usize, format: LayerFormat) -> Vec<Notice> {
        let OfLayer { transparency, negatives, halfs } = &self.0[layer];
        let found =
            [(transparency, Notice::NotOpaque(format)), (negatives, Notice::NegativesClamped(format))];
        let found = found.into_iter().filter(|(found, _)| found.load(Ordering::Relaxed));
        found.map(|(_, notice)| notice).chain(halfs.notices(format)).collect()
    }
}
