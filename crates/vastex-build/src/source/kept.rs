//! What was decoded last of a source and will be needed again by the neighbours of a page, shared by threads.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::image::InputFault;

/// Bytes of decoded cells that are kept, where that is at least [`FEWEST`] of them.
const BYTES: u64 = 64 << 20;
/// So many neighbours of a page are needed again at once.
const FEWEST: u64 = 4;
const MOST: u64 = 256;

/// A cell that is decoded, or being decoded by whoever holds the lock.
type Slot<V> = Arc<Mutex<Option<Arc<V>>>>;

/// Decoded cells by their names, the newest first. The list is never locked while one is decoded; who needs
/// one that is being decoded waits for that one alone.
pub(super) struct Kept<K, V> {
    capacity: usize,
    slots: Mutex<VecDeque<(K, Slot<V>)>>,
}

impl<K: Clone + PartialEq, V> Kept<K, V> {
    /// For cells of so many bytes.
    pub(super) fn new(cell_bytes: u64) -> Kept<K, V> {
        let capacity = (BYTES / cell_bytes.max(1)).clamp(FEWEST, MOST) as usize;
        Kept { capacity, slots: Mutex::default() }
    }

    /// The cell of a name, which `decode` makes where it is not there. One that cannot be decoded is
    /// forgotten, so that the next one who asks tries again.
    pub(super) fn load(
        &self,
        name: &K,
        decode: impl FnOnce() -> Result<V, InputFault>,
    ) -> Result<Arc<V>, InputFault> {
        let slot = self.slot(name);
        let mut found = lock(&slot);
        if let Some(decoded) = &*found {
            return Ok(decoded.clone());
        }
        let decoded = decode()?;
        Ok(found.insert(Arc::new(decoded)).clone())
    }

    /// Lets go of all cells: they may have changed. Who is decoding one does so for itself alone.
    pub(super) fn forget(&self) {
        lock(&self.slots).clear();
    }

    fn slot(&self, name: &K) -> Slot<V> {
        let mut slots = lock(&self.slots);
        let known = slots.iter().position(|(other, _)| other == name).and_then(|at| slots.remove(at));
        let entry = known.unwrap_or_else(|| (name.clone(), Slot::default()));
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
