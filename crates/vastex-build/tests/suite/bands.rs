//! TIFF files of more bands than a picture has: some of them are shown, built and cut out, exactly as they
//! are stored.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::pyramids::{shown, whole};
use vastex_build::{
    BuildOptions, CropSource, DecodeOptions, Decoding, Notice, TiffSource, bands_to_choose, build,
    open as open_rows,
};
use vastex_core::LayerFormat;
use vastex_tiles::{Container, TileSource};

const SIZE: [u32; 2] = [150, 70];
const BANDS: u16 = 7;

/// What a band has at a texel.
fn value(band: u16, x: u32, y: u32) -> u16 {
    (u32::from(band) * 9000 + x * 31 + y * 7) as u16
}

/// A TIFF file of seven bands of 16 bits, in strips of 16 rows: side by side or in planes, with names of two
/// of them.
fn tiff(path: &Path, is_planar: bool) {
    let names = "<GDALMetadata><Item name=\"DESCRIPTION\" sample=\"0\" role=\"description\">coastal</Item>\
                 <Item name=\"OTHER\" sample=\"1\">no name</Item>\
                 <Item name=\"DESCRIPTION\" sample=\"4\" role=\"description\">near infrared</Item></GDALMetadata>";
    let texel = |band: u16, x: u32, y: u32| value(band, x, y).to_le_bytes();
    let rows = |y: u32| y * 16..(y * 16 + 16).min(SIZE[1]);
    let mut strips: Vec<Vec<u8>> = Vec::new();
    for band in 0..if is_planar { BANDS } else { 1 } {
        for strip in 0..SIZE[1].div_ceil(16) {
            let texels = rows(strip).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
            strips.push(match is_planar {
                true => texels.flat_map(|(x, y)| texel(band, x, y)).collect(),
                false => {
                    texels.flat_map(|(x, y)| (0..BANDS).flat_map(move |band| texel(band, x, y))).collect()
                }
            });
        }
    }
    let count = strips.len() as u32;
    const ENTRIES: u32 = 12;
    let lists = 8 + 2 + ENTRIES * 12 + 4;
    let (bits_at, lengths_at) = (lists, lists + 2 * u32::from(BANDS));
    let offsets_at = lengths_at + 4 * count;
    let names_at = offsets_at + 4 * count;
    let mut at = names_at + names.len() as u32 + 1;
    let planar = if is_planar { 2 } else { 1 };
    let entries: [(u16, u16, u32, u32); ENTRIES as usize] = [
        (256, 4, 1, SIZE[0]),
        (257, 4, 1, SIZE[1]),
        (258, 3, BANDS.into(), bits_at),
        (259, 3, 1, 1),
        (262, 3, 1, 1),
        (273, 4, count, offsets_at),
        (277, 3, 1, BANDS.into()),
        (278, 4, 1, 16),
        (279, 4, count, lengths_at),
        (284, 3, 1, planar),
        (42112, 2, names.len() as u32 + 1, names_at),
        (42113, 2, 2, u32::from_le_bytes([b'0', 0, 0, 0])),
    ];
    let mut file = vec![b'I', b'I', 42, 0, 8, 0, 0, 0, ENTRIES as u8, 0];
    for (tag, kind, count, value) in entries {
        file.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
        file.extend([count.to_le_bytes(), value.to_le_bytes()].concat());
    }
    file.extend([0; 4]);
    (0..BANDS).for_each(|_| file.extend(16u16.to_le_bytes()));
    strips.iter().for_each(|strip| file.extend((strip.len() as u32).to_le_bytes()));
    for strip in &strips {
        file.extend(at.to_le_bytes());
        at += strip.len() as u32;
    }
    file.extend(names.bytes().chain([0]));
    strips.iter().for_each(|strip| file.extend(strip));
    std::fs::write(path, file).unwrap();
}

fn of(path: &Path, bands: &str) -> PathBuf {
    PathBuf::from(format!("{}:bands={bands}", path.display()))
}

