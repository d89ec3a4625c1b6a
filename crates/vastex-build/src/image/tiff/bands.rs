//! The rows of a TIFF file of which bands are taken, or whose samples are no colours yet (palettes, inks,
//! fewer bits than a byte): strip by strip, or a row of tiles at a time.
//!
//! Strips and tiles may have any size: what one takes stands in [`ImageHeader::memory`], and whoever reads
//! compares that with what may be taken, before the first row.

use super::file::TiffImage;
use crate::image::{ImageHeader, InputFault, Notice, PixelFormat, RowReader};

/// Some bands of a TIFF file's first image, or the colours that are made of its samples.
pub(super) struct BandsReader {
    header: ImageHeader,
    image: TiffImage,
    format: PixelFormat,
    /// The rows of one strip, or of one row of tiles, and its number.
    held: Vec<u8>,
    held_row: Option<u32>,
    next_row: u32,
}

impl BandsReader {
    pub(super) fn new(image: TiffImage) -> Result<BandsReader, InputFault> {
        let orientation = image.orientation as u16;
        let image = image.cut().upright();
        let mut header = image.header()?;
        header.orientation = orientation;
        let format = header.format;
        let rows = u64::from(image.chunk[1].min(header.height));
        let held = rows.saturating_mul(header.row_bytes() as u64);
        header.memory = held.saturating_add(image.bytes_to_show(format));
        if !image.is_tiled && image.chunk[1] >= header.height {
            let why = "a TIFF of one strip whose samples must be converted";
            header.notices.push(Notice::WholeImage { bytes: header.memory, why });
        }
        Ok(BandsReader { header, image, format, held: Vec::new(), held_row: None, next_row: 0 })
    }

    /// Decodes a strip, or a row of tiles.
    fn hold(&mut self, row: u32) -> Result<(), InputFault> {
        if self.held_row == Some(row) {
            return Ok(());
        }
        let (texel, width) = (self.format.texel_bytes(), self.header.width as usize);
        let side = self.image.chunk[0] as usize;
        let rows = self.image.chunk_rows(row) as usize;
        self.held.resize(rows * width * texel, 0);
        for column in 0..self.image.columns() {
            let texels = self.image.chunk_texels(column, row, self.format)?;
            let first = column as usize * side;
            let bytes = side.min(width - first) * texel;
            let targets = self.held.chunks_exact_mut(width * texel);
            for (to, from) in targets.zip(texels.chunks_exact(side * texel)) {
                to[first * texel..][..bytes].copy_from_slice(&from[..bytes]);
            }
        }
        self.held_row = Some(row);
        Ok(())
    }
}

impl RowReader for BandsReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let row_bytes = self.header.row_bytes();
        for row in rows.chunks_exact_mut(row_bytes) {
            let side = self.image.chunk[1];
            self.hold(self.next_row / side)?;
            row.copy_from_slice(&self.held[(self.next_row % side) as usize * row_bytes..][..row_bytes]);
            self.next_row += 1;
        }
        Ok(())
    }
}
