//! Every kind of file that can be read, read in odd portions and compared with what was put in.

use std::io::Cursor;
use std::path::Path;

use crate::common::files::{HandmadeTiff, exif, interlaced_png, jpeg, jpeg_with_segment, smooth};
use crate::common::texels;
use png::{BitDepth, ColorType};
use tiff::encoder::colortype::{self, ColorType as TiffColor};
use tiff::encoder::{Compression, DeflateLevel, TiffEncoder, TiffKind, TiffValue};
use vastex_build::{ImageHeader, Notice, PixelFormat, open, open_reduced};

pub(crate) const SIZE: [u32; 2] = [103, 61];

/// Reads a file in portions of 1, 2, 3 ... rows.
pub(crate) fn read(bytes: &[u8]) -> (ImageHeader, Vec<u8>) {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    read_file(file.path())
}

fn read_file(path: &Path) -> (ImageHeader, Vec<u8>) {
    let mut reader = open(path).unwrap();
    let (row, mut left) = (reader.header().row_bytes(), reader.header().height);
    let (mut image, mut portion) = (Vec::new(), 1);
    while left > 0 {
        let count = portion.min(left);
        let start = image.len();
        image.resize(start + count as usize * row, 0);
        reader.read_rows(&mut image[start..]).unwrap();
        (left, portion) = (left - count, portion + 1);
    }
    (reader.header().clone(), image)
}

#[track_caller]
pub(crate) fn check(file: &[u8], format: PixelFormat, expected: &[u8]) -> Vec<Notice> {
    let (header, image) = read(file);
    assert_eq!(([header.width, header.height], header.format), (SIZE, format));
    assert!(image == expected);
    header.notices
}

fn png_file(color: ColorType, depth: BitDepth, data: &[u8], set: impl FnOnce(&mut png::Info<'_>)) -> Vec<u8> {
    let mut out = Vec::new();
    let mut info = png::Info::with_size(SIZE[0], SIZE[1]);
    (info.color_type, info.bit_depth) = (color, depth);
    set(&mut info);
    let mut writer = png::Encoder::with_info(&mut out, info).unwrap().write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    out
}

fn little_endian(big: &[u8]) -> Vec<u8> {
    big.chunks(2).flat_map(|s| [s[1], s[0]]).collect()
}

#[test]
fn png_of_every_colour_type() {
    use vastex_build::Sample::{U8, U16};
    for (color, format) in [
        (ColorType::Grayscale, PixelFormat::GREY8),
        (ColorType::GrayscaleAlpha, PixelFormat::GREY_ALPHA8),
        (ColorType::Rgb, PixelFormat::RGB8),
        (ColorType::Rgba, PixelFormat::RGBA8),
    ] {
        let samples = (SIZE[0] * SIZE[1]) as usize * color.samples();
        let data = texels(2 * samples, 3);
        let eight = png_file(color, BitDepth::Eight, &data[..samples], |_| ());
        assert_eq!(check(&eight, format.with_sample(U8), &data[..samples]), []);
        let sixteen = png_file(color, BitDepth::Sixteen, &data, |_| ());
        assert_eq!(check(&sixteen, format.with_sample(U16), &little_endian(&data)), []);
    }
}

#[test]
fn png_of_few_bits_and_palettes() {
    for depth in [BitDepth::One, BitDepth::Two, BitDepth::Four] {
        let bits = depth as usize;
        let row = (SIZE[0] as usize * bits).div_ceil(8);
        let packed = texels(row * SIZE[1] as usize, 7);
        let values: Vec<u8> = packed
            .chunks(row)
            .flat_map(|r| {
                (0..SIZE[0] as usize)
                    .map(move |x| r[x * bits / 8] >> (8 - bits - x * bits % 8) & ((1 << bits) - 1))
            })
            .collect();
        let grey: Vec<u8> = values.iter().map(|v| v * (255 / ((1u16 << bits) - 1) as u8)).collect();
        check(&png_file(ColorType::Grayscale, depth, &packed, |_| ()), PixelFormat::GREY8, &grey);

        let palette: Vec<u8> = texels(3 << bits, 11);
        let rgb: Vec<u8> = values.iter().flat_map(|&v| palette[usize::from(v) * 3..][..3].to_vec()).collect();
        let indexed = |info: &mut png::Info<'_>| info.palette = Some(palette.clone().into());
        check(&png_file(ColorType::Indexed, depth, &packed, indexed), PixelFormat::RGB8, &rgb);

        let rgba: Vec<u8> =
            values.iter().flat_map(|&v| [&palette[usize::from(v) * 3..][..3], &[v]].concat()).collect();
        let transparent = |info: &mut png::Info<'_>| {
            info.palette = Some(palette.clone().into());
            info.trns = Some((0..1u8 << bits).collect::<Vec<_>>().into());
        };
        check(&png_file(ColorType::Indexed, depth, &packed, transparent), PixelFormat::RGBA8, &rgba);
    }
}

