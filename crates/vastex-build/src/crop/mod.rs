//! A region of one level, as it is stored: from whatever can be opened to an array of NumPy, a PNG or a TIFF.
//!
//! Where texels come from is the business of a [`stored::Stored`], one for each kind of source; how they are
//! written that of [`mod@write`], with a module for each format. Between them go rows, as many at a time as
//! fit [`BAND_BYTES`]. Nothing is filtered, converted or interpolated on the way.

mod npy;
mod of_directory;
mod of_rows;
mod of_tiff;
mod of_tiles;
mod png;
mod shape;
mod stored;
mod tiff;
mod write;

use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vastex_tiles::TileSource;

use crate::image::tiff::file::pyramid::{TiffPyramid, image_in_file};
use crate::image::{InputFault, Number};
use crate::progress::Progress;
use crate::source::{DirectorySource, SourceError};
use crate::tile::{LayerFault, LayerOf};
use shape::Shape;
use stored::Stored;

/// Bytes of the rows that are read at once, where that is at least one row.
const BAND_BYTES: u64 = 32 << 20;

/// The format that a region is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CropFormat {
    /// NumPy's: every kind of number. The shape is (y, x), or (y, x, channel) where there are several.
    /// Numbers of fewer bits than a byte have a byte each.
    Npy,
    /// PNG: 1 to 4 channels of 8 or 16 bits without a sign, or grey of 1, 2 or 4 bits, or numbers of a
    /// palette of up to 256 colours with that palette; no inks.
    Png,
    /// TIFF, uncompressed strips: every kind of number, and that says what they are: grey of which 0 is
    /// white, numbers of a palette with that palette, inks; BigTIFF where it must be.
    Tiff,
}

impl CropFormat {
    /// The format's name.
    pub const fn name(self) -> &'static str {
        match self {
            CropFormat::Npy => "an array of NumPy",
            CropFormat::Png => "PNG",
            CropFormat::Tiff => "TIFF",
        }
    }
}

/// Texels of a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CropRegion {
    /// The column and the row of its upper left texel.
    pub at: [u32; 2],
    /// The region's columns and rows, at least 1 each.
    pub size: [u32; 2],
}

