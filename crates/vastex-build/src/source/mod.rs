//! Tile directories as sources of tiles: any page of any level, straight from the directory's own files.
//!
//! Pages and cells need not have the same size: a page is put together from the cells that it overlaps, its
//! borders from those that lie around it. Where a level has no tile of its own, its ancestor's texels are
//! interpolated; levels that are coarser than the directory's coarsest are filtered when it is opened. What a
//! directory is, its layout's module says; which files are kept decoded, [`kept`].

mod identity;
mod interpolate;
mod kept;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use vastex_core::{
    AddressMode, Box3, Description, Dims, Geometry, GeometryError, GeometrySpec, PagePos, fold,
};
use vastex_tiles::{Codec, ReadError, ReadFuture, ReadLimit, SourceKey, Tiers, Tile, TileSource};

use crate::image::grids::{Grid, Source, look_at_description, look_at_directory};
use crate::image::{ImageHeader, InputFault, Notice, PixelFormat, Profile};
use crate::texels::convert::{Conversion, layer_format};
use crate::texels::filter::{Filter, LayerFilter};
use identity::identity;
use kept::KeptTiles;

/// Texels of border of the pages.
const BORDER: u32 = 4;
/// Bytes that the levels which a directory lacks may take.
const MAX_MADE_BYTES: u64 = 256 << 20;

/// The tiles of a directory of Gaia Sky, Celestia, Deep Zoom or the prototype, as pages of 128 or 256 texels.
///
/// A file that cannot be read is an error of the pages that need it, and is tried again when they are asked
/// for again. Holds up to 64 MiB of decoded files and, in full, the levels that are coarser than the
/// directory's.
pub struct DirectorySource {
    description: Arc<Description>,
    /// Where the tiles are.
    directory: PathBuf,
    levels: Levels,
    /// The levels that the directory lacks, finest first, as texels of the layer.
    made: Vec<Vec<u8>>,
    notices: Vec<Notice>,
}

/// Why a tile directory cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The directory, or a file in it, cannot be read.
    #[error("{path}: {fault}", path = path.display())]
    Input {
        /// The directory, or the file that describes it.
        path: PathBuf,
        /// What is wrong with it.
        #[source]
        fault: InputFault,
    },
    /// Its levels have an impossible size.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
}

impl DirectorySource {
    /// Opens a directory, or the `.dzi` or `.ctx` file that describes one. Reads headers and lists of files
    /// and, where the directory does not go down to one texel, its coarsest level.
    pub fn open(path: impl AsRef<Path>) -> Result<DirectorySource, SourceError> {
        let path = path.as_ref();
        let at_path = |fault| SourceError::Input { path: path.into(), fault };
        let source = look(path).map_err(at_path)?;
        let [width, height] = source.grid.size();
        let mut header = ImageHeader::new(width, height, source.texels.format).map_err(at_path)?;
        header.linear = source.texels.linear;
        let mut notices = source.notices;
        let left = |profile: &Profile| profile.left(header.format, "tiles are shown as they are stored");
        notices.extend(source.texels.profile.as_ref().and_then(left));
        let x = if source.wraps { AddressMode::Wrap } else { AddressMode::Clamp };
        let geometry = Geometry::new(GeometrySpec {
            dims: Dims::D2,
            page: if source.grid.cell() < 256 { 128 } else { 256 },
            border: BORDER,
            address: [x, AddressMode::Clamp, AddressMode::Clamp],
            ..GeometrySpec::image(header.width, header.height)
        })?;
        let description = Description::one_layer(geometry, layer_format(&header));
        let conversion = Conversion::usual(&header);
        let kept = KeptTiles::new(source.grid.cell(), header.format);
        let levels = Levels {
            grid: source.grid,
            format: header.format,
            conversion,
            address: [x, AddressMode::Clamp],
            kept,
        };
        let made = made_levels(&levels, &description).map_err(at_path)?;
        let (description, directory) = (Arc::new(description), source.directory);
        Ok(DirectorySource { description, directory, levels, made, notices })
    }

    /// What is worth knowing of the directory.
    pub fn notices(&self) -> &[Notice] {
        &self.notices
    }

    fn tile(&self, pos: PagePos) -> Result<Tile, ReadError> {
        let geometry = &self.description.geometry;
        if !geometry.contains(pos) {
            return Err(ReadError::NoSuchTile { pos });
        }
        let mut tile = vec![0; self.description.tile_bytes()];
        for (level, level_box, offset) in geometry.tile_boxes(pos) {
            self.fill(level, level_box, offset, &mut tile).map_err(|fault| read_error(pos, &fault))?;
        }
        Ok(Tile { codec: Codec::Raw, bytes: tile.into() })
    }

