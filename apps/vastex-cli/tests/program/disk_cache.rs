//! `--disk-cache`: later runs read from it, trouble with it is said and changes no picture.

use std::fs::File;

use serde_json::Value;

use crate::tool::{Ended, Sandbox};

fn render(sandbox: &Sandbox, source: &str, more: &[&str]) -> (Value, String) {
    let args = ["render", source, "--size", "160x90", "-o", "out.png", "--json"];
    let ended = sandbox.run(&[&args[..], more].concat()).expect_code(0);
    (ended.json(), ended.stderr)
}

fn reads(json: &Value) -> [u64; 2] {
    ["hits", "misses"].map(|name| json["disk_cache"][name].as_u64().unwrap())
}

#[test]
fn a_second_run_reads_everything_from_the_cache_and_a_changed_file_nothing() {
    let sandbox = Sandbox::with_container();
    let cache = ["--disk-cache", "made/cache"];
    let (without, _) = render(&sandbox, "image.vastex", &[]);
    assert_eq!(without.get("disk_cache"), None);
    let picture = sandbox.read("out.png");
    let (first, _) = render(&sandbox, "image.vastex", &cache);
    let [hits, misses] = reads(&first);
    assert!(hits == 0 && misses > 1, "{first}");
    std::fs::rename(sandbox.path("image.vastex"), sandbox.path("moved.vastex")).unwrap();
    let (second, said) = render(&sandbox, "moved.vastex", &cache);
    assert_eq!(reads(&second), [misses, 0]);
    assert!(!said.contains("note"), "{said}");
    assert_eq!(sandbox.read("out.png"), picture);

    sandbox.write_png("other.png", [300, 201]);
    sandbox.run(&["build", "other.png", "-o", "moved.vastex", "--page", "64", "--quiet"]).expect_code(0);
    assert_eq!(reads(&render(&sandbox, "moved.vastex", &cache).0)[0], 0);
}

#[test]
fn tile_directories_are_kept_until_a_file_of_theirs_changes() {
    let sandbox = Sandbox::with_container();
    sandbox.run(&["export", "image.vastex", "--layout", "deepzoom", "-o", "tree", "--quiet"]).expect_code(0);
    let cache = ["--disk-cache", "cache"];
    let misses = reads(&render(&sandbox, "tree", &cache).0)[1];
    assert_eq!(reads(&render(&sandbox, "tree", &cache).0), [misses, 0]);
    let mut names = std::fs::read_dir(sandbox.path("tree/tree_files/9")).unwrap();
    let tile = names.next().unwrap().unwrap().path();
    File::options().write(true).open(tile).unwrap().set_modified(std::time::UNIX_EPOCH).unwrap();
    assert_eq!(reads(&render(&sandbox, "tree", &cache).0), [0, misses]);
}

#[test]
fn a_cache_that_cannot_be_had_is_done_without() {
    let sandbox = Sandbox::with_container();
    render(&sandbox, "image.vastex", &[]);
    let picture = sandbox.read("out.png");
    sandbox.write("file", b"x");
    std::fs::create_dir(sandbox.path("cache")).unwrap();
    let lock = File::create(sandbox.path("cache/vastex.lock")).unwrap();
    lock.lock().unwrap();
    for (directory, words) in [("file", "cannot be a disk cache"), ("cache", "is in use")] {
        let (json, said) = render(&sandbox, "image.vastex", &["--disk-cache", directory]);
        assert!(said.contains(words) && said.contains("note: ") && said.contains(directory), "{said}");
        assert_eq!((json.get("disk_cache"), sandbox.read("out.png")), (None, picture.clone()));
    }
    let ended = sandbox.run(&["render", "image.vastex", "--disk-cache-mib", "5"]).expect_code(2);
    assert!(ended.stderr.contains("--disk-cache <DIR>"), "{ended}");
}

/// A source and what lies over it are both kept, in one directory.
#[test]
fn all_files_of_a_picture_are_kept() {
    let sandbox = Sandbox::with_container();
    sandbox.write_grey_png("over.png", [290, 210]);
    sandbox.run(&["build", "over.png", "-o", "over.vastex", "--page", "64", "--quiet"]).expect_code(0);
    let with = ["--over", "over.vastex", "--disk-cache", "cache"];
    let (first, said) = render(&sandbox, "image.vastex", &with);
    let [hits, misses] = reads(&first);
    assert!(!said.contains("in use") && hits == 0, "{said}");
    assert_eq!(reads(&render(&sandbox, "image.vastex", &with).0), [misses, 0]);
    let alone = ["--disk-cache", "alone"];
    assert!(misses > reads(&render(&sandbox, "image.vastex", &alone).0)[1]);
}

#[test]
fn an_image_of_a_file_is_kept_beside_the_file_itself() {
    let sandbox = Sandbox::new();
    let slide = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/tiff/slide-jpeg.svs");
    sandbox.write("slide.svs", &std::fs::read(slide).unwrap());
    for source in ["slide.svs", "slide.svs:label"] {
        let (first, said) = render(&sandbox, source, &["--disk-cache", "cache"]);
        let [hits, misses] = reads(&first);
        assert!(hits == 0 && misses > 0, "{source}: {first} {said}");
        let [hits, misses] = reads(&render(&sandbox, source, &["--disk-cache", "cache"]).0);
        assert!(hits > 0 && misses == 0, "{source}");
    }
}

/// What the limit for files does is what a full disk does.
#[cfg(unix)]
#[test]
fn where_nothing_can_be_written_the_picture_is_the_same_and_it_is_said_once() {
    let sandbox = Sandbox::with_container();
    render(&sandbox, "image.vastex", &[]);
    let picture = sandbox.read("out.png");
    let script = "ulimit -f 0; exec \"$0\" render image.vastex --size 160x90 --disk-cache cache --json";
    let mut command = std::process::Command::new("sh");
    command.args(["-c", script, env!("CARGO_BIN_EXE_vastex")]).current_dir(sandbox.path(""));
    let ended = Ended::of(command.env_remove("RUST_LOG")).expect_code(0);
    assert_eq!(ended.stderr.matches("the disk cache cannot keep tiles").count(), 1, "{ended}");
    let json = ended.json();
    assert_eq!((&json["disk_cache"]["bytes"], &json["pages_failed"]), (&0.into(), &0.into()));
    assert!(json["disk_cache"]["failures"].as_u64() > Some(0) && !picture.is_empty());
}
