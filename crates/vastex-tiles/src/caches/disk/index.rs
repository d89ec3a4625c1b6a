//! What a disk cache knows of its entries: which there are, where they lie, which were used. In memory, and
//! never locked while a file is read or written.

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
pub(super) struct Location {
    /// The number of its segment.
    pub(super) segment: u64,
    pub(super) file: Arc<dyn MediumFile>,
    pub(super) head: Head,
    /// True if the entry was read since it was written to this segment.
    used: bool,
}

impl Location {
    pub(super) fn new(segment: u64, file: Arc<dyn MediumFile>, head: Head) -> Location {
        Location { segment, file, head, used: false }
    }

    /// Reads the tile. Fails if its bytes are not what they must be.
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
    locations: FxHashMap<EntryKey, Location>,
    total: TierStats,
    by_source: FxHashMap<u128, TierStats>,
}

impl Index {
    /// The figures of all sources together. The bytes are the lengths of the files.
    pub(super) fn total(&self) -> TierStats {
        self.total
    }

    /// The figures of one source. The bytes are those of its entries.
    pub(super) fn of_source(&self, source: u128) -> TierStats {
        self.by_source.get(&source).copied().unwrap_or_default()
    }

    /// Sets the length of all files together.
    pub(super) fn set_bytes(&mut self, bytes: u64) {
        self.total.bytes = bytes;
    }

    /// Adds to the figures of an entry's source, and to the total.
    pub(super) fn count(&mut self, key: &EntryKey, add: impl Fn(&mut TierStats)) {
        add(&mut self.total);
        add(self.by_source.entry(key.source).or_default());
    }

    /// Where an entry lies; from now on the entry counts as used.
    pub(super) fn find(&mut self, key: &EntryKey) -> Option<Location> {
        let location = self.locations.get_mut(key)?;
        location.used = true;
        Some(location.clone())
    }

    pub(super) fn contains(&self, key: &EntryKey) -> bool {
        self.locations.contains_key(key)
    }

    /// Adds an entry, replacing any entry of the same key.
    pub(super) fn put(&mut self, location: Location) {
        let head = location.head;
        self.remove(&head.key);
        self.locations.insert(head.key, location);
        self.total.tiles += 1;
        let of_source = self.by_source.entry(head.key.source).or_default();
        of_source.tiles += 1;
        of_source.bytes += head.entry_bytes();
    }

    fn remove(&mut self, key: &EntryKey) {
        if let Some(location) = self.locations.remove(key) {
            self.total.tiles -= 1;
            let of_source = self.by_source.entry(key.source).or_default();
            of_source.tiles -= 1;
            of_source.bytes -= location.head.entry_bytes();
        }
    }

    /// Removes a damaged entry, unless it lies elsewhere by now.
    pub(super) fn drop_damaged(&mut self, damaged: &Location) {
        let is_there =
            |location: &Location| (location.segment, location.head) == (damaged.segment, damaged.head);
        if self.locations.get(&damaged.head.key).is_some_and(is_there) {
            self.remove(&damaged.head.key);
        }
    }

    /// The entries of a segment that were used, in the order of `keys`.
    pub(super) fn used_in(&self, segment: u64, keys: &[EntryKey]) -> Vec<Location> {
        let locations = keys.iter().filter_map(|key| self.locations.get(key));
        locations.filter(|location| location.segment == segment && location.used).cloned().collect()
    }

    /// Removes the entries of a segment. All count as evicted, except those that are being `copied` to
    /// another segment.
    pub(super) fn remove_segment(&mut self, segment: u64, keys: &[EntryKey], copied: &FxHashSet<EntryKey>) {
        for key in keys {
            if self.locations.get(key).is_some_and(|location| location.segment == segment) {
                self.remove(key);
                if !copied.contains(key) {
                    self.count(key, |stats| stats.evictions += 1);
                }
            }
        }
    }
}
