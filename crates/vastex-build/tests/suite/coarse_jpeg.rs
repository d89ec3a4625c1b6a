//! Progressive JPEGs at an eighth of their size, from their first scans: beside libjpeg, which decodes all.

mod made;

use std::path::Path;

use mozjpeg::{ColorSpace, Compress, Decompress, ScanMode};
use vastex_build::{ImageHeader, InputFault, Notice, open, open_reduced};

use crate::common::files::{exif, jpeg_with_segment};
use crate::common::sandbox::{Sandbox, hills};
use crate::common::texels;
use made::{Made, Scans};

/// What libjpeg makes of a file at an eighth, without guesses at what the file lacks.
fn by_libjpeg(file: &[u8], channels: usize) -> Vec<u8> {
    let mut decoder = Decompress::new_mem(file).unwrap();
    decoder.do_block_smoothing(false);
    decoder.scale(1);
    let color = if channels == 1 { ColorSpace::JCS_GRAYSCALE } else { ColorSpace::JCS_RGB };
    let mut decoder = decoder.to_colorspace(color).unwrap();
    let mut rows = vec![0; decoder.width() * decoder.height() * channels];
    let row = decoder.width() * channels;
    for row in rows.chunks_exact_mut(row) {
        decoder.read_scanlines_into::<u8>(row).unwrap();
    }
    decoder.finish().unwrap();
    rows
}

/// The small picture of a file: its header, the rows that came, and why no more did.
fn coarse(path: &Path, file: &[u8]) -> (ImageHeader, Vec<u8>, Option<InputFault>) {
    std::fs::write(path, file).unwrap();
    let mut reader = open_reduced(path, 2).unwrap().unwrap();
    let header = reader.header().clone();
    let mut rows = Vec::new();
    for _ in 0..header.height {
        let mut row = vec![0; header.row_bytes()];
        if let Err(fault) = reader.read_rows(&mut row) {
            return (header, rows, Some(fault));
        }
        rows.extend(row);
    }
    assert!(reader.read_rows(&mut vec![0; header.row_bytes()]).is_err(), "there are no more rows");
    (reader.header().clone(), rows, None)
}

fn whole(path: &Path, file: &[u8]) -> Vec<u8> {
    let (_, rows, fault) = coarse(path, file);
    assert!(fault.is_none(), "{fault:?}");
    rows
}

#[test]
fn every_layout_of_blocks_and_scans_is_as_libjpeg_has_it() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.jpg");
    let (one, three) = ([1, 1], |first| [first, [1, 1], [1, 1]].to_vec());
    let layouts: Vec<Vec<[usize; 2]>> = vec![
        vec![one],
        vec![[2, 2]],
        three([1, 1]),
        three([2, 1]),
        three([1, 2]),
        three([2, 2]),
        three([4, 1]),
        three([4, 2]),
        three([1, 4]),
        vec![[2, 2], [2, 1], [1, 2]],
        vec![[1, 1], [2, 2], [1, 1]],
    ];
    let mut seed = 0;
    for blocks in layouts {
        for size in [[97, 83], [8, 8], [129, 16], [1, 70]] {
            for scans in [Scans::Together, Scans::Apart, Scans::LumaFirst] {
                for (restarts, has_long_codes) in [(0, false), (1, true), (7, false)] {
                    seed += 1;
                    let made = Made { scans, restarts, has_long_codes, ..Made::new(size, &blocks, seed) };
                    let file = made.file();
                    let expected = by_libjpeg(&file, blocks.len());
                    assert!(whole(&path, &file) == expected, "{made:?}");
                }
            }
        }
    }
}

