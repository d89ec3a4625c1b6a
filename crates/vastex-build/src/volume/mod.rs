//! From a volume to a container or an OME-Zarr with all levels, in one pass, block by block.
//!
//! [`build_volume`] reads whatever `vastex-volume` opens. A *block* of the finest level is read by as many
//! threads as there are and halved in memory as often as whole bricks (or chunks, or shards) come out of it;
//! what is left of it is a part of a coarser level, which is passed over in the same way (`plan`). So memory
//! depends on what is written at once, and not on the volume. The bytes written depend on the volume and the
//! options, not on the number of threads.

mod block;
mod container;
mod error;
mod levels;
mod pass;
mod plan;
mod reading;
mod scratch;
mod sink;
mod zarr;

use std::path::{Path, PathBuf};

use rayon::ThreadPool;
use vastex_tiles::{lies_in, same_file};
use vastex_volume::{
    Convention, DType, LevelLeftOut, Opened, Reduction, Volume, VolumeAbout, VolumeError, files_of_volume,
    open_placed,
};

use crate::progress::Progress;
use crate::threads;
use container::ContainerSink;
use levels::{Level, levels};
use pass::{Pass, Track};
use reading::Reading;
use sink::{Counts, Sink, Stop};
use zarr::ZarrSink;

pub use container::ContainerOptions;
pub use error::VolumeBuildError;
pub use zarr::{ZarrCodec, ZarrOptions, ZarrVersion};

/// Images of a list that are named.
const MOST_NAMED: usize = 20;

/// What is made of a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeFormat {
    /// A container, with levels down to one voxel.
    Container(ContainerOptions),
    /// A directory of OME-Zarr, with levels down to one chunk.
    Zarr(ZarrOptions),
}

/// How a volume is built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VolumeOptions {
    /// What is made of it.
    pub format: VolumeFormat,
    /// How coarser levels are made; `None` for [`Reduction::Majority`] of labels, else [`Reduction::Mean`].
    /// Labels beside the image always go by majority.
    pub downsample: Option<Reduction>,
    /// True if z is left as it is while its voxels are larger than those along x and y; else all axes are
    /// halved alike.
    pub keep_z: bool,
    /// What translations of the levels of an OME-Zarr are of; `None` for what its metadata look like. Of
    /// other volumes it is refused.
    pub convention: Option<Convention>,
    /// Threads that read, halve and encode; 0 for one for each core.
    pub threads: usize,
    /// True if chunks that cannot be read become the fill value, with a note.
    pub tolerant: bool,
    /// Bytes of memory that blocks and what is made of them may take, besides up to 512 MiB of chunks and
    /// levels that are kept; of chunks that have more than 256 MiB by themselves up to 1 GiB are kept as
    /// well, and up to 1 GiB is being decoded.
    pub memory_limit: u64,
}

impl Default for VolumeOptions {
    fn default() -> VolumeOptions {
        VolumeOptions {
            format: VolumeFormat::Container(ContainerOptions::default()),
            downsample: None,
            keep_z: false,
            convention: None,
            threads: 0,
            tolerant: false,
            memory_limit: 4 << 30,
        }
    }
}

/// What was built.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeReport {
    /// What the values are.
    pub dtype: DType,
    /// Voxels along x, y and z of each level, the finest first.
    pub levels: Vec<[u64; 3]>,
    /// How many channels there are.
    pub channels: u64,
    /// How many times there are.
    pub times: u64,
    /// How coarser levels were made.
    pub downsample: Reduction,
    /// Images of labels that were built beside the image.
    pub labels: Vec<String>,
    /// Bricks, chunks or shards that have bytes of their own, labels included.
    pub pieces: u64,
    /// Bricks, chunks or shards that hold one value alone (of OME-Zarr: the fill value), and take no room.
    pub empty: u64,
    /// Bytes written.
    pub bytes: u64,
    /// Voxels read, labels included.
    pub voxels: u64,
    /// What was odd, left out or damaged; a sentence each.
    pub notes: Vec<String>,
}

/// Makes a container or an OME-Zarr of the volume at a path, with all levels, channels and times, and the
/// labels beside it where the output has a place for them.
///
/// The output appears when it is whole. A container replaces a file that is there; a directory replaces only
/// an empty one, or an OME-Zarr that was made here. After an error or a cancellation nothing is left behind.
/// Takes the memory that [`VolumeOptions::memory_limit`] says, whatever the size of the volume.
pub fn build_volume(
    input: &Path,
    output: &Path,
    options: &VolumeOptions,
    progress: &dyn Progress,
) -> Result<VolumeReport, VolumeBuildError> {
    let volume = open_one(input, options.convention)?;
    check_place(input, output)?;
    check_finest(volume.about())?;
    let pool = threads::pool(options.threads)?;
    Build { output, options, progress, pool: &pool, notes: Vec::new() }.run(&volume)
}

