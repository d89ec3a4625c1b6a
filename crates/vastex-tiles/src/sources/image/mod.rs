//! An image whose pixels lie in main memory, as a source: the pixels are taken as they are, and coarser
//! levels are made when they are asked for.
//!
//! A level is made of the next finer one in cells of 256x256 texels ([`cells`]), each by the filter that
//! builds use ([`halve`]); a read puts its tile together from cells, or from the pixels themselves.

mod cells;
mod halve;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use bytes::Bytes;
use vastex_core::{
    AddressMode, Box3, Description, Geometry, GeometryError, GeometrySpec, Layer, LayerError, LayerFormat,
    PageContents, PagePos, PageSet, Region, fold, fold_runs, is_border_color,
};

use super::{ReadError, ReadFuture, SourceKey, Tiers, TileSource};
use crate::stores::ReadLimit;
use crate::tile::{Codec, Tile};
use cells::{Cell, CellPos, Cells, SIDE};
use halve::{Halving, texel_of_color};

pub use halve::Reduction;

/// The least that is kept of coarser levels: all of those that have one cell.
const LEAST_CACHE: u64 = 4 << 20;
/// What is kept of coarser levels by default.
const USUAL_CACHE: u64 = 64 << 20;

/// How pixels in memory are a texture. [`ImageOptions::default`] suits a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageOptions {
    /// Name of the layer.
    pub layer: String,
    /// Bytes from the beginning of a row to that of the next; `None` where rows follow one another without a
    /// gap.
    pub row_bytes: Option<usize>,
    /// What lies beyond the left and right edges, and beyond the upper and lower ones.
    pub address: [AddressMode; 2],
    /// What lies beyond edges of [`AddressMode::Border`], as [`Description::border_color`] says.
    pub border_color: [u8; 4],
    /// How coarser levels are made; `None` for what suits the format ([`Reduction::usual`]).
    pub reduction: Option<Reduction>,
    /// Texels of a page along a side, without its borders.
    pub page: u32,
    /// Texels of border on each side of a page.
    pub border: u32,
    /// Bytes of coarser levels that are kept at most, 4 MiB at least. `None` for a 64th of the image, and 64
    /// MiB at least.
    pub cache_bytes: Option<u64>,
}

impl Default for ImageOptions {
    /// A layer called `color`, rows without gaps, clamped edges, pages of 128 texels with 4 of border.
    fn default() -> ImageOptions {
        let spec = GeometrySpec::image(1, 1);
        ImageOptions {
            layer: "color".into(),
            row_bytes: None,
            address: [AddressMode::Clamp; 2],
            border_color: [0; 4],
            reduction: None,
            page: spec.page,
            border: spec.border,
            cache_bytes: None,
        }
    }
}

