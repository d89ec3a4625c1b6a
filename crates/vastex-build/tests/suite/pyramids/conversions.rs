//! Samples that are no colours yet: numbers of a palette, of 1, 2 and 4 bits, and inks. What is shown where
//! the file lies is what its rows and a build of it have.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use mozjpeg::{ColorSpace, Compress};
use vastex_build::{
    BuildOptions, Converted, Notice, PixelFormat, Sample, TiffDirectories, TiffSource, build,
    open as open_rows,
};
use vastex_core::LayerFormat;
use vastex_tiles::{Container, TileSource};

use super::{fixture, open, shown, stored};
use crate::common::files::{HandmadeTiff, smooth};
use crate::common::texels;

const SIZE: [u32; 2] = [75, 51];
const TEXELS: usize = (SIZE[0] * SIZE[1]) as usize;

/// The rows of a file, and what is said of it.
fn rows(path: &Path) -> (PixelFormat, Vec<u8>, Vec<Notice>) {
    let mut reader = open_rows(path).unwrap();
    let header = reader.header().clone();
    let mut rows = vec![0; header.row_bytes() * header.height as usize];
    reader.read_rows(&mut rows).unwrap();
    (header.format, rows, reader.header().notices.clone())
}

/// Three channels with an alpha that hides nothing, as layers of colours have.
fn opaque(rgb: &[u8]) -> Vec<u8> {
    rgb.chunks(3).flat_map(|texel| texel.iter().copied().chain([255])).collect()
}

/// Says that a file's rows are `expected`, and that a build and the file as it lies show the same.
fn check(file: &[u8], format: PixelFormat, expected: &[u8], notices: &[Notice], what: &str) {
    let directory = tempfile::tempdir().unwrap();
    let (path, output) = (directory.path().join("a.tif"), directory.path().join("a.vastex"));
    std::fs::write(&path, file).unwrap();
    let (found, rows, said) = rows(&path);
    assert_eq!((found, &*said), (format, notices), "{what}");
    assert!(rows == expected, "rows of {what}");
    let source = open(&path);
    assert_eq!(source.notices(), notices, "{what}");
    // Colours of 16 bits become light.
    if format.sample() == Sample::U16 {
        return;
    }
    build(&[&path], &output, &BuildOptions::default(), &()).unwrap();
    let built = Arc::new(Container::open_file(&output).unwrap());
    let texels = if format.channels() == 3 { opaque(expected) } else { rows };
    assert!(shown(source, 0) == (SIZE, texels.clone()), "{what} as it lies");
    assert!(shown(built, 0).1 == texels, "a build of {what}");
}

/// Samples of few bits, one behind the other in a byte, rows from a byte on.
fn packed(samples: &[u8], bits: usize) -> Vec<u8> {
    let in_byte = 8 / bits;
    let byte = |some: &[u8]| {
        some.iter().enumerate().fold(0, |byte, (n, sample)| byte | sample << (8 - bits - n % in_byte * bits))
    };
    samples.chunks(SIZE[0] as usize).flat_map(|row| row.chunks(in_byte).map(byte)).collect()
}

/// A file of samples of so many bits in strips or tiles.
fn of_bits(samples: &[u8], bits: usize, photometric: u32, tiled: bool) -> HandmadeTiff {
    let chunk = if tiled { [32, 16] } else { [SIZE[0], 7] };
    let mut file = HandmadeTiff::new(SIZE, &[bits as u32], photometric, chunk, tiled);
    let bytes = |columns: u32| (columns as usize * bits).div_ceil(8) as u32;
    file.cut([bytes(SIZE[0]), SIZE[1]], 1, [bytes(chunk[0]), chunk[1]], &packed(samples, bits));
    file
}

