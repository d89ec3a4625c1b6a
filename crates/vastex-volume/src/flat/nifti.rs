//! NIfTI, versions 1 and 2: one file, gzipped or not, or a header with its image beside it. Values are as
//! they are stored: what `scl_slope` makes of them is said, not applied, and no orientation either.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vastex_tiles::read_advice;

use super::array::{FlatArray, Layout, Place};
use crate::chunks::{AxisMap, Grid};
use crate::fault::{VolumeError, VolumeFault, damaged, unsupported};
use crate::values::DType;
use crate::volume::{Convention, LevelArray, Volume, VolumeAbout, VolumeLevel};

/// Bytes of a header of version 1, and of version 2.
const V1: usize = 348;
const V2: usize = 540;
/// Values along an axis: as many as a texture may have.
const MOST_SIDE: i64 = 1 << 31;
/// Bytes of a gzipped file's values, which are inflated whole.
const MOST_INFLATED: u64 = 2 << 30;
/// Values of several bytes that are read as so many channels of one.
const RGB: i16 = 128;
const RGBA: i16 = 2304;

struct Header {
    version: u8,
    is_big_endian: bool,
    /// True if the values lie in a file of their own.
    is_pair: bool,
    dims: [i64; 8],
    datatype: i16,
    steps: [f64; 8],
    offset: f64,
    slope: f64,
    intercept: f64,
    units: u8,
    name: String,
}

/// Returns true if a file is one of NIfTI, by its first bytes, inflated where they must be.
pub(crate) fn is_nifti(path: &Path) -> bool {
    start_of(path).is_ok_and(|(start, _)| read_header(&start).is_some())
}

/// Returns true if a file is a header whose values lie in a file of their own.
fn is_of_pair(path: &Path) -> bool {
    let header = start_of(path).ok().and_then(|(start, _)| read_header(&start));
    header.is_some_and(|header| header.is_pair)
}

/// The bytes of a header, and whether the file is gzipped.
fn start_of(path: &Path) -> io::Result<(Vec<u8>, bool)> {
    let mut start = Vec::new();
    let mut file = File::open(path)?;
    (&mut file).take(V2 as u64).read_to_end(&mut start)?;
    if !start.starts_with(&[0x1f, 0x8b]) {
        return Ok((start, false));
    }
    let mut inflated = Vec::new();
    flate2::read::MultiGzDecoder::new(io::BufReader::new(File::open(path)?))
        .take(V2 as u64)
        .read_to_end(&mut inflated)?;
    Ok((inflated, true))
}

/// A field of a header, in its byte order.
macro_rules! field {
    ($bytes:expr, $is_big:expr, $at:expr, $kind:ty) => {{
        let bytes: [u8; size_of::<$kind>()] = *$bytes.get($at..)?.first_chunk()?;
        if $is_big { <$kind>::from_be_bytes(bytes) } else { <$kind>::from_le_bytes(bytes) }
    }};
}

fn read_header(bytes: &[u8]) -> Option<Header> {
    let size: [u8; 4] = *bytes.first_chunk()?;
    let is_big = match (i32::from_le_bytes(size), i32::from_be_bytes(size)) {
        (348 | 540, _) => false,
        (_, 348 | 540) => true,
        _ => return None,
    };
    if field!(bytes, is_big, 0, i32) == V1 as i32 {
        let magic = bytes.get(344..347)?;
        let mut header = Header {
            version: 1,
            is_big_endian: is_big,
            is_pair: magic == b"ni1",
            dims: [0; 8],
            datatype: field!(bytes, is_big, 70, i16),
            steps: [0.0; 8],
            offset: field!(bytes, is_big, 108, f32).into(),
            slope: field!(bytes, is_big, 112, f32).into(),
            intercept: field!(bytes, is_big, 116, f32).into(),
            units: *bytes.get(123)?,
            name: words(bytes.get(148..228)?),
        };
        for n in 0..8 {
            header.dims[n] = field!(bytes, is_big, 40 + 2 * n, i16).into();
            header.steps[n] = field!(bytes, is_big, 76 + 4 * n, f32).into();
        }
        return (magic == b"n+1" || magic == b"ni1").then_some(header);
    }
    let magic = bytes.get(4..7)?;
    let mut header = Header {
        version: 2,
        is_big_endian: is_big,
        is_pair: magic == b"ni2",
        dims: [0; 8],
        datatype: field!(bytes, is_big, 12, i16),
        steps: [0.0; 8],
        offset: field!(bytes, is_big, 168, i64) as f64,
        slope: field!(bytes, is_big, 176, f64),
        intercept: field!(bytes, is_big, 184, f64),
        units: field!(bytes, is_big, 500, i32) as u8,
        name: words(bytes.get(240..320)?),
    };
    for n in 0..8 {
        header.dims[n] = field!(bytes, is_big, 16 + 8 * n, i64);
        header.steps[n] = field!(bytes, is_big, 104 + 8 * n, f64);
    }
    (magic == b"n+2" || magic == b"ni2").then_some(header)
}

