//! What sources of a volume tell of its chunks: they share these, and tell each read once between them.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use vastex_tiles::{ChunkStats, StoreStats, Tiers};

use super::Volume;

/// Tells sources apart.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// What the sources of a volume have told so far.
#[derive(Debug, Default)]
pub(crate) struct Told {
    store: StoreStats,
    chunks: ChunkStats,
    /// The source that tells what is kept; 0 where there is none.
    teller: u64,
}

/// What one source tells.
pub(crate) struct Telling {
    volume: Arc<Volume>,
    number: u64,
    /// What it has told of what was done.
    done: Mutex<(StoreStats, ChunkStats)>,
}

impl Telling {
    pub(crate) fn new(volume: Arc<Volume>) -> Telling {
        Telling { volume, number: NEXT.fetch_add(1, Ordering::Relaxed), done: Mutex::default() }
    }

    /// Adds what this source has told before, and what was done of the volume since any source was asked.
    /// What is kept is told by one of those that are there.
    pub(crate) fn add_to(&self, tiers: &mut Tiers) {
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        let mut told = self.volume.told.lock().unwrap_or_else(PoisonError::into_inner);
        let work = self.volume.chunk_work();
        let store = StoreStats { reads: work.decoded, bytes: work.bytes_read };
        let chunks = ChunkStats {
            decoded: work.decoded,
            bytes_decoded: work.bytes_decoded,
            shared: work.shared,
            bytes: 0,
        };
        done.0.reads += store.reads.saturating_sub(told.store.reads);
        done.0.bytes += store.bytes.saturating_sub(told.store.bytes);
        done.1 += chunks.since(&told.chunks);
        (told.store, told.chunks) = (store, chunks);
        if told.teller == 0 {
            told.teller = self.number;
        }
        tiers.store += done.0;
        tiers.chunks += done.1;
        if told.teller == self.number {
            tiers.chunks.bytes += work.bytes_kept;
        }
    }
}

impl Drop for Telling {
    fn drop(&mut self) {
        let mut told = self.volume.told.lock().unwrap_or_else(PoisonError::into_inner);
        if told.teller == self.number {
            told.teller = 0;
        }
    }
}
