//! Files that are no images, broken images and impossible options: a message that helps, and nothing left
//! behind.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

use crate::common::files::{HandmadeTiff, jpeg, smooth};
use crate::common::{texels, write_png};
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::RGB8;
use vastex_build::{BuildError, BuildOptions, Progress, build};

const SIZE: [u32; 2] = [300, 200];

/// Builds `name` in a directory of its own; says the error, which names the file, and that nothing else is
/// there.
#[track_caller]
fn error_of(name: &str, bytes: &[u8], options: &BuildOptions) -> String {
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join(name);
    std::fs::write(&input, bytes).unwrap();
    error_in(dir.path(), &input, options)
}

#[track_caller]
fn error_in(dir: &Path, input: &Path, options: &BuildOptions) -> String {
    let error = build(&[input], &dir.join("out.vastex"), options, &()).unwrap_err().to_string();
    let mut left: Vec<_> = std::fs::read_dir(dir).unwrap().map(|e| e.unwrap().path()).collect();
    left.retain(|path| path != input);
    assert!(left.is_empty(), "left behind: {left:?}");
    error
}

fn good_jpeg() -> Vec<u8> {
    jpeg(SIZE, 3, false, &smooth(SIZE, 3))
}

fn good_png() -> Vec<u8> {
    let file = tempfile::NamedTempFile::new().unwrap();
    let data = texels((SIZE[0] * SIZE[1] * 3) as usize, 3);
    write_png(file.path(), SIZE, png::ColorType::Rgb, png::BitDepth::Eight, &data);
    std::fs::read(file.path()).unwrap()
}

fn tiff(size: [u32; 2], compression: u32) -> HandmadeTiff {
    let mut file = HandmadeTiff::new(size, &[8, 8, 8], 2, [size[0], 16], false);
    file.set(259, compression);
    file
}

fn good_tiff() -> Vec<u8> {
    let mut file = tiff(SIZE, 1);
    file.cut(SIZE, 3, [SIZE[0], 16], &texels((SIZE[0] * SIZE[1] * 3) as usize, 3));
    file.bytes()
}

/// A PNG whose header says any size.
fn png_of(width: u32, height: u32) -> Vec<u8> {
    let mut file = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
    file.extend([&width.to_be_bytes()[..], &height.to_be_bytes(), &[8, 2, 0, 0, 0]].concat());
    let crc = !file[12..].iter().fold(!0u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ c >> 1 } else { c >> 1 })
    });
    file.extend(crc.to_be_bytes());
    file.extend(b"\0\0\0\x04IDAT\x78\x01\x01\0\0\0\0\0");
    file
}

#[test]
fn files_that_are_no_images() {
    let default = BuildOptions::default();
    for (name, bytes, says) in [
        ("empty.png", &b""[..], "empty.png: is empty"),
        ("notes.jpg", b"Dear reader,\nthis is no picture.\n", "notes.jpg: is a text file"),
        ("a.tif", b"\x00\x01\x02\x03\x04", "no known image format (it begins with 00 01 02 03 04)"),
        ("b.png", b"\x89PNG\r\n\x1a\n", "truncated"),
        ("c.jpg", b"\xff\xd8\xff", "truncated"),
        ("d.jpg", b"\xff\xd8\xff\xd9", "damaged"),
        ("e.tif", b"II\x2a\0\xff\xff\xff\x7f", "e.tif: is"),
    ] {
        let error = error_of(name, bytes, &default);
        assert!(error.contains(says) && error.contains(name), "{error}");
    }
    let dir = tempfile::tempdir().unwrap();
    let error = error_in(dir.path(), &dir.path().join("missing.png"), &default);
    assert!(error.contains("missing.png: there is no such file"), "{error}");
    std::fs::create_dir(dir.path().join("images")).unwrap();
    let error = error_in(dir.path(), &dir.path().join("images"), &default);
    assert!(error.contains("images: no tile layout recognised in this directory"), "{error}");
}

