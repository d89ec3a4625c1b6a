//! Whatever is wrong, the message names the file and the remedy, the exit code says whose fault it is, and
//! nothing is left behind.

use crate::tool::{Ended, Sandbox};

/// Runs the program; the exit code and every word must be as said, and no file may have appeared.
#[track_caller]
fn check(sandbox: &Sandbox, args: &[&str], code: i32, words: &[&str]) {
    let before = sandbox.names();
    let ended = sandbox.run(args).expect_code(code);
    for word in words {
        assert!(ended.stderr.contains(word), "{args:?} does not say {word:?}: {ended}");
    }
    assert_eq!(sandbox.names(), before, "{args:?} left something behind");
}

#[test]
fn values_that_make_no_sense_are_the_command_lines_fault() {
    let sandbox = Sandbox::with_container();
    let build = ["build", "image.png", "-o", "out.vastex"];
    let render = ["render", "image.vastex"];
    let build_cases: &[(&[&str], &str)] = &[
        (&["--page", "0"], "--page"),
        (&["--page", "100000"], "4096"),
        (&["--page", "many"], "--page"),
        (&["--border", "0"], "--border"),
        (&["--border", "65"], "--border"),
        (&["--compress", "zip"], "zstd"),
        (&["--linear", "perhaps"], "off"),
        (&["--address", "round"], "mirror"),
        (&["--address", "wrap,"], "mirror"),
        (&["--threads", "0"], "--threads"),
    ];
    let render_cases: &[(&[&str], &str)] = &[
        (&["--size", "0x10"], "pixels"),
        (&["--size", "640"], "1280x720"),
        (&["--size", "99999999999x99999999999"], "1280x720"),
        (&["--size", "70000x70000"], "65536"),
        (&["--on", "cube"], "globe"),
        (&["--camera-path", "wander"], "teleport"),
        (&["--filter", "sharp"], "bilinear"),
        (&["--pool-mib", "0"], "--pool-mib"),
        (&["--pool-mib", "99999999999999999999"], "--pool-mib"),
        (&["--frames", "0"], "--frames"),
        (&["--frames", "2", "--until-converged"], "--until-converged"),
        (&["--upload-kib-per-frame", "0"], "--upload-kib-per-frame"),
        (&["--latency-frames", "0"], "--latency-frames"),
        (&["-o", "out.jpg"], ".png"),
    ];
    for (more, word) in build_cases {
        check(&sandbox, &[&build, *more].concat(), 2, &[word]);
    }
    for (more, word) in render_cases {
        check(&sandbox, &[&render, *more].concat(), 2, &[word]);
    }
    check(&sandbox, &["build", "image.png"], 2, &["--output"]);
    check(&sandbox, &["paint"], 2, &["paint"]);
    check(&sandbox, &[], 2, &["Usage"]);
}

#[test]
fn what_is_no_image_is_refused_by_build() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [64, 64]);
    sandbox.write("empty.png", b"");
    sandbox.write("text.png", b"This is a text.\n");
    let whole = sandbox.read("image.png");
    sandbox.write("short.png", &whole[..whole.len() / 2]);
    sandbox.write("header.png", &whole[..20]);
    sandbox.write("noise.tif", &[0xa5; 300]);
    let earth = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-color-10800x5400.jpg");
    sandbox.write("short.jpg", &std::fs::read(earth).unwrap()[..60_000]);
    std::fs::create_dir(sandbox.path("folder")).unwrap();
    let cases = [
        ("missing.png", "missing.png"),
        ("empty.png", "empty"),
        ("text.png", "text"),
        ("short.png", "again"),
        ("header.png", "again"),
        ("noise.tif", "convert"),
        ("short.jpg", "again"),
        ("folder", "directory"),
    ];
    for (input, word) in cases {
        check(&sandbox, &["build", input, "-o", "out.vastex"], 1, &[input, word]);
    }
    check(&sandbox, &["build", "image.png", "-o", "image.png"], 1, &["image.png", "another name"]);
    assert_eq!(sandbox.read("image.png"), whole);
}

