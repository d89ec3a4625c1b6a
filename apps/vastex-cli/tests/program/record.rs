//! A short form of `cargo xtask record`: what is recorded twice is equal, and what differs is named.

use std::fs;
use std::path::Path;

use tempfile::TempDir;
use xtask::record::compare::{Found, compare};
use xtask::record::{self, FEW_FRAMES, FEW_STEPS, Program};

fn program() -> Program {
    Program { path: env!("CARGO_BIN_EXE_vastex").into() }
}

fn found(was: &Path, is: &Path) -> Found {
    compare(&program(), was, is, &[]).unwrap()
}

/// Puts one text in the place of another, which is there.
fn change(file: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains(from), "{}", file.display());
    fs::write(file, text.replacen(from, to, 1)).unwrap();
}

#[test]
fn two_records_are_equal_and_what_is_changed_in_one_is_named() {
    let sandbox = TempDir::new().unwrap();
    let [was, is] = ["was", "is"].map(|name| sandbox.path().join(name));
    for directory in [&was, &is] {
        fs::create_dir(directory).unwrap();
        // Nothing of a record depends on where it was made.
        let work = directory.with_extension("sandbox");
        for only in ["one-fly-tight", "many-asked", "many-chance-31", "trace-spin"] {
            record::worlds(&program(), &sandbox.path().join("some"), only).unwrap();
            let worlds = directory.join("worlds");
            fs::create_dir_all(&worlds).unwrap();
            for entry in fs::read_dir(sandbox.path().join("some/worlds")).unwrap() {
                let entry = entry.unwrap();
                fs::copy(entry.path(), worlds.join(entry.file_name())).unwrap();
            }
        }
        record::frames(&program(), &work, directory, &FEW_FRAMES).unwrap();
        record::files(&program(), None, None, &work, directory, &FEW_STEPS).unwrap();
    }
    let none = found(&was, &is);
    assert_eq!(none.differences, Vec::<String>::new());
    let files = ["worlds", "frames", "files"].map(|part| none.parts[part][0]);
    assert!(files[0] >= 6 && files[1] >= 20 && files[2] == 1, "{files:?}");

    change(&is.join("worlds/many-asked.txt"), " done ", " late ");
    change(&is.join("files.txt"), "resumed out.vastex: ", "resumed out.vastex: 0");
    fs::remove_file(is.join("worlds/trace-spin.sets.txt")).unwrap();
    // A planet and a list of layers show something else than a plane.
    let [plane, image, planet, list, volume] = FEW_FRAMES.map(|name| is.join(format!("frames/{name}.png")));
    for other in [image, planet, list] {
        fs::copy(&plane, other).unwrap();
    }
    change(&volume.with_extension("feedback.txt"), "\nframe 0\n0:", "\nframe 0\n1:");
    let some = found(&was, &is).differences;
    assert_eq!(some.len(), 7, "{some:#?}");
    let named = [
        ("files.txt: resumed out.vastex\n    - ", "\n    + 0"),
        ("frames/image-raw.png: ", " of 9216 texels differ, by "),
        ("frames/list-over.png: ", " of 9216 texels differ, by "),
        ("frames/planet-lit.png: ", " of 9216 texels differ, by "),
        ("frames/volume-mip.feedback.txt:", " (frame "),
        ("worlds/many-asked.txt:", " (frame "),
        ("worlds/trace-spin.sets.txt: ", "is not any more"),
    ];
    for (told, (begins, says)) in some.iter().zip(named) {
        assert!(told.starts_with(begins) && told.contains(says), "{told}");
    }
}

#[test]
fn a_trace_is_compared_by_what_it_says() {
    let sandbox = TempDir::new().unwrap();
    for name in ["was", "is"] {
        record::worlds(&program(), &sandbox.path().join(name), "trace-fly").unwrap();
    }
    let [was, is] = ["was", "is"].map(|name| sandbox.path().join(name));
    // Other bytes that say the same are no difference; a text that says something else is one.
    fs::write(is.join("worlds/trace-fly.vxtrace"), "another form").unwrap();
    assert_eq!(found(&was, &is).differences, Vec::<String>::new());
    change(&was.join("worlds/trace-fly.txt"), " x", " x1");
    let some = found(&was, &is).differences;
    assert_eq!(some.len(), 2, "the texts differ, and the old trace does not say what it said: {some:#?}");
}
