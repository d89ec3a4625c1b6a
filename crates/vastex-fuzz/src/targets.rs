//! The targets: each hands bytes to a reader and asserts what must hold whatever they are.
//!
//! A reader may refuse bytes, with a message; it may not panic, nor take for sound what it cannot read.

mod volume;

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use pollster::block_on;
use vastex_build::{
    BuildOptions, CropFormat, CropRegion, CropSource, ExportOptions, Layout, TiffSource, build, crop, export,
    open, open_reduced,
};
use vastex_tiles::{Container, MemoryStore, ReadError, TileSource, merge, verify};

use crate::seeds;
use crate::tree::Tree;

/// Texels of an image, bytes of a tile, and pages, beyond which an input is lawful but only slow.
const MAX_TEXELS: u64 = 1 << 20;
const MAX_ROW_BYTES: usize = 1 << 20;
const MAX_TILE_BYTES: usize = 1 << 20;
const MAX_PAGES: u64 = 1 << 12;

/// What a target's bytes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A file.
    File,
    /// A [`Tree`] of files.
    Tree,
}

/// Something that reads what others wrote.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// The target's name on the command line.
    pub name: &'static str,
    /// What the target's bytes are.
    pub form: Form,
    pub(crate) check: fn(&[u8]),
    pub(crate) seeds: fn() -> Result<Vec<Vec<u8>>>,
}

/// All targets.
pub const TARGETS: &[Target] = &[
    Target { name: "container", form: Form::File, check: container, seeds: seeds::containers },
    Target { name: "part", form: Form::Tree, check: parts, seeds: seeds::parts },
    Target { name: "image", form: Form::File, check: image, seeds: seeds::images },
    Target { name: "profile", form: Form::File, check: image, seeds: seeds::profiles },
    Target { name: "raw", form: Form::Tree, check: described, seeds: seeds::raws },
    Target { name: "mosaic", form: Form::Tree, check: described, seeds: seeds::mosaics },
    Target { name: "deep_zoom", form: Form::Tree, check: directory, seeds: seeds::deep_zoom },
    Target { name: "gaia_sky", form: Form::Tree, check: directory, seeds: seeds::gaia_sky },
    Target { name: "celestia", form: Form::Tree, check: directory, seeds: seeds::celestia },
    Target { name: "prototype", form: Form::Tree, check: directory, seeds: seeds::prototype },
    Target { name: "export", form: Form::File, check: exported, seeds: seeds::exports },
    Target { name: "volume", form: Form::Tree, check: volume::check, seeds: seeds::volumes },
];

impl Target {
    /// The target of that name.
    pub fn named(name: &str) -> Option<&'static Target> {
        TARGETS.iter().find(|target| target.name == name)
    }

    /// Reads the bytes; panics where the reader does, or where it takes for sound what is not.
    pub fn check(&self, bytes: &[u8]) {
        (self.check)(bytes);
    }

    /// Small sound inputs, the same every time.
    pub fn seeds(&self) -> Result<Vec<Vec<u8>>> {
        (self.seeds)()
    }

    /// The files of an input, by their names.
    pub fn files(&self, input: &[u8]) -> Vec<(String, Vec<u8>)> {
        match self.form {
            Form::File => vec![("the file".to_owned(), input.to_vec())],
            Form::Tree => Tree::decode(input).files,
        }
    }
}

/// Opens and verifies; then reads pages. What verify calls sound must read and decode.
fn container(bytes: &[u8]) {
    let store = Arc::new(MemoryStore::new("fuzz", bytes.to_vec()));
    let container = match block_on(Container::open(store.clone())) {
        Ok(container) => container,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            assert!(!is_sound(&store), "verify calls sound what does not open: {error}");
            return;
        }
    };
    let description = container.description().clone();
    if description.tile_bytes() > MAX_TILE_BYTES || description.geometry.page_count() > MAX_PAGES {
        return;
    }
    container.info();
    let sound = is_sound(&store);
    for pos in description.geometry.pages() {
        match block_on(container.read(pos)) {
            Ok(tile) => match tile.decode(&description) {
                Ok(texels) => assert_eq!(texels.len(), description.tile_bytes()),
                Err(error) => assert!(!sound, "verify calls sound what does not decode: {error}"),
            },
            Err(ReadError::NoSuchTile { .. }) => {}
            Err(error) => assert!(!sound, "verify calls sound what does not read: {error}"),
        }
    }
}

