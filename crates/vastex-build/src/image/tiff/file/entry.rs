//! The entries of a directory, and their values: read from the file when they are asked for, lists by ranges.

use std::collections::BTreeMap;

use super::{TiffFile, damaged};
use crate::image::InputFault;

/// Entries that a directory may have. Sound ones have some dozens.
const MOST_ENTRIES: u64 = 4096;

/// Where the values of a tag lie.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    kind: u16,
    /// Values that there are.
    pub(super) count: u64,
    /// Place of the first in the file.
    at: u64,
}

/// One directory of a file.
#[derive(Clone, Debug)]
pub(crate) struct Directory {
    entries: BTreeMap<u16, Entry>,
    /// Where the next one lies; 0 after the last.
    pub(super) next: u64,
    /// Where it lies, for messages.
    pub(super) place: String,
}

/// Bytes of a value of a kind; `None` for kinds that are not known.
fn value_bytes(kind: u16) -> Option<u64> {
    match kind {
        1 | 2 | 6 | 7 => Some(1),
        3 | 8 => Some(2),
        4 | 9 | 11 | 13 => Some(4),
        5 | 10 | 12 | 16..=18 => Some(8),
        _ => None,
    }
}

impl TiffFile {
    /// The directory at a place of the file.
    pub(super) fn directory(&self, at: u64) -> Result<Directory, InputFault> {
        let place = format!("in the directory at byte {at}");
        let (count_bytes, entry_bytes, word) = if self.is_big { (8, 20, 8) } else { (2, 12, 4) };
        let count = self.whole(&self.bytes(at, count_bytes, &place)?);
        if count > MOST_ENTRIES {
            return Err(damaged(&place, format!("it says that it has {count} entries")));
        }
        let bytes = self.bytes(at + count_bytes, count * entry_bytes + word, &place)?;
        let (list, next) = bytes.split_at((count * entry_bytes) as usize);
        let mut entries = BTreeMap::new();
        let first = at + count_bytes;
        for (number, entry) in (0..).zip(list.chunks_exact(entry_bytes as usize)) {
            let (tag, kind) = (self.whole(&entry[..2]) as u16, self.whole(&entry[2..4]) as u16);
            let value = entry_bytes - word;
            let count = self.whole(&entry[4..value as usize]);
            let Some(bytes) = value_bytes(kind) else { continue };
            let at = match count.checked_mul(bytes) {
                Some(bytes) if bytes <= word => first + number * entry_bytes + value,
                _ => self.whole(&entry[value as usize..]),
            };
            // Of a tag that is there twice the first counts, as for libtiff.
            entries.entry(tag).or_insert(Entry { kind, count, at });
        }
        Ok(Directory { entries, next: self.whole(next), place })
    }

    /// Value number `index` of an entry, a whole number.
    pub(super) fn value(&self, entry: &Entry, index: u64, place: &str) -> Result<u64, InputFault> {
        Ok(self.values(entry, index, 1, place)?[0])
    }

    /// All values of an entry, whole numbers.
    pub(super) fn all_values(&self, entry: &Entry, place: &str) -> Result<Vec<u64>, InputFault> {
        self.values(entry, 0, entry.count, place)
    }

    /// `count` values of an entry from `index` on, whole numbers.
    fn values(&self, entry: &Entry, index: u64, count: u64, place: &str) -> Result<Vec<u64>, InputFault> {
        let bytes = value_bytes(entry.kind).filter(|_| matches!(entry.kind, 1 | 3 | 4 | 7 | 13 | 16 | 18));
        let bytes = bytes.ok_or_else(|| damaged(place, "whole numbers are something else there"))?;
        let (at, list) = self.range(entry, index, count, bytes, place)?;
        Ok(self.bytes(at, list, place)?.chunks_exact(bytes as usize).map(|value| self.whole(value)).collect())
    }

    /// Where some values of an entry begin, and how many bytes they have.
    fn range(
        &self,
        entry: &Entry,
        index: u64,
        count: u64,
        bytes: u64,
        place: &str,
    ) -> Result<(u64, u64), InputFault> {
        let begin = index.checked_mul(bytes).and_then(|begin| entry.at.checked_add(begin));
        let is_there = index.checked_add(count).is_some_and(|end| end <= entry.count);
        match (begin, count.checked_mul(bytes)) {
            (Some(begin), Some(list)) if is_there => Ok((begin, list)),
            _ => Err(damaged(place, "a list is shorter than it should be")),
        }
    }
}

impl Directory {
    /// How many entries it has.
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    pub(super) fn entry(&self, tag: u16) -> Option<&Entry> {
        self.entries.get(&tag)
    }

    /// The whole numbers of a tag, `most` at most; none where there is no such tag.
    pub(super) fn numbers(&self, file: &TiffFile, tag: u16, most: u64) -> Result<Vec<u64>, InputFault> {
        let Some(entry) = self.entry(tag) else { return Ok(Vec::new()) };
        if entry.count > most {
            let why = format!("its tag {tag} has {} values, and {most} at most make sense", entry.count);
            return Err(damaged(&self.place, why));
        }
        file.values(entry, 0, entry.count, &self.place)
    }

    /// The first whole number of a tag.
    pub(super) fn number(&self, file: &TiffFile, tag: u16) -> Result<Option<u64>, InputFault> {
        match self.entry(tag).filter(|entry| entry.count > 0) {
            Some(entry) => file.value(entry, 0, &self.place).map(Some),
            None => Ok(None),
        }
    }

    /// The bytes of a tag as they are stored, the first `most` of them.
    pub(super) fn raw(&self, file: &TiffFile, tag: u16, most: u64) -> Result<Option<Vec<u8>>, InputFault> {
        let Some(entry) = self.entry(tag).filter(|entry| entry.count > 0) else { return Ok(None) };
        let bytes = value_bytes(entry.kind).unwrap_or(1);
        let count = entry.count.min(most / bytes);
        let (at, list) = file.range(entry, 0, count, bytes, &self.place)?;
        file.bytes(at, list, &self.place).map(Some)
    }

    /// A text, up to its first zero; bytes that are no UTF-8 are replaced.
    pub(super) fn text(&self, file: &TiffFile, tag: u16, most: u64) -> Result<Option<String>, InputFault> {
        let bytes = self.raw(file, tag, most)?;
        Ok(bytes.map(|bytes| {
            let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
            String::from_utf8_lossy(&bytes[..end]).into_owned()
        }))
    }

    /// Doubles, the first `most` of them; none where the tag holds something else.
    pub(super) fn doubles(&self, file: &TiffFile, tag: u16, most: u64) -> Result<Vec<f64>, InputFault> {
        const DOUBLE: u16 = 12;
        if self.entry(tag).is_none_or(|entry| entry.kind != DOUBLE) {
            return Ok(Vec::new());
        }
        let bytes = self.raw(file, tag, 8 * most)?.unwrap_or_default();
        Ok(bytes.chunks_exact(8).map(|value| f64::from_bits(file.whole(value))).collect())
    }
}