fn words(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).trim().to_owned()
}

/// Opens a file of NIfTI, or the header of a pair.
pub(crate) fn open_nifti(path: &Path) -> Result<Volume, VolumeError> {
    let at = |fault: VolumeFault| fault.at(path.display().to_string());
    let (start, is_gzip) = start_of(path).map_err(|error| at(VolumeFault::Read(read_advice(&error))))?;
    let header =
        read_header(&start).ok_or_else(|| at(damaged("is no file of NIfTI: its header is cut off")))?;
    let mut oddities = Vec::new();
    let sides = sides(&header, &mut oddities).map_err(at)?;
    let (dtype, samples) = dtype_of(header.datatype).map_err(at)?;
    let (values, is_gzip) =
        if header.is_pair { image_of(path).map_err(at)? } else { (path.to_owned(), is_gzip) };
    let layout = Layout {
        offset: offset(&header, &mut oddities).map_err(at)?,
        dtype,
        is_big_endian: header.is_big_endian,
        // The fifth axis is slower than time; values of a voxel lie side by side.
        shape: vec![sides[4], sides[3], sides[2], sides[1], sides[0], samples],
    };
    let bytes = layout
        .bytes()
        .ok_or_else(|| at(damaged(format!("claims {sides:?} voxels, more than a file can have"))))?;
    if is_gzip && bytes > MOST_INFLATED {
        let why = format!(
            "has {bytes} bytes of values and is gzipped, so that it must be inflated whole; at most {MOST_INFLATED} are. Run `gunzip` \
             on it: the file that comes out is read in place"
        );
        return Err(at(VolumeFault::TooLarge(why)));
    }
    if !is_gzip {
        let len =
            std::fs::metadata(&values).map_err(|error| at(VolumeFault::Read(read_advice(&error))))?.len();
        if len < layout.offset.saturating_add(bytes) {
            return Err(damaged(format!(
                "has {len} bytes, where its header announces {} of values behind {}; copy it anew",
                bytes, layout.offset
            ))
            .at(values.display().to_string()));
        }
    }
    let channel = if samples > 1 { 5 } else { 0 };
    let axes = AxisMap { x: 4, y: 3, z: Some(2), channel: Some(channel), time: Some(1) };
    if samples > 1 && sides[4] > 1 {
        oddities.push(
            "voxels have several values along two axes; only the first of the fifth axis is read".into(),
        );
    }
    let grid = Grid { shape: layout.shape.clone(), chunk: layout.chunk(), axes };
    let scale = scale(&header, &mut oddities);
    let place = if is_gzip { Place::Gzip(values) } else { Place::Plain(values) };
    let level = VolumeLevel {
        path: String::new(),
        size: grid.size(),
        scale,
        origin: [0.0; 3],
        chunk: grid.chunk_size(),
    };
    let (slope, intercept, time_step) = (header.slope, header.intercept, time_step(&header));
    let is_scaled =
        slope.is_finite() && intercept.is_finite() && slope != 0.0 && (slope, intercept) != (1.0, 0.0);
    let about = VolumeAbout {
        path: path.display().to_string(),
        kind: "nifti",
        version: Some(header.version.to_string()),
        name: Some(header.name).filter(|name| !name.is_empty()),
        dtype,
        channels: grid.channels(),
        times: grid.times(),
        levels: vec![level],
        channel_info: Vec::new(),
        unit: unit(header.units),
        convention: Convention::Corner,
        labels: Vec::new(),
        root: PathBuf::new(),
        is_label: false,
        label_colors: Vec::new(),
        value_scale: is_scaled.then_some([slope, intercept]),
        downsample: None,
        left_out: Vec::new(),
        time_step,
        time_unit: time_unit(header.units),
        oddities,
    };
    let source = Arc::new(FlatArray::new(place, layout));
    Ok(Volume::new(about, vec![LevelArray { dtype, grid, source }]))
}

/// Voxels along x, y, z, values along time and along the fifth axis.
fn sides(header: &Header, oddities: &mut Vec<String>) -> Result<[u64; 5], VolumeFault> {
    let count = header.dims[0];
    if !(1..=7).contains(&count) {
        return Err(damaged(format!("has {count} axes, where NIfTI has 1 to 7; copy it anew")));
    }
    let mut sides = [1; 7];
    for (axis, side) in sides.iter_mut().enumerate().take(count as usize) {
        let found = header.dims[axis + 1];
        *side = match found {
            1..=MOST_SIDE => found as u64,
            0 if axis >= 3 => {
                oddities.push(format!("the side along axis {} is 0; 1 is taken", axis + 1));
                1
            }
            _ => {
                return Err(damaged(format!(
                    "the side along axis {} is {found}; 1 to {MOST_SIDE} are read",
                    axis + 1
                )));
            }
        };
    }
    if sides[5] * sides[6] > 1 {
        oddities.push("has more than five axes; only the first places of the others are read".into());
    }
    Ok([sides[0], sides[1], sides[2], sides[3], sides[4]])
}