#[test]
fn interlaced_png_is_held_whole_and_says_so() {
    let data = texels((SIZE[0] * SIZE[1]) as usize * 3, 13);
    let file = interlaced_png(SIZE, &data);
    let bytes = data.len() as u64;
    assert_eq!(
        check(&file, PixelFormat::RGB8, &data),
        [Notice::WholeImage { bytes, why: "an interlaced PNG" }]
    );
    // The first pass is a small picture of it, and nothing else is read for that.
    let path = tempfile::NamedTempFile::new().unwrap().into_temp_path();
    std::fs::write(&path, &file[..33 + 1000]).unwrap();
    let mut reader = open_reduced(&path, 26).unwrap().unwrap();
    let header = reader.header().clone();
    assert_eq!(([header.width, header.height], header.notices), ([13, 8], vec![]));
    assert!(header.memory < 300 << 10);
    let mut rows = vec![0; 13 * 8 * 3];
    rows.chunks_mut(2 * 13 * 3).for_each(|rows| reader.read_rows(rows).unwrap());
    for (n, texel) in (0..).zip(rows.as_chunks::<3>().0) {
        let at = (n / 13 * 8 * SIZE[0] + n % 13 * 8) as usize * 3;
        assert_eq!(texel, &data[at..at + 3], "texel {n}");
    }
    assert!(reader.read_rows(&mut rows[..13 * 3]).is_err(), "there are no more rows");
    assert!(open_reduced(&path, 28).unwrap().is_none(), "it is not much larger than that");
}

#[test]
fn png_takes_colours_as_stored_and_says_which_are_light() {
    let data = texels((SIZE[0] * SIZE[1]) as usize * 3, 17);
    let gamma = |scaled| {
        png_file(ColorType::Rgb, BitDepth::Eight, &data, |info| {
            info.source_gamma = Some(png::ScaledFloat::from_scaled(scaled));
        })
    };
    assert_eq!(check(&gamma(45_455), PixelFormat::RGB8, &data), []);
    assert_eq!(check(&gamma(55_555), PixelFormat::RGB8, &data), []);
    let (header, _) = read(&gamma(100_000));
    assert_eq!((header.linear, header.notices), (true, vec![]));
    let profile =
        png_file(ColorType::Rgb, BitDepth::Eight, &data, |info| info.icc_profile = Some(vec![1; 200].into()));
    assert_eq!(check(&profile, PixelFormat::RGB8, &data), []);
    assert!(read(&profile).0.profile.is_some());
}

#[track_caller]
fn check_jpeg(channels: u32, progressive: bool) -> Vec<Notice> {
    let data = smooth(SIZE, channels);
    let (header, image) = read(&jpeg(SIZE, channels as usize, progressive, &data));
    assert_eq!([header.width, header.height], SIZE);
    let worst = image.iter().zip(&data).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(image.len() == data.len() && worst.unwrap() <= 12, "{worst:?}");
    header.notices
}

#[test]
fn jpeg_by_rows_and_progressive() {
    assert_eq!(check_jpeg(1, false), []);
    assert_eq!(check_jpeg(3, false), []);
    // 13x8 blocks of 64 coefficients of two bytes, three components.
    let bytes = 13 * 8 * 64 * 2 * 3;
    assert_eq!(check_jpeg(3, true), [Notice::WholeImage { bytes, why: "a progressive JPEG" }]);
}

#[test]
fn jpeg_is_turned_upright_and_gives_its_profile() {
    let file = jpeg(SIZE, 3, false, &smooth(SIZE, 3));
    let file = jpeg_with_segment(&file, 0xe2, b"ICC_PROFILE\0\x01\x01ab");
    let (header, _) = read(&jpeg_with_segment(&file, 0xe1, &[b"Exif\0\0", &exif(6)[..]].concat()));
    assert_eq!([header.width, header.height], [SIZE[1], SIZE[0]]);
    assert!(matches!(header.notices[..], [Notice::Turned(6), Notice::WholeImage { .. }]));
    assert!(header.profile.is_some());
}

