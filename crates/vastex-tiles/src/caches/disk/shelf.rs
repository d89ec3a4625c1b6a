//! All segments of a disk cache, oldest first, within one budget: room is made before anything is written.
//!
//! Room is made by the clock algorithm, whose hand is the oldest segment: entries that were read since they
//! were written are copied to the newest segment, up to half of the segment's bytes, and the rest is dropped
//! with it. So at most twice the bytes of new tiles are written.

use std::collections::{BTreeSet, VecDeque};
use std::io;
use std::sync::Mutex;

use rustc_hash::FxHashSet;

use super::entry::{EntryKey, HEAD_BYTES};
use super::index::{Index, Location};
use super::medium::Medium;
use super::segment::{self, Segment};
use crate::ground::sync::lock;
use crate::tile::Tile;

/// Each segment gets this part of the budget, so that dropping one costs little of what is kept.
const SEGMENTS: u64 = 64;
/// The smallest size of a segment in bytes.
const LEAST_SEGMENT: u64 = 64 << 10;
/// The most segments: each keeps a file open.
const MOST_SEGMENTS: usize = 2 * SEGMENTS as usize;
/// The most bytes that are copied when a segment is dropped.
const MOST_COPIED: u64 = 32 << 20;
/// Entries that are looked at under one lock of the index, so that readers get the lock in between.
const KEYS_AT_A_TIME: usize = 256;

/// The segments, within a budget of bytes that their files have together.
pub(super) struct Shelf {
    medium: Box<dyn Medium>,
    segments: VecDeque<Segment>,
    budget: u64,
    next_number: u64,
}

