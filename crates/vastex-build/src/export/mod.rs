//! From a texture to the tile directories of other programs.
//!
//! [`export`] reads every level as the texture holds it, in rows of pages, and cuts it anew: nothing is
//! filtered or compressed twice, but where a layout's grid cannot hold the texture's size. Each layout has a
//! module that turns the texture's shape into a [`plan::Plan`]; how rows come about is [`level_rows`]' and
//! [`resample`]'s business, files are [`encode`]'s and [`crate::new_directory`]'s.

mod deep_zoom;
mod encode;
mod level_rows;
mod plan;
mod planet;
mod prototype;
mod resample;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use rayon::ThreadPool;
use vastex_core::{Geometry, PageSet};
use vastex_tiles::TileSource;

use crate::image::Notice;
use crate::new_directory::{DirectoryFault, NewDirectory};
use crate::progress::Progress;
use crate::threads::{self, ThreadsError};
use crate::tile::{LayerFault, LayerOf};
use encode::Encoder;
use level_rows::{Window, Work};
use plan::{LevelPlan, Plan};

/// Tiles of a row that are written before anybody is asked whether to go on.
const AT_ONCE: usize = 64;

/// Whose tile directory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Gaia Sky's tree of planet tiles; a `.ctx` file beside it makes it Celestia's too, where that reads
    /// such tiles.
    GaiaSky,
    /// Celestia's virtual texture; Gaia Sky reads it too, where it reads tiles of such a size.
    Celestia,
    /// Deep Zoom: a `.dzi` file and its tiles.
    DeepZoom,
    /// Full pages of 512 texels with borders of 2.
    Prototype,
}

/// The image format of tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileFormat {
    /// Exact.
    Png,
    /// Small; colour or grey of 8 bits.
    Jpeg,
}

/// How a texture is exported. What is `None` follows the layout.
#[derive(Clone, Debug)]
pub struct ExportOptions {
    /// Whose directory is made.
    pub layout: Layout,
    /// By default JPEG where the texels can be that, PNG for the rest and for the prototype. Floats can be
    /// neither.
    pub format: Option<TileFormat>,
    /// Quality of JPEG, 1 to 100. From 90 on, colour is kept at full resolution.
    pub quality: u8,
    /// Texels per side of a tile, without the overlap of Deep Zoom and the prototype. Planet tiles are a
    /// power of two.
    pub tile_size: Option<u32>,
    /// Texels that tiles share with their neighbours: any number for Deep Zoom, 1 for Gaia Sky's bordered
    /// tiles.
    pub overlap: Option<u32>,
    /// Number of the tree's finest level, for planets.
    pub finest_level: Option<u32>,
    /// For a part of a planet: the column and row of its first tile in the finest level, which must be given
    /// then.
    pub first_tile: Option<[u32; 2]>,
    /// Name of the layer; the first by default.
    pub layer: Option<String>,
    /// Threads that read, filter and encode; 0 for as many as there are cores.
    pub threads: usize,
}

impl ExportOptions {
    /// What suits most.
    pub fn new(layout: Layout) -> ExportOptions {
        ExportOptions {
            layout,
            format: None,
            quality: 90,
            tile_size: None,
            overlap: None,
            finest_level: None,
            first_tile: None,
            layer: None,
            threads: 0,
        }
    }
}

/// What was exported.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportReport {
    /// Texels of the finest level.
    pub size: [u32; 2],
    /// Levels that have tiles.
    pub levels: u32,
    /// Tiles of all levels.
    pub tiles: u64,
    /// Bytes of all tiles.
    pub bytes: u64,
    /// Format of the tiles.
    pub format: TileFormat,
    /// What else there is to know.
    pub notices: Vec<Notice>,
}

