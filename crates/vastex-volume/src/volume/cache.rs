//! Decoded chunks that were used last, up to a number of bytes.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use rustc_hash::FxHashMap;

use crate::chunks::Chunk;

/// Bytes of decoded chunks that are kept.
const MOST_BYTES: usize = 256 << 20;

/// A level, and the coordinates of a chunk of it.
type Key = (usize, Vec<u64>);

/// Chunks by their place; absent ones are kept, too.
#[derive(Default)]
pub(super) struct ChunkCache {
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    by_key: FxHashMap<Key, (Option<Chunk>, u64)>,
    by_use: BTreeMap<u64, Key>,
    bytes: usize,
    uses: u64,
}

impl ChunkCache {
    /// A chunk that is kept, or that it is known to be absent.
    pub(super) fn find(&self, key: &Key) -> Option<Option<Chunk>> {
        self.with(|kept| {
            kept.uses += 1;
            let now = kept.uses;
            let (chunk, used) = kept.by_key.get_mut(key)?;
            let chunk = chunk.clone();
            let before = std::mem::replace(used, now);
            kept.by_use.remove(&before);
            kept.by_use.insert(now, key.clone());
            Some(chunk)
        })
    }

    pub(super) fn keep(&self, key: Key, chunk: Option<Chunk>) {
        self.with(|kept| {
            let bytes = cost(&chunk);
            if bytes > MOST_BYTES {
                return;
            }
            kept.forget(&key);
            kept.bytes += bytes;
            kept.uses += 1;
            kept.by_use.insert(kept.uses, key.clone());
            kept.by_key.insert(key, (chunk, kept.uses));
            while kept.bytes > MOST_BYTES
                && let Some((_, oldest)) = kept.by_use.pop_first()
            {
                kept.forget(&oldest);
            }
        });
    }

    fn with<T>(&self, work: impl FnOnce(&mut Kept) -> T) -> T {
        work(&mut self.kept.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Kept {
    fn forget(&mut self, key: &Key) {
        if let Some((chunk, used)) = self.by_key.remove(key) {
            self.by_use.remove(&used);
            self.bytes -= cost(&chunk);
        }
    }
}

fn cost(chunk: &Option<Chunk>) -> usize {
    /// What a place takes beside the values.
    const OVERHEAD: usize = 256;
    chunk.as_ref().map_or(0, |chunk| chunk.bytes.len()) + OVERHEAD
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_has_a_bound_and_what_is_used_stays() {
        let cache = ChunkCache::default();
        let chunk = Chunk { bytes: vec![0; 20 << 20].into(), strides: [1, 1].into() };
        for n in 0..30 {
            cache.find(&(0, vec![0]));
            cache.keep((0, vec![n]), Some(chunk.clone()));
            let kept = cache.kept.lock().unwrap();
            assert!(kept.bytes <= MOST_BYTES && kept.by_key.len() == kept.by_use.len());
        }
        assert!(cache.find(&(0, vec![0])).is_some() && cache.find(&(0, vec![5])).is_none());
        assert!(cache.find(&(1, vec![0])).is_none());
        cache.keep((2, vec![]), None);
        assert!(matches!(cache.find(&(2, vec![])), Some(None)));
    }
}
