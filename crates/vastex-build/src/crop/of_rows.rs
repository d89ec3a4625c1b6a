//! Regions of an image that can only be read from the top: its rows, decoded up to the last one of the
//! region.

use std::path::{Path, PathBuf};

use super::CropError;
use super::stored::Stored;
use crate::image::stored_as::StoredAs;
use crate::image::{ImageHeader, Notice, Number, RowReader, open_stored};
use crate::progress::{Progress, read_first_rows, read_further_rows};

/// Bytes of the rows that are decoded at once.
const ROWS_BYTES: usize = 4 << 20;

pub(super) struct OfRows {
    path: PathBuf,
    reader: Box<dyn RowReader>,
    of: StoredAs,
    header: ImageHeader,
    /// The next row of the reader.
    next: u32,
    rows: Vec<u8>,
}

impl OfRows {
    pub(super) fn open(path: &Path, level: u32) -> Result<OfRows, CropError> {
        if level > 0 {
            let there =
                "an image that is no pyramid has level 0 only; `vastex build` makes the others".into();
            return Err(CropError::Level { level, there });
        }
        let opened = open_stored(path).map_err(|fault| CropError::Input { path: path.into(), fault })?;
        let (reader, of) = opened;
        let header = reader.header().clone();
        Ok(OfRows { path: path.into(), reader, of, header, next: 0, rows: Vec::new() })
    }

    fn read_rows(&mut self, count: u32, progress: &dyn Progress) -> Result<(), CropError> {
        self.rows.resize(count as usize * self.header.row_bytes(), 0);
        let (done, all) = (self.next.into(), self.header.height.into());
        let read = match self.next {
            0 => read_first_rows(&mut *self.reader, &mut self.rows, progress),
            _ => read_further_rows(&mut *self.reader, &mut self.rows, &|| progress.advance(done, all, 0)),
        };
        self.next += count;
        read.ok_or(CropError::Cancelled)?.map_err(|fault| CropError::Input { path: self.path.clone(), fault })
    }
}

impl Stored for OfRows {
    fn size(&self) -> [u32; 2] {
        [self.header.width, self.header.height]
    }

    fn number(&self) -> Number {
        self.header.format.sample().into()
    }

    fn channels(&self) -> u16 {
        self.header.format.channels().into()
    }

    fn stored_as(&self) -> StoredAs {
        self.of.clone()
    }

    fn rows_together(&self, _: u32) -> u32 {
        ((ROWS_BYTES / self.header.row_bytes()) as u32).max(1)
    }

    fn tell(&self, progress: &dyn Progress) {
        // What else the reader says is of what becomes of texels that are converted.
        let costs = self.header.notices.iter().filter(|notice| matches!(notice, Notice::WholeImage { .. }));
        costs.for_each(|notice| progress.note(&self.path, notice));
    }

    fn approach(&mut self, row: u32, progress: &dyn Progress) -> Result<bool, CropError> {
        if self.next < row {
            self.read_rows(self.rows_together(self.next).min(row - self.next), progress)?;
        }
        Ok(self.next >= row)
    }

    fn read(
        &mut self,
        first: [u32; 2],
        size: [u32; 2],
        texels: &mut [u8],
        progress: &dyn Progress,
    ) -> Result<(), CropError> {
        self.read_rows(size[1], progress)?;
        let texel = self.header.format.texel_bytes();
        let (left, bytes) = (first[0] as usize * texel, size[0] as usize * texel);
        let rows = self.rows.chunks_exact(self.header.row_bytes());
        for (to, row) in texels.chunks_exact_mut(bytes).zip(rows) {
            to.copy_from_slice(&row[left..left + bytes]);
        }
        Ok(())
    }
}
