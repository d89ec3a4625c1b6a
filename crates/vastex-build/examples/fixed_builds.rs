//! Hashes of what is made of fixed images with fixed options: containers built whole, in parts, after an
//! interruption, with insets and with a region replaced, and the exports of every layout. Whoever changes how
//! builds work compares them before and after.
//! `cargo run --release -p vastex-build --example fixed_builds [IMAGE ...]`; images that are named are built
//! too.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a comparison that is run by hand")]

use std::hash::Hasher;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use twox_hash::XxHash3_64;
use vastex_build::{
    BuildOptions, Compression, ExportOptions, Inset, LayerInput, Layout, PartOf, Progress, Quality,
    ReplaceOptions, TileFormat, build, export, merge, replace,
};
use vastex_core::{AddressMode, LayerFormat};
use vastex_tiles::Container;

/// Of the images that are built whole.
const SIZE: [usize; 2] = [1500, 1100];
/// Of those that are replaced in, exported, interrupted and the like.
const SMALL: [usize; 2] = [700, 500];
/// Of those that are put into them.
const PATCH: [usize; 2] = [190, 130];

fn main() {
    let dir = tempfile::tempdir().unwrap();
    let mut images: Vec<(String, PathBuf)> =
        [("u8", 1), ("u8", 2), ("u8", 3), ("u8", 4), ("u16", 1), ("u16", 3), ("f32", 1)]
            .map(|(sample, channels)| {
                (format!("{sample} x {channels}"), raw(dir.path(), SIZE, sample, channels))
            })
            .into();
    let size = |path: &PathBuf| std::fs::metadata(path).unwrap().len();
    images.extend(
        std::env::args().skip(1).map(PathBuf::from).map(|path| (format!("{} bytes", size(&path)), path)),
    );
    for (name, image) in &images {
        for (how, options) in options() {
            println!("{:016x} {name}, {how}", hash(dir.path(), &[LayerInput::from(image)], &options));
        }
    }
    let (grey, rgb, rgba) = (&images[0].1, &images[2].1, &images[3].1);
    for quality in [Quality::Fast, Quality::Normal] {
        let options = BuildOptions { quality, ..BuildOptions::default() };
        use LayerFormat::{Bc1Srgb, Bc3Srgb, Bc4, Bc6h, Bc7Srgb};
        for (format, image) in [(Bc1Srgb, rgb), (Bc3Srgb, rgba), (Bc4, grey), (Bc6h, rgb), (Bc7Srgb, rgba)] {
            let layer = LayerInput { format: Some(format), ..LayerInput::from(image) };
            println!("{:016x} {}, {quality:?}", hash(dir.path(), &[layer], &options), format.name());
        }
    }
    let layers = [("color", rgb), ("height", &images[4].1), ("mask", grey)];
    let layers = layers.map(|(name, image)| LayerInput { name: name.into(), ..LayerInput::from(image) });
    println!("{:016x} three layers", hash(dir.path(), &layers, &BuildOptions::default()));
    changed(dir.path());
    resampled(dir.path());
    in_pieces(dir.path());
    exported(dir.path());
}

