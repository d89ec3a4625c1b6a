//! Oddities of OME-Zarr that no library at hand writes: stores written here by hand, and what they read as.

use std::path::Path;

use serde_json::{Value, json};
use vastex_volume::{Convention, Opened, open, open_placed};

use crate::fixtures::{path, volume, whole};

fn put(directory: &Path, key: &str, content: impl AsRef<[u8]>) {
    let file = directory.join(key);
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(file, content).unwrap();
}

fn put_json(directory: &Path, key: &str, content: &Value) {
    put(directory, key, content.to_string());
}

/// An array of version 3 of floats, along z, y and x, in chunks of 2x2x3.
fn array_of_floats(shape: [u64; 3]) -> Value {
    json!({
        "zarr_format": 3, "node_type": "array", "shape": shape, "data_type": "float32",
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [2, 2, 3]}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": "0x40490fdb",
        "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}],
        "dimension_names": ["z", "y", "x"], "attributes": {}
    })
}

fn value_at(z: u64, y: u64, x: u64) -> f32 {
    (100 * z + 10 * y + x) as f32 - 7.5
}

/// Version 0.5: metadata of all arrays within the group's, which are old, paths of several parts, a fill
/// value of floats in hexadecimal digits, and a channel whose dark and bright are exchanged.
#[test]
fn consolidated_metadata_nested_paths_and_digits_of_floats_are_read() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let axes = ["z", "y", "x"].map(|name| json!({"name": name, "type": "space", "unit": "micrometer"}));
    let dataset = |path: &str, side: f64| json!({"path": path, "coordinateTransformations": [{"type": "scale", "scale": [1.0, side, side]}]});
    let omero = json!({"channels": [{
        "label": "bright field", "color": "FFFFFF", "active": true, "inverted": true,
        "window": {"min": -10, "max": 300, "start": 0, "end": 200}
    }]});
    let group = |attributes: Value, consolidated: Value| {
        json!({
            "zarr_format": 3, "node_type": "group", "attributes": attributes,
            "consolidated_metadata": {"kind": "inline", "must_understand": false, "metadata": consolidated}
        })
    };
    let ome = json!({"ome": {
        "version": "0.5", "omero": omero,
        "multiscales": [{"axes": axes, "datasets": [dataset("scale0/x", 0.5), dataset("scale1/x", 1.0)]}]
    }});
    // What the arrays themselves say is newer than what was collected of them.
    let old = json!({"scale0/x": array_of_floats([9, 9, 9]), "scale1/x": array_of_floats([1, 1, 1])});
    put_json(at, "zarr.json", &group(ome, old));
    for (level, shape) in [("scale0", [3, 4, 6]), ("scale1", [3, 2, 3])] {
        put_json(at, &format!("{level}/zarr.json"), &group(json!({}), json!({})));
        put_json(at, &format!("{level}/x/zarr.json"), &array_of_floats(shape));
    }
    // All chunks but one: those at the end of z reach beyond it.
    for (cz, cy, cx) in [(0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0), (1, 0, 1), (1, 1, 0), (1, 1, 1)] {
        let places = (0..2).flat_map(|z| (0..2).flat_map(move |y| (0..3).map(move |x| (z, y, x))));
        let values = places.map(|(z, y, x)| value_at(2 * cz + z, 2 * cy + y, 3 * cx + x).to_le_bytes());
        put(at, &format!("scale0/x/c/{cz}/{cy}/{cx}"), values.collect::<Vec<_>>().concat());
    }
    let volume = volume(at);
    let about = volume.about();
    let levels: Vec<_> = about.levels.iter().map(|level| (level.path.as_str(), level.size)).collect();
    assert_eq!(levels, [("scale0/x", [6, 4, 3]), ("scale1/x", [3, 2, 3])]);
    assert!(about.oddities.is_empty(), "{:?}", about.oddities);
    let channel = &about.channel_info[0];
    assert_eq!((channel.is_inverted, channel.window), (true, Some([0.0, 200.0])));
    assert_eq!(volume.fill(), std::f32::consts::PI.to_le_bytes());
    let found = whole(&volume, 0, 0);
    let mut values = found.as_chunks::<4>().0.iter().map(|value| f32::from_le_bytes(*value));
    for (z, y, x) in (0..3).flat_map(|z| (0..4).flat_map(move |y| (0..6).map(move |x| (z, y, x)))) {
        let is_absent = z < 2 && y >= 2 && x >= 3;
        let expected = if is_absent { std::f32::consts::PI } else { value_at(z, y, x) };
        assert_eq!(values.next(), Some(expected), "{x},{y},{z}");
    }
}