#[test]
fn samples_of_few_bits_are_grey() {
    for bits in [1, 2, 4] {
        let most = (1u8 << bits) - 1;
        let samples: Vec<u8> = texels(TEXELS, 5).iter().map(|sample| sample & most).collect();
        for (photometric, tiled) in [(1, false), (1, true), (0, true), (4, true)] {
            let file = of_bits(&samples, bits, photometric, tiled);
            let grey = |sample: &u8| sample * (255 / most);
            let expected: Vec<u8> = match photometric {
                0 => samples.iter().map(|sample| 255 - grey(sample)).collect(),
                _ => samples.iter().map(grey).collect(),
            };
            let what = format!("{bits} bits of photometric interpretation {photometric}");
            check(&file.bytes(), PixelFormat::GREY8, &expected, &[], &what);
        }
        // One strip, which is read in parts, and cut out as it is stored.
        let mut file = HandmadeTiff::new(SIZE, &[bits as u32], 1, SIZE, false);
        file.chunks.push(packed(&samples, bits));
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.tif");
        std::fs::write(&path, file.bytes()).unwrap();
        assert!(stored(&path, 0) == samples);
    }
}

#[test]
fn numbers_of_a_palette_are_its_colours() {
    for (bits, tiled, of_8_bits) in [(1, true, false), (4, false, false), (8, true, false), (8, false, true)]
    {
        let count = 1usize << bits;
        let samples: Vec<u8> = texels(TEXELS, 6).iter().map(|sample| sample & (count - 1) as u8).collect();
        let colors: Vec<u8> = (0..3 * count).map(|n| (n * 37 + 11) as u8).collect();
        let mut file = of_bits(&samples, bits, 3, tiled);
        let entry = |color: &u8| if of_8_bits { u32::from(*color) } else { u32::from(*color) << 8 | 0x5a };
        file.tags.push((320, colors.iter().map(entry).collect()));
        let color = |sample: &u8| [0, 1, 2].map(|channel| colors[channel * count + usize::from(*sample)]);
        let expected: Vec<u8> = samples.iter().flat_map(color).collect();
        let what = format!("a palette of {count} colours");
        check(&file.bytes(), PixelFormat::RGB8, &expected, &[], &what);
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.tif");
        std::fs::write(&path, file.bytes()).unwrap();
        assert!(stored(&path, 0) == samples, "{what} is cut out as it is stored");
        // The numbers themselves.
        let band = directory.path().join("a.tif:bands=1");
        assert!(shown(open(&band), 0).1 == stored(&band, 0), "{what}");
        // One that ends too early is told of.
        file.tags.pop();
        file.tags.push((320, vec![0; 3 * count - 1]));
        std::fs::write(&path, file.bytes()).unwrap();
        let fault = TiffSource::open(&path).err().unwrap().to_string();
        assert!(fault.contains(&format!("has {} numbers of {}", 3 * count - 1, 3 * count)), "{fault}");
    }
}

