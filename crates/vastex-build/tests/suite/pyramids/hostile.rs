//! Pyramids that lie: whatever they claim, there is an error that says where, or pages that are refused;
//! never a panic, and never memory for what is not there.

use std::path::PathBuf;

use pollster::block_on;
use vastex_build::{CropSource, TiffSource};
use vastex_core::PagePos;
use vastex_tiles::TileSource;

use super::{fixture, whole};

struct File {
    directory: tempfile::TempDir,
}

impl File {
    fn with(bytes: &[u8]) -> File {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("a.tif"), bytes).unwrap();
        File { directory }
    }

    fn path(&self) -> PathBuf {
        self.directory.path().join("a.tif")
    }

    /// Why it does not open.
    fn refusal(&self) -> String {
        TiffSource::open(self.path()).err().unwrap().to_string()
    }
}

/// A little-endian classic file of these directories, each a list of tag, kind, count and value, and of what
/// follows.
fn handmade(directories: &[&[(u16, u16, u32, u32)]], next: &[u32], behind: &[u8]) -> Vec<u8> {
    let mut out = b"II\x2a\0\x08\0\0\0".to_vec();
    for (entries, next) in directories.iter().zip(next) {
        out.extend((entries.len() as u16).to_le_bytes());
        for (tag, kind, count, value) in *entries {
            out.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
            out.extend([count.to_le_bytes(), value.to_le_bytes()].concat());
        }
        out.extend(next.to_le_bytes());
    }
    out.extend(behind);
    out
}

/// A grey image of one tile of 16x16 texels, stored at `offset`.
fn grey(compression: u32, offset: u32, len: u32) -> Vec<(u16, u16, u32, u32)> {
    vec![
        (256, 4, 1, 16),
        (257, 4, 1, 16),
        (258, 3, 1, 8),
        (259, 3, 1, compression),
        (262, 3, 1, 1),
        (277, 3, 1, 1),
        (322, 4, 1, 16),
        (323, 4, 1, 16),
        (324, 4, 1, offset),
        (325, 4, 1, len),
    ]
}

/// Thousands of directories, chained and listed below the first one, take as many reads as the first two
/// thousand.
#[test]
fn thousands_of_directories_are_looked_at_as_far_as_is_reasonable() {
    const MANY: u32 = 20_000;
    let entries = grey(1, 0, 0);
    let size = 2 + 12 * (entries.len() as u32 + 1) + 4;
    let at = |n: u32| 8 + n * size;
    let list = at(2 * MANY + 1);
    let first = with(entries.clone(), (330, 4, MANY, list));
    let plain = with(entries, (254, 4, 1, 0));
    let mut directories: Vec<&[(u16, u16, u32, u32)]> = vec![&first];
    directories.extend((0..2 * MANY).map(|_| &plain[..]));
    // The first half is the chain, the second half lies below the first one.
    let next: Vec<u32> = (0..=2 * MANY).map(|n| if n < MANY { at(n + 1) } else { 0 }).collect();
    let below: Vec<u8> = (0..MANY).flat_map(|n| at(MANY + 1 + n).to_le_bytes()).collect();
    let file = File::with(&handmade(&directories, &next, &below));
    let source = TiffSource::open(file.path()).unwrap();
    assert!((1000..=2100).contains(&source.others().len()), "{}", source.others().len());
    let mut tiers = vastex_tiles::Tiers::default();
    source.add_tiers(&mut tiers);
    assert!(tiers.store.reads < 60_000, "{} reads", tiers.store.reads);
}

/// Where what follows one directory of so many entries lies.
fn behind(entries: usize) -> u32 {
    (8 + 2 + 12 * entries + 4) as u32
}

fn with(mut entries: Vec<(u16, u16, u32, u32)>, changed: (u16, u16, u32, u32)) -> Vec<(u16, u16, u32, u32)> {
    entries.retain(|entry| entry.0 != changed.0);
    entries.push(changed);
    entries
}

