//! What the program says and does not say, and what all of its pictures have in common.

use crate::tool::{Ended, Sandbox};

fn words(command: &str) -> Vec<&str> {
    command.split_whitespace().collect()
}

/// Drivers that look for a display complain where there is none, in lines that look like the program's own.
#[test]
fn a_program_without_a_window_asks_for_no_window_system() {
    let sandbox = Sandbox::with_container();
    sandbox.write_grey_png("relief.png", [64, 32]);
    sandbox.write("v.raw", &[7; 8 * 8 * 8]);
    sandbox.write("v.raw.toml", b"width = 8\nheight = 8\ndepth = 8\nsample = \"u8\"\n");
    let mut all = vec![
        "render image.vastex --size 64x36 -o out.png",
        "render image.vastex --size 64x36 --compare",
        "render relief.png --cache off --on terrain --size 64x36 --compare",
        "render image.vastex --on globe --size 64x36 --report page",
        "build image.png -o other.vastex",
        "info image.vastex",
        "verify image.vastex",
    ];
    if cfg!(feature = "volumes") {
        all.extend([
            "render v.raw --on volume --size 32x32 --compare -o out.png",
            "render v.raw --on slices --slice z=1 --size 32x32 -o out.png",
            "info v.raw",
            "build v.raw -o v.vastex",
        ]);
    }
    if cfg!(feature = "view") {
        all.push("view image.vastex --size 64x36 --screenshot out.png");
    }
    if cfg!(all(feature = "view", feature = "volumes")) {
        all.push("view v.raw --size 160x120 --screenshot out.png");
    }
    for args in all {
        let mut command = sandbox.command(&words(args));
        for variable in ["XDG_RUNTIME_DIR", "DISPLAY", "WAYLAND_DISPLAY", "NODEVICE_SELECT"] {
            command.env_remove(variable);
        }
        let ended = Ended::of(&mut command).expect_code(0);
        let is_error = |line: &str| line.to_lowercase().starts_with("error");
        assert!(!ended.stdout.lines().chain(ended.stderr.lines()).any(is_error), "{args}: {ended}");
    }
}

#[test]
fn what_is_behind_an_image_looks_the_same_whatever_its_channels() {
    let sandbox = Sandbox::with_container();
    sandbox.write_grey_png("grey.png", [300, 200]);
    sandbox.run(&words("build grey.png -o grey.vastex --page 64 --quiet")).expect_code(0);
    let corner = |name: &str| {
        let out = format!("{name}.png");
        sandbox.run(&words(&format!("render {name}.vastex --size 128x36 -o {out}"))).expect_code(0);
        sandbox.read_rgb(&out)[0]
    };
    let (grey, colour) = (corner("grey"), corner("image"));
    assert_eq!(grey, colour);
    assert_eq!(colour, [22, 25, 31]);
}

#[test]
fn a_comparison_says_that_both_pictures_are_too_coarse() {
    let sandbox = Sandbox::with_container();
    sandbox.write("small.toml", b"[default_pool]\nsize_mib = 0.2\n");
    let render = "render image.vastex --size 320x180 --compare";
    let sharp = sandbox.run(&words(render)).expect_code(0);
    assert!(sharp.stdout.contains("(gpu): ") && !sharp.stdout.contains("coarser"), "{sharp}");
    let small = format!("{render} --settings small.toml");
    let coarse = sandbox.run(&words(&small)).expect_code(0);
    assert!(coarse.stdout.contains(" levels coarser than wanted as well): "), "{coarse}");
    let told = sandbox.run(&words(&format!("{small} --json"))).expect_code(0).json();
    assert!(told["reference_mip_bias"].as_f64().unwrap() > 0.0, "{told}");
    assert_eq!(told["reference_mip_bias"], told["mip_bias"]);
}

#[test]
fn a_build_says_what_it_replaces_and_leaves_zeros_out() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [300, 200]);
    let build = words("build image.png -o image.vastex");
    let first = sandbox.run(&build).expect_code(0);
    assert!(!first.stderr.contains("is there already"), "{first}");
    assert!(first.stdout.contains(" tiles; ") && !first.stdout.contains(" 0 "), "{first}");
    let second = sandbox.run(&build).expect_code(0);
    assert!(second.stderr.contains("note: image.vastex: is there already"), "{second}");
    let quiet = sandbox.run(&[&build[..], &["--quiet"]].concat()).expect_code(0);
    assert_eq!(quiet.stderr, "");
}

#[cfg(feature = "view")]
#[test]
fn a_file_in_the_place_of_a_command_is_opened_in_the_window() {
    let sandbox = Sandbox::with_container();
    let run = |file: &str| {
        let mut command = sandbox.command(&[file]);
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        Ended::of(&mut command)
    };
    if cfg!(target_os = "linux") {
        let opened = run("image.vastex").expect_code(1);
        assert!(opened.stderr.contains("no window can be opened"), "{opened}");
        assert!(!opened.stderr.contains(".rs:"), "no place in anybody's source: {opened}");
    }
    let missing = run("missing.vastex").expect_code(1);
    assert!(missing.stderr.contains("missing.vastex: there is no such file"), "{missing}");
    let misspelt = run("veiw").expect_code(2);
    assert!(misspelt.stderr.contains("unrecognized subcommand 'veiw'"), "{misspelt}");
}

#[cfg(feature = "view")]
#[test]
fn shapes_that_are_not_there_open_no_window() {
    let sandbox = Sandbox::with_container();
    let ended = sandbox.run(&["view", "image.vastex", "--shapes", "gone.geojson"]).expect_code(1);
    assert!(ended.stderr.contains("gone.geojson: cannot be read"), "{ended}");
}

/// Names of files are bytes on Unix.
#[cfg(all(unix, feature = "volumes"))]
#[test]
fn names_that_are_no_text_are_names_of_files() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let sandbox = Sandbox::with_container();
    sandbox.write("v.raw", &[7; 8 * 8 * 8]);
    sandbox.write("v.raw.toml", b"width = 8\nheight = 8\ndepth = 8\nsample = \"u8\"\n");
    let [array, labels] = [&b"\xff.npy"[..], b"\xff.raw"].map(OsStr::from_bytes);
    let mut crop = sandbox.command(&words("crop image.png --at 0,0 --size 4x4 -o"));
    Ended::of(crop.arg(array)).expect_code(0);
    assert!(sandbox.path("").join(array).is_file());
    for (from, ending) in [("v.raw", ""), ("v.raw.toml", ".toml")] {
        let mut to = labels.to_owned();
        to.push(ending);
        std::fs::copy(sandbox.path(from), sandbox.path("").join(to)).unwrap();
    }
    let mut render = sandbox.command(&words("render v.raw --on slices --slice z=1 --size 8x8 --labels"));
    Ended::of(render.arg(labels)).expect_code(0);
}