#[test]
fn inks_become_red_green_and_blue() {
    let inks = [Notice::InksConverted];
    let left = |ink: u32, black: u32, most: u32| ((most - ink) * (most - black) + most / 2) / most;
    for (planar, with_alpha) in [(1, false), (2, false), (1, true)] {
        let samples = if with_alpha { 5 } else { 4 };
        let data = texels(TEXELS * samples, 8);
        let mut file = HandmadeTiff::new(SIZE, &vec![8; samples], 5, [32, 16], true);
        file.profile = Some(b"a profile of inks".to_vec());
        file.set(284, planar);
        if with_alpha {
            file.set(338, 2);
        }
        match planar {
            1 => file.cut(SIZE, samples, [32, 16], &data),
            _ => (0..samples).for_each(|plane| {
                let plane: Vec<u8> = data.iter().skip(plane).step_by(samples).copied().collect();
                file.cut(SIZE, 1, [32, 16], &plane);
            }),
        }
        let color = |texel: &[u8]| {
            let rgb = [0, 1, 2].map(|ink| left(texel[ink].into(), texel[3].into(), 255) as u8);
            [&rgb[..], &texel[4..]].concat()
        };
        let expected: Vec<u8> = data.chunks(samples).flat_map(color).collect();
        let format = if with_alpha { PixelFormat::RGBA8 } else { PixelFormat::RGB8 };
        check(&file.bytes(), format, &expected, &inks, &format!("{samples} samples, planar {planar}"));
        file.set(332, 2);
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.tif");
        std::fs::write(&path, file.bytes()).unwrap();
        let fault = TiffSource::open(&path).err().unwrap().to_string();
        assert!(fault.contains("inks other than cyan"), "{fault}");
    }
    let data = texels(TEXELS * 8, 9);
    let mut file = HandmadeTiff::new(SIZE, &[16; 4], 5, [SIZE[0], 7], false);
    file.cut(SIZE, 8, [SIZE[0], 7], &data);
    let expected = data.as_chunks().0.iter().flat_map(|[c, d, m, n, y, z, k, l]: &[u8; 8]| {
        let black = u16::from_le_bytes([*k, *l]).into();
        let ink = |bytes| left(u32::from(u16::from_le_bytes(bytes)), black, 65_535) as u16;
        [[*c, *d], [*m, *n], [*y, *z]].map(ink).map(u16::to_le_bytes)
    });
    let expected = expected.flatten().collect::<Vec<u8>>();
    check(&file.bytes(), PixelFormat::RGB8.with_sample(Sample::U16), &expected, &inks, "16 bits");
}

/// A JPEG of four inks, as libjpeg stores the numbers that it gets: beside a marker of Adobe's.
fn jpeg_of_inks(inks: &[u8]) -> Vec<u8> {
    let mut compress = Compress::new(ColorSpace::JCS_CMYK);
    compress.set_size(SIZE[0] as usize, SIZE[1] as usize);
    compress.set_quality(98.0);
    compress.set_fastest_defaults();
    compress.set_optimize_scans(false);
    let mut started = compress.start_compress(Vec::new()).unwrap();
    started.write_scanlines(inks).unwrap();
    started.finish().unwrap()
}

#[test]
fn a_jpeg_of_inks_is_read_with_those_of_adobe_inverted() {
    let inks = smooth(SIZE, 4);
    let file = jpeg_of_inks(&inks);
    let marker = file.windows(9).position(|bytes| bytes == b"\xff\xee\0\x0eAdobe").unwrap();
    let without = [&file[..marker], &file[marker + 16..]].concat();
    let directory = tempfile::tempdir().unwrap();
    for (file, is_inverted) in [(&file, true), (&without, false)] {
        let path = directory.path().join("a.jpg");
        std::fs::write(&path, file).unwrap();
        let (format, rows, said) = rows(&path);
        assert_eq!((format, &*said), (PixelFormat::RGB8, &[Notice::InksConverted][..]));
        let color = |texel: &[u8; 4]| {
            let ink = |n: usize| i32::from(if is_inverted { 255 - texel[n] } else { texel[n] });
            [0, 1, 2].map(|n| (255 - ink(n)) * (255 - ink(3)) / 255)
        };
        let expected: Vec<i32> = inks.as_chunks().0.iter().flat_map(color).collect();
        let worst = rows.iter().zip(&expected).map(|(found, one)| (i32::from(*found) - one).abs()).max();
        assert!(worst.unwrap() <= 6, "{worst:?}");
        // A small picture of it.
        let mut small = vastex_build::open_reduced(&path, 16).unwrap().unwrap();
        let header = small.header().clone();
        let mut rows = vec![0; header.row_bytes() * header.height as usize];
        small.read_rows(&mut rows).unwrap();
        let mean = |values: &[i32]| values.iter().sum::<i32>() / values.len() as i32;
        let small: Vec<i32> = rows.iter().map(|value| i32::from(*value)).collect();
        assert!((mean(&small) - mean(&expected)).abs() <= 4);
    }
}

