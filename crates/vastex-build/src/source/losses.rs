//! What numbers lose where a source's tiles are read in place, told as soon as it is found.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use vastex_core::LayerFormat;

use crate::image::Notice;
use crate::texels::convert::Conversion;
use crate::texels::halfs::HalfLoss;

/// Who is told, by whichever thread reads the tile.
pub(super) type LossListener = Box<dyn Fn(Notice) + Send + Sync>;

/// What the texels that were read so far lost in a layer of a format, and who is told of it.
pub(super) struct Losses {
    format: LayerFormat,
    found: HalfLoss,
    listener: OnceLock<LossListener>,
    /// Whether it was told that numbers are rounded, and that some are infinite.
    told: [AtomicBool; 2],
}

impl Losses {
    pub(super) fn new(format: LayerFormat) -> Losses {
        let (found, listener, told) = Default::default();
        Losses { format, found, listener, told }
    }

    /// Looks at texels of an image for numbers that its conversion changes.
    pub(super) fn look_at(&self, conversion: &Conversion, image: &[u8]) {
        self.found.look_at(conversion, image);
        self.tell();
    }

    /// Has everything told once, what was found already as well. There is one listener, the first.
    pub(super) fn listen(&self, listener: LossListener) {
        drop(self.listener.set(listener));
        self.tell();
    }

    /// What there is to say of a layer of a format.
    pub(super) fn notices(&self, format: LayerFormat) -> Vec<Notice> {
        self.found.notices(format).collect()
    }

    fn tell(&self) {
        let Some(listener) = self.listener.get() else { return };
        for notice in self.found.notices(self.format) {
            let nth = usize::from(matches!(notice, Notice::HalfsInfinite(_)));
            if !self.told[nth].swap(true, Ordering::Relaxed) {
                listener(notice);
            }
        }
    }
}
