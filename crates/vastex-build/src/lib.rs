//! The part of Vastex that prepares: from an image file to a `.vastex` container, in one pass over its rows.
//!
//! [`build`] reads JPEG, PNG and TIFF row by row, makes every level, cuts tiles with their borders and drives
//! the container's writer. Memory follows the width of the image, never its height; what a file makes
//! impossible to read by rows is reported as a [`Notice`]. The bytes written depend on the image and the options, and
//! not on the number of threads.
//!
//! [`replace`] puts an image into a region of a container that was built here, on all levels.
//!
//! [`export`](fn@export) goes the other way: from a texture to the tile directories of other programs, which [`build`]
//! reads too.
//!
//! Not here: the container's bytes (`vastex-tiles`), the shape of levels, pages and borders (`vastex-core`).

mod bands;
mod convert;
mod error;
mod export;
mod filter;
mod fingerprint;
mod magnify;
mod notice;
mod pipeline;
mod place;
mod pyramid;
mod readers;
mod replace;
mod rows;
mod tail;

use std::ops::ControlFlow;
use std::path::Path;

use vastex_core::{AddressMode, Description, Dims, Geometry, GeometrySpec, LayerFormat};
use vastex_tiles::{Left, Origin, PartWriter, ResumableWriter, WriterOptions};

pub use error::{BuildError, InputFault};
pub use export::{ExportError, ExportOptions, ExportReport, Layout, TileFormat, export};
pub use notice::Notice;
pub use readers::{DirectorySource, ImageHeader, PixelFormat, RowReader, Sample, open};
pub use replace::{ReplaceError, ReplaceOptions, replace};
pub use vastex_tiles::{
    Compression, MergeError, PartOf, ReorderError, UpdateError, Updated, WriteError, Written, merge, reorder,
};

use filter::Filter;
use pipeline::{Done, Job, Sink, Stopped};

/// How a container is made.
#[derive(Clone, Debug)]
pub struct BuildOptions {
    /// Texels of payload per side of a page, 8 to 4096.
    pub page: u32,
    /// Texels of border on each side, 1 to half a page.
    pub border: u32,
    /// How tiles are compressed.
    pub compression: Compression,
    /// Whether colour is filtered in linear light and weighted by alpha; else every channel as it is stored.
    pub linear: bool,
    /// What lies beyond the edges, in x and in y. Where this says clamp, the tiles of a planet wrap in x all the same.
    pub address: [AddressMode; 2],
    /// Threads that filter and encode, besides one that reads and one that writes; 0 for as many as there are cores.
    pub threads: usize,
    /// Whether to wait at the end until the disk has everything.
    pub durable: bool,
    /// Every tile begins at a multiple of so many bytes, for direct I/O: 1 for no alignment, or a power of two from
    /// 4096 to 65,536.
    pub align: u32,
    /// Bytes of memory beyond which an image is refused before anything is allocated.
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
            linear: true,
            address: [AddressMode::Clamp; 2],
            threads: 0,
            durable: false,
            align: 1,
            memory_limit: 16 << 30,
            part: None,
            resume: false,
        }
    }
}

/// Told how far a build is, and asked whether to go on. Called on the thread that called [`build`].
pub trait Progress {
    /// `rows_done` of `rows_total` rows are read and `bytes_written` bytes of tiles are written. `Break` cancels the
    /// build, which then leaves nothing behind, unless it can be resumed.
    fn advance(&self, rows_done: u64, rows_total: u64, bytes_written: u64) -> ControlFlow<()>;
}

/// Nobody watches, nobody cancels.
impl Progress for () {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// What was built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BuildReport {
    /// Size of level 0 in texels.
    pub size: [u32; 2],
    /// Levels, the tail's included.
    pub levels: u32,
    /// The format of the one layer.
    pub format: LayerFormat,
    /// Tiles, the tail counted as one.
    pub tiles: u64,
    /// Tiles that are kept as their colour.
    pub constant_tiles: u64,
    /// Tiles whose bytes are those of an earlier one.
    pub shared_tiles: u64,
    /// Tiles that an interrupted build had made.
    pub resumed_tiles: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Bytes of rows that were held at once.
    pub row_bytes_held: u64,
    /// Bytes of memory that the build could at most have taken, as estimated from the header.
    pub memory: u64,
    /// What was left out of the image, and what it cost.
    pub notices: Vec<Notice>,
}

