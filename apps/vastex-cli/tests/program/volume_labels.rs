//! Labels in pictures of volumes, of a store whose labels differ in their upper 32 bits alone.

use std::collections::BTreeMap;

use crate::tool::Sandbox;

const SIZE: [usize; 3] = [24, 20, 12];
/// Three balls beside one another, and a plate that has a colour in the file.
const IDS: [u64; 4] = [7, 1 << 32 | 7, 2 << 32 | 7, 4_294_967_301];
const PLATE: [u8; 3] = [10, 200, 30];

fn label(x: usize, y: usize, z: usize) -> u64 {
    let is_ball = |cx: i64, r: i64| {
        let [x, y, z] = [x, y, z].map(|n| n as i64);
        (x - cx).pow(2) + (y - 8).pow(2) + (z - 5).pow(2) < r * r
    };
    match (x, y) {
        _ if is_ball(4, 4) => IDS[0],
        _ if is_ball(12, 4) => IDS[1],
        _ if is_ball(20, 4) => IDS[2],
        (3..20, 15..18) if z < 9 => IDS[3],
        _ => 0,
    }
}

/// An image and labels beside it, as OME-Zarr 0.4, in one chunk each.
fn store(sandbox: &Sandbox) {
    let [nx, ny, nz] = SIZE;
    let places = || (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (x, y, z))));
    let array = |dtype: &str| {
        format!(
            r#"{{"zarr_format": 2, "shape": [{nz}, {ny}, {nx}], "chunks": [{nz}, {ny}, {nx}], "dtype": "{dtype}",
            "compressor": null, "fill_value": 0, "order": "C", "filters": null, "dimension_separator": "/"}}"#
        )
    };
    let about = |more: &str| {
        format!(
            r#"{{"multiscales": [{{"version": "0.4", "axes": [{{"name": "z", "type": "space"}}, {{"name": "y", "type": "space"}},
            {{"name": "x", "type": "space"}}], "datasets": [{{"path": "0", "coordinateTransformations":
            [{{"type": "scale", "scale": [2, 1, 1]}}]}}]}}]{more}}}"#
        )
    };
    let colors = format!(
        r#", "image-label": {{"version": "0.4", "colors": [{{"label-value": {}, "rgba": [10, 200, 30, 255]}}]}}"#,
        IDS[3]
    );
    let image: Vec<u8> = places().map(|(x, y, z)| (x * 3 + y * 5 + z * 7) as u8).collect();
    let labels: Vec<u8> = places().flat_map(|(x, y, z)| label(x, y, z).to_le_bytes()).collect();
    let group = br#"{"zarr_format": 2}"#;
    for (name, bytes) in [
        ("cells.zarr/.zgroup", &group[..]),
        ("cells.zarr/.zattrs", about("").as_bytes()),
        ("cells.zarr/0/.zarray", array("|u1").as_bytes()),
        ("cells.zarr/0/0/0/0", &image),
        ("cells.zarr/labels/.zgroup", group),
        ("cells.zarr/labels/.zattrs", br#"{"labels": ["nuclei"]}"#),
        ("cells.zarr/labels/nuclei/.zgroup", group),
        ("cells.zarr/labels/nuclei/.zattrs", about(&colors).as_bytes()),
        ("cells.zarr/labels/nuclei/0/.zarray", array("<u8").as_bytes()),
        ("cells.zarr/labels/nuclei/0/0/0/0", &labels),
    ] {
        let path = sandbox.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
}

fn drawn(sandbox: &Sandbox, words: &str) -> Vec<[u8; 3]> {
    let words: Vec<&str> = words.split(' ').chain(["-o", "picture.png"]).collect();
    sandbox.run(&words).expect_code(0);
    sandbox.read_rgb("picture.png")
}

#[test]
fn a_slice_shows_each_label_in_a_colour_of_its_own() {
    let sandbox = Sandbox::new();
    store(&sandbox);
    let [nx, ny, _] = SIZE;
    let slice =
        "render cells.zarr --on slices --slice z=5 --size 24x20 --range 0,1 --channels 0 --labels nuclei";
    let picture = drawn(&sandbox, &format!("{slice} --label-opacity 1"));
    let mut colors: BTreeMap<u64, [u8; 3]> = BTreeMap::new();
    for (nth, pixel) in picture.iter().enumerate() {
        let (x, y) = (nth % nx, nth / nx);
        match label(x, y, 5) {
            0 => assert_eq!(*pixel, [(x * 3 + y * 5 + 35) as u8; 3], "the image at {x}, {y}"),
            label => assert_eq!(pixel, colors.entry(label).or_insert(*pixel), "label {label} at {x}, {y}"),
        }
    }
    assert_eq!((picture.len(), colors.len()), (nx * ny, 4));
    let mut different: Vec<_> = colors.values().collect();
    different.sort_unstable();
    different.dedup();
    assert_eq!((different.len(), colors[&IDS[3]]), (4, PLATE));
    // Outlines, of one label alone: those beside it show the image.
    let words = format!("{slice} --label-outlines --label-selected {} --label-others hidden", IDS[1]);
    let picture = drawn(&sandbox, &words);
    for (nth, pixel) in picture.iter().enumerate() {
        let (x, y) = (nth % nx, nth / nx);
        let is_edge = [(x + 1, y), (x - usize::from(x > 0), y), (x, y + 1), (x, y - usize::from(y > 0))]
            .iter()
            .any(|(x, y)| label(*x, *y, 5) != IDS[1]);
        let expected = match label(x, y, 5) == IDS[1] && is_edge {
            true => colors[&IDS[1]],
            false => [(x * 3 + y * 5 + 35) as u8; 3],
        };
        assert_eq!(*pixel, expected, "{x}, {y}");
    }
}

#[test]
fn labels_are_drawn_by_themselves_and_cropped_exactly() {
    let sandbox = Sandbox::new();
    store(&sandbox);
    let [nx, ny, nz] = SIZE;
    let picture = drawn(&sandbox, "render cells.zarr/labels/nuclei --on volume --view +z --size 24x20");
    for (nth, pixel) in picture.iter().enumerate() {
        let first = (0..nz).map(|z| label(nth % nx, nth / nx, z)).find(|label| *label != 0);
        assert_eq!(*pixel != [0; 3], first.is_some(), "{}, {}", nth % nx, nth / nx);
        if first == Some(IDS[3]) {
            let [red, green, blue] = *pixel;
            assert!(green > red && green > blue, "the plate's own colour, lit: {pixel:?}");
        }
    }
    let size = format!("{nx}x{ny}x{nz}");
    let crop = ["crop", "cells.zarr/labels/nuclei", "--at", "0,0,0", "--size", &size, "-o", "labels.npy"];
    sandbox.run(&crop).expect_code(0);
    let npy = sandbox.read("labels.npy");
    let header = 10 + usize::from(u16::from_le_bytes([npy[8], npy[9]]));
    let cropped = npy[header..].chunks_exact(8).map(|bytes| u64::from_le_bytes(bytes.try_into().unwrap()));
    let places = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| label(x, y, z))));
    assert!(cropped.eq(places));
}

