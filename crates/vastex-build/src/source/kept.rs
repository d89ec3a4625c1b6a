//! The decoded files of a directory that were needed last, shared by threads.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use vastex_tiles::{StoreCounter, StoreStats};

use crate::image::grids::tile::{Decoded, Piece};
use crate::image::{InputFault, PixelFormat};

/// Bytes of decoded files that are kept, where that is at least [`FEWEST`] of them.
const BYTES: u64 = 64 << 20;
/// So many neighbours of a page are needed again at once.
const FEWEST: u64 = 4;
const MOST: u64 = 256;

/// A file that is decoded, or being decoded by whoever holds the lock.
type Slot = Arc<Mutex<Option<Arc<Decoded>>>>;

/// Decoded files, the newest first. The list is never locked while a file is decoded; who needs a file that
/// is being decoded waits for that one alone.
pub(super) struct KeptTiles {
    capacity: usize,
    slots: Mutex<VecDeque<(PathBuf, Slot)>>,
    reads: StoreCounter,
}

impl KeptTiles {
    /// For cells of so many texels per side.
    pub(super) fn new(cell: u32, format: PixelFormat) -> KeptTiles {
        let bytes = u64::from(cell) * u64::from(cell) * format.texel_bytes() as u64;
        let capacity = (BYTES / bytes.max(1)).clamp(FEWEST, MOST) as usize;
        KeptTiles { capacity, slots: Mutex::default(), reads: StoreCounter::default() }
    }

    /// The file of a piece. A file that cannot be decoded is forgotten, so that the next one who asks tries
    /// again.
    pub(super) fn load(&self, piece: &Piece, format: PixelFormat) -> Result<Arc<Decoded>, InputFault> {
        let slot = self.slot(piece);
        let mut found = lock(&slot);
        if let Some(decoded) = &*found {
            return Ok(decoded.clone());
        }
        let mut decoded = Decoded::default();
        decoded.load(piece, format)?;
        self.reads.note(std::fs::metadata(&piece.path).map_or(0, |file| file.len()));
        Ok(found.insert(Arc::new(decoded)).clone())
    }

    /// What has been read of files.
    pub(super) fn reads(&self) -> StoreStats {
        self.reads.stats()
    }

    /// Lets go of all files: they may have changed. Who is decoding one does so for itself alone.
    pub(super) fn forget(&self) {
        lock(&self.slots).clear();
    }

    fn slot(&self, piece: &Piece) -> Slot {
        let mut slots = lock(&self.slots);
        let known = slots.iter().position(|(path, _)| *path == piece.path).and_then(|at| slots.remove(at));
        let entry = known.unwrap_or_else(|| (piece.path.clone(), Slot::default()));
        let slot = entry.1.clone();
        slots.push_front(entry);
        slots.truncate(self.capacity);
        slot
    }
}

/// What is locked is whole at any moment, so a panic elsewhere does it no harm.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