/// The rows and notices, or the fault, of a JPEG.
fn read_jpeg(file: &[u8], tolerates: bool) -> Result<(ImageHeader, Vec<u8>), String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.jpg");
    std::fs::write(&path, file).unwrap();
    let mut reader = open(&path).map_err(|fault| fault.to_string())?;
    if tolerates {
        reader.tolerate();
    }
    let mut image = vec![0; reader.header().image_bytes() as usize];
    let row = reader.header().row_bytes();
    image
        .chunks_mut(7 * row)
        .try_for_each(|rows| reader.read_rows(rows))
        .map_err(|fault| fault.to_string())?;
    Ok((reader.header().clone(), image))
}

#[test]
fn jpeg_that_lacks_data_is_an_error_unless_it_is_tolerated() {
    // Noise, so that nearly all of the file is compressed data.
    let noise = texels((SIZE[0] * SIZE[1] * 3) as usize, 37);
    for progressive in [false, true] {
        let file = jpeg(SIZE, 3, progressive, &noise);
        let (_, whole) = read_jpeg(&file, false).unwrap();
        let half = &file[..file.len() / 2];
        let cut = [half, &[0xff, 0xd9]].concat();
        let mut holed = file.clone();
        holed[file.len() / 2..][..2].copy_from_slice(&[0xff, 0xd9]);
        for damaged in [cut.clone(), holed] {
            let fault = read_jpeg(&damaged, false).unwrap_err();
            assert!(fault.contains("its data end there") && fault.contains("--tolerant"), "{fault}");
            let (header, image) = read_jpeg(&damaged, true).unwrap();
            assert!(
                header.notices.iter().any(|notice| matches!(notice, Notice::DamagedInPlaces(n) if *n > 0))
            );
            // What comes before the damage is as it was: all of the first rows, if rows come in turn.
            assert!(progressive || image[..whole.len() / 4] == whole[..whole.len() / 4]);
        }
        // Without an end of its own, too.
        assert!(read_jpeg(half, false).unwrap_err().contains("truncated"));
        let (_, image) = read_jpeg(half, true).unwrap();
        assert!(image == read_jpeg(&cut, true).unwrap().1);
    }
}

#[test]
fn few_bytes_before_the_end_of_a_jpeg_are_stray_and_more_are_damage() {
    let noise = texels((SIZE[0] * SIZE[1] * 3) as usize, 37);
    for progressive in [false, true] {
        let file = jpeg(SIZE, 3, progressive, &noise);
        let (_, whole) = read_jpeg(&file, false).unwrap();
        let data = &file[..file.len() - 2];
        let trailing = |count: u8| [data, &(1..=count).collect::<Vec<_>>(), &[0xff, 0xd9]].concat();
        let told = |header: &ImageHeader| {
            let is_stray = |notice: &Notice| matches!(notice, Notice::StrayBytes(n) if *n <= 16);
            let is_damage = |notice: &Notice| matches!(notice, Notice::DamagedInPlaces(1));
            (header.notices.iter().any(is_stray), header.notices.iter().any(is_damage))
        };
        let (header, image) = read_jpeg(&trailing(12), false).unwrap();
        assert!(image == whole && told(&header) == (true, false), "{:?}", header.notices);
        // The decoder looks a few bytes ahead, which it does not count.
        let many = trailing(40);
        match read_jpeg(&many, false) {
            Ok((header, _)) => {
                assert!(!progressive && told(&header) == (false, true), "{:?}", header.notices);
            }
            Err(fault) => assert!(progressive && fault.contains("--tolerant"), "{fault}"),
        }
        let (header, image) = read_jpeg(&many, true).unwrap();
        assert!(image == whole && told(&header) == (false, true), "{:?}", header.notices);
    }
}

