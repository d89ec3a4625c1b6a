//! An OME-Zarr as the output: an array for each level, chunk by chunk or shard by shard, metadata at the end.

mod arrays;
mod codec;
mod metadata;

use std::path::{Path, PathBuf};

use serde_json::Value;
use vastex_volume::{Reduction, Volume, crc32c};

use super::block::{Beyond, Block};
use super::error::VolumeBuildError;
use super::levels::Level;
use super::sink::{Counts, Place, Sink, Stop};
use crate::new_directory::NewDirectory;
use crate::threads;
use arrays::{Array, Arrays, Axes, sayable};

pub use arrays::ZarrVersion;
pub use codec::ZarrCodec;

/// Files of a level: what more is claims of damaged metadata.
const MOST_FILES: u64 = 1 << 31;
/// Bytes of metadata that are looked at to tell who made a directory.
const MOST_METADATA: u64 = 8 << 20;

/// How an OME-Zarr is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ZarrOptions {
    /// Of the format.
    pub version: ZarrVersion,
    /// Voxels of a chunk along x, y and z, at least 1 each.
    pub chunk: [u64; 3],
    /// Chunks along each axis of a shard, which is one file; 1 for a file for each chunk.
    pub shards: u64,
    /// How chunks are compressed.
    pub codec: ZarrCodec,
}

impl Default for ZarrOptions {
    fn default() -> ZarrOptions {
        ZarrOptions { version: ZarrVersion::V05, chunk: [64; 3], shards: 1, codec: ZarrCodec::Zstd(3) }
    }
}

impl ZarrOptions {
    /// The levels that chunks of this size make enough of: the last one is a chunk.
    pub(super) fn is_enough(&self, size: [u64; 3]) -> bool {
        (0..3).all(|axis| size[axis] <= self.chunk[axis])
    }

    /// What does not go together, or not with a volume of this size, in so many channels and times.
    pub(super) fn check(&self, size: [u64; 3], textures: u64) -> Result<(), String> {
        if self.shards > 1 && self.version == ZarrVersion::V04 {
            return Err("OME-Zarr 0.4 has no shards; leave out --shards, or write 0.5".into());
        }
        if self.chunk.contains(&0) || self.shards == 0 {
            return Err("chunks and shards have at least one voxel and one chunk along each axis".into());
        }
        let along = |axis: usize| size[axis].div_ceil(self.chunk[axis].saturating_mul(self.shards));
        let files = (0..3).fold(textures, |files, axis| files.saturating_mul(along(axis)));
        match files > MOST_FILES {
            true => Err(format!(
                "the finest level would have {files} files, and at most {MOST_FILES} are written; are the sizes of the volume \
                 right? Else make chunks larger by --page, or write shards by --shards"
            )),
            false => Ok(()),
        }
    }
}

/// The directory of an OME-Zarr, with one image or an image and its labels.
pub(super) fn new_directory(output: &Path) -> Result<NewDirectory, VolumeBuildError> {
    Ok(NewDirectory::create(output, is_ours)?)
}

/// Returns true if a directory is an OME-Zarr that was made here, so that it may be replaced.
fn is_ours(path: &Path) -> bool {
    ["zarr.json", ".zattrs"].iter().any(|name| {
        let file = path.join(name);
        let is_short = file.metadata().is_ok_and(|found| found.is_file() && found.len() <= MOST_METADATA);
        let said = is_short.then(|| std::fs::read(&file).ok()).flatten();
        let said = said.and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
        said.is_some_and(|said| metadata::is_ours(&said))
    })
}

/// Writes one image of it.
pub(super) struct ZarrSink<'a> {
    directory: &'a NewDirectory,
    /// Where the image lies in the directory.
    prefix: PathBuf,
    common: Arrays,
    arrays: Vec<Array>,
    counts: Counts,
}

