//! The central directory of a zip archive, with the extensions for large ones: what lies in it, and where.

use std::collections::BTreeMap;

use crate::fault::{VolumeFault, damaged, unsupported};

/// Bytes of the record at the end, without its comment.
pub(super) const END_BYTES: usize = 22;
/// Bytes that the comment behind it can have.
pub(super) const MOST_COMMENT: usize = u16::MAX as usize;
/// Bytes of the record that leads to the one of a large archive, which lies right before the other.
pub(super) const LOCATOR_BYTES: usize = 20;
/// Bytes of the record of a large archive that are read.
pub(super) const LARGE_END_BYTES: usize = 56;
/// Bytes that stand before an entry's name and its data.
pub(super) const LOCAL_BYTES: usize = 30;

const END: u32 = 0x0605_4b50;
const LOCATOR: u32 = 0x0706_4b50;
const LARGE_END: u32 = 0x0606_4b50;
const ENTRY: u32 = 0x0201_4b50;
const LOCAL: u32 = 0x0403_4b50;
const ENTRY_BYTES: usize = 46;
/// The extra field with sizes and places that do not fit into 32 bits.
const LARGE_EXTRA: u16 = 1;

/// How an entry is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    Stored,
    Deflated,
}

/// An entry of an archive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    /// How it is compressed; else the number of a method that is not read.
    pub(super) method: Result<Method, u16>,
    pub(super) is_encrypted: bool,
    pub(super) packed: u64,
    pub(super) size: u64,
    /// Where its local header begins.
    pub(super) header: u64,
}

/// Where the central directory lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) offset: u64,
    pub(super) bytes: u64,
    pub(super) entries: u64,
}

pub(super) fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(at..)?.first_chunk().copied()?))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..)?.first_chunk().copied()?))
}

fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(bytes.get(at..)?.first_chunk().copied()?))
}

/// Returns true if an archive begins so.
pub(super) fn begins(start: &[u8]) -> bool {
    matches!(u32_at(start, 0), Some(LOCAL | END))
}

/// Where the record at the end begins in the last bytes of an archive.
pub(super) fn find_end(tail: &[u8]) -> Option<usize> {
    let last = tail.len().checked_sub(END_BYTES)?;
    (0..=last).rev().find(|at| {
        u32_at(tail, *at) == Some(END)
            && u16_at(tail, at + 20)
                .is_some_and(|comment| at + END_BYTES + usize::from(comment) <= tail.len())
    })
}

/// What the record at the end says, and whether that is all: a number that is as large as can be may stand
/// for one in the record of a large archive, or for itself.
pub(super) fn read_end(end: &[u8]) -> Option<(Place, bool)> {
    let (entries, bytes, offset) = (u16_at(end, 10)?, u32_at(end, 12)?, u32_at(end, 16)?);
    let is_whole = entries != u16::MAX && bytes != u32::MAX && offset != u32::MAX;
    Some((Place { offset: offset.into(), bytes: bytes.into(), entries: entries.into() }, is_whole))
}

/// Where the record of a large archive lies.
pub(super) fn read_locator(locator: &[u8]) -> Option<u64> {
    (u32_at(locator, 0)? == LOCATOR).then(|| u64_at(locator, 8))?
}

/// What the record of a large archive says.
pub(super) fn read_large_end(record: &[u8]) -> Option<Place> {
    if u32_at(record, 0)? != LARGE_END {
        return None;
    }
    Some(Place { entries: u64_at(record, 32)?, bytes: u64_at(record, 40)?, offset: u64_at(record, 48)? })
}

/// Where an entry's data begin, behind its local header.
pub(super) fn data_offset(header: u64, local: &[u8]) -> Option<u64> {
    if u32_at(local, 0)? != LOCAL {
        return None;
    }
    let behind = LOCAL_BYTES as u64 + u64::from(u16_at(local, 26)?) + u64::from(u16_at(local, 28)?);
    header.checked_add(behind)
}

