//! A volume of 10^15 voxels and four channels, whose chunks follow from a formula with detail at every level:
//! slices, points, mixed values and tiles of it, each of the level that is stated.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use pollster::block_on;
use vastex_core::PagePos;
use vastex_tiles::TileSource;

use super::{SliceAxis, VolumeOptions, VolumeSource, VoxelValue};
use crate::chunks::{AxisMap, Chunk, ChunkFuture, ChunkSource, Grid, Presence, PresenceFuture};
use crate::values::DType;
use crate::volume::{Convention, LevelArray, Volume, VolumeAbout, VolumeLevel};

/// Voxels along each side.
const SIDE: u64 = 100_000;
const CHANNELS: u64 = 4;
/// Voxels of a chunk along each side.
pub(super) const CHUNK: u64 = 32;
/// What is looked at.
const SAMPLES: u64 = 200;

/// Some number that follows from others.
fn hash(numbers: &[u64]) -> u64 {
    numbers.iter().fold(0x9e37_79b9_7f4a_7c15, |state, number| {
        let mixed = (state ^ number).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed ^ mixed >> 29
    })
}

/// The value of a voxel of a level.
fn value(level: u64, channel: u64, at: [u64; 3]) -> u16 {
    let noise = |shift: u32| {
        let [x, y, z] = at.map(|at| at >> shift);
        hash(&[level, channel, u64::from(shift), x, y, z]) >> 49
    };
    // Of single voxels, and of blocks of them.
    (noise(0) + noise(3)) as u16
}

/// The chunks of a level.
struct Formula {
    level: u64,
    /// How long each takes, beside the formula.
    takes: Duration,
}

impl ChunkSource for Formula {
    fn read<'a>(&'a self, coords: &'a [u64]) -> ChunkFuture<'a> {
        std::thread::sleep(self.takes);
        let mut values = Vec::new();
        for n in 0..CHUNK.pow(3) {
            let within = [n % CHUNK, n / CHUNK % CHUNK, n / CHUNK / CHUNK];
            let at = std::array::from_fn(|axis| coords[3 - axis] * CHUNK + within[axis]);
            values.extend(value(self.level, coords[0], at).to_le_bytes());
        }
        let strides = [2 * CHUNK.pow(3), 2 * CHUNK * CHUNK, 2 * CHUNK, 2].map(|stride| stride as usize);
        let stored = values.len();
        let chunk = Chunk::new(values, strides, stored);
        Box::pin(async { Ok(Some(chunk)) })
    }

    fn fill(&self) -> [u8; 8] {
        [0; 8]
    }

    fn presence(&self, _: usize) -> PresenceFuture<'_> {
        Box::pin(async { Ok(Presence::All) })
    }
}

fn sizes() -> Vec<u64> {
    let mut sizes = vec![SIDE];
    while let Some(side) = sizes.last().filter(|side| **side > 1) {
        sizes.push(side.div_ceil(2));
    }
    sizes
}

/// With so many of its levels.
fn huge(stored: usize) -> Arc<Volume> {
    slow(stored, Duration::ZERO)
}

/// A chunk of it takes so long.
pub(super) fn slow(stored: usize, takes: Duration) -> Arc<Volume> {
    let sizes = &sizes()[..stored];
    let level = |(n, side): (usize, &u64)| VolumeLevel {
        path: n.to_string(),
        size: [*side; 3],
        scale: [(1_u64 << n) as f64; 3],
        origin: [0.0; 3],
        chunk: [CHUNK; 3],
    };
    let array = |(n, side): (usize, &u64)| LevelArray {
        dtype: DType::U16,
        grid: Grid {
            shape: vec![CHANNELS, *side, *side, *side],
            chunk: vec![1, CHUNK, CHUNK, CHUNK],
            axes: AxisMap { x: 3, y: 2, z: Some(1), channel: Some(0), time: None },
        },
        source: Arc::new(Formula { level: n as u64, takes }),
    };
    let about = VolumeAbout {
        path: "formula".into(),
        kind: "zarr",
        version: None,
        name: None,
        dtype: DType::U16,
        levels: sizes.iter().enumerate().map(level).collect(),
        channels: CHANNELS,
        channel_info: Vec::new(),
        times: 1,
        unit: None,
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
    Arc::new(Volume::new(about, sizes.iter().enumerate().map(array).collect()))
}

fn sources(volume: &Arc<Volume>) -> Vec<VolumeSource> {
    let of = |channel| {
        let options = VolumeOptions { channel, ..VolumeOptions::default() };
        VolumeSource::open(volume.clone(), &options).unwrap()
    };
    (0..CHANNELS).map(of).collect()
}

/// What is looked at the `nth` time: a level and a channel, and numbers below others.
fn picked(nth: u64) -> (u8, u64, impl Fn(u64, u64) -> u64) {
    let of = move |salt: u64, count: u64| hash(&[nth, salt, 77]) % count;
    (of(0, sizes().len() as u64) as u8, of(1, CHANNELS), of)
}

#[test]
fn slices_of_every_level_are_the_formula() {
    let volume = huge(sizes().len());
    let sources = sources(&volume);
    assert_eq!(volume.about().size().iter().product::<u64>(), 10_u64.pow(15));
    for nth in 0..SAMPLES {
        let (level, channel, of) = picked(nth);
        let side = sizes()[usize::from(level)];
        let axis = [SliceAxis::X, SliceAxis::Y, SliceAxis::Z][of(2, 3) as usize];
        let index = of(3, SIDE);
        let size = [0, 1].map(|n| 1 + of(4 + n, side.min(40)));
        let at = [0, 1].map(|n| of(6 + n, side - size[n as usize] + 1));
        let values = block_on(sources[channel as usize].slice(
            level,
            axis,
            index as u32,
            at.map(|at| at as u32),
            size.map(|side| side as u32),
        ))
        .unwrap();
        let [along, right, down] = axis.axes();
        let mut expected = Vec::new();
        for (y, x) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y, x))) {
            let mut voxel = [0; 3];
            voxel[along] = index >> level;
            (voxel[right], voxel[down]) = (at[0] + x, at[1] + y);
            expected.extend(value(level.into(), channel, voxel).to_le_bytes());
        }
        assert!(values == expected, "slice {nth} of level {level} at {index}, {at:?}");
    }
}