/// The samples of a PNG of `assets/tiff`.
fn png_of(name: &str) -> Vec<u8> {
    let file = File::open(fixture(name)).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut samples = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut samples).unwrap();
    samples
}

/// What GDAL reads of classes and of the palette that it wrote.
#[test]
fn land_cover_of_gdal_has_its_colours() {
    let expected = png_of("cog-palette.png");
    assert!(expected.chunks(3).collect::<std::collections::BTreeSet<_>>().len() > 5);
    let source = open(&fixture("cog-palette.tif"));
    assert_eq!(source.description().layers[0].format, LayerFormat::Rgba8Srgb);
    assert!(shown(source, 0).1 == opaque(&expected));
}

/// What GDAL reads of a scan that it compressed as fax does.
#[test]
fn a_scan_is_what_its_writer_reads_of_it() {
    let expected = png_of("scan-fax4.png");
    assert!(expected.contains(&0) && expected.contains(&255));
    assert!(shown(open(&fixture("scan-fax4.tif")), 0).1 == expected);
}

/// What is converted is said by rows and by the file where it lies, and nothing else is.
#[test]
fn what_samples_were_converted_from_is_said() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.tif");
    use Converted::{Doubles, FewBits, Inks, Integers, Premultiplied, WhiteIsZero};
    const ASSOCIATED: Option<u32> = Some(1);
    const UNASSOCIATED: Option<u32> = Some(2);
    for (bits, photometric, kind, extra, expected) in [
        (&[1][..], 1, 1, None, &[FewBits(1)][..]),
        (&[4], 0, 1, None, &[FewBits(4), WhiteIsZero]),
        (&[8], 0, 1, None, &[WhiteIsZero]),
        (&[16], 0, 1, None, &[WhiteIsZero]),
        (&[8; 4], 5, 1, None, &[Inks]),
        (&[8; 4], 2, 1, ASSOCIATED, &[Premultiplied]),
        (&[16; 2], 1, 1, ASSOCIATED, &[Premultiplied]),
        (&[8; 4], 2, 1, UNASSOCIATED, &[]),
        (&[32], 1, 2, None, &[Integers]),
        (&[64], 1, 3, None, &[Doubles]),
        (&[8; 3], 2, 1, None, &[]),
        (&[16], 1, 1, None, &[]),
        (&[16], 1, 2, None, &[]),
        (&[32], 1, 3, None, &[]),
    ] {
        for tiled in [true, false] {
            let mut file = HandmadeTiff::new([16, 16], bits, photometric, [16, 16], tiled);
            file.set(339, kind);
            extra.into_iter().for_each(|extra| file.set(338, extra));
            let samples = vec![200; 16 * 16 * bits.iter().sum::<u32>() as usize / 8];
            file.chunks = vec![samples.clone()];
            std::fs::write(&path, file.bytes()).unwrap();
            let mut reader = open_rows(&path).unwrap();
            let header = reader.header().clone();
            assert_eq!(header.converted, expected, "{bits:?} of kind {kind}, {photometric} with {extra:?}");
            // What is not named as converted has the values that are stored.
            let mut rows = vec![0; header.image_bytes() as usize];
            reader.read_rows(&mut rows).unwrap();
            assert!(!expected.is_empty() || kind != 1 || rows == samples);
            assert!(expected.is_empty() || rows != samples, "{expected:?}");
            if tiled {
                let facts = TiffDirectories::read(&path).unwrap().facts().unwrap();
                assert_eq!(facts.conversions(), header.conversions());
                assert_eq!(facts.conversions().len(), expected.len());
            }
        }
    }
    let png = directory.path().join("a.png");
    let mut encoder = png::Encoder::new(File::create(&png).unwrap(), 2, 1);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_palette(vec![0, 0, 0, 255, 0, 0]);
    encoder.write_header().unwrap().write_image_data(&[0, 1]).unwrap();
    assert_eq!(open_rows(&png).unwrap().header().conversions(), ["from numbers of a palette"]);
}
