//! What the files of this crate are made of: numbers, shapes of textures, lists of pages, a checksum.
//!
//! A file begins with eight letters and a version and ends with a CRC-32 of everything before. Numbers are
//! varints: seven bits a byte, the lowest first, the eighth set on all but the last. Nothing is allocated by
//! a count before what it counts has been read. What a file holds, and what is said of one that is damaged,
//! is the business of those who use this.

use crate::shader_constants::{STEP_BITS, STEPS_PER_LEVEL};
use crate::texture::geometry::codec::{GeometryBytesError, GeometryParts};
use crate::texture::geometry::{
    AddressMode, Geometry, GeometryError, GeometrySpec, MAX_LEVELS, TexelPositions,
};
use crate::texture::page::{Dims, PageId};
use crate::wanted::feedback::WantedPage;

/// Letters that say what a file is.
pub(crate) type Magic = [u8; 8];

/// Bytes of the version and of the checksum.
pub(crate) const WORD: usize = 4;
/// The address modes of old files, each at the number that stands for it.
const OLD_ADDRESS_MODES: [AddressMode; 4] =
    [AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border];

/// What is wrong with the bytes of a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FileError {
    /// The bytes end too soon.
    #[error("it ends within {what}, at byte {at}: it was cut off")]
    Truncated {
        /// Where, in bytes from the beginning.
        at: usize,
        /// What was being read.
        what: &'static str,
    },
    /// The checksum does not fit.
    #[error("its checksum is {found:08x}, and {expected:08x} is written at its end")]
    Checksum {
        /// Of the bytes that are here.
        found: u32,
        /// That the last four bytes say.
        expected: u32,
    },
    /// A number is beyond what its field holds.
    #[error("at byte {at}, {what} {value} is impossible")]
    Value {
        /// Where, in bytes from the beginning.
        at: usize,
        /// What was read.
        what: &'static str,
        /// What stands there.
        value: u64,
    },
    /// Bytes are no texture's shape.
    #[error("texture {texture}, at byte {at}: {error}")]
    Shape {
        /// The texture, counted from 0.
        texture: usize,
        /// Where the texture's shape begins, in bytes from the beginning.
        at: usize,
        /// Why.
        error: GeometryBytesError,
    },
    /// A texture's shape is impossible.
    #[error("texture {texture}, at byte {at}: {error}")]
    Geometry {
        /// The texture, counted from 0.
        texture: usize,
        /// Where the texture's shape ends, in bytes from the beginning.
        at: usize,
        /// Why.
        error: GeometryError,
    },
}

/// The beginning of a file.
pub(crate) fn begin(magic: &Magic, version: u32) -> Vec<u8> {
    [&magic[..], &version.to_le_bytes()].concat()
}

/// The end of a file.
pub(crate) fn seal(mut bytes: Vec<u8>) -> Vec<u8> {
    let checksum = crc32(&bytes);
    bytes.extend(checksum.to_le_bytes());
    bytes
}

pub(crate) fn put(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

/// The shape of a texture after the number of its bytes, then its placement: the bytes that containers have.
pub(crate) fn put_geometry(bytes: &mut Vec<u8>, geometry: &Geometry) {
    let shape = geometry.shape_bytes();
    put(bytes, shape.len() as u64);
    bytes.extend(shape);
    bytes.extend(geometry.placement_bytes());
}

/// Pages in ascending order, each once.
pub(crate) fn put_pages(bytes: &mut Vec<u8>, pages: &[WantedPage]) {
    put(bytes, pages.len() as u64);
    let mut next = 0;
    for wanted in pages {
        put(bytes, wanted.page.to_bits() - next);
        next = wanted.page.to_bits() + 1;
        put(bytes, u64::from(wanted.pixels) << STEP_BITS | u64::from(wanted.eighth & 7));
    }
}

pub(crate) fn put_float(bytes: &mut Vec<u8>, value: f32) {
    bytes.extend(value.to_le_bytes());
}

pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
    pub(super) at: usize,
}

impl<'a> Reader<'a> {
    /// Reads the letters and the version; `None` if the letters are others.
    pub(crate) fn open(bytes: &'a [u8], magic: &Magic) -> Result<Option<(Reader<'a>, u32)>, FileError> {
        if !bytes.starts_with(magic) {
            let cut = !bytes.is_empty() && magic.starts_with(bytes);
            return match cut {
                true => Err(FileError::Truncated { at: bytes.len(), what: "its first letters" }),
                false => Ok(None),
            };
        }
        let mut reader = Reader { bytes, at: magic.len() };
        let version = reader.word("the version")?;
        Ok(Some((reader, version)))
    }

    /// Checks the checksum, and ends before it.
    pub(crate) fn unseal(&mut self) -> Result<(), FileError> {
        let Some(end) = self.bytes.len().checked_sub(WORD).filter(|&end| end >= self.at) else {
            return Err(FileError::Truncated { at: self.bytes.len(), what: "the checksum" });
        };
        let expected = Reader { bytes: self.bytes, at: end }.word("the checksum")?;
        let found = crc32(&self.bytes[..end]);
        self.bytes = &self.bytes[..end];
        if found == expected { Ok(()) } else { Err(FileError::Checksum { found, expected }) }
    }

