//! Pictures of volumes by `render`, beside the values that `crop` has of the same volume.

use std::path::Path;

use crate::tool::Sandbox;

/// A head of three channels.
const HEAD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/volumes/head.zip");
const SIZE: [usize; 3] = [98, 116, 94];

/// The values of its first channel: x fastest.
fn values(sandbox: &Sandbox) -> Vec<u8> {
    let [x, y, z] = SIZE;
    let size = format!("{x}x{y}x{z}");
    sandbox.run(&["crop", HEAD, "--at", "0,0,0", "--size", &size, "-o", "head.npy"]).expect_code(0);
    let npy = sandbox.read("head.npy");
    let header = 10 + usize::from(u16::from_le_bytes([npy[8], npy[9]]));
    npy[header..].to_vec()
}

/// The red of a picture of so many pixels.
fn drawn(sandbox: &Sandbox, [width, height]: [usize; 2], words: &[&str]) -> Vec<u8> {
    let size = format!("{width}x{height}");
    let mut command = vec!["render", HEAD, "--size", &size, "-o", "picture.png"];
    command.extend(words);
    sandbox.run(&command).expect_code(0);
    let pixels = sandbox.read_rgb("picture.png");
    assert_eq!(pixels.len(), width * height);
    pixels.iter().map(|pixel| pixel[0]).collect()
}

/// The largest difference between a picture and what a place of it must be.
fn off(picture: &[u8], width: usize, expected: impl Fn(usize, usize) -> f64) -> f64 {
    let of = |(nth, code): (usize, &u8)| (f64::from(*code) - expected(nth % width, nth / width)).abs();
    picture.iter().enumerate().map(of).fold(0.0, f64::max)
}

#[test]
fn a_face_is_the_maximum_and_the_mean_along_its_axis() {
    let sandbox = Sandbox::new();
    let values = values(&sandbox);
    let [nx, ny, nz] = SIZE;
    let at = |x: usize, y: usize, z: usize| values[(z * ny + y) * nx + x];
    let channel = ["--on", "volume", "--channels", "0", "--range", "0,1"];
    let of =
        |mode: &'static str, view: &'static str| [&channel[..], &["--mode", mode, "--view", view]].concat();
    // +z: right +x, down +y.
    let picture = drawn(&sandbox, [nx, ny], &of("mip", "+z"));
    let most = |x, y| f64::from((0..nz).map(|z| at(x, y, z)).max().unwrap());
    assert_eq!(off(&picture, nx, most), 0.0);
    let picture = drawn(&sandbox, [nx, ny], &of("average", "+z"));
    let mean = |x, y| (0..nz).map(|z| f64::from(at(x, y, z))).sum::<f64>() / nz as f64;
    assert!(off(&picture, nx, mean) <= 1.0);
    // -x: right -y, down +z.
    let picture = drawn(&sandbox, [ny, nz], &of("mip", "-x"));
    let most = |right: usize, down| f64::from((0..nx).map(|x| at(x, ny - 1 - right, down)).max().unwrap());
    assert_eq!(off(&picture, ny, most), 0.0);
}

#[test]
fn a_slice_is_the_voxels_after_the_range() {
    let sandbox = Sandbox::new();
    let values = values(&sandbox);
    let [nx, ny, nz] = SIZE;
    let words = ["--on=slices", "--slice", "y=50", "--channels", "0:FFFFFF:40..200", "--json"];
    let picture = drawn(&sandbox, [nx, nz], &words);
    let expected = |x, z| {
        let value = f64::from(values[(z * ny + 50) * nx + x]);
        ((value - 40.0) / 160.0).clamp(0.0, 1.0) * 255.0
    };
    assert!(off(&picture, nx, expected) <= 1.0);
}

/// Bricks cut a volume, and nothing of that is to be seen: beside textures that hold it whole, in a pool that
/// holds all bricks and in a small one.
#[test]
fn a_picture_is_that_of_ordinary_textures() {
    let sandbox = Sandbox::new();
    for (view, pool) in [("around:yaw=30,pitch=20", "64"), ("+y", "8")] {
        let words = ["--on=volume", "--mode=average", "--channels=0,1", "--view", view, "--pool-mib", pool];
        let size = ["render", HEAD, "--size", "96x96", "--filter=exact", "--compare", "--json"];
        let run = sandbox.run(&[&size[..], &words].concat()).expect_code(0);
        let summary = run.json();
        let compared = &summary["compared"];
        // In perspective levels change along a ray where it enters a brick, and there is none beside.
        let least = if view == "+y" { 60.0 } else { 40.0 };
        assert!(compared["psnr_db"].as_f64().unwrap() > least, "{view}: {summary}");
        assert_eq!(compared["reference_mip_bias"], summary["mip_bias"]);
        // What was read lies in the file: chunks there are compressed.
        let read = summary["bytes_read"].as_u64().unwrap();
        assert!(0 < read && read < std::fs::metadata(HEAD).unwrap().len(), "{summary}");
    }
}