/// Images put into containers, and insets.
fn changed(dir: &Path) {
    let output = dir.join("changed.vastex");
    let mask = raw(dir, [70, 50], "u8", 1);
    for (sample, channels, format) in [
        ("u8", 1, None),
        ("u8", 3, None),
        ("u16", 3, None),
        ("f32", 1, None),
        ("u8", 4, Some(LayerFormat::Bc3Srgb)),
        ("u8", 4, Some(LayerFormat::Bc7Srgb)),
        ("f32", 3, Some(LayerFormat::Bc6h)),
    ] {
        let name = format!("{sample} x {channels}, {}", format.map_or("as it is", LayerFormat::name));
        let ground = LayerInput { format, ..LayerInput::from(raw(dir, SMALL, sample, channels)) };
        let patch = raw(dir, PATCH, sample, channels);
        let whole = BuildOptions { page: 60, address: [AddressMode::Wrap; 2], ..BuildOptions::default() };
        let sparse = BuildOptions {
            mask: Some(mask.clone()),
            address: [AddressMode::Wrap; 2],
            ..BuildOptions::default()
        };
        for (how, options) in [("whole", whole.clone()), ("sparse", sparse)] {
            build(&[&ground].map(LayerInput::clone), &output, &options, &()).unwrap();
            replace(&output, [601, 33], &[&patch], &ReplaceOptions::default(), &()).unwrap();
            println!("{:016x} replaced in {name}, {how}", hash_of(&std::fs::read(&output).unwrap()));
        }
        let inset = |at, finer| Inset { layer: None, image: patch.clone(), at, finer };
        let insets = vec![inset([100, 40], 0), inset([901, 333], 2)];
        let options = BuildOptions { insets, ..whole };
        println!("{:016x} insets in {name}", hash(dir, &[ground], &options));
    }
}

/// Layers whose images do not fit one another.
fn resampled(dir: &Path) {
    let layer = |name: &str, size, sample, channels| LayerInput {
        name: name.into(),
        ..LayerInput::from(raw(dir, size, sample, channels))
    };
    for size in [[333, 250], [650, 480]] {
        let layers = [
            layer("color", SMALL, "u8", 4),
            layer("other", size, "u8", 4),
            layer("light", size, "u16", 3),
            layer("normal", size, "u8", 2),
            layer("labels", size, "u8", 1),
            layer("height", size, "f32", 1),
        ];
        println!("{:016x} layers of {size:?}", hash(dir, &layers, &BuildOptions::default()));
    }
}

