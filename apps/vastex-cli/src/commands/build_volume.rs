//! `vastex build` of volumes: containers and OME-Zarr with all of their levels.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Result, bail};
use serde::Serialize;
use vastex_build::{
    Compression, ContainerOptions, VolumeBuildError, VolumeFormat, VolumeOptions, VolumeReport, ZarrCodec,
    ZarrOptions, ZarrVersion, build_volume,
};
use vastex_volume::Reduction;

use super::build::{Bar, INTERRUPTED, handle_interrupts};
use super::volume::printable;
use crate::args::{BuildArgs, Compress, Downsample, Zarr};
use crate::report;

/// Builds the volume at a path.
pub(super) fn run(args: &BuildArgs, input: &Path) -> Result<ExitCode> {
    if let Some(why) = args.of_images_alone() {
        bail!(
            "{}: is a volume. {why}; leave it out, or build its first page as an image by --layer color=FILE",
            input.display()
        );
    }
    let options = options(args)?;
    handle_interrupts()?;
    if !args.print.quiet && args.output.exists() {
        let output = args.output.display();
        report::say(&format!("note: {output}: is there already, and is replaced once the new one is whole"));
    }
    let bar = Bar::new(args.print.quiet);
    let begin = Instant::now();
    let built = build_volume(input, &args.output, &options, &bar);
    bar.0.finish_and_clear();
    let built = match built {
        Err(VolumeBuildError::Cancelled) => {
            report::say("interrupted; nothing was left behind");
            return Ok(ExitCode::from(INTERRUPTED));
        }
        built => built?,
    };
    if !args.print.quiet {
        built.notes.iter().for_each(|note| report::say(&printable(&format!("note: {note}"))));
    }
    let summary = Summary::new(args, input, &options, &built, begin.elapsed().as_secs_f64());
    args.print.summary(&summary, Summary::text)?;
    Ok(ExitCode::SUCCESS)
}

fn options(args: &BuildArgs) -> Result<VolumeOptions> {
    let is_zarr = args.volume.zarr.is_some() || args.output.extension().is_some_and(|end| end == "zarr");
    let format = match is_zarr {
        true => VolumeFormat::Zarr(zarr_options(args)?),
        false => VolumeFormat::Container(container_options(args)?),
    };
    let usual = VolumeOptions::default();
    Ok(VolumeOptions {
        format,
        downsample: args.volume.downsample.map(|rule| match rule {
            Downsample::Mean => Reduction::Mean,
            Downsample::Max => Reduction::Max,
            Downsample::Min => Reduction::Min,
            Downsample::Majority => Reduction::Majority,
        }),
        keep_z: args.volume.keep_z,
        convention: args.volume.origins.convention(),
        threads: args.threads.count(),
        tolerant: args.tolerant,
        memory_limit: args.memory_mib.map_or(usual.memory_limit, |mib| mib << 20),
    })
}

fn container_options(args: &BuildArgs) -> Result<ContainerOptions> {
    if args.volume.shards.is_some() {
        bail!("--shards is of OME-Zarr; give the output the ending .zarr, or leave it out");
    }
    let usual = ContainerOptions::default();
    Ok(ContainerOptions {
        page: args.page.unwrap_or(usual.page),
        border: args.border.unwrap_or(usual.border),
        compression: match args.compress {
            None => usual.compression,
            Some(Compress::None) => Compression::None,
            Some(Compress::Lz4) => Compression::Lz4,
            Some(Compress::Zstd) => Compression::Zstd(0),
            Some(Compress::Gzip) => {
                bail!("--compress gzip is of OME-Zarr; a container has none, lz4 or zstd")
            }
        },
        align: args.align.unwrap_or(usual.align),
        durable: args.disk.durable,
    })
}

