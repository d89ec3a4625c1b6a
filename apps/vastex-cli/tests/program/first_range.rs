//! Black and white of values that nobody has said anything of, as the window shows them first.

use crate::tool::{Ended, Sandbox};

const HEIGHTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/tiff/vips-f32.tif");
const WORDS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-elevation-1080x540-u16.png");
const COLORS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/tiff/vips-chained.tif");

fn shoot(sandbox: &Sandbox, file: &str, more: &[&str]) -> Ended {
    let words = [&["view", "--screenshot", "shot.png", "--size", "128x96", "--cache", "off"], more, &[file]];
    sandbox.run(&words.concat()).expect_code(0)
}

/// The darkest and the lightest of the upper half, which no guides lie over, and how many shades there are.
fn shades(sandbox: &Sandbox) -> (u8, u8, usize) {
    let upper = &sandbox.read_rgb("shot.png")[20 * 128..44 * 128];
    let mut found: Vec<u8> = upper.iter().map(|[_, green, _]| *green).collect();
    found.sort_unstable();
    found.dedup();
    (found[0], found[found.len() - 1], found.len())
}

#[test]
fn heights_and_values_of_sensors_are_seen_at_once() {
    let sandbox = Sandbox::new();
    // Metres far from 0 and 1; and 16 bits of which less than a third is used.
    for (file, said) in [(HEIGHTS, "black is "), (WORDS, "black is ")] {
        let ended = shoot(&sandbox, file, &[]);
        assert!(ended.stderr.contains(said) && ended.stderr.contains("C takes those in view"), "{ended}");
        let (dark, light, shades) = shades(&sandbox);
        assert!(dark < 70 && light > 190 && shades > 8, "{file}: {dark} to {light}, {shades} shades");
    }
    // What somebody asks for is shown.
    let ended = shoot(&sandbox, HEIGHTS, &["--range", "0,1"]);
    assert!(!ended.stderr.contains("black is"), "{ended}");
    let (_, _, of_range) = shades(&sandbox);
    shoot(&sandbox, HEIGHTS, &["--layer", ":range=0..1"]);
    assert_eq!(shades(&sandbox).2, of_range);
    assert!(of_range < 12, "{of_range} shades: nothing but black and white, and their edges");
    // Colours of 8 bits are what they are.
    assert!(!shoot(&sandbox, COLORS, &[]).stderr.contains("black is"));
}
