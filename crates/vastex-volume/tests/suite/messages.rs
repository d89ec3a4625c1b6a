//! What is said of volumes that are damaged, lie or have gone: each message names the path, what is wrong
//! there, and what to do.

use std::path::Path;

use pollster::block_on;
use serde_json::{Value, json};
use vastex_core::PagePos;
use vastex_tiles::{ReadError, TileSource};
use vastex_volume::{Opened, Volume, VolumeRegion, VolumeSource, open};

use crate::fixtures::{path, unpacked, volume};
use crate::generated::{Level, random, source};

/// Every value of level 0, of the first channel and time.
fn whole(volume: &Volume) -> Result<Vec<u8>, String> {
    let region = VolumeRegion { level: 0, channel: 0, time: 0, at: [0; 3], size: volume.about().size() };
    block_on(volume.read(&region)).map_err(|error| error.to_string())
}

/// The error of opening, or else of reading.
fn said(path: &Path) -> String {
    match open(path) {
        Err(error) => error.to_string(),
        Ok(Opened::Volume(volume)) => whole(&volume).unwrap_err(),
        Ok(Opened::Images(list)) => panic!("{}: is {}", path.display(), list.what),
    }
}

/// Changes a file of metadata.
fn change(file: &Path, change: impl FnOnce(&mut Value)) {
    let mut value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    change(&mut value);
    std::fs::write(file, value.to_string()).unwrap();
}

fn check(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "no '{part}' in: {message}");
    }
}

#[test]
fn a_truncated_chunk_says_that_it_is_damaged() {
    for (name, key, why) in [
        ("v2-fortran", "0/0/0/0", "gzip"),
        ("v01-dots", "0/0.0.0.0.0", "blosc"),
        ("v2-nested-unsaid", "0/0/0/0", "lz4"),
        ("blosc-zlib-1-float64", "0/0/0/0", "blosc"),
    ] {
        let directory = unpacked(name);
        let file = directory.path().join(key);
        let bytes = std::fs::read(&file).unwrap();
        std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
        check(&said(directory.path()), &[key, why, "the chunk is damaged"]);
    }
    let directory = unpacked("v05-shards");
    let file = directory.path().join("0/c/0/0/0/0/0");
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() - 7]).unwrap();
    check(&said(directory.path()), &["0/c/0/0/0/0/0", "index of the shard is damaged", "copy the file anew"]);
}

#[test]
fn a_wrong_codec_says_which_and_what_else_it_may_be() {
    for (codec, why) in [("zstd", "zstd"), ("lz4", "lz4"), ("blosc", "blosc"), ("zlib", "zlib")] {
        let directory = unpacked("v2-fortran");
        change(&directory.path().join("0/.zarray"), |value| value["compressor"] = json!({ "id": codec }));
        check(&said(directory.path()), &["0/0/0/0", why, "or was written with another codec"]);
    }
    let directory = unpacked("v2-fortran");
    change(&directory.path().join("0/.zarray"), |value| value["compressor"] = json!({ "id": "lzma" }));
    check(&said(directory.path()), &["0/.zarray", "'lzma'"]);
    check(&said(&path("v2-delta.zip")), &["v2-delta.zip", "delta"]);
}

#[test]
fn a_lying_shape_says_which_bytes_do_not_fit() {
    let directory = unpacked("v2-fortran");
    // A chunk is one voxel longer than what is stored.
    change(&directory.path().join("0/.zarray"), |value| {
        let side = value["chunks"][2].as_u64().unwrap();
        value["chunks"][2] = json!(side + 1);
    });
    check(
        &said(directory.path()),
        &["0/0/0/0", "bytes of values where its array's metadata make", "of another array"],
    );
    let directory = tempfile::tempdir().unwrap();
    for name in ["planar.raw", "planar.raw.toml"] {
        std::fs::copy(path(name), directory.path().join(name)).unwrap();
    }
    let file = directory.path().join("planar.raw");
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() - 1]).unwrap();
    check(&said(&file), &["planar.raw", "bytes"]);
}

#[test]
fn huge_declared_sizes_are_refused_before_memory_is_taken() {
    for (key, huge, parts) in [
        ("shape", json!([5, 1_u64 << 40, 7]), ["0/.zarray", "side of 1099511627776"]),
        ("chunks", json!([1_u64 << 30, 1_u64 << 30, 1_u64 << 30]), ["0/.zarray", "larger than"]),
    ] {
        let directory = unpacked("v2-fortran");
        change(&directory.path().join("0/.zarray"), |value| value[key] = huge);
        check(&said(directory.path()), &parts);
    }
    // A chunk that claims four gigabytes.
    let directory = unpacked("v01-dots");
    let file = directory.path().join("0/0.0.0.0.0");
    let mut bytes = std::fs::read(&file).unwrap();
    bytes[4..8].copy_from_slice(&u32::MAX.to_le_bytes());
    std::fs::write(&file, bytes).unwrap();
    check(&said(directory.path()), &["0/0.0.0.0.0", "claims 4294967295 bytes", "the chunk is damaged"]);
    let volume = volume(&path("v05-flat.zip"));
    let region = VolumeRegion { level: 0, channel: 0, time: 0, at: [0; 3], size: [u64::MAX, 1, 1] };
    let message = block_on(volume.read(&region)).unwrap_err().to_string();
    check(&message, &["v05-flat.zip", "reach beyond the edge", "choose a smaller region"]);
}

