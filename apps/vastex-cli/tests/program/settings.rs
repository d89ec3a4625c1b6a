//! Settings of pools from files and from the command line, and the size that a picture asks for.

use crate::tool::Sandbox;

/// Bytes of the pool with which a picture of 320x180 pixels is drawn.
fn pool_bytes(sandbox: &Sandbox, more: &[&str]) -> u64 {
    let args = ["render", "image.vastex", "--size", "320x180", "--frames", "1", "--json"];
    let json = sandbox.run(&[&args[..], more].concat()).expect_code(0).json();
    json["pool_bytes"].as_u64().unwrap()
}

/// At most as many, and no slot fewer than a tenth below.
#[track_caller]
fn check(bytes: u64, expected: u64) {
    assert!(bytes <= expected && bytes * 10 >= expected * 9, "{bytes} of {expected} bytes");
}

#[test]
fn files_and_options_set_the_size_of_the_pool_the_last_one_wins() {
    let sandbox = Sandbox::with_container();
    let info =
        sandbox.run(&["info", "image.vastex", "--estimate", "320x180", "--json"]).expect_code(0).json();
    let estimate = &info["estimate"];
    assert_eq!(estimate["picture"], serde_json::json!([320, 180]));
    // Pages of 64 texels: (640 / 64 + 2) across, (360 / 64, rounded up, + 2) down.
    assert_eq!((&estimate["pages_in_view"], &estimate["slots"]), (&96.into(), &160.into()));
    let bytes = 160 * 72 * 72 * 4;
    assert_eq!((&estimate["tile_bytes"], &estimate["pool_bytes"]), (&(72 * 72 * 4).into(), &bytes.into()));
    check(pool_bytes(&sandbox, &[]), bytes);

    sandbox.write("vastex.toml", b"[[pool]]\nformats = [\"rgba8-srgb\"]\nsize_mib = 5\n");
    sandbox.write("mine.toml", b"[[pool]]\ntile_max = 72\nsize_mib = 3\n");
    check(pool_bytes(&sandbox, &["--settings", "vastex.toml"]), 5 << 20);
    let both = ["--settings", "vastex.toml", "--settings", "mine.toml"];
    check(pool_bytes(&sandbox, &both), 3 << 20);
    check(pool_bytes(&sandbox, &[&both[..], &["--pool-mib", "1"]].concat()), 1 << 20);
}

#[test]
fn the_arithmetic_is_told_step_by_step() {
    let sandbox = Sandbox::with_container();
    let text = sandbox.run(&["info", "image.vastex", "--estimate", "320x180"]).expect_code(0).stdout;
    for words in ["320 x 180", "96 pages in view: 12 x 8", "x 4/3", "160 slots", "/ 80 %", "all layers"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert!(!sandbox.run(&["info", "image.vastex"]).expect_code(0).stdout.contains("80 %"));
    let bad = sandbox.run(&["info", "image.vastex", "--estimate", "320"]).expect_code(2);
    assert!(bad.stderr.contains("1280x720"), "{bad}");
}

#[test]
fn what_is_wrong_in_a_settings_file_is_said_with_its_line() {
    let sandbox = Sandbox::with_container();
    sandbox.write("bad.toml", b"# pools\n[[pool]]\nsize = 5\n");
    sandbox.write("tiny.toml", b"[default_pool]\nsize_mib = 0.02\n");
    let cases: [(&str, &[&str]); 3] = [
        ("bad.toml", &["bad.toml:3", "size_mib"]),
        ("missing.toml", &["missing.toml", "cannot be read"]),
        ("tiny.toml", &["image.vastex", "make the pool at least"]),
    ];
    for (file, words) in cases {
        let ended = sandbox.run(&["render", "image.vastex", "--settings", file]).expect_code(1);
        assert!(words.iter().all(|word| ended.stderr.contains(word)), "{file}: {ended}");
    }
}

#[test]
fn a_pool_that_is_too_small_for_the_view_is_told_of_with_a_remedy() {
    let sandbox = Sandbox::with_container();
    sandbox.write("small.toml", b"[default_pool]\nsize_mib = 0.2\n");
    let render = ["render", "image.vastex", "--size", "320x180", "-o", "out.png"];
    let small = sandbox.run(&[&render[..], &["--settings", "small.toml"]].concat()).expect_code(0);
    let words = [
        "image.vastex",
        "of 72x72 texels of rgba8-srgb",
        "has room for 9",
        "levels coarser",
        "--pool-mib 1 or more",
    ];
    for words in words {
        assert!(small.stderr.contains(words), "{words}: {small}");
    }
    let ample = sandbox.run(&render).expect_code(0);
    assert!(!ample.stderr.contains("coarser"), "{ample}");
}
