//! What people and machines do to a program: pipes where files belong, few open files, damaged images,
//! impatience.

use std::io::Write;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};

use crate::tool::{Ended, PATIENCE, Sandbox};

#[test]
fn pipes_and_devices_are_refused_wherever_a_file_is_read() {
    let sandbox = Sandbox::with_container();
    assert!(Command::new("mkfifo").arg(sandbox.path("pipe")).status().unwrap().success());
    let cases: [&[&str]; 7] = [
        &["replay", "pipe"],
        &["replay", "/dev/zero"],
        &["learn", "pipe", "-o", "sets"],
        &["render", "image.vastex", "--settings", "pipe", "-o", "a.png"],
        &["render", "image.vastex", "--prefetch-sets", "pipe", "-o", "a.png"],
        &["render", "image.vastex", "--prefetch-sets", "/dev/zero", "-o", "a.png"],
        &["build", "image.png", "--mask", "pipe", "-o", "b.vastex"],
    ];
    let before = sandbox.names();
    for args in cases {
        // One that waited for a writer would never end.
        let ended = sandbox.run(args).expect_code(1);
        assert!(ended.stderr.contains("a device or a pipe"), "{args:?}: {ended}");
        assert_eq!(sandbox.names(), before, "{args:?}");
    }
}

#[test]
fn pipes_where_files_of_the_program_itself_belong_are_not_waited_for() {
    let sandbox = Sandbox::with_container();
    std::fs::create_dir(sandbox.path("report")).unwrap();
    for pipe in [".b.vastex.journal", "report/index.html"] {
        assert!(Command::new("mkfifo").arg(sandbox.path(pipe)).status().unwrap().success());
    }
    let ended = sandbox.run(&["build", "image.png", "-o", "b.vastex", "--resume"]).expect_code(1);
    assert!(ended.stderr.contains(".b.vastex.journal") && ended.stderr.contains("remove it"), "{ended}");
    let ended = sandbox.run(&["render", "image.vastex", "--report", "report"]).expect_code(1);
    assert!(ended.stderr.contains("index.html: this is a device or a pipe"), "{ended}");
}

#[test]
fn a_pipe_beside_a_raw_file_is_not_waited_for() {
    let sandbox = Sandbox::new();
    sandbox.write("x.raw", &[7; 64]);
    assert!(Command::new("mkfifo").arg(sandbox.path("x.raw.toml")).status().unwrap().success());
    for args in
        [&["info", "x.raw"][..], &["build", "x.raw", "-o", "a.vastex"], &["render", "x.raw", "-o", "a.png"]]
    {
        let ended = sandbox.run(args).expect_code(1);
        assert!(ended.stderr.contains("x.raw"), "{args:?}: {ended}");
    }
}

#[test]
fn what_is_not_there_is_said_in_plain_words_wherever_it_is_named() {
    let sandbox = Sandbox::with_container();
    let cases: [&[&str]; 8] = [
        &["info", "none"],
        &["merge", "none", "-o", "a.vastex"],
        &["replay", "none"],
        &["learn", "none", "-o", "sets"],
        &["render", "image.vastex", "--settings", "none", "-o", "a.png"],
        &["render", "image.vastex", "--camera-path", "none.path", "--frames", "2", "-o", "a.png"],
        &["render", "none", "--on", "volume", "-o", "a.png"],
        &["build", "none", "-o", "a.vastex"],
    ];
    for args in cases {
        let ended = sandbox.run(args).expect_code(1);
        assert!(ended.stderr.contains("none") && ended.stderr.contains("there is no such file"), "{ended}");
        assert!(!ended.stderr.contains("os error"), "{ended}");
    }
}

