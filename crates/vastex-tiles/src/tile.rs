//! A tile as its source hands it out: encoded, and how to decode it.

use bytes::Bytes;

/// How the bytes of a tile are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Codec {
    /// As they are.
    Raw,
    /// Every texel is the same; the bytes are one texel of each layer.
    Constant,
    /// One LZ4 block, without a frame.
    Lz4,
    /// One Zstandard frame.
    Zstd,
}

/// Why the bytes of a tile cannot be decoded.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a {codec:?} tile of {len} bytes does not decode to {expected} bytes: {why}")]
pub struct DecodeError {
    /// How the tile is encoded.
    pub codec: Codec,
    /// Bytes of the encoded tile.
    pub len: usize,
    /// Bytes that the tile should have.
    pub expected: usize,
    /// What the decoder said.
    pub why: String,
}

/// An encoded tile. Cheap to clone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tile {
    /// How `bytes` are encoded.
    pub codec: Codec,
    /// The encoded bytes.
    pub bytes: Bytes,
}
