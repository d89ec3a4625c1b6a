//! An entry: whose tile it is, where its bytes lie, and what they must be.
//!
//! A head has 64 bytes, little-endian:
//!
//! | at | bytes | what |
//! |---|---|---|
//! | 0 | 16 | the source: a hash of its key and its description |
//! | 16 | 12 | x, y and z of the page |
//! | 28 | 1 | its level |
//! | 29 | 1 | the codec |
//! | 30 | 2 | zero |
//! | 32 | 8 | where the tile's bytes begin in the segment |
//! | 40 | 4 | how many they are |
//! | 44 | 4 | zero |
//! | 48 | 8 | their checksum |
//! | 56 | 8 | the checksum of the 56 bytes before, seeded with the version of this layout |

use vastex_core::PagePos;

use crate::ground::hash::seeded;
use crate::tile::{Codec, MAX_TILE_BYTES};

/// Bytes of a head.
pub(super) const HEAD_BYTES: usize = 64;
/// Heads of another layout are damaged ones.
const VERSION: u64 = 1;
/// Bytes of a head under its checksum.
const CHECKED: usize = 56;

/// A page of a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct EntryKey {
    pub(super) source: u128,
    pub(super) pos: PagePos,
}

/// An entry without its tile's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Head {
    pub(super) key: EntryKey,
    pub(super) codec: Codec,
    /// Where the tile's bytes begin in the segment.
    pub(super) offset: u64,
    /// How many they are, at least 1.
    pub(super) len: u32,
    pub(super) checksum: u64,
}

impl Head {
    /// What the entry takes of the files, in bytes.
    pub(super) fn entry_bytes(&self) -> u64 {
        u64::from(self.len) + HEAD_BYTES as u64
    }

    pub(super) fn encode(&self) -> [u8; HEAD_BYTES] {
        let PagePos { level, x, y, z } = self.key.pos;
        let mut bytes = [0; HEAD_BYTES];
        bytes[..16].copy_from_slice(&self.key.source.to_le_bytes());
        for (field, coord) in bytes[16..28].chunks_exact_mut(4).zip([x, y, z]) {
            field.copy_from_slice(&coord.to_le_bytes());
        }
        (bytes[28], bytes[29]) = (level, self.codec.number());
        bytes[32..40].copy_from_slice(&self.offset.to_le_bytes());
        bytes[40..44].copy_from_slice(&self.len.to_le_bytes());
        bytes[48..56].copy_from_slice(&self.checksum.to_le_bytes());
        let own = seeded(VERSION, &bytes[..CHECKED]);
        bytes[CHECKED..].copy_from_slice(&own.to_le_bytes());
        bytes
    }

    /// Reads a head. `None` unless the bytes are those of a head whose tile lies in a segment of
    /// `segment_len` bytes.
    pub(super) fn decode(bytes: &[u8; HEAD_BYTES], segment_len: u64) -> Option<Head> {
        let (checked, stated) = bytes.split_at(CHECKED);
        if seeded(VERSION, checked).to_le_bytes() != stated {
            return None;
        }
        let u32_at = |at: usize| Some(u32::from_le_bytes(*bytes[at..].first_chunk()?));
        let u64_at = |at: usize| Some(u64::from_le_bytes(*bytes[at..].first_chunk()?));
        let source = u128::from_le_bytes(*bytes.first_chunk()?);
        let pos = PagePos { level: bytes[28], x: u32_at(16)?, y: u32_at(20)?, z: u32_at(24)? };
        let head = Head {
            key: EntryKey { source, pos },
            codec: Codec::from_number(bytes[29]).ok()?,
            offset: u64_at(32)?,
            len: u32_at(40)?,
            checksum: u64_at(48)?,
        };
        let lies_within = head.offset.checked_add(u64::from(head.len)).is_some_and(|end| end <= segment_len);
        let sensible = head.len > 0 && u64::from(head.len) <= MAX_TILE_BYTES;
        (lies_within && sensible).then_some(head)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head() -> Head {
        let key = EntryKey { source: 1 << 100 | 7, pos: PagePos { level: 3, x: 1, y: 1 << 20, z: 9 } };
        Head { key, codec: Codec::Zstd, offset: 1 << 40, len: 900, checksum: u64::MAX - 1 }
    }

    #[test]
    fn a_head_reads_back_and_any_flipped_bit_is_seen() {
        let bytes = head().encode();
        assert_eq!(Head::decode(&bytes, u64::MAX), Some(head()));
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes;
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Head::decode(&flipped, u64::MAX), None, "bit {bit}");
        }
    }

    #[test]
    fn a_head_whose_tile_lies_outside_its_segment_is_refused() {
        assert_eq!(Head::decode(&head().encode(), (1 << 40) + 899), None);
        assert!(Head::decode(&head().encode(), (1 << 40) + 900).is_some());
        let refused = [Head { len: 0, ..head() }, Head { offset: u64::MAX - 3, ..head() }];
        for head in [refused[0], refused[1], Head { len: MAX_TILE_BYTES as u32 + 1, ..head() }] {
            assert_eq!(Head::decode(&head.encode(), u64::MAX), None, "{head:?}");
        }
    }
}
