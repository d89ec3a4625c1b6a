//! One build: images opened as layers, read and filtered in step, and cut into tiles on their way to a
//! container.

mod attend;
pub(crate) mod error;
pub(crate) mod finer;
mod fingerprint;
mod layer_rows;
pub(crate) mod layers;
pub(crate) mod leftovers;
mod memory;
pub(crate) mod options;
pub(crate) mod pipeline;
pub(crate) mod place;
pub(crate) mod report;
mod sparse;

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use vastex_tiles::{Left, Origin, PartWriter, ResumableWriter};

pub use error::BuildError;
pub use options::{BuildOptions, Inset, NodataRule, ParseNodataRuleError};
pub use report::{BuildReport, LayerReport};

use crate::image::open_with_files_while;
use crate::progress::Progress;
use crate::texels::LayerInput;
use crate::threads;
use crate::tile::TileEncoder;
use finer::{Finer, finer, without_blocks};
pub(crate) use layers::{OpenLayer, fingerprint as fingerprint_of};
use memory::{fit_memory, keep_freed_memory};
use pipeline::{Buffers, Done, Job, Sink, Stopped};
use sparse::Selection;

/// Opens the images, if there may be an output: at least one, and no file that is read lies there.
pub(crate) fn open(
    inputs: Vec<LayerInput>,
    output: &Path,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<Vec<OpenLayer>, BuildError> {
    if inputs.is_empty() {
        return Err(BuildError::NoInput);
    }
    if let Some(mask) = &options.mask {
        let opened = open_with_files_while(mask, &|| progress.opening());
        let opened = opened.map_err(|fault| BuildError::input(mask, fault))?;
        place::check(&opened.files, output)?;
    }
    layers::open_all(inputs, output, options, progress)
}

/// What a container is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// To be what was asked for.
    Whole,
    /// To be changed, and then to be made whole: with so many levels more, which are empty, and no layer
    /// compressed in blocks.
    UnderInsets { finer_levels: u8 },
}

/// Makes a container of the layers.
pub(crate) fn run(
    layers: &mut [OpenLayer],
    output: &Path,
    options: &BuildOptions,
    stage: Stage,
    progress: &dyn Progress,
) -> Result<BuildReport, BuildError> {
    if stage == Stage::Whole {
        leftovers::refuse(output, options.resume)?;
    }
    let mut description = layers::describe(layers, options)?;
    let plans: Result<Vec<_>, _> =
        layers.iter().map(|layer| layer.plan(&description.geometry, options)).collect();
    let plans = plans?;
    let pool = if options.gives_way { threads::pool_that_gives_way } else { threads::pool };
    let pool = Arc::new(pool(options.threads)?);
    let finer_levels = match stage {
        Stage::Whole => 0,
        Stage::UnderInsets { finer_levels } => {
            description = without_blocks(&description);
            finer_levels
        }
    };
    let texture = finer(&description, finer_levels)?;
    let run = match options.part {
        Some(part) => part.run(description.geometry.page_count()),
        None => 0..description.geometry.page_count(),
    };
    let encoder = TileEncoder::new(description.into(), options.compression, options.quality);
    let geometry = &encoder.description().geometry;
    let mut job = Job {
        plans: &plans,
        encoder: &encoder,
        pool: &pool,
        buffers: Buffers::default(),
        ahead_bytes: std::array::from_fn(|pieces| {
            layers::memory_ahead(layers, pieces * pool.current_num_threads())
        }),
    };
    let memory = fit_memory(layers, &mut job, texture.geometry.page_count(), options.memory_limit)?;
    let selection = sparse::select(layers, &plans, geometry, options, progress)?;
    for layer in layers.iter() {
        let notices = layer.reader.header().notices_of_layer();
        notices.iter().for_each(|notice| progress.note(&layer.path, notice));
    }
    let filters: Vec<String> = plans.iter().map(|plan| plan.filter.to_string()).collect();
    let writer_options = options.writer_options(filters, layers::about(layers, geometry.size()));
    let rows = u64::from(geometry.size()[1]);
    let mut go_on = |bytes| progress.advance(0, rows, bytes);
    let left = if options.resume { Left::Resumed(&mut go_on) } else { Left::Removed };
    let same = layers::fingerprint(layers, options, progress)?;
    keep_freed_memory();
    let built = match options.part {
        None => {
            let origin = Origin { input: same.input.as_bytes(), options: &options.named() };
            let writer = ResumableWriter::create(output, texture, writer_options, origin, left)?;
            leftovers::remove(output);
            let resumed = writer.taken_over();
            let sink = Finer { sink: writer, levels: finer_levels };
            Work { job: &job, run, memory, progress, resumed, selection }.run(layers, sink)
        }
        Some(part) => {
            let same = same.anywhere.as_bytes();
            let writer = PartWriter::create(output, texture, &writer_options, part, same, left)?;
            leftovers::remove(output);
            let resumed = writer.taken_over();
            Work { job: &job, run, memory, progress, resumed, selection }.run(layers, writer)
        }
    };
    let (mut built, findings) = (built?, encoder.into_findings());
    for (number, (layer, plan)) in layers.iter().zip(&plans).enumerate() {
        let mut report = layer.report(plan);
        report.notices.extend(findings.notices(number, plan.layer.format));
        built.layers.push(report);
    }
    Ok(built)
}

/// A build that is ready to begin.
struct Work<'a> {
    job: &'a Job<'a>,
    /// The pages of the file to be made, by their place in the order of writing.
    run: Range<u64>,
    memory: u64,
    progress: &'a dyn Progress,
    /// How many of its tiles are taken over.
    resumed: u64,
    selection: Selection,
}

impl Work<'_> {
    /// What is said of the layers is left to others.
    fn run(self, layers: &mut [OpenLayer], sink: impl Sink) -> Result<BuildReport, BuildError> {
        let tiles = self.run.start + self.resumed..self.run.end;
        let Done { sink, bytes, row_bytes_held } = self
            .job
            .run(layers, tiles, self.selection, sink, self.progress)
            .map_err(|stopped| match stopped {
                Stopped::Input { path, fault } => BuildError::Input { path, fault },
                Stopped::Output(error) => BuildError::Output(error),
                Stopped::Cancelled => BuildError::Cancelled,
            })?;
        let geometry = &self.job.encoder.description().geometry;
        let [width, height, _] = geometry.size();
        if self.progress.advance(height.into(), height.into(), bytes).is_break() {
            return Err(BuildError::Cancelled);
        }
        let written = sink.finish()?;
        Ok(BuildReport {
            size: [width, height],
            levels: geometry.levels().len() as u32,
            layers: Vec::new(),
            texels: u64::from(width) * u64::from(height),
            tiles: written.tiles,
            constant_tiles: written.constant_tiles,
            shared_tiles: written.shared_tiles,
            absent_tiles: (self.run.end - self.run.start).saturating_sub(written.tiles),
            resumed_tiles: self.resumed,
            bytes: written.bytes,
            row_bytes_held,
            memory: self.memory,
            insets: Vec::new(),
        })
    }
}