#[test]
fn a_mosaic_of_more_columns_than_open_files_is_built_all_the_same() {
    let sandbox = Sandbox::new();
    let columns = 60;
    for x in 0..columns {
        sandbox.write_png(&format!("p_{x}_0.png"), [8, 24]);
        sandbox.write_png(&format!("p_{x}_1.png"), [8, 24]);
    }
    sandbox.write("m.txt", b"vastex mosaic\ngrid p_{x}_{y}.png\n");
    let build = ["build", "m.txt", "-o", "a.vastex", "--page", "64", "--threads", "1", "--quiet"];
    sandbox.run(&build).expect_code(0);
    let whole = sandbox.read("a.vastex");
    // Both limits, so that it cannot be raised; 128 are left to everything else.
    let limited = |files: u32| {
        let mut shell = Command::new("sh");
        shell.current_dir(sandbox.path("")).env_remove("RUST_LOG");
        shell.args(["-c", &format!("ulimit -n {files}; exec \"$@\""), "sh"]);
        Ended::of(shell.arg(env!("CARGO_BIN_EXE_vastex")).args(build))
    };
    for files in [40, 128, 150] {
        limited(files).expect_code(0);
        assert!(sandbox.read("a.vastex") == whole, "{files}");
    }
}

#[test]
fn exports_of_sixteen_bits_and_floats_end() {
    let sandbox = Sandbox::new();
    let file = std::fs::File::create(sandbox.path("deep.png")).unwrap();
    let mut encoder = png::Encoder::new(file, 301, 177);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Sixteen);
    let texels: Vec<u8> = (0..301 * 177 * 6).map(|n: u32| (n * 7 / 5) as u8).collect();
    encoder.write_header().unwrap().write_image_data(&texels).unwrap();
    sandbox.run(&["build", "deep.png", "-o", "deep.vastex", "--page", "64", "--quiet"]).expect_code(0);
    for layout in ["gaiasky", "celestia"] {
        let args = ["export", "deep.vastex", "--layout", layout, "-o", layout, "--json"];
        assert_eq!(sandbox.run(&args).expect_code(0).json()["format"], "png");
    }
    sandbox
        .run(&["build", "--layer", "color=deep.png:rgba16f", "-o", "float.vastex", "--quiet"])
        .expect_code(0);
    let before = sandbox.names();
    for layout in ["gaiasky", "celestia", "deepzoom", "prototype"] {
        let refused =
            sandbox.run(&["export", "float.vastex", "--layout", layout, "-o", "out"]).expect_code(2);
        assert!(refused.stderr.contains("texels of rgba16f are floats"), "{refused}");
        assert_eq!(sandbox.names(), before);
    }
}

/// A pipe as stdout that is full and that nobody reads: whoever prints waits for ever.
fn full_pipe() -> (UnixStream, Stdio) {
    let (reader, mut writer) = UnixStream::pair().unwrap();
    writer.set_nonblocking(true).unwrap();
    while writer.write(&[b'x'; 4096]).is_ok() {}
    while writer.write(b"x").is_ok() {}
    writer.set_nonblocking(false).unwrap();
    (reader, OwnedFd::from(writer).into())
}

/// Waits for something that a program does.
#[track_caller]
pub(crate) fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) {
    let begin = std::time::Instant::now();
    while !is_so() {
        assert!(begin.elapsed() < PATIENCE, "no {what} in {PATIENCE:?}");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
}

/// The exit code of a program whose output nobody gathers.
#[track_caller]
pub(crate) fn end_of(child: &mut Child) -> Option<i32> {
    let mut status = None;
    wait_for("end", || {
        status = child.try_wait().unwrap();
        status.is_some()
    });
    status.unwrap().code()
}

#[test]
fn a_second_signal_ends_a_program_that_cannot_heed_the_first() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [30, 20]);
    let args = ["build", "image.png", "-o", "out.vastex"];
    let (_unread, stdout) = full_pipe();
    let mut child = sandbox.command(&args).stdout(stdout).stderr(Stdio::null()).spawn().unwrap();
    // From here on it prints what it has done, and asks for no signal any more.
    wait_for("container", || sandbox.path("out.vastex").exists());
    let number = child.id().to_string();
    let send = |signal| Command::new("kill").args(["-s", signal, &number]).stderr(Stdio::null()).status();
    assert!(send("INT").unwrap().success());
    // Not pending any more, and not the end.
    let status = || std::fs::read_to_string(format!("/proc/{number}/status")).unwrap_or_default();
    if cfg!(target_os = "linux") {
        wait_for("signal taken", || status().lines().any(|line| line == "ShdPnd:\t0000000000000000"));
    }
    assert!(child.try_wait().unwrap().is_none(), "the first signal ended it");
    assert!(send("TERM").unwrap().success());
    assert_eq!(end_of(&mut child), Some(130));
}

