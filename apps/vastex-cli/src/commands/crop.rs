//! `vastex crop`: writes a region of a level as it is stored.

use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde::Serialize;
use vastex_build::{CropError, CropSource, crop};

use super::build::{INTERRUPTED, Watch, handle_interrupts};
use crate::args::{CropArgs, CropPlace, CropSize};
use crate::open::{self, Lies, OpenImage};
use crate::output::Output;
use crate::places::Inputs;
use crate::report;

pub(crate) fn run(args: &CropArgs) -> Result<ExitCode> {
    let (source, target) = (&args.source, &args.output);
    let (at, size) = match (args.at, args.size) {
        (CropPlace::Image(at), CropSize::Image(size)) => (at, size),
        (CropPlace::Volume(at), CropSize::Volume(size)) => return of_volume(args, at, size),
        _ => bail!("give --at and --size two numbers each, of an image, or three, of a volume"),
    };
    refuse_volume(source)?;
    let mut cropped = match open::what_lies_at(source)? {
        Lies::Generated | Lies::Container => {
            // Only of a planet anything is built: the image of its continents.
            let image = OpenImage { cache: &args.cache, wraps: true, observer: &() };
            let tiles = open::open_tiles(source, false, Some(image))?;
            CropSource::of_tiles(tiles, args.layer.as_deref(), args.level)
                .with_context(|| source.display().to_string())?
        }
        Lies::Other if args.layer.is_some() => {
            bail!("{}: has no named layers; leave out --layer", source.display())
        }
        Lies::Other => CropSource::open(source, args.level).with_context(|| source.display().to_string())?,
    };
    let region = cropped.region(at, size).with_context(|| source.display().to_string())?;
    cropped.check(region, target.format).with_context(|| source.display().to_string())?;
    check_place(args)?;
    // Until here nothing is written but into the cache, which stays sound whenever the program ends, and
    // Ctrl-C ends it at once.
    handle_interrupts()?;
    let output = Output::at(&target.path)?;
    let watch = Watch::new(args.print.quiet);
    let begin = Instant::now();
    let done = output.write_by(|file| crop(&mut cropped, region, target.format, file, &watch));
    watch.bar.0.finish_and_clear();
    let bytes = match done? {
        Err(CropError::Cancelled) => {
            report::say("interrupted; nothing was left behind");
            return Ok(ExitCode::from(INTERRUPTED));
        }
        Err(CropError::Output(error)) => return Err(output.refusal(&error)),
        Err(error) => return Err(error).with_context(|| source.display().to_string()),
        Ok(bytes) => bytes,
    };
    let summary = Summary {
        source: source.display().to_string(),
        output: target.path.display().to_string(),
        level: args.level,
        at: region.at,
        size,
        channels: cropped.channels(),
        dtype: cropped.number().name(),
        bytes,
        seconds: begin.elapsed().as_secs_f64(),
    };
    args.print.summary(&summary, Summary::text)?;
    Ok(ExitCode::SUCCESS)
}

/// A region of a volume.
#[cfg(feature = "volumes")]
fn of_volume(args: &CropArgs, at: [i64; 3], size: [u64; 3]) -> Result<ExitCode> {
    check_place(args)?;
    handle_interrupts()?;
    super::volume::crop(args, at, size)
}

/// Without their reader there are no volumes.
#[cfg(not(feature = "volumes"))]
fn of_volume(args: &CropArgs, _: [i64; 3], _: [u64; 3]) -> Result<ExitCode> {
    bail!(
        "{}: this program was built without volumes; give --at and --size two numbers each",
        args.source.display()
    )
}

/// Says what to write where two numbers were given of a volume that is no image, too.
#[cfg(feature = "volumes")]
fn refuse_volume(source: &std::path::Path) -> Result<()> {
    let is_image = source.is_file() && vastex_build::open(source).is_ok();
    if !is_image && vastex_volume::is_volume(source) {
        bail!("{}: is a volume; give --at X,Y,Z and --size WxHxD", source.display());
    }
    Ok(())
}

/// Without their reader there are no volumes.
#[cfg(not(feature = "volumes"))]
fn refuse_volume(_: &std::path::Path) -> Result<()> {
    Ok(())
}

/// Nothing is written over what is read.
fn check_place(args: &CropArgs) -> Result<()> {
    Inputs::of([&*args.source]).check(&[("region", Some(&args.output.path))])
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary {
    source: String,
    output: String,
    level: u32,
    /// Column and row of the first texel, in the level.
    at: [u32; 2],
    /// Columns and rows.
    size: [u32; 2],
    /// Numbers of a texel.
    channels: u16,
    /// What they are, as NumPy names it.
    dtype: &'static str,
    /// Of the output.
    bytes: u64,
    seconds: f64,
}

impl Summary {
    fn text(&self) -> String {
        let Summary { output, level, size: [width, height], channels, dtype, seconds, .. } = self;
        let bytes = report::bytes(self.bytes);
        format!(
            "{output}: {width}x{height} texels of level {level}, {channels} channels of {dtype}; {bytes} in {seconds:.1} s"
        )
    }
}