#[test]
fn the_words_for_labels_are_checked() {
    let sandbox = Sandbox::new();
    store(&sandbox);
    for (words, code, part) in [
        ("cells.zarr --labels cells", 1, "has the labels nuclei"),
        ("cells.zarr --label-outlines", 1, "goes with --labels"),
        ("cells.zarr --labels nuclei --label-selected 0", 2, "0 is where there is no label"),
        ("cells.zarr --labels nuclei --label-selected -1", 1, "0 to 18446744073709551615"),
        ("cells.zarr --labels nuclei --label-opacity 2", 2, "0 to 1"),
        ("cells.zarr/labels/nuclei --labels cells", 1, "labels itself"),
        ("cells.zarr/labels/nuclei --channels 0", 1, "colours of their own"),
    ] {
        let words: Vec<&str> =
            ["render", "--on=volume", "--size=24x20"].into_iter().chain(words.split(' ')).collect();
        let told = sandbox.run(&words).expect_code(code).stderr;
        assert!(told.contains(part), "{words:?}: {told}");
    }
    // What is said of the image's translations is said of no labels that lie elsewhere.
    sandbox.write("far.raw", &[3; SIZE[0] * SIZE[1] * SIZE[2]]);
    sandbox.write("far.raw.toml", b"width = 24\nheight = 20\ndepth = 12\nsample = \"u8\"\n");
    let words = "render cells.zarr --on slices --slice z=5 --size 24x20 --labels far.raw --origins corner";
    sandbox.run(&words.split(' ').collect::<Vec<_>>()).expect_code(0);
}

#[test]
fn labels_that_cannot_be_read_leave_the_image() {
    let sandbox = Sandbox::new();
    store(&sandbox);
    let words = "render cells.zarr --on slices --slice z=6 --size 40x32 --channels 0";
    let image = drawn(&sandbox, words);
    sandbox.write("cells.zarr/labels/nuclei/0/0/0/0", b"cut off");
    let with: Vec<&str> = words.split(' ').chain(["--labels", "nuclei", "-o", "picture.png"]).collect();
    let ended = sandbox.run(&with).expect_code(0);
    assert_eq!(ended.stderr.matches("labels/nuclei/0/0/0/0").count(), 1, "{ended}");
    assert!(sandbox.read_rgb("picture.png") == image);
}