    /// Writes the texels of `level_box` into a tile, from `offset` on.
    fn fill(&self, level: u8, level_box: Box3, offset: [u32; 3], tile: &mut [u8]) -> Result<(), InputFault> {
        let texel = self.description.tile_bytes() / self.description.geometry.tile_texels() as usize;
        let side = self.description.geometry.tile()[0] as usize;
        let ([x, y, _], [width, height, _]) = (level_box.origin, level_box.size);
        let start = (offset[1] as usize * side + offset[0] as usize) * texel;
        let rows = tile[start..].chunks_mut(side * texel).map(|row| &mut row[..width as usize * texel]);
        let Some(made) = usize::from(level).checked_sub(self.levels.grid.levels() as usize) else {
            let image = self.levels.texels(level.into(), [x, y], [width, height])?;
            let image_row = width as usize * self.levels.format.texel_bytes();
            for (row, image) in rows.zip(image.chunks_exact(image_row)) {
                self.levels.conversion.row(row, image);
            }
            return Ok(());
        };
        let size = self.description.geometry.level(level).size;
        for (row, y) in rows.zip(y..y + i64::from(height)) {
            let from = fold(self.levels.address[1], y, size[1]) as usize * size[0] as usize;
            for (to, x) in row.chunks_exact_mut(texel).zip(x..) {
                let at = (from + fold(self.levels.address[0], x, size[0]) as usize) * texel;
                to.copy_from_slice(&self.made[made][at..at + texel]);
            }
        }
        Ok(())
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

fn read_error(pos: PagePos, fault: &InputFault) -> ReadError {
    let (place, fault) = match fault {
        InputFault::Tile { path, fault } => (path.display().to_string(), &**fault),
        fault => (String::new(), fault),
    };
    match fault {
        InputFault::Io(_) => ReadError::Store { pos, place, error: fault.to_string() },
        fault => ReadError::Damaged { pos, place, fault: fault.to_string() },
    }
}

#[deny(clippy::missing_trait_methods)]
impl TileSource for DirectorySource {
    fn behind(&self) -> Option<&dyn TileSource> {
        None
    }

    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn present(&self) -> Option<&Arc<vastex_core::PageSet>> {
        None
    }

    /// Nothing: which files are the same is only known when they have been read.
    fn contents(&self) -> Option<&Arc<vastex_core::PageContents>> {
        None
    }

    /// Goes by the names, sizes and times of all files, which are looked up at every call. Nothing where one
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
        tiers.store += self.levels.kept.reads();
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move { self.tile(pos) })
    }

    /// Nothing: what is kept are files, and a tile is put together of several.
    fn at_hand(&self, _: PagePos) -> Option<Tile> {
        None
    }

    /// Files are read again, wherever the region lies. The levels that the directory lacks stay as they were
    /// made when it was opened.
    fn changed(&self, _: &vastex_core::Region) {
        self.levels.kept.forget();
    }
}

/// The levels that the directory has.
struct Levels {
    grid: Box<dyn Grid>,
    format: PixelFormat,
    conversion: Conversion,
    address: [AddressMode; 2],
    kept: KeptTiles,
}

/// Texels side by side in a level, within one cell, that lie side by side in what is put together, too.
struct Run {
    from: u32,
    to: u32,
    len: u32,
}

impl Levels {
    fn size(&self, level: u32) -> [u32; 2] {
        self.grid.size().map(|n| n.div_ceil(1 << level) as u32)
    }

    /// A rectangle of a level, which may reach beyond its edges: rows of texels without padding.
    fn texels(&self, level: u32, origin: [i64; 2], size: [u32; 2]) -> Result<Vec<u8>, InputFault> {
        let texel = self.format.texel_bytes();
        let stride = size[0] as usize * texel;
        let mut texels = vec![0; stride * size[1] as usize];
        let columns = self.runs(level, 0, origin[0], size[0]);
        for y in self.runs(level, 1, origin[1], size[1]) {
            for x in &columns {
                let target = &mut texels[y.to as usize * stride + x.to as usize * texel..];
                self.copy(level, [x.from, y.from], [x.len, y.len], target, stride)?;
            }
        }
        Ok(texels)
    }