#[test]
fn what_is_no_sound_container_is_refused_by_all_that_read_one() {
    let sandbox = Sandbox::with_container();
    let whole = sandbox.read("image.vastex");
    let altered = |at: usize| {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x10;
        bytes
    };
    sandbox.write("short.vastex", &whole[..whole.len() / 2]);
    sandbox.write("header.vastex", &whole[..40]);
    sandbox.write("index.vastex", &altered(whole.len() - 20));
    sandbox.write("empty.vastex", b"");
    sandbox.write("text.vastex", b"This is a text.\n");
    // Who opened a picture hears of pictures.
    sandbox.write("noise.jpg", b"\x3e\xa7\x67\xa2\xc8\x01\xc8\x1c");
    sandbox.write("text.png", b"This is a text.\n");
    sandbox.run(&["build", "image.png", "-o", "1.part", "--shard", "1/2"]).expect_code(0);
    std::fs::create_dir(sandbox.path("folder")).unwrap();
    let cases = [
        ("missing.vastex", "missing.vastex"),
        ("short.vastex", "again"),
        ("header.vastex", "again"),
        ("index.vastex", "again"),
        ("empty.vastex", "empty"),
        ("text.vastex", "not a Vastex container (it is a text file)"),
        ("noise.jpg", "is of no known image format"),
        ("text.png", "is a text file, not an image"),
        ("1.part", "is part 1 of 2 of a container; join all parts with `vastex merge`"),
        ("folder", "directory"),
    ];
    for (source, word) in cases {
        check(&sandbox, &["info", source], 1, &[source, word]);
        check(&sandbox, &["render", source, "-o", "out.png"], 1, &[source, word]);
        let verified = sandbox.run(&["verify", source]).expect_code(1);
        assert!(format!("{}{}", verified.stdout, verified.stderr).contains(source), "{verified}");
    }
    for foreign in ["1.part", "image.png", "text.vastex"] {
        let verified = sandbox.run(&["verify", foreign]).expect_code(1);
        assert!(!verified.stderr.contains("fault") && verified.stdout.is_empty(), "{verified}");
        assert_eq!(verified.stderr.matches(foreign).count(), 1, "{verified}");
    }
    check(
        &sandbox,
        &["build", "image.vastex", "-o", "out.vastex"],
        1,
        &["image.vastex", "container already"],
    );
    check(&sandbox, &["build", "1.part", "-o", "out.vastex"], 1, &["1.part", "join all parts"]);
}

#[test]
fn verify_prints_every_fault() {
    let sandbox = Sandbox::with_container();
    let mut bytes = sandbox.read("image.vastex");
    let (quarter, half) = (bytes.len() / 4, bytes.len() / 2);
    bytes[quarter] ^= 1;
    bytes[half] ^= 1;
    sandbox.write("image.vastex", &bytes);
    let ended = sandbox.run(&["verify", "image.vastex"]).expect_code(1);
    assert_eq!(ended.stdout.lines().count(), 2, "{ended}");
    assert!(ended.stdout.lines().all(|line| line.starts_with("image.vastex: ")), "{ended}");
    assert!(ended.stderr.contains("2 faults"), "{ended}");
    let json = sandbox.run(&["verify", "image.vastex", "--json"]).expect_code(1).json();
    assert_eq!((json["sound"].as_bool(), json["faults"].as_array().map(Vec::len)), (Some(false), Some(2)));
}