#[test]
fn a_sound_one_opens() {
    let texels: Vec<u8> = (0..=255).collect();
    let file = File::with(&handmade(&[&grey(1, behind(10), 256)], &[0], &texels));
    assert_eq!(whole(CropSource::open(&file.path(), 0).unwrap()), texels);
    assert!(TiffSource::open(file.path()).is_ok());
}

#[test]
fn directories_that_lead_in_circles_are_refused() {
    let file = File::with(&handmade(&[&grey(1, behind(10), 256)], &[8], &[0; 256]));
    assert!(file.refusal().contains("leads back"), "{}", file.refusal());
    let sub = with(grey(1, behind(11), 256), (330, 4, 1, 8));
    let file = File::with(&handmade(&[&sub], &[0], &[0; 256]));
    assert_eq!(TiffSource::open(file.path()).unwrap().levels().len(), 1);
}

#[test]
fn what_a_directory_claims_is_compared_with_the_file() {
    let base = || grey(1, behind(10), 256);
    for (changed, word) in [
        ((256, 4, 1, u32::MAX), "lists 1 strips or tiles"),
        ((256, 4, 1, 0), "0x16"),
        ((258, 3, 0x4000_0000, 8), "values"),
        ((277, 4, 1, 60_000), "60000 samples"),
        ((322, 4, 1, 0), "no texels"),
        ((259, 3, 1, 34925), "LZMA"),
        ((259, 3, 1, 50001), "WebP"),
        ((339, 3, 1, 5), "complex"),
        ((262, 3, 1, 3), "palette"),
        ((274, 3, 1, 6), "turned"),
        ((324, 2, 1, 8), "whole numbers"),
        ((324, 4, 0, 8), "lists 0"),
        ((258, 3, 1, 12), "12 bits"),
        ((266, 3, 1, 2), "lowest bit"),
        ((330, 4, 2, 0xffff_ff00), "ends"),
    ] {
        let entries = with(base(), changed);
        let file = File::with(&handmade(&[&entries], &[0], &[0; 512]));
        let said = match TiffSource::open(file.path()) {
            Err(error) => error.to_string(),
            Ok(source) => {
                block_on(source.read(source.description().geometry.tail_pos())).unwrap_err().to_string()
            }
        };
        assert!(said.contains(word) && said.contains("a.tif"), "{changed:?}: {said}");
    }
    for (start, word) in [
        (&b"II\x2a\0\xff\xff\xff\xff"[..], "ends"),
        (b"II\x2a\0\x08\0\0\0\xff\xff", "entries"),
        (b"II\x2b\0\x04\0\0\0\x10\0\0\0\0\0\0\0", "8 bytes"),
        (b"II\x2b\0\x08\0\0\0\x10\0\0\0\0\0\0\0\xff\xff\xff\xff\xff\xff\xff\xff", "entries"),
        (b"MM\0\x2a", "byte 0"),
    ] {
        let file = File::with(start);
        assert!(file.refusal().contains(word), "{start:?}: {}", file.refusal());
    }
}

/// Sides whose product no 64 bits hold, and tiles that would fill the memory.
#[test]
fn tiles_that_no_memory_holds_are_refused() {
    let huge = with(with(grey(1, behind(10), 256), (322, 4, 1, u32::MAX)), (323, 4, 1, u32::MAX));
    let file = File::with(&handmade(&[&huge], &[0], &[0; 256]));
    assert!(file.refusal().contains("vastex build"), "{}", file.refusal());
    let large = with(with(grey(8, behind(10), 256), (322, 4, 1, 8192)), (323, 4, 1, 8192));
    let large = with(with(large, (256, 4, 1, 8192)), (257, 4, 1, 8192));
    let file = File::with(&handmade(&[&large], &[0], &[0; 256]));
    assert!(file.refusal().contains("cannot hold 67108864"), "{}", file.refusal());
}

