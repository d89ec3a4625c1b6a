//! How far a reader is with what it must decode before its first row is there, and whether that is still
//! wanted.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Parts of a whole that are told apart.
const PARTS: u32 = 1 << 16;

/// The work of a reader before its first row, as other threads see it: it decodes all of a progressive JPEG.
#[derive(Debug, Default)]
pub struct Beginning {
    parts: AtomicU32,
    is_broken_off: AtomicBool,
}

impl Beginning {
    /// How much of it is done, from 0 to 1.
    pub fn share(&self) -> f64 {
        f64::from(self.parts.load(Ordering::Relaxed)) / f64::from(PARTS)
    }

    /// Has the reader end with an error, soon.
    pub fn break_off(&self) {
        self.is_broken_off.store(true, Ordering::Relaxed);
    }

    /// Returns true once [`Beginning::break_off`] was called.
    pub fn is_broken_off(&self) -> bool {
        self.is_broken_off.load(Ordering::Relaxed)
    }

    /// So many bytes of all are done.
    pub(super) fn note(&self, bytes: u64, all: u64) {
        let parts = u128::from(bytes) * u128::from(PARTS) / u128::from(all.max(1));
        self.parts.store(parts.min(PARTS.into()) as u32, Ordering::Relaxed);
    }
}
