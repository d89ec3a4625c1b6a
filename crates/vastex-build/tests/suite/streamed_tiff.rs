//! TIFF files of one strip, whose rows come while it is decoded: the same rows as those of many strips.

use std::io::Write;
use std::path::Path;

use vastex_build::{ImageHeader, InputFault, open};

use crate::common::files::{HandmadeTiff, jpeg, pack_bits, smooth};
use crate::common::sandbox::Sandbox;
use crate::common::texels;

const SIZE: [u32; 2] = [61, 45];
const NONE: u32 = 1;
const LZW: u32 = 5;
const DEFLATE: u32 = 8;
const PACKBITS: u32 = 32773;
const ZSTD: u32 = 50000;

fn compress(compression: u32, bytes: &[u8]) -> Vec<u8> {
    match compression {
        NONE => bytes.to_vec(),
        LZW => {
            let order = weezl::BitOrder::Msb;
            weezl::encode::Encoder::with_tiff_size_switch(order, 8).encode(bytes).unwrap()
        }
        DEFLATE => {
            let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
            encoder.write_all(bytes).unwrap();
            encoder.finish().unwrap()
        }
        ZSTD => zstd::stream::encode_all(bytes, 3).unwrap(),
        _ => pack_bits(bytes),
    }
}

/// What a file is of: bits of its samples, their kind (1 unsigned, 2 signed, 3 floats), photometric
/// interpretation, predictor, whether channels lie in planes, and whether the highest byte comes first.
#[derive(Clone, Debug)]
struct Kind(Vec<u32>, u32, u32, u32, bool, bool);

impl Kind {
    fn stored(&self) -> Vec<u8> {
        texels((SIZE[0] * SIZE[1] * self.0[0] / 8) as usize * self.0.len(), 21)
    }

    /// The rows of what is stored as it is, where that are whole numbers without a sign.
    fn shown(&self) -> Option<Vec<u8>> {
        let Kind(bits, sample_format, photometric, _, is_planar, big_endian) = self;
        let (stored, sample, channels) = (self.stored(), bits[0] as usize / 8, bits.len());
        let count = stored.len() / sample / channels;
        let of = |[texel, channel]: [usize; 2]| {
            let at = if *is_planar { channel * count + texel } else { texel * channels + channel };
            let mut value = stored[at * sample..][..sample].to_vec();
            if *big_endian {
                value.reverse();
            }
            if *photometric == 0 {
                value.iter_mut().for_each(|byte| *byte = !*byte);
            }
            value
        };
        let places = (0..count).flat_map(|texel| (0..channels).map(move |channel| [texel, channel]));
        (*sample_format == 1).then(|| places.flat_map(of).collect())
    }

    /// A file in strips of so many rows, of bytes that could be anything.
    fn file(&self, compression: u32, rows: u32) -> HandmadeTiff {
        let Kind(bits, sample_format, photometric, predictor, is_planar, big_endian) = self.clone();
        let sample = bits[0] as usize / 8;
        let planes = if is_planar { bits.len() } else { 1 };
        let texel = sample * bits.len() / planes;
        let stored = self.stored();
        let chunk = [SIZE[0], rows];
        let mut file =
            HandmadeTiff { big_endian, ..HandmadeTiff::new(SIZE, &bits, photometric, chunk, false) };
        file.set(259, compression);
        file.set(317, predictor);
        file.set(339, sample_format);
        if bits.len() == 2 || bits.len() == 4 {
            file.set(338, 2);
        }
        if is_planar {
            file.set(284, 2);
        }
        for plane in stored.chunks(stored.len() / planes) {
            file.cut(SIZE, texel, chunk, plane);
        }
        file.chunks.iter_mut().for_each(|chunk| *chunk = compress(compression, chunk));
        file
    }
}

/// The header, the rows that came, and why no more did. They are asked for in portions of 1, 2, 3 and so on.
fn read(path: &Path, bytes: &[u8]) -> (ImageHeader, Vec<u8>, Option<InputFault>) {
    std::fs::write(path, bytes).unwrap();
    let mut reader = open(path).unwrap();
    let (mut rows, mut left) = (Vec::new(), reader.header().height);
    for portion in 1.. {
        let count = left.min(portion);
        if count == 0 {
            break;
        }
        let mut some = vec![0; count as usize * reader.header().row_bytes()];
        if let Err(fault) = reader.read_rows(&mut some) {
            return (reader.header().clone(), rows, Some(fault));
        }
        rows.extend(some);
        left -= count;
    }
    (reader.header().clone(), rows, None)
}

