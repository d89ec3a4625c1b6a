//! Views as texts and links: a planet is drawn as its text says, whoever draws it, and a link is opened where
//! a file is.

use crate::tool::{Ended, Sandbox};

fn run(sandbox: &Sandbox, words: &[&str]) -> Ended {
    sandbox.run(words)
}

/// A directory with a small relief of the Earth, built, and two other files to lie on it.
fn earth() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write_relief("relief.png");
    sandbox.write_png("lights.png", [96, 48]);
    sandbox.write_grey_png("clouds of today.png", [96, 48]);
    for name in ["relief", "lights", "clouds of today"] {
        let (image, container) = (format!("{name}.png"), format!("{name}.vastex"));
        run(&sandbox, &["build", &image, "-o", &container, "--page", "64", "--quiet"]).expect_code(0);
    }
    sandbox
}

const PLACE: &str = "globe:lon=10,lat=30,alt=20000000m";
/// All that is said of a planet, as the window copies it.
const PLANET: &str = "on=planet;layer=:gamma=1.4;height=:file=2:scale=0.01:zero=0;sun=-60,10;exaggeration=7;\
                      atmosphere=0.5;lights=1;night=:file=3;clouds=:file=4:opacity=0.7";

fn furthest(one: &[[u8; 3]], other: &[[u8; 3]]) -> u8 {
    assert_eq!(one.len(), other.len(), "pictures of one size");
    let channels = one.as_flattened().iter().zip(other.as_flattened());
    channels.map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(u8::MAX)
}

#[test]
fn a_planet_is_what_its_text_says() {
    let sandbox = earth();
    let draw = |words: &[&str]| {
        let render = ["render", "relief.vastex", "--size", "96x64", "-o", "out.png"];
        run(&sandbox, &[&render, words].concat()).expect_code(0);
        sandbox.read_rgb("out.png")
    };
    let over = ["--over", "relief.vastex", "--over", "lights.vastex", "--over", "clouds of today.vastex"];
    let view = format!("{PLACE};{PLANET}");
    let of_text = draw(&[&over[..], &["--view", &view]].concat());
    // That every part of it counts is tested beside the arguments.
    let changed = draw(&[&over[..], &["--view", &view.replace("lights=1", "lights=20")]].concat());
    assert_ne!(changed, of_text);
    // The same, said by options; how dense clouds are only a text says.
    let clouds = view.replace(":opacity=0.7", "");
    let options = "--on planet --height relief.vastex --night lights.vastex --layer :gamma=1.4 --sun -60,10 --exaggeration 7 \
                   --atmosphere 0.5 --height-scale 0.01 --height-zero 0 --clouds";
    let options: Vec<&str> =
        options.split_whitespace().chain(["clouds of today.vastex", "--view", PLACE]).collect();
    let of_options = draw(&options);
    assert_eq!(of_options, draw(&[&over[..], &["--view", &clouds]].concat()));
    assert_ne!(of_options, of_text, "clouds are thinner");
    // A link says the same, from anywhere, and files that it names are no layers by themselves.
    let link = |view: &str| {
        format!(
            "vastex:relief.vastex?file=relief.vastex&file=lights.vastex&file=clouds%20of%20today.vastex&view={view}"
        )
    };
    let of_link = |link: &str| {
        run(&sandbox, &["render", link, "--size", "96x64", "-o", "out.png"]).expect_code(0);
        sandbox.read_rgb("out.png")
    };
    assert_eq!(of_link(&link(&view)), of_text);
    assert_eq!(
        of_link(&link(&view.replace("layer=:gamma=1.4;", ""))),
        of_link(&link(&view.replace(":gamma=1.4", "")))
    );
    // Commands that show nothing take the file that it is of.
    let told = run(&sandbox, &["info", &link(&view), "--json"]).expect_code(0);
    assert_eq!(told.json(), run(&sandbox, &["info", "relief.vastex", "--json"]).expect_code(0).json());
    // A path of the camera has all of it as well, and so has the page about it.
    sandbox.write("a.path", format!("vastex path 1\n0 {PLACE}\n").as_bytes());
    let words = [
        "render",
        &link(&view),
        "--camera-path",
        "a.path",
        "--size",
        "96x64",
        "--report",
        "page",
        "-o",
        "out.png",
    ];
    run(&sandbox, &words).expect_code(0);
    assert_eq!(sandbox.read_rgb("out.png"), of_text);
    let page = String::from_utf8(sandbox.read("page/index.html")).unwrap();
    assert!(
        page.contains(&PLANET[..40]) && page.contains("clouds=:file=4:opacity=0.7"),
        "the view is in the page"
    );
    for (words, code, said) in [
        (
            vec!["--view", &format!("{PLACE};on=planet;sun=1,2"), "--sun", "off"],
            2,
            "--view says where the sun stands",
        ),
        (vec!["--view", &format!("{PLACE};moon=1")], 2, "there is no 'moon'"),
        (vec!["--view", &format!("{PLACE};on=planet;night=:file=2")], 2, "'file=2': there are 1 files"),
        (vec!["--view", &format!("{PLACE};on=terrain")], 2, "plane:"),
    ] {
        let ended = run(&sandbox, &[&["render", "relief.vastex", "-o", "x.png"][..], &words].concat())
            .expect_code(code);
        assert!(ended.stderr.contains(said), "{words:?}: {ended}");
    }
}

