//! TIFF files of strips at a share of their size: each texel is one of the image, and few strips are decoded.

use std::fs::File;
use std::path::Path;

use tiff::encoder::{Compression, DeflateLevel, TiffEncoder, colortype};
use vastex_build::{CropFormat, CropRegion, CropSource, crop, open_reduced};

use crate::common::files::HandmadeTiff;
use crate::common::sandbox::Sandbox;
use crate::common::texels;

const SIZE: [u32; 2] = [1500, 1200];

/// Values that say which row and column they are of, modulo 256 each.
fn write(path: &Path, rows: u32, compression: Compression) {
    let texels: Vec<u8> = (0..SIZE[1])
        .flat_map(|y| (0..SIZE[0]).flat_map(move |x| [x as u8, y as u8, (x / 256 * 16 + y / 256) as u8]))
        .collect();
    let mut encoder = TiffEncoder::new(File::create(path).unwrap()).unwrap().with_compression(compression);
    let mut image = encoder.new_image::<colortype::RGB8>(SIZE[0], SIZE[1]).unwrap();
    image.rows_per_strip(rows).unwrap();
    image.write_data(&texels).unwrap();
}

/// The column and the row of the image that a texel is of.
fn place([x, y, high]: [u8; 3]) -> [u32; 2] {
    [u32::from(high / 16) * 256 + u32::from(x), u32::from(high % 16) * 256 + u32::from(y)]
}

#[test]
fn strips_are_read_at_a_share_of_their_size() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    let deflate = Compression::Deflate(DeflateLevel::Balanced);
    // Rows a strip, and how far a row may be from where it is shown: not at all where it is read by itself.
    for (rows, compression, off) in [
        (16, Compression::Uncompressed, 0),
        (SIZE[1], Compression::Uncompressed, 0),
        (1, deflate, 0),
        (4, deflate, 0),
        (8, Compression::Lzw, 8),
        (16, deflate, 16),
    ] {
        write(&path, rows, compression);
        let mut reader = open_reduced(&path, 150).unwrap().unwrap();
        let header = reader.header().clone();
        assert_eq!([header.width, header.height], SIZE.map(|side| side.div_ceil(10)));
        let mut texels = vec![0; header.image_bytes() as usize];
        // In parts, as previews are read.
        for rows in texels.chunks_mut(7 * header.row_bytes()) {
            reader.read_rows(rows).unwrap();
        }
        for (n, texel) in (0..).zip(texels.as_chunks::<3>().0) {
            let [x, y] = place(*texel);
            let [column, row] = [n % header.width, n / header.width].map(|at| at * 10 + 5);
            assert_eq!(x, column, "{rows} rows a strip");
            assert!(y.abs_diff(row) <= off, "{rows} rows a strip: row {y} for {row}");
        }
    }
}

#[test]
fn plain_samples_that_must_be_converted_are_read_where_they_lie() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    let at = |column: u32, row: u32| (row * 4 + column / 16) as u16 + 300;
    let size = [800, 600];
    let texels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| at(x, y)));
    // Of one strip, whose highest bytes come first.
    let mut file = HandmadeTiff { big_endian: true, ..HandmadeTiff::new(size, &[16], 1, size, false) };
    file.chunks = vec![texels.flat_map(u16::to_be_bytes).collect()];
    std::fs::write(&path, file.bytes()).unwrap();
    let mut reader = open_reduced(&path, 100).unwrap().unwrap();
    let header = reader.header().clone();
    assert_eq!([header.width, header.height], [100, 75]);
    let mut rows = vec![0; header.image_bytes() as usize];
    reader.read_rows(&mut rows).unwrap();
    for (n, texel) in (0..).zip(rows.as_chunks::<2>().0) {
        assert_eq!(u16::from_le_bytes(*texel), at(n % 100 * 8 + 4, n / 100 * 8 + 4), "texel {n}");
    }
}

