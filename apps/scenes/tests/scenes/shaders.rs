//! Every shader text of the project is valid and every shader file is part of one, without a device.

use std::path::{Path, PathBuf};

use memchr::memmem::Finder;

#[path = "../../examples/shaders/list.rs"]
mod list;

/// One text of so many is validated here, more of the library's; a browser takes a text with every
/// declaration there is in a step of its own, and wgpu whatever a test uses. Neighbours in the list differ in
/// one option, and no option has a multiple of so many values.
const ONE_OF: usize = 113;
const ONE_OF_LIBRARY: usize = 29;

/// Both are asked of one walk, since making the texts is what takes long.
#[test]
fn shader_texts_are_valid_and_every_shader_file_is_part_of_one() {
    let parts = parts_of_texts();
    let mut unknown: Vec<(&PathBuf, Finder<'_>)> =
        parts.iter().map(|(file, part)| (file, Finder::new(part))).collect();
    let (mut nth, mut checked) = (0, 0);
    list::each(&mut |name, text| {
        let one_of = if name.starts_with("library") { ONE_OF_LIBRARY } else { ONE_OF };
        if nth % one_of == 0 {
            check(name, &text);
            checked += 1;
        }
        nth += 1;
        unknown.retain(|(_, part)| part.find(text.as_bytes()).is_none());
    });
    assert!(checked > 80 && checked * ONE_OF >= nth, "{checked} of {nth}");
    let unknown: Vec<&PathBuf> = unknown.into_iter().map(|(file, _)| file).collect();
    assert!(unknown.is_empty(), "no text has {unknown:?}");
}

/// Of every shader file what a text with it contains.
fn parts_of_texts() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut files = Vec::new();
    for directory in ["apps", "crates"] {
        shader_files(&root.join(directory), &mut files);
    }
    assert!(files.len() > 60, "{files:?}");
    let part = |file: PathBuf| {
        let text = std::fs::read_to_string(&file).unwrap();
        // Names and numbers stand in the place of words of these.
        let marks = ["MEMBER", "NAME", "_POOL", "_LAYER", "_KIND", "_WAY"];
        let is_pattern = marks.iter().any(|mark| text.contains(mark));
        let part = if is_pattern { text.lines().next().unwrap_or_default().to_owned() } else { text };
        (file, part)
    };
    files.into_iter().map(part).collect()
}

fn shader_files(directory: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            shader_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "wgsl") {
            files.push(path);
        }
    }
}

fn check(name: &str, text: &str) {
    let parsed =
        naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
    let flags = naga::valid::ValidationFlags::all();
    let validated = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty()).validate(&parsed);
    if let Err(error) = validated {
        panic!("{name}: {}", error.emit_to_string(text));
    }
}
