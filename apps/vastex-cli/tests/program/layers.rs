//! `--layer`: several layers over one another, and what is said of those that are none.

use crate::tool::{Ended, Sandbox};

fn run(sandbox: &Sandbox, command: &str) -> Ended {
    sandbox.run(&command.split_whitespace().collect::<Vec<_>>())
}

/// The Earth's colours and heights, both small.
fn sandbox_with_layers() -> Sandbox {
    let sandbox = Sandbox::new();
    let relief = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-elevation-1080x540-u16.png");
    std::fs::copy(relief, sandbox.path("relief.png")).unwrap();
    let build = "build -o earth.vastex --layer depth=relief.png --layer height=relief.png --page 64 --quiet";
    run(&sandbox, build).expect_code(0);
    sandbox
}

#[test]
fn layers_lie_over_one_another() {
    let sandbox = sandbox_with_layers();
    let render = "render earth.vastex --size 200x100";
    let picture = |layers: &str, name: &str| {
        run(&sandbox, &format!("{render} {layers} -o {name}.png")).expect_code(0);
        sandbox.read_rgb(&format!("{name}.png"))
    };
    let below = picture("--layer depth:range=0.1..0.3", "below");
    let above = picture("--layer height:range=0.15..0.25:map=viridis:filter=nearest", "above");
    let both = picture(
        "--layer depth:range=0.1..0.3 --layer height:range=0.15..0.25:map=viridis:opacity=0.5:filter=nearest",
        "both",
    );
    let light = |encoded: u8| (f64::from(encoded) / 255.0).powf(2.2);
    let channels = both.as_flattened().iter().zip(below.as_flattened().iter().zip(above.as_flattened()));
    let apart = channels.map(|(both, (below, above))| {
        let expected = ((light(*below) + light(*above)) / 2.0).powf(1.0 / 2.2) * 255.0;
        (expected - f64::from(*both)).abs()
    });
    let far = apart.filter(|apart| *apart > 6.0).count();
    assert!(far * 100 < both.len() * 3, "{far} channels of {} pixels are not half of each", both.len());
    // A layer that is hidden is as if it were not there, and one that is opaque hides the others.
    let hidden = picture("--layer depth:range=0.1..0.3 --layer height:hidden", "hidden");
    let opaque =
        picture("--layer depth --layer height:range=0.15..0.25:map=viridis:filter=nearest", "opaque");
    for (one, other) in [(&hidden, &below), (&opaque, &above)] {
        let channels = one.as_flattened().iter().zip(other.as_flattened());
        assert!(channels.map(|(a, b)| a.abs_diff(*b)).max() <= Some(2));
    }
    for scene in ["terrain", "globe --height-scale 0.2"] {
        let layers = "--layer depth:map=inferno --layer height:opacity=0.3 --overlay levels";
        run(&sandbox, &format!("{render} --on {scene} {layers} -o on.png")).expect_code(0);
    }
}

#[test]
fn bands_and_values_without_data_are_chosen() {
    let sandbox = sandbox_with_layers();
    let picture = |layer: &str| {
        run(&sandbox, &format!("render earth.vastex --layer {layer} --size 100x50 -o a.png")).expect_code(0);
        sandbox.read_rgb("a.png")
    };
    let (plain, one) = (picture("depth:filter=nearest"), picture("depth:bands=1:filter=nearest"));
    assert_eq!(plain, one);
    assert_eq!(plain, picture("depth:nodata=65535:filter=nearest"));
    let refused = run(&sandbox, "render earth.vastex --layer depth:bands=2 -o a.png").expect_code(1);
    assert!(refused.stderr.contains("there are no bands 2 in layer \"depth\""), "{refused}");
}

#[test]
fn files_are_shown_side_by_side() {
    let sandbox = sandbox_with_layers();
    let picture = |words: &str| {
        run(&sandbox, &format!("render {words} --cache off -o a.png")).expect_code(0);
        sandbox.read_rgb("a.png")
    };
    let below = "earth.vastex --layer depth:range=0.1..0.3";
    // Two panes, and three of which one column is left.
    for (files, layers, panes) in
        [("--over relief.png", "", 2), ("--over relief.png --over earth.vastex", "", 3)]
    {
        let (width, height) = (100, 80);
        let all = width * panes + panes - 1;
        let beside =
            picture(&format!("{below} {files} {layers} --compare-mode beside --size {all}x{height}"));
        let alone = [below.to_owned(), "relief.png".to_owned(), "earth.vastex".to_owned()];
        for (pane, alone) in (0..panes).zip(alone) {
            let alone = picture(&format!("{alone} --size {width}x{height}"));
            for (i, expected) in alone.iter().enumerate() {
                let [x, y] = [i % width, i / width];
                let found = beside[y * all + pane * width + x];
                let off = found.iter().zip(expected).map(|(a, b)| a.abs_diff(*b)).max();
                assert!(off <= Some(3), "pane {pane} of {panes} ({x}, {y}): {found:?}, {expected:?} alone");
            }
        }
    }
    let refused = run(&sandbox, "render earth.vastex --compare-mode beside -o a.png").expect_code(2);
    assert!(refused.stderr.contains("one layer is shown"), "{refused}");
}