/// Why nothing was exported. Nothing is left behind.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// Options that the layout or the texture does not go with.
    #[error("{0}")]
    Options(String),
    /// The texture is of a kind that no layout holds.
    #[error("the levels of this texture do not halve, as those of images do; only images can be exported")]
    NoImage,
    /// The directory cannot be made.
    #[error("{path}: {why}", path = path.display())]
    Target {
        /// The directory.
        path: PathBuf,
        /// What is wrong and what to do.
        why: String,
    },
    /// A tile of the texture cannot be read or decoded.
    #[error(transparent)]
    Tile(#[from] LayerFault),
    /// A file cannot be written.
    #[error("{path}: cannot be written: {why}", path = path.display())]
    Output {
        /// The file.
        path: PathBuf,
        /// What the system or the encoder said, and what to do.
        why: String,
    },
    /// The threads cannot be started.
    #[error(transparent)]
    Threads(#[from] ThreadsError),
    /// [`Progress`] asked to stop.
    #[error("cancelled")]
    Cancelled,
}

impl From<DirectoryFault> for ExportError {
    fn from(fault: DirectoryFault) -> ExportError {
        match fault {
            DirectoryFault::Target(path, why) => ExportError::Target { path, why },
            DirectoryFault::Output(path, why) => ExportError::Output { path, why },
        }
    }
}

/// Writes a texture into a new directory at `target`, which appears when it is whole.
///
/// `target` may exist, if it is empty. Memory follows the width of the texture: a row of pages and a row of
/// tiles.
pub fn export(
    source: &dyn TileSource,
    target: &Path,
    options: &ExportOptions,
    progress: &dyn Progress,
) -> Result<ExportReport, ExportError> {
    let description = source.description();
    let layer = LayerOf::new(description, options.layer.as_deref()).map_err(ExportError::Options)?;
    let format = tile_format(options, &layer)?;
    let name = name_of(target)?;
    let plan = plan(layer.geometry(), options, format, name)?;
    let pool = threads::pool(options.threads)?;
    let directory = NewDirectory::create(target, |_| false)?;
    let encoder = Encoder { format, layer: layer.format(), quality: options.quality.clamp(1, 100) };
    let present = source.present().map(|present| (layer.geometry(), &**present));
    let tiles = Tiles { encoder, directory: &directory, present };
    let written = write_levels(&plan, &tiles, &pool, progress, |level| level.window(source, &layer))?;
    for (path, text) in &plan.texts {
        directory.write(path, text.as_bytes())?;
    }
    directory.put_in_place()?;
    let mut notices = plan.notices;
    notices.extend(written.dropped_alpha.then_some(Notice::AlphaDropped));
    let (tiles, bytes) = (written.tiles, written.bytes);
    Ok(ExportReport { size: plan.size, levels: plan.levels.len() as u32, tiles, bytes, format, notices })
}

fn plan(
    geometry: &Geometry,
    options: &ExportOptions,
    format: TileFormat,
    name: &str,
) -> Result<Plan, ExportError> {
    let halves = geometry.levels().iter().skip(1).all(|level| level.factor == [2, 2, 1]);
    if !halves {
        return Err(ExportError::NoImage);
    }
    let is_planet = matches!(options.layout, Layout::GaiaSky | Layout::Celestia);
    if !is_planet && (options.finest_level.is_some() || options.first_tile.is_some()) {
        return refuse(
            "a finest level and a first column and row are those of planets; leave them out, or choose gaiasky or celestia",
        );
    }
    match options.layout {
        Layout::GaiaSky | Layout::Celestia => planet::plan(geometry, options, format, name),
        Layout::DeepZoom => deep_zoom::plan(geometry, options, format, name),
        Layout::Prototype => prototype::plan(geometry, options),
    }
}

/// The image format of tiles; refused where none can hold the layer's texels.
fn tile_format(options: &ExportOptions, layer: &LayerOf) -> Result<TileFormat, ExportError> {
    let (name, decoded) = (layer.stored_format().name(), layer.format());
    if !encode::fits_png(decoded) {
        return refuse(&format!(
            "texels of {name} are floats, which no image format of tiles holds; export another layer, or one that was built \
             with 16 bits (r16 or rgba16)"
        ));
    }
    let fits_jpeg = encode::fits_jpeg(decoded);
    match (options.layout, options.format) {
        (Layout::Prototype, Some(TileFormat::Jpeg)) => {
            refuse("the prototype's pages are PNG; leave out the format, or choose another layout")
        }
        (Layout::Prototype, _) | (_, Some(TileFormat::Png)) => Ok(TileFormat::Png),
        (_, Some(TileFormat::Jpeg)) if !fits_jpeg => {
            refuse(&format!("JPEG cannot hold texels of {name}; choose PNG"))
        }
        (_, Some(TileFormat::Jpeg)) => Ok(TileFormat::Jpeg),
        (_, None) => Ok(if fits_jpeg { TileFormat::Jpeg } else { TileFormat::Png }),
    }
}

/// What to call the texture in the files that describe it: the directory's name.
fn name_of(target: &Path) -> Result<&str, ExportError> {
    let refused = |why: &str| ExportError::Target { path: target.into(), why: why.into() };
    let name = target.file_name().ok_or_else(|| refused("this names no directory; add a name"))?;
    let name = name
        .to_str()
        .ok_or_else(|| refused("the name is no UTF-8, but it goes into text files; choose another"))?;
    match name.contains(['"', '<', '>', '&', '\\']) || name.chars().any(char::is_control) {
        true => {
            Err(refused("the name holds quotes or brackets, but it goes into text files; choose another"))
        }
        false => Ok(name),
    }
}

fn refuse<T>(why: &str) -> Result<T, ExportError> {
    Err(ExportError::Options(why.into()))
}

/// What the tiles written so far come to.
#[derive(Clone, Copy, Debug, Default)]
struct Written {
    tiles: u64,
    bytes: u64,
    /// Rows of texels of all levels.
    rows: u64,
    dropped_alpha: bool,
}

/// Writes every level, the order of the plan's; `progress` is asked on this thread.
fn write_levels<'a>(
    plan: &Plan,
    tiles: &Tiles<'_>,
    pool: &ThreadPool,
    progress: &dyn Progress,
    window_of: impl Fn(&LevelPlan) -> Window<'a>,
) -> Result<Written, ExportError> {
    let total = plan.levels.iter().map(|level| level.rows.len() as u64 * u64::from(level.step)).sum();
    let mut written = Written::default();
    for level in &plan.levels {
        tiles.directory.make(&level.directory)?;
        let mut window = window_of(level);
        for row in level.rows.clone() {
            let before = written;
            let go_on = || match progress.advance(before.rows, total, before.bytes) {
                ControlFlow::Break(()) => Err(ExportError::Cancelled),
                ControlFlow::Continue(()) => Ok(()),
            };
            let work = Work { pool, go_on: &go_on };
            window.hold(level.texel_rows(row), &work)?;
            for (bytes, dropped_alpha) in tiles.write_row(level, row, &window, &work)? {
                written.tiles += 1;
                written.bytes += bytes;
                written.dropped_alpha |= dropped_alpha;
            }
            written.rows += u64::from(level.step);
        }
    }
    match progress.advance(total, total, written.bytes) {
        ControlFlow::Break(()) => Err(ExportError::Cancelled),
        ControlFlow::Continue(()) => Ok(written),
    }
}

