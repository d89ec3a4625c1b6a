//! The rows of a TIFF file of which bands are taken, or whose samples are no colours yet (palettes, inks,
//! fewer bits than a byte): strip by strip, or a row of tiles at a time; of one strip, of strips that are
//! very large and of those that are not compressed, row by row.
//!
//! Strips and tiles may have any size: what one takes stands in [`ImageHeader::memory`], and whoever reads
//! compares that with what may be taken, before the first row.

use super::file::TiffImage;
use super::file::strip_rows::StripRows;
use super::sparse::{AnyRows, SparseReader, Strips};
use crate::image::{ImageHeader, InputFault, Notice, PixelFormat, RowReader};

/// Some bands of a TIFF file's first image, or the colours that are made of its samples.
pub(super) struct BandsReader {
    header: ImageHeader,
    image: TiffImage,
    format: PixelFormat,
    rows: Rows,
    next_row: u32,
}

enum Rows {
    /// The rows of one strip, or of one row of tiles, and its number.
    Held(Vec<u8>, Option<u32>),
    /// Rows that come as they are decoded.
    Streamed(Box<StripRows>),
}

impl BandsReader {
    pub(super) fn new(image: TiffImage) -> Result<BandsReader, InputFault> {
        let orientation = image.orientation as u16;
        let image = image.upright();
        let mut header = image.header()?;
        header.orientation = orientation;
        let format = header.format;
        if (image.has_large_strips() || image.is_plain()) && image.has_streams() {
            let rows = StripRows::new(image.clone(), image.picked_bands());
            // A row as it is stored, of the bands that are shown, and as it is shown.
            let texel = image.texel_bytes() + image.picked_texel() + format.texel_bytes();
            let row = u64::from(header.width).saturating_mul(texel as u64);
            header.memory = rows.memory().saturating_add(row);
            let rows = Rows::Streamed(Box::new(rows));
            return Ok(BandsReader { header, image, format, rows, next_row: 0 });
        }
        let image = image.cut();
        let rows = u64::from(image.chunk[1].min(header.height));
        let held = rows.saturating_mul(header.row_bytes() as u64);
        header.memory = held.saturating_add(image.bytes_to_show(format));
        if !image.is_tiled && image.chunk[1] >= header.height {
            let why = "a TIFF of one strip whose samples must be converted";
            header.notices.push(Notice::WholeImage { bytes: header.memory, why });
        }
        Ok(BandsReader { header, image, format, rows: Rows::Held(Vec::new(), None), next_row: 0 })
    }

    /// The image at a share of its size; `None` where that is no quicker than to read all of it.
    pub(super) fn sparse(self, side: u32) -> Option<SparseReader> {
        let strips = match &self.rows {
            Rows::Streamed(_) if self.image.is_plain() => Strips::Plain,
            // Rows come as soon as they are decoded.
            Rows::Streamed(_) => return None,
            Rows::Held(..) if self.image.is_tiled => return None,
            Rows::Held(..) => Strips::Decoded { rows: self.image.chunk[1], bytes: self.image.chunk_bytes() },
        };
        SparseReader::new(Box::new(self), strips, side)
    }
}

/// Decodes a strip, or a row of tiles, where it is not the one that is held.
fn hold(
    image: &TiffImage,
    format: PixelFormat,
    row: u32,
    (held, held_row): (&mut Vec<u8>, &mut Option<u32>),
) -> Result<(), InputFault> {
    if *held_row == Some(row) {
        return Ok(());
    }
    let (texel, width) = (format.texel_bytes(), image.size[0] as usize);
    let side = image.chunk[0] as usize;
    let rows = image.chunk_rows(row) as usize;
    held.resize(rows * width * texel, 0);
    for column in 0..image.columns() {
        let texels = image.chunk_texels(column, row, format)?;
        let first = column as usize * side;
        let bytes = side.min(width - first) * texel;
        let targets = held.chunks_exact_mut(width * texel);
        for (to, from) in targets.zip(texels.chunks_exact(side * texel)) {
            to[first * texel..][..bytes].copy_from_slice(&from[..bytes]);
        }
    }
    *held_row = Some(row);
    Ok(())
}

impl RowReader for BandsReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let (row_bytes, side) = (self.header.row_bytes(), self.image.chunk[1]);
        for row in rows.chunks_exact_mut(row_bytes) {
            match &mut self.rows {
                Rows::Held(held, number) => {
                    hold(&self.image, self.format, self.next_row / side, (&mut *held, number))?;
                    row.copy_from_slice(&held[(self.next_row % side) as usize * row_bytes..][..row_bytes]);
                }
                Rows::Streamed(rows) => {
                    row.copy_from_slice(&self.image.texels_of(rows.read_row()?, self.format));
                }
            }
            self.next_row += 1;
        }
        Ok(())
    }
}

impl AnyRows for BandsReader {
    fn go_to(&mut self, row: u32) {
        self.next_row = row;
        if let Rows::Streamed(rows) = &mut self.rows {
            rows.be_sparse();
            rows.go_to(row);
        }
    }
}
