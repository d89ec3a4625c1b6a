//! Small files that claim much: refused when they are opened or before anything is allocated for them, with a
//! remedy that suits them; and what is known to cost much is told before it is done.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use exr::prelude::{Blocks, Compression, FlatSamples, Vec2, f16};
use png::{BitDepth, ColorType};
use vastex_build::{
    BuildError, BuildOptions, CropFormat, CropRegion, CropSource, Notice, Progress, build, crop, open,
};

use crate::common::exr::{encoding, exr_of};
use crate::common::files::HandmadeTiff;
use crate::common::{texels, write_png};

struct Sandbox(tempfile::TempDir);

impl Sandbox {
    fn new() -> Sandbox {
        Sandbox(tempfile::tempdir().unwrap())
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// What a build says that may take so many MiB and is refused.
    fn refused(&self, input: &str, mib: u64) -> String {
        let options = BuildOptions { memory_limit: mib << 20, ..BuildOptions::default() };
        let error = build(&[self.at(input)], &self.at("out.vastex"), &options, &()).unwrap_err();
        assert!(matches!(error, BuildError::Memory { .. }), "{error}");
        assert!(!self.at("out.vastex").exists());
        error.to_string()
    }

    /// A planet of tiles of `side` texels: the roots, and one tile of a level, which makes that the finest.
    fn lone_tile(&self, side: u32, level: u32) {
        let tile = |name: &str| {
            let path = self.at("planet").join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            let data = texels((side * side) as usize, 3);
            write_png(&path, [side; 2], ColorType::Grayscale, BitDepth::Eight, &data);
        };
        ["level0/tx_0_0.png", "level0/tx_1_0.png", &format!("level{level}/tx_3_1.png")]
            .iter()
            .for_each(|name| tile(name));
    }
}

/// A PNG that says how many rows it has, and whether they come in seven passes; it has none.
fn png_of(width: u32, height: u32, is_interlaced: bool) -> Vec<u8> {
    let mut file = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
    let says = [8, 2, 0, 0, u8::from(is_interlaced)];
    file.extend([&width.to_be_bytes()[..], &height.to_be_bytes(), &says].concat());
    let crc = crate::common::files::crc32(&file[12..]);
    file.extend(crc.to_be_bytes());
    file.extend(b"\0\0\0\x04IDAT\x78\x01\x01\0\0\0\0\0");
    file
}

/// An OpenEXR image of one channel in tiles.
fn exr_of_tiles(size: usize, tile: usize) -> Vec<u8> {
    let numbers = (0..size * size).map(|n| f16::from_f32(n as f32)).collect();
    let encoding = encoding(Compression::Uncompressed, Blocks::Tiles(Vec2(tile, tile)));
    exr_of([size; 2], encoding, vec![("Y", FlatSamples::F16(numbers))], false)
}

/// As many blocks as texels: which of them were read takes a bit each, and is counted.
#[test]
fn exr_of_a_block_for_each_texel_takes_what_it_says() {
    const SIZE: usize = 96;
    let sandbox = Sandbox::new();
    let path = sandbox.at("a.exr");
    let file = exr_of_tiles(SIZE, 1);
    std::fs::write(&path, &file).unwrap();
    let mut reader = open(&path).unwrap();
    let (image, block) = (2 * SIZE * SIZE, 2);
    assert_eq!(reader.header().memory as usize, image + 3 * block + SIZE * SIZE / 8);
    let mut rows = vec![0; image];
    reader.read_rows(&mut rows).unwrap();
    let numbers = rows.as_chunks::<2>().0.iter().map(|half| f16::from_le_bytes(*half).to_f32());
    assert!(numbers.eq((0..SIZE * SIZE).map(|n| f16::from_f32(n as f32).to_f32())));
}

#[test]
fn exr_that_has_a_block_twice_is_refused() {
    let sandbox = Sandbox::new();
    let (path, mut file) = (sandbox.at("a.exr"), exr_of_tiles(40, 16));
    // Column, row and level of the second tile, and its bytes.
    let second = [[1u32, 0, 0, 0].map(u32::to_le_bytes).concat(), 512u32.to_le_bytes().to_vec()].concat();
    let at = file.windows(second.len()).position(|bytes| bytes == second).unwrap();
    file[at] = 0;
    std::fs::write(&path, &file).unwrap();
    let mut reader = open(&path).unwrap();
    let mut rows = vec![0; reader.header().image_bytes() as usize];
    let fault = reader.read_rows(&mut rows).unwrap_err().to_string();
    assert!(fault.contains("a block is stored twice"), "{fault}");
}

/// A piece that must be held whole counts, however narrow it is.
#[test]
fn a_mosaic_counts_what_its_pieces_claim() {
    let sandbox = Sandbox::new();
    std::fs::write(sandbox.at("m.txt"), "vastex mosaic\n0 0 tall.png\n64 0 other.png\n").unwrap();
    write_png(&sandbox.at("other.png"), [64, 3], ColorType::Rgb, BitDepth::Eight, &texels(64 * 3 * 3, 1));
    std::fs::write(sandbox.at("tall.png"), png_of(64, 4_000_000, true)).unwrap();
    let error = sandbox.refused("m.txt", 300);
    assert!(error.contains("m.txt: needs") && error.contains("can be read by rows"), "{error}");
    // One that comes row by row may be as tall as it likes, and is found to have no rows.
    std::fs::write(sandbox.at("tall.png"), png_of(64, 4_000_000, false)).unwrap();
    let options = BuildOptions { memory_limit: 300 << 20, ..BuildOptions::default() };
    let error =
        build(&[sandbox.at("m.txt")], &sandbox.at("out.vastex"), &options, &()).unwrap_err().to_string();
    assert!(error.contains("tall.png") && error.contains("row 0 of 4000000"), "{error}");
}

#[test]
fn a_directory_of_tiles_that_are_too_large_is_told_what_helps() {
    let sandbox = Sandbox::new();
    sandbox.lone_tile(512, 5);
    let error = sandbox.refused("planet", 20);
    assert!(error.contains("make it anew with smaller tiles"), "{error}");
    assert!(!error.contains("TIFF"), "{error}");
}

/// Remembers what is said, and stops the build before the first row.
#[derive(Default)]
struct Listener(RefCell<Vec<(PathBuf, Notice)>>);

impl Progress for Listener {
    fn advance(&self, rows_done: u64, _: u64, bytes_written: u64) -> ControlFlow<()> {
        assert_eq!((rows_done, bytes_written), (0, 0));
        ControlFlow::Break(())
    }

