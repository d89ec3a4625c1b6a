//! Volumes by `view --screenshot`, which shows what the window shows first.

use crate::parts::assert_alike;
use crate::tool::{Sandbox, draws_by_gpu};

/// A head of three channels, and nuclei with labels beside them.
const HEAD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/volumes/head.zip");
const NUCLEI: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/volumes/nuclei.zip");

#[test]
fn a_screenshot_shows_three_slices_and_the_volume() {
    let sandbox = Sandbox::new();
    let shot = |name: &str| {
        sandbox.run(&["view", "--screenshot", name, "--size", "128x96", HEAD]).expect_code(0);
        sandbox.read_rgb(name)
    };
    let pixels = shot("head.png");
    assert_eq!(pixels.len(), 128 * 96);
    for [left, top] in [[0, 0], [65, 0], [0, 49], [65, 49]] {
        let within =
            |n: usize| (left..left + 62).contains(&(n % 128)) && (top..top + 46).contains(&(n / 128));
        let bright = pixels.iter().enumerate().filter(|(n, pixel)| within(*n) && pixel[0] > 100).count();
        assert!(bright > 60, "{bright} bright pixels at {left},{top}");
    }
    assert!(pixels == shot("again.png"), "the same each time");
    // Painted in parts it is the same picture.
    let words = ["view", "--screenshot", "parts.png", "--size", "128x96", "--part-side", "100", HEAD];
    sandbox.run(&words).expect_code(0);
    let parts = sandbox.read_rgb("parts.png");
    assert!(pixels == parts || draws_by_gpu(), "in parts");
    assert_alike("in parts", (128, 1), &pixels, &parts);
}

#[cfg(unix)]
#[test]
fn a_screenshot_that_is_interrupted_leaves_nothing() {
    use std::process::{Command, Stdio};

    use crate::hostile::{end_of, wait_for};

    let sandbox = Sandbox::new();
    let is_begun = || sandbox.names().iter().any(|name| name.starts_with(".v.png"));
    // A program that is done before it is seen at work is run again.
    for _ in 0..30 {
        let words = ["view", "--screenshot", "v.png", "--size", "640x480", HEAD];
        let mut child = sandbox.command(&words).stderr(Stdio::null()).spawn().unwrap();
        wait_for("picture", || child.try_wait().unwrap().is_some() || is_begun());
        let number = child.id().to_string();
        drop(Command::new("kill").args(["-s", "INT", &number]).stderr(Stdio::null()).status());
        let code = end_of(&mut child);
        if code != Some(0) {
            assert_eq!((code, sandbox.names()), (Some(130), Vec::new()));
            return;
        }
        std::fs::remove_file(sandbox.path("v.png")).unwrap();
    }
    panic!("it was never caught at work");
}

/// Each picture in it lies in a texture, and the whole is painted in parts.
#[test]
fn a_screenshot_may_be_wider_than_any_texture() {
    let sandbox = Sandbox::new();
    let words = ["view", "--screenshot", "wide.png", "--size", "20000x24", HEAD];
    sandbox.run(&words).expect_code(0);
    assert_eq!(sandbox.read_rgb("wide.png").len(), 20000 * 24);
    let words = ["view", "--screenshot", "wider.png", "--size", "65536x8", HEAD, "--view", VIEW];
    let ended = sandbox.run(&words).expect_code(1);
    assert!(ended.stderr.contains("of each at most"), "{ended}");
}

/// What a person copies of the head: a part of it in 3-D, so small that nothing lies over the picture.
const VIEW: &str = "volume:x=49,y=58,z=47,zoom=1.5,yaw=-40,pitch=10;panes=3d;mode=average;\
                    channel=1:color=ffffff:range=0..120:gamma=0.8;channel=2:map=magma:range=0..200;clip=0..0.6,0..1,0..1";

#[test]
fn a_view_as_a_text_and_a_link_are_seen_in_the_window_and_drawn_by_render_alike() {
    let sandbox = Sandbox::new();
    let size = ["--size", "80x64"];
    let shot = |words: &[&str]| {
        let first = ["view", "--screenshot", "shot.png"];
        sandbox.run(&[&first[..], &size, words].concat()).expect_code(0);
        sandbox.read_rgb("shot.png")
    };
    let drawn = |words: &[&str]| {
        sandbox.run(&[&["render", "-o", "drawn.png"][..], &size, words].concat()).expect_code(0);
        sandbox.read_rgb("drawn.png")
    };
    let link = format!("vastex:{HEAD}?view={}", VIEW.replace(';', "%3B"));
    let seen = shot(&["--view", VIEW, HEAD]);
    assert!(seen.iter().filter(|pixel| pixel[0] > 30).count() > 200, "something is seen");
    assert!(seen != shot(&[HEAD]) && seen == shot(&[&link]), "the window");
    let by_render = drawn(&["--view", VIEW, HEAD]);
    assert!(by_render == drawn(&[&link]) && by_render == drawn(&["--on", "volume", "--view", VIEW, HEAD]));
    let is_near = |(a, b): &(&[u8; 3], &[u8; 3])| (0..3).all(|c| a[c].abs_diff(b[c]) <= 2);
    let near = seen.iter().zip(&by_render).filter(is_near).count();
    assert!(near * 100 >= seen.len() * 99, "{near} of {} pixels are alike", seen.len());
    // A slice by itself, and channels by words in the place of a view.
    let slice = VIEW.replace("panes=3d", "panes=z;slices=49,58,30");
    let (seen, by_render) = (shot(&["--view", &slice, HEAD]), drawn(&["--view", &slice, HEAD]));
    let near = seen.iter().zip(&by_render).filter(is_near).count();
    assert!(near * 100 >= seen.len() * 99, "{near} of {} pixels of a slice are alike", seen.len());
    let camera = "volume:x=49,y=58,z=47,zoom=1.5,yaw=-40,pitch=10;panes=3d";
    let by_words = |words: &[&str]| shot(&[&["--view", camera, HEAD][..], words].concat());
    let words = by_words(&["--mode", "mip", "--channels", "0:FF8000:10..200:0.5,2:viridis_r"]);
    let text = format!(
        "{camera};mode=mip;channel=0:color=ff8000:range=10..200:opacity=0.5;channel=2:map=viridis_r:range=0..255"
    );
    assert!(words == shot(&["--view", &text, HEAD]), "in the words of render");
    assert!(by_words(&["--range", "0,0.2"]) != by_words(&[]));
}