#[test]
fn files_lie_over_one_another_and_are_compared() {
    let sandbox = sandbox_with_layers();
    let render =
        "render earth.vastex --layer depth:range=0.1..0.3 --over relief.png --cache off --size 200x100";
    let picture = |words: &str, name: &str| {
        run(&sandbox, &format!("{words} -o {name}.png")).expect_code(0);
        sandbox.read_rgb(&format!("{name}.png"))
    };
    let below = picture("render earth.vastex --layer depth:range=0.1..0.3 --size 200x100", "below");
    let over = picture(render, "over");
    let alone = picture("render relief.png --cache off --size 200x100", "alone");
    let apart = |one: &[[u8; 3]], other: &[[u8; 3]]| {
        let channels = one.as_flattened().iter().zip(other.as_flattened());
        channels.map(|(a, b)| a.abs_diff(*b)).max().unwrap()
    };
    assert!(apart(&over, &alone) <= 2, "what lies over it hides it");
    let swiped = picture(&format!("{render} --compare-mode swipe:0.25"), "swiped");
    for row in 0..100 {
        let (line, end) = (row * 200 + 50, row * 200 + 200);
        assert!(apart(&swiped[row * 200..line], &below[row * 200..line]) <= 2, "row {row}");
        assert!(apart(&swiped[line..end], &over[line..end]) <= 2, "row {row}");
    }
    let same = "render relief.png --over relief.png --cache off --compare-mode difference:100 --size 200x100";
    assert_eq!(apart(&picture(same, "same"), &vec![[0; 3]; 200 * 100]), 0);
    for (words, code, said) in [
        ("--over nowhere.png", 1, "nowhere.png: there is no such file"),
        ("--over relief.png --layer depth --layer depth:file=3", 2, "'file=3': there are 2 files"),
        ("--compare-mode swipe", 2, "lay a file over it with --over"),
        ("--over relief.png --compare-mode swap", 2, "write off, swipe[:AT]"),
        ("--over relief.png --placement middle", 2, "write stretched or by-texel"),
        ("--over relief.png --compare", 2, "--compare compares one opaque layer"),
    ] {
        let ended = run(&sandbox, &format!("render earth.vastex {words} -o x.png")).expect_code(code);
        assert!(ended.stderr.contains(said), "{words}: {ended}");
    }
    std::fs::copy(sandbox.path("over.png"), sandbox.path("kept.png")).unwrap();
    let ended = run(&sandbox, "render earth.vastex --over kept.png -o kept.png");
    assert!(ended.expect_code(1).stderr.contains("kept.png: is the source as well as the output"));
}

/// A part of an image lies upon it texel by texel, if that is said, and is stretched otherwise.
#[test]
fn images_of_unlike_size_lie_where_they_are_told_to() {
    let sandbox = sandbox_with_layers();
    run(&sandbox, "crop relief.png --at 0,0 --size 540x270 -o crop.png").expect_code(0);
    let picture = |placed: &str, view: &str| {
        let view = format!("image:x=540,y=270,zoom=20;layer=;layer=:file=2;compare=difference:1000{view}");
        let words =
            format!("render relief.png --over crop.png --cache off --filter nearest {placed} --size 60x30");
        let words = format!("{words} --view {view} -o a.png");
        run(&sandbox, &words).expect_code(0);
        sandbox.read_rgb("a.png")
    };
    let (by_option, by_view) = (picture("--placement by-texel", ""), picture("", ";placement=by-texel"));
    assert!(by_option == by_view && by_view != picture("", ""));
    // The part ends in the middle of the picture. Where it is, it differs from the whole in nothing.
    let ground = by_view[30 * 60 - 1];
    assert_ne!(ground, [0; 3]);
    for (n, pixel) in by_view.iter().enumerate() {
        let is_in_both = n % 60 < 30 && n / 60 < 15;
        assert_eq!(*pixel, if is_in_both { [0; 3] } else { ground }, "{},{}", n % 60, n / 60);
    }
    let twice = "render relief.png --over crop.png --placement by-texel --view image:x=1,y=1,zoom=1;placement=stretched";
    let refused = run(&sandbox, &format!("{twice} -o a.png")).expect_code(2);
    assert!(refused.stderr.contains("leave out --placement"), "{refused}");
}

#[test]
fn what_is_no_layer_is_told() {
    let sandbox = sandbox_with_layers();
    for (words, code, said) in [
        ("--layer snow", 1, "there is no layer \"snow\"; the layers are depth, height"),
        ("--layer height:map=jet", 2, "grey, viridis, magma"),
        ("--layer height:opacity=2", 2, "from 0 to 1"),
        ("--layer height --layer-shown depth", 2, "cannot be used with"),
        ("--layer height --range 0,1", 2, "cannot be used with"),
        ("--layer depth --layer height --compare", 2, "one opaque layer"),
        ("--layer depth:opacity=0.5 --estimate quadtree", 2, "one opaque layer"),
    ] {
        let ended = run(&sandbox, &format!("render earth.vastex {words} -o out.png")).expect_code(code);
        assert!(ended.stderr.contains(said), "{words}: {ended}");
    }
    let nine = "--layer height ".repeat(9);
    let ended = run(&sandbox, &format!("render earth.vastex {nine}")).expect_code(2);
    assert!(ended.stderr.contains("9 layers named, 8 are shown at most"), "{ended}");
    assert!(!sandbox.path("out.png").exists());
    run(&sandbox, "render earth.vastex --layer depth --compare").expect_code(0);
}
