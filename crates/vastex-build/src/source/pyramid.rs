//! TIFF pyramids as sources of tiles: any page of any level, straight from the file's own tiles.
//!
//! Vastex's levels halve. One that the file has not, as where each is a quarter of the one before, is
//! filtered from the next finer one whenever a page of it is asked for, if that is at most [`MOST_REDUCED`]
//! levels away, and else interpolated from the next coarser one. Levels that are coarser than the file's
//! coarsest are made at opening.

mod facts;

use std::path::Path;
use std::sync::Arc;

use vastex_core::{AddressMode, Description, LayerFormat, PagePos};
use vastex_tiles::{ReadFuture, ReadLimit, SourceKey, Tiers, Tile, TileSource};

use super::cells::{self, Cells};
use super::identity::identity_of_file;
use super::kept::Kept;
use super::pages::{OpeningWatch, Pages, Shape, unwatched};
use super::{SourceError, read_error};
use crate::image::tiff::file::TiffImage;
use crate::image::tiff::file::pyramid::{TiffOther, TiffPyramid};
use crate::image::{InputFault, Notice, PixelFormat, TiffAbout};
use crate::texels::missing::Missing;
pub use facts::{TiffFacts, TiffLevel};

/// Levels by which one that is missing may be coarser than what it is filtered from, whenever a page of it is
/// asked for: a page reads 4^3 as many texels.
const MOST_REDUCED: u32 = 3;
/// Bytes of a strip or tile, decoded, of which some are kept.
const MOST_CHUNK_BYTES: u64 = 64 << 20;
/// Texels of the coarsest level that are read at opening to make coarser ones.
const MOST_COARSEST_TEXELS: u64 = 1 << 26;

/// The tiles of a TIFF file, as pages of 128 or 256 texels: a Cloud Optimized GeoTIFF, an OME-TIFF, a pyramid
/// of libvips or maketx, an SVS file of Aperio, or any tiled TIFF that is small enough to go without levels.
///
/// Level 0 is the file's first image. Values are those that `vastex build` stores of it, but colours stay as
/// they are stored where the file has a colour profile. A tile that cannot be decoded is an error of the
/// pages that need it, and is tried again when they are asked for again. Any number of threads read and
/// decode at once. Holds up to 64 MiB of decoded tiles, or four tiles, and, in full, the levels that are
/// coarser than the file's.
pub struct TiffSource {
    identity: Option<SourceKey>,
    pages: Pages<Levels>,
    facts: TiffFacts,
}

impl TiffSource {
    /// Opens a file, or another image of it by its name ([`TiffOther::name`]), as in `slide.svs:label`. Reads
    /// its directories and, if they do not go down to one texel, its coarsest level.
    pub fn open(path: impl AsRef<Path>) -> Result<TiffSource, SourceError> {
        TiffSource::open_as(path.as_ref(), &Shape::default())
    }

    /// Opens it with pages of another shape.
    pub(crate) fn open_as(path: &Path, shape: &Shape) -> Result<TiffSource, SourceError> {
        let at_path = |fault| SourceError::Input { path: path.into(), fault };
        // Of the file that is opened, whatever takes its place later.
        let identity = identity_of_file(path).ok();
        let found = TiffPyramid::open(path).map_err(at_path)?.ok_or(InputFault::NoTiles).map_err(at_path)?;
        TiffSource::of(found, (path, identity), (shape, &unwatched))
    }

