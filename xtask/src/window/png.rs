//! Pictures of a display as PNG files, stored without compression: a person opens a few of them.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

/// Bytes of a stored block at most.
const BLOCK: usize = 65_535;

/// Writes red, green and blue of pixels, row by row.
pub(super) fn write(path: &Path, [width, height]: [usize; 2], rgb: &[u8]) -> Result<()> {
    let mut rows = Vec::with_capacity(rgb.len() + height);
    for row in rgb.chunks_exact(3 * width) {
        rows.push(0); // as they are
        rows.extend_from_slice(row);
    }
    let mut stream = vec![0x78, 0x01];
    let blocks = rows.len().div_ceil(BLOCK);
    for (n, block) in rows.chunks(BLOCK).enumerate() {
        stream.push(u8::from(n + 1 == blocks));
        stream.extend((block.len() as u16).to_le_bytes());
        stream.extend((!(block.len() as u16)).to_le_bytes());
        stream.extend_from_slice(block);
    }
    stream.extend(adler32(&rows).to_be_bytes());
    let mut head = Vec::new();
    head.extend((width as u32).to_be_bytes());
    head.extend((height as u32).to_be_bytes());
    head.extend([8, 2, 0, 0, 0]); // eight bits of three channels
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    for (name, content) in [(b"IHDR", &head[..]), (b"IDAT", &stream), (b"IEND", &[])] {
        file.extend((content.len() as u32).to_be_bytes());
        let begin = file.len();
        file.extend_from_slice(name);
        file.extend_from_slice(content);
        file.extend(crc32(&file[begin..]).to_be_bytes());
    }
    fs::write(path, file).with_context(|| format!("cannot write {}", path.display()))
}

fn adler32(bytes: &[u8]) -> u32 {
    let (mut a, mut b) = (1u32, 0u32);
    // So many sums that do not overflow.
    for run in bytes.chunks(5552) {
        for byte in run {
            a += u32::from(*byte);
            b += a;
        }
        (a, b) = (a % 65_521, b % 65_521);
    }
    b << 16 | a
}

/// What eight steps make of each low byte.
const STEPS: [u32; 256] = {
    let mut steps = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut crc, mut bit) = (byte as u32, 0);
        while bit < 8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
            bit += 1;
        }
        steps[byte] = crc;
        byte += 1;
    }
    steps
};

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, byte| STEPS[(crc as u8 ^ byte) as usize] ^ crc >> 8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_the_formats() {
        assert_eq!((crc32(b"123456789"), adler32(b"Wikipedia")), (0xCBF4_3926, 0x11E6_0398));
    }
}
