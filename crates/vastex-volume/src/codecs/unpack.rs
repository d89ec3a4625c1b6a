//! General compressors and checksums, each into a bounded number of bytes.

use std::io::Read;

use super::memory;
use crate::spare::Spare;

/// Decodes by the thread's own decoder, which takes longer to make than a small chunk takes to decode.
#[cfg(feature = "zstd")]
fn with_decoder(
    decode: impl FnOnce(&mut zstd::bulk::Decompressor<'static>) -> std::io::Result<usize>,
) -> Result<usize, String> {
    use std::cell::RefCell;
    thread_local! {
        static DECODER: RefCell<Option<zstd::bulk::Decompressor<'static>>> = const { RefCell::new(None) };
    }
    DECODER.with_borrow_mut(|kept| {
        let decoder = match kept {
            Some(decoder) => decoder,
            none => none.insert(zstd::bulk::Decompressor::new().map_err(|error| error.to_string())?),
        };
        decode(decoder).map_err(|error| error.to_string())
    })
}

/// Decodes Zstandard, frame after frame, into memory of `most` bytes with anything in them, or into its own
/// where it is given none.
#[cfg(feature = "zstd")]
pub(super) fn zstd(input: &[u8], most: usize, mut memory: Vec<u8>) -> Result<Vec<u8>, String> {
    if memory.len() < most {
        memory.clear();
        memory.try_reserve_exact(most).map_err(|error| error.to_string())?;
        with_decoder(|decoder| decoder.decompress_to_buffer(input, &mut memory))?;
        return Ok(memory);
    }
    let bytes = with_decoder(|decoder| decoder.decompress_to_buffer(input, &mut memory[..most]))?;
    memory.truncate(bytes);
    Ok(memory)
}

/// Decodes Zstandard, frame after frame, into the memory that it is given.
#[cfg(not(feature = "zstd"))]
pub(super) fn zstd(mut input: &[u8], most: usize, mut output: Vec<u8>) -> Result<Vec<u8>, String> {
    output.clear();
    while !input.is_empty() {
        let decoder =
            ruzstd::decoding::StreamingDecoder::new(&mut input).map_err(|error| error.to_string())?;
        take(decoder, &mut output, most)?;
    }
    Ok(output)
}

/// Decodes Zstandard into exactly the bytes of a buffer.
#[cfg(feature = "zstd")]
pub(super) fn zstd_into(input: &[u8], output: &mut [u8]) -> Result<(), String> {
    let bytes = with_decoder(|decoder| decoder.decompress_to_buffer(input, output))?;
    whole(bytes, output.len())
}

/// Decodes Zstandard into exactly the bytes of a buffer.
#[cfg(not(feature = "zstd"))]
pub(super) fn zstd_into(input: &[u8], output: &mut [u8]) -> Result<(), String> {
    let decoded = zstd(input, output.len(), Vec::new())?;
    whole(decoded.len(), output.len())?;
    output.copy_from_slice(&decoded);
    Ok(())
}

/// Decodes gzip, member after member, into the memory that it is given.
pub(super) fn gzip(input: &[u8], most: usize, mut output: Vec<u8>) -> Result<Vec<u8>, String> {
    output.clear();
    take(flate2::read::MultiGzDecoder::new(input), &mut output, most)?;
    Ok(output)
}

/// Decodes zlib, into the memory that it is given.
pub(super) fn zlib(input: &[u8], most: usize, mut output: Vec<u8>) -> Result<Vec<u8>, String> {
    output.clear();
    take(flate2::read::ZlibDecoder::new(input), &mut output, most)?;
    Ok(output)
}

/// Decodes zlib into exactly the bytes of a buffer.
pub(super) fn zlib_into(input: &[u8], output: &mut [u8]) -> Result<(), String> {
    flate2::read::ZlibDecoder::new(input).read_exact(output).map_err(|error| error.to_string())
}

/// Decodes a block of LZ4 into exactly the bytes of a buffer.
pub(super) fn lz4_into(input: &[u8], output: &mut [u8]) -> Result<(), String> {
    match lz4_flex::block::decompress_into(input, output) {
        Ok(len) if len == output.len() => Ok(()),
        Ok(len) => Err(format!("has {len} bytes, where {} are expected", output.len())),
        Err(error) => Err(error.to_string()),
    }
}

/// Decodes a block of LZ4 that follows its size.
pub(super) fn sized_lz4(input: &[u8], most: usize, spare: &Spare) -> Result<Vec<u8>, String> {
    let (size, block) = input.split_first_chunk().ok_or("ends within its size")?;
    let size = u32::from_le_bytes(*size) as usize;
    if size > most {
        return Err(format!("claims {size} bytes, where at most {most} are expected"));
    }
    let mut output = memory(size, spare);
    lz4_into(block, &mut output)?;
    Ok(output)
}

/// The bytes before a CRC-32C, which must be right.
pub(super) fn crc32c(input: &[u8]) -> Result<&[u8], String> {
    let (bytes, sum) = input.split_last_chunk().ok_or("ends within its checksum")?;
    match checksum(bytes) == u32::from_le_bytes(*sum) {
        true => Ok(bytes),
        false => Err("the checksum differs".into()),
    }
}

/// Castagnoli's polynomial, its bits turned round.
const POLYNOMIAL: u32 = 0x82f6_3b78;

/// For each byte, and for each of 8 places from the end of a word, what it makes of the remainder.
static TABLES: [[u32; 256]; 8] = tables();

const fn tables() -> [[u32; 256]; 8] {
    let mut tables = [[0; 256]; 8];
    let mut byte = 0;
    while byte < 256 {
        let mut rest = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            rest = if rest & 1 == 1 { (rest >> 1) ^ POLYNOMIAL } else { rest >> 1 };
            bit += 1;
        }
        tables[0][byte] = rest;
        byte += 1;
    }
    let mut place = 1;
    while place < 8 {
        let mut byte = 0;
        while byte < 256 {
            let before = tables[place - 1][byte];
            tables[place][byte] = (before >> 8) ^ tables[0][(before & 0xff) as usize];
            byte += 1;
        }
        place += 1;
    }
    tables
}

