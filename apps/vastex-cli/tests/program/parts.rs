//! Pictures that are drawn in parts are those that are drawn at once, whatever is in them.

use crate::tool::{Ended, Sandbox, draws_by_gpu};

fn run(sandbox: &Sandbox, command: &str) -> Ended {
    sandbox.run(&command.split_whitespace().collect::<Vec<_>>())
}

/// A directory with a small relief of the Earth and an image, both built.
fn earth() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write_relief("relief.png");
    sandbox.write_png("image.png", [1080, 540]);
    for name in ["relief", "image"] {
        run(&sandbox, &format!("build {name}.png -o {name}.vastex --page 64 --quiet")).expect_code(0);
    }
    sandbox
}

/// Compares a picture in parts with the one that is drawn at once: pixels are at most `most` steps of 1/255
/// apart, by a GPU but for one in a thousand, which is 3 steps apart at most: its filter may weigh the same
/// place otherwise from another part. At the edges of a picture that is drawn at once nothing is loaded of
/// what lies beside it, and so a pixel there may be another.
pub(crate) fn assert_alike(what: &str, (columns, most): (usize, u8), whole: &[[u8; 3]], parts: &[[u8; 3]]) {
    assert_eq!(whole.len(), parts.len(), "pictures of one size");
    let rows = whole.len() / columns;
    let is_inside =
        |n: &usize| (1..columns - 1).contains(&(n % columns)) && (1..rows - 1).contains(&(n / columns));
    let apart = |n: usize| whole[n].iter().zip(&parts[n]).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
    let apart: Vec<u8> = (0..whole.len()).filter(is_inside).map(apart).collect();
    let furthest = apart.iter().copied().max().unwrap_or(0);
    let count = apart.iter().filter(|apart| **apart > most).count();
    let is_open = || furthest <= 3 && 1000 * count <= apart.len() && draws_by_gpu();
    assert!(furthest <= most || is_open(), "{what}: {count} pixels differ by up to {furthest}");
}

/// A picture of few pixels.
const COLUMNS: usize = 120;
const SIZE: &str = "--size 120x100";
/// Divides it into two rows of two parts, so that each part ends at others in both directions.
const IN_PARTS: &str = "--part-side 119";

#[test]
fn a_picture_in_parts_is_the_one_that_is_drawn_at_once() {
    let sandbox = earth();
    let draw = |words: &str, output: &str| {
        run(&sandbox, &format!("render {words} {SIZE} -o {output}")).expect_code(0);
        sandbox.read_rgb(output)
    };
    // The ground, its night, clouds, what is around it and space are in each of two parts at least.
    let planet = "relief.vastex --on planet --height relief.vastex --height-zero 0.4 --night image.vastex --sun -60,10 \
                  --clouds relief.vastex --view globe:lon=25,lat=30,alt=1500000m,heading=60,tilt=50";
    for words in [
        "image.vastex --view image:x=500,y=200,zoom=3,turn=33 --over relief.vastex --compare-mode swipe:0.4 \
         --layer :opacity=0.5 --layer :file=2:opacity=0.5",
        "image.vastex --over relief.vastex --compare-mode beside",
        "image.vastex --view globe:lon=10,lat=46,alt=30000m,heading=20,tilt=50",
        "image.vastex --on plane",
        "relief.vastex --on terrain --view plane:x=0.05,y=0.2,z=0.05,yaw=20,pitch=25",
        planet,
        "image.vastex --on globe --overlay levels",
    ] {
        // Panes, which are narrow, have two rows of two parts as well.
        let in_parts = if words.ends_with("beside") { "--part-side 100" } else { IN_PARTS };
        let (whole, parts) = (draw(words, "whole.png"), draw(&format!("{words} {in_parts}"), "parts.png"));
        assert_alike(words, (COLUMNS, 1), &whole, &parts);
    }
    // Every picture of a path, and as bytes.
    sandbox
        .write("a.path", b"vastex path 1\nfps 1\n0 image:x=200,y=200,zoom=2\n1 image:x=900,y=300,zoom=4\n");
    let path = format!("render image.vastex --camera-path a.path {SIZE}");
    run(&sandbox, &format!("{path} -o whole-%d.png")).expect_code(0);
    run(&sandbox, &format!("{path} {IN_PARTS} -o parts-%d.png")).expect_code(0);
    run(&sandbox, &format!("{path} {IN_PARTS} --format raw -o parts.rgba")).expect_code(0);
    let bytes = sandbox.read("parts.rgba");
    assert_eq!(bytes.len(), 2 * COLUMNS * 100 * 4);
    for frame in 0..2 {
        let parts = sandbox.read_rgb(&format!("parts-{frame}.png"));
        let whole = sandbox.read_rgb(&format!("whole-{frame}.png"));
        assert_alike(&format!("picture {frame}"), (COLUMNS, 1), &whole, &parts);
        let raw: Vec<[u8; 3]> = bytes[frame * COLUMNS * 100 * 4..][..COLUMNS * 100 * 4]
            .chunks_exact(4)
            .map(|texel| [texel[0], texel[1], texel[2]])
            .collect();
        assert!(raw == parts, "{frame}");
    }
    for (words, said) in [
        ("--compare", "--compare is of a picture that is drawn at once"),
        ("--explain 3,4", "--explain"),
        ("--overlay atlas", "the overlay atlas is drawn at once"),
    ] {
        let ended = run(&sandbox, &format!("render image.vastex {SIZE} {IN_PARTS} {words} -o x.png"));
        assert!(ended.expect_code(1).stderr.contains(said), "{words}");
    }
    assert!(!sandbox.path("x.png").exists());
    assert_eq!(sandbox.names().iter().filter(|name| name.contains("partial")).count(), 0);
}

