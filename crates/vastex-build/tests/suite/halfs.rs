//! What is said of numbers that floats of 16 bits cannot hold: by builds, replacements, where the levels of a
//! pyramid are kept, and where it is read in place.

use std::sync::{Arc, Mutex};

use vastex_build::{BuildOptions, LayerInput, Notice, ReplaceOptions, TiffSource, build, replace};
use vastex_core::LayerFormat;
use vastex_tiles::TileSource as _;

use crate::common::files::HandmadeTiff;
use crate::common::sandbox::Sandbox;
use crate::common::texels;

const SIZE: [u32; 2] = [64, 32];
const HALF: LayerFormat = LayerFormat::Rgba16Float;

/// A raw image of floats of 32 bits: so many channels, each the number of the texel as `value` has it.
fn raw(sandbox: &Sandbox, name: &str, channels: usize, value: impl Fn(usize) -> f32) -> std::path::PathBuf {
    let [width, height] = SIZE;
    let texels = (width * height) as usize;
    let bytes: Vec<u8> = (0..texels * channels).flat_map(|n| value(n / channels).to_le_bytes()).collect();
    let about = format!(
        "width = {width}\nheight = {height}\nsample = \"f32\"\nchannels = {channels}\nlinear = true\n"
    );
    std::fs::write(sandbox.path(&format!("{name}.toml")), about).unwrap();
    std::fs::write(sandbox.path(name), bytes).unwrap();
    sandbox.path(name)
}

/// The notices of numbers that a build lost.
fn lost(sandbox: &Sandbox, input: impl Into<LayerInput>, options: &BuildOptions) -> Vec<Notice> {
    let input: LayerInput = input.into();
    let report = build(&[input], &sandbox.path("out.vastex"), options, &()).unwrap();
    of_halfs(report.layers[0].notices.clone())
}

fn of_halfs(notices: Vec<Notice>) -> Vec<Notice> {
    let is = |notice: &Notice| matches!(notice, Notice::HalfsRounded(_) | Notice::HalfsInfinite(_));
    notices.into_iter().filter(is).collect()
}

#[test]
fn what_halfs_cannot_hold_is_said() {
    let (sandbox, options) = (Sandbox::new(), BuildOptions::default());
    let rgb = |name: &str, value: fn(usize) -> f32| raw(&sandbox, name, 3, value);
    let (rounded, infinite) = (Notice::HalfsRounded(HALF), Notice::HalfsInfinite(HALF));
    for (name, value, expected) in [
        ("exact.raw", (|n| n as f32) as fn(usize) -> f32, vec![]),
        ("largest.raw", |n| if n == 7 { 65504.0 } else { 0.5 }, vec![]),
        ("third.raw", |n| if n == 2000 { 1.0 / 3.0 } else { 0.5 }, vec![rounded.clone()]),
        ("nearly.raw", |n| if n == 9 { -65519.0 } else { 0.5 }, vec![rounded.clone()]),
        ("infinite.raw", |n| if n == 9 { -65520.0 } else { 0.5 }, vec![infinite.clone()]),
        ("both.raw", |n| if n == 9 { 1e6 } else { 0.1 }, vec![infinite.clone(), rounded.clone()]),
        ("none.raw", |n| if n == 9 { f32::NAN } else { f32::INFINITY }, vec![]),
    ] {
        assert_eq!(lost(&sandbox, rgb(name, value).as_path(), &options), expected, "{name}");
    }
    // One channel is kept as it is, unless halves are asked for; blocks are near what they are made of.
    let grey = raw(&sandbox, "grey.raw", 1, |n| n as f32 + 1e6);
    assert_eq!(lost(&sandbox, grey.as_path(), &options), []);
    let half = LayerInput { format: Some(LayerFormat::R16Float), ..grey.as_path().into() };
    assert_eq!(lost(&sandbox, half, &options), [Notice::HalfsInfinite(LayerFormat::R16Float)]);
    let said = [infinite, rounded].map(|notice| notice.to_string());
    assert!(said[0].contains("65504") && said[0].contains("rgba16f") && said[0].contains("r32f"), "{said:?}");
    assert!(said[1].contains("2048") && said[1].contains("rgba16f") && said[1].contains("r32f"), "{said:?}");
}