/// Why pixels are no source.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ImageSourceError {
    /// Blocks have no texels to make levels of.
    #[error(
        "texels of {0} are compressed in blocks; hand over pixels that are not, as of rgba8-srgb, and vastex_build::BlockSource makes blocks of their tiles"
    )]
    Compressed(&'static str),
    /// Rows would overlap.
    #[error("rows {given} bytes apart: one row of {width} texels of {format} has {needed} bytes")]
    RowBytes {
        /// Bytes from row to row.
        given: usize,
        /// Bytes of a row.
        needed: u64,
        /// Texels of a row.
        width: u32,
        /// Name of the format.
        format: &'static str,
    },
    /// There are fewer pixels than the image has.
    #[error("{given} bytes of pixels: an image of {width}x{height} texels of {format} has {needed}")]
    Pixels {
        /// Bytes that were handed over.
        given: usize,
        /// Bytes that the image takes.
        needed: u128,
        /// Texels of a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Name of the format.
        format: &'static str,
    },
    /// The texture has an impossible shape.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// The layer does not suit the pages.
    #[error(transparent)]
    Layer(#[from] LayerError),
}

/// An image whose pixels lie in main memory: shown like any other texture, however large it is.
///
/// Neither opening it nor reading its finest level copies more than the tiles that are read. Coarser levels
/// are made when they are asked for, as a build makes them, and are kept within
/// [`ImageOptions::cache_bytes`]; so the first read of the coarsest ones, with which a texture is added, goes
/// over all pixels once, on the thread that reads (about a second for some billions of bytes), and a read of
/// a level that was dropped over those below it, the 64th part of a large image at most with the default. A
/// read under way takes some cells of up to 512 KiB of each level besides.
///
/// ```
/// use vastex_tiles::{ImageSource, TileSource};
/// let pixels = vec![255; 3000 * 2000 * 4];
/// let source = ImageSource::rgba8(3000, 2000, pixels)?;
/// assert_eq!(source.description().geometry.size(), [3000, 2000, 1]);
/// # Ok::<(), vastex_tiles::ImageSourceError>(())
/// ```
pub struct ImageSource {
    description: Arc<Description>,
    pixels: Bytes,
    row_bytes: usize,
    texel: usize,
    halving: Halving,
    /// The border colour as a texel.
    border: Vec<u8>,
    cells: Cells,
}

impl ImageSource {
    /// A picture of red, green, blue and alpha, a byte each, the colours sRGB-encoded as they are in image
    /// files and on screens; alpha is not multiplied in. `pixels` is row after row, from the top left: a
    /// `Vec<u8>`, an `Arc<[u8]>`, a mapped file, or whatever else gives bytes. It is kept as it is, and no
    /// copy is made.
    pub fn rgba8(
        width: u32,
        height: u32,
        pixels: impl AsRef<[u8]> + Send + 'static,
    ) -> Result<ImageSource, ImageSourceError> {
        ImageSource::new(LayerFormat::Rgba8Srgb, [width, height], pixels, &ImageOptions::default())
    }

    /// One channel of 16-bit numbers, row after row from the top left.
    pub fn r16(width: u32, height: u32, mut values: Vec<u16>) -> Result<ImageSource, ImageSourceError> {
        if cfg!(target_endian = "big") {
            values.iter_mut().for_each(|value| *value = value.to_le());
        }
        ImageSource::new(LayerFormat::R16, [width, height], Words(values), &ImageOptions::default())
    }

    /// One channel of 32-bit floats, row after row from the top left.
    pub fn r32f(width: u32, height: u32, mut values: Vec<f32>) -> Result<ImageSource, ImageSourceError> {
        if cfg!(target_endian = "big") {
            values.iter_mut().for_each(|value| *value = f32::from_bits(value.to_bits().to_le()));
        }
        ImageSource::new(LayerFormat::R32Float, [width, height], Words(values), &ImageOptions::default())
    }

    /// Pixels of any format that is not compressed, `size` columns and rows: a texel has its channels one
    /// after the other, each little-endian. Takes no time and no memory for levels.
    ///
    /// Formats of blocks are refused: coarser levels and borders are made of texels, which blocks hold
    /// roughly, and this crate has no encoder for what comes of them. `BlockSource`, in the crate
    /// `vastex-build`, compresses the tiles of such a source as they are read.
    pub fn new(
        format: LayerFormat,
        size: [u32; 2],
        pixels: impl AsRef<[u8]> + Send + 'static,
        options: &ImageOptions,
    ) -> Result<ImageSource, ImageSourceError> {
        if format.is_compressed() {
            return Err(ImageSourceError::Compressed(format.name()));
        }
        let [width, height] = size;
        let [x, y] = options.address;
        let geometry = Geometry::new(GeometrySpec {
            page: options.page,
            border: options.border,
            address: [x, y, AddressMode::Clamp],
            ..GeometrySpec::image(width, height)
        })?;
        let reduction = options.reduction.unwrap_or_else(|| Reduction::usual(format));
        let is_mixable = reduction != Reduction::Labels;
        let layer = Layer { is_mixable, ..Layer::new(options.layer.clone(), format) };
        let border_color = options.border_color;
        let description = Description { border_color, ..Description::new(geometry, vec![layer]) };
        description.check()?;
        let texel = format.texel_bytes();
        let row = u64::from(width) * texel as u64;
        let row_bytes = options.row_bytes.map_or(row, |bytes| bytes as u64);
        if row_bytes < row {
            let given = row_bytes as usize;
            return Err(ImageSourceError::RowBytes { given, needed: row, width, format: format.name() });
        }
        let pixels = Bytes::from_owner(pixels);
        let needed = u128::from(row_bytes) * u128::from(height - 1) + u128::from(row);
        if (pixels.len() as u128) < needed {
            let (given, format) = (pixels.len(), format.name());
            return Err(ImageSourceError::Pixels { given, needed, width, height, format });
        }
        let bytes_of =
            |size: [u32; 3]| u64::from(size[0]).saturating_mul(size[1].into()).saturating_mul(texel as u64);
        let levels: Vec<u64> =
            description.geometry.levels().iter().map(|level| bytes_of(level.size)).collect();
        let usual = || (levels[0] / 64).max(USUAL_CACHE);
        let most = options.cache_bytes.unwrap_or_else(usual).max(LEAST_CACHE);
        Ok(ImageSource {
            pixels,
            row_bytes: row_bytes as usize,
            texel,
            halving: Halving::new(format, reduction),
            border: texel_of_color(format, border_color),
            cells: Cells::new(&levels, most),
            description: Arc::new(description),
        })
    }

    /// Bytes of coarser levels that are kept now.
    pub fn cached_bytes(&self) -> u64 {
        self.cells.bytes()
    }

    fn tile(&self, pos: PagePos, may: Make) -> Option<Tile> {
        let geometry = &self.description.geometry;
        if !geometry.contains(pos) {
            return None;
        }
        let mut tile = vec![0; self.description.tile_bytes()];
        let stride = geometry.tile()[0] as usize * self.texel;
        for (level, level_box, offset) in geometry.tile_boxes(pos) {
            let start = offset[1] as usize * stride + offset[0] as usize * self.texel;
            let mut looked_at = LookedAt::default();
            self.copy(level, level_box, (&mut tile[start..], stride), &mut looked_at, may)?;
        }
        Some(Tile { codec: Codec::Raw, bytes: tile.into() })
    }

    /// Copies a box of a level, as the address modes say, into rows that begin `stride` bytes apart. `None`
    /// where that takes cells that are not kept and may not be made.
    fn copy(
        &self,
        level: u8,
        level_box: Box3,
        (to, stride): (&mut [u8], usize),
        looked_at: &mut LookedAt,
        may: Make,
    ) -> Option<()> {
        let geometry = &self.description.geometry;
        let ([x, y, _], [columns, rows, _]) = (level_box.origin, level_box.size);
        let [width, height, _] = geometry.level(level).size;
        let [across, down, _] = geometry.address();
        let runs = fold_runs(across, width, x, columns);
        for (to, y) in to.chunks_mut(stride).zip(y..).take(rows as usize) {
            let mut to = &mut to[..columns as usize * self.texel];
            if is_border_color(down, y, height) {
                fill(to, &self.border);
                continue;
            }
            let y = fold(down, y, height);
            for run in &runs {
                let (here, rest) = to.split_at_mut(run.len as usize * self.texel);
                match run.first {
                    None => fill(here, &self.border),
                    Some(first) => self.copy_run(level, [first, y], here, looked_at, may)?,
                }
                to = rest;
            }
        }
        Some(())
    }

    /// Copies neighbouring texels of a row.
    fn copy_run(
        &self,
        level: u8,
        [x, y]: [u32; 2],
        mut to: &mut [u8],
        looked_at: &mut LookedAt,
        may: Make,
    ) -> Option<()> {
        if level == 0 {
            let first = y as usize * self.row_bytes + x as usize * self.texel;
            to.copy_from_slice(self.pixels.get(first..first + to.len())?);
            return Some(());
        }
        let mut x = x;
        while !to.is_empty() {
            let pos = CellPos { level, x: x / SIDE, y: y / SIDE };
            let cell = looked_at.cell(pos, || self.cell(pos, may))?;
            let (column, row) = ((x % SIDE) as usize, (y % SIDE) as usize);
            let columns = self.cell_size(pos)[0] as usize;
            let count = (columns - column).min(to.len() / self.texel);
            let (here, rest) = to.split_at_mut(count * self.texel);
            here.copy_from_slice(cell.get((row * columns + column) * self.texel..)?.get(..here.len())?);
            (to, x) = (rest, x + count as u32);
        }
        Some(())
    }

    /// Columns and rows of a cell.
    fn cell_size(&self, pos: CellPos) -> [u32; 2] {
        let [width, height, _] = self.description.geometry.level(pos.level).size;
        [(width - pos.x * SIDE).min(SIDE), (height - pos.y * SIDE).min(SIDE)]
    }

    /// A cell of a level coarser than 0: kept, or made of the next finer level.
    fn cell(&self, pos: CellPos, may: Make) -> Option<Cell> {
        if let Some(cell) = self.cells.get(pos) {
            return Some(cell);
        }
        if may == Make::No {
            return None;
        }
        let [columns, rows] = self.cell_size(pos);
        let row_bytes = columns as usize * self.texel;
        let mut texels = vec![0; rows as usize * row_bytes];
        let mut pair = vec![0; 4 * row_bytes];
        let mut looked_at = LookedAt::default();
        let [x, y] = [pos.x, pos.y].map(|cell| 2 * i64::from(cell) * i64::from(SIDE));
        for (coarse, y) in texels.chunks_exact_mut(row_bytes).zip((y..).step_by(2)) {
            let finer = Box3 { origin: [x, y, 0], size: [2 * columns, 2, 1] };
            self.copy(pos.level - 1, finer, (&mut pair, 2 * row_bytes), &mut looked_at, may)?;
            let (upper, lower) = pair.split_at(2 * row_bytes);
            self.halving.row(coarse, upper, lower);
        }
        let cell = Cell::from(texels);
        self.cells.insert(pos, &cell);
        Some(cell)
    }
}

/// Whether cells that are not kept are made.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Make {
    Yes,
    No,
}

