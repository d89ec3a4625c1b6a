//! What a disk cache knows of its entries: which there are, where they lie, which were used. In memory, never waited for.

use std::sync::Arc;

use bytes::Bytes;
use rustc_hash::FxHashMap;

use super::entry::{EntryKey, Head};
use super::medium::MediumFile;
use crate::hash::checksum;
use crate::tier::TierStats;
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
    pub(super) stats: TierStats,
}

impl Index {
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
        self.places.insert(place.head.key, place);
        self.stats.tiles = self.places.len() as u64;
    }

    /// Takes an entry out, unless it lies elsewhere by now.
    pub(super) fn drop_damaged(&mut self, damaged: &Place) {
        let key = &damaged.head.key;
        let is_there = |place: &Place| (place.segment, place.head) == (damaged.segment, damaged.head);
        if self.places.get(key).is_some_and(is_there) {
            self.places.remove(key);
            self.stats.tiles = self.places.len() as u64;
        }
    }

    /// Those of the entries that lie in a segment and were used, in the order of `keys`.
    pub(super) fn used_in(&self, segment: u64, keys: &[EntryKey]) -> Vec<Place> {
        let places = keys.iter().filter_map(|key| self.places.get(key));
        places.filter(|place| place.segment == segment && place.used).cloned().collect()
    }

    /// Takes out the entries that lie in a segment; says how many they were.
    pub(super) fn remove_segment(&mut self, segment: u64, keys: &[EntryKey]) -> u64 {
        let before = self.places.len();
        for key in keys {
            if self.places.get(key).is_some_and(|place| place.segment == segment) {
                self.places.remove(key);
            }
        }
        self.stats.tiles = self.places.len() as u64;
        (before - self.places.len()) as u64
    }
}
