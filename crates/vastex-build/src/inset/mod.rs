//! Images that are finer than the texture in which they lie: a city in full detail on a coarse world.
//!
//! The texture gets as many levels more as the finest inset needs, and pages on them only where insets are.
//! It is built without insets into a file beside the output ([`unfinished`]), each inset is put into that as
//! [`crate::replace()`] does, from its own level on, and when all are in, the tiles are encoded on their way
//! to where they are asked for ([`encode`]). Until then no layer is compressed in blocks, so what comes out
//! is what a build of the whole picture gives there too.

mod encode;
mod unfinished;

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use vastex_core::Description;
use vastex_tiles::{Compression, Container, ContainerUpdate, ContainerWriter, Written};

use crate::build::finer::finer;
use crate::build::layers::{self, OpenLayer};
use crate::build::{self, BuildError, BuildOptions, BuildReport, Inset, Stage, place};
use crate::image::Notice;
use crate::progress::Progress;
use crate::replace::{self, OpenImage, Placed, ReplaceError, ReplaceOptions, Replaced, Rules};
use unfinished::Unfinished;

/// Makes a container with the insets that the options ask for; there is at least one. Finer ones lie over
/// coarser ones, later ones over earlier ones.
pub(crate) fn build(
    mut layers: Vec<OpenLayer>,
    output: &Path,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<BuildReport, BuildError> {
    if options.part.is_some() {
        return Err(BuildError::InsetsApart);
    }
    let finest = finest(&options.insets);
    let texture = Arc::new(finer(&layers::describe(&layers, options)?, finest)?);
    let filters = filters(&layers, options)?;
    let insets = check(&options.insets, (&texture, &filters), output, options, progress)?;
    // Whoever works for hours should know first whether there can be an output; and nobody else builds there
    // meanwhile.
    let about = layers::about(&layers, texture.geometry.size());
    let writer_options = options.writer_options(filters, about);
    let writer = ContainerWriter::claim(output, (*texture).clone(), writer_options, options.resume)?;
    let same = unfinished::fingerprint(&layers, &texture, options, progress)?;
    let mut unfinished = Unfinished::find(output, same, options.resume)?;

    let image_rows = u64::from(texture.geometry.level(finest).size[1]);
    let rows = image_rows + insets.iter().map(|inset| inset.rows).sum::<u64>();
    let mut steps = Steps { progress, rows_before: 0, rows, bytes_before: 0 };
    let mut built = ground(&mut layers, &mut unfinished, options, finest, &steps)?;
    steps.end(image_rows, built.bytes);
    for (number, Checked { placed, rows, texels, memory }) in insets.into_iter().enumerate() {
        built.texels += texels;
        built.memory = built.memory.max(memory);
        let is_in = number < unfinished.insets();
        let replaced = (!is_in).then(|| put(&mut unfinished, placed, options, &steps)).transpose()?;
        steps.end(rows, replaced.as_ref().map_or(0, |replaced| replaced.updated.bytes_added));
        built.insets.extend(replaced.into_iter().flat_map(|replaced| replaced.notices));
    }
    let (written, findings) = encode::encode(unfinished.path(), writer, &texture, options, &steps)?;
    for (number, layer) in built.layers.iter_mut().enumerate() {
        layer.notices.extend(findings.notices(number, layer.layer.format));
    }
    unfinished.remove();
    Ok(report(built, &texture, &written))
}

/// Makes the texture without its insets, unless an interrupted build had.
fn ground(
    layers: &mut [OpenLayer],
    unfinished: &mut Unfinished,
    options: &BuildOptions,
    finer_levels: u8,
    progress: &dyn Progress,
) -> Result<BuildReport, BuildError> {
    if !unfinished.is_built() {
        // Tiles are written once more, so they are compressed fast and lie close.
        let options =
            BuildOptions { compression: Compression::Lz4, align: 1, durable: false, ..options.clone() };
        let built =
            build::run(layers, unfinished.path(), &options, Stage::UnderInsets { finer_levels }, progress)?;
        unfinished.set_built();
        return Ok(built);
    }
    let description = layers::describe(layers, options)?;
    let found = Container::open_file(unfinished.path()).map_err(|error| BuildError::Reorder(error.into()))?;
    let of_layer = |layer: &OpenLayer| Ok(layer.report(&layer.plan(&description.geometry, options)?));
    let [width, height, _] = description.geometry.size();
    Ok(BuildReport {
        layers: layers.iter().map(of_layer).collect::<Result<_, BuildError>>()?,
        texels: u64::from(width) * u64::from(height),
        resumed_tiles: found.info().tiles,
        ..BuildReport::default()
    })
}

/// Puts an inset into what is built so far.
fn put(
    unfinished: &mut Unfinished,
    placed: Placed<'_>,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<Replaced, BuildError> {
    let put = || {
        let update = ContainerUpdate::open(unfinished.path(), false)?.without_waiting();
        replace::put(update, placed, Compression::Lz4, &replace_options(options), progress)
    };
    let replaced = put().map_err(|error| inset_error(placed, error))?;
    unfinished.count_inset()?;
    Ok(replaced)
}

/// An inset that suits its texture.
struct Checked<'a> {
    placed: Placed<'a>,
    rows: u64,
    texels: u64,
    /// Bytes of memory that it takes.
    memory: u64,
}

