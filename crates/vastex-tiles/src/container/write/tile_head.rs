//! What stands before each tile in a part and in a journal: enough to append the tile without decoding it.

use std::io::{self, Read};

use bytes::Bytes;

use crate::container::format::layout::Fields;
use crate::ground::hash::checksum;
use crate::tile::{Codec, EncodedTile, Tile};

/// A tile without its bytes, or the note that a page has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TileHead {
    /// The number of its page in the index's order.
    pub(super) page: u64,
    /// The hash by which identical tiles are found.
    pub(super) hash: u128,
    /// The checksum of the encoded bytes.
    pub(super) checksum: u64,
    /// The number of encoded bytes; 0 if the page has no tile.
    pub(super) len: u64,
    pub(super) codec: Codec,
}

impl TileHead {
    /// Bytes of a head.
    pub(super) const BYTES: usize = 56;

    pub(super) fn of(page: u64, tile: &EncodedTile) -> TileHead {
        let Tile { codec, bytes } = tile.tile();
        TileHead {
            page,
            hash: tile.content(),
            checksum: tile.checksum(),
            len: bytes.len() as u64,
            codec: *codec,
        }
    }

    /// The head that notes that a page has no tile.
    pub(super) fn absent(page: u64) -> TileHead {
        TileHead { page, hash: 0, checksum: checksum(&[]), len: 0, codec: Codec::Raw }
    }

    /// Returns true if the page has no tile.
    pub(super) fn is_absent(&self) -> bool {
        self.len == 0
    }

    pub(super) fn encode(&self) -> [u8; TileHead::BYTES] {
        let mut bytes = [0; TileHead::BYTES];
        bytes[..8].copy_from_slice(&self.page.to_le_bytes());
        bytes[8..24].copy_from_slice(&self.hash.to_le_bytes());
        bytes[24..32].copy_from_slice(&self.checksum.to_le_bytes());
        bytes[32..40].copy_from_slice(&self.len.to_le_bytes());
        bytes[40] = self.codec.number();
        let own = checksum(&bytes[..48]);
        bytes[48..].copy_from_slice(&own.to_le_bytes());
        bytes
    }

    /// Reads a head. Fails unless the bytes are those of a head whose tile has at most `raw_len` bytes.
    pub(super) fn decode(bytes: &[u8; TileHead::BYTES], raw_len: usize) -> Result<TileHead, String> {
        let (checked, stated) = bytes.split_at(48);
        if checksum(checked).to_le_bytes() != stated {
            return Err("the beginning of a tile is damaged".into());
        }
        let mut fields = Fields::new(checked);
        let (page, low, high) = (fields.u64()?, fields.u64()?, fields.u64()?);
        let (tile_checksum, len, codec) = (fields.u64()?, fields.u64()?, fields.u64()?);
        let codec = u8::try_from(codec).map_err(|e| e.to_string()).and_then(Codec::from_number)?;
        if len > raw_len as u64 {
            return Err(format!("a tile of {len} bytes where {raw_len} are the most"));
        }
        let hash = u128::from(high) << 64 | u128::from(low);
        let head = TileHead { page, hash, checksum: tile_checksum, len, codec };
        if head.is_absent() && head != TileHead::absent(page) {
            return Err("a tile of no bytes".into());
        }
        Ok(head)
    }

    /// The tile with its `bytes`, whose checksum has been compared with [`TileHead::checksum`].
    pub(super) fn with_bytes(self, bytes: Bytes, raw_len: usize) -> EncodedTile {
        let tile = Tile { codec: self.codec, bytes };
        EncodedTile::encoded_before(tile, self.hash, self.checksum, raw_len)
    }

    /// Reads the next head that an interrupted writer left, or `None` if there is no whole and sound one.
    pub(super) fn read_sound(from: &mut impl Read, raw_len: usize) -> io::Result<Option<TileHead>> {
        let mut bytes = [0; TileHead::BYTES];
        let whole = fills(from, &mut bytes)?;
        Ok(whole.then(|| TileHead::decode(&bytes, raw_len).ok()).flatten())
    }

    /// Reads the tile's bytes, or `None` if they are not whole and sound.
    pub(super) fn read_sound_bytes(&self, from: &mut impl Read) -> io::Result<Option<Bytes>> {
        // At most those of a decoded tile.
        let mut bytes = vec![0; self.len as usize];
        let sound = fills(from, &mut bytes)? && checksum(&bytes) == self.checksum;
        Ok(sound.then(|| bytes.into()))
    }
}

/// Fills `bytes`. Returns false if there are not enough.
fn fills(from: &mut impl Read, bytes: &mut [u8]) -> io::Result<bool> {
    match from.read_exact(bytes) {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(e) => Err(e),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_reads_back_and_any_flipped_bit_is_seen() {
        let head = TileHead { page: 7, hash: 1 << 100 | 5, checksum: 9, len: 40, codec: Codec::Lz4 };
        let bytes = head.encode();
        assert_eq!(TileHead::decode(&bytes, 40), Ok(head));
        assert!(TileHead::decode(&bytes, 39).is_err());
        assert!(TileHead::decode(&TileHead { len: 0, ..head }.encode(), 40).is_err());
        assert_eq!(TileHead::decode(&TileHead::absent(3).encode(), 40), Ok(TileHead::absent(3)));
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes;
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(TileHead::decode(&flipped, 40).is_err(), "bit {bit}");
        }
    }
}
