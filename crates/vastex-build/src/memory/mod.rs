//! Images in main memory with all of their levels, as sources of tiles: whole, or at a half, a quarter and so on of
//! their size; and while their rows are still coming, as far as they are there.
//!
//! [`decode()`] reads a file into one; whoever reads rows for another reason gives them to one as well
//! ([`MemoryImage::push`]), as a program does that shows what it builds. Values are those that [`crate::build()`]
//! stores where the image is whole. What a level is made of is in [`levels`].

mod decode;
mod levels;

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use vastex_core::{
    AddressMode, Box3, Description, Geometry, GeometryError, GeometrySpec, Layer, PageContents, PagePos,
    PageSet, Region, fold,
};
use vastex_tiles::{Codec, ReadError, ReadFuture, ReadLimit, SourceKey, Tiers, Tile, TileSource};

use crate::image::ImageHeader;
use crate::texels::convert::layer_format;
use levels::{Levels, Rows};

pub use decode::{DecodeOptions, decode};

/// Factors are powers of two up to this.
const MOST_FACTOR: u32 = 1 << 31;

/// An image of one layer in memory, with all of its levels. Texels whose rows are not there yet are zero.
///
/// Its level 0 is the image, or each of its texels stands for `factor` times `factor` of the image: the mean of four of them.
/// Reads copy what they need and wait for nothing but the row that is being added. One thread adds rows, any number read.
pub struct MemoryImage {
    description: Arc<Description>,
    /// Columns and rows of the image.
    image_size: [u32; 2],
    factor: u32,
    /// Bytes of a texel of the layer.
    texel: usize,
    /// What becomes of the image's rows.
    rows: Mutex<Rows>,
    levels: RwLock<Levels>,
    /// Rows of level 0 that are there.
    there: AtomicU32,
}

impl MemoryImage {
    /// Room for an image, each texel of it or one for `factor` times `factor`, where `factor` is a power of two. The
    /// left and right edges are neighbours if `wraps`. Memory is taken as rows come: [`MemoryImage::bytes`] at the end.
    pub fn new(header: &ImageHeader, factor: u32, wraps: bool) -> Result<MemoryImage, GeometryError> {
        let factor = factor.clamp(1, MOST_FACTOR);
        let [width, height] = [header.width, header.height].map(|side| side.div_ceil(factor));
        let x = if wraps || header.wraps { AddressMode::Wrap } else { AddressMode::Clamp };
        let address = [x, AddressMode::Clamp, AddressMode::Clamp];
        let geometry = Geometry::new(GeometrySpec { address, ..GeometrySpec::image(width, height) })?;
        let format = layer_format(header);
        let sizes = geometry.levels().iter().map(|level| [level.size[0], level.size[1]]).collect();
        let description = Description::new(geometry, vec![Layer::new("color", format)]);
        Ok(MemoryImage {
            description: Arc::new(description),
            image_size: [header.width, header.height],
            factor,
            texel: format.texel_bytes(),
            rows: Mutex::new(Rows::new(header, factor)),
            levels: RwLock::new(Levels::new(sizes, format, x == AddressMode::Wrap)),
            there: AtomicU32::new(0),
        })
    }

    /// The smallest factor with which an image takes at most `limit` bytes.
    pub fn factor_within(header: &ImageHeader, limit: u64) -> u32 {
        factor_with(|factor| MemoryImage::bytes(header, factor) <= limit)
    }

    /// The smallest factor with which an image has at most `side` texels along each axis.
    pub fn factor_of_side(header: &ImageHeader, side: u32) -> u32 {
        factor_with(|factor| header.width.max(header.height).div_ceil(factor) <= side)
    }

    /// Bytes of an image in memory, its coarser levels included.
    pub fn bytes(header: &ImageHeader, factor: u32) -> u64 {
        let [width, height] = [header.width, header.height].map(|side| u64::from(side.div_ceil(factor)));
        // Sizes are at most 2^31, and a texel has at most 16 bytes.
        let finest = u128::from(width) * u128::from(height) * layer_format(header).texel_bytes() as u128;
        u64::try_from(finest + finest / 3).unwrap_or(u64::MAX)
    }

