//! The part of Vastex that prepares: from an image file to a `.vastex` container, in one pass over its rows.
//!
//! [`build`] reads images, raw files, mosaics and tile directories row by row, makes every level, cuts tiles with their borders and drives
//! the container's writer. Memory follows the width of the image, never its height; what a file makes
//! impossible to read by rows is reported as a [`Notice`]. The bytes written depend on the image and the options, and
//! not on the number of threads.
//!
//! [`replace`] puts an image into a region of a container that was built here, on all levels; an [`Inset`] is put so into levels
//! that exist where insets are.
//!
//! [`export`](fn@export) goes the other way: from a texture to the tile directories of other programs, which [`build`]
//! reads too.
//!
//! Not here: the container's bytes (`vastex-tiles`), the shape of levels, pages and borders (`vastex-core`).

mod bands;
mod blocks;
mod convert;
mod descent;
mod error;
mod export;
mod filter;
mod fingerprint;
mod inset;
mod layer_rows;
mod layers;
mod layout;
mod magnify;
#[cfg(all(feature = "bc", any(test, feature = "measure")))]
#[doc(hidden)]
pub mod measure;
mod notice;
mod pipeline;
mod place;
mod pyramid;
mod readers;
mod replace;
mod rows;
mod shared;
mod sparse;
mod srgb;
mod stack;
mod straight;
mod tail;
mod tent;
mod texel;

use std::ops::{ControlFlow, Range};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vastex_core::AddressMode;
use vastex_tiles::{Left, Origin, PartWriter, ResumableWriter, WriterOptions};

pub use blocks::Quality;
pub use error::{BuildError, InputFault};
pub use export::{ExportError, ExportOptions, ExportReport, Layout, TileFormat, export};
pub use filter::{FilterError, Kernel, LayerFilter, LevelsFrom, Meaning};
pub use inset::Inset;
pub use layers::{LayerInput, LayerReport};
pub use notice::Notice;
pub use readers::{
    DirectorySource, Helpers, ImageHeader, PixelFormat, Profile, RowReader, Sample, in_srgb, open,
};
pub use replace::{LayerImage, ReplaceError, ReplaceOptions, Replaced, replace};
pub use vastex_tiles::{
    Compression, MergeError, PartOf, ReorderError, UpdateError, Updated, WriteError, Written, merge, reorder,
};

use inset::Finer;
use layers::OpenLayer;
use pipeline::{Buffers, Done, Job, Sink, Stopped};
use sparse::Selection;

/// How a container is made.
#[derive(Clone, Debug)]
pub struct BuildOptions {
    /// Texels of payload per side of a page, 8 to 4096.
    pub page: u32,
    /// Texels of border on each side, 1 to half a page.
    pub border: u32,
    /// How tiles are compressed.
    pub compression: Compression,
    /// How well block-compressed layers are encoded.
    pub quality: Quality,
    /// Whether colour is filtered in linear light and weighted by alpha, where no filter says otherwise; else every channel
    /// as it is stored.
    pub linear: bool,
    /// How levels are made, of layers that do not say so themselves; nothing for what suits each layer's name and format
    /// ([`LayerFilter::for_layer`]).
    pub filter: Option<LayerFilter>,
    /// From which level each level is made, where no filter says otherwise.
    pub levels_from: LevelsFrom,
    /// What lies beyond the edges, in x and in y. Where this says clamp, the tiles of a planet wrap in x all the same.
    pub address: [AddressMode; 2],
    /// What lies beyond an edge of [`AddressMode::Border`]: red, green, blue, alpha, as a layer stores them.
    pub border_color: [u8; 4],
    /// An image of the texture's shape, of any size: where it is black or transparent, pages get no tile, and their nearest
    /// ancestors stand in for them. Nothing for tiles everywhere.
    pub mask: Option<PathBuf>,
    /// Whether pages that are transparent in all layers with alpha get no tile.
    pub drop_transparent: bool,
    /// Whether images whose compressed data are damaged or end early are taken for what can be made of them, with a notice;
    /// else they are errors. Only JPEG can be gone on with.
    pub tolerant: bool,
    /// Images that lie over those of the texture, as fine as they or finer. The texture has as many levels more as the finest of
    /// them needs; where no inset lies, pages of those have no tiles.
    pub insets: Vec<Inset>,
    /// Threads that filter and encode, and decode pieces of the images where they have nothing else to do, besides one that reads each
    /// layer and one that writes; 0 for as many as there are cores.
    pub threads: usize,
    /// Whether to wait at the end until the disk has everything.
    pub durable: bool,
    /// Every tile begins at a multiple of so many bytes, for direct I/O: 1 for no alignment, or a power of two from
    /// 4096 to 65,536.
    pub align: u32,
    /// Bytes of memory that a build may take: where it could take more its buffers become smaller, and where that is not
    /// enough the image is refused before anything is allocated.
    pub memory_limit: u64,
    /// Whether only a part of the container is made, which [`merge`] joins with the others to the very bytes of the whole.
    ///
    /// Every part reads the image up to its own last tile, and encodes and writes its own tiles only.
    pub part: Option<PartOf>,
    /// Whether to go on with what an interrupted build of the same image and options left beside the output, and to leave
    /// what is written there if this one is interrupted or fails. The bytes are those of one build.
    pub resume: bool,
}