    fn runs(&self, level: u32, axis: usize, origin: i64, len: u32) -> Vec<Run> {
        let (size, cell) = (self.size(level)[axis], self.grid.cell());
        let mut runs: Vec<Run> = Vec::new();
        for to in 0..len {
            let from = fold(self.address[axis], origin + i64::from(to), size);
            match runs.last_mut() {
                Some(run) if run.from + run.len == from && !from.is_multiple_of(cell) => run.len += 1,
                _ => runs.push(Run { from, to, len: 1 }),
            }
        }
        runs
    }

    /// Copies texels of one cell, from its own tile or from what its ancestor gives.
    fn copy(
        &self,
        level: u32,
        first: [u32; 2],
        size: [u32; 2],
        target: &mut [u8],
        stride: usize,
    ) -> Result<(), InputFault> {
        let cell = self.grid.cell();
        let mut piece = self.grid.piece(level, first[0] / cell, first[1] / cell);
        if piece.shift == 0 {
            piece.within = [0, 1].map(|axis| piece.within[axis] + u64::from(first[axis] % cell));
            let decoded = self.kept.load(&piece, self.format)?;
            decoded.copy(target, stride, size, &piece, self.format.texel_bytes());
            return Ok(());
        }
        let [x, y] = [0, 1].map(|axis| interpolate::Between::new(first[axis], size[axis], piece.shift));
        let coarse = self.texels(level + piece.shift, [x.origin(), y.origin()], [x.count(), y.count()])?;
        interpolate::fill(target, stride, self.format, &coarse, &x, &y);
        Ok(())
    }
}

/// The levels of the description that are coarser than the directory's, by the mean of 2x2 texels.
fn made_levels(levels: &Levels, description: &Description) -> Result<Vec<Vec<u8>>, InputFault> {
    let geometry = &description.geometry;
    let format = description.layers[0].format;
    let filter = Filter::new(LayerFilter::for_layer("color", format, true), format, 2);
    let texel = format.texel_bytes();
    let first = levels.grid.levels() as usize;
    let mut made: Vec<Vec<u8>> = Vec::new();
    for level in first..geometry.levels().len() {
        let ([width, height, _], finer) = (geometry.levels()[level].size, geometry.levels()[level - 1].size);
        let bytes = u64::from(width) * u64::from(height) * texel as u64;
        if bytes > MAX_MADE_BYTES {
            return Err(InputFault::Unsupported {
                what: format!("no level that is coarser than {}x{} texels", finer[0], finer[1]),
                remedy: "add coarser levels, or make a container of it with `vastex build`",
            });
        }
        let mut coarse = vec![0; bytes as usize];
        let columns = finer[0].next_multiple_of(2);
        // As many rows at a time as a row of cells has; two of them make one.
        let strip = (levels.grid.cell() / 2).clamp(1, height);
        for (top, rows) in
            (0..).step_by(strip as usize).zip(coarse.chunks_mut((strip * width) as usize * texel))
        {
            let count = 2 * (rows.len() / (width as usize * texel)) as u32;
            let fine = match made.last() {
                None => strip_of_directory(levels, level as u32 - 1, [2 * top, columns, count], texel)?,
                Some(last) => strip_of_made(last, levels.address, finer, [2 * top, columns, count], texel),
            };
            let row_bytes = columns as usize * texel;
            for (row, pair) in
                rows.chunks_exact_mut(width as usize * texel).zip(fine.chunks_exact(2 * row_bytes))
            {
                let (upper, lower) = pair.split_at(row_bytes);
                filter.row(row, &[upper, lower]);
            }
        }
        made.push(coarse);
    }
    Ok(made)
}

/// `count` rows of `columns` texels of the layer, from row `top` of a level of the directory on.
fn strip_of_directory(
    levels: &Levels,
    level: u32,
    [top, columns, count]: [u32; 3],
    texel: usize,
) -> Result<Vec<u8>, InputFault> {
    let image = levels.texels(level, [0, top.into()], [columns, count])?;
    let mut rows = vec![0; columns as usize * count as usize * texel];
    levels.conversion.row(&mut rows, &image);
    Ok(rows)
}

/// The same of a level that was made.
fn strip_of_made(
    made: &[u8],
    address: [AddressMode; 2],
    size: [u32; 3],
    [top, columns, count]: [u32; 3],
    texel: usize,
) -> Vec<u8> {
    let mut rows = Vec::with_capacity(columns as usize * count as usize * texel);
    for y in top..top + count {
        let row = fold(address[1], y.into(), size[1]) as usize * size[0] as usize;
        for x in 0..columns {
            let at = (row + fold(address[0], x.into(), size[0]) as usize) * texel;
            rows.extend_from_slice(&made[at..at + texel]);
        }
    }
    rows
}
