//! Chunks of Blosc 1: blocks that are compressed one by one, each in as many streams as its values have
//! bytes, or in one.

use std::ops::Range;

use super::shuffle::{join_planes, unshuffle, unshuffle_bits};
use super::{blosclz, memory, unpack};
use crate::spare::Spare;

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

/// Where the bytes of a chunk lie that was only copied, at most so many; `None` of others.
pub(super) fn copied(input: &[u8], most: usize) -> Result<Option<Range<usize>>, String> {
    let header = read_header(input, most)?;
    if header.flags & COPIED == 0 {
        return Ok(None);
    }
    let range = HEADER_BYTES..HEADER_BYTES + header.bytes;
    match range.end <= input.len() {
        true => Ok(Some(range)),
        false => Err("ends too early".into()),
    }
}

/// Decodes a chunk of at most so many bytes.
pub(super) fn decode(input: &[u8], most: usize, spare: &Spare) -> Result<Vec<u8>, String> {
    let header = read_header(input, most)?;
    if header.bytes == 0 {
        return Ok(Vec::new());
    }
    let mut output = memory(header.bytes, spare);
    if header.flags & (SHUFFLED | BITS_SHUFFLED) == 0 {
        for (n, block) in output.chunks_mut(header.block).enumerate() {
            read_block(&header, streams_of(input, n)?, block)?;
        }
        return Ok(output);
    }
    let mut plain = memory(header.block.min(header.bytes), spare);
    for (n, block) in output.chunks_mut(header.block).enumerate() {
        let streams = streams_of(input, n)?;
        let plain = &mut plain[..block.len()];
        let is_done = header.flags & BITS_SHUFFLED == 0
            && match header.width {
                2 => read_planes::<2>(&header, streams, plain, block)?,
                4 => read_planes::<4>(&header, streams, plain, block)?,
                8 => read_planes::<8>(&header, streams, plain, block)?,
                _ => false,
            };
        if is_done {
            continue;
        }
        read_block(&header, streams, plain)?;
        match header.flags & BITS_SHUFFLED != 0 {
            true => unshuffle_bits(header.width, plain, block),
            false => unshuffle(header.width, plain, block),
        }
    }
    spare.give(plain);
    Ok(output)
}

/// What lies in a chunk from its nth block on.
fn streams_of(input: &[u8], nth: usize) -> Result<&[u8], String> {
    let begin = number(input, HEADER_BYTES + 4 * nth).ok_or("ends within the places of its blocks")?;
    Ok(input.get(begin..).ok_or("has a block beyond its end")?)
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

/// Returns true if there is a stream for each byte of a value in a block of so many bytes.
fn is_split(header: &Header, block: usize) -> bool {
    header.flags & ONE_STREAM == 0
        && header.width <= MOST_STREAMS
        && header.block / header.width >= LEAST_STREAM
        && block == header.block
        && block.is_multiple_of(header.width)
}

/// Decodes the streams of a block.
fn read_block(header: &Header, mut streams: &[u8], block: &mut [u8]) -> Result<(), String> {
    let count = if is_split(header, block.len()) { header.width } else { 1 };
    for stream in block.chunks_mut(block.len() / count) {
        let packed = next_stream(&mut streams)?;
        match packed.len() == stream.len() {
            true => stream.copy_from_slice(packed),
            false => read_stream(header, packed, stream)?,
        }
    }
    Ok(())
}

/// Decodes a block with a stream for each byte of its values, shuffled, by way of as much memory; streams
/// that were only copied are taken where they lie. `false` if it has one stream, and is not decoded.
fn read_planes<const WIDTH: usize>(
    header: &Header,
    mut streams: &[u8],
    plain: &mut [u8],
    block: &mut [u8],
) -> Result<bool, String> {
    if !is_split(header, block.len()) {
        return Ok(false);
    }
    let mut planes: [&[u8]; WIDTH] = [&[]; WIDTH];
    for (plane, stream) in planes.iter_mut().zip(plain.chunks_exact_mut(block.len() / WIDTH)) {
        let packed = next_stream(&mut streams)?;
        if packed.len() == stream.len() {
            *plane = packed;
        } else {
            read_stream(header, packed, stream)?;
            *plane = stream;
        }
    }
    join_planes(planes, block);
    Ok(true)
}

/// Takes the next stream.
fn next_stream<'a>(streams: &mut &'a [u8]) -> Result<&'a [u8], String> {
    let len = number(streams, 0).ok_or("ends within a block")?;
    let packed = streams.get(4..4_usize.saturating_add(len)).ok_or("ends within a block")?;
    *streams = &streams[4 + len..];
    Ok(packed)
}

fn read_stream(header: &Header, packed: &[u8], stream: &mut [u8]) -> Result<(), String> {
    match header.within {
        Within::BloscLz => blosclz::decode_into(packed, stream),
        Within::Lz4 => unpack::lz4_into(packed, stream),
        Within::Zlib => unpack::zlib_into(packed, stream),
        Within::Zstd => unpack::zstd_into(packed, stream),
    }
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
        assert_eq!(copied(&chunk, 4), Ok(Some(16..20)));
        assert!(copied(&chunk[..19], 4).is_err() && copied(&chunk, 3).is_err());
        assert_eq!(copied(&header(0, 2, 4, 4, 16), 4), Ok(None));
    }

    #[test]
    fn lies_are_errors() {
        let decode = |chunk: &[u8], most| decode(chunk, most, &Spare::default());
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
