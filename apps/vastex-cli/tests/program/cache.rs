//! Images that nobody built, shown all the same: they are built into the cache once.

use std::path::{Path, PathBuf};

use crate::tool::{Ended, Sandbox};

/// All files below a directory but locks.
fn files(directory: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(directory) else { return Vec::new() };
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        paths.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect();
    files.retain(|file| file.extension().is_none_or(|ending| ending != "lock"));
    files.sort();
    files
}

/// A run whose cache is in the sandbox.
fn run(sandbox: &Sandbox, args: &[&str]) -> Ended {
    Ended::of(sandbox.command(args).env("XDG_CACHE_HOME", sandbox.path("caches")))
}

/// What is kept there.
fn kept(sandbox: &Sandbox) -> Vec<PathBuf> {
    files(&sandbox.path("caches/vastex"))
}

#[test]
fn an_image_is_shown_without_a_build_and_built_once() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [300, 200]);
    let first = run(&sandbox, &["render", "image.png", "-o", "first.png"]).expect_code(0);
    assert!(first.stderr.contains("image.png: is built into"), "{first}");
    let cached = kept(&sandbox);
    assert_eq!(cached.len(), 1, "{cached:?}");
    let second = run(&sandbox, &["render", "image.png", "-o", "second.png"]).expect_code(0);
    assert!(!second.stderr.contains("is built"), "{second}");
    run(&sandbox, &["build", "image.png", "-o", "image.vastex", "--quiet"]).expect_code(0);
    run(&sandbox, &["render", "image.vastex", "-o", "built.png"]).expect_code(0);
    assert_eq!(sandbox.read("first.png"), sandbox.read("built.png"));
    assert_eq!(sandbox.read("second.png"), sandbox.read("built.png"));
    // On a globe the edges are neighbours: that is another container.
    let globe = run(&sandbox, &["render", "image.png", "--on", "globe", "-o", "globe.png"]).expect_code(0);
    assert!(globe.stderr.contains("is built"), "{globe}");
    assert_eq!(kept(&sandbox).len(), 2);
    let wrapped = ["build", "image.png", "-o", "globe.vastex", "--address", "wrap,clamp", "--quiet"];
    run(&sandbox, &wrapped).expect_code(0);
    run(&sandbox, &["render", "globe.vastex", "--on", "globe", "-o", "of-built.png"]).expect_code(0);
    assert_eq!(sandbox.read("globe.png"), sandbox.read("of-built.png"));
    // A generated planet takes it, too.
    run(&sandbox, &["render", "planet:12:image.png", "-o", "planet.png"]).expect_code(0);
}

#[test]
fn a_cached_image_that_is_damaged_is_built_anew_once() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [900, 700]);
    let render = |name: &str| run(&sandbox, &["render", "image.png", "--size", "900x700", "-o", name]);
    render("whole.png").expect_code(0);
    let [cached] = &kept(&sandbox)[..] else { panic!("one container is kept") };
    let whole = std::fs::read(cached).unwrap();
    // Between the description and the index lie the tiles.
    let mut bytes = whole.clone();
    let end = bytes.len() * 9 / 10;
    (bytes.len() / 2..end).step_by(97).for_each(|at| bytes[at] ^= 0x55);
    std::fs::write(cached, bytes).unwrap();
    let mended = render("mended.png").expect_code(0);
    assert_eq!(mended.stderr.matches("is damaged; it is built anew").count(), 1, "{mended}");
    assert!(sandbox.read("mended.png") == sandbox.read("whole.png"));
    assert!(std::fs::read(&kept(&sandbox)[0]).unwrap() == whole, "the same bytes");
    assert!(!render("again.png").expect_code(0).stderr.contains("damaged"));
}

#[test]
fn of_an_image_info_tells_what_its_header_says() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [300, 200]);
    let told = run(&sandbox, &["info", "image.png"]).expect_code(0);
    assert!(told.stdout.starts_with("image.png\n300x200 texels of 8-bit RGB\n"), "{told}");
    let told = run(&sandbox, &["info", "image.png", "--json"]).expect_code(0);
    let told: serde_json::Value = serde_json::from_str(&told.stdout).unwrap();
    assert_eq!((&told["kind"], &told["size"]), (&"image".into(), &serde_json::json!([300, 200])));
    let refused = run(&sandbox, &["info", "image.png", "--estimate", "100x100"]).expect_code(1);
    assert!(refused.stderr.contains("`vastex build image.png"), "{refused}");
    assert!(kept(&sandbox).is_empty(), "nothing is built for that");
}

#[test]
fn the_cache_lies_where_it_is_asked_for_or_nowhere() {
    let sandbox = Sandbox::new();
    sandbox.write_png("image.png", [100, 60]);
    let render = |more: &[&str]| run(&sandbox, &[&["render", "image.png", "-o", "out.png"], more].concat());
    render(&["--cache", "mine/here"]).expect_code(0);
    assert_eq!((files(&sandbox.path("mine/here")).len(), kept(&sandbox).len()), (1, 0));
    // Without a cache it is decoded into memory: the same picture.
    let cached = sandbox.read("out.png");
    let off = render(&["--cache", "off"]).expect_code(0);
    assert!(off.stderr.is_empty() && sandbox.read("out.png") == cached, "{off}");
    assert_eq!((files(&sandbox.path("mine/here")).len(), kept(&sandbox).len()), (1, 0));
    sandbox.write("file", b"");
    let unusable = render(&["--cache", "file/cache"]).expect_code(1);
    assert!(unusable.stderr.contains("file/cache: cannot hold built images"), "{unusable}");
    let mut homeless = sandbox.command(&["render", "image.png", "-o", "out.png"]);
    let homeless = Ended::of(homeless.env_remove("XDG_CACHE_HOME").env_remove("HOME")).expect_code(1);
    assert!(homeless.stderr.contains("name one with --cache DIR"), "{homeless}");
    // What is damaged is said of the image, and leaves nothing.
    let whole = sandbox.read("image.png");
    sandbox.write("short.png", &whole[..whole.len() / 2]);
    for cache in [&[][..], &["--cache", "off"]] {
        let short =
            run(&sandbox, &[&["render", "short.png", "-o", "out.png"], cache].concat()).expect_code(1);
        assert!(short.stderr.contains("short.png") && short.stderr.contains("truncated"), "{short}");
    }
    assert_eq!(kept(&sandbox).len(), 0);
}
