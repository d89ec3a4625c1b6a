//! Kinds of samples, codecs and layouts, laid out by hand: what is shown is what rows of the same file hold.

use vastex_build::{PixelFormat, Sample, open as open_rows};

use super::{open, shown, stored};
use crate::common::files::HandmadeTiff;
use crate::common::texels;

const SIZE: [u32; 2] = [75, 51];

/// All rows of a file.
fn rows(path: &std::path::Path) -> (PixelFormat, Vec<u8>) {
    let mut reader = open_rows(path).unwrap();
    let header = reader.header().clone();
    let mut rows = vec![0; header.row_bytes() * header.height as usize];
    reader.read_rows(&mut rows).unwrap();
    (header.format, rows)
}

/// Returns true if samples go into a layer as they are.
fn is_exact(format: PixelFormat) -> bool {
    format.channels() == 1 || (format.sample() == Sample::U8 && format.channels() != 3)
}

#[test]
fn every_kind_of_sample_is_shown_as_rows_hold_it() {
    let mut exact = 0;
    for big_endian in [false, true] {
        for (bits, sample_format, channels, photometric, extra) in [
            (8, 1, 1, 1, None),
            (8, 1, 1, 0, None),
            (8, 1, 2, 1, Some(2)),
            (8, 1, 4, 2, Some(2)),
            (8, 1, 4, 2, Some(1)),
            (16, 1, 1, 1, None),
            (16, 1, 1, 0, None),
            (8, 2, 1, 1, None),
            (16, 2, 1, 1, None),
            (32, 2, 1, 1, None),
            (32, 3, 1, 1, None),
            (64, 3, 1, 1, None),
        ] {
            for (chunk, tiled, planar) in [([32, 16], true, 1), ([SIZE[0], 7], false, 1), ([32, 16], true, 2)]
            {
                let sample = bits as usize / 8;
                let mut data = texels((SIZE[0] * SIZE[1]) as usize * channels * sample, 7);
                if sample_format == 3 {
                    // No infinities and no NaNs.
                    data.chunks_mut(sample).for_each(|v| v[if big_endian { 0 } else { sample - 1 }] = 0x40);
                }
                let mut file = HandmadeTiff::new(SIZE, &vec![bits; channels], photometric, chunk, tiled);
                file.big_endian = big_endian;
                file.set(339, sample_format);
                if let Some(extra) = extra {
                    file.set(338, extra);
                }
                file.set(284, planar);
                if planar == 2 && channels > 1 {
                    for plane in 0..channels {
                        let of_plane = |texel: &[u8]| texel[plane * sample..][..sample].to_vec();
                        let plane: Vec<u8> = data.chunks(channels * sample).flat_map(of_plane).collect();
                        file.cut(SIZE, sample, chunk, &plane);
                    }
                } else {
                    file.cut(SIZE, channels * sample, chunk, &data);
                }
                let directory = tempfile::tempdir().unwrap();
                let path = directory.path().join("a.tif");
                std::fs::write(&path, file.bytes()).unwrap();
                let what = format!(
                    "{bits} bits of kind {sample_format}, {channels} channels, {photometric}, {chunk:?}"
                );
                let mut expected = data.clone();
                if big_endian {
                    expected.chunks_mut(sample).for_each(<[u8]>::reverse);
                }
                assert!(stored(&path, 0) == expected, "{what}");
                let (format, rows) = rows(&path);
                if is_exact(format) {
                    assert!(shown(open(&path), 0) == (SIZE, rows), "{what}");
                    exact += 1;
                }
            }
        }
    }
    assert_eq!(exact, 2 * 12 * 3);
}

/// One strip that is not compressed, of any size, is read in parts.
#[test]
fn one_strip_is_read_in_parts() {
    let size = [1200, 900];
    let data = texels(size[0] as usize * size[1] as usize * 2, 9);
    let mut file = HandmadeTiff::new(size, &[16], 1, size, false);
    file.cut(size, 2, size, &data);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.tif");
    std::fs::write(&path, file.bytes()).unwrap();
    assert!(stored(&path, 0) == data);
    assert_eq!(open(&path).levels()[0].tile, [1200, 436]);
}

/// As microscopes write it; inches are those of a page, and so are few texels a centimetre, as libvips has
/// them.
#[test]
fn a_resolution_in_centimetres_is_the_size_of_a_texel() {
    let size_of = |unit: u32, across: [u32; 2], down: [u32; 2]| {
        let mut file = HandmadeTiff::new([32, 16], &[8], 1, [16, 16], true);
        file.cut([32, 16], 1, [16, 16], &[1; 32 * 16]);
        file.tags.extend([(282, across.to_vec()), (283, down.to_vec()), (296, vec![unit])]);
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.tif");
        std::fs::write(&path, file.bytes()).unwrap();
        open(&path).about().pixel_size.as_ref().map(|pixel| (pixel.size, pixel.unit.clone()))
    };
    let found = size_of(3, [20_000, 1], [200_000, 4]).unwrap();
    assert_eq!(found, ([0.5, 0.2], "µm".to_owned()));
    assert_eq!(size_of(2, [300, 1], [300, 1]), None);
    assert_eq!(size_of(3, [10, 1], [10, 1]), None);
    assert_eq!(size_of(3, [11_811, 100], [11_811, 100]), None, "300 an inch");
    assert_eq!(size_of(3, [10, 1], [0, 1]), None);
    assert_eq!(size_of(3, [10, 0], [10, 1]), None);
}

/// A tile that a sparse file leaves out is filled with what stands for no data.
#[test]
fn tiles_that_are_left_out_are_filled() {
    let size = [32, 16];
    let mut file = HandmadeTiff::new(size, &[16], 1, [16, 16], true);
    file.cut(size, 2, [16, 16], &[1; 32 * 16 * 2]);
    let whole = file.bytes();
    let places = whole.windows(12).position(|w| w[..8] == [0x44, 1, 4, 0, 2, 0, 0, 0]).unwrap();
    let lengths = whole.windows(12).position(|w| w[..8] == [0x45, 1, 4, 0, 2, 0, 0, 0]).unwrap();
    let at = |entry: usize| u32::from_le_bytes(whole[entry + 8..entry + 12].try_into().unwrap()) as usize;
    let mut sparse = whole.clone();
    sparse[at(places)..at(places) + 4].fill(0);
    sparse[at(lengths)..at(lengths) + 4].fill(0);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.tif");
    std::fs::write(&path, sparse).unwrap();
    let found = stored(&path, 0);
    for row in found.chunks(64) {
        assert_eq!((&row[..32], &row[32..]), (&[0; 32][..], &[1; 32][..]));
    }
}
