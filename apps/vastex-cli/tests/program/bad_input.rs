//! Whatever is wrong, the message names the file and the remedy, the exit code says whose fault it is, and nothing is
//! left behind.

use crate::tool::Desk;

/// Runs the program; the exit code and every word must be as said, and no file may have appeared.
#[track_caller]
fn check(desk: &Desk, args: &[&str], code: i32, words: &[&str]) {
    let before = desk.names();
    let ended = desk.run(args).expect_code(code);
    for word in words {
        assert!(ended.stderr.contains(word), "{args:?} does not say {word:?}: {ended}");
    }
    assert_eq!(desk.names(), before, "{args:?} left something behind");
}

#[test]
fn values_that_make_no_sense_are_the_command_lines_fault() {
    let desk = Desk::with_container();
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
        check(&desk, &[&build, *more].concat(), 2, &[word]);
    }
    for (more, word) in render_cases {
        check(&desk, &[&render, *more].concat(), 2, &[word]);
    }
    check(&desk, &["build", "image.png"], 2, &["--output"]);
    check(&desk, &["paint"], 2, &["paint"]);
    check(&desk, &[], 2, &["Usage"]);
}

#[test]
fn what_is_no_image_is_refused_by_build() {
    let desk = Desk::new();
    desk.write_png("image.png", [64, 64]);
    desk.write("empty.png", b"");
    desk.write("text.png", b"This is a text.\n");
    let whole = desk.read("image.png");
    desk.write("short.png", &whole[..whole.len() / 2]);
    desk.write("header.png", &whole[..20]);
    desk.write("noise.tif", &[0xa5; 300]);
    let earth = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-color-10800x5400.jpg");
    desk.write("short.jpg", &std::fs::read(earth).unwrap()[..60_000]);
    std::fs::create_dir(desk.path("folder")).unwrap();
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
        check(&desk, &["build", input, "-o", "out.vastex"], 1, &[input, word]);
    }
    check(&desk, &["build", "image.png", "-o", "image.png"], 1, &["image.png", "another name"]);
    assert_eq!(desk.read("image.png"), whole);
}

#[test]
fn what_is_no_sound_container_is_refused_by_all_that_read_one() {
    let desk = Desk::with_container();
    let whole = desk.read("image.vastex");
    let altered = |at: usize| {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x10;
        bytes
    };
    desk.write("short.vastex", &whole[..whole.len() / 2]);
    desk.write("header.vastex", &whole[..40]);
    desk.write("index.vastex", &altered(whole.len() - 20));
    desk.write("empty.vastex", b"");
    desk.write("text.vastex", b"This is a text.\n");
    std::fs::create_dir(desk.path("folder")).unwrap();
    let cases = [
        ("missing.vastex", "missing.vastex"),
        ("short.vastex", "again"),
        ("header.vastex", "again"),
        ("index.vastex", "again"),
        ("empty.vastex", "empty"),
        ("text.vastex", "vastex build"),
        ("image.png", "vastex build"),
        ("folder", "directory"),
    ];
    for (source, word) in cases {
        check(&desk, &["info", source], 1, &[source, word]);
        check(&desk, &["render", source, "-o", "out.png"], 1, &[source, word]);
        let verified = desk.run(&["verify", source]).expect_code(1);
        assert!(format!("{}{}", verified.stdout, verified.stderr).contains(source), "{verified}");
    }
}

#[test]
fn verify_prints_every_fault() {
    let desk = Desk::with_container();
    let mut bytes = desk.read("image.vastex");
    let (quarter, half) = (bytes.len() / 4, bytes.len() / 2);
    bytes[quarter] ^= 1;
    bytes[half] ^= 1;
    desk.write("image.vastex", &bytes);
    let ended = desk.run(&["verify", "image.vastex"]).expect_code(1);
    assert_eq!(ended.stdout.lines().count(), 2, "{ended}");
    assert!(ended.stdout.lines().all(|line| line.starts_with("image.vastex: ")), "{ended}");
    assert!(ended.stderr.contains("2 faults"), "{ended}");
    let json = desk.run(&["verify", "image.vastex", "--json"]).expect_code(1).json();
    assert_eq!((json["sound"].as_bool(), json["faults"].as_array().map(Vec::len)), (Some(false), Some(2)));
}