/// Something that compresses.
type Encode = fn(&[u8]) -> Vec<u8>;

fn deflated(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn lzw(bytes: &[u8]) -> Vec<u8> {
    weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8).encode(bytes).unwrap()
}

fn zstandard(bytes: &[u8]) -> Vec<u8> {
    zstd::stream::encode_all(bytes, 3).unwrap()
}

/// As runs of one byte each.
fn packbits(bytes: &[u8]) -> Vec<u8> {
    bytes.iter().flat_map(|byte| [0, *byte]).collect()
}

#[test]
fn a_tile_decodes_to_exactly_what_it_must_have() {
    let texels: Vec<u8> = (0..300).map(|n| (n * 7) as u8).collect();
    let codecs: [(u32, Encode); 4] = [(8, deflated), (5, lzw), (50_000, zstandard), (32_773, packbits)];
    for (compression, encode) in codecs {
        for (count, word) in [(256, None), (255, Some("255 bytes of 256")), (257, Some("more than its 256"))]
        {
            let bytes = encode(&texels[..count]);
            let entries = grey(compression, behind(10), bytes.len() as u32);
            let file = File::with(&handmade(&[&entries], &[0], &bytes));
            let Some(word) = word else {
                assert_eq!(whole(CropSource::open(&file.path(), 0).unwrap()), texels[..256]);
                continue;
            };
            let said = file.refusal();
            assert!(said.contains(word) && said.contains("tile 0"), "{compression}: {said}");
        }
        // Cut off, and of another codec.
        let bytes = encode(&texels[..256]);
        for wrong in [&bytes[..bytes.len() / 2], &[0xff; 64][..]] {
            let entries = grey(compression, behind(10), wrong.len() as u32);
            let file = File::with(&handmade(&[&entries], &[0], wrong));
            assert!(file.refusal().contains("tile 0"), "{compression}: {}", file.refusal());
        }
    }
}

#[test]
fn a_tile_beyond_the_end_of_the_file_is_an_error_of_its_pages() {
    let whole = std::fs::read(fixture("cog-deflate-u16.tif")).unwrap();
    let sound = TiffSource::open(fixture("cog-deflate-u16.tif")).unwrap();
    // GDAL writes the finest level last.
    let file = File::with(&whole[..whole.len() - 600]);
    let source = TiffSource::open(file.path()).unwrap();
    let mut refused = 0;
    for pos in source.description().geometry.pages() {
        match block_on(source.read(pos)) {
            Ok(tile) => assert!(tile.bytes == block_on(sound.read(pos)).unwrap().bytes, "{pos}"),
            Err(error) => {
                refused += 1;
                assert!(error.to_string().contains("again"), "{error}");
            }
        }
    }
    assert!(refused > 0);
    assert!(block_on(source.read(PagePos::new_2d(0, 9, 9))).is_err());
}

/// JPEG and JPEG 2000 streams of another size, of other channels, cut off or damaged: in four places at once,
/// a quarter of the file apart, and so in different tiles, each of which is decoded by itself.
#[test]
fn streams_that_are_not_what_their_directory_says_are_refused() {
    for name in ["cog-jpeg.tif", "slide-jpeg.svs", "slide-jpeg2000.svs", "vips-subifd-jpeg.tif"] {
        let whole = std::fs::read(fixture(name)).unwrap();
        let (mut refused, quarter) = (0, whole.len() / 4);
        for at in (0..quarter).step_by(61) {
            let mut bytes = whole.clone();
            bytes.chunks_exact_mut(quarter).for_each(|part| part[at] = part[at].wrapping_add(0x55));
            let file = File::with(&bytes);
            let Ok(source) = TiffSource::open(file.path()) else { continue };
            if source.description().geometry.page_count() > 64 {
                continue;
            }
            for pos in source.description().geometry.pages() {
                refused += usize::from(block_on(source.read(pos)).is_err());
            }
        }
        assert!(refused > 5, "{name}: {refused}");
    }
}