/// Components one after the other with all of their coefficients, of which the AC ones are passed over.
#[test]
fn a_sequential_file_of_several_scans_is_as_libjpeg_has_it() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.jpg");
    let mut seed = 100;
    for first in [[1, 1], [2, 1], [2, 2], [1, 2]] {
        for (size, restarts) in [([97, 83], 0), ([8, 8], 1), ([129, 16], 7)] {
            for scans in [Scans::Apart, Scans::LumaFirst] {
                seed += 1;
                let blocks = [first, [1, 1], [1, 1]];
                let made = Made { scans, restarts, is_sequential: true, ..Made::new(size, &blocks, seed) };
                let file = made.file();
                assert!(whole(&path, &file) == by_libjpeg(&file, 3), "{made:?}");
                if size == [8, 8] {
                    continue;
                }
                // Cut off, it says so.
                let (_, rows, fault) = coarse(&path, &file[..file.len() - 40]);
                let is_cut = matches!(fault, Some(InputFault::Truncated { .. }));
                assert!(rows.is_empty() && is_cut, "{fault:?} of {made:?}");
            }
        }
    }
}

#[test]
fn what_is_decoded_before_the_first_row_can_be_broken_off() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.jpg");
    let sequential = Made { is_sequential: true, ..Made::new([97, 83], &[[2, 2], [1, 1], [1, 1]], 7) };
    for scans in [Scans::Apart, Scans::LumaFirst] {
        std::fs::write(&path, Made { scans, ..sequential.clone() }.file()).unwrap();
        let opened = || open_reduced(&path, 2).unwrap().unwrap();
        let mut reader = opened();
        let beginning = reader.beginning().unwrap();
        assert_eq!(beginning.share(), 0.0);
        let mut row = vec![0; reader.header().row_bytes()];
        reader.read_rows(&mut row).unwrap();
        assert_eq!(beginning.share(), 1.0);
        let mut reader = opened();
        let beginning = reader.beginning().unwrap();
        beginning.break_off();
        assert!(matches!(reader.read_rows(&mut row), Err(InputFault::Io(_))) && beginning.share() == 0.0);
    }
    // Rows of a scan of all components come one after the other.
    std::fs::write(&path, Made::new([97, 83], &[[1, 1]], 7).file()).unwrap();
    assert!(open_reduced(&path, 2).unwrap().unwrap().beginning().is_none());
}

#[test]
fn colours_are_what_the_markers_say() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.jpg");
    let three = [[2, 2], [1, 1], [1, 1]];
    let mut pictures = Vec::new();
    for (has_jfif, adobe, ids) in [
        (false, None, *b"\x01\x02\x03"),
        (true, Some(0), *b"RGB"),
        (false, Some(1), *b"RGB"),
        (false, None, *b"\x09\x08\x07"),
        (false, None, *b"RGB"),
        (false, Some(0), *b"\x01\x02\x03"),
    ] {
        let made = Made { has_jfif, adobe, ids, ..Made::new([90, 50], &three, 5) };
        let file = made.file();
        let rows = whole(&path, &file);
        assert!(rows == by_libjpeg(&file, 3), "{made:?}");
        pictures.push(rows);
    }
    let [converted, .., as_it_is] = &pictures[..] else { panic!("there are some") };
    assert!(pictures[..4].iter().all(|rows| rows == converted) && pictures[4] == *as_it_is);
    assert!(converted != as_it_is);
}

#[test]
fn bits_that_come_later_are_taken_for_half_of_what_they_can_be() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.jpg");
    for missing_bits in 1..=3 {
        let made = Made { missing_bits, restarts: 3, ..Made::new([250, 130], &[[1, 1]], 77) };
        let file = made.file();
        // With the scans that have these bits.
        let expected = by_libjpeg(&file, 1);
        let most = made.quant(0) * ((1 << missing_bits) - 1);
        let rows = whole(&path, &file);
        let off: Vec<u32> = rows.iter().zip(&expected).map(|(a, b)| u32::from(a.abs_diff(*b))).collect();
        assert!(off.iter().all(|off| *off <= most.div_ceil(16) + 1), "{missing_bits} bits: {off:?}");
        let mean = |rows: &[u8]| rows.iter().map(|&v| f64::from(v)).sum::<f64>() / rows.len() as f64;
        let bias = (mean(&rows) - mean(&expected)).abs();
        assert!(bias < 0.25 + f64::from(most) / 64.0, "{missing_bits} bits: {bias}");
    }
}