impl Default for BuildOptions {
    fn default() -> BuildOptions {
        BuildOptions {
            page: 128,
            border: 4,
            compression: Compression::default(),
            quality: Quality::default(),
            linear: true,
            filter: None,
            levels_from: LevelsFrom::Chain,
            address: [AddressMode::Clamp; 2],
            border_color: [0; 4],
            mask: None,
            drop_transparent: false,
            tolerant: false,
            insets: Vec::new(),
            threads: 0,
            durable: false,
            align: 1,
            memory_limit: 16 << 30,
            part: None,
            resume: false,
        }
    }
}

impl BuildOptions {
    fn writer_options(&self, filters: Vec<String>) -> WriterOptions {
        WriterOptions { compression: self.compression, durable: self.durable, align: self.align, filters }
    }
}

/// Told how far a build is, and asked whether to go on. Called on the thread that called [`build`].
pub trait Progress {
    /// `rows_done` of `rows_total` rows are read and `bytes_written` bytes of tiles are written. `Break` cancels the
    /// build, which then leaves nothing behind, unless it can be resumed.
    fn advance(&self, rows_done: u64, rows_total: u64, bytes_written: u64) -> ControlFlow<()>;

    /// What is known of an image before its first row is read, such as what it costs; also among what the report says at the end.
    fn note(&self, image: &Path, notice: &Notice) {
        let _ = (image, notice);
    }
}

/// Nobody watches, nobody cancels.
impl Progress for () {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// What was built.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BuildReport {
    /// Size of level 0 in texels.
    pub size: [u32; 2],
    /// Levels, the tail's included.
    pub levels: u32,
    /// What was made of each image, in the order of the inputs.
    pub layers: Vec<LayerReport>,
    /// Texels that were read, the largest image's of all layers and the insets'.
    pub texels: u64,
    /// Tiles, the tail counted as one.
    pub tiles: u64,
    /// Tiles that are kept as their colour.
    pub constant_tiles: u64,
    /// Tiles whose bytes are those of an earlier one.
    pub shared_tiles: u64,
    /// Pages that have no tile.
    pub absent_tiles: u64,
    /// Tiles that an interrupted build had made.
    pub resumed_tiles: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Bytes of rows that were held at once.
    pub row_bytes_held: u64,
    /// Bytes of memory that the build could at most have taken, as estimated from the headers.
    pub memory: u64,
    /// What was left out of insets and what it cost, each with its image; not of those that an interrupted build had put in.
    pub insets: Vec<(PathBuf, Notice)>,
}