fn is_sound(store: &Arc<MemoryStore>) -> bool {
    block_on(verify(store.clone(), |_, _| {})).faults.is_empty()
}

/// Joins parts. What is joined must be sound, and what is refused leaves nothing behind.
fn parts(bytes: &[u8]) {
    let tree = Tree::decode(bytes);
    with_directory(&tree, |root, out| {
        let paths: Vec<_> = tree.files.iter().map(|(name, _)| root.join(name)).collect();
        let joined = merge(&paths, &out.join("out.vastex"), false, |_, total| match total > MAX_PAGES {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        });
        check_output(out, joined.map(drop).map_err(|error| error.to_string()), Deep::No);
    });
}

fn image(bytes: &[u8]) {
    let tree = Tree { files: vec![("image".to_owned(), bytes.to_vec())] };
    with_directory(&tree, |root, out| {
        build_at(&root.join("image"), out);
        read_reduced(&root.join("image"));
        if bytes.starts_with(b"II") || bytes.starts_with(b"MM") {
            read_in_place(&root.join("image"));
        }
    });
}

/// Reads an image at a share of its size, where there is one. Its rows may end with a message.
fn read_reduced(path: &Path) {
    let mut reader = match open_reduced(path, 2) {
        Ok(Some(reader)) => reader,
        Ok(None) => return,
        Err(fault) => return assert!(!fault.to_string().is_empty()),
    };
    let header = reader.header();
    let texels = u64::from(header.width) * u64::from(header.height);
    if texels > MAX_TEXELS || header.row_bytes() > MAX_ROW_BYTES {
        return;
    }
    let (mut row, rows) = (vec![0; header.row_bytes()], header.height);
    for _ in 0..rows {
        if let Err(fault) = reader.read_rows(&mut row) {
            return assert!(!fault.to_string().is_empty());
        }
    }
}