#[test]
fn labels_are_shown_at_first_where_they_are_asked_for() {
    let sandbox = Sandbox::new();
    let shot = |words: &[&str]| {
        let first = ["view", "--screenshot", "shot.png", "--size", "80x80", NUCLEI];
        sandbox.run(&[&first[..], words].concat()).expect_code(0);
        sandbox.read_rgb("shot.png")
    };
    let (plain, labels) = (shot(&[]), shot(&["--labels", "nuclei", "--label-opacity", "1"]));
    assert_ne!(plain, labels);
    let one = shot(&[
        "--labels",
        "nuclei",
        "--label-opacity",
        "1",
        "--label-selected",
        "1000000",
        "--label-others",
        "hidden",
    ]);
    assert_eq!(one, plain, "no label has that number, and others are hidden");
}

#[test]
fn labels_by_themselves_and_stacks_of_pages_are_volumes_in_the_window() {
    let sandbox = Sandbox::new();
    let shot = |words: &[&str]| {
        let first = ["view", "--screenshot", "shot.png", "--size", "80x80"];
        sandbox.run(&[&first[..], words].concat()).expect_code(0);
        sandbox.read_rgb("shot.png")
    };
    let mut colors = shot(&[&format!("{NUCLEI}/labels/nuclei")]);
    colors.sort_unstable();
    colors.dedup();
    assert!(colors.len() > 20, "{} colours", colors.len());
    let stack = concat!(env!("CARGO_MANIFEST_DIR"), "/../../crates/vastex-volume/fixtures/imagej.tif");
    let camera = "volume:x=1,y=1,z=1,zoom=1,yaw=0,pitch=0;panes=z";
    let slice = |z: u32| shot(&[stack, "--view", &format!("{camera};slices=0,0,{z}")]);
    assert_ne!(slice(0), slice(1), "two pages");
    // What images have shows the first page.
    let page = shot(&[stack, "--on", "plane"]);
    assert_ne!(page, shot(&[stack]));
}

#[test]
fn what_a_view_or_a_word_says_twice_or_of_something_else_is_refused() {
    let sandbox = Sandbox::new();
    sandbox.write_png("a.png", [8, 8]);
    let beyond = VIEW.replace("channel=1", "channel=7");
    for (words, code, says) in [
        (
            vec!["view", "--screenshot", "o.png", HEAD, "--view", VIEW, "--mode", "mip"],
            2,
            "--view says which mode",
        ),
        (
            vec!["render", "-o", "o.png", HEAD, "--view", VIEW, "--channels", "0"],
            2,
            "--view says which channels",
        ),
        (vec!["render", "-o", "o.png", HEAD, "--view", "volume:x=1"], 2, "something is missing"),
        (vec!["render", "-o", "o.png", HEAD, "--view", &beyond], 1, "channels 0 to 2"),
        (vec!["view", "--screenshot", "o.png", HEAD, "--view", &beyond], 1, "channels 0 to 2"),
        (vec!["view", "--screenshot", "o.png", HEAD, "--time", "1"], 1, "times 0 to 0"),
        (vec!["view", "--screenshot", "o.png", HEAD, "--labels", "cells"], 1, "--labels cells"),
        (
            vec!["view", "--screenshot", "o.png", HEAD, "--view", "image:x=1,y=2,zoom=3"],
            1,
            "--view is for images",
        ),
        (vec!["view", "--screenshot", "o.png", "a.png", "--channels", "0"], 1, "--channels is for volumes"),
        (vec!["view", "--screenshot", "o.png", "a.png", "--view", VIEW], 1, "is no volume"),
    ] {
        let ended = sandbox.run(&words).expect_code(code);
        assert!(ended.stderr.contains(says), "{words:?}: {ended}");
    }
}

#[test]
fn what_is_no_volume_of_values_and_what_images_have_is_refused() {
    let sandbox = Sandbox::new();
    for (words, says) in [
        (vec![HEAD, "--on", "globe"], "--on is for images"),
        (vec![HEAD, "--layer", "values"], "--layer is for images"),
        (
            vec![concat!(env!("CARGO_MANIFEST_DIR"), "/../../crates/vastex-volume/fixtures/plate.zip")],
            "a plate; name one of its images below this path: A/1/0, A/1/1",
        ),
    ] {
        let words = [vec!["view", "--screenshot", "out.png", "--size", "64x64"], words].concat();
        let ended = sandbox.run(&words).expect_code(1);
        assert!(ended.stderr.contains(says), "{words:?}: {ended}");
        assert!(!sandbox.path("out.png").exists(), "{words:?}");
    }
    let plate = concat!(env!("CARGO_MANIFEST_DIR"), "/../../crates/vastex-volume/fixtures/plate.zip");
    let ended = sandbox.run(&["render", plate, "--on", "volume", "-o", "out.png"]).expect_code(1);
    assert!(ended.stderr.contains("images below this path: A/1/0, A/1/1"), "{ended}");
}