#[test]
fn verify_notes_what_an_interrupted_change_left() {
    let sandbox = Sandbox::with_container();
    sandbox.write("image.vastex", &[sandbox.read("image.vastex"), vec![1; 77]].concat());
    let ended = sandbox.run(&["verify", "image.vastex"]).expect_code(0);
    assert!(
        ended.stdout.contains("sound") && ended.stderr.contains("note: image.vastex: 77 bytes of"),
        "{ended}"
    );
    let json = sandbox.run(&["verify", "image.vastex", "--json"]).expect_code(0).json();
    assert_eq!((json["leftover_bytes"].as_u64(), json["sound"].as_bool()), (Some(77), Some(true)));
    // The texels that are there already: nothing is written, and the rest is cut off.
    let whole = sandbox.read("image.vastex").len() - 77;
    sandbox.run(&["replace", "image.vastex", "--at", "0,0", "image.png"]).expect_code(0);
    assert_eq!(sandbox.read("image.vastex").len(), whole);
    assert_eq!(sandbox.run(&["verify", "image.vastex"]).expect_code(0).stderr, "");
    if cfg!(unix) {
        let lock = std::fs::File::open(sandbox.path("image.vastex")).unwrap();
        lock.lock().unwrap();
        let ended = sandbox.run(&["verify", "image.vastex"]).expect_code(0);
        assert!(ended.stderr.contains("is being changed now"), "{ended}");
    }
}

#[cfg(unix)]
#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_work() {
    let sandbox = Sandbox::with_container();
    std::fs::create_dir(sandbox.path("folder")).unwrap();
    for place in ["nowhere/out", "folder", "image.png/out", "/dev/null"] {
        let picture = if place.ends_with("out") { format!("{place}.png") } else { place.into() };
        check(&sandbox, &["render", "image.vastex", "-o", &picture], 1, &[place]);
    }
    for (place, says) in [
        ("nowhere/out.vastex", "its directory does not exist: make it"),
        ("folder", "add a file name"),
        ("image.png/out.vastex", "leads through a file"),
    ] {
        check(&sandbox, &["build", "image.png", "-o", place], 1, &[place, says]);
        let ended = sandbox.run(&["build", "image.png", "-o", place]);
        assert!(!ended.stderr.contains("free space"), "{ended}");
    }
    assert!(std::process::Command::new("mkfifo").arg(sandbox.path("pipe")).status().unwrap().success());
    check(&sandbox, &["build", "image.png", "-o", "pipe"], 1, &["pipe", "replaced"]);
    check(&sandbox, &["build", "pipe", "-o", "out.vastex"], 1, &["pipe", "name an image file"]);
    check(&sandbox, &["merge", "pipe", "-o", "out.vastex"], 1, &["pipe: is a directory, a device or a pipe"]);
    check(&sandbox, &["build", "/dev/zero", "-o", "out.vastex"], 1, &["/dev/zero", "name an image file"]);
    let before = sandbox.read("image.vastex");
    sandbox.run(&["render", "image.vastex", "-o", "./image.vastex"]).expect_code(2);
    assert_eq!(sandbox.read("image.vastex"), before);
}

#[test]
fn a_pool_that_holds_not_even_the_tail_is_refused() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [1200, 600]);
    sandbox.run(&["build", "image.png", "-o", "large.vastex", "--page", "1024", "--quiet"]).expect_code(0);
    let args = ["render", "large.vastex", "--pool-mib", "1", "-o", "out.png"];
    check(&sandbox, &args, 1, &["large.vastex", "make the pool", "bytes"]);
}

#[test]
fn what_a_picture_beyond_the_adapter_cannot_have_is_refused() {
    let sandbox = Sandbox::with_container();
    sandbox.run(&["render", "image.vastex", "--size", "65536x1", "-o", "wide.png"]).expect_code(0);
    assert_eq!(sandbox.read_rgb("wide.png").len(), 65_536);
    let compared = ["render", "image.vastex", "--size", "65536x1", "--compare"];
    check(&sandbox, &compared, 1, &["image.vastex", "--compare", "in parts"]);
}

#[test]
fn a_damaged_tile_is_told_and_the_rest_goes_on() {
    let sandbox = Sandbox::with_container();
    let mut bytes = sandbox.read("image.vastex");
    let quarter = bytes.len() / 4;
    bytes[quarter] ^= 1;
    sandbox.write("image.vastex", &bytes);
    let args = ["render", "image.vastex", "--size", "320x200", "--on", "image", "-o", "out.png", "--json"];
    let ended = sandbox.run(&args).expect_code(0);
    // Which page it is follows from how large the encoder's tiles are.
    let told = ended.stderr.strip_prefix("vastex: image.vastex: level ").unwrap_or_default();
    assert!(told.contains(" failed, a coarser one is shown instead: level "), "{ended}");
    assert_eq!(ended.json()["pages_failed"], 1);
    assert!(sandbox.path("out.png").exists());
}