#[test]
fn truncated_images_name_the_row() {
    for (name, bytes) in [("a.jpg", good_jpeg()), ("a.png", good_png())] {
        for share in [0.3, 0.6, 0.9] {
            let cut = (bytes.len() as f64 * share) as usize;
            let error = error_of(name, &bytes[..cut], &BuildOptions::default());
            assert!(
                error.contains("truncated") && error.contains("near row") && error.contains("of 200"),
                "{error}"
            );
        }
        let error = error_of(name, &bytes[..bytes.len() - 1], &BuildOptions::default());
        assert!(error.contains("truncated"), "{error}");
    }
    // A TIFF's directory may stand before its strips: here one strip lies beyond the end.
    let mut file = tiff(SIZE, 1);
    file.cut(SIZE, 3, [SIZE[0], 16], &texels((SIZE[0] * SIZE[1] * 3) as usize, 3));
    let mut bytes = file.bytes();
    let strip_5 = (8 + 5 * SIZE[0] * 16 * 3).to_le_bytes();
    let at = bytes.windows(4).rposition(|w| w == strip_5).unwrap();
    bytes[at..at + 4].copy_from_slice(&0x7000_0000u32.to_le_bytes());
    let error = error_of("a.tif", &bytes, &BuildOptions::default());
    assert!(error.contains("truncated: it ends near row 80 of 200"), "{error}");
}

/// The decoder finds out after the header, deep in its own code, and unwinds from there: again and again, in
/// many threads.
#[test]
fn jpeg_that_names_no_table() {
    let mut bytes = good_jpeg();
    let scan = bytes.windows(2).position(|w| w == [0xff, 0xda]).unwrap();
    // The tables of the scan's first component: none of these numbers was defined.
    bytes[scan + 6] = 0x33;
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..25 {
                    let error = error_of("a.jpg", &bytes, &BuildOptions::default());
                    assert!(error.contains("a.jpg: is damaged near row 0 of 200"), "{error}");
                }
            });
        }
    });
}

#[test]
fn progressive_jpeg_truncated() {
    let bytes = jpeg(SIZE, 3, true, &smooth(SIZE, 3));
    let error = error_of("p.jpg", &bytes[..bytes.len() / 2], &BuildOptions::default());
    assert!(error.contains("p.jpg: is truncated"), "{error}");
}