/// Inks, numbers of a palette, bits and bands: each texel is one of the image.
#[test]
fn strips_that_are_converted_are_read_at_a_share_of_their_size() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    let size = [400u32, 331];
    for (bits, photometric, bands) in
        [(vec![8; 4], 5, ""), (vec![8], 3, ""), (vec![1], 1, ""), (vec![8; 5], 1, ":bands=5,2,1")]
    {
        let row = (size[0] * bits[0] * bits.len() as u32).div_ceil(8);
        let data = texels((row * size[1]) as usize, 31);
        // One strip where it lies, and many of which a row is decoded.
        for (rows, compression) in [(size[1], 1), (5, 1), (1, 32773)] {
            let mut file = HandmadeTiff::new(size, &bits, photometric, [size[0], rows], false);
            file.set(259, compression);
            if photometric == 3 {
                file.tags.push((320, (0..3 << 8).map(|n| n * 37 % 256 * 257).collect()));
            }
            file.cut([row, size[1]], 1, [row, rows], &data);
            if compression != 1 {
                // Runs of bytes as they are.
                let literal = |run: &[u8]| [&[run.len() as u8 - 1], run].concat();
                file.chunks.iter_mut().for_each(|c| *c = c.chunks(128).flat_map(literal).collect());
            }
            std::fs::write(&path, file.bytes()).unwrap();
            let named = std::path::PathBuf::from(format!("{}{bands}", path.display()));
            let all = |mut reader: Box<dyn vastex_build::RowReader>| {
                let mut rows = vec![0; reader.header().image_bytes() as usize];
                rows.chunks_mut(3 * reader.header().row_bytes())
                    .for_each(|some| reader.read_rows(some).unwrap());
                (reader.header().clone(), rows)
            };
            let (whole, expected) = all(vastex_build::open(&named).unwrap());
            let (header, found) = all(open_reduced(&named, 100).unwrap().unwrap());
            assert_eq!(([header.width, header.height], header.format), ([100, 83], whole.format));
            let texel = whole.format.texel_bytes();
            for (n, found) in found.chunks_exact(texel).enumerate() {
                let [x, y] = [n % 100 * 4 + 2, (n / 100 * 4 + 2).min(330)];
                let expected = &expected[(y * 400 + x) * texel..][..texel];
                assert_eq!(found, expected, "{photometric} {rows} {compression}: texel {n}");
            }
        }
    }
}

#[test]
fn a_file_that_is_as_quickly_read_whole_has_no_share() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    for (rows, compression, side) in [
        // One strip, and strips that are too few, compressed; and an image that is not much larger.
        (SIZE[1], Compression::Lzw, 150),
        (100, Compression::Lzw, 150),
        (4, Compression::Uncompressed, 1000),
    ] {
        write(&path, rows, compression);
        assert!(open_reduced(&path, side).unwrap().is_none(), "{rows} rows a strip");
    }
    // What is damaged is an error where it is read, not before.
    write(&path, 4, Compression::Lzw);
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let opened = open_reduced(&path, 150);
    if let Ok(Some(mut reader)) = opened {
        let mut rows = vec![0; reader.header().image_bytes() as usize];
        assert!(reader.read_rows(&mut rows).is_err());
    }
}

/// A file of tiles of 16x16 texels, whose values say which column and row they are of.
fn tiles(size: [u32; 2]) -> HandmadeTiff {
    let texels: Vec<u8> = (0..size[1])
        .flat_map(|y| (0..size[0]).flat_map(move |x| [x as u8, y as u8, (x / 256 * 16 + y / 256) as u8]))
        .collect();
    let mut file = HandmadeTiff::new(size, &[8, 8, 8], 2, [16; 2], true);
    file.cut(size, 3, [16; 2], &texels);
    file
}

