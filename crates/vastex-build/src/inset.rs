//! Images that are finer than the texture in which they lie: a city in full detail on a coarse world.
//!
//! The texture gets as many levels more as the finest inset needs, and pages on them only where insets are. It is built
//! without insets into a file beside the output, each inset is put into that as [`crate::replace()`] does, from its own level on,
//! and what they superseded is left behind when the file is copied to its place.

use std::ffi::OsString;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vastex_core::{Description, Geometry, GeometrySpec, PagePos};
use vastex_tiles::{
    ContainerUpdate, ContainerWriter, EncodedTile, ReorderError, WriteError, Written, reorder,
};

use crate::error::BuildError;
use crate::layers::{self, OpenLayer};
use crate::pipeline::Sink;
use crate::readers::open;
use crate::replace::{self, Placed, ReplaceError, ReplaceOptions, Rules};
use crate::{BuildOptions, BuildReport, Progress, make, place};

/// An image that lies over a texture, and is as fine as it or finer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Inset {
    /// The image.
    pub image: PathBuf,
    /// Column and row of its upper left texel, counted in its own texels from the upper left of the texture.
    pub at: [u32; 2],
    /// How many levels it is finer than the texture's own image: 0 for as fine as that, 1 for twice as fine.
    pub finer: u8,
}

/// Makes a container with the insets that the options ask for; there is at least one. Finer ones lie over coarser ones, later
/// ones over earlier ones.
pub(crate) fn build(
    mut layers: Vec<OpenLayer>,
    output: &Path,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<BuildReport, BuildError> {
    if options.part.is_some() || options.resume {
        return Err(BuildError::InsetsApart);
    }
    let finest = finest(&options.insets);
    let texture = Arc::new(finer(&layers::describe(&layers, options)?, finest)?);
    let filters = filters(&layers, options)?;
    let insets = check(&options.insets, &texture, &filters, output, options)?;
    // Whoever works for hours should know first whether there can be an output.
    drop(ContainerWriter::create(output, (*texture).clone(), options.writer_options(filters))?);

    let unfinished = Unfinished::beside(output);
    let image_rows = u64::from(texture.geometry.level(finest).size[1]);
    let rows = image_rows + insets.iter().map(|inset| inset.rows).sum::<u64>();
    let mut stage = Stage { progress, rows_before: 0, rows, bytes_before: 0 };
    let mut built = make(&mut layers, &unfinished.0, options, finest, &stage)?;
    stage.end(image_rows, built.bytes);
    for Checked { placed, rows, texels, memory } in insets {
        let put = || {
            let update = ContainerUpdate::open(&unfinished.0, false)?;
            replace::put(update, placed, options.compression, &replace_options(options), &stage)
        };
        let updated = put().map_err(|error| inset_error(placed, error))?;
        built.texels += texels;
        built.memory = built.memory.max(memory);
        stage.end(rows, updated.bytes_added);
    }
    let written = put_in_place(&unfinished.0, output, options.durable, &stage)?;
    Ok(report(built, &texture, &written))
}

/// The same texture with so many levels more, all finer.
pub(crate) fn finer(description: &Description, levels: u8) -> Result<Description, BuildError> {
    let geometry = &description.geometry;
    let size = geometry.size();
    let larger = |texels: u32| u32::try_from(u64::from(texels) << levels.min(32)).ok();
    let (Some(width), Some(height)) = (larger(size[0]), larger(size[1])) else {
        return Err(BuildError::InsetTooFine { levels, size: [size[0], size[1]] });
    };
    let spec = GeometrySpec { size: [width, height, size[2]], ..*geometry.spec() };
    let finer = Description { geometry: Geometry::new(spec)?, ..description.clone() };
    // A texture so small that its tail has room for more levels has nothing to put into that room.
    match finer.geometry.tail().first_level() == geometry.tail().first_level() + levels {
        true => Ok(finer),
        false => Err(BuildError::InsetInTail { levels, size: [size[0], size[1]] }),
    }
}

/// Takes the tiles of a texture as those of one that has so many levels more.
pub(crate) struct Finer<S> {
    pub(crate) sink: S,
    pub(crate) levels: u8,
}

impl<S> Finer<S> {
    fn pos(&self, pos: PagePos) -> PagePos {
        PagePos { level: pos.level + self.levels, ..pos }
    }
}

impl<S: Sink> Sink for Finer<S> {
    fn append(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError> {
        self.sink.append(self.pos(pos), tile)
    }

    fn skip(&mut self, pos: PagePos) -> Result<(), WriteError> {
        self.sink.skip(self.pos(pos))
    }

    fn finish(self) -> Result<Written, WriteError> {
        self.sink.finish()
    }
}

/// An inset that suits its texture.
struct Checked<'a> {
    placed: Placed<'a>,
    rows: u64,
    texels: u64,
    /// Bytes of memory that it takes.
    memory: u64,
}

/// The insets in the order in which they are put into the texture, if they suit it. Nothing has been built yet.
fn check<'a>(
    insets: &'a [Inset],
    texture: &Arc<Description>,
    filters: &[String],
    output: &Path,
    options: &BuildOptions,
) -> Result<Vec<Checked<'a>>, BuildError> {
    let rules = Rules::new(texture, filters).map_err(BuildError::InsetTexture)?;
    let finest = finest(insets);
    let check = |inset: &'a Inset| {
        let failed = |fault| BuildError::Input { path: inset.image.clone(), fault };
        let reader = rules.colors_of(open(&inset.image).map_err(failed)?);
        let header = reader.header();
        place::check(&inset.image, header.tile_directory.as_deref(), output)?;
        let placed = Placed { image: &inset.image, level: finest - inset.finer, at: inset.at };
        let suits = rules.suits(&placed, header).and_then(|(_, region)| {
            rules.check_memory(&placed, header, &region, true, &replace_options(options))
        });
        let memory = suits.map_err(|error| inset_error(placed, error))?;
        let rows = u64::from(header.height);
        Ok::<_, BuildError>(Checked { placed, rows, texels: rows * u64::from(header.width), memory })
    };
    let mut checked = insets.iter().map(check).collect::<Result<Vec<_>, _>>()?;
    checked.sort_by_key(|inset| std::cmp::Reverse(inset.placed.level));
    Ok(checked)
}