#[cfg(unix)]
#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_work() {
    let desk = Desk::with_container();
    std::fs::create_dir(desk.path("folder")).unwrap();
    for place in ["nowhere/out", "folder", "image.png/out", "/dev/null"] {
        let picture = if place.ends_with("out") { format!("{place}.png") } else { place.into() };
        check(&desk, &["render", "image.vastex", "-o", &picture], 1, &[place]);
    }
    for place in ["nowhere/out.vastex", "folder", "image.png/out.vastex"] {
        check(&desk, &["build", "image.png", "-o", place], 1, &[place]);
    }
    assert!(std::process::Command::new("mkfifo").arg(desk.path("pipe")).status().unwrap().success());
    check(&desk, &["build", "image.png", "-o", "pipe"], 1, &["pipe", "replaced"]);
    check(&desk, &["build", "pipe", "-o", "out.vastex"], 1, &["pipe", "name an image file"]);
    check(&desk, &["build", "/dev/zero", "-o", "out.vastex"], 1, &["/dev/zero", "name an image file"]);
    let before = desk.read("image.vastex");
    desk.run(&["render", "image.vastex", "-o", "./image.vastex"]).expect_code(2);
    assert_eq!(desk.read("image.vastex"), before);
}

#[test]
fn a_pool_that_holds_not_even_the_tail_is_refused() {
    let desk = Desk::new();
    desk.write_png("image.png", [1200, 600]);
    desk.run(&["build", "image.png", "-o", "large.vastex", "--page", "1024", "--quiet"]).expect_code(0);
    let args = ["render", "large.vastex", "--pool-mib", "1", "-o", "out.png"];
    check(&desk, &args, 1, &["large.vastex", "make the pool", "bytes"]);
}

#[test]
fn a_picture_beyond_the_adapter_is_refused() {
    let desk = Desk::with_container();
    check(&desk, &["render", "image.vastex", "--size", "65536x1"], 1, &["65536x1", "pixels per side"]);
}

#[test]
fn a_damaged_tile_is_told_and_the_rest_goes_on() {
    let desk = Desk::with_container();
    let mut bytes = desk.read("image.vastex");
    let quarter = bytes.len() / 4;
    bytes[quarter] ^= 1;
    desk.write("image.vastex", &bytes);
    let args = ["render", "image.vastex", "--size", "320x200", "--on", "image", "-o", "out.png", "--json"];
    let ended = desk.run(&args).expect_code(0);
    assert!(ended.stderr.contains("image.vastex: level 1 page 1,1 failed"), "{ended}");
    assert_eq!(ended.json()["pages_failed"], 1);
    assert!(desk.path("out.png").exists());
}

#[cfg(all(feature = "view", target_os = "linux"))]
#[test]
fn where_there_is_no_display_view_says_so() {
    let desk = Desk::with_container();
    let mut command = desk.command(&["view", "image.vastex"]);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    let ended = crate::tool::Ended::of(&command.output().unwrap()).expect_code(1);
    assert!(ended.stderr.contains("DISPLAY") && ended.stderr.contains("vastex render"), "{ended}");
}

#[test]
fn where_there_is_no_driver_render_says_so() {
    let desk = Desk::with_container();
    let mut command = desk.command(&["render", "image.vastex", "-o", "out.png"]);
    command.env("VK_DRIVER_FILES", "/nonexistent.json").env("WGPU_BACKEND", "vulkan");
    let ended = crate::tool::Ended::of(&command.output().unwrap()).expect_code(1);
    assert!(ended.stderr.contains("mesa-vulkan-drivers"), "{ended}");
    assert!(!desk.path("out.png").exists());
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_error() {
    let desk = Desk::with_container();
    let mut child =
        desk.command(&["info", "image.vastex"]).stdout(std::process::Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[cfg(unix)]
#[test]
fn an_interrupted_build_leaves_nothing_behind() {
    let desk = Desk::new();
    let earth = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-color-10800x5400.jpg");
    let mut child = desk
        .command(&["build", earth, "-o", "out.vastex", "--threads", "1"])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut waits = 0;
    while desk.names().is_empty() && waits < 2000 {
        std::thread::sleep(std::time::Duration::from_millis(5));
        waits += 1;
    }
    assert_ne!(desk.names(), Vec::<String>::new(), "the build has begun");
    let pid = child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(desk.names(), Vec::<String>::new());
}