/// Where tiles go, and how.
struct Tiles<'a> {
    encoder: Encoder,
    directory: &'a NewDirectory,
    /// The pages of the texture that have tiles; `None` if all have.
    present: Option<(&'a Geometry, &'a PageSet)>,
}

impl Tiles<'_> {
    /// Writes a row of tiles; says of each its bytes, and whether transparency was left out.
    fn write_row(
        &self,
        level: &LevelPlan,
        row: u32,
        window: &Window<'_>,
        work: &Work<'_>,
    ) -> Result<Vec<(u64, bool)>, ExportError> {
        let write = |column: u32| -> Result<_, ExportError> {
            let rectangle = level.rectangle(column, row);
            let texels = window.cut(rectangle, level.wraps);
            let path = level.directory.join(level.name(column, row, self.encoder.extension()));
            let (bytes, dropped_alpha) = self
                .encoder
                .encode(&texels, rectangle.size)
                .map_err(|why| ExportError::Output { path: self.directory.path(&path), why })?;
            self.directory.write(&path, &bytes)?;
            Ok((bytes.len() as u64, dropped_alpha))
        };
        let has_texels = |&column: &u32| {
            let own = |(geometry, present)| level.has_texels(column, row, geometry, present);
            !level.may_lack_tiles || self.present.is_none_or(own)
        };
        let mut written = Vec::with_capacity(level.columns.len());
        for first in level.columns.clone().step_by(AT_ONCE) {
            (work.go_on)()?;
            let columns = first..level.columns.end.min(first + AT_ONCE as u32);
            let tiles = || threads::try_map(columns.filter(has_texels), write);
            written.extend(work.pool.install(tiles)?);
        }
        Ok(written)
    }
}