    /// The tiles of images that were found in the file at a path, which `identity` names, as long as nobody
    /// breaks that off.
    pub(super) fn of(
        found: TiffPyramid,
        (path, identity): (&Path, Option<SourceKey>),
        (shape, watch): (&Shape, OpeningWatch<'_>),
    ) -> Result<TiffSource, SourceError> {
        let (levels, header, facts) = TiffFacts::of(found, path, shape)?;
        levels.check_coarsest().map_err(|fault| SourceError::Input { path: path.into(), fault })?;
        let pages = Pages::new(levels, &header, false, (shape, watch)).map_err(|error| error.at(path))?;
        Ok(TiffSource { identity, pages, facts })
    }

    /// What the file has to show, and says of that.
    pub fn facts(&self) -> &TiffFacts {
        &self.facts
    }

    /// What is worth knowing of the file.
    pub fn notices(&self) -> &[Notice] {
        self.facts.notices()
    }

    /// Has told what numbers lose on their way into the layer of pages ([`Notice::HalfsRounded`] and
    /// [`Notice::HalfsInfinite`]), once each: what was found already at once, the rest by whichever thread
    /// reads the tile in which it is found. Only the first call counts.
    pub fn tell_losses(&self, tell: impl Fn(Notice) + Send + Sync + 'static) {
        self.pages.tell_losses(Box::new(tell));
    }

    /// What the texels that were read so far lost in a layer of a format.
    pub(crate) fn losses(&self, format: LayerFormat) -> Vec<Notice> {
        self.pages.losses(format)
    }

    /// The levels that the file stores, the finest first.
    pub fn levels(&self) -> &[TiffLevel] {
        self.facts.levels()
    }

    /// Images of the file that are no levels: thumbnails, labels, masks, further pages.
    pub fn others(&self) -> &[TiffOther] {
        self.facts.others()
    }

    /// What the file says of the size and place of its texels.
    pub fn about(&self) -> &TiffAbout {
        self.facts.about()
    }
}

fn image_bytes(image: &TiffImage) -> u64 {
    let texels = u64::from(image.size[0]) * u64::from(image.size[1]);
    texels.saturating_mul(image.texel_bytes() as u64)
}

/// Refuses an image whose pages would each need much more of the file than they show.
fn check_image(image: &TiffImage) -> Result<(), InputFault> {
    if !image.is_tiled && image_bytes(image) > MOST_CHUNK_BYTES {
        let [width, height] = image.size;
        return Err(InputFault::Unsupported {
            what: format!("{width}x{height} texels in strips and no tiles"),
            remedy: "make a container of it with `vastex build FILE -o FILE.vastex`",
        });
    }
    image.check_chunk(MOST_CHUNK_BYTES, "make a container of it with `vastex build FILE -o FILE.vastex`")
}

#[deny(clippy::missing_trait_methods)]
impl TileSource for TiffSource {
    fn behind(&self) -> Option<&dyn TileSource> {
        None
    }

    fn description(&self) -> &Arc<Description> {
        &self.pages.description
    }

    fn present(&self) -> Option<&Arc<vastex_core::PageSet>> {
        None
    }

    /// Nothing: which tiles are the same is only known when they have been read.
    fn contents(&self) -> Option<&Arc<vastex_core::PageContents>> {
        None
    }

    /// Goes by the file's name, size and time when it was opened. `None` if they could not be looked up.
    fn identity(&self) -> Option<SourceKey> {
        self.identity
    }

    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        None
    }

    fn blocks(&self) -> bool {
        false
    }

    fn add_tiers(&self, tiers: &mut Tiers) {
        tiers.store += self.pages.cells.reads();
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move { self.pages.tile(pos, read_error) })
    }

    /// Nothing: what is kept are the file's tiles, and a page is put together of several.
    fn at_hand(&self, _: PagePos) -> Option<Tile> {
        None
    }

    /// Tiles are read again, wherever the region lies. Where they lie in the file stays as it was when that
    /// was opened, and so do the levels that it lacks.
    fn changed(&self, _: &vastex_core::Region) {
        self.pages.cells.kept.forget();
    }
}

/// The levels that the file has, or that are made of its next ones.
pub(super) struct Levels {
    /// By how many times level 0 was halved; the first and the last are there.
    levels: Vec<Option<TiffImage>>,
    format: PixelFormat,
    missing: Option<Missing>,
    kept: Kept<[u32; 3], Vec<u8>>,
}

