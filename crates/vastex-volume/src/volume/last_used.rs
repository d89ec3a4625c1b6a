//! Decoded chunks that are kept: the last used ones up to a number of bytes; and beside these, of chunks
//! that have more bytes by themselves, a few of the last used ones, so that who takes a chunk part by part
//! does not have it decoded for each.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use crate::chunks::Chunk;

/// A level, and the coordinates of a chunk of it, along up to 8 axes.
pub(crate) type Key = (usize, Vec<u64>);
/// Coordinates of up to 8 axes, as they lie in a table: who looks for 27 chunks, as a brick does, else goes
/// to 27 more places of memory that are in no cache.
type Place = [u64; 8];

fn place(coords: &[u64]) -> Place {
    let mut place = [0; 8];
    place.iter_mut().zip(coords).for_each(|(place, at)| *place = *at);
    place
}

/// How many times the bytes that are kept of other chunks those may have together that have more by
/// themselves.
const LARGE_SHARE: usize = 4;

/// Chunks by their places; `None` of those that are known to be absent.
#[derive(Default)]
pub(super) struct LastUsed {
    /// Those that fit into the bytes that are kept.
    small: Shelf,
    /// Those that do not.
    large: Shelf,
}

/// Chunks in the order of their use.
#[derive(Default)]
struct Shelf {
    /// By level and coordinates.
    by_key: FxHashMap<usize, FxHashMap<Place, Entry>>,
    /// By the use under which each is filed here; it may have been used since.
    by_use: BTreeMap<u64, Key>,
    bytes: usize,
    uses: u64,
}

/// A chunk that is kept.
pub(super) struct Entry {
    chunk: Option<Chunk>,
    /// The number of its last use, or of one not long before it, and of the one under which it is filed.
    used: u64,
    filed: u64,
}

impl LastUsed {
    pub(super) fn find(&mut self, level: usize, coords: &[u64]) -> Option<Option<Chunk>> {
        self.small.find(level, coords).or_else(|| self.large.find(level, coords))
    }

    /// Bytes of all that are kept.
    pub(super) fn bytes(&self) -> usize {
        self.small.bytes + self.large.bytes
    }

    /// Keeps a chunk; what makes room for it is handed back. Of up to `most_bytes` as one of the last used
    /// that have these together. One that has more: with others like it up to four times as many, and the
    /// last one whatever it has; none where nothing is to be kept.
    #[must_use]
    pub(super) fn keep(&mut self, key: &Key, chunk: Option<Chunk>, most_bytes: usize) -> Vec<Entry> {
        let mut gone: Vec<Entry> =
            [self.small.forget(key), self.large.forget(key)].into_iter().flatten().collect();
        match cost(&chunk) <= most_bytes {
            true => self.small.put(key, chunk),
            false if most_bytes > 0 => self.large.put(key, chunk),
            false => return gone,
        }
        gone.extend(self.make_room(most_bytes));
        gone
    }

    /// Hands out what was used longest ago, until no more is kept than may be.
    #[must_use]
    pub(super) fn make_room(&mut self, most_bytes: usize) -> Vec<Entry> {
        let mut gone = self.small.make_room(most_bytes, 0);
        gone.extend(self.large.make_room(most_bytes.saturating_mul(LARGE_SHARE), most_bytes.min(1)));
        gone
    }
}

impl Shelf {
    fn find(&mut self, level: usize, coords: &[u64]) -> Option<Option<Chunk>> {
        let entry = self.by_key.get_mut(&level)?.get_mut(&place(coords))?;
        self.uses += 1;
        // Not each time: what nobody writes to stays in the caches of all who look.
        if self.uses - entry.used > self.by_use.len() as u64 / 8 {
            entry.used = self.uses;
        }
        Some(entry.chunk.clone())
    }

