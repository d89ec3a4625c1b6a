//! Hashes of containers that are built of fixed images with fixed options: whoever changes how fast builds are compares them
//! before and after. `cargo run --release -p vastex-build --example fixed_builds [IMAGE ...]`; images that are named are built too.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a comparison that is run by hand")]

use std::hash::Hasher;
use std::path::{Path, PathBuf};

use twox_hash::XxHash3_64;
use vastex_build::{BuildOptions, Compression, LayerInput, Quality, build};
use vastex_core::{AddressMode, LayerFormat};

/// Of the images that are made here.
const SIZE: [usize; 2] = [1500, 1100];

fn main() {
    let dir = tempfile::tempdir().unwrap();
    let mut images: Vec<(String, PathBuf)> =
        [("u8", 1), ("u8", 2), ("u8", 3), ("u8", 4), ("u16", 1), ("u16", 3), ("f32", 1)]
            .map(|(sample, channels)| (format!("{sample} x {channels}"), raw(dir.path(), sample, channels)))
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
        let mut hasher = XxHash3_64::with_seed(0);
        hasher.write(&std::fs::read(&output).unwrap());
        hasher.finish()
    });
    hashes.sort_unstable();
    assert_eq!(hashes[0], hashes[1], "the bytes depend on the number of threads");
    hashes[0]
}

/// A raw file: smooth in places, noise in others, some of it transparent.
fn raw(dir: &Path, sample: &str, channels: usize) -> PathBuf {
    let path = dir.join(format!("{sample}-{channels}.raw"));
    let [width, height] = SIZE;
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
    std::fs::write(dir.join(format!("{sample}-{channels}.raw.toml")), text).unwrap();
    path
}
