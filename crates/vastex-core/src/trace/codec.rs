//! A trace as bytes, and back. docs/traces.md describes them.
//!
//! Numbers are varints: seven bits a byte, the lowest first, the eighth set on all but the last. Nothing is allocated by a
//! count before what it counts has been read.

use crate::feedback::WantedPage;
use crate::geometry::{AddressMode, Geometry, GeometrySpec, MAX_LEVELS, TexelPositions};
use crate::page::{Dims, PageId, TextureId};
use crate::shared::{STEP_BITS, STEPS_PER_LEVEL};

use super::{Trace, TraceError};

/// The version written, and the only one read.
pub(super) const VERSION: u32 = 1;

const MAGIC: &[u8; 8] = b"VXTRACE\0";
/// Bytes of the version and of the checksum.
const WORD: usize = 4;
/// By the numbers that stand for them.
const ADDRESS_MODES: [AddressMode; 4] =
    [AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border];

pub(super) fn encode(trace: &Trace) -> Vec<u8> {
    let mut bytes = Vec::from(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    put(&mut bytes, trace.geometries.len() as u64);
    trace.geometries.iter().for_each(|geometry| put_geometry(&mut bytes, geometry));
    put(&mut bytes, trace.frames.len() as u64);
    for frame in &trace.frames {
        put(&mut bytes, frame.len() as u64);
        let mut next = 0;
        for wanted in frame {
            put(&mut bytes, wanted.page.to_bits() - next);
            next = wanted.page.to_bits() + 1;
            put(&mut bytes, u64::from(wanted.pixels) << STEP_BITS | u64::from(wanted.eighth & 7));
        }
    }
    let checksum = crc32(&bytes);
    bytes.extend(checksum.to_le_bytes());
    bytes
}

fn put(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

fn put_geometry(bytes: &mut Vec<u8>, geometry: &Geometry) {
    let spec = geometry.spec();
    bytes.push(match spec.dims {
        Dims::D2 => 2,
        Dims::D3 => 3,
    });
    spec.size.iter().for_each(|&size| put(bytes, u64::from(size)));
    put(bytes, u64::from(spec.page));
    put(bytes, u64::from(spec.border));
    for mode in spec.address {
        bytes.push(ADDRESS_MODES.iter().position(|&known| known == mode).unwrap_or(0) as u8);
    }
    bytes.push(u8::from(spec.positions == TexelPositions::Kept));
    put(bytes, u64::from(spec.tail_align));
    put(bytes, geometry.levels().len() as u64 - 1);
    for level in geometry.levels().iter().skip(1) {
        level.factor.iter().for_each(|&factor| put(bytes, u64::from(factor)));
    }
}

pub(super) fn decode(bytes: &[u8]) -> Result<Trace, TraceError> {
    if !bytes.starts_with(MAGIC) {
        let cut = !bytes.is_empty() && MAGIC.starts_with(bytes);
        return Err(match cut {
            true => TraceError::Truncated { at: bytes.len(), what: "its first letters" },
            false => TraceError::NotATrace,
        });
    }
    let mut reader = Reader { bytes, at: MAGIC.len() };
    let version = reader.word("the version")?;
    if version != VERSION {
        return Err(TraceError::Version(version));
    }
    let Some(end) = bytes.len().checked_sub(WORD).filter(|&end| end >= reader.at) else {
        return Err(TraceError::Truncated { at: bytes.len(), what: "the checksum" });
    };
    let expected = Reader { bytes, at: end }.word("the checksum")?;
    let found = crc32(&bytes[..end]);
    if found != expected {
        return Err(TraceError::Checksum { found, expected });
    }
    reader.bytes = &bytes[..end];
    read_trace(&mut reader)
}

fn read_trace(reader: &mut Reader<'_>) -> Result<Trace, TraceError> {
    let mut trace = Trace::new();
    for texture in 0..reader.number("the number of textures", u64::from(TextureId::MAX) + 1)? as usize {
        let geometry = reader.geometry(texture)?;
        trace.add_texture(geometry).map_err(|error| TraceError::Content { at: reader.at, error })?;
    }
    for _ in 0..reader.number("the number of frames", u64::MAX)? {
        let pages = reader.frame()?;
        trace.add_frame(pages).map_err(|error| TraceError::Content { at: reader.at, error })?;
    }
    match reader.bytes.len() - reader.at {
        0 => Ok(trace),
        rest => Err(TraceError::Value {
            at: reader.at,
            what: "a number of bytes after the last frame of",
            value: rest as u64,
        }),
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn byte(&mut self, what: &'static str) -> Result<u8, TraceError> {
        let byte = *self.bytes.get(self.at).ok_or(TraceError::Truncated { at: self.at, what })?;
        self.at += 1;
        Ok(byte)
    }

    fn word(&mut self, what: &'static str) -> Result<u32, TraceError> {
        let mut word = [0; WORD];
        for byte in &mut word {
            *byte = self.byte(what)?;
        }
        Ok(u32::from_le_bytes(word))
    }

    /// A varint of at most `max`.
    fn number(&mut self, what: &'static str, max: u64) -> Result<u64, TraceError> {
        let (start, mut value) = (self.at, 0u64);
        for shift in (0..u64::BITS).step_by(7) {
            let byte = self.byte(what)?;
            let bits = u64::from(byte & 0x7f);
            if bits << shift >> shift != bits {
                return Err(TraceError::Value { at: start, what, value: u64::MAX });
            }
            value |= bits << shift;
            if byte & 0x80 == 0 {
                return match value <= max {
                    true => Ok(value),
                    false => Err(TraceError::Value { at: start, what, value }),
                };
            }
        }
        Err(TraceError::Value { at: start, what, value: u64::MAX })
    }

    fn side(&mut self, what: &'static str) -> Result<u32, TraceError> {
        self.number(what, u64::from(u32::MAX)).map(|side| side as u32)
    }

    fn sides(&mut self, what: &'static str) -> Result<[u32; 3], TraceError> {
        Ok([self.side(what)?, self.side(what)?, self.side(what)?])
    }

    fn one_of<T: Copy>(&mut self, what: &'static str, values: &[T]) -> Result<T, TraceError> {
        let (at, index) = (self.at, self.byte(what)?);
        let value = values.get(usize::from(index)).copied();
        value.ok_or(TraceError::Value { at, what, value: u64::from(index) })
    }

    fn geometry(&mut self, texture: usize) -> Result<Geometry, TraceError> {
        let (at, dims) = (self.at, self.byte("the dimensions of a texture")?);
        let dims = match dims {
            2 => Dims::D2,
            3 => Dims::D3,
            _ => {
                return Err(TraceError::Value {
                    at,
                    what: "a number of dimensions of",
                    value: u64::from(dims),
                });
            }
        };
        let size = self.sides("the size of a texture")?;
        let page = self.side("the page size of a texture")?;
        let border = self.side("the border of a texture")?;
        let mut address = [AddressMode::Clamp; 3];
        for mode in &mut address {
            *mode = self.one_of("an address mode", &ADDRESS_MODES)?;
        }
        let positions = [TexelPositions::Centered, TexelPositions::Kept];
        let positions = self.one_of("the position of texels", &positions)?;
        let tail_align = self.side("the alignment of a tail")?;
        let spec = GeometrySpec { dims, size, page, border, address, positions, tail_align };
        let mut factors = Vec::new();
        for _ in 0..self.number("the number of levels", MAX_LEVELS as u64 - 1)? {
            factors.push(self.sides("the factors of a level")?);
        }
        let at = self.at;
        Geometry::with_factors(spec, &factors).map_err(|error| TraceError::Geometry { texture, at, error })
    }

    fn frame(&mut self) -> Result<Vec<WantedPage>, TraceError> {
        let (mut pages, mut next) = (Vec::new(), 0u64);
        for _ in 0..self.number("the number of a frame's pages", u64::MAX)? {
            let at = self.at;
            let step = self.number("a page", u64::MAX)?;
            let page = next.checked_add(step).and_then(PageId::from_bits);
            let page = page.ok_or(TraceError::Value { at, what: "the page", value: step })?;
            next = page.to_bits() + 1; // all ones is no page
            let need = self.number("a page's pixels", u64::from(u32::MAX) << STEP_BITS | 7)?;
            let (pixels, eighth) = ((need >> STEP_BITS) as u32, (need % u64::from(STEPS_PER_LEVEL)) as u8);
            pages.push(WantedPage { page, pixels, eighth });
        }
        Ok(pages)
    }
}

/// CRC-32 as Ethernet and PNG have it.
fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = {
        let mut table = [0; 256];
        let mut n = 0;
        while n < 256 {
            let (mut crc, mut bit) = (n as u32, 0);
            while bit < 8 {
                crc = if crc & 1 != 0 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
                bit += 1;
            }
            table[n] = crc;
            n += 1;
        }
        table
    };
    !bytes.iter().fold(!0, |crc, &byte| crc >> 8 ^ TABLE[usize::from(crc as u8 ^ byte)])
}

#[cfg(test)]
mod tests;