#[test]
fn images_of_no_or_of_absurd_size() {
    let default = BuildOptions::default();
    let mut no_rows = good_jpeg();
    let sof = no_rows.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    no_rows[sof + 5..sof + 9].fill(0);
    let huge = |rows| {
        let mut file = tiff([1 << 20, 1 << 20], 5);
        file.set(278, rows);
        file.chunks = vec![vec![0; 16]; ((1 << 20) / rows) as usize];
        file.bytes()
    };
    for (name, bytes, says) in [
        ("a.jpg", no_rows, "0x0 texels"),
        ("b.png", png_of(0, 7), "0x7 texels"),
        ("c.png", png_of(1 << 30, 4), "c.png: "),
        ("d.png", png_of(50_000_000, 5_000), "MiB of memory, more than the limit"),
        ("e.tif", huge(1 << 20), "has 16 bytes, which cannot hold 3298534883328"),
    ] {
        let error = error_of(name, &bytes, &default);
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn impossible_options_and_outputs() {
    let with = |page, border| BuildOptions { page, border, ..Default::default() };
    for (options, says) in [
        (with(0, 4), "a page of 0 texels"),
        (with(100_000, 4), "a page of 100000 texels"),
        (with(128, 0), "a border of 0 texels"),
        (with(16, 9), "a border of 9 texels"),
        (BuildOptions { memory_limit: 1 << 20, ..Default::default() }, "more than the limit of 1 MiB"),
    ] {
        let error = error_of("a.png", &good_png(), &options);
        assert!(error.contains(says), "{error}");
    }
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("a.tif");
    std::fs::write(&input, good_tiff()).unwrap();
    let build_to = |output: &Path| build(&[&input], output, &BuildOptions::default(), &()).unwrap_err();
    assert!(matches!(build_to(&input), BuildError::SameFile(_)));
    assert_eq!(std::fs::read(&input).unwrap(), good_tiff());
    for output in [dir.path().to_path_buf(), dir.path().join("missing/out.vastex")] {
        let error = build_to(&output).to_string();
        assert!(error.contains(output.to_str().unwrap()) && error.contains("cannot be written"), "{error}");
    }
    let build_all =
        |inputs: &[PathBuf]| build(inputs, &dir.path().join("o"), &BuildOptions::default(), &()).unwrap_err();
    assert!(matches!(build_all(&[]), BuildError::NoInput));
    assert!(build_all(&[input.clone(), input.clone()]).to_string().contains("two layers are called"));
}

#[test]
fn kinds_that_cannot_be_read_say_what_to_do() {
    let mut float = tiff(SIZE, 1);
    float.set(339, 3);
    let mut planar = tiff(SIZE, 7);
    planar.set(284, 2);
    let mut exotic = tiff(SIZE, 34_925);
    exotic.cut(SIZE, 3, [SIZE[0], 16], &[0; 300 * 200 * 3]);
    float.cut(SIZE, 3, [SIZE[0], 16], &[0; 300 * 200 * 3]);
    planar.chunks = vec![vec![0; 300 * 16]; 3 * 13];
    for (file, says) in [(float, "floats of 8 bits"), (planar, "separate planes"), (exotic, "not known")] {
        let error = error_of("a.tif", &file.bytes(), &BuildOptions::default());
        assert!(error.contains(says) && error.contains("convert it"), "{error}");
    }
}

/// Files with a few bytes changed end in a container or in an error; never in a panic, never in much memory.
#[test]
fn altered_files_never_panic() {
    let mut lzw = std::io::Cursor::new(Vec::new());
    let data = texels((SIZE[0] * SIZE[1] * 3) as usize, 5);
    let mut encoder = TiffEncoder::new(&mut lzw).unwrap().with_compression(tiff::encoder::Compression::Lzw);
    let mut image = encoder.new_image::<RGB8>(SIZE[0], SIZE[1]).unwrap();
    image.rows_per_strip(16).unwrap();
    image.write_data(&data).unwrap();
    let mut tiles = HandmadeTiff::new(SIZE, &[8, 8, 8], 2, [64, 32], true);
    tiles.cut(SIZE, 3, [64, 32], &data);
    let mut jpeg_tiles = HandmadeTiff::new(SIZE, &[8, 8, 8], 6, [64, 32], true);
    jpeg_tiles.set(259, 7);
    jpeg_tiles.chunks = tiles.chunks.iter().map(|tile| jpeg([64, 32], 3, false, tile)).collect();
    let progressive = jpeg(SIZE, 3, true, &smooth(SIZE, 3));
    let files = [
        good_jpeg(),
        progressive,
        good_png(),
        good_tiff(),
        lzw.into_inner(),
        tiles.bytes(),
        jpeg_tiles.bytes(),
    ];
    let options = BuildOptions { memory_limit: 64 << 20, ..Default::default() };
    let dir = tempfile::tempdir().unwrap();
    let (input, output) = (dir.path().join("in"), dir.path().join("out.vastex"));
    let mut state = 1u32;
    let mut random = |below: usize| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize % below
    };
    for (number, file) in files.iter().enumerate() {
        for round in 0..50 {
            let mut altered = file.clone();
            for _ in 0..1 + random(3) {
                // Headers and directories are at the ends, and there most of what decides.
                let at = match random(3) {
                    0 => random(600.min(file.len())),
                    1 => file.len() - 1 - random(600.min(file.len())),
                    _ => random(file.len()),
                };
                altered[at] = random(256) as u8;
            }
            std::fs::write(&input, &altered).unwrap();
            let built = catch_unwind(|| build(&[&input], &output, &options, &()).is_ok());
            let built = built.unwrap_or_else(|_| panic!("file {number}, round {round}"));
            assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1 + usize::from(built));
            if built {
                std::fs::remove_file(&output).unwrap();
            }
        }
    }
}

/// Cancels when so many rows are done.
struct CancelAt(u64, Cell<u64>);

impl Progress for CancelAt {
    fn advance(&self, rows_done: u64, rows_total: u64, _: u64) -> ControlFlow<()> {
        assert!(rows_total == 5000 && rows_done >= self.1.get());
        self.1.set(rows_done);
        if rows_done >= self.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn a_cancelled_build_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let (input, output) = (dir.path().join("a.png"), dir.path().join("out.vastex"));
    write_png(&input, [500, 5000], png::ColorType::Grayscale, png::BitDepth::Eight, &texels(500 * 5000, 3));
    for rows in [0, 2000, 5000] {
        let error = build(&[&input], &output, &BuildOptions::default(), &CancelAt(rows, Cell::new(0)));
        assert!(matches!(error, Err(BuildError::Cancelled)), "{rows}");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
