//! Damaged volumes by the program: what is whole is drawn, what is not is said, and nothing passes for what
//! it is not.

use crate::tool::Sandbox;

/// An OME-Zarr of 40x40x40 voxels and a coarser level, one chunk each: brighter along x, twice as bright in
/// the coarser level.
fn store(sandbox: &Sandbox, filters: [&str; 2]) {
    let datasets = [0, 1].map(|level| {
        let scale = level + 1;
        format!(
            r#"{{"path": "{level}", "coordinateTransformations": [{{"type": "scale", "scale": [{scale}, {scale}, {scale}]}}]}}"#
        )
    });
    let axes = ["z", "y", "x"].map(|name| format!(r#"{{"name": "{name}", "type": "space"}}"#)).join(", ");
    let image = format!(
        r#"{{"multiscales": [{{"version": "0.4", "axes": [{axes}], "datasets": [{}]}}]}}"#,
        datasets.join(", ")
    );
    for level in [0, 1] {
        std::fs::create_dir_all(sandbox.path(&format!("a.zarr/{level}"))).unwrap();
        let side = [40, 20][level];
        let meta = format!(
            r#"{{"zarr_format": 2, "shape": [{side}, {side}, {side}], "chunks": [{side}, {side}, {side}], "dtype": "|u1",
            "compressor": null, "fill_value": 0, "order": "C", "filters": {}, "dimension_separator": "."}}"#,
            filters[level]
        );
        sandbox.write(&format!("a.zarr/{level}/.zarray"), meta.as_bytes());
        let values: Vec<u8> = (0..side * side * side).map(|n| (n % side * (level + 1) * 3) as u8).collect();
        sandbox.write(&format!("a.zarr/{level}/0.0.0"), &values);
    }
    sandbox.write("a.zarr/.zgroup", br#"{"zarr_format": 2}"#);
    sandbox.write("a.zarr/.zattrs", image.as_bytes());
}

/// How often a text is said.
fn times(text: &str, said: &str) -> usize {
    text.matches(said).count()
}

#[test]
fn a_damaged_chunk_leaves_the_picture() {
    let sandbox = Sandbox::new();
    store(&sandbox, ["null"; 2]);
    let draw = |size: &str| {
        let words = ["render", "a.zarr", "--on", "slices", "--slice", "z=5", "--size", size, "-o", "out.png"];
        let ended = sandbox.run(&words).expect_code(0);
        (ended, sandbox.read_rgb("out.png"))
    };
    let (_, sound) = draw("40x40");
    // Of the coarser level.
    sandbox.write("a.zarr/1/0.0.0", b"cut");
    let (ended, picture) = draw("40x40");
    assert!(picture == sound, "the finer level is whole, and shown");
    assert_eq!(times(&ended.stderr, "1/0.0.0"), 1, "{ended}");
    let (_, coarse) = draw("20x20");
    assert!(
        coarse[10 * 20 + 18][0] > 200,
        "voxels of the finer level stand for it: {:?}",
        coarse[10 * 20 + 18]
    );
    // Of the level that the window follows from.
    store(&sandbox, ["null"; 2]);
    sandbox.write("a.zarr/0/0.0.0", b"cut");
    let (ended, picture) = draw("40x40");
    assert_eq!(times(&ended.stderr, "0/0.0.0"), 1, "{ended}");
    assert!(picture[10 * 40 + 37][0] > 200, "coarser voxels stand for it: {:?}", picture[10 * 40 + 37]);
    let (_, coarse) = draw("20x20");
    assert!(coarse[10 * 20 + 18][0] > 200, "the coarser level is whole: {:?}", coarse[10 * 20 + 18]);
    let shot = ["view", "a.zarr", "--screenshot", "shot.png", "--size", "128x96"];
    let ended = sandbox.run(&shot).expect_code(0);
    assert!(ended.stderr.contains("0/0.0.0"), "{ended}");
}

#[test]
fn another_level_does_not_pass_for_one_that_cannot_be_read() {
    let sandbox = Sandbox::new();
    let delta = r#"[{"id": "delta", "dtype": "|u1"}]"#;
    store(&sandbox, [delta, "null"]);
    let crop = |level: &[&str]| {
        let words = ["crop", "a.zarr", "--at", "0,0,0", "--size", "4x4x4", "-o", "a.npy"];
        sandbox.run(&[&words[..], level].concat())
    };
    for level in [&[][..], &["--level", "0"]] {
        let ended = crop(level).expect_code(1);
        for said in ["'delta'", "a.zarr/0/.zarray", "--level 1"] {
            assert!(ended.stderr.contains(said), "{said}: {ended}");
        }
    }
    assert!(!sandbox.path("a.npy").exists());
    crop(&["--level", "1"]).expect_code(0);
    let npy = sandbox.read("a.npy");
    assert_eq!(npy[npy.len() - 4..], [0, 6, 12, 18]);
    let ended = crop(&["--level", "2"]).expect_code(1);
    assert!(ended.stderr.contains("levels 0 to 1"), "{ended}");
    for output in ["b.vastex", "b.zarr"] {
        let ended = sandbox.run(&["build", "a.zarr", "-o", output]).expect_code(1);
        assert!(ended.stderr.contains("'delta'") && ended.stderr.contains("a.zarr/0/.zarray"), "{ended}");
        assert!(!sandbox.path(output).exists());
    }
    let words = "render a.zarr --on slices --slice z=5 --size 20x20 --json -o out.png";
    let ended = sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0);
    assert!(ended.stderr.contains("the finest level, '0', is missing"), "{ended}");
    let told = ended.json();
    assert!(told["finest_left_out"].as_str().is_some_and(|why| why.contains("'delta'")), "{told}");
    let info = sandbox.run(&["info", "a.zarr", "--json"]).expect_code(0).json();
    assert_eq!(
        (&info["levels_left_out"][0]["number"], &info["levels_left_out"][0]["path"]),
        (&0.into(), &"0".into())
    );
}