/// A progressive JPEG as programs make it.
fn compressed(size: [u32; 2], channels: usize, data: &[u8], set: impl FnOnce(&mut Compress)) -> Vec<u8> {
    let color = if channels == 1 { ColorSpace::JCS_GRAYSCALE } else { ColorSpace::JCS_RGB };
    let mut compress = Compress::new(color);
    compress.set_size(size[0] as usize, size[1] as usize);
    set(&mut compress);
    let mut started = compress.start_compress(Vec::new()).unwrap();
    started.write_scanlines(data).unwrap();
    started.finish().unwrap()
}

/// A file without all that comes after the scans of DC coefficients.
fn first_scans_alone(file: &[u8]) -> Vec<u8> {
    let holds_others =
        |at: usize| file[at..].starts_with(&[0xff, 0xda]) && file[at + 5 + 2 * usize::from(file[at + 4])] > 0;
    let end = (0..file.len()).find(|&at| holds_others(at)).unwrap();
    [&file[..end], &[0xff, 0xd9]].concat()
}

#[test]
fn files_of_programs_are_as_libjpeg_has_them() {
    let (sandbox, size) = (Sandbox::new(), [411, 260]);
    let path = sandbox.path("image.jpg");
    let full = ((1, 1), (1, 1));
    let halved = ((2, 2), (2, 2));
    for (channels, chroma, mode, is_plain, off_by) in [
        (1, full, None, false, (0, 0.0)),
        (3, full, None, false, (0, 0.0)),
        (3, full, Some(ScanMode::AllComponentsTogether), false, (0, 0.0)),
        (3, full, Some(ScanMode::ScanPerComponent), false, (0, 0.0)),
        // libjpeg's own order of scans, in which the first is without the lowest bit: half of 3, at most, an
        // eighth of that, and as much of the colours.
        (1, full, None, true, (1, 0.3)),
        (3, full, None, true, (3, 0.6)),
        (3, halved, None, false, (0, 0.0)),
        (3, halved, None, true, (3, 0.6)),
    ] {
        let data: Vec<u8> = hills(size, channels)
            .iter()
            .zip(texels(411 * 260 * channels, 9))
            .map(|(hill, noise)| hill.saturating_add(noise / 8))
            .collect();
        let file = compressed(size, channels, &data, |compress| {
            if is_plain {
                compress.set_fastest_defaults();
            }
            // This sets all else back.
            mode.into_iter().for_each(|mode| compress.set_scan_optimization_mode(mode));
            compress.set_quality(90.0);
            compress.set_progressive_mode();
            compress.set_chroma_sampling_pixel_sizes(chroma.0, chroma.1);
        });
        let (header, rows, fault) = coarse(&path, &file);
        assert!(fault.is_none());
        assert_eq!([header.width, header.height], size.map(|side| side.div_ceil(8)));
        // At an eighth libjpeg has two texels across and down of a block of colours, where it can.
        let expected = match chroma == full {
            true => by_libjpeg(&file, channels),
            false => by_libjpeg(&first_scans_alone(&file), channels),
        };
        let off = rows.iter().zip(&expected).map(|(a, b)| a.abs_diff(*b));
        let (most, sum) = (off.clone().max().unwrap(), off.map(u64::from).sum::<u64>());
        let mean = sum as f64 / rows.len() as f64;
        assert!(most <= off_by.0 && mean <= off_by.1, "{channels} {chroma:?} {is_plain}: {most}, {mean}");
        // The whole file says what it takes; this takes next to nothing.
        let all = open(&path).unwrap().header().clone();
        assert!(matches!(all.notices[..], [Notice::WholeImage { why: "a progressive JPEG", .. }]));
        assert!(header.notices.is_empty() && header.memory <= all.memory / 64, "{}", header.memory);
    }
}

