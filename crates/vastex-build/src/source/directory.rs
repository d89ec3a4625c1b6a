//! Tile directories as sources of tiles: any page of any level, straight from the directory's own files.
//!
//! Where a level has no tile of its own, its ancestor's texels are interpolated.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vastex_core::{AddressMode, Description, LayerFormat, PagePos};
use vastex_tiles::{ReadFuture, ReadLimit, SourceKey, StoreCounter, Tiers, Tile, TileSource};

use super::cells::{self, Cells};
use super::identity::identity;
use super::kept::Kept;
use super::pages::{OpeningWatch, Pages, Shape, unwatched};
use super::{SourceError, read_error};
use crate::image::grids::guess::may_be_tiles;
use crate::image::grids::tile::Decoded;
use crate::image::grids::{Grid, Source, look_at_description, look_at_directory};
use crate::image::{ImageHeader, InputFault, Notice, PixelFormat, Profile};

/// The tiles of a directory of Gaia Sky, Celestia, Deep Zoom or the prototype, as pages of 128 or 256 texels.
///
/// A file that cannot be read is an error of the pages that need it, and is tried again when they are asked
/// for again. Holds up to 64 MiB of decoded files and, in full, the levels that are coarser than the
/// directory's.
pub struct DirectorySource {
    /// Where the tiles are.
    directory: PathBuf,
    pages: Pages<Levels>,
    notices: Vec<Notice>,
}

impl DirectorySource {
    /// Opens a directory, or the `.dzi` or `.ctx` file that describes one. Reads headers and lists of files
    /// and, where the directory does not go down to one texel, its coarsest level.
    pub fn open(path: impl AsRef<Path>) -> Result<DirectorySource, SourceError> {
        DirectorySource::open_while(path.as_ref(), &unwatched)
    }

    /// Opens it as [`DirectorySource::open`] does as long as `watch`, which hears how much of what is read
    /// for it is there, 0 to 1, does not break it off ([`SourceError::BrokenOff`]).
    pub fn open_while(
        path: &Path,
        watch: &dyn Fn(f64) -> ControlFlow<()>,
    ) -> Result<DirectorySource, SourceError> {
        DirectorySource::open_watched(path, &Shape::default(), watch)
    }

    /// Returns true if a directory looks like one that can be opened, by the names of its first entries: for
    /// a list of what there is to open. Takes a fraction of a millisecond, whatever is in it, and may be
    /// wrong.
    pub fn may_be_at(directory: impl AsRef<Path>) -> bool {
        may_be_tiles(directory.as_ref())
    }

    /// Opens it with pages of another shape.
    pub(crate) fn open_as(path: &Path, shape: &Shape) -> Result<DirectorySource, SourceError> {
        DirectorySource::open_watched(path, shape, &unwatched)
    }

    fn open_watched(
        path: &Path,
        shape: &Shape,
        watch: OpeningWatch<'_>,
    ) -> Result<DirectorySource, SourceError> {
        let at_path = |fault| SourceError::Input { path: path.into(), fault };
        let source = look(path).map_err(at_path)?;
        let [width, height] = source.grid.size();
        let mut header = ImageHeader::new(width, height, source.texels.format).map_err(at_path)?;
        header.linear = source.texels.linear;
        let mut notices = source.notices;
        let left = |profile: &Profile| profile.left(header.format, "tiles are shown as they are stored");
        notices.extend(source.texels.profile.as_ref().and_then(left));
        let cell = u64::from(source.grid.cell());
        let kept = Kept::new(cell * cell * header.format.texel_bytes() as u64);
        let format = header.format;
        let levels = Levels { grid: source.grid, format, kept, reads: StoreCounter::default() };
        let pages = Pages::new(levels, &header, source.wraps, (shape, watch));
        let pages = pages.map_err(|error| error.at(path))?;
        Ok(DirectorySource { directory: source.directory, pages, notices })
    }

    /// Levels that the directory has.
    pub(crate) fn level_count(&self) -> u32 {
        self.pages.cells.levels()
    }

    /// Columns and rows of one of them.
    pub(crate) fn level_size(&self, level: u32) -> [u32; 2] {
        self.pages.cells.size(level)
    }

