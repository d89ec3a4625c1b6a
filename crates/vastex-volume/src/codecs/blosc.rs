//! Chunks of Blosc 1: blocks that are compressed one by one, each in as many streams as its values have
//! bytes, or in one.

use super::shuffle::{unshuffle, unshuffle_bits};
use super::{blosclz, unpack};

const HEADER_BYTES: usize = 16;
/// The newest version of the format that is read; later ones are those of Blosc 2.
const MOST_VERSION: u8 = 2;
/// Streams that a block can have.
const MOST_STREAMS: usize = 16;
/// Bytes that a stream has at least where there is one for each byte of a value.
const LEAST_STREAM: usize = 128;
/// Bytes that decoding may give for each stored one: no compressor within reaches that.
const MOST_RATIO: usize = 1 << 16;

const SHUFFLED: u8 = 1;
const COPIED: u8 = 2;
const BITS_SHUFFLED: u8 = 4;
const ONE_STREAM: u8 = 0x10;

/// The compressor within.
#[derive(Clone, Copy)]
enum Within {
    BloscLz,
    Lz4,
    Zlib,
    Zstd,
}

struct Header {
    flags: u8,
    within: Within,
    /// Bytes of a value.
    width: usize,
    /// Bytes decoded.
    bytes: usize,
    /// Of a block, decoded.
    block: usize,
}

fn number(input: &[u8], at: usize) -> Option<usize> {
    Some(u32::from_le_bytes(*input.get(at..)?.first_chunk()?) as usize)
}

/// Decodes a chunk of at most so many bytes.
pub(super) fn decode(input: &[u8], most: usize) -> Result<Vec<u8>, String> {
    let header = read_header(input, most)?;
    if header.bytes == 0 {
        return Ok(Vec::new());
    }
    if header.flags & COPIED != 0 {
        let bytes = input.get(HEADER_BYTES..HEADER_BYTES + header.bytes).ok_or("ends too early")?;
        return Ok(bytes.to_vec());
    }
    let mut output = vec![0; header.bytes];
    let mut plain = vec![0; header.block.min(header.bytes)];
    let is_shuffled = header.flags & (SHUFFLED | BITS_SHUFFLED) != 0;
    for (n, block) in output.chunks_mut(header.block).enumerate() {
        let begin = number(input, HEADER_BYTES + 4 * n).ok_or("ends within the places of its blocks")?;
        let streams = input.get(begin..).ok_or("has a block beyond its end")?;
        if !is_shuffled {
            read_block(&header, streams, block)?;
            continue;
        }
        let plain = &mut plain[..block.len()];
        read_block(&header, streams, plain)?;
        match header.flags & BITS_SHUFFLED != 0 {
            true => unshuffle_bits(header.width, plain, block),
            false => unshuffle(header.width, plain, block),
        }
    }
    Ok(output)
}

fn read_header(input: &[u8], most: usize) -> Result<Header, String> {
    let (&[version, _, flags, width], true) =
        (input.first_chunk().ok_or("has no header")?, input.len() >= HEADER_BYTES)
    else {
        return Err("has no header".into());
    };
    if version == 0 || version > MOST_VERSION {
        return Err(format!("is of version {version} of its format, of which 1 and 2 are read"));
    }
    let within = match flags >> 5 {
        0 => Within::BloscLz,
        1 => Within::Lz4,
        2 => {
            return Err(
                "is compressed by Snappy within, which is not read; write it with another compressor".into(),
            );
        }
        3 => Within::Zlib,
        4 => Within::Zstd,
        other => return Err(format!("is compressed by method {other} within, which nobody knows")),
    };
    let cut = || "has no header".to_owned();
    let bytes = number(input, 4).ok_or_else(cut)?;
    let block = number(input, 8).ok_or_else(cut)?;
    let stored = number(input, 12).ok_or_else(cut)?;
    if bytes > most {
        return Err(format!("claims {bytes} bytes, where at most {most} are expected"));
    }
    if stored > input.len() {
        return Err(format!("has {} bytes of {stored}: it is cut off", input.len()));
    }
    if bytes > input.len().saturating_mul(MOST_RATIO) {
        return Err(format!("claims {bytes} bytes in {}", input.len()));
    }
    if bytes > 0 && block == 0 {
        return Err("has blocks of no bytes".into());
    }
    Ok(Header { flags, within, width: usize::from(width).max(1), bytes, block })
}

/// Decodes the streams of a block.
fn read_block(header: &Header, mut streams: &[u8], block: &mut [u8]) -> Result<(), String> {
    let is_last_short = block.len() != header.block;
    let is_split = header.flags & ONE_STREAM == 0
        && header.width <= MOST_STREAMS
        && header.block / header.width >= LEAST_STREAM
        && !is_last_short
        && block.len().is_multiple_of(header.width);
    let count = if is_split { header.width } else { 1 };
    for stream in block.chunks_mut(block.len() / count) {
        let len = number(streams, 0).ok_or("ends within a block")?;
        let packed = streams.get(4..4_usize.saturating_add(len)).ok_or("ends within a block")?;
        streams = &streams[4 + len..];
        match header.within {
            _ if len == stream.len() => stream.copy_from_slice(packed),
            Within::BloscLz => blosclz::decode_into(packed, stream)?,
            Within::Lz4 => unpack::lz4_into(packed, stream)?,
            Within::Zlib => unpack::zlib_into(packed, stream)?,
            Within::Zstd => unpack::zstd_into(packed, stream)?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(flags: u8, width: u8, bytes: u32, block: u32, stored: u32) -> Vec<u8> {
        let mut header = vec![2, 1, flags, width];
        [bytes, block, stored].iter().for_each(|n| header.extend(n.to_le_bytes()));
        header
    }

    #[test]
    fn what_was_only_copied_is_read() {
        let chunk = [header(COPIED, 2, 4, 4, 20), vec![1, 2, 3, 4]].concat();
        assert_eq!(decode(&chunk, 4), Ok(vec![1, 2, 3, 4]));
        assert!(decode(&chunk[..19], 4).is_err() && decode(&chunk, 3).is_err());
    }

    #[test]
    fn lies_are_errors() {
        for (bad, what) in [
            (header(0x20, 2, u32::MAX, 4, 16), "claims"),
            (header(0x20, 2, 100, 0, 16), "no bytes"),
            (header(0x20, 2, 100, 50, 17), "cut off"),
            (header(0x20, 2, 100, 50, 16), "places of its blocks"),
            (header(0x40, 2, 100, 50, 16), "Snappy"),
            (header(0xe0, 2, 100, 50, 16), "nobody"),
            (vec![5; 40], "version 5"),
            (vec![2, 1], "no header"),
        ] {
            let error = decode(&bad, 1 << 20).unwrap_err();
            assert!(error.contains(what), "{error}");
        }
        let mut chunk = header(0x20 | SHUFFLED, 2, 100, 100, 24);
        chunk.extend([20, 0, 0, 0, 0xff, 0xff, 0xff, 0xff]);
        assert!(decode(&chunk, 100).is_err());
    }
}
