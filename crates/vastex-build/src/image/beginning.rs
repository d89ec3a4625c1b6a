//! How far a reader is with what it must decode before its first row is there, and whether that is still
//! wanted.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use super::InputFault;

/// Parts of a whole that are told apart.
const PARTS: u32 = 1 << 16;

/// The work of a reader before its first row, as other threads see it: it decodes all of a progressive JPEG,
/// of an OpenEXR file of tiles, or of a picture that is stored turned.
#[derive(Debug, Default)]
pub struct Beginning {
    parts: AtomicU32,
    is_broken_off: AtomicBool,
    /// What comes before it, and is half of the work.
    before: Option<Arc<Beginning>>,
}

impl Beginning {
    /// What follows other work.
    pub(super) fn after(before: Option<Arc<Beginning>>) -> Beginning {
        Beginning { before, ..Beginning::default() }
    }

    /// How much of it is done, from 0 to 1.
    pub fn share(&self) -> f64 {
        let own = f64::from(self.parts.load(Ordering::Relaxed)) / f64::from(PARTS);
        self.before.as_ref().map_or(own, |before| f64::midpoint(before.share(), own))
    }

    /// Has the reader end with an error, soon.
    pub fn break_off(&self) {
        self.before.iter().for_each(|before| before.break_off());
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

    /// So much of all is done. Fails where nobody wants it any more.
    pub(super) fn go_on(&self, done: u64, all: u64) -> Result<(), InputFault> {
        if self.is_broken_off() {
            return Err(InputFault::Io(io::Error::other("it is not wanted any more")));
        }
        self.note(done, all);
        Ok(())
    }
}
