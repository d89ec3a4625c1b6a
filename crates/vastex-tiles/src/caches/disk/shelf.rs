//! All segments of a disk cache, oldest first: room is made before anything is written, and never more taken than there is.
//!
//! Room is made by a clock whose hand is the oldest segment: what was read since it was written there goes to the newest
//! one, up to a half of the segment; the rest goes with the segment. So the bytes written are at most twice those of new
//! tiles.

use std::collections::{BTreeSet, VecDeque};
use std::io;
use std::sync::Mutex;

use rustc_hash::FxHashSet;

use super::entry::{EntryKey, HEAD_BYTES};
use super::index::{Index, Place};
use super::medium::Medium;
use super::segment::{self, Segment};
use crate::ground::sync::lock;
use crate::tile::Tile;

/// A segment has this part of the budget, so that giving one up costs little of what is kept.
const SEGMENTS: u64 = 64;
/// The least that a segment is made for, in bytes.
const LEAST_SEGMENT: u64 = 64 << 10;
/// Segments that there may be: each is an open file.
const MOST_SEGMENTS: usize = 2 * SEGMENTS as usize;
/// Bytes that a second chance is given to at a time: one thread copies them.
const MOST_COPIED: u64 = 32 << 20;
/// Entries that are looked at behind the index's lock at a time, so that readers get it in between.
const KEYS_AT_A_TIME: usize = 256;

/// The segments, within a budget of bytes that their files have together.
pub(super) struct Shelf {
    medium: Box<dyn Medium>,
    segments: VecDeque<Segment>,
    budget: u64,
    next_number: u64,
}

impl Shelf {
    /// Takes up what earlier runs left. Reads the heads, 64 bytes a tile; removes what holds nothing and what is beyond the
    /// budget.
    pub(super) fn open(medium: Box<dyn Medium>, budget: u64, index: &Mutex<Index>) -> io::Result<Shelf> {
        let numbers: BTreeSet<u64> =
            medium.names()?.iter().filter_map(|name| segment::number_of(name)).collect();
        let next_number = numbers.last().map_or(0, |last| last.wrapping_add(1));
        let mut shelf = Shelf { medium, segments: VecDeque::new(), budget, next_number };
        for number in numbers {
            match Segment::open(&*shelf.medium, number) {
                Ok((segment, places)) if !places.is_empty() => {
                    places.into_iter().for_each(|place| lock(index).put(place));
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

    /// A newest segment: the one before it has had its last entry.
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

    /// Puts a tile in. Nothing happens where it is larger than the whole budget.
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

    /// Gives up the oldest segment but for what of it was used.
    fn make_room(&mut self, index: &Mutex<Index>) -> io::Result<()> {
        let Some(oldest) = self.segments.front() else { return Ok(()) };
        let mut left = (oldest.bytes() / 2).min(MOST_COPIED);
        let keys = oldest.keys.chunks(KEYS_AT_A_TIME);
        let used: Vec<Place> = keys.flat_map(|keys| lock(index).used_in(oldest.number, keys)).collect();
        // Read now: the room of the segment is needed for writing them.
        let kept: Vec<(Place, Tile)> = used
            .into_iter()
            .filter_map(|place| {
                let tile = place.read().ok()?;
                left = left.checked_sub(need(&tile)?.1)?;
                Some((place, tile))
            })
            .collect();
        let copied = kept.iter().map(|(place, _)| place.head.key).collect();
        self.remove_oldest(index, &copied)?;
        for (n, (place, tile)) in kept.iter().enumerate() {
            if let Err(error) = self.append(index, place.head.key, tile, place.head.len) {
                let mut index = lock(index);
                kept[n..]
                    .iter()
                    .for_each(|(lost, _)| index.count(&lost.head.key, |stats| stats.evictions += 1));
                return Err(error);
            }
        }
        Ok(())
    }

    /// Gives up the oldest segment.
    fn give_up_oldest(&mut self, index: &Mutex<Index>) -> io::Result<()> {
        self.remove_oldest(index, &FxHashSet::default())
    }

    /// Removes the oldest segment, of which some entries are about to be copied. Where its files cannot be removed, it stays.
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

/// Bytes of a tile, and those of its entry; nothing where it is none that can be kept.
fn need(tile: &Tile) -> Option<(u32, u64)> {
    let len = u32::try_from(tile.bytes.len()).ok().filter(|len| *len > 0)?;
    Some((len, u64::from(len) + HEAD_BYTES as u64))
}

/// Whether room on the disk is what is missing.
fn is_full(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::QuotaExceeded | io::ErrorKind::StorageFull)
}