#[test]
fn one_strip_has_the_rows_of_many() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    let kinds = [
        Kind(vec![8], 1, 1, 1, false, false),
        Kind(vec![8], 1, 0, 2, false, false),
        Kind(vec![8; 3], 1, 2, 2, false, true),
        Kind(vec![8; 4], 1, 2, 1, false, false),
        Kind(vec![8; 3], 1, 2, 2, true, false),
        Kind(vec![16], 1, 0, 1, false, false),
        Kind(vec![16; 3], 1, 2, 2, false, true),
        Kind(vec![16; 4], 1, 2, 1, true, true),
        Kind(vec![8; 3], 2, 2, 1, false, false),
        Kind(vec![16], 2, 1, 2, false, true),
        Kind(vec![32], 2, 1, 1, false, false),
        Kind(vec![32], 3, 1, 3, false, true),
        Kind(vec![32; 3], 3, 2, 1, true, false),
        Kind(vec![64], 3, 1, 1, false, false),
    ];
    for kind in &kinds {
        for compression in [NONE, DEFLATE, LZW, PACKBITS, ZSTD] {
            let many = read(&path, &kind.file(compression, 7).bytes());
            let (header, rows, fault) = read(&path, &kind.file(compression, SIZE[1]).bytes());
            assert!(fault.is_none() && many.2.is_none(), "{kind:?} {compression}: {fault:?} {:?}", many.2);
            assert!(header.format == many.0.format && rows == many.1, "{kind:?} {compression}");
            assert_eq!(header.notices, many.0.notices, "{kind:?} {compression}");
            if compression == NONE
                && let Some(shown) = kind.shown()
            {
                assert!(rows == shown, "{kind:?}");
            }
            let planes = if kind.4 { kind.0.len() as u64 } else { 1 };
            assert!(header.memory < planes << 20, "{kind:?} {compression}: {}", header.memory);
        }
    }
}

#[test]
fn what_is_damaged_or_cut_off_has_rows_up_to_there() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    let kind = Kind(vec![8; 3], 1, 2, 1, false, false);
    for compression in [NONE, DEFLATE, LZW, PACKBITS, ZSTD] {
        let mut file = kind.file(compression, SIZE[1]);
        let (_, all, _) = read(&path, &file.bytes());
        // The strip lies at the end of the file, and half of it is missing. It is said to be of the length
        // that it has.
        let bytes = file.bytes();
        let entry = [0x11, 1, 4, 0, 1, 0, 0, 0, 8, 0, 0, 0];
        let at = bytes.windows(12).position(|window| window == entry).unwrap();
        let mut cut = bytes.clone();
        cut[at + 8..at + 12].copy_from_slice(&(bytes.len() as u32).to_le_bytes());
        cut.extend(&file.chunks[0][..file.chunks[0].len() / 2]);
        let (header, rows, fault) = read(&path, &cut);
        let place = match fault {
            Some(InputFault::Truncated { place }) => place,
            other => panic!("{compression}: {other:?}"),
        };
        let count = rows.len() / header.row_bytes();
        assert!(all.starts_with(&rows), "{compression}");
        // Zstandard gives out blocks of 128 KiB, and all of this is one.
        assert!(count > 5 || compression == ZSTD, "{compression}: {count} rows");
        let near: u32 = place.split(' ').nth(2).and_then(|row| row.parse().ok()).unwrap();
        assert!((count..count + 10).contains(&(near as usize)), "{compression}: {place} of {count}");

        if compression == NONE {
            continue;
        }
        // Too little, and too much.
        let texel = [9, 8, 7];
        let stored = texel.repeat((SIZE[0] * SIZE[1]) as usize);
        for (stored, said) in [(&stored[3..], "8232 bytes of 8235"), (&stored, "")] {
            file.chunks = vec![compress(compression, stored)];
            let (_, rows, fault) = read(&path, &file.bytes());
            match (said, fault) {
                ("", None) => assert!(rows == stored),
                (said, Some(InputFault::Damaged { place, why })) if !said.is_empty() => {
                    assert!(place.contains("near row 44 of 45") && why.contains(said), "{place}: {why}");
                }
                other => panic!("{compression}: {other:?}"),
            }
        }
        let more = texel.repeat((SIZE[0] * SIZE[1]) as usize + 1);
        file.chunks = vec![compress(compression, &more)];
        let (_, _, fault) = read(&path, &file.bytes());
        assert!(
            matches!(&fault, Some(InputFault::Damaged { why, .. }) if why.contains("more than its 8235")),
            "{compression}: {fault:?}"
        );
    }
}