    /// What the texels of its tiles are, as they are stored.
    pub(crate) fn pixel_format(&self) -> PixelFormat {
        self.pages.cells.format
    }

    /// Texels per side of a tile.
    pub(crate) fn cell(&self) -> u32 {
        self.pages.cells.grid.cell()
    }

    /// A rectangle of a level that the directory has, as its tiles store it: rows without padding.
    pub(crate) fn stored_texels(
        &self,
        level: u32,
        first: [u32; 2],
        size: [u32; 2],
    ) -> Result<Vec<u8>, InputFault> {
        let clamp = [AddressMode::Clamp; 2];
        cells::rectangle(&self.pages.cells, clamp, level, first.map(i64::from), size)
    }

    /// What is worth knowing of the directory.
    pub fn notices(&self) -> &[Notice] {
        &self.notices
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
}

fn look(path: &Path) -> Result<Source, InputFault> {
    let found = std::fs::metadata(path)?;
    if found.is_dir() {
        return look_at_directory(path);
    }
    if !found.is_file() {
        return Err(InputFault::NotAFile);
    }
    look_at_description(path)?.ok_or(InputFault::NoTiles)
}

#[deny(clippy::missing_trait_methods)]
impl TileSource for DirectorySource {
    fn behind(&self) -> Option<&dyn TileSource> {
        None
    }

    fn description(&self) -> &Arc<Description> {
        &self.pages.description
    }

    fn present(&self) -> Option<&Arc<vastex_core::PageSet>> {
        None
    }

    /// Nothing: which files are the same is only known when they have been read.
    fn contents(&self) -> Option<&Arc<vastex_core::PageContents>> {
        None
    }

    /// Goes by the names, sizes and times of all files, which are looked up at every call. `None` if one
    /// cannot be.
    fn identity(&self) -> Option<SourceKey> {
        identity(&self.directory).ok()
    }

    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        None
    }

    fn blocks(&self) -> bool {
        false
    }

    fn add_tiers(&self, tiers: &mut Tiers) {
        tiers.store += self.pages.cells.reads.stats();
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move { self.pages.tile(pos, read_error) })
    }

    /// Nothing: what is kept are files, and a tile is put together of several.
    fn at_hand(&self, _: PagePos) -> Option<Tile> {
        None
    }

    /// Files are read again, wherever the region lies. The levels that the directory lacks stay as they were
    /// made when it was opened.
    fn changed(&self, _: &vastex_core::Region) {
        self.pages.cells.kept.forget();
    }
}

/// The levels that the directory has.
struct Levels {
    grid: Box<dyn Grid>,
    format: PixelFormat,
    kept: Kept<PathBuf, Decoded>,
    reads: StoreCounter,
}

impl Cells for Levels {
    fn format(&self) -> PixelFormat {
        self.format
    }

    fn levels(&self) -> u32 {
        self.grid.levels()
    }

    fn size(&self, level: u32) -> [u32; 2] {
        self.grid.size().map(|n| n.div_ceil(1 << level) as u32)
    }

    fn cell(&self, _: u32) -> [u32; 2] {
        [self.grid.cell(); 2]
    }

    /// From the cell's own tile, or from what its ancestor gives.
    fn copy(
        &self,
        level: u32,
        first: [u32; 2],
        size: [u32; 2],
        target: &mut [u8],
        stride: usize,
        address: [AddressMode; 2],
    ) -> Result<(), InputFault> {
        let cell = self.grid.cell();
        let mut piece = self.grid.piece(level, first[0] / cell, first[1] / cell);
        if piece.shift > 0 {
            let rectangle = cells::Rectangle { first, size };
            return cells::interpolated(self, address, level, piece.shift, rectangle, target, stride);
        }
        piece.within = [0, 1].map(|axis| piece.within[axis] + u64::from(first[axis] % cell));
        let decoded = self.kept.load(&piece.path, || {
            let decoded = Decoded::of(&piece, self.format, false)?;
            self.reads.note(std::fs::metadata(&piece.path).map_or(0, |file| file.len()));
            Ok(decoded)
        })?;
        decoded.copy(target, stride, size, &piece, self.format.texel_bytes());
        Ok(())
    }
}