/// Why a region cannot be cut out.
#[derive(Debug, thiserror::Error)]
pub enum CropError {
    /// The image, or a file of it, cannot be read.
    #[error("{path}: {fault}", path = path.display())]
    Input {
        /// The image.
        path: PathBuf,
        /// What is wrong with the file.
        #[source]
        fault: InputFault,
    },
    /// The tile directory cannot be opened.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// A tile of the texture cannot be read or decoded.
    #[error(transparent)]
    Tile(#[from] LayerFault),
    /// There is no such layer.
    #[error("{0}")]
    Layer(String),
    /// There is no such level, or none that is stored.
    #[error("there is no level {level}; {there}")]
    Level {
        /// The level that was asked for.
        level: u32,
        /// Which levels there are.
        there: String,
    },
    /// The region reaches beyond the level.
    #[error(
        "{width}x{height} texels at {x},{y} reach beyond the edge: level {level} has {of_width}x{of_height} texels; choose a \
         smaller region, or another place",
        width = size[0], height = size[1], x = at[0], y = at[1], of_width = of[0], of_height = of[1]
    )]
    Region {
        /// The column and the row of the region's upper left texel, which may lie before the first ones.
        at: [i64; 2],
        /// The region's columns and rows.
        size: [u32; 2],
        /// The level.
        level: u32,
        /// The level's columns and rows.
        of: [u32; 2],
    },
    /// The format cannot hold such texels.
    #[error("{} cannot hold {what}; {remedy}", format.name())]
    Format {
        /// The format.
        format: CropFormat,
        /// What the texels are.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The output cannot be written.
    #[error("cannot be written: {0}")]
    Output(#[source] io::Error),
    /// [`Progress`] asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// One level of something, from which regions are cut.
pub struct CropSource {
    stored: Box<dyn Stored>,
    level: u32,
}

impl CropSource {
    /// Opens an image, a TIFF pyramid or a tile directory. Of a TIFF file, samples are what it stores, in
    /// whatever position; levels are those that it stores, counted by how many times level 0 was halved; of
    /// strips of more than 256 MiB rows are decoded from the top of a strip down to the region. Of
    /// other images only level 0 can be had, upright, and rows before the region are decoded too. Of a tile
    /// directory the texels have the channels that all of its tiles fit into.
    pub fn open(path: &Path, level: u32) -> Result<CropSource, CropError> {
        let at_path = |fault| CropError::Input { path: path.into(), fault };
        let is_file = match image_in_file(path) {
            Some(_) => true,
            None => std::fs::metadata(path).map_err(|error| at_path(error.into()))?.is_file(),
        };
        let pyramid = if is_file { TiffPyramid::open(path).map_err(at_path)? } else { None };
        let stored: Box<dyn Stored> = match pyramid {
            Some(pyramid) => Box::new(of_tiff::OfTiff::new(path, pyramid, level)?),
            None => match DirectorySource::open(path) {
                Ok(directory) => Box::new(of_directory::OfDirectory::new(path, directory, level)?),
                Err(SourceError::Input { fault: InputFault::NoTiles, .. }) => {
                    Box::new(of_rows::OfRows::open(path, level)?)
                }
                Err(error) => return Err(error.into()),
            },
        };
        Ok(CropSource { stored, level })
    }

    /// A layer of a texture, the first unless it is named; what is compressed in blocks is decoded. Where a
    /// page has no tile, texels are those of its nearest ancestor.
    pub fn of_tiles(
        tiles: Arc<dyn TileSource>,
        layer: Option<&str>,
        level: u32,
    ) -> Result<CropSource, CropError> {
        let layer = LayerOf::new(tiles.description(), layer).map_err(CropError::Layer)?;
        Ok(CropSource { stored: Box::new(of_tiles::OfTiles::new(tiles, layer, level)?), level })
    }

    /// Columns and rows of the level.
    pub fn size(&self) -> [u32; 2] {
        self.stored.size()
    }

    /// The kind of the source's numbers.
    pub fn number(&self) -> Number {
        self.stored.number()
    }

    /// Numbers of a texel.
    pub fn channels(&self) -> u16 {
        self.stored.channels()
    }

    fn shape(&self, size: [u32; 2]) -> Shape {
        let (channels, number) = (self.channels(), self.number());
        Shape { size, channels, number, of: self.stored.stored_as() }
    }

    /// The region of so many columns and rows at a place, which is refused beyond any edge. Reads nothing.
    pub fn region(&self, at: [i64; 2], size: [u32; 2]) -> Result<CropRegion, CropError> {
        let of = self.size();
        let along = |axis: usize| {
            let first = u32::try_from(at[axis]).ok()?;
            let end = first.checked_add(size[axis])?;
            (size[axis] > 0 && end <= of[axis]).then_some(first)
        };
        match (along(0), along(1)) {
            (Some(x), Some(y)) => Ok(CropRegion { at: [x, y], size }),
            _ => Err(CropError::Region { at, size, level: self.level, of }),
        }
    }

    /// Checks that the region lies within the level, and the format can hold it. Reads nothing.
    pub fn check(&self, region: CropRegion, format: CropFormat) -> Result<(), CropError> {
        self.region(region.at.map(i64::from), region.size)?;
        write::check(format, &self.shape(region.size))
    }
}

/// How much of a region is done, while more of it is read.
struct Within<'a> {
    progress: &'a dyn Progress,
    rows: [u32; 2],
    written: u64,
}

impl Progress for Within<'_> {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        let [done, all] = self.rows.map(u64::from);
        self.progress.advance(done, all, self.written)
    }

    fn beginning(&self, share: f64) -> ControlFlow<()> {
        self.progress.beginning(share)
    }
}

impl Within<'_> {
    fn check(&self) -> Result<(), CropError> {
        if self.advance(0, 0, 0).is_break() { Err(CropError::Cancelled) } else { Ok(()) }
    }
}

/// Writes a region. Memory is that of 32 MiB of rows, or one row, and of the tiles that these need; of an
/// image that cannot be read by rows all of it is held, which `progress` is told before. What is written
/// before an error is of no use.
pub fn crop(
    source: &mut CropSource,
    region: CropRegion,
    format: CropFormat,
    output: &mut dyn Write,
    progress: &dyn Progress,
) -> Result<(), CropError> {
    source.check(region, format)?;
    let shape = source.shape(region.size);
    let stored = &mut *source.stored;
    stored.tell(progress);
    let [width, height] = region.size;
    let row_bytes = u64::from(width) * u64::from(stored.channels()) * stored.number().bytes() as u64;
    let most = u32::try_from(BAND_BYTES / row_bytes).unwrap_or(u32::MAX).max(1);
    write::write(format, &shape, output, &mut |write| {
        let mut band = Vec::new();
        let mut told = Within { progress, rows: [0, height], written: 0 };
        told.check()?;
        while !stored.approach(region.at[1], &told)? {
            told.check()?;
        }
        while told.rows[0] < height {
            told.check()?;
            let first = region.at[1] + told.rows[0];
            let rows = stored.rows_together(first).min(most).min(height - told.rows[0]);
            band.resize((u64::from(rows) * row_bytes) as usize, 0);
            stored.read([region.at[0], first], [width, rows], &mut band, &told)?;
            write(&band).map_err(CropError::Output)?;
            told.rows[0] += rows;
            told.written += band.len() as u64;
        }
        // Whoever stopped it while the last rows were read is heard, too.
        told.check()
    })
}