/// Opens a volume; what lists several is refused.
fn open_one(path: &Path, convention: Option<Convention>) -> Result<Volume, VolumeBuildError> {
    match open_placed(path, convention)? {
        Opened::Volume(volume) => Ok(*volume),
        Opened::Images(list) => {
            let named: Vec<&str> = list.images.iter().take(MOST_NAMED).map(String::as_str).collect();
            Err(VolumeBuildError::Images { path: list.path, what: list.what, images: named.join(", ") })
        }
    }
}

/// Refuses a volume without its finest level: what is made of a coarser one would pass for the whole.
fn check_finest(about: &VolumeAbout) -> Result<(), VolumeBuildError> {
    let refused = |left: &LevelLeftOut| {
        let (path, error) = (about.path.clone(), left.error.clone());
        Err(VolumeBuildError::FinestLeftOut { path, level: left.path.clone(), error })
    };
    about.finest_left_out().map_or(Ok(()), refused)
}

/// Refuses an output that is one of the files of the input, lies in its directory, or has one of them in
/// itself.
fn check_place(input: &Path, output: &Path) -> Result<(), VolumeBuildError> {
    let meets = |file: &PathBuf| same_file(file, output) || lies_in(output, file) || lies_in(file, output);
    match files_of_volume(input).iter().any(meets) {
        true => Err(VolumeBuildError::Place { output: output.into(), input: input.into() }),
        false => Ok(()),
    }
}

struct Build<'a> {
    output: &'a Path,
    options: &'a VolumeOptions,
    progress: &'a dyn Progress,
    pool: &'a ThreadPool,
    notes: Vec<String>,
}

impl<'a> Build<'a> {
    fn run(&mut self, volume: &Volume) -> Result<VolumeReport, VolumeBuildError> {
        let about = volume.about();
        let rule = self.rule_of(volume)?;
        self.notes.extend(about.oddities.iter().map(|odd| format!("{}: {odd}", about.path)));
        match self.options.format {
            VolumeFormat::Container(options) => self.container(volume, rule, &options),
            VolumeFormat::Zarr(options) => self.zarr(volume, rule, &options),
        }
    }

    fn rule_of(&self, volume: &Volume) -> Result<Reduction, VolumeBuildError> {
        let about = volume.about();
        match self.options.downsample.unwrap_or(Reduction::usual(about.is_label)) {
            Reduction::Mean if about.is_label => Err(VolumeBuildError::Options(format!(
                "{}: is an image of labels, whose means would be labels of nothing; use --downsample majority",
                about.path
            ))),
            rule => Ok(rule),
        }
    }

    fn levels_of(
        &self,
        volume: &Volume,
        enough: impl Fn([u64; 3]) -> bool,
    ) -> Result<Vec<Level>, VolumeBuildError> {
        let finest = &volume.about().levels[0];
        levels(finest.size, finest.scale, self.options.keep_z, enough).ok_or_else(|| {
            VolumeBuildError::Options(format!(
                "{}: has sides for which there would be more than 32 levels; leave out --keep-z",
                volume.about().path
            ))
        })
    }

    fn container(
        &mut self,
        volume: &Volume,
        rule: Reduction,
        options: &ContainerOptions,
    ) -> Result<VolumeReport, VolumeBuildError> {
        let about = volume.about();
        let levels = self.levels_of(volume, |size| size == [1; 3])?;
        if !about.labels.is_empty() {
            self.notes.push(format!(
                "{}: labels are left out ({}), since a container holds one image; build each from its path, {}",
                about.path,
                about.labels.join(", "),
                about.labels_at("NAME").display()
            ));
        }
        let mut sink = ContainerSink::create(self.output, volume, &levels, rule, options)?;
        let mut track = self.track(rows_of(volume));
        self.pass(volume, &levels, rule, &mut sink, &mut track)?;
        let counts = sink.counts();
        let written = sink.finish()?;
        Ok(self.report(volume, rule, &levels, Counts { bytes: written.bytes, ..counts }))
    }