/// What bioformats2raw writes: images in the order in which a list names them, by version 0.2, without a fill
/// value.
#[test]
fn a_list_of_series_names_images_of_version_0_2() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    put_json(at, ".zgroup", &json!({"zarr_format": 2}));
    put_json(at, ".zattrs", &json!({"bioformats2raw.layout": 3}));
    put_json(at, "OME/.zgroup", &json!({"zarr_format": 2}));
    put_json(at, "OME/.zattrs", &json!({"series": ["second", "deep/first"]}));
    // One that is not in the list.
    put_json(at, "0/.zgroup", &json!({"zarr_format": 2}));
    for (nth, image) in ["second", "deep/first"].into_iter().enumerate() {
        put_json(at, &format!("{image}/.zgroup"), &json!({"zarr_format": 2}));
        let datasets = json!([{"path": "0"}, {"path": "1"}]);
        put_json(
            at,
            &format!("{image}/.zattrs"),
            &json!({"multiscales": [{"version": "0.2", "datasets": datasets}]}),
        );
        for (level, shape) in [(0, [1, 2, 2, 3, 4]), (1, [1, 2, 2, 2, 2])] {
            let array = json!({
                "zarr_format": 2, "shape": shape, "chunks": [1, 1, 2, 3, 4], "dtype": "<u2", "compressor": null,
                "fill_value": null, "order": "C", "filters": null, "dimension_separator": "/"
            });
            put_json(at, &format!("{image}/{level}/.zarray"), &array);
        }
        let values: Vec<u8> = (0..24_u16).flat_map(|n| (1000 * nth as u16 + 300 * n).to_le_bytes()).collect();
        put(at, &format!("{image}/0/0/0/0/0/0"), values);
    }
    let Opened::Images(list) = open(at).unwrap() else { panic!("one image") };
    assert_eq!(list.images, ["second", "deep/first"]);
    for (nth, image) in list.images.iter().enumerate() {
        let volume = volume(&at.join(image));
        let about = volume.about();
        assert_eq!((about.version.as_deref(), about.channels, about.size()), (Some("0.2"), 2, [4, 3, 2]));
        assert_eq!(about.levels[1].scale, [2.0, 2.0, 1.0], "it follows from the sizes");
        assert!(about.oddities.iter().all(|oddity| oddity.contains("no scale is given")), "{about:?}");
        let expected: Vec<u8> =
            (0..24_u16).flat_map(|n| (1000 * nth as u16 + 300 * n).to_le_bytes()).collect();
        assert_eq!(whole(&volume, 0, 0), expected);
        assert_eq!(whole(&volume, 1, 0), [0; 48], "absent chunks without a fill value are 0");
    }
}

/// Streaming writers of Zstandard do not know how long what they write will be, and their frames do not say.
#[test]
fn frames_of_zstandard_that_do_not_say_their_length_are_read() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let mut array = array_of_floats([2, 2, 3]);
    array["data_type"] = json!("uint16");
    array["fill_value"] = json!(0);
    array["codecs"] = json!([
        {"name": "bytes", "configuration": {"endian": "little"}},
        {"name": "zstd", "configuration": {"level": 0, "checksum": false}}
    ]);
    put_json(at, "zarr.json", &array);
    let values: Vec<u8> = (0..12_u16).flat_map(|n| (n * 300).to_le_bytes()).collect();
    // The magic number, no length and no checksum, a window of 1 KiB; a block of bytes as they are, and the
    // last one, of one byte five times.
    let block = |last: u32, kind: u32, size: u32| (size << 3 | kind << 1 | last).to_le_bytes()[..3].to_vec();
    let head = [0x28, 0xb5, 0x2f, 0xfd, 0x00, 0x00];
    let frame = [&head[..], &block(0, 0, 19), &values[..19], &block(1, 1, 5), &[7]].concat();
    put(at, "c/0/0/0", frame);
    assert_eq!(whole(&volume(at), 0, 0), [&values[..19], &[7; 5]].concat());
}

/// Whoever knows better than the metadata what translations are of says so.
#[test]
fn translations_are_of_what_somebody_says() {
    let opened = |name: &str, convention| match open_placed(&path(name), convention) {
        Ok(Opened::Volume(volume)) => *volume,
        other => panic!("{name}: {other:?}"),
    };
    for (name, found, other) in [
        ("v04-center.zip", Convention::Center, Convention::Corner),
        ("v05-corner.zip", Convention::Corner, Convention::Center),
    ] {
        let (usual, same) = (opened(name, None), opened(name, Some(found)));
        assert_eq!((usual.about().convention, usual.about()), (found, same.about()), "{name}");
        let placed = opened(name, Some(other));
        assert_eq!(placed.about().convention, other, "{name}");
        let half = if other == Convention::Corner { 0.5 } else { -0.5 };
        for (before, after) in usual.about().levels.iter().zip(&placed.about().levels) {
            for axis in 0..3 {
                assert_eq!(after.origin[axis], before.origin[axis] + half * before.scale[axis], "{name}");
            }
        }
    }
    let error = open_placed(&path("one.nii"), Some(Convention::Corner)).unwrap_err().to_string();
    assert!(error.contains("one.nii") && error.contains("no OME-Zarr"), "{error}");
    assert!(error.ends_with("leave out --origins corner"), "{error}");
}