impl Levels {
    pub(super) fn new(
        mut levels: Vec<Option<TiffImage>>,
        format: PixelFormat,
        missing: Option<Missing>,
    ) -> Levels {
        while levels.last().is_some_and(Option::is_none) {
            levels.pop();
        }
        let texels = |image: &TiffImage| u64::from(image.chunk[0]) * u64::from(image.chunk[1]);
        let most = levels.iter().flatten().map(texels).max().unwrap_or(1);
        let kept = Kept::new(most.saturating_mul(format.texel_bytes() as u64));
        Levels { levels, format, missing, kept }
    }

    fn stored(&self, level: u32) -> Option<&TiffImage> {
        self.levels.get(level as usize)?.as_ref()
    }

    fn first(&self) -> Option<&TiffImage> {
        self.stored(0)
    }

    fn reads(&self) -> vastex_tiles::StoreStats {
        self.first().map(|image| image.file().reads()).unwrap_or_default()
    }

    /// Levels from one that is missing to the next finer one that is there.
    fn above_finer(&self, level: u32) -> u32 {
        (0..=level).rev().position(|finer| self.stored(finer).is_some()).unwrap_or(0) as u32
    }

    /// Refuses a file whose coarsest level is so large that reading it would keep everybody waiting.
    fn check_coarsest(&self) -> Result<(), InputFault> {
        let Some(Some(coarsest)) = self.levels.last() else { return Err(InputFault::NoTiles) };
        let [width, height] = coarsest.size;
        if u64::from(width) * u64::from(height) > MOST_COARSEST_TEXELS {
            return Err(InputFault::Unsupported {
                what: format!("no level that is coarser than {width}x{height} texels"),
                remedy: "add levels (`gdaladdo FILE`), or make a container of it with `vastex build FILE -o FILE.vastex`",
            });
        }
        Ok(())
    }
}

impl Cells for Levels {
    fn format(&self) -> PixelFormat {
        self.format
    }

    fn missing(&self) -> Option<Missing> {
        self.missing
    }

    fn levels(&self) -> u32 {
        self.levels.len() as u32
    }

    fn size(&self, level: u32) -> [u32; 2] {
        let halved = || self.first().map_or([1; 2], |first| first.size.map(|n| n.div_ceil(1 << level)));
        self.stored(level).map_or_else(halved, |image| image.size)
    }

    fn cell(&self, level: u32) -> [u32; 2] {
        self.stored(level).map_or([256; 2], |image| image.chunk)
    }

    fn is_reduced(&self, level: u32) -> bool {
        self.stored(level).is_none() && self.above_finer(level) <= MOST_REDUCED
    }

    fn copy(
        &self,
        level: u32,
        first: [u32; 2],
        size: [u32; 2],
        target: &mut [u8],
        stride: usize,
        address: [AddressMode; 2],
    ) -> Result<(), InputFault> {
        let Some(image) = self.stored(level) else {
            let coarser = (level..self.levels()).position(|coarser| self.stored(coarser).is_some());
            let shift = coarser.ok_or(InputFault::NoTiles)? as u32;
            let rectangle = cells::Rectangle { first, size };
            return cells::interpolated(self, address, level, shift, rectangle, target, stride);
        };
        let [column, row] = [0, 1].map(|axis| first[axis] / image.chunk[axis]);
        let texels =
            self.kept.load(&[level, column, row], || image.chunk_texels(column, row, self.format))?;
        let texel = self.format.texel_bytes();
        let [left, top] = [0, 1].map(|axis| (first[axis] % image.chunk[axis]) as usize);
        let row_bytes = image.chunk[0] as usize * texel;
        for (y, to) in target.chunks_mut(stride).take(size[1] as usize).enumerate() {
            let from = (top + y) * row_bytes + left * texel;
            let to = &mut to[..size[0] as usize * texel];
            to.copy_from_slice(&texels[from..from + to.len()]);
        }
        Ok(())
    }
}