/// Makes a container of the one image in `inputs`.
///
/// The file appears at `output`, over what was there, when it is whole; after an error or a cancellation nothing is left
/// behind, unless [`BuildOptions::resume`] asks for it. Takes one pass over the image, and memory as
/// [`BuildReport::memory`] says.
pub fn build(
    inputs: &[impl AsRef<Path>],
    output: &Path,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<BuildReport, BuildError> {
    let [input] = inputs else { return Err(BuildError::Inputs(inputs.len())) };
    let input = input.as_ref();
    let at_input = |fault| BuildError::Input { path: input.into(), fault };
    let mut reader = open(input).map_err(at_input)?;
    let tiles = reader.header().tile_directory.clone();
    place::check(input, tiles.as_deref(), output)?;
    let description = describe(reader.header(), options)?;
    let pool = thread_pool(options.threads)?;
    let mut job = Job {
        description: &description,
        linear_light: options.linear,
        compression: options.compression,
        tiles: match options.part {
            Some(part) => part.run(description.geometry.page_count()),
            None => 0..description.geometry.page_count(),
        },
        pool: &pool,
    };
    let memory = check_memory(input, reader.header(), &job, options.memory_limit)?;
    let writer_options = WriterOptions {
        compression: options.compression,
        durable: options.durable,
        align: options.align,
        filters: vec![Filter::new(description.layers[0].format, options.linear).name().into()],
    };
    let rows = u64::from(reader.header().height);
    let mut go_on = |bytes| progress.advance(0, rows, bytes);
    let left = if options.resume { Left::Resumed(&mut go_on) } else { Left::Removed };
    let of = |path: &Path| fingerprint::fingerprint(path).map_err(|error| at_input(error.into()));
    let source = [of(input)?, tiles.as_deref().map_or(Ok(0), of)?];
    match options.part {
        None => {
            let origin = Origin { input: &source.map(u64::to_le_bytes).concat(), options: &[] };
            let writer = ResumableWriter::create(output, description.clone(), writer_options, origin, left)?;
            job.tiles.start += writer.taken_over();
            Work { job: &job, input, memory, progress, resumed: writer.taken_over() }
                .run(&mut *reader, writer)
        }
        Some(part) => {
            let same = format!("{:?}", (source, options.compression));
            let same = same.as_bytes();
            let writer = PartWriter::create(output, description.clone(), &writer_options, part, same, left)?;
            job.tiles.start += writer.taken_over();
            Work { job: &job, input, memory, progress, resumed: writer.taken_over() }
                .run(&mut *reader, writer)
        }
    }
}

/// A build that is ready to begin.
struct Work<'a> {
    job: &'a Job<'a>,
    input: &'a Path,
    memory: u64,
    progress: &'a dyn Progress,
    /// Tiles that are taken over.
    resumed: u64,
}

impl Work<'_> {
    fn run(&self, reader: &mut dyn RowReader, sink: impl Sink) -> Result<BuildReport, BuildError> {
        let Done { sink, bytes, row_bytes_held } =
            self.job.run(reader, sink, self.progress).map_err(|stopped| match stopped {
                Stopped::Input(fault) => BuildError::Input { path: self.input.into(), fault },
                Stopped::Output(error) => BuildError::Output(error),
                Stopped::Cancelled => BuildError::Cancelled,
            })?;
        let header = reader.header();
        let rows = u64::from(header.height);
        if self.progress.advance(rows, rows, bytes).is_break() {
            return Err(BuildError::Cancelled);
        }
        let (written, description) = (sink.finish()?, self.job.description);
        Ok(BuildReport {
            size: [header.width, header.height],
            levels: description.geometry.levels().len() as u32,
            format: description.layers[0].format,
            tiles: written.tiles,
            constant_tiles: written.constant_tiles,
            shared_tiles: written.shared_tiles,
            resumed_tiles: self.resumed,
            bytes: written.bytes,
            row_bytes_held,
            memory: self.memory,
            notices: header.notices.clone(),
        })
    }
}

fn describe(header: &ImageHeader, options: &BuildOptions) -> Result<Description, BuildError> {
    let [x, y] = options.address;
    let x = if header.wraps && x == AddressMode::Clamp { AddressMode::Wrap } else { x };
    let geometry = Geometry::new(GeometrySpec {
        dims: Dims::D2,
        size: [header.width, header.height, 1],
        page: options.page,
        border: options.border,
        address: [x, y, AddressMode::Clamp],
        ..GeometrySpec::image(1, 1)
    })?;
    Ok(Description::one_layer(geometry, convert::layer_format(header)))
}

/// The most memory that a build can take; an error where that is too much. Nothing has been allocated yet.
fn check_memory(input: &Path, header: &ImageHeader, job: &Job<'_>, limit: u64) -> Result<u64, BuildError> {
    /// What the container's writer keeps for each tile.
    const INDEX_BYTES: u64 = 64;
    let index = job.description.geometry.page_count().saturating_mul(INDEX_BYTES);
    let pipeline = job.memory(header.row_bytes());
    let needed = pipeline.saturating_add(index).saturating_add(header.memory);
    if needed <= limit {
        return Ok(needed);
    }
    let remedy = if header.memory > limit / 2 {
        "convert it to a TIFF of many strips or of tiles, which can be read by rows"
    } else {
        "the image is too wide or has too many pages; use larger pages, or split it"
    };
    Err(BuildError::Memory { path: input.into(), needed, limit, remedy })
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
