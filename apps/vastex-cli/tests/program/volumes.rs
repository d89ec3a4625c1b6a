//! Volumes where they lie: what `info` says of them for scripts, and regions as NumPy reads them.

use std::io::Read;
use std::path::{Path, PathBuf};

use serde_json::json;

use crate::tool::Sandbox;

/// Where the fixtures of vastex-volume lie.
fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../crates/vastex-volume/fixtures").join(name)
}

fn copy(sandbox: &Sandbox, name: &str) {
    sandbox.write(name, &std::fs::read(fixture(name)).unwrap());
}

/// The bytes behind the header of an array of NumPy, and the words of the header.
fn array(npy: &[u8]) -> (String, Vec<u8>) {
    let header = 10 + usize::from(u16::from_le_bytes([npy[8], npy[9]]));
    (String::from_utf8(npy[10..header].to_vec()).unwrap(), npy[header..].to_vec())
}

/// What the library that wrote a fixture has as its values.
fn expected(name: &str) -> Vec<u8> {
    let file = std::fs::File::open(fixture(&format!("expected/{name}.npy.gz"))).unwrap();
    let mut npy = Vec::new();
    flate2::read::GzDecoder::new(file).read_to_end(&mut npy).unwrap();
    array(&npy).1
}

#[test]
fn info_has_the_keys_that_scripts_use() {
    let sandbox = Sandbox::new();
    copy(&sandbox, "v04-center.zip");
    let told = sandbox.run(&["info", "v04-center.zip", "--json"]).expect_code(0).json();
    assert_eq!(told["size"], json!([22, 20, 6]));
    let levels: Vec<_> =
        told["levels"].as_array().unwrap().iter().map(|l| [l["size"].clone(), l["scale"].clone()]).collect();
    assert_eq!(levels[2], [json!([4, 4, 6]), json!([3.0, 3.0, 3.0])]);
    for (key, value) in [
        ("channels", json!(2)),
        ("times", json!(2)),
        ("dtype", json!("uint16")),
        ("bricks", json!(12)),
        ("absent_bricks", json!(0)),
        ("labels", json!(["cells"])),
    ] {
        assert_eq!(told[key], value, "{key}");
    }
    let made: Vec<_> = told["made_levels"].as_array().unwrap().iter().map(|l| l["size"].clone()).collect();
    assert_eq!(made, [json!([2, 2, 3]), json!([1, 1, 2]), json!([1, 1, 1])]);
    assert_eq!((&told["levels_made"], &told["levels_made_by"]), (&json!("at-opening"), &json!("mean")));
    let labels = sandbox.run(&["info", "v04-center.zip/labels/cells", "--json"]).expect_code(0).json();
    assert_eq!((&labels["is_label"], &labels["levels_made_by"]), (&json!(true), &json!("majority")));
    // Translations are of what somebody says.
    let corner =
        sandbox.run(&["info", "v04-center.zip", "--json", "--origins", "corner"]).expect_code(0).json();
    assert_eq!((&told["convention"], &corner["convention"]), (&json!("center"), &json!("corner")));
    let half = |of: &serde_json::Value, key: &str| of["levels"][1][key][0].as_f64().unwrap();
    assert_eq!(half(&corner, "origin"), half(&told, "origin") + 0.5 * half(&told, "scale"));
    sandbox.write("a.pgm", b"P5 1 1 255\n7");
    let ended = sandbox.run(&["info", "a.pgm", "--origins", "corner"]).expect_code(1);
    assert!(ended.stderr.contains("a.pgm: is no volume, and --origins is for volumes"), "{ended}");
    assert_eq!(told["oddities"].as_array().unwrap().len(), 3);
    let text = sandbox.run(&["info", "v04-center.zip", "--count"]).expect_code(0).stdout;
    for words in [
        "22 x 20 x 6 voxels of uint16",
        "DAPI",
        "level 1 (1): 11 x 10 x 6",
        "3 more down to one voxel are made at opening by mean",
        "12 of 64 voxels a side; 0 absent",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    copy(&sandbox, "plate.zip");
    let list = sandbox.run(&["info", "plate.zip", "--json"]).expect_code(0).json();
    assert_eq!((&list["kind"], &list["images"]), (&json!("images"), &json!(["A/1/0", "A/1/1"])));
}

#[test]
fn a_region_of_a_volume_is_what_is_stored() {
    let sandbox = Sandbox::new();
    copy(&sandbox, "v04-center.zip");
    let crop = [
        "crop",
        "v04-center.zip",
        "--at",
        "3,5,1",
        "--size",
        "9x7x4",
        "--channel",
        "1",
        "--time",
        "1",
        "-o",
        "a.npy",
    ];
    sandbox.run(&[&crop[..], &["--quiet"]].concat()).expect_code(0);
    let (header, values) = array(&sandbox.read("a.npy"));
    assert!(header.starts_with("{'descr': '<u2', 'fortran_order': False, 'shape': (4, 7, 9), }"), "{header}");
    let all = expected("v04-center");
    let mut wanted = Vec::new();
    for z in 1..5 {
        for y in 5..12 {
            let begin = 2 * ((((2 + 1) * 6 + z) * 20 + y) * 22 + 3);
            wanted.extend_from_slice(&all[begin..begin + 18]);
        }
    }
    assert!(values == wanted);
    for (name, size, bytes) in [("one.nii", "7x6x5", 7 * 6 * 5 * 2), ("layers.tif", "11x9x4", 11 * 9 * 4 * 4)]
    {
        copy(&sandbox, name);
        sandbox.run(&["crop", name, "--at", "0,0,0", "--size", size, "-o", "b.npy"]).expect_code(0);
        assert!(array(&sandbox.read("b.npy")).1 == expected(name)[..bytes], "{name}");
    }
}

#[test]
fn what_cannot_be_cut_says_why_and_leaves_nothing() {
    let sandbox = Sandbox::with_container();
    copy(&sandbox, "v04-center.zip");
    copy(&sandbox, "v2-delta.zip");
    copy(&sandbox, "plate.zip");
    for (args, code, says) in [
        ("crop v04-center.zip --at 0,0,5 --size 2x2x2 -o a.npy", 1, "beyond the edge"),
        ("crop v04-center.zip --at 0,-1,0 --size 2x2x2 -o a.npy", 1, "2x2x2 voxels at 0,-1,0 reach beyond"),
        ("crop v04-center.zip --at=-1,0,0 --size 2x2x2 --level 3 -o a.npy", 1, "levels 0 to 2"),
        ("crop v04-center.zip --at 0,0,0 --size 2x2x2 --level 3 -o a.npy", 1, "levels 0 to 2"),
        ("crop v04-center.zip --at 0,0,0 --size 2x2x2 --channel 2 -o a.npy", 1, "channels 0 to 1"),
        ("crop v04-center.zip --at 0,0 --size 2x2 -o a.npy", 1, "--at X,Y,Z"),
        ("crop plate.zip --at 0,0,0 --size 2x2x2 -o a.npy", 1, "A/1/0, A/1/1"),
        ("crop v2-delta.zip --at 0,0,0 --size 2x2x2 -o a.npy", 1, "'delta'"),
        ("info v2-delta.zip", 1, "v2-delta.zip/0/.zarray"),
        ("render v04-center.zip --on image -o a.png", 1, "an image is needed"),
        ("crop image.vastex --at 0,0,0 --size 2x2x2 -o a.npy", 1, "image.vastex"),
        ("crop v04-center.zip --at 0,0,0 --size 2x2 -o a.npy", 2, "three, of a volume"),
        ("crop v04-center.zip --at 0,0,0 --size 2x2x2 -o a.png", 2, ".npy"),
        ("crop image.vastex --at 0,0 --size 2x2 --channel 1 -o a.npy", 2, "--channel"),
    ] {
        let ended = sandbox.run(&args.split(' ').collect::<Vec<_>>()).expect_code(code);
        assert!(ended.stderr.contains(says), "{args}: {ended}");
        assert!(!sandbox.path("a.npy").exists() && !sandbox.path("a.png").exists(), "{args}");
    }
}

#[test]
fn a_volume_is_built_and_read_again() {
    let sandbox = Sandbox::new();
    copy(&sandbox, "v04-center.zip");
    for (output, format) in [("out.vastex", "container"), ("out.zarr", "ome-zarr")] {
        let told = sandbox.run(&["build", "v04-center.zip", "-o", output, "--json"]).expect_code(0).json();
        assert_eq!((&told["format"], &told["downsample"]), (&json!(format), &json!("mean")), "{told}");
        assert_eq!((&told["channels"], &told["times"]), (&json!(2), &json!(2)));
        let info = sandbox.run(&["info", output, "--json"]).expect_code(0).json();
        assert_eq!((&info["size"], &info["dtype"]), (&json!([22, 20, 6]), &json!("uint16")));
        assert_eq!((&info["downsample"], &info["unit"]), (&json!("mean"), &json!("micrometer")));
        let npy = format!("{format}.npy");
        let whole = ["--at", "0,0,0", "--size", "22x20x6", "--channel", "1", "--time", "1", "-o", &npy];
        sandbox.run(&[&["crop", output][..], &whole].concat()).expect_code(0);
        let (_, found) = array(&sandbox.read(&npy));
        assert!(found == expected("v04-center")[3 * 22 * 20 * 6 * 2..], "{format}");
    }
    sandbox.run(&["verify", "out.vastex"]).expect_code(0);
    // What is of images, and what is of volumes.
    for (arguments, says) in [
        (&["v04-center.zip", "-o", "x.vastex", "--format", "r8"][..], "--format"),
        (&["v04-center.zip", "-o", "x.vastex", "--reorder"], "--reorder"),
        (&["v04-center.zip", "-o", "x.vastex", "--shards", "2"], "--shards"),
        (&["v04-center.zip", "-o", "x.zarr", "--compress", "lz4"], "zstd, gzip or none"),
        (&["v04-center.zip", "-o", "x.zarr", "--zarr", "0.4", "--shards", "2"], "0.4 has no shards"),
        (&["plate.zip", "-o", "x.zarr"], "A/1/0"),
    ] {
        copy(&sandbox, "plate.zip");
        let error = sandbox.run(&[&["build"][..], arguments].concat()).expect_code(1).stderr;
        assert!(error.contains(says), "{arguments:?}: {error}");
    }
    let error = sandbox.run(&["render", "out.vastex", "--on", "plane", "-o", "x.png"]).expect_code(1).stderr;
    assert!(error.contains("is a volume"), "{error}");
}