    fn zarr(
        &mut self,
        volume: &Volume,
        rule: Reduction,
        options: &ZarrOptions,
    ) -> Result<VolumeReport, VolumeBuildError> {
        let about = volume.about();
        let textures = about.channels.saturating_mul(about.times);
        options
            .check(about.size(), textures)
            .map_err(|why| VolumeBuildError::Options(format!("{}: {why}", about.path)))?;
        if let Some([slope, intercept]) = about.value_scale {
            self.notes.push(format!(
                "{}: its values mean {slope} * stored + {intercept}; OME-Zarr has no place for that, so it is left out",
                about.path
            ));
        }
        let enough = |size| options.is_enough(size);
        let levels = self.levels_of(volume, enough)?;
        let labels = self.open_labels(volume);
        let mut rows = rows_of(volume);
        labels.iter().for_each(|(_, label)| rows = rows.saturating_add(rows_of(label)));
        let directory = zarr::new_directory(self.output)?;
        let mut track = self.track(rows);
        let name = self.output.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into());
        let mut sink = ZarrSink::new(&directory, "", volume, &levels, options);
        self.pass(volume, &levels, rule, &mut sink, &mut track)?;
        sink.finish(volume, &levels, rule, &name)?;
        let mut counts = sink.counts();
        for (name, label) in &labels {
            track.bytes = counts.bytes;
            let levels = self.levels_of(label, enough)?;
            let mut sink =
                ZarrSink::new(&directory, PathBuf::from("labels").join(name), label, &levels, options);
            self.pass(label, &levels, Reduction::Majority, &mut sink, &mut track)?;
            sink.finish(label, &levels, Reduction::Majority, name)?;
            let of_label = sink.counts();
            counts.pieces += of_label.pieces;
            counts.empty += of_label.empty;
            counts.bytes += of_label.bytes;
        }
        let names: Vec<String> = labels.iter().map(|(name, _)| name.clone()).collect();
        if !names.is_empty() {
            zarr::write_labels(&directory, options.version, &names)?;
        }
        directory.put_in_place()?;
        let voxels = labels.iter().map(|(_, label)| voxels_of(label)).sum::<u64>();
        let report = self.report(volume, rule, &levels, counts);
        Ok(VolumeReport { labels: names, voxels: report.voxels.saturating_add(voxels), ..report })
    }

    /// The labels beside an image; those that cannot be opened are said and left out.
    fn open_labels(&mut self, volume: &Volume) -> Vec<(String, Volume)> {
        let mut opened = Vec::new();
        for name in &volume.about().labels {
            let is_plain = !name.is_empty() && name.split('/').all(|part| !matches!(part, "" | "." | ".."));
            let found: Result<Opened, VolumeError> = match is_plain {
                true => open_placed(&volume.about().labels_at(name), self.options.convention),
                false => continue,
            };
            match found {
                Ok(Opened::Volume(label)) => {
                    if let Err(error) = check_finest(label.about()) {
                        self.notes.push(format!("{error}; these labels are left out"));
                        continue;
                    }
                    let odd = &label.about().oddities;
                    self.notes.extend(odd.iter().map(|odd| format!("{}: {odd}", label.about().path)));
                    opened.push((name.clone(), *label));
                }
                Ok(Opened::Images(list)) => {
                    self.notes
                        .push(format!("{}: is {}, and is left out of the labels", list.path, list.what));
                }
                Err(error) => self.notes.push(format!("{error}; these labels are left out")),
            }
        }
        opened
    }

    fn track(&self, rows_total: u64) -> Track<'a> {
        Track { progress: self.progress, rows: 0.0, rows_total, bytes: 0 }
    }

    fn pass(
        &mut self,
        volume: &Volume,
        levels: &[Level],
        rule: Reduction,
        sink: &mut dyn Sink,
        track: &mut Track<'_>,
    ) -> Result<(), VolumeBuildError> {
        let stop = Stop::default();
        let reading = Reading::new(volume, self.options.tolerant, &stop);
        let memory = self.options.memory_limit;
        let (output, pool) = (self.output, self.pool);
        let pass = Pass { volume, levels, rule, reading: &reading, pool, output, memory, stop: &stop };
        pass.run(sink, track)?;
        let damage = reading.into_damage();
        let more = damage.count - damage.named.len() as u64;
        let filled = |error: String| format!("{error}; what is missing there is filled");
        self.notes.extend(damage.named.into_iter().map(filled));
        if more > 0 {
            self.notes.push(format!("{more} more chunks could not be read and are filled"));
        }
        Ok(())
    }

    fn report(&mut self, volume: &Volume, rule: Reduction, levels: &[Level], counts: Counts) -> VolumeReport {
        let about = volume.about();
        VolumeReport {
            dtype: about.dtype,
            levels: levels.iter().map(|level| level.size).collect(),
            channels: about.channels,
            times: about.times,
            downsample: rule,
            labels: Vec::new(),
            pieces: counts.pieces,
            empty: counts.empty,
            bytes: counts.bytes,
            voxels: voxels_of(volume),
            notes: std::mem::take(&mut self.notes),
        }
    }
}

/// Rows of voxels of the finest level, in all channels and times.
fn rows_of(volume: &Volume) -> u64 {
    let about = volume.about();
    let [_, height, depth] = about.size();
    [height, depth, about.channels, about.times].into_iter().fold(1, u64::saturating_mul)
}

fn voxels_of(volume: &Volume) -> u64 {
    rows_of(volume).saturating_mul(volume.about().size()[0])
}
