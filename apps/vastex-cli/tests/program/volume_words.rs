//! Words and views of volumes mean the same in the window (`view --screenshot`) and to `render`, also of
//! labels by themselves.

use crate::tool::Sandbox;

const HEAD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/volumes/head.zip");
const NUCLEI: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/volumes/nuclei.zip");
const LABELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/volumes/nuclei.zip/labels/nuclei");
const SIZE: [&str; 2] = ["--size", "80x64"];

/// What the window shows at first.
fn seen(sandbox: &Sandbox, words: &[&str]) -> Vec<[u8; 3]> {
    let all = [&["view", "--screenshot", "seen.png"], &SIZE[..], words].concat();
    sandbox.run(&all).expect_code(0);
    sandbox.read_rgb("seen.png")
}

fn drawn(sandbox: &Sandbox, words: &[&str]) -> Vec<[u8; 3]> {
    let all = [&["render", "-o", "drawn.png"], &SIZE[..], words].concat();
    sandbox.run(&all).expect_code(0);
    sandbox.read_rgb("drawn.png")
}

/// How many of a hundred pixels are alike.
fn alike(a: &[[u8; 3]], b: &[[u8; 3]]) -> usize {
    let is_near = |(a, b): &(&[u8; 3], &[u8; 3])| (0..3).all(|c| a[c].abs_diff(b[c]) <= 2);
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(is_near).count() * 100 / a.len()
}

#[test]
fn a_view_of_labels_by_themselves_is_one_picture() {
    let sandbox = Sandbox::new();
    let camera = "volume:x=64,y=64,z=30,zoom=1,yaw=30,pitch=20;panes=z;slices=64,64,30;mode=mip";
    let view = format!("{camera};channels=none;labels=nuclei:opacity=0.9");
    let by_window = seen(&sandbox, &["--view", &view, LABELS]);
    assert!(by_window.iter().any(|[r, g, b]| r.max(g).max(b) > &100), "something is seen");
    assert!(alike(&by_window, &drawn(&sandbox, &["--view", &view, LABELS])) >= 99, "the view");
    let link = format!("vastex:{LABELS}?view={}", view.replace(';', "%3B"));
    assert!(alike(&by_window, &drawn(&sandbox, &[&link])) >= 99, "the link");
    // Labels alone over an image lie where they do beside it.
    assert!(alike(&by_window, &drawn(&sandbox, &["--view", &view, NUCLEI])) >= 99, "without the image");
    assert!(alike(&by_window, &seen(&sandbox, &["--view", &view, NUCLEI])) >= 99, "nor in the window");
    // What their words say is so without --labels, too.
    let hidden = ["--label-selected", "1000000", "--label-others", "hidden", "--view", &view, LABELS];
    let none = seen(&sandbox, &hidden);
    assert!(alike(&none, &by_window) < 95 && alike(&none, &drawn(&sandbox, &hidden)) >= 99);
    assert!(alike(&seen(&sandbox, &["--view", camera, LABELS, "--label-opacity", "0.2"]), &by_window) < 95);
}

#[test]
fn a_channel_of_a_view_has_its_usual_range_and_colour() {
    let sandbox = Sandbox::new();
    let camera = "volume:x=64,y=64,z=30,zoom=1.5,yaw=-40,pitch=10;panes=3d;mode=mip";
    for (source, channels) in [(NUCLEI, "channel=0"), (HEAD, "channel=2;channel=1:gamma=0.8")] {
        let view = format!("{camera};{channels}");
        let by_window = seen(&sandbox, &["--view", &view, source]);
        assert!(alike(&by_window, &drawn(&sandbox, &["--view", &view, source])) >= 99, "{channels}");
    }
    // Words for channels show what the format can hold, in both.
    let words = ["--channels", "0", "--view", camera, NUCLEI];
    let by_window = seen(&sandbox, &words);
    assert!(alike(&by_window, &drawn(&sandbox, &words)) >= 99, "the words");
    let usual = seen(&sandbox, &["--view", &format!("{camera};channel=0"), NUCLEI]);
    assert!(alike(&by_window, &usual) < 95, "16 bits are more than what is used of them");
    // Ends that are the same, and a range of a view beside --range.
    let equal = format!("{camera};channel=0:range=300..300");
    let by_window = seen(&sandbox, &["--view", &equal, NUCLEI]);
    assert!(alike(&by_window, &drawn(&sandbox, &["--view", &equal, NUCLEI])) >= 98, "equal ends");
    assert_eq!(by_window, seen(&sandbox, &["--range", "0,0.5", "--view", &equal, NUCLEI]));
}

