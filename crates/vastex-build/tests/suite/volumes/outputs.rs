//! What outputs say of themselves, which chunks they have, and that no thread decides their bytes.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use vastex_build::{
    Compression, ContainerOptions, VolumeOptions, ZarrCodec, ZarrOptions, ZarrVersion, build_volume,
};
use vastex_tiles::verify_file;
use vastex_volume::{BrickCount, Convention, DType, Opened, Reduction, open_placed};

use super::{Raw, container, opened, whole, zarr};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../vastex-volume/fixtures").join(name)
}

fn json_in(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// Paths of the files below a directory, with their bytes, in order.
fn files(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    let mut open = vec![directory.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => open.push(path),
                false => {
                    let name = path.strip_prefix(directory).unwrap().to_str().unwrap().to_owned();
                    found.push((name, std::fs::read(path).unwrap()));
                }
            }
        }
    }
    found.sort();
    found
}

#[test]
fn metadata_say_where_levels_lie_and_who_made_them() {
    let raw = Raw::new(DType::U16, [70, 40, 30], 2, 3);
    let (_, volume) = raw.build("out.zarr", &zarr(ZarrOptions { chunk: [32; 3], ..ZarrOptions::default() }));
    let said = json_in(&raw.out("out.zarr/zarr.json"));
    let ome = &said["attributes"]["ome"];
    assert_eq!((&ome["version"], &ome["multiscales"][0]["type"]), (&json!("0.5"), &json!("mean")));
    let dataset = &ome["multiscales"][0]["datasets"][1];
    assert_eq!(
        dataset["coordinateTransformations"],
        json!([
            {"type": "scale", "scale": [1.0, 1.0, 4.0, 1.0, 1.0]},
            {"type": "translation", "translation": [0.0, 0.0, 2.0, 0.5, 0.5]}
        ])
    );
    let array = json_in(&raw.out("out.zarr/1/zarr.json"));
    assert_eq!(array["dimension_names"], json!(["t", "c", "z", "y", "x"]));
    assert_eq!(array["chunk_grid"]["configuration"]["chunk_shape"], json!([1, 1, 15, 20, 32]));
    let about = volume.about();
    assert_eq!((about.unit.as_deref(), about.convention), (Some("micrometer"), Convention::Center));
    assert_eq!((about.version.as_deref(), about.downsample.as_deref()), (Some("0.5"), Some("mean")));
    let origins: Vec<_> = about.levels.iter().map(|level| level.origin).collect();
    assert_eq!(origins, [[0.0; 3]; 3]);
}

/// The step of times and its unit, of either version and of containers.
#[test]
fn times_are_as_far_apart_as_in_the_source() {
    let raw = Raw::new(DType::U8, [20, 10, 8], 2, 3);
    raw.build("in.zarr", &zarr(ZarrOptions { version: ZarrVersion::V04, ..ZarrOptions::default() }));
    let file = raw.out("in.zarr/.zattrs");
    let mut said = json_in(&file);
    let image = &mut said["multiscales"][0];
    image["axes"][0]["unit"] = json!("min");
    image["datasets"][0]["coordinateTransformations"][0]["scale"][0] = json!(2.5);
    std::fs::write(&file, said.to_string()).unwrap();
    for (name, options, unit) in [
        ("a.zarr", zarr(ZarrOptions { version: ZarrVersion::V04, ..ZarrOptions::default() }), "minute"),
        ("b.zarr", zarr(ZarrOptions { chunk: [8; 3], ..ZarrOptions::default() }), "minute"),
        ("c.vastex", container(ContainerOptions::default()), "min"),
    ] {
        build_volume(&raw.out("in.zarr"), &raw.out(name), &options, &()).unwrap();
        let volume = opened(&raw.out(name));
        let about = volume.about();
        assert_eq!((about.time_step, about.time_unit.as_deref()), (Some(2.5), Some(unit)), "{name}");
        assert_eq!((about.times, about.oddities.len()), (3, 0), "{name}: {:?}", about.oddities);
    }
}