    /// Adds the next rows of the image: a whole number of them, as its reader gives them out. More than there are is
    /// too much, and is left out.
    pub fn push(&self, rows: &[u8]) {
        let mut reading = self.rows.lock().unwrap_or_else(PoisonError::into_inner);
        let row_bytes = reading.row_bytes();
        for row in rows.chunks_exact(row_bytes) {
            let Some(row) = reading.next(row) else { continue };
            let mut levels = self.levels.write().unwrap_or_else(PoisonError::into_inner);
            levels.push(row);
            self.there.store(levels.rows(), Ordering::Release);
        }
    }

    /// Rows of level 0 that are there.
    pub fn rows(&self) -> u32 {
        self.there.load(Ordering::Acquire)
    }

    /// Whether all of its rows are there.
    pub fn is_whole(&self) -> bool {
        self.rows() == self.description.geometry.size()[1]
    }

    /// Columns and rows of the image that one texel of level 0 stands for.
    pub fn factor(&self) -> u32 {
        self.factor
    }

    /// Columns and rows of the image.
    pub fn image_size(&self) -> [u32; 2] {
        self.image_size
    }

    /// The region that rows are in, from the row `from` of level 0 to the last that is there.
    pub fn region_since(&self, from: u32) -> Region {
        Region::image(0..u32::MAX, from..self.rows().max(from))
    }

    /// Copies a box of a level into a tile, whose rows begin `stride` bytes apart.
    fn fill(&self, levels: &Levels, level: u8, level_box: Box3, tile: &mut [u8], stride: usize) {
        let geometry = &self.description.geometry;
        let ([x, y, _], [columns, rows, _]) = (level_box.origin, level_box.size);
        let [width, height, _] = geometry.level(level).size;
        let [across, down, _] = geometry.address();
        let runs = runs(across, width, x, columns);
        for (target, y) in tile.chunks_mut(stride).zip(y..).take(rows as usize) {
            let Some(row) = levels.row(level, fold(down, y, height)) else { continue };
            let mut to = 0;
            for &(from, len) in &runs {
                let (from, len) = (from as usize * self.texel, len as usize * self.texel);
                target[to..to + len].copy_from_slice(&row[from..from + len]);
                to += len;
            }
        }
    }
}

/// The smallest power of two that will do, or the largest that there is.
fn factor_with(will_do: impl Fn(u32) -> bool) -> u32 {
    (0..MOST_FACTOR.ilog2()).map(|bits| 1 << bits).find(|&factor| will_do(factor)).unwrap_or(MOST_FACTOR)
}

/// The texels of `count` columns from `first` on: first and number of each run of neighbours.
fn runs(address: AddressMode, width: u32, first: i64, count: u32) -> Vec<(u32, u32)> {
    let mut runs: Vec<(u32, u32)> = Vec::new();
    for x in (first..).take(count as usize) {
        let from = fold(address, x, width);
        match runs.last_mut() {
            Some((first, len)) if *first + *len == from => *len += 1,
            _ => runs.push((from, 1)),
        }
    }
    runs
}

#[deny(clippy::missing_trait_methods)]
impl TileSource for MemoryImage {
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
        Box::pin(async move { self.at_hand(pos).ok_or(ReadError::NoSuchTile { pos }) })
    }

    fn at_hand(&self, pos: PagePos) -> Option<Tile> {
        let geometry = &self.description.geometry;
        if !geometry.contains(pos) {
            return None;
        }
        let mut tile = vec![0; self.description.tile_bytes()];
        let stride = geometry.tile()[0] as usize * self.texel;
        let levels = self.levels.read().unwrap_or_else(PoisonError::into_inner);
        for (level, level_box, offset) in geometry.tile_boxes(pos) {
            let start = offset[1] as usize * stride + offset[0] as usize * self.texel;
            self.fill(&levels, level, level_box, &mut tile[start..], stride);
        }
        Some(Tile { codec: Codec::Raw, bytes: tile.into() })
    }

    /// Nothing is kept that could be stale.
    fn changed(&self, _: &Region) {}
}
