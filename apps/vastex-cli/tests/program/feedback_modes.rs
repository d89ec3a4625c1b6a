//! `render --feedback`, `--whole-kib` and `--fade-ms`: the same picture, whichever way it is made.

use serde_json::Value;

use crate::tool::Sandbox;

fn summary(sandbox: &Sandbox, more: &str) -> Value {
    let command = format!("render image.vastex --size 160x90 --on plane --camera-path fly --json {more}");
    let ended = sandbox.run(&command.split_whitespace().collect::<Vec<_>>()).expect_code(0);
    serde_json::from_str(&ended.stdout).unwrap()
}

#[test]
fn every_way_of_feedback_gives_the_same_picture() {
    let sandbox = Sandbox::with_container();
    let by_default = summary(&sandbox, "-o default.png");
    for way in ["separate", "inline", "raw"] {
        let summary = summary(&sandbox, &format!("--feedback {way} -o {way}.png"));
        // Inline rounds a few pixels to the page beside theirs.
        let exact = if way == "inline" { 0 } else { 2 };
        for same in
            ["converged", "share_at_wanted_level"].iter().chain(&["tiles_loaded", "pages_wanted"][..exact])
        {
            assert_eq!(summary[*same], by_default[*same], "{way}: {same}");
        }
        assert!(summary["feedback_bytes_read"].as_u64() > Some(0), "{way}");
        assert!(sandbox.read(&format!("{way}.png")) == sandbox.read("default.png"), "{way}: another picture");
    }
    let ended = sandbox.run(&["render", "image.vastex", "--feedback", "guess"]).expect_code(2);
    assert!(ended.stderr.contains("separate, inline, raw"), "{}", ended.stderr);
}

#[test]
fn a_picture_is_written_when_everything_in_it_has_faded_in() {
    let sandbox = Sandbox::with_container();
    let frames = |more: &str| summary(&sandbox, more)["frames"].as_u64().unwrap();
    let at_once = frames("-o at-once.png");
    // The path lasts 300 frames, so a tile of its last pose takes as long once more.
    assert!(frames("--fade-ms 5000 -o faded.png") > at_once);
    assert!(sandbox.read("faded.png") == sandbox.read("at-once.png"), "another picture");
    let early = |file: &str, more: &str| {
        summary(&sandbox, &format!("--frames 6 -o {file} {more}"));
        sandbox.read(file)
    };
    assert!(early("early.png", "") != early("fading.png", "--fade-ms 5000"));
    let ended = sandbox.run(&["render", "image.vastex", "--fade-ms", "60001"]).expect_code(2);
    assert!(ended.stderr.contains("--fade-ms"), "{}", ended.stderr);
}

#[test]
fn a_texture_that_fits_asks_for_no_tile() {
    let sandbox = Sandbox::with_container();
    let whole = summary(&sandbox, "--whole-kib 1024 --frames 1 --compare");
    assert_eq!((&whole["tiles_loaded"], &whole["share_at_wanted_level"]), (&0.into(), &1.0.into()));
    assert!(whole["share_within_1_255"].as_f64() >= Some(0.999), "{whole}");
    let paged = summary(&sandbox, "--whole-kib 64");
    assert!(paged["tiles_loaded"].as_u64() > Some(0), "a texture beyond that is paged");
}