/// Levels lie in what is built where they lie in the source, whatever somebody says of its translations, and
/// so do labels of other sizes beside them.
#[test]
fn what_is_built_lies_where_the_source_lies() {
    let dir = tempfile::tempdir().unwrap();
    for (name, places) in [("v04-center.zip", &["", "labels/cells"][..]), ("v05-corner.zip", &[""])] {
        for convention in [None, Some(Convention::Corner), Some(Convention::Center)] {
            let out = dir.path().join("out.zarr");
            let options =
                VolumeOptions { convention, ..zarr(ZarrOptions { chunk: [8; 3], ..ZarrOptions::default() }) };
            build_volume(&fixture(name), &out, &options, &()).unwrap();
            for below in places {
                // A name that ends with a slash leads into a folder, which a zip is not.
                let within = |path: PathBuf| if below.is_empty() { path } else { path.join(below) };
                let at = within(fixture(name));
                let source = match open_placed(&at, convention).unwrap() {
                    Opened::Volume(volume) => *volume,
                    Opened::Images(list) => panic!("{list:?}"),
                };
                let built = opened(&within(out.clone()));
                let origins = [&source, &built].map(|volume| volume.about().levels[0].origin);
                let apart = std::iter::zip(origins[0], origins[1]).map(|(one, other)| (one - other).abs());
                assert!(apart.fold(0.0, f64::max) < 1e-9, "{name}/{below} {convention:?}: {origins:?}");
            }
        }
    }
}

#[test]
fn version_0_4_and_every_codec_are_read_back() {
    let raw = Raw::new(DType::I16, [50, 40, 30], 1, 1);
    for (version, shards, codec) in [
        (ZarrVersion::V04, 1, ZarrCodec::Zstd(1)),
        (ZarrVersion::V04, 1, ZarrCodec::Gzip(1)),
        (ZarrVersion::V04, 1, ZarrCodec::None),
        (ZarrVersion::V05, 1, ZarrCodec::Gzip(6)),
        (ZarrVersion::V05, 2, ZarrCodec::None),
        (ZarrVersion::V05, 2, ZarrCodec::Zstd(3)),
    ] {
        let options = ZarrOptions { version, shards, codec, chunk: [16; 3] };
        let (report, volume) = raw.build("out.zarr", &zarr(options));
        assert_eq!(volume.about().version.as_deref(), Some(version.name()));
        assert_eq!((volume.about().oddities.len(), report.levels.len()), (0, 3), "{options:?}");
        assert!(whole(&volume, 0, 0, 0) == raw.values, "{options:?}");
    }
}

#[test]
fn chunks_that_hold_nothing_are_not_written() {
    let mut values = vec![0; 64 * 64 * 64];
    values[64 * 64 * 40 + 64 * 5 + 60] = 9;
    let raw = Raw::of(DType::U8, [64; 3], 1, 1, values);
    for shards in [1, 2] {
        let options = VolumeOptions {
            downsample: Some(Reduction::Max),
            ..zarr(ZarrOptions { chunk: [16; 3], shards, ..ZarrOptions::default() })
        };
        let (report, volume) = raw.build("out.zarr", &options);
        assert_eq!(report.pieces, 3, "one for each level");
        for level in 0..3 {
            let values = whole(&volume, level, 0, 0);
            assert_eq!(values.iter().filter(|value| **value == 9).count(), 1, "{level}");
        }
    }
    let options = VolumeOptions {
        downsample: Some(Reduction::Max),
        ..container(ContainerOptions { page: 16, ..ContainerOptions::default() })
    };
    let (report, volume) = raw.build("out.vastex", &options);
    // A brick and those whose border it is in, on two levels, and the tail.
    assert!(report.pieces < 10 && report.empty > 60, "{report:?}");
    let count = pollster::block_on(volume.count_bricks(false)).unwrap();
    assert!(matches!(count, BrickCount { absent: Some(0), .. }), "{count:?}");
}