#[test]
fn tiles_are_read_at_a_share_of_their_size() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    // How far a texel may be from where it is shown: all tiles of a small file are decoded, and of one of
    // 1102 tiles every second column and row.
    for (size, off) in [([333, 250], 0), ([600, 450], 16)] {
        std::fs::write(&path, tiles(size).bytes()).unwrap();
        let mut reader = open_reduced(&path, 100).unwrap().unwrap();
        let header = reader.header().clone();
        let step = size[0] / 100;
        assert_eq!([header.width, header.height], size.map(|side: u32| side.div_ceil(step)));
        let mut texels = vec![0; header.image_bytes() as usize];
        for rows in texels.chunks_mut(7 * header.row_bytes()) {
            reader.read_rows(rows).unwrap();
        }
        let mut is_exact = 0;
        for (n, texel) in (0..).zip(texels.as_chunks::<3>().0) {
            let shown = [n % header.width, n / header.width];
            let wanted = [0, 1].map(|axis| (shown[axis] * step + step / 2).min(size[axis] - 1));
            let there = place(*texel);
            for axis in [0, 1] {
                assert!(there[axis].abs_diff(wanted[axis]) <= off, "{size:?}: {there:?} for {wanted:?}");
            }
            is_exact += usize::from(there == wanted);
        }
        let share = texels.len() / 3 / if off == 0 { 1 } else { 5 };
        assert!(is_exact >= share, "{is_exact} of {}", texels.len() / 3);
    }
    // Tiles of which too few can be decoded, and an image that is not much larger.
    let mut large = HandmadeTiff::new([20_000, 9000], &[8, 8, 8], 2, [16_384, 8192], true);
    large.chunks = vec![Vec::new(); 4];
    std::fs::write(&path, large.bytes()).unwrap();
    assert!(open_reduced(&path, 100).unwrap().is_none());
    std::fs::write(&path, tiles([150, 100]).bytes()).unwrap();
    assert!(open_reduced(&path, 100).unwrap().is_none());
    // What is damaged is an error where it is read, not before.
    let mut damaged = tiles([333, 250]);
    damaged.set(259, 8);
    std::fs::write(&path, damaged.bytes()).unwrap();
    let mut reader = open_reduced(&path, 100).unwrap().unwrap();
    let mut rows = vec![0; reader.header().row_bytes()];
    assert!(reader.read_rows(&mut rows).is_err());
}

/// Bands that a path names have a share, too.
#[test]
fn bands_of_tiles_are_read_at_a_share_of_their_size() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    let (size, bands) = ([320, 256], 5);
    let texels: Vec<u8> =
        (0..size[0] * size[1] * bands).map(|n| (n % bands * 40 + n / bands % 40) as u8).collect();
    let mut file = HandmadeTiff::new(size, &[8; 5], 1, [64; 2], true);
    file.cut(size, 5, [64; 2], &texels);
    std::fs::write(&path, file.bytes()).unwrap();
    let named = format!("{}:bands=4", path.display());
    let mut reader = open_reduced(named.as_ref(), 80).unwrap().unwrap();
    let header = reader.header().clone();
    assert_eq!([header.width, header.height], [80, 64]);
    let mut rows = vec![0; header.image_bytes() as usize];
    reader.read_rows(&mut rows).unwrap();
    for (n, value) in (0..).zip(rows) {
        let texel = (n / 80 * 4 + 2) * 320 + n % 80 * 4 + 2;
        assert_eq!(u32::from(value), 3 * 40 + texel % 40, "texel {n}");
    }
}

/// A file of some bytes that claims rows of gigabytes has no share, and nobody makes room for a row of it.
#[test]
fn rows_of_gigabytes_have_no_share() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    for (photometric, compression) in [(1, 1), (2, 1), (1, 32773), (2, 32773)] {
        let mut file = HandmadeTiff::new([u32::MAX, 4], &[64; 3], photometric, [u32::MAX, 4], false);
        file.set(339, 3);
        file.set(259, compression);
        file.chunks = vec![vec![0; 900]];
        std::fs::write(&path, file.bytes()).unwrap();
        // Whether it is opened at all is another question.
        let reduced = open_reduced(&path, 512);
        assert!(!matches!(reduced, Ok(Some(_))), "{photometric} {compression}");
        // Nor is a texel cut out of a strip that has no room.
        let region = CropRegion { at: [5, 1], size: [1, 1] };
        let cut = CropSource::open(&path, 0)
            .and_then(|mut source| crop(&mut source, region, CropFormat::Npy, &mut Vec::new(), &()));
        let error = cut.unwrap_err().to_string();
        assert!(error.contains("image.tif: holds strips of") && error.contains("at once"), "{error}");
    }
}
