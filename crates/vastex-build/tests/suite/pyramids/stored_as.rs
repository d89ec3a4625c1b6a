//! Regions of images whose samples are no colours yet: numbers of a palette, grey of few bits, inks. The
//! numbers are those of the file in every format, and a picture of them is the region of its picture.

use std::io::{BufReader, Cursor};
use std::path::{Path, PathBuf};

use mozjpeg::{ColorSpace, Compress};
use png::{BitDepth, ColorType, Transformations};
use tiff::decoder::Decoder;
use tiff::tags::Tag;
use vastex_build::{CropFormat, CropRegion, CropSource, Number, crop, open};

use super::whole;
use crate::common::files::{HandmadeTiff, smooth};
use crate::common::texels;

const SIZE: [u32; 2] = [37, 23];
const TEXELS: usize = (SIZE[0] * SIZE[1]) as usize;
const AT: [u32; 2] = [5, 3];
const PART: [u32; 2] = [13, 17];

fn cut(path: &Path, format: CropFormat) -> Result<Vec<u8>, String> {
    let mut source = CropSource::open(path, 0).unwrap();
    let mut bytes = Vec::new();
    let region = CropRegion { at: AT, size: PART };
    crop(&mut source, region, format, &mut bytes, &()).map(|()| bytes).map_err(|error| error.to_string())
}

/// The region of rows of texels of so many bytes.
fn region(rows: &[u8], texel: usize) -> Vec<u8> {
    let row = |y: u32| {
        let first = ((AT[1] + y) * SIZE[0] + AT[0]) as usize * texel;
        &rows[first..first + PART[0] as usize * texel]
    };
    (0..PART[1]).flat_map(row).copied().collect()
}

/// Rows as they are shown, and bytes of their texels.
fn shown(path: &Path) -> (Vec<u8>, usize) {
    let mut reader = open(path).unwrap();
    let mut rows = vec![0; reader.header().image_bytes() as usize];
    reader.read_rows(&mut rows).unwrap();
    (rows, reader.header().format.texel_bytes())
}

/// Numbers of so many bits, one behind the other, rows from a byte on.
fn packed(numbers: &[u8], bits: usize) -> Vec<u8> {
    let byte = |some: &[u8]| {
        some.iter().enumerate().fold(0, |byte, (n, number)| byte | number << (8 - bits - n * bits))
    };
    numbers.chunks(SIZE[0] as usize).flat_map(|row| row.chunks(8 / bits).map(byte)).collect()
}

/// An image of one number a texel with a palette, or without.
fn png_of(path: &Path, depth: BitDepth, numbers: &[u8], palette: Option<(&[u8], &[u8])>) {
    let file = std::fs::File::create(path).unwrap();
    let mut encoder = png::Encoder::new(file, SIZE[0], SIZE[1]);
    encoder.set_color(if palette.is_some() { ColorType::Indexed } else { ColorType::Grayscale });
    encoder.set_depth(depth);
    if let Some((colors, alphas)) = palette {
        encoder.set_palette(colors);
        if !alphas.is_empty() {
            encoder.set_trns(alphas);
        }
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&packed(numbers, depth as usize)).unwrap();
}

/// The numbers of a PNG as it stores them, a byte each.
fn numbers_of_png(file: &[u8]) -> Vec<u8> {
    let mut decoder = png::Decoder::new(BufReader::new(Cursor::new(file)));
    decoder.set_transformations(Transformations::IDENTITY);
    let mut reader = decoder.read_info().unwrap();
    let bits = reader.info().bit_depth as usize;
    let mut stored = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut stored).unwrap();
    let rows = stored.chunks(reader.output_line_size(PART[0]).unwrap());
    let number = |row: &[u8], n: usize| {
        let at = n * bits;
        row[at / 8] >> (8 - bits - at % 8) & (0xff >> (8 - bits)) as u8
    };
    rows.flat_map(|row| (0..PART[0] as usize).map(|n| number(row, n)).collect::<Vec<_>>()).collect()
}

/// What a TIFF says of how its numbers are shown: PhotometricInterpretation, and bits of each.
fn says(file: &[u8]) -> (u32, Vec<u32>) {
    let mut decoder = Decoder::new(Cursor::new(file)).unwrap();
    let bits = decoder.get_tag_u32_vec(Tag::BitsPerSample).unwrap();
    (decoder.get_tag_u32(Tag::PhotometricInterpretation).unwrap(), bits)
}