impl<'a> ZarrSink<'a> {
    /// Begins an image at a place in the directory.
    pub(super) fn new(
        directory: &'a NewDirectory,
        prefix: impl Into<PathBuf>,
        volume: &Volume,
        levels: &[Level],
        options: &ZarrOptions,
    ) -> ZarrSink<'a> {
        let about = volume.about();
        let common = Arrays {
            version: options.version,
            axes: Axes {
                has_time: about.times > 1,
                has_channel: about.channels > 1 || !about.channel_info.is_empty(),
            },
            channels: about.channels,
            times: about.times,
            dtype: about.dtype,
            fill: sayable(about.dtype, volume.fill()),
            codec: options.codec,
        };
        let array = |level| Array::new(level, options.chunk, options.shards);
        let arrays = levels.iter().map(array).collect();
        ZarrSink { directory, prefix: prefix.into(), common, arrays, counts: Counts::default() }
    }

    /// Writes the metadata of the image and of its arrays.
    pub(super) fn finish(
        &self,
        volume: &Volume,
        levels: &[Level],
        rule: Reduction,
        name: &str,
    ) -> Result<(), VolumeBuildError> {
        for (number, array) in self.arrays.iter().enumerate() {
            let (file, said) = self.common.metadata(array);
            write_json(self.directory, &self.prefix.join(number.to_string()).join(file), &said)?;
        }
        let said = metadata::image(volume.about(), &self.common, levels, rule, name);
        write_group(self.directory, &self.prefix, self.common.version, Some(said))
    }

    /// The bytes of a file at a place, if it holds anything but the fill value; and how many of its chunks
    /// do.
    fn file(&self, array: &Array, at: [u64; 3], block: &Block) -> Result<Option<Vec<u8>>, String> {
        let counts = array.chunks_of_file();
        let width = self.common.dtype.bytes();
        let sides = array.chunk.map(|side| side as usize);
        let encoded = |chunk: [u64; 3]| {
            // What lies beyond the edge holds nothing.
            if (0..3).any(|axis| chunk[axis] * array.chunk[axis] >= array.size[axis]) {
                return Ok(None);
            }
            let first = std::array::from_fn(|axis| (chunk[axis] * array.chunk[axis]) as i64);
            let values = block.cut(first, sides, width, Beyond::Fill(&self.common.fill));
            match is_filled(&values, &self.common.fill) {
                true => Ok(None),
                false => self.common.codec.encode(values).map(Some),
            }
        };
        if array.shard.is_none() {
            return encoded(at);
        }
        let mut bytes = Vec::new();
        let mut index = Vec::new();
        for z in 0..counts[2] {
            for y in 0..counts[1] {
                for x in 0..counts[0] {
                    let within = [x, y, z];
                    let chunk = std::array::from_fn(|axis| at[axis] * counts[axis] + within[axis]);
                    let entry = match encoded(chunk)? {
                        None => [u64::MAX; 2],
                        Some(chunk) => {
                            let entry = [bytes.len() as u64, chunk.len() as u64];
                            bytes.extend(chunk);
                            entry
                        }
                    };
                    index.extend(entry.map(u64::to_le_bytes).concat());
                }
            }
        }
        if bytes.is_empty() {
            return Ok(None);
        }
        let sum = crc32c(&index);
        bytes.extend(index);
        bytes.extend(sum.to_le_bytes());
        Ok(Some(bytes))
    }
}

/// Returns true if values are all the fill value.
fn is_filled(values: &[u8], fill: &[u8]) -> bool {
    // Each equals the next exactly if all equal themselves shifted by one.
    values.starts_with(fill) && values[fill.len()..] == values[..values.len() - fill.len()]
}

impl Sink for ZarrSink<'_> {
    fn quantum(&self, level: usize) -> [u64; 3] {
        self.arrays[level].file()
    }

    fn border(&self) -> u64 {
        0
    }

    fn by_block(&self) -> usize {
        self.arrays.len()
    }

    fn write(&mut self, place: Place, block: &Block, stop: &Stop) -> Result<(), VolumeBuildError> {
        let array = &self.arrays[place.level];
        let sides = array.file();
        let range =
            |axis: usize| block.inner[0][axis] / sides[axis]..block.inner[1][axis].div_ceil(sides[axis]);
        let mut files = Vec::new();
        for z in range(2) {
            for y in range(1) {
                files.extend(range(0).map(|x| [x, y, z]));
            }
        }
        let level = self.prefix.join(place.level.to_string());
        let written = threads::try_map(files, |at| {
            stop.check()?;
            let path = level.join(self.common.key(place.channel, place.time, at));
            let file = self.file(array, at, block);
            let file =
                file.map_err(|why| VolumeBuildError::Output { path: self.directory.path(&path), why })?;
            let Some(bytes) = file else { return Ok::<_, VolumeBuildError>(None) };
            self.directory.write_deep(&path, &bytes)?;
            Ok(Some(bytes.len() as u64))
        })?;
        for bytes in written {
            match bytes {
                Some(bytes) => {
                    self.counts.pieces += 1;
                    self.counts.bytes += bytes;
                }
                None => self.counts.empty += 1,
            }
        }
        Ok(())
    }

    fn write_rest(&mut self, _: Place, _: Block) -> Result<(), VolumeBuildError> {
        // All levels come in parts.
        Ok(())
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}

/// Writes the group that lists labels beside an image.
pub(super) fn write_labels(
    directory: &NewDirectory,
    version: ZarrVersion,
    names: &[String],
) -> Result<(), VolumeBuildError> {
    let said = serde_json::json!({ "labels": names });
    write_group(directory, Path::new("labels"), version, Some(said))
}

fn write_group(
    directory: &NewDirectory,
    place: &Path,
    version: ZarrVersion,
    said: Option<Value>,
) -> Result<(), VolumeBuildError> {
    for (file, said) in metadata::group(version, said) {
        write_json(directory, &place.join(file), &said)?;
    }
    Ok(())
}

fn write_json(directory: &NewDirectory, path: &Path, said: &Value) -> Result<(), VolumeBuildError> {
    let text = serde_json::to_string_pretty(said)
        .map_err(|error| VolumeBuildError::Output { path: directory.path(path), why: error.to_string() })?;
    Ok(directory.write_deep(path, text.as_bytes())?)
}
