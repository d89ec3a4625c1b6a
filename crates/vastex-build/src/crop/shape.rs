//! What a region is when it is written: its size and numbers, and rows on their way.

use std::borrow::Cow;
use std::io;

use crate::image::Number;
use crate::image::stored_as::{self, StoredAs};

/// What is written.
#[derive(Clone)]
pub(super) struct Shape {
    /// Columns and rows.
    pub(super) size: [u32; 2],
    pub(super) channels: u16,
    pub(super) number: Number,
    /// What the numbers stand for.
    pub(super) of: StoredAs,
}

impl Shape {
    /// Bits of a number in a picture: those of the source, where they are fewer than it is handed over with.
    pub(super) fn bits(&self) -> u8 {
        self.of.bits(self.number.bytes())
    }

    /// Bytes of a row in a picture.
    pub(super) fn row_bytes(&self) -> u64 {
        (u64::from(self.size[0]) * u64::from(self.channels) * u64::from(self.bits())).div_ceil(8)
    }

    /// Rows as they lie in a picture, numbers of few bits packed.
    pub(super) fn packed<'a>(&self, rows: &'a [u8]) -> Cow<'a, [u8]> {
        match self.bits() {
            bits @ ..8 => stored_as::packed(rows, bits, self.size[0] as usize).into(),
            _ => rows.into(),
        }
    }
}

/// Takes rows from the top, whole ones, little-endian and without padding.
pub(super) type Sink<'a> = &'a mut dyn FnMut(&[u8]) -> io::Result<()>;