/// These bands of all texels, and of four channels the most of alpha.
fn expected(bands: &[u16], has_alpha: bool) -> Vec<u8> {
    let texels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
    let channels = |(x, y)| {
        let alpha = has_alpha.then_some(u16::MAX);
        bands.iter().map(move |band| value(band - 1, x, y)).chain(alpha).flat_map(u16::to_le_bytes)
    };
    texels.flat_map(channels).collect()
}

#[test]
fn any_bands_are_shown_built_and_cut_out() {
    let directory = tempfile::tempdir().unwrap();
    for is_planar in [false, true] {
        let path = directory.path().join("bands.tif");
        tiff(&path, is_planar);
        for (source, bands) in [
            (path.clone(), &[1, 2, 3][..]),
            (of(&path, "5,4,3"), &[5, 4, 3]),
            (of(&path, "7"), &[7]),
            (of(&path, "2,2,6"), &[2, 2, 6]),
        ] {
            let (format, has_alpha) =
                if bands.len() == 1 { (LayerFormat::R16, false) } else { (LayerFormat::Rgba16, true) };
            let expected = expected(bands, has_alpha);
            let tiles = Arc::new(TiffSource::open(&source).unwrap());
            assert_eq!(tiles.facts().shown_bands(), bands);
            assert_eq!(tiles.description().layers[0].format, format);
            let is_first = tiles.notices().contains(&Notice::FirstBands { of: 7 });
            assert_eq!(is_first, source == path, "{}", source.display());
            let (size, texels) = shown(tiles, 0);
            assert_eq!(size, SIZE);
            assert!(texels == expected, "{}, planar {is_planar}", source.display());
            let output = directory.path().join("out.vastex");
            build(&[&source], &output, &BuildOptions::default(), &()).unwrap();
            let container = Arc::new(Container::open_file(&output).unwrap());
            assert!(shown(container, 0).1 == expected);
            let in_memory = Decoding::open(&source, &DecodeOptions::default()).unwrap().run(&()).unwrap();
            assert!(shown(in_memory, 0).1 == expected);
            let cut = CropSource::open(&source, 0).unwrap();
            let all: Vec<u16> = (1..=BANDS).collect();
            let is_all = source == path;
            assert_eq!(usize::from(cut.channels()), if is_all { 7 } else { bands.len() });
            assert!(whole(cut) == self::expected(if is_all { &all } else { bands }, false));
        }
        let about = TiffSource::open(&path).unwrap().about().clone();
        let names = [(0, "coastal"), (4, "near infrared")];
        let named = |n| names.iter().find(|(band, _)| *band == n).map(|(_, name)| (*name).to_owned());
        assert_eq!(bands_to_choose(&path), Some(7));
        assert_eq!(about.bands, (0..7).map(named).collect::<Vec<_>>());
    }
}

#[test]
fn bands_that_are_not_there_are_told() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("bands.tif");
    tiff(&path, false);
    for bad in ["0", "8", "1,2", "1,2,3,4", "", "a", "-1", "1, 2,3"] {
        let why = TiffSource::open(of(&path, bad)).err().unwrap().to_string();
        assert!(why.contains(&format!("has no bands '{bad}'; it has 7")), "{why}");
        let rows = open_rows(&of(&path, bad)).err().unwrap().to_string();
        assert!(rows.contains("it has 7"), "{rows}");
    }
    // Another file has none to choose from, and one that is not there is that.
    let png = directory.path().join("a.png");
    crate::common::write_png(&png, [2, 2], png::ColorType::Rgb, png::BitDepth::Eight, &[0; 12]);
    assert!(open_rows(&of(&png, "1")).is_err());
    assert_eq!(bands_to_choose(&png), None);
    assert_eq!(bands_to_choose(&crate::pyramids::fixture("cog-jpeg.tif")), None);
    assert!(open_rows(&of(&directory.path().join("gone.tif"), "1")).is_err());
}