#[test]
fn nothing_is_read_beyond_the_first_scans() {
    let (sandbox, size) = (Sandbox::new(), [500, 400]);
    let path = sandbox.path("image.jpg");
    let file = compressed(size, 3, &texels(500 * 400 * 3, 4), |compress| {
        compress.set_fastest_defaults();
        compress.set_progressive_mode();
    });
    let rows = whole(&path, &file);
    let scans: Vec<usize> =
        file.windows(2).enumerate().filter(|(_, bytes)| *bytes == [0xff, 0xda]).map(|(at, _)| at).collect();
    assert!(scans.len() > 5 && scans[1] < file.len() / 8, "{scans:?} of {}", file.len());
    assert!(whole(&path, &file[..scans[1]]) == rows);
    // Without the end of the first scan rows end, too, and those before are the same.
    let (_, fewer, fault) = coarse(&path, &file[..scans[1] / 2]);
    let in_row = fewer.len() as f64 / rows.len() as f64;
    assert!((0.2..0.6).contains(&in_row) && rows.starts_with(&fewer), "{in_row}");
    assert!(matches!(fault, Some(InputFault::Truncated { .. })), "{fault:?}");
    // The whole of it is an error, and names what is missing.
    let mut reader = open(&path).unwrap();
    let mut row = vec![0; reader.header().row_bytes()];
    assert!(matches!(reader.read_rows(&mut row), Err(InputFault::Truncated { .. })));
}

#[test]
fn what_is_unusual_is_left_to_libjpeg() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.jpg");
    let none = |file: &[u8]| {
        std::fs::write(&path, file).unwrap();
        open_reduced(&path, 2).unwrap().is_none()
    };
    let usual = Made::new([100, 60], &[[1, 1]], 3);
    let file = usual.file();
    assert!(!none(&file) && open_reduced(&path, 26).unwrap().is_none(), "it has 12 texels for 26");
    // One of several scans that says that it is not progressive; shares that no decoder has; and a first scan
    // without its tables.
    let made = Made { scans: Scans::Apart, ..Made::new([100, 60], &[[1, 1]; 3], 3) };
    let mut sequential = made.file();
    assert!(!none(&sequential));
    let frame = sequential.windows(2).position(|bytes| bytes == [0xff, 0xc2]).unwrap();
    sequential[frame + 1] = 0xc0;
    assert!(none(&sequential));
    assert!(none(&Made::new([100, 60], &[[3, 1], [2, 1], [1, 1]], 3).file()));
    let codes = file.windows(2).position(|bytes| bytes == [0xff, 0xc4]).unwrap();
    let mut without = file.clone();
    without[codes + 1] = 0xfe;
    assert!(none(&without));
    // One that is stored turned is upright.
    let turned = jpeg_with_segment(&file, 0xe1, &[b"Exif\0\0", &exif(6)[..]].concat());
    let (header, rows, _) = coarse(&path, &turned);
    assert_eq!([header.width, header.height], [8, 13]);
    let stored = whole(&path, &file);
    assert!((0..13).all(|y| (0..8).all(|x| rows[y * 8 + x] == stored[(7 - x) * 13 + y])));
}

#[test]
fn damaged_files_end_and_panic_nowhere() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("image.jpg");
    let mut state = 7u32;
    let mut next = move |below: usize| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize % below
    };
    let mut ended = 0;
    for (blocks, scans) in [(vec![[1, 1]], Scans::Together), (vec![[2, 2], [1, 1], [1, 1]], Scans::Apart)] {
        let made = Made { scans, restarts: 5, missing_bits: 1, ..Made::new([120, 90], &blocks, 21) };
        let sound = made.file();
        for _ in 0..400 {
            let mut file = sound.clone();
            for _ in 0..=next(3) {
                let at = 2 + next(file.len() - 2);
                file[at] = [0, 0xff, 0xd0, next(256) as u8][next(4)];
            }
            std::fs::write(&path, &file).unwrap();
            let Ok(Some(mut reader)) = open_reduced(&path, 2) else { continue };
            let mut rows = vec![0; reader.header().image_bytes().min(1 << 20) as usize];
            let row = reader.header().row_bytes();
            let count = rows.len() / row;
            ended += u32::from(reader.read_rows(&mut rows[..count * row]).is_err());
        }
    }
    assert!(ended > 100, "{ended} were found to be damaged");
}
