//! Stores of Zarr v2 without compression, of any levels and chunks, some of which are left out.

use std::path::Path;
use std::sync::Arc;

use tempfile::TempDir;
use vastex_volume::{Volume, VolumeOptions, VolumeSource};

use crate::fixtures::volume;

/// A level: voxels, voxels of a chunk and sides of a voxel, each along x, y and z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level {
    pub(crate) size: [u64; 3],
    pub(crate) chunk: [u64; 3],
    pub(crate) scale: [f64; 3],
    pub(crate) moved: [f64; 3],
}

impl Level {
    pub(crate) fn new(size: [u64; 3], chunk: [u64; 3], scale: [f64; 3]) -> Level {
        Level { size, chunk, scale, moved: [0.0; 3] }
    }
}

/// Some number that follows from others.
pub(crate) fn hash(numbers: &[u64]) -> u64 {
    numbers.iter().fold(0x9e37_79b9_7f4a_7c15, |state, number| {
        let mixed = (state ^ number).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed ^ mixed >> 29).wrapping_mul(0x94d0_49bb_1331_11eb)
    })
}

/// Writes a store whose chunks hold what `value` adds for a level and a voxel, of the type `dtype` (`<u2`);
/// what `is_stored` denies for a level and a chunk is left out. The fill value is 3.
pub(crate) fn write(
    directory: &Path,
    dtype: &str,
    levels: &[Level],
    value: impl Fn(usize, [u64; 3], &mut Vec<u8>),
    is_stored: impl Fn(usize, [u64; 3]) -> bool,
) {
    let zyx = |of: [u64; 3]| format!("[{},{},{}]", of[2], of[1], of[0]);
    let datasets: Vec<String> = levels
        .iter()
        .enumerate()
        .map(|(n, level)| {
            let ([x, y, z], [by_x, by_y, by_z]) = (level.scale, level.moved);
            format!(
                "{{\"path\":\"{n}\",\"coordinateTransformations\":[{{\"type\":\"scale\",\"scale\":[{z},{y},{x}]}},\
                 {{\"type\":\"translation\",\"translation\":[{by_z},{by_y},{by_x}]}}]}}"
            )
        })
        .collect();
    let axes = ["z", "y", "x"].map(|name| format!("{{\"name\":\"{name}\",\"type\":\"space\"}}")).join(",");
    let multiscales = format!(
        "{{\"multiscales\":[{{\"version\":\"0.4\",\"axes\":[{axes}],\"datasets\":[{}]}}]}}",
        datasets.join(",")
    );
    std::fs::write(directory.join(".zgroup"), "{\"zarr_format\":2}").unwrap();
    std::fs::write(directory.join(".zattrs"), multiscales).unwrap();
    for (n, level) in levels.iter().enumerate() {
        let at = directory.join(n.to_string());
        std::fs::create_dir(&at).unwrap();
        let meta = format!(
            "{{\"zarr_format\":2,\"shape\":{},\"chunks\":{},\"dtype\":\"{dtype}\",\"compressor\":null,\"fill_value\":3,\
             \"order\":\"C\",\"filters\":null,\"dimension_separator\":\".\"}}",
            zyx(level.size),
            zyx(level.chunk)
        );
        std::fs::write(at.join(".zarray"), meta).unwrap();
        let counts: [u64; 3] = std::array::from_fn(|axis| level.size[axis].div_ceil(level.chunk[axis]));
        for chunk in places(counts).filter(|chunk| is_stored(n, *chunk)) {
            let mut bytes = Vec::new();
            for within in places(level.chunk) {
                let voxel = std::array::from_fn(|axis| chunk[axis] * level.chunk[axis] + within[axis]);
                value(n, voxel, &mut bytes);
            }
            std::fs::write(at.join(format!("{}.{}.{}", chunk[2], chunk[1], chunk[0])), bytes).unwrap();
        }
    }
}

/// All places of a box, x fastest.
pub(crate) fn places(size: [u64; 3]) -> impl Iterator<Item = [u64; 3]> {
    let [width, height, depth] = size;
    (0..depth).flat_map(move |z| (0..height).flat_map(move |y| (0..width).map(move |x| [x, y, z])))
}

/// A volume of 16 bits whose values are numbers by chance below 5000.
pub(crate) fn random(
    levels: &[Level],
    is_stored: impl Fn(usize, [u64; 3]) -> bool,
) -> (TempDir, Arc<Volume>) {
    let directory = tempfile::tempdir().unwrap();
    let value = |level: usize, [x, y, z]: [u64; 3], bytes: &mut Vec<u8>| {
        bytes.extend(((hash(&[level as u64, x, y, z]) % 5000) as u16).to_le_bytes());
    };
    write(directory.path(), "<u2", levels, value, is_stored);
    let volume = volume(directory.path());
    (directory, Arc::new(volume))
}

/// A source of the first channel and time, in bricks of 16 voxels.
pub(crate) fn source(volume: &Arc<Volume>) -> VolumeSource {
    let options = VolumeOptions { brick: 16, ..VolumeOptions::default() };
    VolumeSource::open(volume.clone(), &options).unwrap()
}