fn dtype_of(datatype: i16) -> Result<(DType, u64), VolumeFault> {
    Ok(match datatype {
        2 => (DType::U8, 1),
        4 => (DType::I16, 1),
        8 => (DType::I32, 1),
        16 => (DType::F32, 1),
        64 => (DType::F64, 1),
        256 => (DType::I8, 1),
        512 => (DType::U16, 1),
        768 => (DType::U32, 1),
        1024 => (DType::I64, 1),
        1280 => (DType::U64, 1),
        RGB => (DType::U8, 3),
        RGBA => (DType::U8, 4),
        other => {
            return Err(unsupported(format!(
                "values of NIfTI's type {other} are not read; convert the file to floats"
            )));
        }
    })
}

/// Where the values begin.
fn offset(header: &Header, oddities: &mut Vec<String>) -> Result<u64, VolumeFault> {
    let least = match (header.is_pair, header.version) {
        (true, _) => 0,
        (false, 1) => V1 as u64 + 4,
        (false, _) => V2 as u64 + 4,
    };
    let found = header.offset;
    if found == 0.0 && least > 0 {
        oddities.push(format!("the values are said to begin at 0, within the header; {least} is taken"));
        return Ok(least);
    }
    match found.is_finite() && found.fract() == 0.0 && (0.0..9e15).contains(&found) {
        true if found as u64 >= least => Ok(found as u64),
        _ => Err(damaged(format!(
            "the values are said to begin at {found}, where {least} is the first place; copy it anew"
        ))),
    }
}

fn scale(header: &Header, oddities: &mut Vec<String>) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let step = header.steps[axis + 1].abs();
        if step.is_normal() {
            return step;
        }
        if (axis as i64) < header.dims[0] {
            oddities.push(format!("the step along axis {} is {step}; 1 is taken", axis + 1));
        }
        1.0
    })
}

fn unit(units: u8) -> Option<String> {
    let name = match units & 7 {
        1 => "meter",
        2 => "millimeter",
        3 => "micrometer",
        _ => return None,
    };
    Some(name.into())
}

/// How far apart times are.
fn time_step(header: &Header) -> Option<f64> {
    Some(header.steps[4]).filter(|step| header.dims[0] > 3 && step.is_normal() && *step > 0.0)
}

fn time_unit(units: u8) -> Option<String> {
    let name = match units & 0x38 {
        8 => "second",
        16 => "millisecond",
        24 => "microsecond",
        _ => return None,
    };
    Some(name.into())
}

/// What a file of values of NIfTI, whose header is a file of its own, is called before its ending.
fn stem_of_values(path: &Path) -> Option<&str> {
    let text = path.to_str()?;
    [".img.gz", ".img"].iter().find_map(|ending| text.strip_suffix(ending))
}

/// Returns true if a file has the name of values whose header is a file of its own.
pub(crate) fn has_name_of_values(path: &Path) -> bool {
    stem_of_values(path).is_some()
}

/// The header beside a file of values, if it is this file's: that of a pair, of whose image and gzipped image
/// the first is meant.
pub(crate) fn header_of(path: &Path) -> Option<PathBuf> {
    let stem = stem_of_values(path)?;
    let headers = [".hdr", ".hdr.gz"].map(|ending| PathBuf::from(format!("{stem}{ending}")));
    let is_of_it = |header: &PathBuf| image_of(header).is_ok_and(|(image, _)| image == path);
    headers.into_iter().find(|header| header.is_file() && is_of_pair(header) && is_of_it(header))
}

/// The image beside a header, and whether it is gzipped.
pub(crate) fn image_of(path: &Path) -> Result<(PathBuf, bool), VolumeFault> {
    let text = path.to_string_lossy();
    let stem = [".hdr.gz", ".hdr"].iter().find_map(|ending| text.strip_suffix(ending));
    let candidates = stem.map(|stem| [(format!("{stem}.img"), false), (format!("{stem}.img.gz"), true)]);
    let found = candidates.into_iter().flatten().find(|(image, _)| Path::new(image).is_file());
    let (image, is_gzip) = found.ok_or_else(|| {
        damaged("is a header whose values lie in a file .img beside it, which is not there")
    })?;
    Ok((image.into(), is_gzip))
}