/// Nothing can tell of every flipped bit, as JPEG has no checksums. But no note says that a picture is whole
/// which is not.
#[test]
fn what_is_told_of_a_jpeg_with_a_flipped_bit_is_that_it_may_be_damaged() {
    for progressive in [false, true] {
        let file = jpeg([32, 32], 3, progressive, &texels(32 * 32 * 3, 41));
        let (sound, whole) = read_jpeg(&file, false).unwrap();
        // The last scan begins last of all segments.
        let scan = file.windows(2).rposition(|marker| marker == [0xff, 0xda]).unwrap() + 14;
        let (mut differ, mut told) = (0, 0);
        for at in (scan..file.len() - 2).step_by(((file.len() - scan) / 60).max(1)) {
            let mut damaged = file.clone();
            damaged[at] ^= 1 << (at % 8);
            let Ok((header, image)) = read_jpeg(&damaged, false) else {
                (differ, told) = (differ + 1, told + 1);
                continue;
            };
            let notes: Vec<_> = header.notices[sound.notices.len()..].iter().map(Notice::to_string).collect();
            assert!(notes.iter().all(|note| note.contains("damaged")), "at {at}: {notes:?}");
            differ += usize::from(image != whole);
            told += usize::from(!notes.is_empty());
        }
        assert!(differ > 0 && (progressive || told > 0), "{progressive}: {differ} {told}");
    }
}

#[test]
fn a_jpeg_of_nothing_but_a_claim_fails_at_its_first_rows() {
    let mut file = jpeg([16, 16], 3, false, &texels(16 * 16 * 3, 1));
    let frame = file.windows(2).position(|marker| marker == [0xff, 0xc0]).unwrap();
    file[frame + 5..frame + 9].copy_from_slice(&[0xff, 0xdc, 0xff, 0xdc]);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.jpg");
    std::fs::write(&path, file).unwrap();
    let mut reader = open(&path).unwrap();
    assert_eq!([reader.header().width, reader.header().height], [65500; 2]);
    let mut row = vec![0; reader.header().row_bytes()];
    let rows = (0..32).take_while(|_| reader.read_rows(&mut row).is_ok()).count();
    assert!(rows < 32, "{rows}");
}

fn tiff_file<C: TiffColor, K: TiffKind>(data: &[C::Inner], rows: u32, compression: Compression) -> Vec<u8>
where
    [C::Inner]: TiffValue,
{
    let mut out = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::<_, K>::new_generic(&mut out).unwrap().with_compression(compression);
    let mut image = encoder.new_image::<C>(SIZE[0], SIZE[1]).unwrap();
    image.rows_per_strip(rows).unwrap();
    image.write_data(data).unwrap();
    out.into_inner()
}

fn check_tiff<K: TiffKind>() {
    let texel_count = (SIZE[0] * SIZE[1]) as usize;
    let bytes = texels(texel_count * 8, 19);
    let words: Vec<u16> = bytes.chunks(2).map(|s| u16::from_le_bytes([s[0], s[1]])).collect();
    let deflate = Compression::Deflate(DeflateLevel::Fast);
    for compression in [Compression::Uncompressed, Compression::Lzw, deflate] {
        for rows in [1, 7, 40] {
            let n = texel_count;
            check(
                &tiff_file::<colortype::Gray8, K>(&bytes[..n], rows, compression),
                PixelFormat::GREY8,
                &bytes[..n],
            );
            check(
                &tiff_file::<colortype::RGB8, K>(&bytes[..3 * n], rows, compression),
                PixelFormat::RGB8,
                &bytes[..3 * n],
            );
            check(
                &tiff_file::<colortype::RGBA8, K>(&bytes[..4 * n], rows, compression),
                PixelFormat::RGBA8,
                &bytes[..4 * n],
            );
            check(
                &tiff_file::<colortype::Gray16, K>(&words[..n], rows, compression),
                PixelFormat::GREY16,
                &bytes[..2 * n],
            );
            check(
                &tiff_file::<colortype::RGB16, K>(&words[..3 * n], rows, compression),
                PixelFormat::RGB16,
                &bytes[..6 * n],
            );
            check(&tiff_file::<colortype::RGBA16, K>(&words, rows, compression), PixelFormat::RGBA16, &bytes);
        }
    }
}

#[test]
fn tiff_of_every_colour_and_compression() {
    check_tiff::<tiff::encoder::TiffKindStandard>();
}

#[test]
fn big_tiff_of_every_colour_and_compression() {
    check_tiff::<tiff::encoder::TiffKindBig>();
}

