//! `vastex build`: drives `vastex-build`, shows how far it is, and lets it clean up when it is interrupted.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow};
use indicatif::ProgressBar;
use serde::Serialize;
use vastex_build::{
    BuildError, BuildOptions, BuildReport, LayerReport, Notice, Progress, ReorderError, WriteError,
};
use vastex_tiles::Compression;

use crate::args::{BuildArgs, Compress};
use crate::{progress, report};

/// What a shell expects of a program that Ctrl-C ended.
pub(crate) const INTERRUPTED: u8 = 130;

/// Set by Ctrl-C and its like; the build asks for it between rows.
static INTERRUPT: AtomicBool = AtomicBool::new(false);

/// Lets Ctrl-C and its like stop the work at the next row; a second one ends the program at once, and what it
/// leaves goes with the next run.
pub(crate) fn handle_interrupts() -> Result<()> {
    let interrupt = || {
        if INTERRUPT.swap(true, Ordering::Relaxed) {
            end_now();
        }
    };
    ctrlc::set_handler(interrupt).context("Ctrl-C cannot be handled")
}

/// Has Ctrl-C and its like end the program at once, without any file that it has begun beside its outputs.
pub(crate) fn clean_up_at_interrupts() -> Result<()> {
    let interrupt = || {
        crate::output::remove_begun();
        end_now();
    };
    ctrlc::set_handler(interrupt).context("Ctrl-C cannot be handled")
}

/// Ends the program without waiting for anything, such as a thread that writes to a dead disk.
fn end_now() -> ! {
    #[cfg(unix)]
    signal_hook::low_level::exit(INTERRUPTED.into());
    #[cfg(not(unix))]
    std::process::exit(INTERRUPTED.into());
}

/// Returns true if the work should stop.
pub(crate) fn is_interrupted() -> bool {
    INTERRUPT.load(Ordering::Relaxed)
}

pub(crate) fn run(args: &BuildArgs) -> Result<ExitCode> {
    handle_interrupts()?;
    if !args.print.quiet && args.output.is_file() {
        let output = args.output.display();
        report::say(&format!("note: {output}: is there already, and is replaced once the new one is whole"));
    }
    let watch = Watch::new(args.print.quiet);
    let begin = Instant::now();
    let built = vastex_build::build(&args.inputs(), &args.output, &options(args), &watch);
    watch.bar.0.finish_and_clear();
    let built = match built {
        Err(BuildError::Cancelled) => {
            report::say(match args.resume {
                true => "interrupted; what is built so far is kept, and the same command goes on with it",
                false => "interrupted; nothing was left behind",
            });
            return Ok(ExitCode::from(INTERRUPTED));
        }
        built => built.map_err(|error| advise_to_resume(args, error))?,
    };
    if args.reorder && !reorder(args)? {
        return Ok(ExitCode::from(INTERRUPTED));
    }
    for layer in &built.layers {
        layer.notices.iter().for_each(|notice| watch.note(&layer.path, notice));
    }
    built.insets.iter().for_each(|(image, notice)| watch.note(image, notice));
    let summary = Summary::new(args, &built, begin.elapsed());
    args.print.summary(&summary, Summary::text)?;
    Ok(ExitCode::SUCCESS)
}

/// A full disk, say, need not cost what is built already.
fn advise_to_resume(args: &BuildArgs, error: BuildError) -> anyhow::Error {
    let is_kept = args.resume && matches!(error, BuildError::Output(WriteError::Io { .. }));
    match is_kept {
        true => anyhow!("{error}. What is built so far is kept, and the same command goes on with it"),
        false => error.into(),
    }
}