/// A JPEG file as a strip has it: without the segments of applications, perhaps without its tables, which
/// come first.
fn as_strip(file: &[u8], has_tables: bool) -> (Vec<u8>, Vec<u8>) {
    let (mut tables, mut strip) = (vec![0xff, 0xd8], vec![0xff, 0xd8]);
    let mut rest = &file[2..];
    while rest[1] != 0xda {
        let len = 2 + usize::from(u16::from_be_bytes([rest[2], rest[3]]));
        match rest[1] {
            0xe0..=0xef => {}
            0xc4 | 0xdb if !has_tables => tables.extend(&rest[..len]),
            _ => strip.extend(&rest[..len]),
        }
        rest = &rest[len..];
    }
    strip.extend(rest);
    tables.extend([0xff, 0xd9]);
    (tables, strip)
}

/// A file of JPEG strips, of so many rows each.
fn jpeg_file(channels: usize, rows: u32, has_tables: bool, is_progressive: bool) -> HandmadeTiff {
    let data = smooth(SIZE, channels as u32);
    let bits = vec![8; channels];
    let photometric = if channels == 1 { 1 } else { 6 };
    let mut file = HandmadeTiff::new(SIZE, &bits, photometric, [SIZE[0], rows], false);
    file.set(259, 7);
    // libtiff writes it, and nobody looks at it.
    file.set(317, 2);
    for rows in data.chunks(rows as usize * SIZE[0] as usize * channels) {
        let count = (rows.len() / (SIZE[0] as usize * channels)) as u32;
        let (tables, strip) = as_strip(&jpeg([SIZE[0], count], channels, is_progressive, rows), has_tables);
        if !has_tables {
            file.tags.retain(|(tag, _)| *tag != 347);
            file.tags.push((347, tables.iter().map(|&byte| byte.into()).collect()));
        }
        file.chunks.push(strip);
    }
    file
}

/// Rows of one strip come as libjpeg decodes them, whoever has its tables; a progressive one is decoded
/// before.
#[test]
fn a_jpeg_of_one_strip_has_its_rows() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    for channels in [1, 3] {
        let data = smooth(SIZE, channels);
        let whole = jpeg(SIZE, channels as usize, false, &data);
        let mut decoder = mozjpeg::Decompress::new_mem(&whole).unwrap().rgb().unwrap();
        let expected: Vec<[u8; 3]> = decoder.read_scanlines().unwrap();
        for has_tables in [true, false] {
            let file = jpeg_file(channels as usize, SIZE[1], has_tables, false);
            let (header, rows, fault) = read(&path, &file.bytes());
            assert!(fault.is_none(), "{fault:?}");
            let expected: Vec<u8> = match channels {
                1 => expected.iter().map(|texel| texel[0]).collect(),
                _ => expected.concat(),
            };
            assert!(rows == expected, "{channels} {has_tables}");
            assert!(header.notices.is_empty() && header.memory < 1 << 20, "{:?}", header.notices);
        }
        let (header, _, fault) = read(&path, &jpeg_file(channels as usize, SIZE[1], true, true).bytes());
        assert!(fault.is_none() && header.notices.len() == 1, "{:?} {fault:?}", header.notices);
    }
}

#[test]
fn a_jpeg_of_one_strip_that_is_damaged_has_rows_up_to_there() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    let whole = jpeg_file(3, SIZE[1], true, false);
    let (_, all, _) = read(&path, &whole.bytes());
    let mut file = jpeg_file(3, SIZE[1], true, false);
    let (len, scan) = (file.chunks[0].len(), file.chunks[0].windows(2).position(|two| two == [0xff, 0xda]));
    file.chunks[0].truncate((len + scan.unwrap()) / 2);
    let (header, rows, fault) = read(&path, &file.bytes());
    assert!(all.starts_with(&rows) && rows.len() >= 8 * header.row_bytes(), "{} bytes", rows.len());
    assert!(matches!(fault, Some(InputFault::Damaged { .. })), "{fault:?}");
    // Of another size than the file says.
    let mut file = jpeg_file(3, SIZE[1], true, false);
    file.set(256, SIZE[0] + 1);
    std::fs::write(&path, file.bytes()).unwrap();
    let (_, rows, fault) = read(&path, &file.bytes());
    assert!(rows.is_empty(), "{} bytes", rows.len());
    assert!(
        matches!(&fault, Some(InputFault::Damaged { why, .. }) if why.contains("61x45 texels where 62x45")),
        "{fault:?}"
    );
    // Every byte of its beginning, and nothing that is not told.
    for at in 0..whole.chunks[0].len().min(700) {
        let mut file = jpeg_file(3, SIZE[1], true, false);
        file.chunks[0][at] ^= 0x55;
        std::fs::write(&path, file.bytes()).unwrap();
        if let Ok(mut reader) = open(&path) {
            let mut rows = vec![0; reader.header().row_bytes()];
            let _ = (0..reader.header().height).try_for_each(|_| reader.read_rows(&mut rows));
        }
    }
}