/// Cells that one read or one cell is made of: they stay until it is done, whatever else drops them.
#[derive(Default)]
struct LookedAt(Vec<(CellPos, Cell)>);

impl LookedAt {
    fn cell(&mut self, pos: CellPos, find: impl FnOnce() -> Option<Cell>) -> Option<&Cell> {
        let at = match self.0.iter().position(|(known, _)| *known == pos) {
            Some(at) => at,
            None => {
                // Rows are looked at from the top down: a row of cells that is done with is not met again,
                // but for folded edges.
                self.0.retain(|(known, _)| known.y + 1 >= pos.y);
                self.0.push((pos, find()?));
                self.0.len() - 1
            }
        };
        self.0.get(at).map(|(_, cell)| cell)
    }
}

fn fill(to: &mut [u8], texel: &[u8]) {
    to.chunks_exact_mut(texel.len()).for_each(|to| to.copy_from_slice(texel));
}

/// Numbers as the bytes that they are.
struct Words<T>(Vec<T>);

impl<T: bytemuck::Pod> AsRef<[u8]> for Words<T> {
    fn as_ref(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0)
    }
}

#[deny(clippy::missing_trait_methods)]
impl TileSource for ImageSource {
    fn behind(&self) -> Option<&dyn TileSource> {
        None
    }

    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn present(&self) -> Option<&Arc<PageSet>> {
        None
    }

    fn contents(&self) -> Option<&Arc<PageContents>> {
        None
    }

    /// Nothing: what is in memory now may be something else in another run.
    fn identity(&self) -> Option<SourceKey> {
        None
    }

    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        None
    }

    fn blocks(&self) -> bool {
        false
    }

    fn add_tiers(&self, _: &mut Tiers) {}

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move { self.tile(pos, Make::Yes).ok_or(ReadError::NoSuchTile { pos }) })
    }

    /// A tile of the pixels themselves, or of levels that are kept.
    fn at_hand(&self, pos: PagePos) -> Option<Tile> {
        self.tile(pos, Make::No)
    }

    /// Nothing: the pixels are the source's own, and stay as they are.
    fn changed(&self, _: &Region) {}
}