#[cfg(all(feature = "view", target_os = "linux"))]
#[test]
fn where_there_is_no_display_view_says_so() {
    let sandbox = Sandbox::with_container();
    let mut command = sandbox.command(&["view", "image.vastex"]);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    let ended = Ended::of(&mut command).expect_code(1);
    assert!(ended.stderr.contains("DISPLAY") && ended.stderr.contains("vastex render"), "{ended}");
}

#[test]
fn where_there_is_no_driver_render_says_so() {
    let sandbox = Sandbox::with_container();
    let mut command = sandbox.command(&["render", "image.vastex", "-o", "out.png"]);
    command.env("VK_DRIVER_FILES", "/nonexistent.json").env("WGPU_BACKEND", "vulkan");
    let ended = Ended::of(&mut command).expect_code(1);
    assert!(ended.stderr.contains("mesa-vulkan-drivers"), "{ended}");
    assert!(!sandbox.path("out.png").exists());
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_error() {
    let sandbox = Sandbox::with_container();
    let mut child =
        sandbox.command(&["info", "image.vastex"]).stdout(std::process::Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(crate::hostile::end_of(&mut child), Some(0));
}

#[cfg(unix)]
#[test]
fn a_limit_for_files_is_an_error_and_leaves_nothing_behind() {
    let sandbox = Sandbox::with_container();
    let before = (sandbox.names(), sandbox.read("image.vastex"));
    let limited = |args: &str| {
        // In blocks of 512 or 1024 bytes.
        let script = format!("ulimit -f 40; exec '{}' {args}", env!("CARGO_BIN_EXE_vastex"));
        let mut shell = std::process::Command::new("sh");
        let ended = Ended::of(shell.args(["-c", &script]).current_dir(sandbox.path(".")));
        assert_eq!(ended.code, Some(1), "{args}: {ended}");
        assert!(ended.stderr.contains("`ulimit -f`"), "{args}: {ended}");
        assert!((sandbox.names(), sandbox.read("image.vastex")) == before, "{args} changed something");
    };
    limited("build image.png -o out.vastex --compress none");
    limited("build image.png -o out.part --compress none --shard 1/1");
}

#[cfg(unix)]
#[test]
fn an_interrupted_build_leaves_nothing_behind() {
    let sandbox = Sandbox::new();
    let earth = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-color-10800x5400.jpg");
    let build = ["build", earth, "-o", "out.vastex", "--threads", "1"];
    crate::resume::signal_at(&sandbox, &build, "INT", 1).expect_code(130);
    assert_eq!(sandbox.names(), Vec::<String>::new());
}

/// A tile of 3.6 GB, as a TIFF file has it that is damaged in its header: it cannot be shown where it lies,
/// and not be built either.
#[test]
fn nobody_is_advised_to_build_what_no_build_reads() {
    let sandbox = Sandbox::new();
    let entries: [(u16, u16, u32); 10] = [
        (256, 4, 60_000),
        (257, 4, 60_000),
        (258, 3, 8),
        (259, 3, 8),
        (262, 3, 1),
        (277, 3, 1),
        (322, 4, 60_000),
        (323, 4, 60_000),
        (324, 4, 134),
        (325, 4, 120),
    ];
    let mut file = b"II*\0\x08\0\0\0\x0a\0".to_vec();
    for (tag, kind, value) in entries {
        file.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
        file.extend([1_u32.to_le_bytes(), value.to_le_bytes()].concat());
    }
    file.extend([0; 124]);
    sandbox.write("damaged.tif", &file);
    for args in [&["info", "damaged.tif"][..], &["build", "damaged.tif", "-o", "out.vastex"]] {
        check(&sandbox, args, 1, &["damaged.tif: is damaged in the header", "which cannot hold 3600000000"]);
    }
}