/// A file of samples of so many bits that are no colours as they are stored, in strips of so many rows: bits
/// of its samples, photometric interpretation, predictor, whether channels lie in planes, and bands that are
/// asked for.
struct Converted(Vec<u32>, u32, u32, bool, &'static str);

impl Converted {
    /// The bands of what is stored as it is, where bands are shown.
    fn shown(&self) -> Option<Vec<u8>> {
        let Converted(bits, photometric, _, is_planar, named) = self;
        let sample = bits[0] as usize / 8;
        if *photometric != 1 || sample == 0 {
            return None;
        }
        let bands = named.strip_prefix(":bands=").unwrap_or("1,2,3");
        let bands: Vec<usize> = bands.split(',').map(|band| band.parse::<usize>().unwrap() - 1).collect();
        let count = (SIZE[0] * SIZE[1]) as usize;
        let stored = texels(count * sample * bits.len(), 23);
        let of = |texel: usize, band: usize| {
            let at = if *is_planar { band * count + texel } else { texel * bits.len() + band };
            &stored[at * sample..][..sample]
        };
        Some(
            (0..count)
                .flat_map(|texel| bands.iter().map(|band| of(texel, *band)).collect::<Vec<_>>().concat())
                .collect(),
        )
    }

    fn file(&self, compression: u32, rows: u32) -> HandmadeTiff {
        let Converted(bits, photometric, predictor, is_planar, _) = self;
        let planes = if *is_planar { bits.len() } else { 1 };
        let row = (SIZE[0] * bits[0] * (bits.len() / planes) as u32).div_ceil(8);
        let mut file = HandmadeTiff::new(SIZE, bits, *photometric, [SIZE[0], rows], false);
        file.set(259, compression);
        file.set(317, *predictor);
        match bits.len() {
            // Four inks and alpha.
            5 if *photometric == 5 => file.set(338, 2),
            // The colours of a palette.
            1 if *photometric == 3 => {
                file.tags.push((320, (0..3u32 << bits[0]).map(|n| n * 37 % 256 * 257).collect()));
            }
            _ => {}
        }
        if *is_planar {
            file.set(284, 2);
        }
        for plane in texels(row as usize * SIZE[1] as usize * planes, 23).chunks((row * SIZE[1]) as usize) {
            file.cut([row, SIZE[1]], 1, [row, rows], plane);
        }
        file.chunks.iter_mut().for_each(|chunk| *chunk = compress(compression, chunk));
        file
    }
}

fn all_converted() -> [Converted; 10] {
    [
        Converted(vec![8; 4], 5, 1, false, ""),
        Converted(vec![8; 5], 5, 2, false, ""),
        Converted(vec![16; 4], 5, 2, true, ""),
        Converted(vec![8], 3, 1, false, ""),
        Converted(vec![4], 3, 1, false, ""),
        Converted(vec![1], 1, 1, false, ""),
        Converted(vec![2], 0, 1, false, ""),
        Converted(vec![8; 6], 1, 2, false, ":bands=5,2,1"),
        Converted(vec![16; 5], 1, 1, true, ":bands=4"),
        Converted(vec![8; 7], 1, 1, false, ""),
    ]
}

/// What must be converted, and bands, come row by row, too, and nothing is held but rows.
#[test]
fn what_is_converted_has_the_rows_of_many_strips() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    for converted in all_converted() {
        let Converted(bits, photometric, _, is_planar, bands) = &converted;
        let named = std::path::PathBuf::from(format!("{}{bands}", path.display()));
        let planes = if *is_planar { bits.len() as u64 } else { 1 };
        for compression in [NONE, DEFLATE, LZW, PACKBITS, ZSTD] {
            let what = format!("{bits:?} {photometric} {bands} {compression}");
            let read = |rows: u32| {
                std::fs::write(&path, converted.file(compression, rows).bytes()).unwrap();
                let mut reader = open(&named).unwrap();
                let mut rows = vec![0; reader.header().image_bytes() as usize];
                rows.chunks_mut(2 * reader.header().row_bytes())
                    .for_each(|some| reader.read_rows(some).unwrap());
                (reader.header().clone(), rows)
            };
            let ((many, expected), (one, rows)) = (read(7), read(SIZE[1]));
            assert!(one.format == many.format && rows == expected, "{what}");
            assert_eq!(one.notices, many.notices, "{what}");
            if compression == NONE
                && let Some(shown) = converted.shown()
            {
                assert!(rows == shown, "{what}");
            }
            assert!(one.memory < planes << 20, "{what}: {}", one.memory);
        }
    }
}