/// Numbers that are none are told, and others stand in their place.
#[test]
fn metadata_that_are_no_numbers_are_oddities() {
    let directory = unpacked("v2-fortran");
    let about = |text: &str| {
        let axes = r#"[{"name":"z","type":"space"},{"name":"y","type":"space"},{"name":"x","type":"space"}]"#;
        let scale = format!(r#"[{{"type":"scale","scale":{text}}}]"#);
        let dataset = format!(r#"[{{"path":"0","coordinateTransformations":{scale}}}]"#);
        let of = format!(r#"{{"multiscales":[{{"version":"0.4","axes":{axes},"datasets":{dataset}}}]}}"#);
        std::fs::write(directory.path().join(".zattrs"), of).unwrap();
        volume(directory.path()).about().clone()
    };
    std::fs::write(directory.path().join(".zgroup"), r#"{"zarr_format":2}"#).unwrap();
    for text in ["[NaN,1,1]", "[1,Infinity,1]", "[1,1,-2]", "[0,0,0]"] {
        let about = about(text);
        assert!(about.levels[0].scale.iter().all(|side| side.is_finite() && *side > 0.0), "{text}");
        let odd = about.oddities.join("\n");
        assert!(odd.contains("scale"), "{text}: {odd}");
    }
    // What no reader takes for a number is no metadata.
    let attributes = std::fs::read_to_string(directory.path().join(".zattrs")).unwrap();
    std::fs::write(directory.path().join(".zattrs"), attributes.replace("[0,0,0]", "[1e999,1,1]")).unwrap();
    check(&said(directory.path()), &[".zattrs", "no sound JSON", "line 1"]);
    assert!(about("[1,1,1]").oddities.iter().all(|odd| !odd.contains("scale")));
}

/// What was there when it was opened, and is not when it is read, is no fill value.
#[test]
fn what_vanishes_is_told() {
    let directory = unpacked("v2-fortran");
    let zarr = volume(directory.path());
    // One chunk alone is absent, as it may be.
    std::fs::remove_file(directory.path().join("0/0/0/0")).unwrap();
    whole(&zarr).unwrap();
    let zarr = volume(directory.path());
    std::fs::remove_dir_all(directory.path().join("0")).unwrap();
    check(&whole(&zarr).unwrap_err(), &["0/.zarray", "is gone", "put it back"]);

    let directory = unpacked("v05-shards");
    let shards = volume(directory.path());
    std::fs::remove_dir_all(directory.path().join("0")).unwrap();
    check(&whole(&shards).unwrap_err(), &["0/zarr.json", "is gone", "put it back"]);

    let directory = tempfile::tempdir().unwrap();
    for name in ["planar.raw", "planar.raw.toml", "one.nii"] {
        std::fs::copy(path(name), directory.path().join(name)).unwrap();
    }
    for name in ["planar.raw", "one.nii"] {
        let file = directory.path().join(name);
        let opened = volume(&file);
        std::fs::remove_file(&file).unwrap();
        check(&whole(&opened).unwrap_err(), &[name, "is gone", "put it back"]);
    }
    check(&said(&directory.path().join("nothing.zarr")), &["nothing.zarr"]);
}

/// A tile that cannot be had is an error of its own; those beside it are there, and the coarser ones.
#[test]
fn a_vanished_level_costs_its_own_tiles() {
    let levels =
        [Level::new([60, 60, 60], [20, 20, 20], [1.0; 3]), Level::new([30, 30, 30], [20, 20, 20], [2.0; 3])];
    let (directory, volume) = random(&levels, |_, _| true);
    let source: VolumeSource = source(&volume);
    std::fs::remove_dir_all(directory.path().join("0")).unwrap();
    match block_on(source.read(PagePos::at(0, [1, 1, 1]))) {
        Err(ReadError::Store { place, error, .. }) => {
            check(&format!("{place}: {error}"), &["0/.zarray", "is gone"]);
        }
        other => panic!("{other:?}"),
    }
    block_on(source.read(PagePos::at(1, [0; 3]))).unwrap();
    block_on(source.read(source.description().geometry.tail_pos())).unwrap();
}