impl BuildReport {
    /// What was left out of the images, and what it cost.
    pub fn notices(&self) -> impl Iterator<Item = &Notice> {
        let of_insets = self.insets.iter().map(|(_, notice)| notice);
        self.layers.iter().flat_map(|layer| &layer.notices).chain(of_insets)
    }
}

/// Makes a container of the images in `inputs`: a path for the one layer `color`, or a [`LayerInput`] for each layer.
///
/// The largest image has the texture's size; every other has that too, or half or a quarter of it, rounded up, and is stored
/// at that share of the resolution. One of another size is resampled to the nearest of these, with a notice. The file appears at `output`, over what was there, when it is whole; after an error or a
/// cancellation nothing is left behind, unless [`BuildOptions::resume`] asks for it. Takes one pass over the images, in step
/// with one another, and memory as [`BuildReport::memory`] says.
pub fn build<I: Clone + Into<LayerInput>>(
    inputs: &[I],
    output: &Path,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<BuildReport, BuildError> {
    if inputs.is_empty() {
        return Err(BuildError::NoInput);
    }
    if let Some(mask) = &options.mask {
        let opened = readers::open_with_files(mask);
        let opened = opened.map_err(|fault| BuildError::Input { path: mask.clone(), fault })?;
        place::check(&opened.files, output)?;
    }
    let mut layers = layers::open_all(inputs.iter().cloned().map(Into::into).collect(), output, options)?;
    match options.insets.as_slice() {
        [] => {
            inset::refuse_left(output, options.resume)?;
            make(&mut layers, output, options, Stage::Whole, progress)
        }
        _ => inset::build(layers, output, options, progress),
    }
}

/// What a container is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// To be what was asked for.
    Whole,
    /// To be changed, and then to be made whole: with so many levels more, which are empty, and no layer compressed in blocks.
    UnderInsets { finer_levels: u8 },
}

/// Makes a container of the layers.
fn make(
    layers: &mut [OpenLayer],
    output: &Path,
    options: &BuildOptions,
    stage: Stage,
    progress: &dyn Progress,
) -> Result<BuildReport, BuildError> {
    let mut description = layers::describe(layers, options)?;
    let plans: Result<Vec<_>, _> =
        layers.iter().map(|layer| layer.plan(&description.geometry, options)).collect();
    let (mut plans, pool) = (plans?, Arc::new(thread_pool(options.threads)?));
    let finer_levels = match stage {
        Stage::Whole => 0,
        Stage::UnderInsets { finer_levels } => {
            plans.iter_mut().for_each(|plan| plan.in_blocks = false);
            description = inset::without_blocks(&description);
            finer_levels
        }
    };
    let texture = inset::finer(&description, finer_levels)?;
    let run = match options.part {
        Some(part) => part.run(description.geometry.page_count()),
        None => 0..description.geometry.page_count(),
    };
    let mut job = Job {
        description: &description,
        plans: &plans,
        compression: options.compression,
        tiles: run.clone(),
        pool: &pool,
        buffers: Buffers::default(),
        ahead_bytes: std::array::from_fn(|pieces| {
            layers::memory_ahead(layers, pieces * pool.current_num_threads())
        }),
    };
    let memory = fit_memory(layers, &mut job, texture.geometry.page_count(), options.memory_limit)?;
    let selection = sparse::select(layers, &plans, &description.geometry, options)?;
    for layer in layers.iter() {
        let notices = layers::notices_of(layer.reader.header());
        notices.iter().for_each(|notice| progress.note(&layer.path, notice));
    }
    let filters: Vec<String> = plans.iter().map(|plan| plan.filter.to_string()).collect();
    let writer_options = options.writer_options(filters);
    let rows = u64::from(description.geometry.size()[1]);
    let mut go_on = |bytes| progress.advance(0, rows, bytes);
    let left = if options.resume { Left::Resumed(&mut go_on) } else { Left::Removed };
    let same = layers::fingerprint(layers, options)?;
    let built = match options.part {
        None => {
            let origin = Origin { input: same.here.as_bytes(), options: &[] };
            let writer = ResumableWriter::create(output, texture, writer_options, origin, left)?;
            inset::remove_left(output);
            let resumed = writer.taken_over();
            job.tiles.start += resumed;
            let sink = Finer { sink: writer, levels: finer_levels };
            Work { job: &job, run, memory, progress, resumed, selection }.run(layers, sink)
        }
        Some(part) => {
            let same = same.anywhere.as_bytes();
            let writer = PartWriter::create(output, texture, &writer_options, part, same, left)?;
            inset::remove_left(output);
            job.tiles.start += writer.taken_over();
            Work { job: &job, run, memory, progress, resumed: writer.taken_over(), selection }
                .run(layers, writer)
        }
    };
    let reports = layers.iter().zip(&plans).map(|(layer, plan)| layer.report(plan));
    built.map(|report| BuildReport { layers: reports.collect(), ..report })
}