/// Bricks of two voxels across, which few rays meet, along rays that meet as many as divide the jitter cycle.
#[test]
fn bricks_that_few_rays_meet_are_loaded_before_the_picture_is_taken() {
    let sandbox = Sandbox::new();
    let (side, depth) = (130, 128);
    let value = |x: usize, y: usize, z: usize| ((x * 7 + y * 13 + z * 5) % 251) as u8;
    let mut values = Vec::new();
    for (z, y) in (0..depth).flat_map(|z| (0..side).map(move |y| (z, y))) {
        values.extend((0..side).map(|x| value(x, y, z)));
    }
    sandbox.write("thin.raw", &values);
    let about = format!("width = {side}\nheight = {side}\ndepth = {depth}\nsample = \"u8\"\n");
    sandbox.write("thin.raw.toml", about.as_bytes());
    let words = "render thin.raw --on volume --mode average --filter exact --range 0,1 --size 130x130 --json";
    let words: Vec<&str> = words.split(' ').chain(["-o", "picture.png"]).collect();
    let told = sandbox.run(&words).expect_code(0).json();
    assert_eq!((&told["converged"], &told["tiles_reloaded"]), (&true.into(), &0.into()));
    let picture: Vec<u8> = sandbox.read_rgb("picture.png").iter().map(|pixel| pixel[0]).collect();
    let mean = |x, y| (0..depth).map(|z| f64::from(value(x, y, z))).sum::<f64>() / depth as f64;
    assert!(off(&picture, side, mean) <= 1.0);
}

/// One level of more than 64 MiB, of which all others are made beside the picture; a second run finds them.
#[test]
fn levels_that_a_file_lacks_are_made_in_the_background_and_kept() {
    let sandbox = Sandbox::new();
    let size = [416_usize, 416, 400];
    let [nx, ny, nz] = size;
    let value = |x: usize, y: usize, z: usize| (((x / 16) * 37 + (y / 16) * 59 + (z / 100) * 31) % 200) as u8;
    let mut values = Vec::with_capacity(nx * ny * nz);
    for (z, y) in (0..nz).flat_map(|z| (0..ny).map(move |y| (z, y))) {
        (0..nx / 16).for_each(|cell| values.extend([value(cell * 16, y, z); 16]));
    }
    sandbox.write("large.raw", &values);
    let about = format!("width = {nx}\nheight = {ny}\ndepth = {nz}\nsample = \"u8\"\n");
    sandbox.write("large.raw.toml", about.as_bytes());
    let kept = |words: &str| {
        let words: Vec<&str> = words.split(' ').collect();
        let told = sandbox.run(&words).expect_code(0).json();
        assert_eq!(told["levels_made"], "in-the-background");
        told["levels_kept"]["kept"]
            .as_u64()
            .map(|kept| (kept, told["levels_kept"]["bricks"].as_u64().unwrap()))
    };
    assert_eq!(kept("info large.raw --json"), None);
    assert_eq!(kept("info large.raw --json --cache kept"), Some((0, 64)));
    // A pixel is 16 voxels: level 4.
    let words = "render large.raw --on volume --mode average --filter exact --channels 0 --size 26x26 --json --cache kept -o";
    let pictures = ["first.png", "second.png"].map(|picture| {
        let words: Vec<&str> = words.split(' ').chain([picture]).collect();
        let told = sandbox.run(&words).expect_code(0).json();
        assert_eq!((&told["converged"], &told["levels_made"]), (&true.into(), &64.into()), "{told}");
        // The second run reads nothing but what it kept.
        assert_eq!(told["chunks_decoded"] == 0, picture == "second.png", "{told}");
        sandbox.read_rgb(picture).iter().map(|pixel| pixel[0]).collect::<Vec<u8>>()
    });
    assert_eq!(kept("info large.raw --json --cache kept"), Some((64, 64)));
    assert_eq!(pictures[0], pictures[1]);
    let mean =
        |x: usize, y: usize| (0..nz).map(|z| f64::from(value(16 * x, 16 * y, z))).sum::<f64>() / nz as f64;
    assert!(off(&pictures[0], 26, mean) <= 1.5, "{}", off(&pictures[0], 26, mean));
}

#[test]
fn the_words_for_volumes_are_checked() {
    let sandbox = Sandbox::new();
    for (words, code, part) in [
        (&["--on", "slices"][..], 2, "--slice z=K"),
        (&["--on", "volume", "--mode", "iso"], 2, "--iso V"),
        (&["--on", "volume", "--view", "z"], 2, "around:yaw"),
        (&["--on", "volume", "--channels", "3"], 1, "has the channels 0 to 2"),
        (&["--on", "slices", "--slice", "z=94"], 1, "94 planes along z"),
        (&["--on", "volume", "--time", "1"], 1, "time"),
        (&["--on", "volume", "-o", "head.jpg"], 2, "PNG"),
    ] {
        let command = [&["render", HEAD][..], words].concat();
        let told = sandbox.run(&command).expect_code(code).stderr;
        assert!(told.contains(part), "{words:?}: {told}");
    }
    let told = sandbox.run(&["render", "nothing.zarr", "--on", "volume"]).expect_code(1).stderr;
    assert!(told.contains("nothing.zarr"), "{told}");
    assert!(Path::new(HEAD).is_file());
    let help = sandbox.run(&["render", "--on", "volume", "--help"]).expect_code(0).stdout;
    assert!(help.contains("vastex render --on") && help.contains("--mode"), "{help}");
}
