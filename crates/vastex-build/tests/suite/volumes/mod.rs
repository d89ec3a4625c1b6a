//! Volumes built into containers and OME-Zarr, read back, and compared with levels that are made voxel by
//! voxel.

mod levels;
mod outputs;
mod refusals;

use std::path::{Path, PathBuf};

use pollster::block_on;
use tempfile::TempDir;
use vastex_build::{ContainerOptions, VolumeFormat, VolumeOptions, VolumeReport, ZarrOptions, build_volume};
use vastex_volume::{DType, Opened, Reduction, Volume, VolumeRegion, open};

/// The name of a kind of values in the description of a raw file.
fn sample(dtype: DType) -> &'static str {
    match dtype {
        DType::Bool | DType::U8 => "u8",
        DType::I8 => "i8",
        DType::U16 => "u16",
        DType::I16 => "i16",
        DType::U32 => "u32",
        DType::I32 => "i32",
        DType::U64 => "u64",
        DType::I64 => "i64",
        DType::F16 => "f16",
        DType::F32 => "f32",
        DType::F64 => "f64",
    }
}

/// A number for each voxel: often the same as its neighbours', with both signs; of floats a multiple of 1/4.
fn value(dtype: DType, n: usize) -> Vec<u8> {
    let mixed = (n as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
    let number = if mixed.is_multiple_of(4) { mixed % 3 } else { mixed % 5000 };
    match dtype {
        DType::F16 => half::f16::from_f64(number as f64 / 4.0 - 300.0).to_le_bytes().into(),
        DType::F32 => (number as f32 / 4.0 - 300.0).to_le_bytes().into(),
        DType::F64 => (number as f64 / 4.0 - 300.0).to_le_bytes().into(),
        _ => (number.wrapping_mul(0x0101_0101_0101_0101) ^ 0x80).to_le_bytes()[..dtype.bytes()].into(),
    }
}

/// A raw volume with its description: channels and times one after the other, each `size` along x, y and z.
struct Raw {
    dir: TempDir,
    dtype: DType,
    size: [u64; 3],
    channels: u64,
    times: u64,
    values: Vec<u8>,
}

impl Raw {
    fn new(dtype: DType, size: [u64; 3], channels: u64, times: u64) -> Raw {
        let count = (size.iter().product::<u64>() * channels * times) as usize;
        Raw::of(dtype, size, channels, times, (0..count).flat_map(|n| value(dtype, n)).collect())
    }

    fn of(dtype: DType, size: [u64; 3], channels: u64, times: u64, values: Vec<u8>) -> Raw {
        let dir = tempfile::tempdir().unwrap();
        let [width, height, depth] = size;
        let said = format!(
            "width = {width}\nheight = {height}\ndepth = {depth}\nsample = \"{}\"\nchannels = {channels}\ntimes = {times}\n\
             order = \"planar\"\nscale = [0.5, 0.5, 2.0]\nunit = \"micrometer\"\n",
            sample(dtype)
        );
        std::fs::write(dir.path().join("in.raw"), &values).unwrap();
        std::fs::write(dir.path().join("in.raw.toml"), said).unwrap();
        Raw { dir, dtype, size, channels, times, values }
    }

    fn path(&self) -> PathBuf {
        self.dir.path().join("in.raw")
    }

    fn out(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// The values of a channel and a time.
    fn plane(&self, channel: u64, time: u64) -> &[u8] {
        let bytes = self.values.len() / (self.channels * self.times) as usize;
        &self.values[(time * self.channels + channel) as usize * bytes..][..bytes]
    }

    /// Builds it, and opens what came out.
    fn build(&self, name: &str, options: &VolumeOptions) -> (VolumeReport, Volume) {
        let report = build_volume(&self.path(), &self.out(name), options, &()).unwrap();
        (report, opened(&self.out(name)))
    }
}

fn opened(path: &Path) -> Volume {
    match open(path).unwrap() {
        Opened::Volume(volume) => *volume,
        Opened::Images(list) => panic!("{} is {}", list.path, list.what),
    }
}

/// A whole level of a channel and a time.
fn whole(volume: &Volume, level: usize, channel: u64, time: u64) -> Vec<u8> {
    let size = volume.about().levels[level].size;
    block_on(volume.read(&VolumeRegion { level, channel, time, at: [0; 3], size })).unwrap()
}

fn zarr(options: ZarrOptions) -> VolumeOptions {
    VolumeOptions { format: VolumeFormat::Zarr(options), threads: 2, ..VolumeOptions::default() }
}

fn container(options: ContainerOptions) -> VolumeOptions {
    VolumeOptions { format: VolumeFormat::Container(options), threads: 2, ..VolumeOptions::default() }
}

/// The value of bytes, as a whole number or as a float whose sums are exact.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
enum Number {
    Whole(i128),
    Float(f64),
}

fn number(dtype: DType, bytes: &[u8]) -> Number {
    let mut wide = [0; 16];
    wide[..bytes.len()].copy_from_slice(bytes);
    let bits = i128::from_le_bytes(wide);
    match dtype {
        DType::F16 => Number::Float(half::f16::from_bits(bits as u16).to_f64()),
        DType::F32 => Number::Float(f32::from_bits(bits as u32).into()),
        DType::F64 => Number::Float(f64::from_bits(bits as u64)),
        DType::I8 => Number::Whole((bits as i8).into()),
        DType::I16 => Number::Whole((bits as i16).into()),
        DType::I32 => Number::Whole((bits as i32).into()),
        DType::I64 => Number::Whole((bits as i64).into()),
        _ => Number::Whole(bits),
    }
}

fn bytes_of(dtype: DType, number: Number) -> Vec<u8> {
    match (dtype, number) {
        (DType::F16, Number::Float(number)) => half::f16::from_f64(number).to_le_bytes().into(),
        (DType::F32, Number::Float(number)) => (number as f32).to_le_bytes().into(),
        (_, Number::Float(number)) => number.to_le_bytes().into(),
        (_, Number::Whole(number)) => number.to_le_bytes()[..dtype.bytes()].into(),
    }
}

/// The next coarser level, voxel by voxel; and its size.
fn coarser(
    dtype: DType,
    rule: Reduction,
    values: &[u8],
    size: [u64; 3],
    factor: [u64; 3],
) -> (Vec<u8>, [u64; 3]) {
    let width = dtype.bytes();
    let to: [u64; 3] = std::array::from_fn(|axis| size[axis].div_ceil(factor[axis]));
    let mut output = Vec::new();
    for n in 0..to.iter().product() {
        let at = [n % to[0], n / to[0] % to[1], n / to[0] / to[1]];
        let range = |axis: usize| at[axis] * factor[axis]..((at[axis] + 1) * factor[axis]).min(size[axis]);
        let mut covered: Vec<&[u8]> = Vec::new();
        for z in range(2) {
            for y in range(1) {
                covered.extend(range(0).map(|x| {
                    let from = ((z * size[1] + y) * size[0] + x) as usize * width;
                    &values[from..from + width]
                }));
            }
        }
        output.extend(one_of(dtype, rule, &covered));
    }
    (output, to)
}

fn one_of(dtype: DType, rule: Reduction, covered: &[&[u8]]) -> Vec<u8> {
    let mut numbers: Vec<Number> = covered.iter().map(|bytes| number(dtype, bytes)).collect();
    numbers.sort_by(|a, b| a.partial_cmp(b).unwrap());
    match rule {
        Reduction::Min => bytes_of(dtype, numbers[0]),
        Reduction::Max => bytes_of(dtype, numbers[numbers.len() - 1]),
        Reduction::Majority => {
            let times = |bytes: &&[u8]| covered.iter().filter(|other| *other == bytes).count();
            let most = covered.iter().map(times).max().unwrap();
            let by_bits = |bytes: &&[u8]| bytes.iter().rev().copied().collect::<Vec<u8>>();
            covered.iter().copied().filter(|bytes| times(bytes) == most).min_by_key(by_bits).unwrap().into()
        }
        Reduction::Mean => {
            let count = numbers.len() as i128;
            let sum = numbers.iter().fold((0_i128, 0.0), |sum, number| match number {
                Number::Whole(number) => (sum.0 + number, sum.1),
                Number::Float(number) => (sum.0, sum.1 + number),
            });
            match numbers[0] {
                Number::Whole(_) => bytes_of(dtype, Number::Whole((2 * sum.0 + count).div_euclid(2 * count))),
                Number::Float(_) => bytes_of(dtype, Number::Float(sum.1 / count as f64)),
            }
        }
    }
}