#[test]
fn points_are_the_formula_at_the_level_that_is_stated() {
    let volume = huge(sizes().len());
    let sources = sources(&volume);
    for nth in 0..SAMPLES {
        let (level, channel, of) = picked(nth);
        let (source, last) = (&sources[channel as usize], sizes()[usize::from(level)] - 1);
        // In eighths of a voxel, so that everything is exact.
        let world: [f64; 3] = std::array::from_fn(|axis| of(10 + axis as u64, 8 * SIDE) as f64 / 8.0);
        let scale = (1_u64 << level) as f64;
        let found = block_on(source.value_at(level, world)).unwrap().unwrap();
        let voxel = world.map(|at| (at / scale) as u64);
        assert_eq!((found.level, found.is_made), (level, false));
        assert_eq!(found.voxel.map(u64::from), voxel);
        let expected = value(level.into(), channel, voxel);
        assert_eq!(found.value, VoxelValue::Unsigned(expected.into()), "point {nth} at {world:?}");
        let mut mixed = 0.0;
        for n in 0..8_u64 {
            let mut weight = 1.0;
            let corner = std::array::from_fn(|axis| {
                let place = world[axis] / scale - 0.5;
                let (first, share) = (place.floor(), place - place.floor());
                let is_second = n >> axis & 1 == 1;
                weight *= if is_second { share } else { 1.0 - share };
                (first as i64 + i64::from(is_second)).clamp(0, last as i64) as u64
            });
            mixed += weight * f64::from(value(level.into(), channel, corner));
        }
        let found = block_on(source.sample_at(level, world)).unwrap().unwrap();
        assert!((f64::from(found) - mixed).abs() < 0.01, "point {nth}: {found}, {mixed}");
    }
}

#[test]
fn bricks_at_the_far_corner_are_the_formula() {
    let volume = huge(sizes().len());
    let source = &sources(&volume)[3];
    let geometry = &source.description().geometry;
    assert!(source.contents().is_none(), "nobody lists what 10^9 bricks hold");
    for level in [0, 3, 7] {
        let pages = geometry.level(level).pages;
        let pos = PagePos::at(level, pages.map(|pages| pages - 1));
        let tile = block_on(source.read(pos)).unwrap().decode(source.description()).unwrap();
        let (tile_side, side) = (66, sizes()[usize::from(level)] as i64);
        let first = source.levels().level(level).first_voxel(pos.coords());
        for n in (0..tile_side * tile_side * tile_side).step_by(37) {
            let within = [n % tile_side, n / tile_side % tile_side, n / tile_side / tile_side];
            let at = std::array::from_fn(|axis| (first[axis] + within[axis]).clamp(0, side - 1) as u64);
            let texel = u16::from_le_bytes([tile[2 * n as usize], tile[2 * n as usize + 1]]);
            assert_eq!(texel, value(level.into(), 3, at), "{pos}, voxel {at:?}");
        }
    }
}

/// Where only the finest level is stored, a preview of a few hundred chunks stands for the others.
#[test]
fn a_volume_of_one_level_is_seen_at_once() {
    let volume = huge(1);
    let source = &sources(&volume)[0];
    assert!(source.has_levels_to_make());
    let before = volume.chunk_work().decoded;
    let tail = source.description().geometry.tail_pos();
    let tile = block_on(source.read(tail)).unwrap().decode(source.description()).unwrap();
    assert!(tile.iter().any(|byte| *byte > 0));
    assert!(volume.chunk_work().decoded - before <= 512);
    let state = source.level_states();
    assert_eq!((state.len(), state.iter().filter(|level| level.is_made).count()), (18, 17));
    assert_eq!(state[1].made.unwrap().total, 50_000_u64.div_ceil(64).pow(3));
}