/// Levels by which the finest inset is finer than the texture's own image.
fn finest(insets: &[Inset]) -> u8 {
    insets.iter().map(|inset| inset.finer).max().unwrap_or(0)
}

fn inset_error(placed: Placed<'_>, error: ReplaceError) -> BuildError {
    match error {
        ReplaceError::Image { path, fault } => BuildError::Input { path, fault },
        ReplaceError::Outside { path, at, size, texture } => {
            BuildError::InsetOutside { path, at, size, level: placed.level, texture }
        }
        ReplaceError::Threads(error) => error,
        ReplaceError::Cancelled => BuildError::Cancelled,
        error => BuildError::Inset(Box::new(error)),
    }
}

/// Names of the filters of the layers, as a container keeps them.
fn filters(layers: &[OpenLayer], options: &BuildOptions) -> Result<Vec<String>, BuildError> {
    layers.iter().map(|layer| Ok(layer.filter(options)?.to_string())).collect()
}

fn replace_options(options: &BuildOptions) -> ReplaceOptions {
    ReplaceOptions { threads: options.threads, durable: false, memory_limit: options.memory_limit }
}

/// Copies what belongs to the last version of the file, along the curve, to where it is asked for.
fn put_in_place(
    unfinished: &Path,
    output: &Path,
    durable: bool,
    stage: &Stage<'_>,
) -> Result<Written, BuildError> {
    reorder(unfinished, output, durable, |_, _| stage.advance(0, 0, 0)).map_err(|error| match error {
        ReorderError::Cancelled => BuildError::Cancelled,
        ReorderError::Output(error) => error.into(),
        error => BuildError::Reorder(error),
    })
}

/// `built` is what was said of the texture without its insets.
fn report(built: BuildReport, texture: &Description, written: &Written) -> BuildReport {
    let [width, height, _] = texture.geometry.size();
    BuildReport {
        size: [width, height],
        levels: texture.geometry.levels().len() as u32,
        tiles: written.tiles,
        constant_tiles: written.constant_tiles,
        shared_tiles: written.shared_tiles,
        absent_tiles: texture.geometry.page_count().saturating_sub(written.tiles),
        bytes: written.bytes,
        ..built
    }
}

/// One step of several, for whoever watches.
struct Stage<'a> {
    progress: &'a dyn Progress,
    /// Rows and bytes of the steps that are done.
    rows_before: u64,
    bytes_before: u64,
    /// Of all steps.
    rows: u64,
}

impl Stage<'_> {
    /// The next step begins.
    fn end(&mut self, rows: u64, bytes: u64) {
        self.rows_before += rows;
        self.bytes_before += bytes;
    }
}

impl Progress for Stage<'_> {
    fn advance(&self, rows_done: u64, _: u64, bytes_written: u64) -> ControlFlow<()> {
        self.progress.advance(self.rows_before + rows_done, self.rows, self.bytes_before + bytes_written)
    }
}

/// A container that is not yet what was asked for; removed when dropped.
struct Unfinished(PathBuf);

impl Unfinished {
    fn beside(output: &Path) -> Unfinished {
        let mut name = OsString::from(".");
        name.push(output.file_name().unwrap_or_default());
        name.push(format!(".{}.insets", std::process::id()));
        Unfinished(output.with_file_name(name))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        // Where it was never made there is nothing to remove.
        let _ = std::fs::remove_file(&self.0);
    }
}