    fn put(&mut self, key: &Key, chunk: Option<Chunk>) {
        self.bytes += cost(&chunk);
        self.uses += 1;
        let now = self.uses;
        self.by_use.insert(now, key.clone());
        let entry = Entry { chunk, used: now, filed: now };
        self.by_key.entry(key.0).or_default().insert(place(&key.1), entry);
    }

    /// Hands out what was used longest ago, until no more than so many bytes are kept, or `least` chunks.
    fn make_room(&mut self, most_bytes: usize, least: usize) -> Vec<Entry> {
        let mut gone = Vec::new();
        while self.bytes > most_bytes
            && self.by_use.len() > least
            && let Some((filed, oldest)) = self.by_use.pop_first()
        {
            let entry =
                self.by_key.get_mut(&oldest.0).and_then(|of_level| of_level.get_mut(&place(&oldest.1)));
            match entry {
                // It was used since it was filed.
                Some(entry) if entry.used > filed => {
                    entry.filed = entry.used;
                    self.by_use.insert(entry.used, oldest);
                }
                _ => gone.extend(self.forget(&oldest)),
            }
        }
        gone
    }

    fn forget(&mut self, key: &Key) -> Option<Entry> {
        let entry = self.by_key.get_mut(&key.0).and_then(|of_level| of_level.remove(&place(&key.1)))?;
        self.by_use.remove(&entry.filed);
        self.bytes -= cost(&entry.chunk);
        Some(entry)
    }
}

fn cost(chunk: &Option<Chunk>) -> usize {
    /// What a place takes beside the values.
    const OVERHEAD: usize = 256;
    chunk.as_ref().map_or(0, Chunk::cost) + OVERHEAD
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST: usize = 256 << 20;

    fn keep(kept: &mut LastUsed, n: u64, bytes: usize) {
        let chunk = Chunk::new(vec![0; bytes], [1, 1], 3);
        drop(kept.keep(&(0, vec![n]), Some(chunk), MOST));
    }

    /// Which of those chunks are kept.
    fn held(kept: &mut LastUsed, of: impl Iterator<Item = u64>) -> Vec<u64> {
        of.filter(|n| kept.find(0, &[*n]).is_some()).collect()
    }

    #[test]
    fn what_is_kept_has_a_bound_and_what_is_used_stays() {
        let mut kept = LastUsed::default();
        for n in 0..30 {
            kept.find(0, &[0]);
            keep(&mut kept, n, 20 << 20);
            let held: usize = kept.small.by_key.values().map(FxHashMap::len).sum();
            assert!(kept.bytes() <= MOST && held == kept.small.by_use.len());
        }
        assert_eq!(held(&mut kept, [0, 5, 29].into_iter()), [0, 29]);
        assert!(kept.large.by_use.is_empty());
    }

    /// Memory of zeros takes none until somebody writes to it.
    #[test]
    fn chunks_beyond_the_bound_are_kept_beside_it_and_have_one_of_their_own() {
        let mut kept = LastUsed::default();
        keep(&mut kept, 100, 200 << 20);
        for n in 0..5 {
            kept.find(0, &[0]);
            keep(&mut kept, n, 300 << 20);
            assert!(kept.large.bytes <= 4 * MOST);
        }
        assert_eq!(held(&mut kept, 0..5), [0, 3, 4], "the last used ones");
        assert_eq!(held(&mut kept, [100].into_iter()), [100], "others are not driven out by them");
        // The last one is kept whatever it has, and nothing else like it.
        keep(&mut kept, 7, 5 * MOST);
        assert_eq!(held(&mut kept, 0..8), [7]);
        keep(&mut kept, 101, 1 << 20);
        assert_eq!(held(&mut kept, [7, 100, 101].into_iter()), [7, 100, 101]);
        drop(kept.make_room(1 << 20));
        assert_eq!(held(&mut kept, [7, 100, 101].into_iter()), [7]);
        drop(kept.make_room(0));
        assert!(held(&mut kept, [7, 100, 101].into_iter()).is_empty() && kept.bytes() == 0);
    }
}