/// A build that is ready to begin.
struct Work<'a> {
    job: &'a Job<'a>,
    /// The pages of the file to be made, by their place in the order of writing.
    run: Range<u64>,
    memory: u64,
    progress: &'a dyn Progress,
    /// Tiles that are taken over.
    resumed: u64,
    selection: Selection,
}

impl Work<'_> {
    /// What is said of the layers is left to others.
    fn run(self, layers: &mut [OpenLayer], sink: impl Sink) -> Result<BuildReport, BuildError> {
        let Done { sink, bytes, row_bytes_held } =
            self.job.run(layers, self.selection, sink, self.progress).map_err(|stopped| match stopped {
                Stopped::Input { path, fault } => BuildError::Input { path, fault },
                Stopped::Output(error) => BuildError::Output(error),
                Stopped::Cancelled => BuildError::Cancelled,
            })?;
        let geometry = &self.job.description.geometry;
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

/// Makes buffers as small as the limit asks for, with a container of `pages`, and says what a build then takes at most; an error where that is too much all
/// the same. Nothing has been allocated yet.
fn fit_memory(layers: &[OpenLayer], job: &mut Job<'_>, pages: u64, limit: u64) -> Result<u64, BuildError> {
    /// What the container's writer keeps for each tile.
    const INDEX_BYTES: u64 = 64;
    /// What the program takes that does nothing yet, its code and the stacks of its threads included.
    const PROGRAM_BYTES: u64 = 16 << 20;
    /// What an allocator wastes at most, as a share of what is asked of it.
    const WASTE: u64 = 8;
    let index = pages.saturating_mul(INDEX_BYTES);
    let readers = layers.iter().fold(0u64, |sum, layer| sum.saturating_add(layer.reader.header().memory));
    let fixed = index.saturating_add(readers).saturating_add(PROGRAM_BYTES);
    job.fit(limit.saturating_sub(fixed) / (WASTE + 1) * WASTE);
    let held = job.memory();
    let needed = held.saturating_add(held / WASTE).saturating_add(fixed);
    if needed <= limit {
        return Ok(needed);
    }
    let greediest = layers.iter().max_by_key(|layer| layer.reader.header().memory);
    let path = greediest.map(|layer| layer.path.clone()).unwrap_or_default();
    let remedy = match greediest.filter(|_| readers > limit / 2).map(|layer| layer.reader.header()) {
        None => "the image is too wide or has too many pages; use larger pages, or split it",
        Some(header) if header.tile_directory.is_some() => {
            "a row of its tiles is held at once; make it anew with smaller tiles, or allow more memory"
        }
        Some(_) => {
            "convert it to a TIFF of many strips or of tiles, stored upright, which can be read by rows"
        }
    };
    Err(BuildError::Memory { path, needed, limit, remedy })
}

fn thread_pool(threads: usize) -> Result<rayon::ThreadPool, BuildError> {
    let threads = match threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("vastex-build-{i}"))
        .build()
        .map_err(|e| BuildError::Threads { threads, why: e.to_string() })
}