    fn note(&self, image: &Path, notice: &Notice) {
        self.0.borrow_mut().push((image.into(), notice.clone()));
    }
}

/// One tile of a fine level makes a texture of that whole level: lawful, and seldom meant.
#[test]
fn what_a_lone_deep_tile_costs_is_told_before_the_work() {
    let sandbox = Sandbox::new();
    sandbox.lone_tile(16, 5);
    let (planet, listener) = (sandbox.at("planet"), Listener::default());
    let error =
        build(&[&planet], &sandbox.at("out.vastex"), &BuildOptions::default(), &listener).unwrap_err();
    assert!(matches!(error, BuildError::Cancelled), "{error}");
    let missing = Notice::TilesFromAncestors { missing: 64 * 32 - 1, of: 64 * 32 };
    assert!(missing.to_string().contains("2047 of the 2048 tiles"), "{missing}");
    assert_eq!(listener.0.into_inner(), [(planet, missing)]);
}

/// So many bytes of zeros as PackBits has them: 128 in two.
fn packed_zeros(bytes: usize) -> Vec<u8> {
    [0x81, 0].repeat(bytes / 128)
}

/// Bits in one tile are held whole, in whatever is allowed, be it more than 256 MiB; of one strip only rows.
#[test]
fn a_tile_of_bits_takes_what_it_says_and_is_refused_by_what_is_allowed() {
    let (size, row) = ([20_480u32, 16_000], 20_480 / 8);
    let sandbox = Sandbox::new();
    let path = sandbox.at("bits.tif");
    let write = |tiled: bool| {
        let mut file = HandmadeTiff::new(size, &[1], 0, size, tiled);
        file.set(259, 32773);
        file.chunks.push(packed_zeros(row * 16_000));
        std::fs::write(&path, file.bytes()).unwrap();
        file.chunks[0].len() as u64
    };
    write(false);
    let header = open(&path).unwrap().header().clone();
    assert!(header.memory < 1 << 20 && header.notices.is_empty(), "{header:?}");
    // What is cut out of it is decoded from the top down.
    let (region, mut cut) = (CropRegion { at: [7, 30], size: [3, 2] }, Vec::new());
    crop(&mut CropSource::open(&path, 0).unwrap(), region, CropFormat::Npy, &mut cut, &()).unwrap();
    assert_eq!(cut[128..], [0; 6]);
    let stored = write(true);
    let header = open(&path).unwrap().header().clone();
    // The rows that are given out, and the tile as it is stored, decompressed and unpacked.
    let texels = u64::from(size[0]) * u64::from(size[1]);
    assert_eq!(header.memory, texels + stored + texels / 8 + texels);
    let error = sandbox.refused("bits.tif", 512);
    assert!(error.contains("bits.tif: needs") && error.contains("limit of 512 MiB"), "{error}");
    assert!(error.contains("of small tiles") && error.contains("allow more memory"), "{error}");
    let said: u64 = error.split(' ').find_map(|word| word.parse().ok()).unwrap();
    let held = header.memory >> 20;
    assert!((held..held + 128).contains(&said), "{error}: it holds {held} MiB");
    // What is cut out is a tile, too, and there the remedy is another.
    let error = CropSource::open(&path, 0).err().unwrap().to_string();
    assert!(error.contains("bits.tif: holds tiles of 313 MiB each") && error.contains("keeps"), "{error}");
}