pub(super) fn checksum(bytes: &[u8]) -> u32 {
    let mut rest = u32::MAX;
    let (words, tail) = bytes.as_chunks::<8>();
    for word in words {
        let mixed = u64::from_le_bytes(*word) ^ u64::from(rest);
        rest = (0..8).fold(0, |sum, n| sum ^ TABLES[7 - n][(mixed >> (8 * n)) as usize & 0xff]);
    }
    for byte in tail {
        rest = (rest >> 8) ^ TABLES[0][((rest ^ u32::from(*byte)) & 0xff) as usize];
    }
    !rest
}

/// Reads to the end, and refuses more than `most` bytes in all.
fn take(decoder: impl Read, output: &mut Vec<u8>, most: usize) -> Result<(), String> {
    let left = (most - output.len()) as u64;
    decoder.take(left + 1).read_to_end(output).map_err(|error| error.to_string())?;
    match output.len() > most {
        true => Err(format!("has more than the {most} bytes that are expected")),
        false => Ok(()),
    }
}

/// Refuses less than all.
fn whole(bytes: usize, expected: usize) -> Result<(), String> {
    match bytes == expected {
        true => Ok(()),
        false => Err(format!("has {bytes} bytes, where {expected} are expected")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_castagnolis() {
        assert_eq!(checksum(b"123456789"), 0xe306_9283);
        assert_eq!(checksum(&[0; 32]), 0x8a91_36aa);
        let sealed = [&b"123456789"[..], &0xe306_9283_u32.to_le_bytes()].concat();
        assert_eq!(crc32c(&sealed), Ok(&b"123456789"[..]));
        assert!(crc32c(&sealed[1..]).is_err() && crc32c(&[1, 2]).is_err());
    }

    #[test]
    fn nothing_grows_beyond_its_bound() {
        use std::io::Write;
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(&vec![0; 1 << 20]).unwrap();
        let bomb = encoder.finish().unwrap();
        let gzip = |most| gzip(&bomb, most, Vec::new());
        let zstd = |frame: &[u8], most| zstd(frame, most, Vec::new());
        assert_eq!(gzip(1 << 20).unwrap().len(), 1 << 20);
        assert!(gzip((1 << 20) - 1).unwrap_err().contains("more than"));
        let frame =
            ruzstd::encoding::compress_to_vec(&[9; 5000][..], ruzstd::encoding::CompressionLevel::Fastest);
        assert_eq!(zstd(&frame, 5000), Ok(vec![9; 5000]));
        assert!(zstd(&frame, 4999).is_err() && zstd(&frame[..frame.len() - 3], 5000).is_err());
        let twice = [&frame[..], &frame].concat();
        assert_eq!(zstd(&twice, 10_000), Ok(vec![9; 10_000]));
        assert!(sized_lz4(&[0xff; 12], 100, &Spare::default()).unwrap_err().contains("claims"));
        let block = lz4_flex::block::compress(&[9; 5000]);
        let mut output = vec![0; 5000];
        assert_eq!(lz4_into(&block, &mut output), Ok(()));
        assert!(output.iter().all(|value| *value == 9));
        assert!(lz4_into(&block, &mut [0; 4999]).is_err());
        assert_eq!(lz4_into(&block, &mut [0; 5001]).unwrap_err(), "has 5000 bytes, where 5001 are expected");
        assert!(lz4_into(&block[..block.len() - 1], &mut output).is_err());
    }
}