/// The right part of the picture shows nothing, and is drawn last: figures and warnings are of all of it.
#[test]
fn the_summary_of_a_picture_in_parts_is_that_of_all_of_them() {
    let sandbox = earth();
    let draw = |words: &str| {
        let ended = run(&sandbox, &format!("render image.vastex {words} --size 512x128 --json -o x.png"));
        let said = ended.expect_code(0);
        let summary: serde_json::Value = serde_json::from_str(&said.stdout).unwrap();
        (summary, said.stderr.clone())
    };
    let number = |summary: &serde_json::Value, key: &str| summary[key].as_f64().unwrap();
    // All of the image is in the left half.
    let at = "--view image:x=1600,y=270,zoom=0.9";
    let (whole, _) = draw(at);
    assert!(whole.get("parts").is_none());
    let (parts, _) = draw(&format!("{at} --part-side 192"));
    assert!(number(&parts, "parts") >= 2.0, "{parts}");
    assert!(number(&parts, "pages_wanted") >= number(&whole, "pages_wanted"), "{parts}, beside {whole}");
    assert_eq!((number(&parts, "mip_bias"), number(&parts, "share_at_wanted_level")), (0.0, 1.0));
    // A pool that is too small for the part that shows most.
    let near = "--view image:x=1000,y=270,zoom=2.2 --pool-mib 1";
    let (parts, said) = draw(&format!("{near} --part-side 192"));
    assert!(number(&parts, "mip_bias") > 0.0 && number(&parts, "share_at_wanted_level") < 1.0, "{parts}");
    assert!(said.contains("GPU memory for tiles is short"), "{said}");
    let text = run(&sandbox, "render image.vastex --size 512x128 --part-side 192 -o x.png");
    assert!(text.expect_code(0).stdout.contains(" parts\n"), "it does not say that it was drawn in parts");
}

#[cfg(feature = "view")]
#[test]
fn a_picture_of_the_window_in_parts_has_all_that_lies_over_it_once() {
    let sandbox = earth();
    let shoot = |words: &str, output: &str| {
        run(&sandbox, &format!("view --screenshot {output} {words} --size 320x180")).expect_code(0);
        sandbox.read_rgb(output)
    };
    for words in [
        "image.vastex --view image:x=500,y=200,zoom=120",
        "image.vastex --over relief.vastex --compare-mode beside",
        "relief.vastex --on planet --sun 20,10",
    ] {
        // Two rows of two parts, also in each of two panes.
        let side = if words.ends_with("beside") { 160 } else { 240 };
        let (whole, parts) =
            (shoot(words, "whole.png"), shoot(&format!("{words} --part-side {side}"), "parts.png"));
        assert_alike(words, (320, 2), &whole, &parts);
    }
}
