//! Numbers and small helpers of the container format; `docs/format.md` says the same for other readers.
//!
//! Everything is little-endian. What the numbers are arranged into stands in `header`, `description` and
//! `index`.

use crate::ground::hash::checksum;

/// The first bytes of every header copy. The high bit and the line ends show a transfer that took the file
/// for text.
pub(crate) const MAGIC: [u8; 8] = *b"\x89VTX\r\n\x1a\n";
/// The first bytes of a part of a container.
pub(crate) const PART_MAGIC: [u8; 8] = *b"\x89VTXPART";
/// The version written and read here.
pub(crate) const VERSION: u32 = 1;
/// Bytes of one header copy: a disk sector, so that a torn write harms one copy only.
pub(crate) const HEADER_COPY_BYTES: u64 = 512;
/// Bytes before the description: both header copies.
pub(crate) const HEADER_BYTES: u64 = 2 * HEADER_COPY_BYTES;
/// Bytes of the first read: the header and nearly every description.
pub(crate) const OPENING_BYTES: u64 = 16 << 10;
/// Bytes that a description may have.
pub(crate) const MAX_DESCRIPTION_BYTES: u64 = 1 << 20;
/// Coarse tiles kept in memory by a reader, in bytes at most; a larger block is read tile by tile.
pub(crate) const MAX_COARSE_BYTES: u64 = 16 << 20;
/// Pages that a container may have. The limit is that of the page list's memory, 4 bytes each.
pub(crate) const MAX_PAGES: u64 = 1 << 31;
/// The record number of a page without a tile.
pub(crate) const NO_RECORD: u32 = u32::MAX;

/// A range of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Extent {
    pub(crate) offset: u64,
    pub(crate) len: u64,
}

impl Extent {
    /// One past the last byte, or `None` if that is beyond 2^64.
    pub(crate) fn end(self) -> Option<u64> {
        self.offset.checked_add(self.len)
    }

    /// Returns true if the range lies in `range` of the file.
    pub(crate) fn lies_within(self, range: std::ops::Range<u64>) -> bool {
        self.offset >= range.start && self.end().is_some_and(|end| end <= range.end)
    }
}

impl std::fmt::Display for Extent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "bytes {} to {}", self.offset, self.offset.saturating_add(self.len))
    }
}

/// A range of the file and the checksum of its bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Section {
    pub(crate) extent: Extent,
    pub(crate) checksum: u64,
}

impl Section {
    /// The section that `bytes` make at `offset`.
    pub(crate) fn of(offset: u64, bytes: &[u8]) -> Section {
        Section { extent: Extent { offset, len: bytes.len() as u64 }, checksum: checksum(bytes) }
    }

    /// Fails where the bytes are not those that were written.
    pub(crate) fn check(&self, bytes: &[u8]) -> Result<(), String> {
        if checksum(bytes) == self.checksum { Ok(()) } else { Err("the checksum does not match".into()) }
    }
}

/// Reads numbers one after the other from bytes that may end anywhere.
pub(crate) struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Fields<'a> {
        Fields { rest: bytes }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    pub(crate) fn bytes(&mut self, len: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.rest.split_at_checked(len).ok_or("it ends too early")?;
        self.rest = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (taken, rest) = self.rest.split_first_chunk::<N>().ok_or("it ends too early")?;
        self.rest = rest;
        Ok(*taken)
    }

    pub(crate) fn u8(&mut self) -> Result<u8, String> {
        self.array::<1>().map(|[byte]| byte)
    }

    pub(crate) fn u32(&mut self) -> Result<u32, String> {
        self.array().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> Result<u64, String> {
        self.array().map(u64::from_le_bytes)
    }

    pub(crate) fn section(&mut self) -> Result<Section, String> {
        Ok(Section { extent: Extent { offset: self.u64()?, len: self.u64()? }, checksum: self.u64()? })
    }
}
