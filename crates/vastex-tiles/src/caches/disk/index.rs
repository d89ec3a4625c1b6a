//! What a disk cache knows of its entries: which there are, where they lie, which were used. In memory, never waited for.

use std::sync::Arc;

use bytes::Bytes;
use rustc_hash::{FxHashMap, FxHashSet};

use super::entry::{EntryKey, Head};
use super::medium::MediumFile;
use crate::ground::hash::checksum;
use crate::sources::TierStats;
use crate::tile::Tile;

/// Where an entry lies.
#[derive(Clone)]
pub(super) struct Place {
    /// The number of its segment.
    pub(super) segment: u64,
    pub(super) file: Arc<dyn MediumFile>,
    pub(super) head: Head,
    /// Whether it was read since it was written there.
    used: bool,
}

impl Place {
    pub(super) fn new(segment: u64, file: Arc<dyn MediumFile>, head: Head) -> Place {
        Place { segment, file, head, used: false }
    }

    /// The tile, if its bytes are still what they must be.
    pub(super) fn read(&self) -> Result<Tile, String> {
        let mut bytes = Vec::new();
        let len = self.head.len as usize;
        bytes.try_reserve_exact(len).map_err(|error| error.to_string())?;
        bytes.resize(len, 0);
        let count = self.file.read_at(&mut bytes, self.head.offset).map_err(|error| error.to_string())?;
        if count < len || checksum(&bytes) != self.head.checksum {
            return Err("its bytes have changed".into());
        }
        Ok(Tile { codec: self.head.codec, bytes: Bytes::from(bytes) })
    }
}

/// All entries, and what was counted.
#[derive(Default)]
pub(super) struct Index {
    places: FxHashMap<EntryKey, Place>,
    total: TierStats,
    by_source: FxHashMap<u128, TierStats>,
}

impl Index {
    /// Of all sources. The bytes are those of the files.
    pub(super) fn total(&self) -> TierStats {
        self.total
    }

    /// Of one source. The bytes are those of its entries.
    pub(super) fn of_source(&self, source: u128) -> TierStats {
        self.by_source.get(&source).copied().unwrap_or_default()
    }

    /// Says how many bytes all files have.
    pub(super) fn set_bytes(&mut self, bytes: u64) {
        self.total.bytes = bytes;
    }

    /// Counts something of an entry, for its source and in total.
    pub(super) fn count(&mut self, key: &EntryKey, add: impl Fn(&mut TierStats)) {
        add(&mut self.total);
        add(self.by_source.entry(key.source).or_default());
    }

    /// Where an entry lies, which from now on counts as used.
    pub(super) fn find(&mut self, key: &EntryKey) -> Option<Place> {
        let place = self.places.get_mut(key)?;
        place.used = true;
        Some(place.clone())
    }

    pub(super) fn contains(&self, key: &EntryKey) -> bool {
        self.places.contains_key(key)
    }

    /// Puts an entry in, in place of the one that there was.
    pub(super) fn put(&mut self, place: Place) {
        let head = place.head;
        self.remove(&head.key);
        self.places.insert(head.key, place);
        self.total.tiles += 1;
        let of_source = self.by_source.entry(head.key.source).or_default();
        of_source.tiles += 1;
        of_source.bytes += head.entry_bytes();
    }

    fn remove(&mut self, key: &EntryKey) {
        if let Some(place) = self.places.remove(key) {
            self.total.tiles -= 1;
            let of_source = self.by_source.entry(key.source).or_default();
            of_source.tiles -= 1;
            of_source.bytes -= place.head.entry_bytes();
        }
    }

    /// Takes an entry out, unless it lies elsewhere by now.
    pub(super) fn drop_damaged(&mut self, damaged: &Place) {
        let is_there = |place: &Place| (place.segment, place.head) == (damaged.segment, damaged.head);
        if self.places.get(&damaged.head.key).is_some_and(is_there) {
            self.remove(&damaged.head.key);
        }
    }

    /// Those of the entries that lie in a segment and were used, in the order of `keys`.
    pub(super) fn used_in(&self, segment: u64, keys: &[EntryKey]) -> Vec<Place> {
        let places = keys.iter().filter_map(|key| self.places.get(key));
        places.filter(|place| place.segment == segment && place.used).cloned().collect()
    }

    /// Takes out the entries that lie in a segment; all but those that are `copied` elsewhere count as evicted.
    pub(super) fn remove_segment(&mut self, segment: u64, keys: &[EntryKey], copied: &FxHashSet<EntryKey>) {
        for key in keys {
            if self.places.get(key).is_some_and(|place| place.segment == segment) {
                self.remove(key);
                if !copied.contains(key) {
                    self.count(key, |stats| stats.evictions += 1);
                }
            }
        }
    }
}
