//! Tile directories of other programs, read as the image that their finest level is.
//!
//! [`open_directory`] and [`open_description`] find out by content which layout they have been given; each
//! layout has a module, which turns it into a [`Grid`] of cells on each level. [`DirectoryReader`] puts
//! together one row of cells of the finest level at a time, so memory follows the width of the image; with
//! help it decodes some files ahead. All levels, page by page, are read by [`crate::source`].

mod celestia;
mod deep_zoom;
mod gaia_sky;
pub(crate) mod guess;
pub(crate) mod prototype;
mod quadtree;
pub(crate) mod tile;

use std::io::Read;
use std::path::{Path, PathBuf};

use vastex_core::{Geometry, PageSet};

use crate::image::ahead::Ahead;
use crate::image::file::open_file;
use crate::image::{Helpers, ImageHeader, InputFault, Notice, PixelFormat, Profile, RowReader};
use tile::{Decoded, Piece};
pub(crate) use tile::{common, in_tile, widen};

/// Bytes that a file which describes a directory may have.
const MAX_TEXT: u64 = 1 << 20;

/// The levels of a directory as grids of cells, of which the last of a row or column may be smaller. Level 0
/// is the finest; each further one has half as many texels, rounded up.
pub(crate) trait Grid: Send + Sync {
    /// Texels of the image.
    fn size(&self) -> [u64; 2];

    /// Texels per side of a cell, on every level.
    fn cell(&self) -> u32;

    /// Levels that the directory has, at least 1.
    fn levels(&self) -> u32;

    /// The pages of a texture of that shape for which there are tiles; `None` if there are for all.
    fn present(&self, geometry: &Geometry) -> Option<PageSet> {
        let _ = geometry;
        None
    }

    /// Where a cell's texels are: in a tile of its own, or in an ancestor's. The cell exists.
    fn piece(&self, level: u32, column: u32, row: u32) -> Piece;
}

/// A directory that was looked at.
pub(crate) struct Source {
    pub(crate) grid: Box<dyn Grid>,
    /// Where its tiles are.
    pub(crate) directory: PathBuf,
    pub(crate) texels: Texels,
    pub(crate) wraps: bool,
    pub(crate) notices: Vec<Notice>,
}

/// What the tiles of a directory have in common, as a sample of them shows.
pub(crate) struct Texels {
    /// Into which all go.
    pub(crate) format: PixelFormat,
    /// True if the colours of the first are linear.
    pub(crate) linear: bool,
    /// What the first says of its colours besides.
    pub(crate) profile: Option<Profile>,
    /// Bytes that decoding a tile takes.
    memory: u64,
}

/// The finest level of a tile directory.
struct DirectoryReader {
    header: ImageHeader,
    grid: Box<dyn Grid>,
    /// One row of cells, once the first is asked for.
    band: Vec<u8>,
    next_row: u32,
    /// The newest file; cells that follow one another may come from one coarse tile.
    decoded: Decoded,
    ahead: Ahead<Result<Decoded, InputFault>>,
    /// Cells whose files somebody was asked for, row by row, and the file of the last of them.
    asked: u64,
    asked_path: PathBuf,
    /// True if the files may be damaged.
    tolerates: bool,
}

/// Opens a directory by what is in it.
pub(super) fn open_directory(path: &Path) -> Result<Box<dyn RowReader>, InputFault> {
    reader(look_at_directory(path)?)
}

/// Opens the directory that a text file describes; `None` if the text is something else.
pub(super) fn open_description(path: &Path) -> Result<Option<Box<dyn RowReader>>, InputFault> {
    look_at_description(path)?.map(reader).transpose()
}

pub(crate) fn look_at_directory(path: &Path) -> Result<Source, InputFault> {
    let (manifest, pages) = (deep_zoom::find(path)?, prototype::find(path)?);
    let gaia_sky = gaia_sky::is_here(path)?;
    let kinds = [
        (manifest.is_some(), "a Deep Zoom image"),
        (pages.is_some(), "the prototype's pages"),
        (gaia_sky, "Gaia Sky's tiles"),
    ];
    let found: Vec<_> = kinds.iter().filter(|(is_here, _)| *is_here).map(|(_, what)| *what).collect();
    if found.len() > 1 {
        return Err(InputFault::Layout {
            why: format!("is a directory with {}", found.join(" and with ")),
            remedy: "name the .dzi file, or move one of them elsewhere",
        });
    }
    if let Some(manifest) = manifest {
        return look_at_found(&manifest);
    }
    if let Some(pages) = pages {
        return prototype::open(&pages);
    }
    if gaia_sky {
        return gaia_sky::open(path);
    }
    let contexts = entries(path)?.into_iter().filter(|path| path.extension().is_some_and(|e| e == "ctx"));
    match contexts.collect::<Vec<_>>().as_slice() {
        [] => Err(InputFault::Directory),
        [one] => look_at_found(one),
        [..] => Err(InputFault::Layout {
            why: "is a directory of several .ctx files".into(),
            remedy: "name one of them",
        }),
    }
}

/// The file beside a directory of tiles that is read with them, if its layout has one; it may not be there.
pub(super) fn size_file(directory: &Path) -> Option<PathBuf> {
    let pages = prototype::find(directory).ok()??;
    Some(prototype::size_file(&pages))
}

/// Looks at what a text file that was found in a directory describes; a fault names it, or the tile that has
/// it.
fn look_at_found(path: &Path) -> Result<Source, InputFault> {
    let found = look_at_description(path).and_then(|found| found.ok_or(InputFault::Text));
    found.map_err(|fault| match fault {
        InputFault::Tile { .. } => fault,
        fault => tile::in_tile(path, fault),
    })
}