/// Writes the container along a curve, in its own place; false where it was interrupted.
fn reorder(args: &BuildArgs) -> Result<bool> {
    let bar = progress::bar(args.print.quiet, "reordering ", "tile");
    let reordered = vastex_build::reorder(&args.output, &args.output, args.disk.durable, |done, total| {
        bar.set_length(total);
        bar.set_position(done);
        if is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    bar.finish_and_clear();
    match reordered {
        Err(ReorderError::Cancelled) => {
            report::say("interrupted; the container is whole, but not reordered");
            Ok(false)
        }
        reordered => Ok(reordered.map(|_| true)?),
    }
}

fn options(args: &BuildArgs) -> BuildOptions {
    BuildOptions {
        page: args.image_page(),
        border: args.image_border(),
        compression: match args.compress {
            Some(Compress::None) => Compression::None,
            // Gzip was refused.
            Some(Compress::Lz4 | Compress::Gzip) | None => Compression::Lz4,
            Some(Compress::Zstd) => Compression::Zstd(0),
        },
        quality: args.quality.into(),
        linear: args.linear,
        filter: args.filter,
        levels_from: args.levels_from,
        nodata: args.nodata,
        keep_levels: args.keep_levels,
        address: args.address.modes,
        border_color: args.address.color,
        threads: args.threads.count(),
        gives_way: false,
        durable: args.disk.durable,
        align: args.align.unwrap_or(1),
        mask: args.mask.clone(),
        drop_transparent: args.drop_transparent,
        tolerant: args.tolerant,
        insets: args.insets(),
        memory_limit: args.memory_mib.map_or(BuildOptions::default().memory_limit, |mib| mib << 20),
        part: args.shard,
        resume: args.resume,
    }
}

/// A progress bar, on a terminal only.
pub(crate) struct Bar(pub(crate) ProgressBar);

impl Bar {
    pub(crate) fn new(hidden: bool) -> Bar {
        Bar(progress::bar(hidden, "", "row"))
    }
}

impl Progress for Bar {
    fn advance(&self, rows_done: u64, rows_total: u64, bytes_written: u64) -> ControlFlow<()> {
        self.0.set_length(rows_total);
        self.0.set_position(rows_done);
        self.0.set_message(format!(", {} written", report::bytes(bytes_written)));
        if is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn opening(&self) -> ControlFlow<()> {
        if is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn beginning(&self, share: f64) -> ControlFlow<()> {
        self.0.set_message(format!(", {} decoded", report::percent(share)));
        if is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// A progress bar, and what is said of the images: each thing once, as soon as it is known.
pub(crate) struct Watch {
    pub(crate) bar: Bar,
    is_quiet: bool,
    said: RefCell<Vec<(PathBuf, Notice)>>,
}

impl Watch {
    /// One that says nothing if `is_quiet`.
    pub(crate) fn new(is_quiet: bool) -> Watch {
        Watch { bar: Bar::new(is_quiet), is_quiet, said: RefCell::default() }
    }
}

impl Progress for Watch {
    fn advance(&self, rows_done: u64, rows_total: u64, bytes_written: u64) -> ControlFlow<()> {
        self.bar.advance(rows_done, rows_total, bytes_written)
    }

    fn opening(&self) -> ControlFlow<()> {
        self.bar.opening()
    }

    fn beginning(&self, share: f64) -> ControlFlow<()> {
        self.bar.beginning(share)
    }

    fn note(&self, image: &Path, notice: &Notice) {
        let mut said = self.said.borrow_mut();
        if self.is_quiet || said.iter().any(|(path, other)| path == image && other == notice) {
            return;
        }
        self.bar.0.suspend(|| report::say_of_image(image, notice));
        said.push((image.into(), notice.clone()));
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary {
    /// The image of the first layer.
    input: String,
    output: String,
    /// Which part of the container was made, as given; of a whole one, nothing.
    shard: Option<String>,
    /// Width and height in texels.
    size: [u32; 2],
    levels: u32,
    /// Of the first layer.
    format: &'static str,
    layers: Vec<LayerSummary>,
    tiles: u64,
    constant_tiles: u64,
    shared_tiles: u64,
    /// Pages that have no tile.
    absent_tiles: u64,
    /// Tiles that an interrupted build had made.
    resumed_tiles: u64,
    /// Of the file.
    bytes: u64,
    seconds: f64,
    /// Millions of texels of the images per second.
    mpix_per_s: f64,
    /// Bytes of memory that the build could at most have taken.
    memory_bound: u64,
    notices: Vec<String>,
}

/// What was made of one image.
#[derive(Serialize)]
struct LayerSummary {
    name: String,
    input: String,
    format: &'static str,
    /// Texels of the texture along one of the layer.
    scale: u32,
    filter: String,
}

impl LayerSummary {
    fn new(built: &LayerReport) -> LayerSummary {
        LayerSummary {
            name: built.layer.name.clone(),
            input: built.path.display().to_string(),
            format: built.layer.format.name(),
            scale: built.layer.scale,
            filter: built.filter.to_string(),
        }
    }

    /// The format, with the name of the layer where there is another one.
    fn text(&self, is_only: bool) -> String {
        let LayerSummary { name, format, scale, .. } = self;
        match (is_only, scale) {
            (true, _) => (*format).into(),
            (false, 1) => format!("{format} ({name})"),
            (false, scale) => format!("{format} ({name}, 1/{scale})"),
        }
    }
}

impl Summary {
    fn new(args: &BuildArgs, built: &BuildReport, took: Duration) -> Summary {
        let first = built.layers.first();
        let seconds = took.as_secs_f64();
        Summary {
            input: first.map(|layer| layer.path.display().to_string()).unwrap_or_default(),
            output: args.output.display().to_string(),
            shard: args.shard.map(|of| format!("{}/{}", of.part, of.parts)),
            size: built.size,
            levels: built.levels,
            format: first.map_or("", |layer| layer.layer.format.name()),
            layers: built.layers.iter().map(LayerSummary::new).collect(),
            tiles: built.tiles,
            constant_tiles: built.constant_tiles,
            shared_tiles: built.shared_tiles,
            absent_tiles: built.absent_tiles,
            resumed_tiles: built.resumed_tiles,
            bytes: built.bytes,
            seconds,
            mpix_per_s: built.texels as f64 / 1e6 / seconds.max(1e-9),
            memory_bound: built.memory,
            notices: built.notices().map(ToString::to_string).collect(),
        }
    }

    fn text(&self) -> String {
        let Summary { output, size: [width, height], levels, tiles, seconds, .. } = self;
        let layers =
            self.layers.iter().map(|layer| layer.text(self.layers.len() == 1)).collect::<Vec<_>>().join(", ");
        let (bytes, rate) = (report::bytes(self.bytes), self.mpix_per_s);
        let kinds = [
            (self.constant_tiles, "of one colour"),
            (self.shared_tiles, "duplicates"),
            (self.resumed_tiles, "taken over from an interrupted build"),
        ];
        let kinds: Vec<String> = kinds
            .into_iter()
            .filter(|&(count, _)| count > 0)
            .map(|(count, kind)| format!("{count} {kind}"))
            .collect();
        let kinds = if kinds.is_empty() { String::new() } else { format!(" ({})", kinds.join(", ")) };
        let absent = match self.absent_tiles {
            0 => String::new(),
            pages => format!("; {pages} pages without a tile"),
        };
        format!(
            "{output}: {width}x{height} texels of {layers} in {levels} levels; {tiles} tiles{kinds}{absent}; {bytes} in \
             {seconds:.1} s, {rate:.0} Mpix/s"
        )
    }
}