/// Reads a TIFF file where it lies, page by page, and as a region. What can be refused is refused with a
/// message.
fn read_in_place(path: &Path) {
    let mut source = match CropSource::open(path, 0) {
        Ok(source) => source,
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    let [width, height] = source.size();
    let texel = u64::from(source.channels()) * source.number().bytes() as u64;
    if u64::from(width) * u64::from(height) * texel > MAX_TEXELS {
        return;
    }
    let region = CropRegion { at: [0, 0], size: [width, height] };
    match crop(&mut source, region, CropFormat::Npy, &mut std::io::sink(), &()) {
        Ok(()) => {}
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    let tiles = match TiffSource::open(path) {
        Ok(tiles) => tiles,
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    let description = tiles.description().clone();
    if description.tile_bytes() > MAX_TILE_BYTES || description.geometry.page_count() > MAX_PAGES {
        return;
    }
    for pos in description.geometry.pages() {
        match block_on(tiles.read(pos)) {
            Ok(tile) => match tile.decode(&description) {
                Ok(texels) => assert_eq!(texels.len(), description.tile_bytes()),
                Err(error) => unreachable!("a page that was put together does not decode: {error}"),
            },
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}

/// Descriptions that one tree is built of.
const MAX_DESCRIPTIONS: usize = 2;

/// Builds what files in a directory describe: raw files by either name, mosaics.
fn described(bytes: &[u8]) {
    let tree = Tree::decode(bytes);
    with_directory(&tree, |root, out| {
        let describes = |name: &&String| [".raw", ".toml", ".txt"].iter().any(|end| name.ends_with(end));
        for name in tree.files.iter().map(|(name, _)| name).filter(describes).take(MAX_DESCRIPTIONS) {
            build_at(&root.join(name), out);
        }
    });
}

/// Builds the directory, and what describes it.
fn directory(bytes: &[u8]) {
    let tree = Tree::decode(bytes);
    with_directory(&tree, |root, out| {
        build_at(root, out);
        let describes = |name: &&String| name.ends_with(".dzi") || name.ends_with(".ctx");
        for name in tree.files.iter().map(|(name, _)| name).filter(describes).take(MAX_DESCRIPTIONS) {
            build_at(&root.join(name), out);
        }
    });
}

fn build_at(input: &Path, out: &Path) {
    match open(input) {
        Ok(reader) => {
            let header = reader.header();
            let texels = u64::from(header.width) * u64::from(header.height);
            if texels > MAX_TEXELS || header.row_bytes() > MAX_ROW_BYTES {
                return;
            }
        }
        Err(fault) => assert!(!fault.to_string().is_empty()),
    }
    let options =
        BuildOptions { page: 32, border: 2, threads: 1, memory_limit: 64 << 20, ..BuildOptions::default() };
    let built = build(&[input], &out.join("out.vastex"), &options, &());
    check_output(out, built.map(drop).map_err(|error| error.to_string()), Deep::Yes);
}

/// Exports every layer to every layout. What is written must read as the image that it is said to be.
fn exported(bytes: &[u8]) {
    const LAYOUTS: [(Layout, Option<u32>); 4] = [
        (Layout::GaiaSky, Some(16)),
        (Layout::Celestia, Some(64)),
        (Layout::DeepZoom, Some(16)),
        (Layout::Prototype, None),
    ];
    /// The grid of a planet holds twice as many texels as its longer side has, squared.
    const MAX_SIDE: u32 = 128;
    const MAX_LAYERS: usize = 2;
    let store = Arc::new(MemoryStore::new("fuzz", bytes.to_vec()));
    let Ok(container) = block_on(Container::open(store)) else { return };
    let description = container.description().clone();
    let is_slow = description.geometry.size().iter().any(|side| *side > MAX_SIDE)
        || description.tile_bytes() > MAX_TILE_BYTES
        || description.geometry.page_count() > MAX_PAGES;
    if is_slow {
        return;
    }
    for layer in description.layers.iter().take(MAX_LAYERS) {
        for (layout, tile_size) in LAYOUTS {
            let layer = Some(layer.name.clone());
            let options = ExportOptions { tile_size, layer, threads: 1, ..ExportOptions::new(layout) };
            with_directory(&Tree::default(), |_, out| export_to(out, &container, &options));
        }
    }
}

fn export_to(out: &Path, container: &Container, options: &ExportOptions) {
    let target = out.join("tiles");
    match export(container, &target, options, &()) {
        Ok(report) => {
            let read = read_all(&target);
            // Texels can be such that Gaia Sky's tiles look as if they had borders.
            let expected = if options.layout == Layout::GaiaSky { read.clone() } else { Ok(report.size) };
            assert!(read.is_ok() && read == expected, "{:?}: {read:?} {:?}", options.layout, report.size);
            let _ = fs::remove_dir_all(&target);
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    check_empty(out);
}

/// The size of the image, once all of its rows are read.
fn read_all(path: &Path) -> Result<[u32; 2], String> {
    let mut reader = open(path).map_err(|fault| fault.to_string())?;
    let size = [reader.header().width, reader.header().height];
    let mut row = vec![0; reader.header().row_bytes()];
    (0..size[1]).try_for_each(|_| reader.read_rows(&mut row)).map_err(|fault| fault.to_string())?;
    Ok(size)
}

/// Whether tiles must decode: those of a part come from others, who sealed them.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Deep {
    Yes,
    No,
}

/// What was made is sound; what was not made left nothing behind.
fn check_output(out: &Path, made: Result<(), String>, deep: Deep) {
    let path = out.join("out.vastex");
    match made {
        Ok(()) if deep == Deep::Yes => {
            let store = Arc::new(MemoryStore::new("out", fs::read(&path).unwrap_or_default()));
            assert_eq!(block_on(verify(store, |_, _| {})).faults, []);
        }
        Ok(()) => assert!(Container::open_file(&path).is_ok(), "what was joined does not open"),
        Err(message) => assert!(!message.is_empty()),
    }
    let _ = fs::remove_file(&path);
    check_empty(out);
}

fn check_empty(out: &Path) {
    let left = fs::read_dir(out).map_or(0, Iterator::count);
    assert_eq!(left, 0, "something was left behind");
}

/// Writes the tree and gives its directory and an empty one.
#[allow(
    clippy::panic,
    reason = "a target reports by panicking, and without a directory nothing would be tested"
)]
fn with_directory(tree: &Tree, work: impl FnOnce(&Path, &Path)) {
    let made = temporary().and_then(|root| Ok((root, temporary()?)));
    let (root, out) = made.unwrap_or_else(|error| panic!("no temporary directory: {error}"));
    tree.write(root.path());
    work(root.path(), out.path());
}

/// A directory in memory where the system has a place for that: thousands are made a second.
fn temporary() -> std::io::Result<tempfile::TempDir> {
    const MEMORY: &str = "/dev/shm";
    tempfile::tempdir_in(MEMORY).or_else(|_| tempfile::tempdir())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A seed that a reader refuses is no way into it: what is damaged must have been read before.
    #[test]
    fn every_seed_is_sound() {
        for target in TARGETS {
            for (n, seed) in target.seeds().unwrap().iter().enumerate() {
                let tree = match target.form {
                    Form::Tree => Tree::decode(seed),
                    Form::File => Tree { files: vec![("file".to_owned(), seed.clone())] },
                };
                with_directory(&tree, |root, out| {
                    let made = read_seed(target.name, &tree, root, &out.join("out.vastex"));
                    made.unwrap_or_else(|error| panic!("{} {n}: {error}", target.name));
                });
            }
        }
    }

    fn read_seed(target: &str, tree: &Tree, root: &Path, out: &Path) -> Result<()> {
        let names: Vec<&String> = tree.files.iter().map(|(name, _)| name).collect();
        match target {
            "container" | "export" => {
                let store = Arc::new(MemoryStore::new("seed", tree.files[0].1.clone()));
                assert!(is_sound(&store));
                block_on(Container::open(store))?;
            }
            "volume" => {
                const FILES: [&str; 7] = [".zip", ".nii", ".gz", ".hdr", ".raw", ".tif", ".vastex"];
                let is_file = |name: &&&String| FILES.iter().any(|end| name.ends_with(end));
                let path = names.iter().find(is_file).map_or(root.to_owned(), |name| root.join(name));
                match vastex_volume::open(&path)? {
                    vastex_volume::Opened::Volume(found) => volume::read(&found)?,
                    vastex_volume::Opened::Images(list) => {
                        let first = vastex_volume::open(&path.join(&list.images[0]))?;
                        assert!(matches!(first, vastex_volume::Opened::Volume(_)), "{:?}", list.images);
                    }
                }
            }
            "part" => {
                let paths: Vec<_> = names.iter().map(|name| root.join(name)).collect();
                merge(&paths, out, false, |_, _| ControlFlow::Continue(()))?;
            }
            _ => {
                let describes = |name: &&&String| {
                    [".dzi", ".ctx", ".txt", ".raw"].iter().any(|end| name.ends_with(end)) || **name == "file"
                };
                // The directory where nothing describes it, and the prototype's has its size beside it.
                let described = names.iter().find(describes).filter(|_| target != "prototype");
                let input = described.map_or(root.to_owned(), |name| root.join(name));
                build(&[input], out, &BuildOptions { threads: 1, ..BuildOptions::default() }, &())?;
            }
        }
        Ok(())
    }
}
