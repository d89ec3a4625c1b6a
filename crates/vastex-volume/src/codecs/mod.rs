//! From the bytes of a stored chunk to those of its values: the codecs that Zarr arrays are written with.
//!
//! Every codec decodes into memory of a size known before: that of the chunk's values, or a little more where
//! another codec follows. What claims to be longer is refused, so a hostile chunk takes no more memory than a
//! sound one.

mod blosc;
mod blosclz;
mod shuffle;
mod unpack;

use std::sync::Arc;

use bytes::Bytes;

use crate::fault::{VolumeFault, damaged};
use crate::spare::Spare;

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

    /// The bytes of a chunk's values, exactly so many. Memory for them is taken from what is spare, and comes
    /// back there.
    pub(crate) fn decode(&self, stored: Bytes, bytes: usize, spare: &Spare) -> Result<Decoded, VolumeFault> {
        let mut decoded = Decoded::Read(stored);
        for (n, codec) in self.0.iter().enumerate().rev() {
            let most = if n == 0 { bytes } else { most_between(bytes) };
            decoded = codec.decode(decoded, most, spare).map_err(|why| {
                damaged(format!(
                    "{}: {why}; the chunk is damaged, or was written with another codec",
                    codec.name()
                ))
            })?;
        }
        match decoded.len() == bytes {
            true => Ok(decoded),
            false => Err(damaged(format!(
                "the chunk has {} bytes of values where its array's metadata make {bytes}; it is damaged, or of another array",
                decoded.len()
            ))),
        }
    }
}

/// What was made of a stored chunk.
#[derive(Debug)]
pub(crate) enum Decoded {
    /// Memory of its own.
    Own(Vec<u8>),
    /// A part of what was read, in which the bytes lie as they are.
    Read(Bytes),
}

impl std::ops::Deref for Decoded {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Decoded::Own(bytes) => bytes,
            Decoded::Read(bytes) => bytes,
        }
    }
}

impl Decoded {
    /// To be shared; memory of its own comes back to what is spare with the last who has it.
    pub(crate) fn share(self, spare: &Arc<Spare>) -> Bytes {
        match self {
            Decoded::Own(mut bytes) => {
                // What is kept is counted by its bytes.
                if bytes.capacity() / 2 > bytes.len() {
                    bytes.shrink_to_fit();
                }
                spare.lend(bytes)
            }
            Decoded::Read(bytes) => bytes,
        }
    }

    /// To be changed.
    pub(crate) fn into_vec(self) -> Vec<u8> {
        match self {
            Decoded::Own(bytes) => bytes,
            Decoded::Read(bytes) => bytes.to_vec(),
        }
    }

    /// The part of it in a range, which is within it.
    fn part(self, range: std::ops::Range<usize>) -> Decoded {
        match self {
            Decoded::Own(mut bytes) => {
                bytes.truncate(range.end);
                bytes.drain(..range.start);
                Decoded::Own(bytes)
            }
            Decoded::Read(bytes) => Decoded::Read(bytes.slice(range)),
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

    fn decode(self, input: Decoded, most: usize, spare: &Spare) -> Result<Decoded, String> {
        let output = match self {
            Codec::Blosc => match blosc::copied(&input, most)? {
                Some(range) => return Ok(input.part(range)),
                None => blosc::decode(&input, most, spare)?,
            },
            Codec::Zstd => unpack::zstd(&input, most, spare.take(most))?,
            Codec::Gzip => unpack::gzip(&input, most, spare.take(most))?,
            Codec::Zlib => unpack::zlib(&input, most, spare.take(most))?,
            Codec::Lz4 => unpack::sized_lz4(&input, most, spare)?,
            Codec::Crc32c => {
                let len = unpack::crc32c(&input)?.len();
                return Ok(input.part(0..len));
            }
            Codec::Shuffle(width) => {
                let mut output = memory(input.len(), spare);
                shuffle::unshuffle(width, &input, &mut output);
                output
            }
        };
        if let Decoded::Own(input) = input {
            spare.give(input);
        }
        Ok(Decoded::Own(output))
    }
}

/// So many bytes with anything in them.
fn memory(bytes: usize, spare: &Spare) -> Vec<u8> {
    match spare.take(bytes) {
        memory if memory.len() == bytes => memory,
        _ => vec![0; bytes],
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
        let stored = Bytes::from([&100_u32.to_le_bytes()[..], &stored].concat());
        let chain = Chain(vec![Codec::Lz4]);
        let spare = Arc::new(Spare::default());
        let decode = |chain: &Chain, stored: &Bytes, bytes| {
            chain
                .decode(stored.clone(), bytes, &spare)
                .map(Decoded::into_vec)
                .map_err(|fault| fault.to_string())
        };
        assert_eq!(decode(&chain, &stored, 100), Ok(vec![7; 100]));
        for bytes in [0, 99, 101] {
            let error = decode(&chain, &stored, bytes).unwrap_err();
            assert!(error.contains("damaged"), "{error}");
        }
        let none = Chain::default();
        let two = Bytes::from(vec![1, 2]);
        assert_eq!(decode(&none, &two, 2), Ok(vec![1, 2]));
        assert!(decode(&none, &two, 3).is_err());
        // What needs no decoding is not copied, behind a checksum either.
        let sealed = Bytes::from([&[1, 2][..], &crc32c(&[1, 2]).to_le_bytes()].concat());
        for (chain, stored) in [(none, two), (Chain(vec![Codec::Crc32c]), sealed)] {
            let shared = chain.decode(stored.clone(), 2, &spare).unwrap().share(&spare);
            assert_eq!(shared.as_ptr(), stored.as_ptr());
        }
    }

    /// Whatever memory is spare, and whatever lies in it, values are the same.
    #[test]
    fn memory_that_was_used_before_changes_nothing() {
        use std::io::Write;
        let values: Vec<u8> = (0..40_000_u32).map(|n| ((n * n / 77) >> 3) as u8).collect();
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        gzip.write_all(&values).unwrap();
        let lz4 = lz4_flex::block::compress(&values);
        let zstd =
            ruzstd::encoding::compress_to_vec(&values[..], ruzstd::encoding::CompressionLevel::Fastest);
        let spare = Arc::new(Spare::default());
        for (codec, stored) in [
            (Codec::Gzip, gzip.finish().unwrap()),
            (Codec::Lz4, [&(values.len() as u32).to_le_bytes()[..], &lz4].concat()),
            (Codec::Zstd, zstd),
            (Codec::Shuffle(1), values.clone()),
        ] {
            let stored = Bytes::from(stored);
            for len in [0, values.len(), values.len() + 900, values.len() - 1] {
                spare.give(vec![0xcc; len]);
                let found = Chain(vec![codec]).decode(stored.clone(), values.len(), &spare).unwrap();
                assert!(*found == values[..], "{codec:?}");
                drop(found.share(&spare));
            }
            assert!(Chain(vec![codec]).decode(stored.clone(), values.len() - 1, &spare).is_err());
            assert!(Chain(vec![codec]).decode(stored, values.len() + 1, &spare).is_err());
        }
    }
}