/// An image of inks as it is often stored takes the memory of some rows, and the first is there when it is
/// decoded: here no other is.
#[test]
fn the_first_row_of_inks_in_one_strip_needs_no_other() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    let size = [2048, 100_000];
    let mut file = HandmadeTiff::new(size, &[8; 4], 5, size, false);
    file.set(259, PACKBITS);
    let row = texels(2048 * 4, 3);
    file.chunks = vec![pack_bits(&row)];
    // The file ends behind it, but is said to go on so far that all rows could be there.
    let mut bytes = file.bytes();
    let entry = [0x17, 1, 4, 0, 1, 0, 0, 0];
    let at = bytes.windows(8).position(|window| window == entry).unwrap() + 8;
    bytes[at..at + 4].copy_from_slice(&(2048 * 4 * 100_000u32 / 64).to_le_bytes());
    std::fs::write(&path, bytes).unwrap();
    let mut reader = open(&path).unwrap();
    let header = reader.header().clone();
    assert!(header.memory < 1 << 20, "{}", header.memory);
    let mut first = vec![0; header.row_bytes()];
    reader.read_rows(&mut first).unwrap();
    let left = |ink: u8, black: u8| ((255 - u32::from(ink)) * (255 - u32::from(black)) + 127) / 255;
    let color = |[c, m, y, k]: &[u8; 4]| [*c, *m, *y].map(|ink| left(ink, *k) as u8);
    assert!(first == row.as_chunks().0.iter().flat_map(color).collect::<Vec<u8>>());
    assert!(vastex_build::open_reduced(&path, 512).unwrap().is_none());
}

/// Pages as fax machines send them have rows, too.
#[test]
fn a_fax_of_one_strip_has_the_rows_of_many() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    let is_black = |x: u32, y: u32| (x * (y + 3) / 70).is_multiple_of(3);
    let strip = |first: u32, rows: u32| {
        let mut encoder = fax::encoder::Encoder::new(fax::VecWriter::new());
        for y in first..first + rows {
            let texel = |x: u32| if is_black(x, y) { fax::Color::Black } else { fax::Color::White };
            encoder.encode_line((0..SIZE[0]).map(texel), SIZE[0] as u16).unwrap();
        }
        encoder.finish().unwrap().finish()
    };
    let expected: Vec<u8> =
        (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| if is_black(x, y) { 0 } else { 255 })).collect();
    for rows in [9, SIZE[1]] {
        let mut file = HandmadeTiff::new(SIZE, &[1], 0, [SIZE[0], rows], false);
        file.set(259, 4);
        // What is said of prediction means nothing there.
        file.set(317, 2);
        file.chunks = (0..SIZE[1]).step_by(rows as usize).map(|first| strip(first, rows)).collect();
        let (header, found, fault) = read(&path, &file.bytes());
        assert!(fault.is_none() && found == expected, "{rows}: {fault:?}");
        assert!(header.notices.is_empty(), "{:?}", header.notices);
    }
}

/// A list of lengths that goes on behind that of the only strip is not read whole: the strip is held.
#[test]
fn a_list_of_lengths_without_an_end_is_not_read() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.tif");
    let file = Converted(vec![8; 4], 5, 1, false, "").file(DEFLATE, SIZE[1]);
    let (_, expected, _) = read(&path, &file.bytes());
    let mut bytes = file.bytes();
    let len = file.chunks[0].len() as u32;
    let count = (1u32 << 22) + 1;
    let entry = [0x17, 1, 4, 0, 1, 0, 0, 0];
    let at = bytes.windows(8).position(|window| window == entry).unwrap();
    let end = bytes.len() as u32;
    bytes[at + 4..at + 8].copy_from_slice(&count.to_le_bytes());
    bytes[at + 8..at + 12].copy_from_slice(&end.to_le_bytes());
    bytes.extend(len.to_le_bytes());
    std::fs::write(&path, &bytes).unwrap();
    let long = std::fs::OpenOptions::new().write(true).open(&path).unwrap();
    long.set_len(u64::from(end) + 4 * u64::from(count)).unwrap();
    let mut reader = open(&path).unwrap();
    assert_eq!(reader.header().notices.len(), 2, "{:?}", reader.header().notices);
    let mut rows = vec![0; expected.len()];
    reader.read_rows(&mut rows).unwrap();
    assert!(rows == expected);
}