/// The insets in the order in which they are put into the texture, if they suit it. Nothing has been built
/// yet.
fn check<'a>(
    insets: &'a [Inset],
    (texture, filters): (&Arc<Description>, &[String]),
    output: &Path,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<Vec<Checked<'a>>, BuildError> {
    let rules = Rules::new(texture, filters).map_err(BuildError::InsetTexture)?;
    let finest = finest(insets);
    let check = |inset: &'a Inset| {
        let layer = layer_of(inset, texture)?;
        let placed = Placed { image: &inset.image, layer, level: finest - inset.finer, at: inset.at };
        let of_layer = rules.of_layer(placed.layer).map_err(BuildError::InsetTexture)?;
        let image = OpenImage::open(of_layer, placed, progress);
        let image = image.map_err(|error| inset_error(placed, error))?;
        let (rows, width) = (u64::from(image.header().height), u64::from(image.header().width));
        place::check(&image.files, output)?;
        let (memory, _) = rules
            .check_memory(&[image], true, &replace_options(options))
            .map_err(|error| inset_error(placed, error))?;
        Ok::<_, BuildError>(Checked { placed, rows, texels: rows * width, memory })
    };
    let mut checked = insets.iter().map(check).collect::<Result<Vec<_>, _>>()?;
    checked.sort_by_key(|inset| std::cmp::Reverse(inset.placed.level));
    Ok(checked)
}

/// The number of the layer into which an inset goes.
fn layer_of(inset: &Inset, texture: &Description) -> Result<usize, BuildError> {
    let named = |name: &String| texture.layers.iter().position(|layer| layer.name == *name);
    let found = match (&inset.layer, texture.layers.len()) {
        (None, 1) => Some(0),
        (name, _) => name.as_ref().and_then(named),
    };
    found.ok_or_else(|| {
        let names: Vec<&str> = texture.layers.iter().map(|layer| layer.name.as_str()).collect();
        BuildError::InsetLayer { path: inset.image.clone(), layers: names.join(", ") }
    })
}

/// Levels by which the finest inset is finer than the texture's own image.
fn finest(insets: &[Inset]) -> u8 {
    insets.iter().map(|inset| inset.finer).max().unwrap_or(0)
}

fn inset_error(placed: Placed<'_>, error: ReplaceError) -> BuildError {
    match error {
        ReplaceError::Image { path, fault } => BuildError::Input { path, fault },
        ReplaceError::Outside { path, at, size, texture, .. } => {
            BuildError::InsetOutside { path, at, size, level: placed.level, texture }
        }
        ReplaceError::Threads(error) => error.into(),
        ReplaceError::Cancelled => BuildError::Cancelled,
        error => BuildError::Inset(Box::new(error)),
    }
}

/// Names of the filters of the layers, as a container keeps them.
fn filters(layers: &[OpenLayer], options: &BuildOptions) -> Result<Vec<String>, BuildError> {
    layers.iter().map(|layer| Ok(layer.filter(options)?.to_string())).collect()
}

fn replace_options(options: &BuildOptions) -> ReplaceOptions {
    let BuildOptions { threads, quality, memory_limit, tolerant, .. } = *options;
    ReplaceOptions { threads, quality, durable: false, memory_limit, tolerant }
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
struct Steps<'a> {
    progress: &'a dyn Progress,
    /// Rows and bytes of the steps that are done.
    rows_before: u64,
    bytes_before: u64,
    /// Of all steps.
    rows: u64,
}

impl Steps<'_> {
    /// The next step begins.
    fn end(&mut self, rows: u64, bytes: u64) {
        self.rows_before += rows;
        self.bytes_before += bytes;
    }
}

impl Progress for Steps<'_> {
    fn advance(&self, rows_done: u64, _: u64, bytes_written: u64) -> ControlFlow<()> {
        self.progress.advance(self.rows_before + rows_done, self.rows, self.bytes_before + bytes_written)
    }

    fn opening(&self) -> ControlFlow<()> {
        self.progress.opening()
    }

    fn beginning(&self, share: f64) -> ControlFlow<()> {
        self.progress.beginning(share)
    }

    fn note(&self, image: &Path, notice: &Notice) {
        self.progress.note(image, notice);
    }
}
