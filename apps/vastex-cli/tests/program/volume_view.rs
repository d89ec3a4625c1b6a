//! Volumes by `view --screenshot`, which shows what the window shows first.

use crate::tool::Sandbox;

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
}

#[test]
fn what_is_no_volume_of_values_and_what_images_have_is_refused() {
    let sandbox = Sandbox::new();
    for (words, says) in [
        (vec![HEAD, "--on", "globe"], "--on is for images"),
        (vec![HEAD, "--layer", "values"], "--layer is for images"),
        (
            vec![concat!(env!("CARGO_MANIFEST_DIR"), "/../../crates/vastex-volume/fixtures/plate.zip")],
            "A/1/0",
        ),
        (vec![NUCLEI, "--pool-mib", "1"], "pool"),
    ] {
        let words = [vec!["view", "--screenshot", "out.png", "--size", "64x64"], words].concat();
        let ended = sandbox.run(&words).expect_code(1);
        assert!(ended.stderr.contains(says), "{words:?}: {ended}");
        assert!(!sandbox.path("out.png").exists(), "{words:?}");
    }
}