/// Says that regions of one number a texel are those numbers in every format, and in pictures of them what
/// the source shows there.
fn check(path: &Path, numbers: &[u8], (photometric, bits): (u32, u32), what: &str) {
    let expected = region(numbers, 1);
    let npy = cut(path, CropFormat::Npy).unwrap();
    assert!(npy.ends_with(&expected) && npy.len() == 128 + expected.len(), "{what} as NumPy has it");
    let (rows, texel) = shown(path);
    let seen = region(&rows, texel);
    let directory = tempfile::tempdir().unwrap();
    let png = cut(path, CropFormat::Png).unwrap();
    assert!(numbers_of_png(&png) == expected, "{what} as PNG");
    let again = directory.path().join("a.png");
    std::fs::write(&again, &png).unwrap();
    assert!(whole(CropSource::open(&again, 0).unwrap()) == expected, "{what} out of PNG again");
    // PNG knows no grey of which 0 is white.
    let inverted: Vec<u8> = seen.iter().map(|value| !value).collect();
    assert!(shown(&again).0 == if photometric == 0 { inverted } else { seen.clone() }, "{what} in a PNG");
    let tif = cut(path, CropFormat::Tiff).unwrap();
    assert_eq!(says(&tif), (photometric, vec![bits]), "{what}");
    let again = directory.path().join("a.tif");
    std::fs::write(&again, &tif).unwrap();
    let source = CropSource::open(&again, 0).unwrap();
    assert_eq!((source.number(), source.channels()), (Number::U8, 1));
    assert!(whole(source) == expected, "{what} out of TIFF again");
    // Where colours have an alpha, TIFF has no place for that.
    let opaque: Vec<u8> = if texel == 4 {
        seen.as_chunks::<4>().0.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect()
    } else {
        seen
    };
    assert!(shown(&again).0 == opaque, "{what} in a TIFF");
}

/// So many colours, none twice.
fn colors(count: usize) -> Vec<u8> {
    (0..count).flat_map(|n| [n as u8, (n * 37 + 11) as u8, 255 - n as u8]).collect()
}

fn tiff_of(path: &Path, bits: usize, photometric: u32, numbers: &[u8], colors: &[u8]) {
    let mut file = HandmadeTiff::new(SIZE, &[bits as u32], photometric, [SIZE[0], 7], false);
    let row = (SIZE[0] as usize * bits).div_ceil(8) as u32;
    file.cut([row, SIZE[1]], 1, [row, 7], &packed(numbers, bits));
    if photometric == 3 {
        let of = |channel: usize| colors.iter().skip(channel).step_by(3).map(|value| u32::from(*value) << 8);
        file.tags.push((320, (0..3).flat_map(of).collect()));
    }
    std::fs::write(path, file.bytes()).unwrap();
}

fn in_directory(name: &str) -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(name);
    (directory, path)
}

fn numbers(bits: usize) -> Vec<u8> {
    texels(TEXELS, 7).iter().map(|number| number >> (8 - bits)).collect()
}

#[test]
fn grey_of_few_bits_stays_grey_of_few_bits() {
    for (bits, depth) in [(1, BitDepth::One), (2, BitDepth::Two), (4, BitDepth::Four)] {
        let (_directory, path) = in_directory("a.tif");
        let numbers = numbers(bits);
        for photometric in [0, 1] {
            tiff_of(&path, bits, photometric, &numbers, &[]);
            check(&path, &numbers, (photometric, bits as u32), &format!("a TIFF of {bits} bits"));
        }
        png_of(&path, depth, &numbers, None);
        check(&path, &numbers, (1, bits as u32), &format!("a PNG of {bits} bits"));
    }
}

#[test]
fn numbers_of_a_palette_keep_their_colours() {
    for (bits, depth) in [(1, BitDepth::One), (2, BitDepth::Two), (4, BitDepth::Four), (8, BitDepth::Eight)] {
        let (_directory, path) = in_directory("a.tif");
        let (numbers, colors) = (numbers(bits), colors(1 << bits));
        tiff_of(&path, bits, 3, &numbers, &colors);
        check(&path, &numbers, (3, 8), &format!("a TIFF of a palette of {bits} bits"));
        for alphas in [&[][..], &[0, 127]] {
            png_of(&path, depth, &numbers, Some((&colors, alphas)));
            check(&path, &numbers, (3, 8), &format!("a PNG of a palette of {bits} bits, {alphas:?}"));
        }
        // Bands that are asked for are plain numbers.
        tiff_of(&path, bits, 3, &numbers, &colors);
        let band = PathBuf::from(format!("{}:bands=1", path.display()));
        let tif = cut(&band, CropFormat::Tiff).unwrap();
        assert_eq!(says(&tif), (1, vec![8]));
        assert!(numbers_of_png(&cut(&band, CropFormat::Png).unwrap()) == region(&numbers, 1));
    }
}

