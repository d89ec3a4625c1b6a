//! The budget of main memory that several RAM caches share.

use std::fmt;
use std::sync::{Arc, Mutex};

use super::kept::Kept;
use crate::ground::sync::lock;

/// A budget of bytes of main memory, for the encoded tiles of all [`RamCache`](crate::RamCache)s that were
/// made with it.
///
/// Where there is no room for a tile, the tile whose last use is the oldest goes, whichever cache it is of.
/// One cache cannot push out all that the others are using, though: of the bytes that other caches have
/// used in the last jitter cycle
/// ([`JITTER_CYCLE`](vastex_core::shader_constants::JITTER_CYCLE) frames, counted by
/// [`RamBudget::begin_frame`]), a cache takes at most half. What it reads beyond that takes the place of its
/// own oldest tiles, or is not kept if it has none.
pub struct RamBudget {
    bytes: u64,
    pub(super) kept: Mutex<Kept>,
}

impl RamBudget {
    /// A budget of at most `bytes`, of which nothing is taken. Each tile counts 128 bytes in addition to its
    /// own.
    pub fn new(bytes: u64) -> Arc<RamBudget> {
        Arc::new(RamBudget { bytes, kept: Mutex::new(Kept::new(bytes)) })
    }

    /// The bytes that all caches together may hold.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The bytes that all caches together hold; never more than [`RamBudget::bytes`].
    pub fn held_bytes(&self) -> u64 {
        lock(&self.kept).bytes()
    }

    /// Says that a frame begins. Without frames, everything counts as used in the last jitter cycle. Costs a
    /// step for each tile that was last used in the frame that leaves the cycle.
    pub fn begin_frame(&self) {
        lock(&self.kept).begin_frame();
    }
}

impl fmt::Debug for RamBudget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let held = self.held_bytes();
        f.debug_struct("RamBudget").field("bytes", &self.bytes).field("held_bytes", &held).finish()
    }
}