#[cfg(feature = "view")]
#[test]
fn the_window_shows_a_planet_as_render_draws_it() {
    let sandbox = earth();
    let view = format!("{PLACE};{PLANET}");
    let over = ["--over", "relief.vastex", "--over", "lights.vastex", "--over", "clouds of today.vastex"];
    let shown = ["relief.vastex", "--size", "96x64", "--view", &view];
    run(&sandbox, &[&["render", "-o", "render.png"][..], &shown, &over].concat()).expect_code(0);
    run(&sandbox, &[&["view", "--screenshot", "window.png"][..], &shown, &over].concat()).expect_code(0);
    assert!(furthest(&sandbox.read_rgb("window.png"), &sandbox.read_rgb("render.png")) <= 1);
    let link = format!(
        "vastex:{}?file=relief.vastex&file=lights.vastex&file=clouds+of+today.vastex&view={view}",
        sandbox.path("relief.vastex").display()
    );
    run(&sandbox, &["view", "--screenshot", "link.png", "--size", "96x64", &link]).expect_code(0);
    assert!(furthest(&sandbox.read_rgb("link.png"), &sandbox.read_rgb("render.png")) <= 1);
}

#[test]
fn what_is_no_link_is_told_and_draws_nothing() {
    let sandbox = Sandbox::with_container();
    for (link, code, said) in [
        ("vastex:", 2, "names no file"),
        ("vastex:image.vastex?veiw=x", 2, "'veiw=x' is no part of a link"),
        ("vastex:image%2.vastex", 2, "'%2.' is no code of a character"),
        ("vastex:image.vastex?view=moon", 2, "'moon' is no view"),
        ("vastex:image.vastex?view=image:x=1,y=2,zoom=3;layer=:file=2", 2, "the view is of file 2"),
        ("vastex:nothing.vastex?view=image:x=1,y=2,zoom=3", 1, "nothing.vastex"),
        ("vastex:image.vastex?file=nothing.png", 1, "nothing.png"),
    ] {
        let ended = run(&sandbox, &["render", link, "--size", "40x30", "-o", "x.png"]).expect_code(code);
        assert!(ended.stderr.contains(said), "{link}: {ended}");
    }
    let twice = ["render", "vastex:image.vastex?view=image:x=1,y=2,zoom=3", "--view", "image:x=1,y=2,zoom=3"];
    assert!(run(&sandbox, &twice).expect_code(2).stderr.contains("leave out one of them"));
    assert!(!sandbox.path("x.png").exists());
    // A link without a view is its file.
    run(&sandbox, &["render", "vastex:image.vastex", "--size", "40x30", "-o", "link.png"]).expect_code(0);
    run(&sandbox, &["render", "image.vastex", "--size", "40x30", "-o", "file.png"]).expect_code(0);
    assert_eq!(sandbox.read_rgb("link.png"), sandbox.read_rgb("file.png"));
}