impl Shelf {
    /// Opens the segments that earlier runs left. Reads the heads, 64 bytes a tile; removes empty segments
    /// and what is beyond the budget.
    pub(super) fn open(medium: Box<dyn Medium>, budget: u64, index: &Mutex<Index>) -> io::Result<Shelf> {
        let numbers: BTreeSet<u64> =
            medium.names()?.iter().filter_map(|name| segment::number_of(name)).collect();
        let next_number = numbers.last().map_or(0, |last| last.wrapping_add(1));
        let mut shelf = Shelf { medium, segments: VecDeque::new(), budget, next_number };
        for number in numbers {
            match Segment::open(&*shelf.medium, number) {
                Ok((segment, locations)) if !locations.is_empty() => {
                    locations.into_iter().for_each(|location| lock(index).put(location));
                    shelf.push(segment);
                }
                // One that holds nothing, or half of one.
                Ok(_) => segment::remove(&*shelf.medium, number)?,
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    segment::remove(&*shelf.medium, number)?;
                }
                Err(error) => return Err(error),
            }
        }
        while shelf.bytes() > budget || shelf.segments.len() > MOST_SEGMENTS {
            shelf.give_up_oldest(index)?;
        }
        lock(index).set_bytes(shelf.bytes());
        Ok(shelf)
    }

    /// Adds a newest segment and seals the one before it.
    fn push(&mut self, segment: Segment) {
        if let Some(before) = self.segments.back_mut() {
            before.seal();
        }
        self.segments.push_back(segment);
    }

    /// Bytes of all files.
    pub(super) fn bytes(&self) -> u64 {
        self.segments.iter().map(Segment::bytes).sum()
    }

    /// Stores a tile. A tile larger than the whole budget is not stored.
    pub(super) fn keep(&mut self, index: &Mutex<Index>, key: EntryKey, tile: &Tile) -> io::Result<()> {
        let Some((len, need)) = need(tile).filter(|(_, need)| *need <= self.budget) else { return Ok(()) };
        while self.bytes() + need > self.budget {
            self.make_room(index)?;
        }
        let kept = match self.append(index, key, tile, len) {
            // The file system allows no larger file: another one begins.
            Err(error) if error.kind() == io::ErrorKind::FileTooLarge => {
                self.segments.back_mut().into_iter().for_each(Segment::seal);
                self.append(index, key, tile, len)
            }
            // The disk has less room than the budget: the oldest tiles give way to the newest all the same.
            Err(error) if is_full(&error) && !self.segments.is_empty() => {
                self.give_up_oldest(index)?;
                self.append(index, key, tile, len)
            }
            kept => kept,
        };
        if kept.is_ok() {
            lock(index).count(&key, |stats| stats.bytes_written += u64::from(len));
        }
        kept
    }

    /// Writes an entry for which there is room.
    fn append(&mut self, index: &Mutex<Index>, key: EntryKey, tile: &Tile, len: u32) -> io::Result<()> {
        let target = (self.budget / SEGMENTS).max(LEAST_SEGMENT);
        let need = u64::from(len) + HEAD_BYTES as u64;
        if !self.segments.back().is_some_and(|newest| newest.has_room(need, target)) {
            while self.segments.len() >= MOST_SEGMENTS {
                self.give_up_oldest(index)?;
            }
            let number = self.next_number;
            self.next_number = number.wrapping_add(1);
            self.push(Segment::create(&*self.medium, number)?);
        }
        let Some(newest) = self.segments.back_mut() else { return Ok(()) };
        let written = newest.append(key, tile, len);
        let bytes = self.bytes();
        let mut index = lock(index);
        index.set_bytes(bytes);
        index.put(written?);
        Ok(())
    }

    /// Drops the oldest segment; entries of it that were used are copied.
    fn make_room(&mut self, index: &Mutex<Index>) -> io::Result<()> {
        let Some(oldest) = self.segments.front() else { return Ok(()) };
        let mut left = (oldest.bytes() / 2).min(MOST_COPIED);
        let keys = oldest.keys.chunks(KEYS_AT_A_TIME);
        let used: Vec<Location> = keys.flat_map(|keys| lock(index).used_in(oldest.number, keys)).collect();
        // Read now: the room of the segment is needed for writing them.
        let kept: Vec<(Location, Tile)> = used
            .into_iter()
            .filter_map(|location| {
                let tile = location.read().ok()?;
                left = left.checked_sub(need(&tile)?.1)?;
                Some((location, tile))
            })
            .collect();
        let copied = kept.iter().map(|(location, _)| location.head.key).collect();
        self.remove_oldest(index, &copied)?;
        for (n, (location, tile)) in kept.iter().enumerate() {
            if let Err(error) = self.append(index, location.head.key, tile, location.head.len) {
                let mut index = lock(index);
                kept[n..]
                    .iter()
                    .for_each(|(lost, _)| index.count(&lost.head.key, |stats| stats.evictions += 1));
                return Err(error);
            }
        }
        Ok(())
    }

    /// Drops the oldest segment with all its entries.
    fn give_up_oldest(&mut self, index: &Mutex<Index>) -> io::Result<()> {
        self.remove_oldest(index, &FxHashSet::default())
    }

    /// Removes the oldest segment, of which some entries are about to be copied. A segment whose files cannot
    /// be removed stays.
    fn remove_oldest(&mut self, index: &Mutex<Index>, copied: &FxHashSet<EntryKey>) -> io::Result<()> {
        let Some(oldest) = self.segments.front() else { return Ok(()) };
        segment::remove(&*self.medium, oldest.number)?;
        for keys in oldest.keys.chunks(KEYS_AT_A_TIME) {
            lock(index).remove_segment(oldest.number, keys, copied);
        }
        self.segments.pop_front();
        lock(index).set_bytes(self.bytes());
        Ok(())
    }
}

/// Bytes of a tile and of its entry, or `None` if no entry can hold the tile.
fn need(tile: &Tile) -> Option<(u32, u64)> {
    let len = u32::try_from(tile.bytes.len()).ok().filter(|len| *len > 0)?;
    Some((len, u64::from(len) + HEAD_BYTES as u64))
}

/// Returns true if the disk is full.
fn is_full(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::QuotaExceeded | io::ErrorKind::StorageFull)
}