#[test]
fn a_tiff_of_one_strip_is_held_whole_where_it_must_be_and_says_so() {
    let data = smooth(SIZE, 1);
    let strip = |compression| {
        tiff_file::<colortype::Gray8, tiff::encoder::TiffKindStandard>(&data, SIZE[1], compression)
    };
    assert_eq!(check(&strip(Compression::Uncompressed), PixelFormat::GREY8, &data), []);
    assert_eq!(check(&strip(Compression::Lzw), PixelFormat::GREY8, &data), []);
    // White is zero: not compressed, but no sample stays as it is.
    let mut converted = HandmadeTiff::new(SIZE, &[8], 0, SIZE, false);
    converted.chunks = vec![data.iter().map(|v| 255 - v).collect()];
    assert_eq!(check(&converted.bytes(), PixelFormat::GREY8, &data), []);
    let mut jpeg_strip = HandmadeTiff::new(SIZE, &[8], 1, SIZE, false);
    jpeg_strip.set(259, 7);
    jpeg_strip.chunks = vec![jpeg(SIZE, 1, false, &data)];
    assert_eq!(read(&jpeg_strip.bytes()).0.notices, []);
    // All of it is decoded before there is a row.
    jpeg_strip.chunks = vec![jpeg(SIZE, 1, true, &data)];
    let (header, _) = read(&jpeg_strip.bytes());
    let why = "a compressed TIFF of one strip";
    let least = 2 * data.len() as u64;
    assert!(
        matches!(header.notices[..], [Notice::WholeImage { bytes, why: said }] if said == why && bytes >= least)
    );
}

#[test]
fn tiff_of_tiles_in_both_byte_orders() {
    let n = (SIZE[0] * SIZE[1]) as usize;
    let data = texels(n * 6, 29);
    for big_endian in [false, true] {
        for tiled in [false, true] {
            let chunk = if tiled { [32, 16] } else { [SIZE[0], 16] };
            let mut file = HandmadeTiff::new(SIZE, &[8, 8, 8], 2, chunk, tiled);
            file.big_endian = big_endian;
            file.cut(SIZE, 3, chunk, &data[..3 * n]);
            check(&file.bytes(), PixelFormat::RGB8, &data[..3 * n]);

            let mut file = HandmadeTiff::new(SIZE, &[16, 16, 16], 2, chunk, tiled);
            file.big_endian = big_endian;
            file.cut(SIZE, 6, chunk, &data);
            let expected = if big_endian { little_endian(&data) } else { data.clone() };
            check(&file.bytes(), PixelFormat::RGB16, &expected);
        }
    }
}

#[test]
fn tiff_with_alpha_white_is_zero_orientation_and_jpeg_tiles() {
    let n = (SIZE[0] * SIZE[1]) as usize;
    let data = texels(n * 2, 31);
    let chunk = [SIZE[0], 16];
    let mut file = HandmadeTiff::new(SIZE, &[8, 8], 1, chunk, false);
    file.set(338, 1);
    file.cut(SIZE, 2, chunk, &data);
    let divided: Vec<u8> = data
        .chunks(2)
        .flat_map(|texel| {
            let [v, a] = [texel[0], texel[1]].map(u32::from);
            [(v * 255 + a / 2).checked_div(a).map_or(v, |quotient| quotient.min(255)) as u8, texel[1]]
        })
        .collect();
    assert_eq!(check(&file.bytes(), PixelFormat::GREY_ALPHA8, &divided), [Notice::PremultipliedAlpha]);

    let mut file = HandmadeTiff::new(SIZE, &[8], 0, chunk, false);
    file.set(274, 3);
    file.cut(SIZE, 1, chunk, &data[..n]);
    let inverted: Vec<u8> = data[..n].iter().rev().map(|v| 255 - v).collect();
    let notices = check(&file.bytes(), PixelFormat::GREY8, &inverted);
    assert!(matches!(notices[..], [Notice::Turned(3), Notice::WholeImage { .. }]), "{notices:?}");

    let picture = smooth(SIZE, 3);
    let chunk = [32, 16];
    let mut file = HandmadeTiff::new(SIZE, &[8, 8, 8], 6, chunk, true);
    file.set(259, 7);
    file.cut(SIZE, 3, chunk, &picture);
    file.chunks = file.chunks.iter().map(|tile| jpeg(chunk, 3, false, tile)).collect();
    let (header, image) = read(&file.bytes());
    assert_eq!(header.format, PixelFormat::RGB8);
    // Padding beyond the right and bottom edge is black, so blocks there ring.
    let inner = |i: &usize| (i / 3) % (SIZE[0] as usize) < 96 && i / 3 / (SIZE[0] as usize) < 48;
    let worst = (0..image.len()).filter(inner).map(|i| image[i].abs_diff(picture[i])).max();
    assert!(worst.unwrap() <= 12, "{worst:?}");
}
