//! Every value of every level is that of the naive version, whatever the kind of values, the rule, the
//! output, and the size of blocks.

use vastex_build::{ContainerOptions, VolumeOptions, ZarrOptions};
use vastex_volume::{DType, Reduction};

use super::{Raw, coarser, container, whole, zarr};

const SIZE: [u64; 3] = [67, 45, 33];

fn small_zarr() -> VolumeOptions {
    zarr(ZarrOptions { chunk: [16, 8, 16], ..ZarrOptions::default() })
}

fn small_container() -> VolumeOptions {
    container(ContainerOptions { page: 16, border: 2, ..ContainerOptions::default() })
}

/// Builds and compares all levels of all channels and times.
fn check(raw: &Raw, options: &VolumeOptions, name: &str) {
    let (report, volume) = raw.build(name, options);
    let about = volume.about();
    assert_eq!(about.oddities, Vec::<String>::new(), "{name}");
    assert_eq!((about.dtype, about.channels, about.times), (raw.dtype, raw.channels, raw.times));
    let sizes: Vec<_> = about.levels.iter().map(|level| level.size).collect();
    assert_eq!(sizes, report.levels, "{name}");
    for time in 0..raw.times {
        for channel in 0..raw.channels {
            let (mut expected, mut size) = (raw.plane(channel, time).to_vec(), raw.size);
            for level in 0..sizes.len() {
                assert!(
                    whole(&volume, level, channel, time) == expected,
                    "{name}: {:?} {:?}, level {level}, channel {channel}, time {time}",
                    raw.dtype,
                    options.downsample
                );
                let Some(next) = sizes.get(level + 1) else { break };
                let factor = std::array::from_fn(|axis| if next[axis] == size[axis] { 1 } else { 2 });
                (expected, size) = coarser(raw.dtype, report.downsample, &expected, size, factor);
                assert_eq!(size, *next, "{name}");
            }
        }
    }
}

#[test]
fn all_kinds_of_values_come_out_exactly() {
    for dtype in DType::ALL.into_iter().filter(|dtype| *dtype != DType::Bool) {
        let raw = Raw::new(dtype, SIZE, 1, 1);
        check(&raw, &small_zarr(), "out.zarr");
        check(&raw, &small_container(), "out.vastex");
    }
}

#[test]
fn all_rules_go_voxel_by_voxel() {
    for dtype in [DType::I16, DType::F32] {
        let raw = Raw::new(dtype, SIZE, 1, 1);
        for rule in Reduction::ALL {
            let downsample = Some(rule);
            check(&raw, &VolumeOptions { downsample, ..small_zarr() }, "out.zarr");
            check(&raw, &VolumeOptions { downsample, ..small_container() }, "out.vastex");
        }
    }
}

#[test]
fn the_size_of_blocks_changes_nothing() {
    let raw = Raw::new(DType::U16, [150, 90, 70], 1, 1);
    for kib in [96, 300, 1000] {
        for keep_z in [false, true] {
            let limited = |options| VolumeOptions { memory_limit: kib << 10, keep_z, ..options };
            check(&raw, &limited(small_zarr()), "out.zarr");
            check(&raw, &limited(small_container()), "out.vastex");
        }
    }
}

#[test]
fn channels_and_times_are_apart() {
    let raw = Raw::new(DType::U16, [40, 30, 20], 3, 2);
    let limited = |options| VolumeOptions { memory_limit: 100 << 10, ..options };
    check(&raw, &limited(small_zarr()), "out.zarr");
    check(&raw, &limited(small_container()), "out.vastex");
}

#[test]
fn odd_chunks_shards_and_thin_volumes_are_cut_where_they_end() {
    for size in [[67, 45, 33], [130, 1, 1], [1, 1, 70], [64, 64, 1], [1, 1, 1]] {
        let raw = Raw::new(DType::U16, size, 1, 1);
        for (chunk, shards) in [([13, 7, 5], 1), ([13, 7, 5], 3), ([16; 3], 2), ([64; 3], 4)] {
            check(&raw, &zarr(ZarrOptions { chunk, shards, ..ZarrOptions::default() }), "out.zarr");
        }
        check(&raw, &small_container(), "out.vastex");
        check(&raw, &container(ContainerOptions::default()), "out.vastex");
    }
}

#[test]
fn z_waits_where_it_is_asked_to() {
    // Voxels are 0.5 along x and y, and 2 along z.
    let raw = Raw::new(DType::U8, [100, 80, 40], 1, 1);
    let options = VolumeOptions { keep_z: true, ..small_zarr() };
    let (report, volume) = raw.build("out.zarr", &options);
    let depths: Vec<u64> = report.levels.iter().map(|size| size[2]).collect();
    assert_eq!(depths, [40, 40, 40, 20, 10]);
    let scales: Vec<_> = volume.about().levels.iter().map(|level| level.scale).collect();
    assert_eq!(scales[2..4], [[2.0; 3], [4.0; 3]]);
    check(&raw, &options, "out.zarr");
    check(&raw, &VolumeOptions { keep_z: true, ..small_container() }, "out.vastex");
}
