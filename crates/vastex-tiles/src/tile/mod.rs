//! What a tile is: encoded bytes, and how they are decoded. `encode` makes tiles of texels, those of
//! colours as `lz4` says, `blocks` reads layers of compressed blocks.
//!
//! A tile's decoded bytes are its layers one after the other, each row by row without padding. Where the
//! encoded bytes come from, and that they are complete, is the business of the source; decoding trusts no
//! byte.

#[cfg(feature = "blocks")]
mod blocks;
#[cfg(feature = "write")]
mod encode;
#[cfg(feature = "write")]
mod lz4;

use bytes::Bytes;
use vastex_core::Description;

#[cfg(feature = "blocks")]
pub use blocks::{decode_blocks, decode_layer};
#[cfg(feature = "write")]
pub use encode::EncodedTile;

/// Bytes that a decoded tile may have: 1 GiB. Sources with larger tiles are refused when they are opened or
/// written.
pub const MAX_TILE_BYTES: u64 = 1 << 30;

/// How the bytes of a tile are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Codec {
    /// The bytes are those of the decoded tile.
    Raw,
    /// All texels of each layer are the same; the bytes are one texel of each layer, or one block if the
    /// layer is compressed.
    Constant,
    /// One LZ4 block, without a frame.
    Lz4,
    /// One Zstandard frame.
    Zstd,
}

impl Codec {
    /// The number of the codec in files.
    pub(crate) fn number(self) -> u8 {
        match self {
            Codec::Raw => 0,
            Codec::Constant => 1,
            Codec::Lz4 => 2,
            Codec::Zstd => 3,
        }
    }

    /// The codec that has a number in files.
    pub(crate) fn from_number(number: u8) -> Result<Codec, String> {
        match number {
            0 => Ok(Codec::Raw),
            1 => Ok(Codec::Constant),
            2 => Ok(Codec::Lz4),
            3 => Ok(Codec::Zstd),
            other => Err(format!("codec {other} is not known")),
        }
    }
}

/// How tiles are compressed when they are encoded, for which the feature `write` is needed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Compression {
    /// Not compressed.
    None,
    /// LZ4, which is decoded at several GB/s.
    #[default]
    Lz4,
    /// Zstandard at this level, 1 to 22 (0: the default level): smaller than LZ4, decoded at about 1 GB/s.
    ///
    /// In a browser, where no C is compiled, the level has no effect.
    Zstd(i32),
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

impl Tile {
    /// Decodes the tile into its texels: all layers, one after the other, `description.tile_bytes()` bytes.
    ///
    /// A raw tile is not copied. Fails if the bytes do not decode to exactly that many.
    pub fn decode(&self, description: &Description) -> Result<Bytes, DecodeError> {
        let expected = description.tile_bytes();
        let decoded = match self.codec {
            Codec::Raw => exactly(self.bytes.len(), expected).map(|()| self.bytes.clone()),
            Codec::Constant => expand(&self.bytes, description).map(Bytes::from),
            Codec::Lz4 => decompress(expected, |out| {
                lz4_flex::block::decompress_into(&self.bytes, out).map_err(|e| e.to_string())
            }),
            Codec::Zstd => decompress(expected, |out| zstd_decompress(&self.bytes, out)),
        };
        decoded.map_err(|why| DecodeError { codec: self.codec, len: self.bytes.len(), expected, why })
    }
}

fn exactly(len: usize, expected: usize) -> Result<(), String> {
    if len == expected { Ok(()) } else { Err(format!("it has {len} bytes")) }
}

/// One block of each layer, repeated over the tile layer by layer.
fn expand(blocks: &[u8], description: &Description) -> Result<Vec<u8>, String> {
    exactly(blocks.len(), description.block_bytes())?;
    let mut out = Vec::with_capacity(description.tile_bytes());
    let mut rest = blocks;
    for layer in &description.layers {
        let (of_layer, others) = rest.split_at(layer.format.block_bytes());
        out.extend_from_slice(&of_layer.repeat(description.layer_blocks(layer) as usize));
        rest = others;
    }
    Ok(out)
}

