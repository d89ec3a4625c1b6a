//! Pictures that are stored turned or mirrored come out upright, from every format that can say so.

use crate::common::files::{HandmadeTiff, exif, jpeg, jpeg_with_segment, smooth};
use crate::common::{texels, write_png};
use crate::readers::read;
use png::{BitDepth, ColorType};
use vastex_build::Notice;

/// Taller and wider than what is turned at once, and a multiple of nothing.
const SIZE: [u32; 2] = [71, 45];

fn png(size: [u32; 2], color: ColorType, depth: BitDepth, data: &[u8], orientation: u8) -> Vec<u8> {
    let file = tempfile::NamedTempFile::new().unwrap();
    write_png(file.path(), size, color, depth, data);
    crate::common::files::png_with_chunk(&std::fs::read(file.path()).unwrap(), b"eXIf", &exif(orientation))
}

/// Where the texel in a stored row and column is seen, in EXIF's words: what side the first row is, and the
/// first column.
fn place(orientation: u8, [row, column]: [usize; 2], [width, height]: [usize; 2]) -> [usize; 2] {
    let (right, bottom) = (width - 1, height - 1);
    match orientation {
        1 => [column, row],                  // top, left
        2 => [right - column, row],          // top, right
        3 => [right - column, bottom - row], // bottom, right
        4 => [column, bottom - row],         // bottom, left
        5 => [row, column],                  // left, top
        6 => [bottom - row, column],         // right, top
        7 => [bottom - row, right - column], // right, bottom
        _ => [row, right - column],          // left, bottom
    }
}

/// The stored picture, with each texel put where it is seen.
fn turned(stored: &[u8], texel: usize, orientation: u8) -> Vec<u8> {
    turned_of(SIZE, stored, texel, orientation)
}

/// As [`turned`], of a stored picture of any size.
fn turned_of(size: [u32; 2], stored: &[u8], texel: usize, orientation: u8) -> Vec<u8> {
    let [width, height] = size.map(|n| n as usize);
    let row_texels = if orientation >= 5 { height } else { width };
    let mut upright = vec![0; stored.len()];
    for (i, from) in stored.chunks(texel).enumerate() {
        let [x, y] = place(orientation, [i / width, i % width], [width, height]);
        upright[(y * row_texels + x) * texel..][..texel].copy_from_slice(from);
    }
    upright
}

/// Checks a file of `SIZE`, made for each orientation.
fn check(file: impl Fn(u8) -> Vec<u8>) {
    let (upright, stored) = read(&file(1));
    assert_eq!(upright.notices, []);
    let texel = upright.format.texel_bytes();
    for orientation in 2..=8 {
        let (header, image) = read(&file(orientation));
        let [w, h] = SIZE;
        assert_eq!([header.width, header.height], if orientation >= 5 { [h, w] } else { [w, h] });
        assert!(image == turned(&stored, texel, orientation), "orientation {orientation}");
        let bytes = stored.len() as u64;
        match orientation {
            2 => {
                assert_eq!(header.notices, [Notice::Turned(2)]);
                assert_eq!(header.memory, upright.memory);
            }
            _ => {
                let why = "an image that is stored turned or upside down";
                assert_eq!(
                    header.notices,
                    [Notice::Turned(orientation.into()), Notice::WholeImage { bytes, why }]
                );
                assert!(header.memory >= upright.memory + bytes);
            }
        }
    }
}

/// Turned by hand: `abc` above `def`.
#[test]
fn six_texels_in_all_orientations() {
    for (orientation, expected) in [
        (1, "abc def"),
        (2, "cba fed"),
        (3, "fed cba"),
        (4, "def abc"),
        (5, "ad be cf"),
        (6, "da eb fc"),
        (7, "fc eb da"),
        (8, "cf be ad"),
    ] {
        let (header, image) =
            read(&png([3, 2], ColorType::Grayscale, BitDepth::Eight, b"abcdef", orientation));
        let rows: Vec<_> =
            image.chunks(header.width as usize).map(|row| std::str::from_utf8(row).unwrap()).collect();
        assert_eq!(rows.join(" "), expected, "orientation {orientation}");
    }
}

#[test]
fn png_of_every_orientation() {
    let texel_count = (SIZE[0] * SIZE[1]) as usize;
    let data = texels(texel_count * 8, 5);
    check(|o| png(SIZE, ColorType::Rgb, BitDepth::Eight, &data[..3 * texel_count], o));
    check(|o| png(SIZE, ColorType::Rgba, BitDepth::Sixteen, &data, o));
}

#[test]
fn jpeg_of_every_orientation() {
    let file = jpeg(SIZE, 3, false, &smooth(SIZE, 3));
    check(|o| jpeg_with_segment(&file, 0xe1, &[b"Exif\0\0", &exif(o)[..]].concat()));
}

#[test]
fn tiff_of_every_orientation() {
    let data = texels((SIZE[0] * SIZE[1]) as usize * 6, 7);
    for tiled in [false, true] {
        let chunk = if tiled { [16, 32] } else { [SIZE[0], 7] };
        check(|o| {
            let mut file = HandmadeTiff::new(SIZE, &[16, 16, 16], 2, chunk, tiled);
            file.set(274, o.into());
            file.cut(SIZE, 6, chunk, &data);
            file.bytes()
        });
    }
}

#[test]
fn what_is_no_orientation_is_upright() {
    let data = texels((SIZE[0] * SIZE[1]) as usize, 9);
    for orientation in [0, 9, 255] {
        let (header, image) = read(&png(SIZE, ColorType::Grayscale, BitDepth::Eight, &data, orientation));
        assert_eq!(header.notices, []);
        assert!(image == data);
    }
}

/// A picture that is too large to be turned whole is turned at a share of its size.
#[test]
fn a_turned_picture_is_had_at_a_share_without_holding_all_of_it() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.png");
    let data = texels((SIZE[0] * SIZE[1] * 3) as usize, 17);
    let small = SIZE.map(|side| side.div_ceil(2));
    let of = |n: u32| [n % small[0] * 2 + 1, n / small[0] * 2 + 1];
    let kept: Vec<u8> = (0..small[0] * small[1])
        .map(of)
        .flat_map(|[x, y]| {
            let at = 3 * (y.min(SIZE[1] - 1) * SIZE[0] + x.min(SIZE[0] - 1)) as usize;
            [data[at], data[at + 1], data[at + 2]]
        })
        .collect();
    for orientation in 1..=8 {
        std::fs::write(&path, png(SIZE, ColorType::Rgb, BitDepth::Eight, &data, orientation)).unwrap();
        let most = kept.len() as u64;
        let reader = vastex_build::open_shrunk(&path, most, 1 << 30).unwrap();
        if orientation == 1 {
            assert!(reader.is_none(), "it is not turned");
            continue;
        }
        let mut reader = reader.unwrap();
        let header = reader.header().clone();
        let [w, h] = small;
        assert_eq!([header.width, header.height], if orientation >= 5 { [h, w] } else { [w, h] });
        assert!(header.notices.contains(&Notice::Turned(orientation.into())));
        let mut found = vec![0; kept.len()];
        found.chunks_mut(5 * header.row_bytes()).for_each(|rows| reader.read_rows(rows).unwrap());
        assert!(found == turned_of(small, &kept, 3, orientation), "orientation {orientation}");
        assert!(vastex_build::open_shrunk(&path, most, 0).unwrap().is_none(), "no memory is too little");
    }
}