/// Parts, what they are joined to, and a build that was interrupted.
fn in_pieces(dir: &Path) {
    struct StopAt(u64);
    impl Progress for StopAt {
        fn advance(&self, rows_done: u64, _: u64, _: u64) -> ControlFlow<()> {
            if rows_done >= self.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
    }
    for format in [LayerFormat::Rgba8Srgb, LayerFormat::Bc1Srgb] {
        let layer = LayerInput { format: Some(format), ..LayerInput::from(raw(dir, SMALL, "u8", 3)) };
        let options = BuildOptions { page: 60, resume: true, ..BuildOptions::default() };
        let parts: Vec<PathBuf> = (1..=3).map(|part| dir.join(format!("{part}.part"))).collect();
        for (part, path) in (1..).zip(&parts) {
            let options = BuildOptions { part: Some(PartOf { part, parts: 3 }), ..options.clone() };
            build(&[layer.clone()], path, &options, &()).unwrap();
            println!("{:016x} {}, part {part}", hash_of(&std::fs::read(path).unwrap()), format.name());
        }
        let joined = dir.join("joined.vastex");
        merge(&parts, &joined, false, |_, _| ControlFlow::Continue(())).unwrap();
        println!("{:016x} {}, joined", hash_of(&std::fs::read(&joined).unwrap()), format.name());
        let resumed = dir.join("resumed.vastex");
        assert!(build(&[layer.clone()], &resumed, &options, &StopAt(300)).is_err());
        build(&[layer], &resumed, &options, &()).unwrap();
        println!("{:016x} {}, resumed", hash_of(&std::fs::read(&resumed).unwrap()), format.name());
    }
}

/// Tile directories of every layout.
fn exported(dir: &Path) {
    let (container, target) = (dir.join("exported.vastex"), dir.join("exported"));
    for (sample, channels) in [("u8", 1), ("u8", 2), ("u8", 3), ("u8", 4), ("u16", 1), ("u16", 4)] {
        let image = raw(dir, SMALL, sample, channels);
        build(&[image], &container, &BuildOptions::default(), &()).unwrap();
        let container = Container::open_file(&container).unwrap();
        for layout in [Layout::GaiaSky, Layout::Celestia, Layout::DeepZoom, Layout::Prototype] {
            for format in [TileFormat::Png, TileFormat::Jpeg] {
                let options = ExportOptions { format: Some(format), ..ExportOptions::new(layout) };
                // Not every layout and image has every format.
                if export(&container, &target, &options, &()).is_ok() {
                    println!(
                        "{:016x} {sample} x {channels}, {layout:?}, {format:?}",
                        hash_of(&files_in(&target))
                    );
                    std::fs::remove_dir_all(&target).unwrap();
                }
            }
        }
    }
}

/// The names and bytes of all files in a directory, in the order of their names.
fn files_in(directory: &Path) -> Vec<u8> {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let of_path = |path: &PathBuf| match path.is_dir() {
        true => files_in(path),
        false => [path.file_name().unwrap().as_encoded_bytes(), &std::fs::read(path).unwrap()].concat(),
    };
    paths.iter().flat_map(of_path).collect()
}

fn options() -> Vec<(String, BuildOptions)> {
    let mut options = Vec::new();
    for (page, border) in [(128, 4), (256, 4), (60, 1)] {
        for compression in [Compression::None, Compression::Lz4, Compression::Zstd(3)] {
            let plain = BuildOptions { page, border, compression, ..BuildOptions::default() };
            options.push((format!("page {page}, {compression:?}"), plain));
        }
    }
    for mode in [AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border] {
        options.push((format!("{mode:?}"), BuildOptions { address: [mode; 2], ..BuildOptions::default() }));
    }
    for filter in ["box", "kaiser-linear", "gauss3", "majority", "box-linear@two", "box@zero"] {
        let filtered = BuildOptions { filter: Some(filter.parse().unwrap()), ..BuildOptions::default() };
        options.push((filter.into(), filtered));
    }
    options
}

/// Of the bytes of a container.
fn hash(dir: &Path, layers: &[LayerInput], options: &BuildOptions) -> u64 {
    let output = dir.join("fixed.vastex");
    let mut hashes = [1, 3].map(|threads| {
        build(layers, &output, &BuildOptions { threads, ..options.clone() }, &()).unwrap();
        hash_of(&std::fs::read(&output).unwrap())
    });
    hashes.sort_unstable();
    assert_eq!(hashes[0], hashes[1], "the bytes depend on the number of threads");
    hashes[0]
}

fn hash_of(bytes: &[u8]) -> u64 {
    let mut hasher = XxHash3_64::with_seed(0);
    hasher.write(bytes);
    hasher.finish()
}

/// A raw file: smooth in places, noise in others, some of it transparent.
fn raw(dir: &Path, [width, height]: [usize; 2], sample: &str, channels: usize) -> PathBuf {
    let name = format!("{sample}-{channels}-{width}.raw");
    let path = dir.join(&name);
    let mut state = 1u32;
    let value = |i: usize| {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        let (x, y, channel) = (i / channels % width, i / channels / width, i % channels);
        let smooth = (x as f32 / 90.0 + channel as f32).sin() * (y as f32 / 70.0).cos() * 0.5 + 0.5;
        let noise = (state >> 8) as f32 / (1 << 24) as f32;
        match (x / 300 + y / 200) % 3 {
            0 => smooth,
            1 => (smooth + noise) / 2.0,
            // Runs of one value, of which some are nothing at all.
            _ => ((x / 64 + y / 32) % 5) as f32 / 4.0,
        }
    };
    let bytes: Vec<u8> = (0..width * height * channels)
        .map(value)
        .flat_map(|v| match sample {
            "u8" => vec![(v * 255.0) as u8],
            "u16" => ((v * 65535.0) as u16).to_le_bytes().to_vec(),
            _ => (v * 3.0 - 1.0).to_le_bytes().to_vec(),
        })
        .collect();
    std::fs::write(&path, bytes).unwrap();
    let text = format!("width = {width}\nheight = {height}\nchannels = {channels}\nsample = \"{sample}\"\n");
    std::fs::write(dir.join(format!("{name}.toml")), text).unwrap();
    path
}