pub(crate) fn look_at_description(path: &Path) -> Result<Option<Source>, InputFault> {
    if std::fs::metadata(path)?.len() > MAX_TEXT {
        return Ok(None);
    }
    let text = read_text(path, MAX_TEXT)?;
    if deep_zoom::is_manifest(&text) {
        deep_zoom::open(path, &text).map(Some)
    } else if celestia::is_context(&text) {
        celestia::open(path, &text).map(Some)
    } else {
        Ok(None)
    }
}

fn reader(source: Source) -> Result<Box<dyn RowReader>, InputFault> {
    let [width, height] = source.grid.size();
    let mut header = ImageHeader::new(width, height, source.texels.format)?;
    header.linear = source.texels.linear;
    header.profile = source.texels.profile;
    header.wraps = source.wraps;
    header.tile_directory = Some(source.directory);
    let band = u64::from(source.grid.cell().min(header.height)).saturating_mul(header.row_bytes() as u64);
    header.memory = band.saturating_add(source.texels.memory);
    header.notices.extend(source.notices);
    let cells = [header.width, header.height].map(|n| u64::from(n.div_ceil(source.grid.cell())));
    let ahead = Ahead::new(cells[0] * cells[1], source.texels.memory);
    Ok(Box::new(DirectoryReader {
        header,
        grid: source.grid,
        band: Vec::new(),
        next_row: 0,
        decoded: Decoded::default(),
        ahead,
        asked: 0,
        asked_path: PathBuf::new(),
        tolerates: false,
    }))
}

impl DirectoryReader {
    /// Puts together the row of cells that begins at the next row.
    fn load_band(&mut self) -> Result<(), InputFault> {
        let (cell, stride) = (self.grid.cell(), self.header.row_bytes());
        let texel_bytes = self.header.format.texel_bytes();
        let row = self.next_row / cell;
        let rows = cell.min(self.header.height - self.next_row);
        self.band.resize(rows as usize * stride, 0);
        for column in 0..self.header.width.div_ceil(cell) {
            let piece = self.grid.piece(0, column, row);
            if !self.decoded.is_of(&piece) {
                self.ask();
                let format = self.header.format;
                let next = self.ahead.next();
                self.decoded = next.unwrap_or_else(|| Decoded::of(&piece, format, self.tolerates))?;
            }
            let width = cell.min(self.header.width - column * cell);
            let start = column as usize * cell as usize * texel_bytes;
            self.decoded.copy(&mut self.band[start..], stride, [width, rows], &piece, texel_bytes);
        }
        Ok(())
    }

    /// Gives files to whoever decodes them, as many as there is room for.
    fn ask(&mut self) {
        let cell = self.grid.cell();
        let [columns, rows] = [self.header.width, self.header.height].map(|n| u64::from(n.div_ceil(cell)));
        while self.ahead.has_room() && self.asked < columns * rows {
            let piece = self.grid.piece(0, (self.asked % columns) as u32, (self.asked / columns) as u32);
            self.asked += 1;
            if piece.path != self.asked_path {
                self.asked_path.clone_from(&piece.path);
                let (format, tolerates) = (self.header.format, self.tolerates);
                self.ahead.push(move || Decoded::of(&piece, format, tolerates));
            }
        }
    }
}

impl RowReader for DirectoryReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn present(&self, geometry: &Geometry) -> Option<PageSet> {
        self.grid.present(geometry)
    }

    fn tolerate(&mut self) {
        self.tolerates = true;
    }

    fn memory_ahead(&self, pieces: usize) -> u64 {
        self.ahead.memory(pieces)
    }

    fn take_help(&mut self, helpers: &Helpers) {
        self.ahead.take_help(helpers);
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let row_bytes = self.header.row_bytes();
        for target in rows.chunks_exact_mut(row_bytes) {
            let in_band = self.next_row % self.grid.cell();
            if in_band == 0 {
                self.load_band()?;
            }
            target.copy_from_slice(&self.band[in_band as usize * row_bytes..][..row_bytes]);
            self.next_row += 1;
        }
        Ok(())
    }
}

/// The paths in a directory, sorted, so that what is said does not depend on the file system.
fn entries(directory: &Path) -> Result<Vec<PathBuf>, InputFault> {
    let list = || -> std::io::Result<Vec<PathBuf>> {
        std::fs::read_dir(directory)?.map(|entry| Ok(entry?.path())).collect()
    };
    let mut paths = list().map_err(|error| tile::in_tile(directory, error.into()))?;
    paths.sort();
    Ok(paths)
}

/// At most `limit` bytes of a text; bytes that are no UTF-8 are replaced.
fn read_text(path: &Path, limit: u64) -> Result<String, InputFault> {
    let mut bytes = Vec::new();
    open_file(path)?.take(limit).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// A number in a name, written in digits only. One that is too large becomes the largest, which lies outside
/// every grid, so that it is refused and not passed over.
fn number(digits: &str) -> Option<u32> {
    let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    is_number.then(|| digits.parse().unwrap_or(u32::MAX))
}

/// What the tiles of a sample have in common.
fn shared_texels<'a>(sample: impl IntoIterator<Item = &'a Path>) -> Result<Texels, InputFault> {
    let mut shared: Option<Texels> = None;
    for path in sample {
        let header = tile::header_of(path)?;
        let memory = header.memory.saturating_add(header.image_bytes().saturating_mul(3));
        let ImageHeader { format, linear, profile, .. } = header;
        let texels = shared.get_or_insert(Texels { format, linear, profile, memory: 0 });
        texels.memory = texels.memory.max(memory);
        texels.format = tile::common(texels.format, format).ok_or_else(|| {
            let why = format!("holds {format} texels while other tiles store theirs differently");
            tile::in_tile(path, InputFault::layout(why, "convert all tiles to one kind"))
        })?;
    }
    shared.ok_or(InputFault::Directory)
}