#[test]
fn channels_keep_their_names_and_labels_are_built_beside_them() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out.zarr");
    let options = zarr(ZarrOptions { chunk: [8; 3], ..ZarrOptions::default() });
    let report = build_volume(&fixture("v04-center.zip"), &out, &options, &()).unwrap();
    let (source, volume) = (opened(&fixture("v04-center.zip")), opened(&out));
    let (from, to) = (source.about(), volume.about());
    assert_eq!((&to.labels, &report.labels), (&vec!["cells".to_owned()], &vec!["cells".to_owned()]));
    let known = |about: &vastex_volume::VolumeAbout| {
        about.channel_info.iter().map(|one| (one.name.clone(), one.color, one.window)).collect::<Vec<_>>()
    };
    assert_eq!(known(to), known(from));
    assert_eq!((to.unit.clone(), to.levels[0].scale), (from.unit.clone(), from.levels[0].scale));
    assert_eq!((to.levels[0].origin, to.convention), (from.levels[0].origin, Convention::Center));
    for time in 0..from.times {
        for channel in 0..from.channels {
            assert!(whole(&volume, 0, channel, time) == whole(&source, 0, channel, time));
        }
    }
    let labels = opened(&out.join("labels/cells"));
    let of_source = opened(&fixture("v04-center.zip").join("labels/cells"));
    assert!(labels.about().is_label && labels.about().downsample.as_deref() == Some("majority"));
    assert_eq!(labels.about().dtype, of_source.about().dtype);
    assert!(whole(&labels, 0, 0, 0) == whole(&of_source, 0, 0, 0));

    // A container has room for one image, and says so.
    let path = dir.path().join("out.vastex");
    let report =
        build_volume(&fixture("v04-center.zip"), &path, &container(ContainerOptions::default()), &());
    let notes = report.unwrap().notes;
    assert!(notes.iter().any(|note| note.contains("labels are left out (cells)")), "{notes:?}");
    let container = opened(&path);
    assert_eq!(known(container.about()), known(from));
    assert_eq!(container.about().levels[0].origin, from.levels[0].origin);
}

#[test]
fn no_thread_decides_bytes() {
    let raw = Raw::new(DType::U16, [100, 70, 50], 2, 1);
    let limited = VolumeOptions {
        memory_limit: 200 << 10,
        ..container(ContainerOptions { page: 16, ..ContainerOptions::default() })
    };
    let mut seen = Vec::new();
    for threads in [1, 3] {
        raw.build("out.vastex", &VolumeOptions { threads, ..limited.clone() });
        let zarr = zarr(ZarrOptions { chunk: [16; 3], ..ZarrOptions::default() });
        raw.build("out.zarr", &VolumeOptions { threads, ..zarr });
        seen.push((std::fs::read(raw.out("out.vastex")).unwrap(), files(&raw.out("out.zarr"))));
    }
    assert!(seen[0] == seen[1]);
    // Nothing is left beside them.
    let mut names: Vec<_> =
        std::fs::read_dir(raw.dir.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["in.raw", "in.raw.toml", "out.vastex", "out.zarr"]);
}

#[test]
fn containers_of_volumes_verify_and_say_what_they_hold() {
    let raw = Raw::new(DType::F32, [40, 30, 20], 2, 2);
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd(0)] {
        let options = ContainerOptions { page: 16, compression, align: 4096, ..ContainerOptions::default() };
        let (_, volume) = raw.build("out.vastex", &container(options));
        let verification = verify_file(raw.out("out.vastex"), |_, _| {}).unwrap();
        assert_eq!(verification.faults, []);
        let about = volume.about();
        assert_eq!((about.kind, about.unit.as_deref()), ("vastex", Some("micrometer")));
        assert_eq!((about.downsample.as_deref(), about.is_label), (Some("mean"), false));
        assert_eq!((about.levels[1].scale, about.levels[1].origin), ([1.0, 1.0, 4.0], [0.0; 3]));
        assert_eq!(about.levels.last().unwrap().size, [1; 3]);
    }
}