/// The entries of a central directory by their names; directories among them are left out.
pub(super) fn read_entries(bytes: &[u8], count: u64) -> Result<BTreeMap<String, Entry>, VolumeFault> {
    let wrong = |n: u64| {
        damaged(format!("entry {n} of its central directory is cut off or no entry; copy the archive anew"))
    };
    let mut entries = BTreeMap::new();
    let mut at = 0;
    for n in 0..count {
        let (name, entry, next) = read_entry(bytes, at).ok_or_else(|| wrong(n))?;
        at = next;
        if !name.ends_with('/') {
            entries.insert(name, entry);
        }
    }
    Ok(entries)
}

fn read_entry(bytes: &[u8], at: usize) -> Option<(String, Entry, usize)> {
    if u32_at(bytes, at)? != ENTRY {
        return None;
    }
    let name_bytes = usize::from(u16_at(bytes, at + 28)?);
    let extra_bytes = usize::from(u16_at(bytes, at + 30)?);
    let comment_bytes = usize::from(u16_at(bytes, at + 32)?);
    let name = bytes.get(at + ENTRY_BYTES..at + ENTRY_BYTES + name_bytes)?;
    let extra_at = at + ENTRY_BYTES + name_bytes;
    let extra = bytes.get(extra_at..extra_at + extra_bytes)?;
    let mut sizes =
        [u32_at(bytes, at + 24)?, u32_at(bytes, at + 20)?, u32_at(bytes, at + 42)?].map(u64::from);
    let mut large = large_numbers(extra).into_iter();
    for size in &mut sizes {
        if *size == u64::from(u32::MAX) {
            *size = large.next()?;
        }
    }
    let [size, packed, header] = sizes;
    let method = match u16_at(bytes, at + 10)? {
        0 => Ok(Method::Stored),
        8 => Ok(Method::Deflated),
        other => Err(other),
    };
    let is_encrypted = u16_at(bytes, at + 8)? & 1 == 1;
    let name = String::from_utf8_lossy(name).into_owned();
    let next = extra_at + extra_bytes + comment_bytes;
    Some((name, Entry { method, is_encrypted, packed, size, header }, next))
}

/// The numbers of the extra field for large archives.
fn large_numbers(mut extra: &[u8]) -> Vec<u64> {
    while let (Some(id), Some(len)) = (u16_at(extra, 0), u16_at(extra, 2)) {
        let Some(field) = extra.get(4..4 + usize::from(len)) else { break };
        if id == LARGE_EXTRA {
            return (0..field.len() / 8).filter_map(|n| u64_at(field, 8 * n)).collect();
        }
        extra = &extra[4 + usize::from(len)..];
    }
    Vec::new()
}

/// Refuses an entry whose bytes cannot be had.
pub(super) fn check(entry: &Entry, most_deflated: u64) -> Result<Method, VolumeFault> {
    if entry.is_encrypted {
        return Err(unsupported("is encrypted in the archive; unpack it with its password"));
    }
    match entry.method {
        Ok(Method::Stored) if entry.packed != entry.size => {
            Err(damaged("is stored in the archive as it is, yet with two sizes; copy the archive anew"))
        }
        Ok(Method::Deflated) if entry.size > most_deflated => Err(VolumeFault::TooLarge(format!(
            "has {} bytes and is deflated in the archive, so that no part of it can be read alone; at most {most_deflated} are \
             read so. Unpack the archive, or write it without compression (`zip -0`)",
            entry.size
        ))),
        Ok(Method::Deflated) if entry.packed > 2 * most_deflated => {
            Err(damaged("takes more bytes in the archive than deflating makes of it; copy the archive anew"))
        }
        Ok(method) => Ok(method),
        Err(method) => Err(unsupported(format!(
            "is compressed in the archive by method {method}; write the archive without compression (`zip -0`)"
        ))),
    }
}
