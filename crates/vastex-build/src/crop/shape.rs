//! What a region is when it is written: its size and numbers, and rows on their way.

use std::io;

use crate::image::Number;

/// What is written.
#[derive(Clone, Copy)]
pub(super) struct Shape {
    /// Columns and rows.
    pub(super) size: [u32; 2],
    pub(super) channels: u16,
    pub(super) number: Number,
}

impl Shape {
    pub(super) fn row_bytes(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.channels) * self.number.bytes() as u64
    }
}

/// Takes rows from the top, whole ones, little-endian and without padding.
pub(super) type Sink<'a> = &'a mut dyn FnMut(&[u8]) -> io::Result<()>;
