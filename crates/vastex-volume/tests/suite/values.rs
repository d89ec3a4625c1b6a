//! Every value of every fixture, from archives and from directories.

use std::ops::ControlFlow;

use vastex_volume::{VolumeRegion, crop, is_volume, open};

use crate::fixtures::{check, expected, path, unpacked, volume};

/// Images, each an archive.
const ZARR: &[&str] = &[
    "v01-dots",
    "v03-names",
    "v04-center",
    "v2-fortran",
    "v2-nested-unsaid",
    "v2-absent",
    "v2-shuffle",
    "blosc-blosclz-1-uint16",
    "blosc-lz4hc-2-uint16",
    "blosc-zlib-1-float64",
    "blosc-zstd-1-bool",
    "blosc-zstd-2-float32",
    "v05-corner",
    "v05-axis-order",
    "v05-shards",
    "v05-flat",
    "v3-transposed",
    "v3-shards-transposed",
    "v06-systems",
    "odd-metadata",
    "custom-axis",
    "plain-array",
    "ome-zarr-py-04",
    "ome-zarr-py-05",
];

#[test]
fn every_image_reads_as_numpy_has_it() {
    for name in ZARR {
        let archive = path(&format!("{name}.zip"));
        assert!(is_volume(&archive), "{name}");
        check(name, &volume(&archive), &expected(name));
        let directory = unpacked(name);
        assert!(is_volume(directory.path()), "{name}");
        check(name, &volume(directory.path()), &expected(name));
    }
}

#[test]
fn deflated_archives_read_the_same() {
    check("deflated", &volume(&path("deflated.zip")), &expected("deflated"));
}

#[test]
fn files_of_other_kinds_read_as_numpy_has_them() {
    for name in ["one.nii", "two.nii.gz", "imagej.tif", "ome.ome.tif", "layers.tif", "planar.raw"] {
        assert!(is_volume(&path(name)), "{name}");
        check(name, &volume(&path(name)), &expected(name));
    }
    // What may be taken for images is a volume by name, and nothing else is.
    for (name, is_stack) in
        [("imagej.tif", true), ("ome.ome.tif", true), ("one.nii", false), ("gone.tif", false)]
    {
        let named = path(&format!("{name}:volume"));
        assert_eq!(is_volume(&named), is_stack, "{name}");
        if is_stack {
            check(name, &volume(&named), &expected(name));
            assert_eq!(vastex_volume::files_of_volume(&named), [path(name)]);
        }
    }
}

#[test]
fn labels_of_64_bits_are_exact() {
    let directory = unpacked("v04-center");
    let labels = volume(&directory.path().join("labels/cells"));
    assert!(labels.about().is_label);
    check("v04-center-labels", &labels, &expected("v04-center-labels"));
    check(
        "v04-center-labels",
        &volume(&path("v04-center.zip").join("labels/cells")),
        &expected("v04-center-labels"),
    );
}

#[test]
fn a_filter_that_is_not_read_is_named() {
    let error = open(&path("v2-delta.zip")).unwrap_err().to_string();
    assert!(error.contains("filter 'delta'") && error.contains("v2-delta.zip/0/.zarray"), "{error}");
}

#[test]
fn a_region_is_written_as_an_array_of_numpy() {
    let volume = volume(&path("v05-shards.zip"));
    let region = VolumeRegion { level: 0, channel: 0, time: 1, at: [5, 7, 9], size: [21, 30, 10] };
    let mut written = Vec::new();
    let mut told = Vec::new();
    crop(&volume, &region, &mut written, &mut |done, total| {
        told.push((done, total));
        ControlFlow::Continue(())
    })
    .unwrap();
    let header = String::from_utf8_lossy(&written[10..128]).into_owned();
    assert!(
        header.starts_with("{'descr': '<u2', 'fortran_order': False, 'shape': (10, 30, 21), }"),
        "{header}"
    );
    assert!(written[128..] == pollster::block_on(volume.read(&region)).unwrap());
    assert!(told.len() > 1 && told.iter().all(|(_, total)| *total == 300), "{told:?}");
    let stopped = crop(&volume, &region, &mut Vec::new(), &mut |_, _| ControlFlow::Break(()));
    assert!(stopped.unwrap_err().to_string().contains("cancelled"));
}

#[test]
fn what_is_not_there_is_refused_with_what_is() {
    let volume = volume(&path("v04-center.zip"));
    let sound = VolumeRegion { level: 0, channel: 1, time: 1, at: [0; 3], size: [22, 20, 6] };
    assert!(volume.check(&sound).is_ok());
    for (bad, says) in [
        (VolumeRegion { level: 3, ..sound }, "levels 0 to 2"),
        (VolumeRegion { channel: 2, ..sound }, "channels 0 to 1"),
        (VolumeRegion { time: 9, ..sound }, "times 0 to 1"),
        (
            VolumeRegion { at: [0, 0, 1], ..sound },
            "22x20x6 voxels at 0,0,1 reach beyond the edge: level 0 has 22x20x6",
        ),
        (VolumeRegion { at: [u64::MAX; 3], ..sound }, "beyond the edge"),
        (VolumeRegion { size: [0, 1, 1], ..sound }, "beyond the edge"),
        (VolumeRegion { level: 1, ..sound }, "level 1 has 11x10x6"),
    ] {
        let error = volume.check(&bad).unwrap_err().to_string();
        assert!(error.contains(says) && error.contains("v04-center.zip"), "{error}");
    }
}