/// The first example of docs/heights.md, with images of the same kinds and a tenth as large.
#[test]
fn the_two_images_of_the_guide_become_one_terrain() {
    let sandbox = Sandbox::new();
    let guide = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/heights.md");
    let guide = std::fs::read_to_string(guide).unwrap();
    let example = guide.lines().find(|line| line.starts_with("vastex build ")).unwrap();
    for image in ["assets/earth-color-10800x5400.jpg", "assets/earth-elevation-1080x540-u16.png"] {
        assert!(example.contains(image), "{example}");
    }
    std::fs::create_dir(sandbox.path("assets")).unwrap();
    sandbox.write_png("color.png", [1080, 540]);
    sandbox.run(&["build", "color.png", "-o", "color.vastex"]).expect_code(0);
    let export = ["export", "color.vastex", "--layout", "deepzoom", "--tile-size", "2000", "-o", "zoom"];
    sandbox.run(&export).expect_code(0);
    sandbox.write("assets/earth-color-10800x5400.jpg", &sandbox.read("zoom/zoom_files/11/0_0.jpg"));
    let heights: Vec<u8> =
        (0..108 * 54u32).flat_map(|n| (n * 11 + 500).to_be_bytes()[2..].to_vec()).collect();
    sandbox.write_png_of("assets/earth-elevation-1080x540-u16.png", [108, 54], &heights);
    let args: Vec<&str> = example.split_whitespace().skip(1).chain(["--json"]).collect();
    let built = sandbox.run(&args).expect_code(0).json();
    let (color, height) = (&built["layers"][0], &built["layers"][1]);
    assert_eq!((&color["format"], &color["scale"]), (&"rgba8-srgb".into(), &1.into()));
    assert_eq!((&height["format"], &height["scale"]), (&"r16".into(), &4.into()));
    let says =
        |notice: &serde_json::Value| notice.as_str().unwrap().contains("resampled to 270x135, a quarter");
    assert!(built["notices"].as_array().unwrap().iter().any(says), "{built}");
    sandbox.run(&["verify", "earth.vastex"]).expect_code(0);
    let render = ["render", "earth.vastex", "--on", "terrain", "--size", "96x64", "--json", "-o", "t.png"];
    assert_eq!(sandbox.run(&render).expect_code(0).json()["converged"], true);
}

/// What is known from the headers is said once, whenever it is said.
#[test]
fn a_notice_is_said_once() {
    let sandbox = Sandbox::new();
    for name in ["level0/tx_0_0.png", "level0/tx_1_0.png", "level2/tx_3_1.png"] {
        std::fs::create_dir_all(sandbox.path("planet").join(name).parent().unwrap()).unwrap();
        sandbox.write_png(&format!("planet/{name}"), [16, 16]);
    }
    let ended = sandbox.run(&["build", "planet", "-o", "p.vastex"]).expect_code(0);
    let said = ended.stderr.lines().filter(|line| line.contains("31 of the 32 tiles of the finest level"));
    assert_eq!(said.count(), 1, "{ended}");
    let quiet = sandbox.run(&["build", "planet", "-o", "p.vastex", "--quiet"]).expect_code(0);
    assert_eq!(quiet.stderr, "");
}