#[cfg(feature = "bc")]
#[test]
fn of_blocks_only_infinite_numbers_are_said() {
    let sandbox = Sandbox::new();
    let as_blocks = |name: &str, value: fn(usize) -> f32| {
        let path = raw(&sandbox, name, 3, value);
        let input = LayerInput { format: Some(LayerFormat::Bc6h), ..path.as_path().into() };
        lost(&sandbox, input, &BuildOptions::default())
    };
    assert_eq!(as_blocks("third.raw", |_| 1.0 / 3.0), []);
    assert_eq!(as_blocks("large.raw", |_| 1e6), [Notice::HalfsInfinite(LayerFormat::Bc6h)]);
}

#[test]
fn what_replacements_lose_is_said() {
    let sandbox = Sandbox::new();
    let under = raw(&sandbox, "under.raw", 3, |_| 0.5);
    assert_eq!(lost(&sandbox, under.as_path(), &BuildOptions::default()), []);
    let over = raw(&sandbox, "over.raw", 3, |n| if n == 1000 { 1e9 } else { 0.5 });
    let (file, options) = (sandbox.path("out.vastex"), ReplaceOptions::default());
    let replaced = replace(&file, [0, 0], &[over.as_path()], &options, &()).unwrap();
    let notices = replaced.notices.into_iter().map(|(_, notice)| notice).collect();
    assert_eq!(of_halfs(notices), [Notice::HalfsInfinite(HALF)]);
}

/// A TIFF of three channels of 16 or 32 bits; the kind is TIFF's, 2 for signed whole numbers and 3 for
/// floats.
fn tiff(size: [u32; 2], bits: u32, kind: u32, data: &[u8]) -> Vec<u8> {
    let chunk = [16, 16];
    let mut file = HandmadeTiff::new(size, &[bits; 3], 2, chunk, true);
    file.tags.push((339, vec![kind; 3]));
    if size != SIZE {
        file.set(254, 1);
    }
    file.cut(size, 3 * bits as usize / 8, chunk, data);
    file.bytes()
}

#[test]
fn colours_of_signed_numbers_are_said_to_be_rounded() {
    let sandbox = Sandbox::new();
    let count = (SIZE[0] * SIZE[1] * 3) as usize;
    let path = sandbox.path("signed.tif");
    std::fs::write(&path, tiff(SIZE, 16, 2, &texels(2 * count, 47))).unwrap();
    let notices = lost(&sandbox, path.as_path(), &BuildOptions::default());
    assert_eq!(notices, [Notice::HalfsRounded(HALF)]);
    // What stands for no data is no number that is lost.
    let depths: Vec<u8> =
        (0..count).flat_map(|n| (if n < 30 { -1e30 } else { 0.5_f32 }).to_le_bytes()).collect();
    std::fs::write(&path, with_nodata(&depths, "-1e30")).unwrap();
    assert_eq!(lost(&sandbox, path.as_path(), &BuildOptions::default()), []);
    std::fs::write(&path, with_nodata(&depths, "-2e30")).unwrap();
    let notices = lost(&sandbox, path.as_path(), &BuildOptions::default());
    assert_eq!(notices, [Notice::HalfsInfinite(HALF)]);
}

/// A TIFF of floats in which texels of a value are without data.
fn with_nodata(data: &[u8], value: &str) -> Vec<u8> {
    let mut bytes = tiff(SIZE, 32, 3, data);
    let text = [value.as_bytes(), b"\0"].concat();
    let directory = u32_at(&bytes, 4) as usize;
    let count = u16::from_le_bytes([bytes[directory], bytes[directory + 1]]);
    // The directory moves behind the text, and gets an entry more, of the largest number.
    let at = bytes.len() as u32;
    let entries = bytes[directory + 2..directory + 2 + 12 * usize::from(count)].to_vec();
    bytes.extend(&text);
    let moved = (bytes.len() as u32).to_le_bytes();
    bytes[4..8].copy_from_slice(&moved);
    bytes.extend((count + 1).to_le_bytes());
    bytes.extend(entries);
    bytes.extend([42113_u16.to_le_bytes(), 2_u16.to_le_bytes()].concat());
    bytes.extend([(text.len() as u32).to_le_bytes(), at.to_le_bytes()].concat());
    bytes.extend([0; 4]);
    bytes
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(*bytes[at..].first_chunk().unwrap())
}

