//! From the bytes of a stored chunk to those of its values: the codecs that Zarr arrays are written with.
//!
//! Every codec decodes into memory of a size known before: that of the chunk's values, or a little more where
//! another codec follows. What claims to be longer is refused, so a hostile chunk takes no more memory than a
//! sound one.

mod blosc;
mod blosclz;
mod shuffle;
mod unpack;

use crate::fault::{VolumeFault, damaged};

/// A codec from bytes to bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Codec {
    /// Blosc 1, with any compressor but Snappy within.
    Blosc,
    /// Zstandard, with or without the size in its header.
    Zstd,
    /// gzip, members one after the other.
    Gzip,
    /// zlib.
    Zlib,
    /// A block of LZ4 behind its size in four bytes.
    Lz4,
    /// CRC-32C behind the bytes.
    Crc32c,
    /// The bytes of values of so many bytes, all first ones first: a filter of numcodecs.
    Shuffle(usize),
}

/// Bytes that a step may give beyond those of the values, where it is not the last one.
const SLACK: usize = 64 << 10;

/// Codecs that a chain may have: writers use two or three, and each may make as much as a chunk of values.
pub(crate) const MOST_CODECS: usize = 8;

/// Codecs in the order in which they encode.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Chain(pub(crate) Vec<Codec>);

impl Chain {
    /// Bytes that a chunk of so many bytes of values may be stored in: more are refused before they are read.
    pub(crate) fn most_stored(&self, bytes: usize) -> u64 {
        most_between(bytes) as u64
    }

    /// The bytes of a chunk's values, exactly so many.
    pub(crate) fn decode(&self, stored: &[u8], bytes: usize) -> Result<Vec<u8>, VolumeFault> {
        let mut decoded: Option<Vec<u8>> = None;
        for (n, codec) in self.0.iter().enumerate().rev() {
            let input = decoded.as_deref().unwrap_or(stored);
            let most = if n == 0 { bytes } else { most_between(bytes) };
            decoded = Some(codec.decode(input, most).map_err(|why| {
                damaged(format!(
                    "{}: {why}; the chunk is damaged, or was written with another codec",
                    codec.name()
                ))
            })?);
        }
        let decoded = decoded.unwrap_or_else(|| stored.to_vec());
        match decoded.len() == bytes {
            true => Ok(decoded),
            false => Err(damaged(format!(
                "the chunk has {} bytes of values where its array's metadata make {bytes}; it is damaged, or of another array",
                decoded.len()
            ))),
        }
    }
}

/// Bytes that a step before the last may give, for values of so many bytes.
fn most_between(bytes: usize) -> usize {
    bytes.saturating_add(bytes / 8).saturating_add(SLACK)
}

impl Codec {
    fn name(self) -> &'static str {
        match self {
            Codec::Blosc => "blosc",
            Codec::Zstd => "zstd",
            Codec::Gzip => "gzip",
            Codec::Zlib => "zlib",
            Codec::Lz4 => "lz4",
            Codec::Crc32c => "crc32c",
            Codec::Shuffle(_) => "shuffle",
        }
    }

    fn decode(self, input: &[u8], most: usize) -> Result<Vec<u8>, String> {
        match self {
            Codec::Blosc => blosc::decode(input, most),
            Codec::Zstd => unpack::zstd(input, most),
            Codec::Gzip => unpack::gzip(input, most),
            Codec::Zlib => unpack::zlib(input, most),
            Codec::Lz4 => unpack::sized_lz4(input, most),
            Codec::Crc32c => unpack::crc32c(input).map(<[u8]>::to_vec),
            Codec::Shuffle(width) => {
                let mut output = vec![0; input.len()];
                shuffle::unshuffle(width, input, &mut output);
                Ok(output)
            }
        }
    }
}

/// The bytes before a checksum that is right.
pub(crate) fn without_crc32c(bytes: &[u8]) -> Result<&[u8], String> {
    unpack::crc32c(bytes)
}

/// The CRC-32C of bytes, as checksums of Zarr have it.
pub fn crc32c(bytes: &[u8]) -> u32 {
    unpack::checksum(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_gives_exactly_the_values() {
        let stored = lz4_flex::block::compress(&[7; 100]);
        let stored = [&100_u32.to_le_bytes()[..], &stored].concat();
        let chain = Chain(vec![Codec::Lz4]);
        assert_eq!(chain.decode(&stored, 100), Ok(vec![7; 100]));
        for bytes in [0, 99, 101] {
            let error = chain.decode(&stored, bytes).unwrap_err().to_string();
            assert!(error.contains("damaged"), "{error}");
        }
        assert_eq!(Chain::default().decode(&[1, 2], 2), Ok(vec![1, 2]));
        assert!(Chain::default().decode(&[1, 2], 3).is_err());
    }
}
