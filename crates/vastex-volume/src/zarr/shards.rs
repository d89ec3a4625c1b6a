//! Indices of shards: where the chunks of a shard lie in it, and which are absent.
//!
//! They are kept up to a number of bytes, those used longest ago go first. An index is read without holding
//! the lock, so that threads wait for no other's read; two that want the same one at once read it twice.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use rustc_hash::FxHashMap;

use super::metadata::{INDEX_ENTRY, ShardMeta};
use crate::codecs::without_crc32c;
use crate::fault::{VolumeError, VolumeFault, damaged};
use crate::keys::{KeyStore, Span, shown};

/// Bytes of indices that are kept for an array.
const MOST_KEPT: usize = 16 << 20;
/// Bytes that an index takes beside its entries.
const OVERHEAD: usize = 128;

/// The index of a shard.
pub(super) struct ShardIndex {
    /// Offset and bytes of each chunk in the shard; nothing of absent ones.
    entries: Vec<Option<(u64, u64)>>,
}

impl ShardIndex {
    /// Where a chunk lies in its shard; `None` if it is absent.
    pub(super) fn entry(&self, place: usize) -> Option<(u64, u64)> {
        self.entries.get(place).copied().flatten()
    }

    fn read(stored: &[u8], meta: &ShardMeta) -> Result<ShardIndex, VolumeFault> {
        let bytes = match meta.has_checksum {
            true => without_crc32c(stored).map_err(|why| {
                damaged(format!("the index of the shard is damaged: {why}; copy the file anew"))
            })?,
            false => stored,
        };
        let number = |bytes: &[u8; 8]| match meta.is_big_endian {
            true => u64::from_be_bytes(*bytes),
            false => u64::from_le_bytes(*bytes),
        };
        let numbers: Vec<u64> = bytes.as_chunks::<8>().0.iter().map(number).collect();
        let entry = |pair: &[u64; 2]| (*pair != [u64::MAX; 2]).then_some((pair[0], pair[1]));
        Ok(ShardIndex { entries: numbers.as_chunks::<2>().0.iter().map(entry).collect() })
    }

    fn bytes(&self) -> usize {
        self.entries.len() * size_of::<Option<(u64, u64)>>() + OVERHEAD
    }
}

/// An index, or that there is no such shard.
type Known = Option<Arc<ShardIndex>>;

/// The indices that are kept.
#[derive(Default)]
pub(super) struct ShardIndices {
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    by_key: FxHashMap<String, (Known, u64)>,
    by_use: BTreeMap<u64, String>,
    bytes: usize,
    uses: u64,
}

impl ShardIndices {
    /// The index of the shard under a key, read where it is not kept; `None` if there is no such shard.
    pub(super) async fn get(
        &self,
        keys: &dyn KeyStore,
        key: &str,
        meta: &ShardMeta,
    ) -> Result<Known, VolumeError> {
        if let Some(known) = self.with(|kept| kept.find(key)) {
            return Ok(known);
        }
        let len = meta.index_bytes() as usize;
        let span = match meta.is_index_first {
            true => Span::Range { offset: 0, len },
            false => Span::Last(len),
        };
        let known = match keys.read(key, span).await? {
            None => None,
            Some(stored) => {
                Some(Arc::new(ShardIndex::read(&stored, meta).map_err(|fault| fault.at(shown(keys, key)))?))
            }
        };
        self.with(|kept| kept.keep(key, known.clone()));
        Ok(known)
    }

    fn with<T>(&self, work: impl FnOnce(&mut Kept) -> T) -> T {
        work(&mut self.kept.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Kept {
    fn find(&mut self, key: &str) -> Option<Known> {
        self.uses += 1;
        let (known, used) = self.by_key.get_mut(key)?;
        self.by_use.remove(used);
        *used = self.uses;
        self.by_use.insert(self.uses, key.to_owned());
        Some(known.clone())
    }

    fn keep(&mut self, key: &str, known: Known) {
        self.forget(key);
        self.bytes += cost(&known);
        self.uses += 1;
        self.by_use.insert(self.uses, key.to_owned());
        self.by_key.insert(key.to_owned(), (known, self.uses));
        while self.bytes > MOST_KEPT
            && let Some((_, oldest)) = self.by_use.pop_first()
        {
            self.forget(&oldest);
        }
    }

    fn forget(&mut self, key: &str) {
        if let Some((known, used)) = self.by_key.remove(key) {
            self.by_use.remove(&used);
            self.bytes -= cost(&known);
        }
    }
}

fn cost(known: &Known) -> usize {
    known.as_ref().map_or(OVERHEAD, |index| index.bytes())
}

/// Whether an entry can lie in any file, and how many bytes it has.
pub(super) fn checked(entry: (u64, u64), most: u64) -> Result<(u64, usize), VolumeFault> {
    let (offset, len) = entry;
    if len > most || offset.checked_add(len).is_none() {
        return Err(damaged(format!(
            "the index of the shard claims {len} bytes at {offset} for a chunk of at most {most}; copy the file anew"
        )));
    }
    Ok((offset, len as usize))
}

/// Entries of an index, for counting.
impl ShardIndex {
    /// The places of the chunks that are stored.
    pub(super) fn stored(&self) -> impl Iterator<Item = usize> {
        self.entries.iter().enumerate().filter(|(_, entry)| entry.is_some()).map(|(place, _)| place)
    }
}

const _: () = assert!(INDEX_ENTRY == 16);

#[cfg(test)]
mod tests {
    use super::*;

    fn meta(counts: [u64; 2]) -> ShardMeta {
        ShardMeta {
            counts: counts.to_vec(),
            order: vec![0, 1],
            is_big_endian: false,
            has_checksum: false,
            is_index_first: false,
        }
    }

    #[test]
    fn absent_chunks_are_told_from_stored_ones() {
        let stored: Vec<u8> = [u64::MAX, u64::MAX, 5, 7].iter().flat_map(|n| n.to_le_bytes()).collect();
        let index = ShardIndex::read(&stored, &meta([1, 2])).unwrap();
        assert_eq!([0, 1, 2].map(|place| index.entry(place)), [None, Some((5, 7)), None]);
        assert_eq!(index.stored().collect::<Vec<_>>(), [1]);
    }

    #[test]
    fn what_is_kept_has_a_bound() {
        let mut kept = Kept::default();
        let entries = vec![None; 10_000];
        let one = cost(&Some(Arc::new(ShardIndex { entries: entries.clone() })));
        let fit = MOST_KEPT / one;
        for n in 0..fit + 5 {
            // The first one is used all the time.
            kept.find("0");
            kept.keep(&n.to_string(), Some(Arc::new(ShardIndex { entries: entries.clone() })));
            assert!(kept.bytes <= MOST_KEPT && kept.by_key.len() == kept.by_use.len());
        }
        assert!(kept.find("0").is_some() && kept.find("1").is_none());
        assert_eq!(kept.bytes, kept.by_key.values().map(|(known, _)| cost(known)).sum::<usize>());
    }

    #[test]
    fn entries_that_cannot_be_are_refused() {
        assert_eq!(checked((3, 10), 10), Ok((3, 10)));
        assert!(checked((3, 11), 10).is_err() && checked((u64::MAX - 1, 5), 10).is_err());
    }
}
