//! Images in main memory with all of their levels, as sources of tiles: whole, or at a half, a quarter and so
//! on of their size; and while their rows are still coming, as far as they are there.
//!
//! [`Decoding`] reads a file into one; whoever reads rows for another reason gives them to one as well
//! ([`MemoryImage::push`]), as a program does that shows what it builds. Values are those that
//! [`crate::build()`] stores where the image is whole. How rows become fewer is in [`reduce`], how they
//! become levels in [`levels`].

mod decode;
mod levels;
mod reduce;

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use vastex_core::{
    AddressMode, Box3, Description, Geometry, GeometryError, GeometrySpec, Layer, PageContents, PagePos,
    PageSet, Region, fold, fold_runs,
};
use vastex_tiles::{Codec, ReadError, ReadFuture, ReadLimit, SourceKey, Tiers, Tile, TileSource};

use crate::image::ImageHeader;
use crate::texels::convert::{Conversion, layer_format};
use levels::Levels;
use reduce::RowReducer;

pub use decode::{DecodeOptions, Decoding};

/// An image of one layer in memory, with all of its levels. Texels whose rows are not there yet are zero
/// where the layer has an alpha, and nothing is seen of them; elsewhere they repeat the last row that is
/// there, so that filters mix that row with no value that the image does not have.
///
/// Its level 0 is the image, or the image halved a number of times: each texel is then the mean of four of
/// those that it stands for. A read copies a page and waits for nothing but the row that is being added. One
/// thread adds rows, any number read.
pub struct MemoryImage {
    description: Arc<Description>,
    /// Columns and rows of the image.
    image_size: [u32; 2],
    halvings: u32,
    /// Bytes of a texel of the layer.
    texel: usize,
    /// What becomes of the image's rows.
    reducer: Mutex<RowReducer>,
    levels: RwLock<Levels>,
    /// Rows of the image, and rows of level 0, that are there.
    image_rows: AtomicU32,
    rows: AtomicU32,
}

impl MemoryImage {
    /// The most that an image can be halved: no image has more than 2^31 texels a side.
    const MOST_HALVINGS: u32 = 31;

    /// Room for an image that is halved so many times, up to 31. The left and right edges are neighbours if
    /// `wraps`, or if the image says so. Memory is taken as rows come: [`MemoryImage::bytes_at`] at the end.
    /// Fails where the image has too many texels for a texture.
    pub fn new(header: &ImageHeader, halvings: u32, wraps: bool) -> Result<MemoryImage, GeometryError> {
        let halvings = halvings.min(MemoryImage::MOST_HALVINGS);
        let [width, height] = halved(header, halvings);
        let x = if wraps || header.wraps { AddressMode::Wrap } else { AddressMode::Clamp };
        let address = [x, AddressMode::Clamp, AddressMode::Clamp];
        let geometry = Geometry::new(GeometrySpec { address, ..GeometrySpec::image(width, height) })?;
        let format = layer_format(header);
        let sizes = geometry.levels().iter().map(|level| [level.size[0], level.size[1]]).collect();
        let conversion = Conversion::usual(header);
        let nodata = header.nodata.and_then(|value| conversion.nodata(value));
        let layer = Layer { nodata, ..Layer::new("color", format) };
        let levels = Levels::new(sizes, &layer, x == AddressMode::Wrap);
        let description = Description::new(geometry, vec![layer]);
        Ok(MemoryImage {
            description: Arc::new(description),
            image_size: [header.width, header.height],
            halvings,
            texel: format.texel_bytes(),
            reducer: Mutex::new(RowReducer::new(header, halvings)),
            levels: RwLock::new(levels),
            image_rows: AtomicU32::new(0),
            rows: AtomicU32::new(0),
        })
    }

    /// How often an image must be halved to take at most so many bytes.
    pub fn halvings_to_fit(header: &ImageHeader, bytes: u64) -> u32 {
        least_halvings(|halvings| MemoryImage::bytes_at(header, halvings) <= bytes)
    }

    /// How often an image must be halved to have at most `side` texels along each axis.
    pub fn halvings_to_side(header: &ImageHeader, side: u32) -> u32 {
        least_halvings(|halvings| halved(header, halvings).into_iter().all(|texels| texels <= side))
    }

    /// Bytes of an image in memory that is halved so many times, its coarser levels included.
    pub fn bytes_at(header: &ImageHeader, halvings: u32) -> u64 {
        let texels: u64 =
            halved(header, halvings.min(MemoryImage::MOST_HALVINGS)).map(u64::from).iter().product();
        // A texel has at most 16 bytes.
        let finest = u128::from(texels) * layer_format(header).texel_bytes() as u128;
        u64::try_from(finest + finest / 3).unwrap_or(u64::MAX)
    }

    /// Adds the next rows of the image, as its reader gives them out. Rows beyond the image's last, and an
    /// incomplete row at the end, are ignored.
    pub fn push(&self, rows: &[u8]) {
        let mut reducer = self.reducer.lock().unwrap_or_else(PoisonError::into_inner);
        for row in rows.chunks_exact(reducer.row_bytes()) {
            if let Some(row) = reducer.next(row) {
                let mut levels = self.levels.write().unwrap_or_else(PoisonError::into_inner);
                levels.push(row);
                self.rows.store(levels.rows(), Ordering::Release);
            }
        }
        self.image_rows.store(reducer.taken(), Ordering::Release);
    }

    /// Rows of the image that were added.
    pub fn image_rows(&self) -> u32 {
        self.image_rows.load(Ordering::Acquire)
    }

    /// Rows of level 0 that are there.
    pub fn rows(&self) -> u32 {
        self.rows.load(Ordering::Acquire)
    }

    /// Returns true if all rows of the image are there.
    pub fn is_whole(&self) -> bool {
        self.rows() == self.description.geometry.size()[1]
    }

    /// How often the image is halved.
    pub fn halvings(&self) -> u32 {
        self.halvings
    }

    /// Columns and rows of the image, of which level 0 may have fewer.
    pub fn image_size(&self) -> [u32; 2] {
        self.image_size
    }

    /// Copies a box of a level into a tile, whose rows begin `stride` bytes apart.
    fn fill(&self, levels: &Levels, level: u8, level_box: Box3, tile: &mut [u8], stride: usize) {
        let geometry = &self.description.geometry;
        let ([x, y, _], [columns, rows, _]) = (level_box.origin, level_box.size);
        let [width, height, _] = geometry.level(level).size;
        let [across, down, _] = geometry.address();
        let runs = fold_runs(across, width, x, columns);
        for (target, y) in tile.chunks_mut(stride).zip(y..).take(rows as usize) {
            let Some(row) = levels.row_or_last(level, fold(down, y, height)) else { continue };
            let mut to = 0;
            for run in &runs {
                let len = run.len as usize * self.texel;
                // Its edges have no colour of their own.
                if let Some(first) = run.first {
                    let from = first as usize * self.texel;
                    target[to..to + len].copy_from_slice(&row[from..from + len]);
                }
                to += len;
            }
        }
    }
}

/// Columns and rows of an image that is halved so many times.
fn halved(header: &ImageHeader, halvings: u32) -> [u32; 2] {
    [header.width, header.height].map(|side| side.div_ceil(1 << halvings))
}

fn least_halvings(will_do: impl Fn(u32) -> bool) -> u32 {
    let most = MemoryImage::MOST_HALVINGS;
    (0..most).find(|&halvings| will_do(halvings)).unwrap_or(most)
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
