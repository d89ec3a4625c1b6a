//! Raw volumes: values and nothing else, with a description beside them.
//!
//! `NAME.raw` is described by `NAME.raw.toml`; either can be named. What is an image and what a volume is
//! told by `depth`.
//!
//! | key | is | without it |
//! |---|---|---|
//! | `width`, `height`, `depth` | voxels along x, y and z | must be there |
//! | `sample` | `u8`, `i8`, `u16`, `i16`, `u32`, `i32`, `u64`, `i64`, `f16`, `f32`, `f64` | must be there |
//! | `channels`, `times` | how many there are | 1 |
//! | `endian` | `little` or `big` | `little` |
//! | `offset` | bytes before the first value | 0 |
//! | `order` | `interleaved`: the channels of a voxel side by side, or `planar`: all of one channel, then of the next | `interleaved` |
//! | `scale`, `unit` | sides of a voxel along x, y and z, and in what | 1, none |

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;
use vastex_tiles::{raw_description, raw_file, read_advice};

use super::array::{FlatArray, Layout, Place};
use crate::chunks::{AxisMap, Grid};
use crate::fault::{VolumeError, VolumeFault, damaged};
use crate::values::DType;
use crate::volume::{Convention, LevelArray, Volume, VolumeAbout, VolumeLevel};

/// Bytes that a description may have.
const MAX_TEXT: u64 = 64 << 10;
/// Values along an axis: as many as a texture may have.
const MOST_SIDE: u64 = 1 << 31;

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Endian {
    #[default]
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Order {
    #[default]
    Interleaved,
    Planar,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    width: u64,
    height: u64,
    depth: u64,
    sample: String,
    #[serde(default = "one")]
    channels: u64,
    #[serde(default = "one")]
    times: u64,
    #[serde(default)]
    endian: Endian,
    #[serde(default)]
    offset: u64,
    #[serde(default)]
    order: Order,
    scale: Option<[f64; 3]>,
    unit: Option<String>,
}

fn one() -> u64 {
    1
}

fn text_of(raw: &Path) -> Option<String> {
    let (path, mut text) = (raw_description(raw), String::new());
    // Looked at before it is opened: opening a pipe waits for somebody who writes to it.
    std::fs::metadata(&path).ok().filter(std::fs::Metadata::is_file)?;
    std::fs::File::open(&path).ok()?.take(MAX_TEXT).read_to_string(&mut text).ok()?;
    Some(text)
}

/// Returns true if a path is a raw file whose description has a depth.
pub(crate) fn is_raw_volume(path: &Path) -> bool {
    let table = raw_file(path).and_then(|raw| text_of(&raw)?.parse::<toml::Table>().ok());
    table.is_some_and(|table| table.contains_key("depth"))
}

/// Opens a raw volume.
pub(crate) fn open_raw(path: &Path) -> Result<Volume, VolumeError> {
    let raw = raw_file(path).unwrap_or_else(|| path.to_owned());
    let description = raw_description(&raw);
    let at = |fault: VolumeFault| fault.at(description.display().to_string());
    let text = text_of(&raw)
        .ok_or_else(|| at(VolumeFault::Read("there is no such file, or it is no text".into())))?;
    let said: Description = toml::from_str(&text).map_err(|error| at(damaged(error.message().to_owned())))?;
    let dtype = dtype_named(&said.sample).ok_or_else(|| {
        let why = format!(
            "'{}' is no kind of value; write u8, i8, u16, i16, u32, i32, u64, i64, f16, f32 or f64",
            said.sample
        );
        at(damaged(why))
    })?;
    let sides = [said.width, said.height, said.depth, said.channels, said.times];
    if sides.iter().any(|side| *side == 0 || *side > MOST_SIDE) {
        return Err(at(damaged(format!(
            "width, height, depth, channels and times are 1 to {MOST_SIDE}, and here {sides:?}"
        ))));
    }
    let scale = said.scale.unwrap_or([1.0; 3]);
    if !scale.iter().all(|side| side.is_normal() && *side > 0.0) {
        return Err(at(damaged("scale has three numbers above 0, along x, y and z")));
    }
    let (shape, axes) = match said.order {
        Order::Interleaved => (
            vec![said.times, said.depth, said.height, said.width, said.channels],
            AxisMap { x: 3, y: 2, z: Some(1), channel: Some(4), time: Some(0) },
        ),
        Order::Planar => (
            vec![said.times, said.channels, said.depth, said.height, said.width],
            AxisMap { x: 4, y: 3, z: Some(2), channel: Some(1), time: Some(0) },
        ),
    };
    let layout = Layout { offset: said.offset, dtype, is_big_endian: said.endian == Endian::Big, shape };
    let len = std::fs::metadata(&raw)
        .map_err(|error| VolumeFault::Read(read_advice(&error)).at(raw.display().to_string()))?
        .len();
    let expected = layout.bytes().map(|bytes| bytes + said.offset);
    if expected != Some(len) {
        let expected = expected.map_or("more than any file has".into(), |bytes| bytes.to_string());
        return Err(damaged(format!(
            "has {len} bytes where its description makes {expected}; correct width, height, depth, sample, channels, times or \
             offset in the .toml file beside it"
        ))
        .at(raw.display().to_string()));
    }
    let grid = Grid { shape: layout.shape.clone(), chunk: layout.chunk(), axes };
    let level = VolumeLevel {
        path: String::new(),
        size: grid.size(),
        scale,
        origin: [0.0; 3],
        chunk: grid.chunk_size(),
    };
    let about = VolumeAbout {
        path: raw.display().to_string(),
        kind: "raw",
        version: None,
        name: None,
        dtype,
        levels: vec![level],
        channels: said.channels,
        channel_info: Vec::new(),
        times: said.times,
        unit: said.unit,
        convention: Convention::Corner,
        labels: Vec::new(),
        root: PathBuf::new(),
        is_label: false,
        label_colors: Vec::new(),
        value_scale: None,
        downsample: None,
        left_out: Vec::new(),
        time_step: None,
        time_unit: None,
        oddities: Vec::new(),
    };
    let source = Arc::new(FlatArray::new(Place::Plain(raw), layout));
    Ok(Volume::new(about, vec![LevelArray { dtype, grid, source }]))
}

fn dtype_named(sample: &str) -> Option<DType> {
    Some(match sample {
        "u8" => DType::U8,
        "i8" => DType::I8,
        "u16" => DType::U16,
        "i16" => DType::I16,
        "u32" => DType::U32,
        "i32" => DType::I32,
        "u64" => DType::U64,
        "i64" => DType::I64,
        "f16" => DType::F16,
        "f32" => DType::F32,
        "f64" => DType::F64,
        _ => return None,
    })
}