fn zarr_options(args: &BuildArgs) -> Result<ZarrOptions> {
    let of_containers = [
        (args.border.is_some(), "--border: chunks of OME-Zarr have none"),
        (args.align.is_some(), "--align is of containers"),
        (args.disk.durable, "--durable is of containers; `sync` waits for all files of an OME-Zarr"),
        (
            args.compress == Some(Compress::Lz4),
            "--compress lz4: OME-Zarr has no name for it that all programs know; use zstd, gzip or none",
        ),
    ];
    if let Some((_, why)) = of_containers.iter().find(|(is_given, _)| *is_given) {
        bail!("{why}");
    }
    let usual = ZarrOptions::default();
    Ok(ZarrOptions {
        version: match args.volume.zarr {
            Some(Zarr::V04) => ZarrVersion::V04,
            Some(Zarr::V05) | None => ZarrVersion::V05,
        },
        chunk: args.page.map_or(usual.chunk, |side| [side.into(); 3]),
        shards: args.volume.shards.unwrap_or(usual.shards),
        codec: match args.compress {
            Some(Compress::None) => ZarrCodec::None,
            Some(Compress::Gzip) => ZarrCodec::Gzip(6),
            _ => usual.codec,
        },
    })
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary {
    input: String,
    output: String,
    /// `container` or `ome-zarr`.
    format: &'static str,
    /// Of OME-Zarr.
    #[serde(skip_serializing_if = "Option::is_none")]
    version: Option<&'static str>,
    /// Voxels along x, y and z of each level, the finest first.
    levels: Vec<[u64; 3]>,
    channels: u64,
    times: u64,
    /// As NumPy names it.
    dtype: &'static str,
    /// How coarser levels were made.
    downsample: &'static str,
    /// Images of labels that were built beside the image.
    labels: Vec<String>,
    /// Bricks, chunks or shards with bytes of their own.
    pieces: u64,
    /// Those that hold one value alone, and take no room.
    empty: u64,
    /// Of the output.
    bytes: u64,
    seconds: f64,
    /// Millions of voxels of the volume per second.
    mvox_per_s: f64,
    notes: Vec<String>,
}

impl Summary {
    fn new(
        args: &BuildArgs,
        input: &Path,
        options: &VolumeOptions,
        built: &VolumeReport,
        seconds: f64,
    ) -> Summary {
        let (format, version) = match options.format {
            VolumeFormat::Container(_) => ("container", None),
            VolumeFormat::Zarr(zarr) => ("ome-zarr", Some(zarr.version.name())),
        };
        Summary {
            input: input.display().to_string(),
            output: args.output.display().to_string(),
            format,
            version,
            levels: built.levels.clone(),
            channels: built.channels,
            times: built.times,
            dtype: built.dtype.name(),
            downsample: built.downsample.name(),
            labels: built.labels.clone(),
            pieces: built.pieces,
            empty: built.empty,
            bytes: built.bytes,
            seconds,
            mvox_per_s: built.voxels as f64 / 1e6 / seconds.max(1e-9),
            notes: built.notes.clone(),
        }
    }

    fn text(&self) -> String {
        let Summary { output, dtype, channels, times, downsample, pieces, empty, seconds, .. } = self;
        let [width, height, depth] = self.levels.first().copied().unwrap_or_default();
        let count = |count: u64, what: &str| match count {
            1 => String::new(),
            count => format!(", {count} {what}s"),
        };
        let labels = match &self.labels[..] {
            [] => String::new(),
            names => format!("; labels {}", printable(&names.join(", "))),
        };
        let piece = if self.format == "container" { "bricks" } else { "files of chunks" };
        let (bytes, rate) = (report::bytes(self.bytes), self.mvox_per_s);
        format!(
            "{output}: {width}x{height}x{depth} voxels of {dtype}{}{} in {} levels by {downsample}{labels}; {pieces} {piece} and \
             {empty} that hold one value; {bytes} in {seconds:.1} s, {rate:.0} Mvox/s",
            count(*channels, "channel"),
            count(*times, "time"),
            self.levels.len()
        )
    }
}
