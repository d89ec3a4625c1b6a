//! Regions of a TIFF file: the samples of its own tiles, whatever they are; where strips are too large to be
//! decoded at once, of rows, from the top of a strip down.

use std::path::{Path, PathBuf};

use super::CropError;
use super::stored::{Stored, copy, parts, up_to_next};
use crate::image::Number;
use crate::image::stored_as::StoredAs;
use crate::image::tiff::file::TiffImage;
use crate::image::tiff::file::pyramid::TiffPyramid;
use crate::image::tiff::file::strip_rows::StripRows;
use crate::progress::Progress;
use crate::threads;

/// Bytes of decoded tiles that are held at once, where that is at least one tile.
const TILES_BYTES: u64 = 64 << 20;

/// Bytes of a strip or tile, decoded, of which those of a region are held; else of a row.
const MOST_CHUNK_BYTES: u64 = 256 << 20;
/// Bytes of the rows that are decoded at once.
const ROWS_BYTES: u64 = 4 << 20;
/// A container has what is shown, and where that is something else than what is stored, another file helps.
const REMEDY: &str = "convert it to a TIFF of tiles, which keeps what is stored; a container of \
                      it (`vastex build FILE -o FILE.vastex`) has regions of what is shown";

pub(super) struct OfTiff {
    path: PathBuf,
    image: TiffImage,
    /// Where strips are too large to be decoded at once.
    rows: Option<StripRows>,
}

impl OfTiff {
    pub(super) fn new(path: &Path, pyramid: TiffPyramid, level: u32) -> Result<OfTiff, CropError> {
        let stored: Vec<String> = (0..)
            .zip(&pyramid.levels)
            .filter_map(|(level, image): (u32, _)| {
                let [width, height] = image.as_ref()?.size;
                Some(format!("{level} ({width}x{height})"))
            })
            .collect();
        let image = pyramid.levels.into_iter().nth(level as usize).flatten();
        let there = || format!("the file stores {}", stored.join(", "));
        let image = image.ok_or_else(|| CropError::Level { level, there: there() })?;
        let rows = match image.check_chunk(MOST_CHUNK_BYTES, REMEDY) {
            Ok(()) => None,
            Err(_) if row_bytes(&image) <= MOST_CHUNK_BYTES && image.has_streams() => {
                Some(StripRows::new(image.clone(), image.asked_bands()))
            }
            Err(fault) => return Err(CropError::Input { path: path.into(), fault }),
        };
        Ok(OfTiff { path: path.into(), image, rows })
    }

    fn texel_bytes(&self) -> usize {
        match self.image.asked_bands() {
            Some(bands) => bands.len() * self.image.number.bytes(),
            None => self.image.texel_bytes(),
        }
    }
}

/// Bytes of a row of an image with all its samples.
fn row_bytes(image: &TiffImage) -> u64 {
    u64::from(image.size[0]).saturating_mul(image.texel_bytes() as u64)
}

/// Rows that are decoded at once.
fn rows_at_once(image: &TiffImage) -> u32 {
    (ROWS_BYTES / row_bytes(image)).max(1) as u32
}

impl Stored for OfTiff {
    fn size(&self) -> [u32; 2] {
        self.image.size
    }

    fn number(&self) -> Number {
        self.image.number
    }

    fn channels(&self) -> u16 {
        self.image.asked_bands().map_or(self.image.samples, |bands| bands.len() as u16)
    }

    fn stored_as(&self) -> StoredAs {
        match self.image.asked_bands() {
            Some(_) => StoredAs::ByCount,
            None => self.image.stored_as(),
        }
    }

    fn rows_together(&self, row: u32) -> u32 {
        match self.rows {
            Some(_) => rows_at_once(&self.image),
            None => up_to_next(row, self.image.chunk[1]),
        }
    }

    fn approach(&mut self, row: u32, _: &dyn Progress) -> Result<bool, CropError> {
        let OfTiff { path, image, rows: Some(rows) } = self else { return Ok(true) };
        let first = if image.is_plain() { row } else { row - row % image.chunk[1] };
        if !(first..=row).contains(&rows.next_row()) {
            rows.go_to(first);
        }
        for _ in 0..rows_at_once(image).min(row - rows.next_row()) {
            rows.read_row().map_err(|fault| CropError::Input { path: path.clone(), fault })?;
        }
        Ok(rows.next_row() == row)
    }

    fn read(
        &mut self,
        first: [u32; 2],
        size: [u32; 2],
        texels: &mut [u8],
        _: &dyn Progress,
    ) -> Result<(), CropError> {
        let texel = self.texel_bytes();
        let OfTiff { path, image, rows } = self;
        if let Some(rows) = rows {
            rows.go_to(first[1]);
            let (left, bytes) = (first[0] as usize * texel, size[0] as usize * texel);
            for to in texels.chunks_exact_mut(bytes) {
                let row = rows.read_row().map_err(|fault| CropError::Input { path: path.clone(), fault })?;
                to.copy_from_slice(&row[left..left + bytes]);
            }
            return Ok(());
        }
        let at_once = (TILES_BYTES / image.chunk_bytes().max(1)).clamp(1, 256) as usize;
        for some in parts(first, size, image.chunk).chunks(at_once) {
            let decoded = threads::try_map(some, |part| match image.asked_bands() {
                Some(bands) => image.bands_of_chunk(part.cell[0], part.cell[1], bands),
                None => image.stored_chunk(part.cell[0], part.cell[1]),
            });
            let decoded = decoded.map_err(|fault| CropError::Input { path: path.clone(), fault })?;
            for (part, tile) in some.iter().zip(decoded) {
                let stride = image.chunk[0] as usize;
                copy(part, &tile, stride, [0; 2], texels, size[0], texel);
            }
        }
        Ok(())
    }
}