#[test]
fn what_cannot_be_shown_of_labels_is_told() {
    let sandbox = Sandbox::new();
    let camera = "volume:x=64,y=64,z=30,zoom=1,yaw=0,pitch=0";
    let beyond = format!("{camera};labels=nuclei:selected=-1");
    let (none, channel) = (format!("{camera};channels=none"), format!("{camera};channel=0"));
    let view = ["view", "--screenshot", "o.png"];
    let render = ["render", "-o", "o.png"];
    for (command, words, says) in [
        (view, vec![LABELS, "--channels", "0"], "colours of their own"),
        (view, vec![LABELS, "--view", &channel], "colours of their own"),
        (view, vec![LABELS, "--label-selected", "4294967301"], "has no label 4294967301"),
        (view, vec![NUCLEI, "--labels", "nuclei", "--label-selected", "-1"], "0 to 4294967295"),
        (view, vec![NUCLEI, "--view", &beyond], "has no label -1"),
        (render, vec![NUCLEI, "--view", &beyond], "0 to 4294967295"),
        (render, vec![NUCLEI, "--view", &none], "no channel and no labels"),
        (view, vec![NUCLEI, "--label-outlines"], "--label-outlines: it goes with"),
    ] {
        let words = [&command[..], &SIZE, &words].concat();
        let told = sandbox.run(&words).expect_code(1).stderr;
        assert!(told.contains(says), "{words:?}: {told}");
    }
}

#[test]
fn words_that_mean_nothing_to_slices_are_refused() {
    let sandbox = Sandbox::new();
    for (words, says) in [
        (&["--mode", "mip"][..], "'--mode'"),
        (&["--view", "+x"], "'--view'"),
        (&["--view", "around:yaw=30"], "'--view'"),
    ] {
        let slice = ["render", NUCLEI, "--on", "slices", "--slice", "z=3", "-o", "o.png"];
        let told = sandbox.run(&[&slice[..], words].concat()).expect_code(2).stderr;
        assert!(told.contains(says) && told.contains("--on volume"), "{words:?}: {told}");
    }
    let beside = ["--slice", "plane:x=1000,y=0,z=0,nx=1,ny=0,nz=0", "-o", "o.png"];
    let words = [&["render", NUCLEI, "--on", "slices"][..], &beside].concat();
    assert!(sandbox.run(&words).expect_code(1).stderr.contains("does not meet"));
}

#[test]
fn the_help_of_view_tells_of_volumes_by_themselves() {
    let help = Sandbox::new().run(&["view", "--help"]).expect_code(0).stdout;
    let at = |part: &str| help.find(part).unwrap_or_else(|| panic!("{part} is not there: {help}"));
    let volumes = at("Options of volumes:");
    for option in ["--side-by-side", "--screenshot <", "--hud", "--camera-path", "--shapes", "--fade-ms"] {
        assert!(at(&format!("\n      {option}")) < volumes, "{option}");
    }
    assert!(at("\n      --label-others") > volumes && at("Volumes, in the window:") > volumes);
    let long = "  wheel in a slice, Page Up, Page Down, arrows up and down\n";
    assert!(help.contains(long), "what keys do stands on a line of its own where they are many: {help}");
    assert!(help.contains("Or a volume: OME-Zarr") && help.contains("vastex view cells.zarr"));
}
