//! `vastex info` and `vastex crop` of volumes.

mod list;

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::{Result, bail};
use serde::Serialize;
use vastex_volume::{
    BRICK, BrickCount, Opened, Reduction, Volume, VolumeAbout, VolumeOptions, is_volume, levels_of,
    made_levels_kept, makes_levels_at_opening, open_placed,
};

use crate::args::InfoArgs;
use crate::report;
pub(crate) use list::no_volume;
pub(super) use list::printable;
use list::{ListSummary, MOST_NAMED, list_text};

/// Returns true if `vastex info` tells of a path as a volume. A TIFF pyramid is none, whatever else lies in
/// it.
pub(crate) fn is_described_as_volume(path: &Path) -> bool {
    is_volume(path) && !is_pyramid(path)
}

#[cfg(feature = "build")]
fn is_pyramid(path: &Path) -> bool {
    let facts = || vastex_build::TiffDirectories::read(path)?.facts();
    path.is_file() && facts().is_ok_and(|facts| facts.levels().len() > 1)
}

/// Without the readers of `vastex build` no pyramid is known.
#[cfg(not(feature = "build"))]
fn is_pyramid(_: &Path) -> bool {
    false
}

/// Says what is in a volume, or which volumes something lists.
pub(super) fn info(args: &InfoArgs) -> Result<ExitCode> {
    if args.estimate.is_some() {
        bail!("{}: pools of volumes are not estimated; leave out --estimate", args.file.display());
    }
    match open_placed(&args.file, args.origins.convention())? {
        Opened::Images(list) => match args.json {
            true => report::print_json(&ListSummary::new(&list))?,
            false => report::print(&list_text(&list))?,
        },
        Opened::Volume(volume) => {
            let count = pollster::block_on(volume.count_bricks(args.count))?;
            let volume: Arc<Volume> = Arc::from(volume);
            let summary = Summary::new(volume.about(), count, args.count);
            let summary = Summary { levels_kept: kept(args, &volume), ..summary };
            match args.json {
                true => report::print_json(&summary)?,
                false => report::print(&format!("{}\n{}", printable(&volume.about().path), summary.text()))?,
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// What is said of what lies at a path, by names; nothing of something that lists volumes.
#[cfg(feature = "view")]
pub(super) fn rows_of(path: &Path) -> Result<Vec<(String, String)>> {
    match open_placed(path, None)? {
        Opened::Volume(volume) => rows(&volume),
        Opened::Images(_) => Ok(Vec::new()),
    }
}

/// What is said of a volume, by names.
#[cfg(feature = "view")]
pub(crate) fn rows(volume: &Volume) -> Result<Vec<(String, String)>> {
    let count = pollster::block_on(volume.count_bricks(false))?;
    let rows = Summary::new(volume.about(), count, false).rows();
    Ok(rows.into_iter().map(|(name, value)| (name.to_owned(), printable(&value))).collect())
}

/// Of the levels that are made in the background, what lies in the directory that is named, of all channels
/// at the first time.
fn kept(args: &InfoArgs, volume: &Arc<Volume>) -> Option<KeptSummary> {
    let cache = args.cache.cache.as_ref().filter(|cache| cache.as_os_str() != "off")?;
    let (_, levels) = levels_of(volume.about(), BRICK as u32, 1).ok()?;
    if makes_levels_at_opening(volume.about(), &levels) {
        return None;
    }
    let mut sum = KeptSummary { kept: 0, bricks: 0 };
    for channel in 0..volume.about().channels.min(MOST_NAMED as u64) {
        let options = VolumeOptions { channel, cache: Some(cache.clone()), ..VolumeOptions::default() };
        let of_channel = made_levels_kept(volume, &options).ok().flatten()?;
        sum = KeptSummary { kept: sum.kept + of_channel.done, bricks: sum.bricks + of_channel.total };
    }
    Some(sum)
}

/// What lies in the directory of `--cache` of levels that are made.
#[derive(Serialize)]
struct KeptSummary {
    /// Bricks of their finest level that lie there.
    kept: u64,
    /// Of how many.
    bricks: u64,
}

/// What `--json` prints of a volume.
#[derive(Serialize)]
struct Summary {
    /// `ome-zarr`, `zarr`, `nifti`, `tiff-stack`, `raw` or `vastex`.
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    version: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    /// Voxels along x, y and z.
    size: [u64; 3],
    /// Those that are stored, the finest first.
    levels: Vec<LevelSummary>,
    /// Those that the file names and that cannot be read, by their numbers among all that it names, which
    /// are those of `crop --level`.
    levels_left_out: Vec<LeftOutSummary>,
    /// Those that are not stored and are made below the coarsest one where the volume is drawn, the finest
    /// first.
    made_levels: Vec<MadeLevelSummary>,
    /// When these are made: `at-opening` or `in-the-background`; left out where there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    levels_made: Option<&'static str>,
    /// By what rule: `mean`, and of labels `majority`.
    #[serde(skip_serializing_if = "Option::is_none")]
    levels_made_by: Option<&'static str>,
    /// Where they are made in the background and `--cache` names a directory: what of them lies there.
    #[serde(skip_serializing_if = "Option::is_none")]
    levels_kept: Option<KeptSummary>,
    channels: u64,
    channel_info: Vec<ChannelSummary>,
    times: u64,
    /// How far apart they are, where the file says so, and in which unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    time_step: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_unit: Option<String>,
    /// As NumPy names it.
    dtype: &'static str,
    /// Of scales and origins.
    unit: Option<String>,
    /// What the file's translations are of.
    convention: &'static str,
    /// Images of labels beside it; each is opened at `labels/NAME` below its path.
    labels: Vec<String>,
    is_label: bool,
    /// Slope and intercept of stored values, which are not applied.
    #[serde(skip_serializing_if = "Option::is_none")]
    value_scale: Option<[f64; 2]>,
    /// How coarser levels were made, as the file calls it.
    #[serde(skip_serializing_if = "Option::is_none")]
    downsample: Option<String>,
    /// Voxels along each side of a brick.
    brick: u64,
    /// Of all stored levels, channels and times.
    bricks: u64,
    /// Those without a stored chunk; null where counting needs more than listings and indices at hand.
    absent_bricks: Option<u64>,
    /// Whether `--count` has counted these.
    #[serde(skip)]
    is_counted: bool,
    oddities: Vec<String>,
}

#[derive(Serialize)]
struct LevelSummary {
    path: String,
    size: [u64; 3],
    /// Sides of a voxel along x, y and z.
    scale: [f64; 3],
    /// The corner of its first voxel.
    origin: [f64; 3],
    /// Voxels of what is decoded at once.
    chunk: [u64; 3],
}

#[derive(Serialize)]
struct LeftOutSummary {
    number: usize,
    path: String,
    why: String,
}

#[derive(Serialize)]
struct MadeLevelSummary {
    size: [u32; 3],
    /// Sides of a voxel along x, y and z.
    scale: [f64; 3],
    /// The corner of its first voxel.
    origin: [f64; 3],
}

#[derive(Serialize)]
struct ChannelSummary {
    name: Option<String>,
    /// Six hexadecimal digits.
    color: Option<String>,
    window: Option<[f64; 2]>,
    active: Option<bool>,
    inverted: bool,
}

impl Summary {
    fn new(about: &VolumeAbout, count: BrickCount, is_counted: bool) -> Summary {
        let levels = about.levels.iter().map(|level| LevelSummary {
            path: level.path.clone(),
            size: level.size,
            scale: level.scale,
            origin: level.origin,
            chunk: level.chunk,
        });
        let left_out = about.left_out.iter().map(|left| LeftOutSummary {
            number: left.number,
            path: left.path.clone(),
            why: left.error.to_string(),
        });
        let made = made_levels(about);
        let channels = about.channel_info.iter().map(|channel| ChannelSummary {
            name: channel.name.clone(),
            color: channel.color.map(|[r, g, b]| format!("{r:02x}{g:02x}{b:02x}")),
            window: channel.window,
            active: channel.is_active,
            inverted: channel.is_inverted,
        });
        Summary {
            kind: about.kind,
            version: about.version.clone(),
            name: about.name.clone(),
            size: about.size(),
            levels: levels.collect(),
            levels_left_out: left_out.collect(),
            levels_made: made.as_ref().map(|(_, when)| *when),
            levels_made_by: made.as_ref().map(|_| Reduction::usual(about.is_label).name()),
            levels_kept: None,
            made_levels: made.map_or_else(Vec::new, |(levels, _)| levels),
            channels: about.channels,
            channel_info: channels.collect(),
            times: about.times,
            time_step: about.time_step,
            time_unit: about.time_unit.clone(),
            dtype: about.dtype.name(),
            unit: about.unit.clone(),
            convention: about.convention.name(),
            labels: about.labels.clone(),
            is_label: about.is_label,
            value_scale: about.value_scale,
            downsample: about.downsample.clone(),
            brick: BRICK,
            bricks: count.bricks,
            absent_bricks: count.absent,
            is_counted,
            oddities: about.oddities.clone(),
        }
    }

    fn rows(&self) -> Vec<(&'static str, String)> {
        let by = |sides: &[u64; 3]| sides.map(|side| side.to_string()).join(" x ");
        let version = self.version.as_ref().map(|version| format!(" {version}")).unwrap_or_default();
        let mut rows = vec![("format", format!("{}{version}", self.kind))];
        rows.extend(self.name.iter().map(|name| ("name", name.clone())));
        rows.push(("size", format!("{} voxels of {}", by(&self.size), self.dtype)));
        rows.push(("channels", self.channels.to_string()));
        rows.extend(
            self.channel_info.iter().take(MOST_NAMED).enumerate().map(|(n, channel)| ("", channel.text(n))),
        );
        let step = self.time_step.filter(|_| self.times > 1).map(|step| {
            let unit = self.time_unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default();
            format!(", {step}{unit} apart")
        });
        rows.push(("times", format!("{}{}", self.times, step.unwrap_or_default())));
        let made = self.downsample.as_ref().map(|rule| format!(" by {rule}")).unwrap_or_default();
        rows.push(("levels", format!("{} stored{made}; origins by {}", self.levels.len(), self.convention)));
        let unit = self.unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default();
        rows.extend(self.levels.iter().enumerate().map(|(n, level)| {
            let LevelSummary { path, size, scale, chunk, .. } = level;
            let scale = scale.map(|side| side.to_string()).join(" x ");
            let path = if path.is_empty() { String::new() } else { format!(" ({path})") };
            ("", format!("level {n}{path}: {} voxels of {scale}{unit}, chunks of {}", by(size), by(chunk)))
        }));
        if let Some((when, by)) = self.levels_made.zip(self.levels_made_by) {
            let when = when.replace('-', " ");
            let kept = self.levels_kept.as_ref();
            let kept = kept.map(|of| format!("; {} of {} bricks lie in the cache", of.kept, of.bricks));
            let kept = kept.unwrap_or_default();
            rows.push((
                "",
                format!("{} more down to one voxel are made {when} by {by}{kept}", self.made_levels.len()),
            ));
        }
        if !self.labels.is_empty() {
            rows.push((
                "labels",
                format!("{}; open one at labels/NAME below this path", self.labels.join(", ")),
            ));
        }
        if let Some([slope, intercept]) = self.value_scale {
            rows.push(("values", format!("mean {slope} * stored + {intercept}; stored ones are read")));
        }
        let absent = match self.absent_bricks {
            Some(absent) => format!("{absent} absent"),
            None if self.is_counted => "too many to count those that are absent".into(),
            None => "--count counts those that are absent".into(),
        };
        rows.push(("bricks", format!("{} of {} voxels a side; {absent}", self.bricks, self.brick)));
        rows.extend(self.oddities.iter().map(|oddity| ("odd", oddity.clone())));
        rows
    }

    fn text(&self) -> String {
        self.rows()
            .into_iter()
            .map(|(name, value)| format!("  {name:<10}{}", printable(&value)))
            .collect::<Vec<_>>()
            .join("\n")
    }
}

/// The levels that are made where a volume is drawn, and when; `None` if none is, or if it cannot be drawn.
fn made_levels(about: &VolumeAbout) -> Option<(Vec<MadeLevelSummary>, &'static str)> {
    let (_, levels) = levels_of(about, BRICK as u32, 1).ok()?;
    let made: Vec<MadeLevelSummary> = levels
        .levels()
        .iter()
        .filter(|level| level.stored.is_none())
        .map(|level| MadeLevelSummary { size: level.size, scale: level.scale, origin: level.origin })
        .collect();
    let when = match makes_levels_at_opening(about, &levels) {
        true => "at-opening",
        false => "in-the-background",
    };
    (!made.is_empty()).then_some((made, when))
}

impl ChannelSummary {
    fn text(&self, n: usize) -> String {
        let mut text = format!("channel {n}");
        self.name.iter().for_each(|name| text.push_str(&format!(": {name}")));
        self.color.iter().for_each(|color| text.push_str(&format!(", colour {color}")));
        self.window.iter().for_each(|[low, high]| text.push_str(&format!(", shown from {low} to {high}")));
        if self.active == Some(false) {
            text.push_str(", hidden");
        }
        text
    }
}

#[cfg(feature = "build")]
pub(super) use crop::run as crop;

/// `vastex crop`.
#[cfg(feature = "build")]
mod crop {
    use std::ops::ControlFlow;
    use std::process::ExitCode;
    use std::time::Instant;

    use anyhow::{Result, anyhow, bail};
    use serde::Serialize;
    use vastex_build::Progress;
    use vastex_volume::{Opened, VolumeAbout, VolumeCropError, VolumeRegion, open};

    use super::{no_volume, printable};
    use crate::args::CropArgs;
    use crate::commands::build::{Bar, INTERRUPTED};
    use crate::output::Output;
    use crate::report;

    /// Writes a region.
    pub(in crate::commands) fn run(args: &CropArgs, at: [i64; 3], size: [u64; 3]) -> Result<ExitCode> {
        let volume = match open(&args.source)? {
            Opened::Volume(volume) => volume,
            Opened::Images(list) => bail!(no_volume(&list)),
        };
        let about = volume.about();
        if !args.print.quiet {
            about
                .oddities
                .iter()
                .for_each(|odd| report::say(&printable(&format!("note: {}: {odd}", about.path))));
        }
        let level = level_of(about, args.level as usize)?;
        let (channel, time) = (args.channel, args.time);
        let region = volume.region_at(&VolumeRegion { level, channel, time, at: [0; 3], size }, at)?;
        let output = Output::at(&args.output.path)?;
        let bar = Bar::new(args.print.quiet);
        let begin = Instant::now();
        let mut progress = |done: u64, total: u64| -> ControlFlow<()> { bar.advance(done, total, 0) };
        let done = output.write_by(|file| vastex_volume::crop(&volume, &region, file, &mut progress));
        bar.0.finish_and_clear();
        let bytes = match done? {
            Err(VolumeCropError::Cancelled) => {
                report::say("interrupted; nothing was left behind");
                return Ok(ExitCode::from(INTERRUPTED));
            }
            Err(VolumeCropError::Output(error)) => return Err(output.refusal(&error)),
            Err(error) => return Err(error.into()),
            Ok(bytes) => bytes,
        };
        let summary = Summary {
            source: args.source.display().to_string(),
            output: args.output.path.display().to_string(),
            level: args.level,
            channel: args.channel,
            time: args.time,
            at: region.at,
            size,
            dtype: about.dtype.name(),
            bytes,
            seconds: begin.elapsed().as_secs_f64(),
        };
        args.print.summary(&summary, Summary::text)?;
        Ok(ExitCode::SUCCESS)
    }

    /// The place of a level by its number in the file: values of another level would pass for those of one
    /// that cannot be read.
    fn level_of(about: &VolumeAbout, number: usize) -> Result<usize> {
        about.level_numbered(number).map_err(|error| {
            let is_left_out = |number: &usize| about.left_out.iter().any(|left| left.number == *number);
            let finest = (0..).find(|number| !is_left_out(number)).unwrap_or(0);
            match is_left_out(&number) {
                true => anyhow!(
                    "{error}; so level {number} of {} cannot be read. The finest one that can be read is --level {finest}",
                    about.path
                ),
                false => error.into(),
            }
        })
    }

    /// What `--json` prints.
    #[derive(Serialize)]
    struct Summary {
        source: String,
        output: String,
        level: u32,
        channel: u64,
        time: u64,
        /// The first voxel: x, y and z.
        at: [u64; 3],
        /// Voxels along x, y and z.
        size: [u64; 3],
        /// As NumPy names it.
        dtype: &'static str,
        /// Of the output.
        bytes: u64,
        seconds: f64,
    }

    impl Summary {
        fn text(&self) -> String {
            let Summary {
                output, level, channel, time, size: [width, height, depth], dtype, seconds, ..
            } = self;
            let bytes = report::bytes(self.bytes);
            format!(
                "{output}: {width}x{height}x{depth} voxels of level {level}, channel {channel}, time {time}, of {dtype}; {bytes} in \
                 {seconds:.1} s"
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_counting_cannot_count_does_not_name_it_as_the_remedy() {
        let directory = tempfile::tempdir().unwrap();
        let (side, chunk) = (1_u64 << 31, 1024);
        let meta = format!(
            "{{\"zarr_format\":2,\"shape\":[{side},{side},{side}],\"chunks\":[{chunk},{chunk},{chunk}],\"dtype\":\"|u1\",\
             \"compressor\":null,\"filters\":null,\"order\":\"C\",\"fill_value\":0,\"dimension_separator\":\"/\"}}"
        );
        std::fs::write(directory.path().join(".zarray"), meta).unwrap();
        let Opened::Volume(volume) = open_placed(directory.path(), None).unwrap() else { panic!("a volume") };
        for (is_counted, says) in [
            (false, "; --count counts those that are absent"),
            (true, "; too many to count those that are absent"),
        ] {
            let count = pollster::block_on(volume.count_bricks(is_counted)).unwrap();
            let rows = Summary::new(volume.about(), count, is_counted).rows();
            let (_, bricks) = rows.iter().find(|(name, _)| *name == "bricks").unwrap();
            assert!(bricks.ends_with(says), "{bricks}");
        }
    }
}
