//! An image at a share of its size of which all rows are decoded: where the whole of it takes memory that
//! nobody may have, as that of a picture that is stored turned.

use std::sync::Arc;

use super::{Beginning, Helpers, ImageHeader, InputFault, RowReader};

/// Of every few rows and columns of an image one.
pub(super) struct Shrunk {
    inner: Box<dyn RowReader>,
    header: ImageHeader,
    /// Rows and columns of the image for one of these.
    step: u32,
    next_row: u32,
    /// Rows of the image that were read, and the last of them.
    read: u32,
    row: Vec<u8>,
    /// Notices of `inner` that are among the own ones.
    seen: usize,
}

impl Shrunk {
    /// An image at half of its size, a quarter and so on, so that it has no more bytes than `most`.
    pub(super) fn new(inner: Box<dyn RowReader>, most: u64) -> Shrunk {
        let mut header = inner.header().clone();
        let seen = header.notices.len();
        let size = [header.width, header.height];
        let mut step = 1;
        while header.image_bytes() > most && step < size[0].max(size[1]) {
            step = step.saturating_mul(2);
            [header.width, header.height] = size.map(|side| side.div_ceil(step));
        }
        header.memory = header.memory.saturating_add(inner.header().row_bytes() as u64);
        Shrunk { inner, header, step, next_row: 0, read: 0, row: Vec::new(), seen }
    }

    /// Reads up to a row of the image, so many altogether.
    fn read_to(&mut self, rows: u32) -> Result<(), InputFault> {
        self.row.resize(self.inner.header().row_bytes(), 0);
        while self.read < rows {
            self.inner.read_rows(&mut self.row)?;
            self.read += 1;
        }
        Ok(())
    }
}

impl RowReader for Shrunk {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn tolerate(&mut self) {
        self.inner.tolerate();
    }

    fn memory_ahead(&self, pieces: usize) -> u64 {
        self.inner.memory_ahead(pieces)
    }

    fn beginning(&self) -> Option<Arc<Beginning>> {
        self.inner.beginning()
    }

    fn take_help(&mut self, helpers: &Helpers) {
        self.inner.take_help(helpers);
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let (row_bytes, texel) = (self.header.row_bytes(), self.header.format.texel_bytes());
        let [width, height] = [self.inner.header().width, self.inner.header().height];
        let step = u64::from(self.step);
        let middle = |at: u32, side: u32| {
            let middle = u64::from(at) * step + step / 2;
            middle.min(u64::from(side) - 1) as u32
        };
        let columns: Vec<usize> =
            (0..self.header.width).map(|at| middle(at, width) as usize * texel).collect();
        for row in rows.chunks_exact_mut(row_bytes) {
            let source = middle(self.next_row, height);
            self.read_to(source + 1)?;
            for (to, from) in row.chunks_exact_mut(texel).zip(&columns) {
                to.copy_from_slice(&self.row[*from..][..texel]);
            }
            self.next_row += 1;
        }
        if self.next_row == self.header.height {
            self.read_to(height)?;
        }
        self.header.add_notices_of(self.inner.header(), &mut self.seen);
        Ok(())
    }
}