fn decompress(
    expected: usize,
    decompress_into: impl FnOnce(&mut [u8]) -> Result<usize, String>,
) -> Result<Bytes, String> {
    let mut out = vec![0; expected];
    let len = decompress_into(&mut out)?;
    exactly(len, expected)?;
    Ok(out.into())
}

#[cfg(all(feature = "write", not(target_family = "wasm")))]
fn zstd_decompress(bytes: &[u8], out: &mut [u8]) -> Result<usize, String> {
    zstd::bulk::decompress_to_buffer(bytes, out).map_err(|e| e.to_string())
}

/// The decoder in pure Rust, where no C is compiled.
#[cfg(any(test, not(feature = "write"), target_family = "wasm"))]
fn zstd_decompress_in_rust(bytes: &[u8], out: &mut [u8]) -> Result<usize, String> {
    let mut decoder = ruzstd::decoding::FrameDecoder::new();
    decoder.set_max_window_size((out.len() as u64).max(1 << 20));
    decoder.decode_all(bytes, out).map_err(|e| e.to_string())
}

#[cfg(any(not(feature = "write"), target_family = "wasm"))]
fn zstd_decompress(bytes: &[u8], out: &mut [u8]) -> Result<usize, String> {
    zstd_decompress_in_rust(bytes, out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex_core::{Geometry, GeometrySpec, Layer, LayerFormat};

    fn description() -> Description {
        let geometry =
            Geometry::new(GeometrySpec { page: 8, border: 1, ..GeometrySpec::image(20, 20) }).unwrap();
        Description::new(
            geometry,
            vec![Layer::new("height", LayerFormat::R16), Layer::new("color", LayerFormat::Rgba8)],
        )
    }

    fn tile(codec: Codec, bytes: &[u8]) -> Tile {
        Tile { codec, bytes: Bytes::copy_from_slice(bytes) }
    }

    #[test]
    fn a_constant_is_expanded_layer_by_layer() {
        let decoded = tile(Codec::Constant, &[1, 2, 3, 4, 5, 6]).decode(&description()).unwrap();
        assert_eq!(decoded.len(), 100 * 6);
        assert_eq!(decoded[..200], [1, 2].repeat(100));
        assert_eq!(decoded[200..], [3, 4, 5, 6].repeat(100));
    }

    #[test]
    fn tiles_of_the_wrong_length_are_refused() {
        let description = description();
        assert!(tile(Codec::Raw, &[0; 599]).decode(&description).is_err());
        assert!(tile(Codec::Constant, &[0; 5]).decode(&description).is_err());
        for len in [0, 599, 601, 5000] {
            let lz4 = lz4_flex::block::compress(&vec![7; len]);
            assert!(tile(Codec::Lz4, &lz4).decode(&description).is_err(), "{len}");
        }
    }

    #[test]
    fn garbage_is_refused() {
        let garbage: Vec<u8> = (0..300u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
        for codec in [Codec::Raw, Codec::Constant, Codec::Lz4, Codec::Zstd] {
            let error = tile(codec, &garbage).decode(&description()).unwrap_err();
            assert_eq!((error.codec, error.len, error.expected), (codec, 300, 600));
        }
    }

    #[cfg(all(feature = "write", not(target_family = "wasm")))]
    #[test]
    fn both_zstandard_decoders_agree() {
        let raw: Vec<u8> = (0..600u32).map(|i| (i / 7) as u8).collect();
        let encoded = zstd::bulk::compress(&raw, 3).unwrap();
        assert_eq!(tile(Codec::Zstd, &encoded).decode(&description()).unwrap(), raw);
        let mut out = vec![0; 600];
        assert_eq!(zstd_decompress_in_rust(&encoded, &mut out), Ok(600));
        assert_eq!(out, raw);
        for expected in [599, 601] {
            let len = zstd_decompress_in_rust(&encoded, &mut vec![0; expected]);
            assert_ne!(len, Ok(expected));
        }
    }
}