#[test]
fn a_palette_that_png_has_no_place_for_is_refused() {
    let (_directory, path) = in_directory("a.tif");
    let numbers: Vec<u8> = texels(2 * TEXELS, 9);
    let mut file = HandmadeTiff::new(SIZE, &[16], 3, [SIZE[0], 7], false);
    file.cut(SIZE, 2, [SIZE[0], 7], &numbers);
    file.tags.push((320, (0..3 << 16).map(|n| n & 0xff00).collect()));
    std::fs::write(&path, file.bytes()).unwrap();
    let error = cut(&path, CropFormat::Png).unwrap_err();
    assert!(error.contains("PNG cannot hold numbers of a palette of 65536 colours"), "{error}");
    assert!(cut(&path, CropFormat::Npy).unwrap().ends_with(&region(&numbers, 2)));
    let tif = cut(&path, CropFormat::Tiff).unwrap();
    assert_eq!(says(&tif), (3, vec![16]));
    let (rows, texel) = shown(&path);
    let (_other, again) = in_directory("b.tif");
    std::fs::write(&again, &tif).unwrap();
    assert!(shown(&again).0 == region(&rows, texel));
}

#[test]
fn inks_stay_inks() {
    for (bits, samples) in [(8, 4), (8, 5), (16, 4)] {
        let (_directory, path) = in_directory("a.tif");
        let texel = samples * bits / 8;
        let inks = texels(TEXELS * texel, 8);
        let mut file = HandmadeTiff::new(SIZE, &vec![bits as u32; samples], 5, [SIZE[0], 7], false);
        if samples > 4 {
            file.set(338, 2);
        }
        file.cut(SIZE, texel, [SIZE[0], 7], &inks);
        std::fs::write(&path, file.bytes()).unwrap();
        let expected = region(&inks, texel);
        assert!(cut(&path, CropFormat::Npy).unwrap().ends_with(&expected));
        let tif = cut(&path, CropFormat::Tiff).unwrap();
        assert_eq!(says(&tif), (5, vec![bits as u32; samples]));
        let (_other, again) = in_directory("b.tif");
        std::fs::write(&again, &tif).unwrap();
        assert!(whole(CropSource::open(&again, 0).unwrap()) == expected);
        let (rows, shown_texel) = shown(&path);
        assert!(shown(&again).0 == region(&rows, shown_texel), "{samples} samples of {bits} bits");
        // It would show them as other colours.
        let error = cut(&path, CropFormat::Png).unwrap_err();
        assert!(error.contains("PNG cannot hold inks") && error.contains(".tif"), "{error}");
    }
}

/// A JPEG of inks is what libjpeg decodes of it, inverted or not.
#[test]
fn inks_of_a_jpeg_are_cut_out_as_libjpeg_decodes_them() {
    let inks = smooth(SIZE, 4);
    let mut compress = Compress::new(ColorSpace::JCS_CMYK);
    compress.set_size(SIZE[0] as usize, SIZE[1] as usize);
    compress.set_quality(98.0);
    compress.set_fastest_defaults();
    compress.set_optimize_scans(false);
    let mut started = compress.start_compress(Vec::new()).unwrap();
    started.write_scanlines(&inks).unwrap();
    let of_adobe = started.finish().unwrap();
    let marker = of_adobe.windows(9).position(|bytes| bytes == b"\xff\xee\0\x0eAdobe").unwrap();
    let without = [&of_adobe[..marker], &of_adobe[marker + 16..]].concat();
    for (file, photometric) in [(&of_adobe, 1), (&without, 5)] {
        let (_directory, path) = in_directory("a.jpg");
        std::fs::write(&path, file).unwrap();
        let source = CropSource::open(&path, 0).unwrap();
        assert_eq!((source.number(), source.channels()), (Number::U8, 4));
        let decoder = mozjpeg::Decompress::new_mem(file).unwrap();
        let mut decoder = decoder.to_colorspace(ColorSpace::JCS_CMYK).unwrap();
        let decoded: Vec<[u8; 4]> = decoder.read_scanlines().unwrap();
        assert!(whole(source) == decoded.as_flattened());
        let expected = region(decoded.as_flattened(), 4);
        assert!(cut(&path, CropFormat::Npy).unwrap().ends_with(&expected));
        let tif = cut(&path, CropFormat::Tiff).unwrap();
        assert_eq!(says(&tif), (photometric, vec![8; 4]));
        assert!(tif.ends_with(&expected));
        assert!(cut(&path, CropFormat::Png).unwrap_err().contains("PNG cannot hold inks"));
    }
}