    /// Nothing is left.
    pub(crate) fn end(&self) -> Result<(), FileError> {
        let (at, what) = (self.at, "after the end a number of bytes of");
        match self.bytes.len() - at {
            0 => Ok(()),
            rest => Err(FileError::Value { at, what, value: rest as u64 }),
        }
    }

    /// A float that is a number.
    pub(crate) fn float(&mut self, what: &'static str) -> Result<f32, FileError> {
        let (at, bits) = (self.at, self.word(what)?);
        let value = f32::from_bits(bits);
        let finite = value.is_finite().then_some(value);
        finite.ok_or(FileError::Value { at, what, value: u64::from(bits) })
    }

    pub(crate) fn byte(&mut self, what: &'static str) -> Result<u8, FileError> {
        let byte = *self.bytes.get(self.at).ok_or(FileError::Truncated { at: self.at, what })?;
        self.at += 1;
        Ok(byte)
    }

    fn word(&mut self, what: &'static str) -> Result<u32, FileError> {
        let mut word = [0; WORD];
        for byte in &mut word {
            *byte = self.byte(what)?;
        }
        Ok(u32::from_le_bytes(word))
    }

    /// A varint of at most `max`.
    pub(crate) fn number(&mut self, what: &'static str, max: u64) -> Result<u64, FileError> {
        let (start, mut value) = (self.at, 0u64);
        for shift in (0..u64::BITS).step_by(7) {
            let byte = self.byte(what)?;
            let bits = u64::from(byte & 0x7f);
            if bits << shift >> shift != bits {
                return Err(FileError::Value { at: start, what, value: u64::MAX });
            }
            value |= bits << shift;
            if byte & 0x80 == 0 {
                return match value <= max {
                    true => Ok(value),
                    false => Err(FileError::Value { at: start, what, value }),
                };
            }
        }
        Err(FileError::Value { at: start, what, value: u64::MAX })
    }

    fn side(&mut self, what: &'static str) -> Result<u32, FileError> {
        self.number(what, u64::from(u32::MAX)).map(|side| side as u32)
    }

    fn sides(&mut self, what: &'static str) -> Result<[u32; 3], FileError> {
        Ok([self.side(what)?, self.side(what)?, self.side(what)?])
    }

    pub(crate) fn one_of<T: Copy>(&mut self, what: &'static str, values: &[T]) -> Result<T, FileError> {
        let (at, index) = (self.at, self.byte(what)?);
        let value = values.get(usize::from(index)).copied();
        value.ok_or(FileError::Value { at, what, value: u64::from(index) })
    }

    pub(crate) fn geometry(&mut self, texture: usize) -> Result<Geometry, FileError> {
        let what = "the shape of a texture";
        let len = self.number("the bytes of a shape", u64::from(u32::MAX))? as usize;
        let at = self.at;
        let unknown = |error| FileError::Shape { texture, at, error };
        let shape = self.bytes[at..].get(..len).ok_or(FileError::Truncated { at: self.bytes.len(), what })?;
        let mut parts = GeometryParts::from_shape(shape).map_err(unknown)?;
        self.at += len;
        parts.set_placement([self.byte(what)?, self.byte(what)?]).map_err(unknown)?;
        let at = self.at;
        parts.geometry().map_err(|error| FileError::Geometry { texture, at, error })
    }

    /// Reads a texture's geometry as files had it before they had the bytes of containers.
    pub(crate) fn old_geometry(&mut self, texture: usize) -> Result<Geometry, FileError> {
        let (at, dims) = (self.at, self.byte("the dimensions of a texture")?);
        let dims = match dims {
            2 => Dims::D2,
            3 => Dims::D3,
            _ => {
                return Err(FileError::Value {
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
            *mode = self.one_of("an address mode", &OLD_ADDRESS_MODES)?;
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
        Geometry::with_factors(spec, &factors).map_err(|error| FileError::Geometry { texture, at, error })
    }

    /// Pages in ascending order, each once; whether they exist is not checked.
    pub(crate) fn pages(&mut self) -> Result<Vec<WantedPage>, FileError> {
        let (mut pages, mut next) = (Vec::new(), 0u64);
        for _ in 0..self.number("the number of pages", u64::MAX)? {
            let at = self.at;
            let step = self.number("a page", u64::MAX)?;
            let page = next.checked_add(step).and_then(PageId::from_bits);
            let page = page.ok_or(FileError::Value { at, what: "the page", value: step })?;
            next = page.to_bits() + 1; // all ones is no page
            let need = self.number("a page's pixels", u64::from(u32::MAX) << STEP_BITS | 7)?;
            let (pixels, eighth) = ((need >> STEP_BITS) as u32, (need % u64::from(STEPS_PER_LEVEL)) as u8);
            pages.push(WantedPage { page, pixels, eighth });
        }
        Ok(pages)
    }
}

/// CRC-32 as Ethernet and PNG have it.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
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