/// Puts the image of another file of TIFF behind that of the first.
fn with_second(mut first: Vec<u8>, mut second: Vec<u8>) -> Vec<u8> {
    let shift = first.len() as u32;
    let directory = u32_at(&second, 4) as usize;
    let count = u16::from_le_bytes([second[directory], second[directory + 1]]);
    let move_at = |bytes: &mut Vec<u8>, at: usize| {
        let moved = u32_at(bytes, at) + shift;
        bytes[at..at + 4].copy_from_slice(&moved.to_le_bytes());
    };
    for entry in (0..usize::from(count)).map(|n| directory + 2 + 12 * n) {
        let tag = u16::from_le_bytes([second[entry], second[entry + 1]]);
        let side = if second[entry + 2] == 3 { 2 } else { 4 };
        let values = u32_at(&second, entry + 4) as usize;
        let is_inline = values * side <= 4;
        if tag == 324 {
            let begin = if is_inline { entry + 8 } else { u32_at(&second, entry + 8) as usize };
            (0..values).for_each(|n| move_at(&mut second, begin + 4 * n));
        }
        if !is_inline {
            move_at(&mut second, entry + 8);
        }
    }
    // Where the next directory is stands behind the entries of the first.
    let next = first.len() - 4;
    first[next..].copy_from_slice(&(directory as u32 + shift).to_le_bytes());
    first.extend(second);
    first
}

#[test]
fn what_kept_levels_lose_is_said() {
    let sandbox = Sandbox::new();
    let floats = |[width, height]: [u32; 2], value: f32| -> Vec<u8> {
        (0..width * height * 3).flat_map(|n| (if n == 99 { value } else { 0.5 }).to_le_bytes()).collect()
    };
    let half = SIZE.map(|side| side / 2);
    let options = BuildOptions { keep_levels: true, ..BuildOptions::default() };
    for (values, expected) in [
        ([0.5, 0.5], vec![]),
        ([1e6, 0.5], vec![Notice::HalfsInfinite(HALF)]),
        ([0.5, 0.1], vec![Notice::HalfsRounded(HALF)]),
    ] {
        let levels =
            [tiff(SIZE, 32, 3, &floats(SIZE, values[0])), tiff(half, 32, 3, &floats(half, values[1]))];
        let [first, second] = levels;
        let path = sandbox.path("pyramid.tif");
        std::fs::write(&path, with_second(first, second)).unwrap();
        assert_eq!(lost(&sandbox, path.as_path(), &options), expected, "{values:?}");
    }
}

/// At opening only the coarsest level is read.
#[test]
fn what_a_pyramid_loses_where_it_lies_is_told_once_it_is_read() {
    let sandbox = Sandbox::new();
    let floats = |[width, height]: [u32; 2], value: f32| -> Vec<u8> {
        (0..width * height * 3).flat_map(|n| (if n == 99 { value } else { 0.5 }).to_le_bytes()).collect()
    };
    let half = SIZE.map(|side| side / 2);
    let path = sandbox.path("pyramid.tif");
    let (first, second) = (floats(SIZE, 1e6), floats(half, 0.1));
    std::fs::write(&path, with_second(tiff(SIZE, 32, 3, &first), tiff(half, 32, 3, &second))).unwrap();
    let source = TiffSource::open(&path).unwrap();
    let told = Arc::new(Mutex::new(Vec::new()));
    let listener = told.clone();
    source.tell_losses(move |notice| listener.lock().unwrap().push(notice));
    let (rounded, infinite) = (Notice::HalfsRounded(HALF), Notice::HalfsInfinite(HALF));
    assert_eq!(*told.lock().unwrap(), std::slice::from_ref(&rounded));
    for _ in 0..2 {
        for page in source.description().geometry.pages() {
            pollster::block_on(source.read(page)).unwrap();
        }
        assert_eq!(*told.lock().unwrap(), [rounded.clone(), infinite.clone()]);
    }
}
