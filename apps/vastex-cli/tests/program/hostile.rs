//! What people and machines do to a program: pipes where files belong, few open files, damaged images, impatience.

use std::process::{Command, Stdio};

use crate::tool::{Desk, Ended};

#[test]
fn pipes_and_devices_are_refused_wherever_a_file_is_read() {
    let desk = Desk::with_container();
    assert!(Command::new("mkfifo").arg(desk.path("pipe")).status().unwrap().success());
    let cases: [&[&str]; 7] = [
        &["replay", "pipe"],
        &["replay", "/dev/zero"],
        &["learn", "pipe", "-o", "sets"],
        &["render", "image.vastex", "--settings", "pipe", "-o", "a.png"],
        &["render", "image.vastex", "--prefetch-sets", "pipe", "-o", "a.png"],
        &["render", "image.vastex", "--prefetch-sets", "/dev/zero", "-o", "a.png"],
        &["build", "image.png", "--mask", "pipe", "-o", "b.vastex"],
    ];
    let before = desk.names();
    for args in cases {
        // One that waited for a writer would never end.
        let ended = desk.run(args).expect_code(1);
        assert!(ended.stderr.contains("a device or a pipe"), "{args:?}: {ended}");
        assert_eq!(desk.names(), before, "{args:?}");
    }
}

#[test]
fn a_mosaic_of_more_columns_than_open_files_is_built_all_the_same() {
    let desk = Desk::new();
    let columns = 60;
    for x in 0..columns {
        desk.write_png(&format!("p_{x}_0.png"), [8, 24]);
        desk.write_png(&format!("p_{x}_1.png"), [8, 24]);
    }
    desk.write("m.txt", b"vastex mosaic\ngrid p_{x}_{y}.png\n");
    let build = ["build", "m.txt", "-o", "a.vastex", "--page", "64", "--threads", "1", "--quiet"];
    desk.run(&build).expect_code(0);
    let whole = desk.read("a.vastex");
    // Both limits, so that it cannot be raised; 128 are left to everything else.
    let limited = |files: u32| {
        let mut shell = Command::new("sh");
        shell.current_dir(desk.path("")).env_remove("RUST_LOG");
        shell.args(["-c", &format!("ulimit -n {files}; exec \"$@\""), "sh"]);
        Ended::of(&shell.arg(env!("CARGO_BIN_EXE_vastex")).args(build).output().unwrap())
    };
    for files in [40, 128, 150] {
        limited(files).expect_code(0);
        assert!(desk.read("a.vastex") == whole, "{files}");
    }
}

#[test]
fn exports_of_sixteen_bits_and_floats_end() {
    let desk = Desk::new();
    let file = std::fs::File::create(desk.path("deep.png")).unwrap();
    let mut encoder = png::Encoder::new(file, 301, 177);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Sixteen);
    let texels: Vec<u8> = (0..301 * 177 * 6).map(|n: u32| (n * 7 / 5) as u8).collect();
    encoder.write_header().unwrap().write_image_data(&texels).unwrap();
    desk.run(&["build", "deep.png", "-o", "deep.vastex", "--page", "64", "--quiet"]).expect_code(0);
    for layout in ["gaiasky", "celestia"] {
        let args = ["export", "deep.vastex", "--layout", layout, "-o", layout, "--json"];
        assert_eq!(desk.run(&args).expect_code(0).json()["format"], "png");
    }
    desk.run(&["build", "--layer", "color=deep.png:rgba16f", "-o", "float.vastex", "--quiet"]).expect_code(0);
    let before = desk.names();
    for layout in ["gaiasky", "celestia", "deepzoom", "prototype"] {
        let refused = desk.run(&["export", "float.vastex", "--layout", layout, "-o", "out"]).expect_code(2);
        assert!(refused.stderr.contains("texels of rgba16f are floats"), "{refused}");
        assert_eq!(desk.names(), before);
    }
}

#[test]
fn an_impatient_second_signal_ends_the_program_too() {
    let desk = Desk::new();
    desk.write_png("big.png", [3000, 3000]);
    let args = ["build", "big.png", "-o", "out.vastex", "--page", "40", "--quiet"];
    let mut command = desk.command(&args);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // Once there is something to lose, the program listens.
    let has_begun = || desk.path(".out.vastex.partial").exists() || desk.path("out.vastex").exists();
    for _ in 0..30_000 {
        if has_begun() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let number = child.id().to_string();
    for signal in ["INT", "TERM"] {
        // It may have ended by the first.
        let _ = Command::new("kill").args(["-s", signal, &number]).stderr(Stdio::null()).status();
    }
    let ended = Ended::of(&child.wait_with_output().unwrap());
    assert!(matches!(ended.code, Some(130 | 0)), "{ended}");
    // Whatever it left goes with the next run.
    desk.run(&args).expect_code(0);
    assert_eq!(desk.names(), ["big.png", "out.vastex"]);
}

#[test]
fn the_two_images_of_the_guide_become_one_terrain() {
    let desk = Desk::new();
    desk.write_png("color.png", [1080, 540]);
    desk.write_png("height.png", [108, 54]);
    let args =
        ["build", "-o", "i.vastex", "--layer", "color=color.png", "--layer", "height=height.png:rgba8"];
    let built = desk.run(&[&args[..], &["--json"]].concat()).expect_code(0).json();
    assert_eq!((&built["layers"][0]["scale"], &built["layers"][1]["scale"]), (&1.into(), &4.into()));
    let says =
        |notice: &serde_json::Value| notice.as_str().unwrap().contains("resampled to 270x135, a quarter");
    assert!(built["notices"].as_array().unwrap().iter().any(says), "{built}");
    desk.run(&["verify", "i.vastex"]).expect_code(0);
}
