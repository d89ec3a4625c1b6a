//! What GDAL, libvips, tifffile, maketx and a slide scanner's layout make of a picture, against builds of the
//! same files.

use std::fs::File;
use std::path::PathBuf;
use std::sync::Arc;

use pollster::block_on;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::Gray32Float;
use tiff::tags::Tag;
use vastex_build::{
    BuildOptions, PixelFormat, TiffAbout, TiffOther, TiffSource, build, image_in_file, open as open_rows,
};
use vastex_tiles::{Container, TileSource, conformance};

use super::{fixture, open, shown, stored};

/// Each with the levels that it stores and its other images.
const FIXTURES: &[(&str, &[u32], &[&str])] = &[
    ("cog-deflate-u16.tif", &[0, 1], &[]),
    ("cog-jpeg.tif", &[0, 1], &["mask", "mask"]),
    ("cog-lzw-i16.tif", &[0, 1], &[]),
    ("cog-palette.tif", &[0, 1], &[]),
    ("cog-zstd-f32.tif", &[0, 1], &[]),
    ("lzw-imagecodecs.tif", &[0], &[]),
    ("maketx-half.tx", &[0, 1, 2, 3, 4, 5, 6], &[]),
    ("maketx.tx", &[0, 1, 2, 3, 4, 5, 6, 7], &[]),
    ("ome-slide.ome.tif", &[0, 1], &["macro", "label", "image"]),
    ("ome-subifds.ome.tif", &[0, 1, 2], &[]),
    ("planes-big-endian.tif", &[0, 1, 2], &[]),
    ("scan-fax4.tif", &[0], &[]),
    ("slide-jpeg.svs", &[0, 2, 4], &["thumbnail", "label", "macro"]),
    ("slide-jpeg2000.svs", &[0, 2, 4], &["thumbnail", "label", "macro"]),
    ("slide-jpeg2000-ycbcr.svs", &[0, 2], &["thumbnail", "label", "macro"]),
    ("slide-jpeg2000-ycbcr-420.svs", &[0, 2], &["thumbnail", "label", "macro"]),
    ("vips-chained.tif", &[0, 1, 2], &[]),
    ("vips-f32.tif", &[0, 1, 2], &[]),
    ("vips-i16.tif", &[0, 1, 2], &[]),
    ("vips-rgb-jpeg.tif", &[0, 1, 2], &[]),
    ("vips-subifd-jpeg.tif", &[0, 1, 2], &[]),
];

#[test]
fn levels_and_other_images_are_told_apart() {
    for (name, levels, others) in FIXTURES {
        let source = open(&fixture(name));
        let found: Vec<u32> = source.levels().iter().map(|level| level.level).collect();
        assert_eq!(found, *levels, "{name}");
        let found: Vec<&str> = source.others().iter().map(|other| other.role).collect();
        assert_eq!(found, *others, "{name}");
        assert_eq!(conformance(&*source), Ok(()), "{name}");
    }
}

#[test]
fn level_0_is_what_a_build_makes_of_the_file() {
    for (name, ..) in FIXTURES {
        let source = open(&fixture(name));
        let directory = tempfile::tempdir().unwrap();
        let output = directory.path().join("built.vastex");
        let geometry = &source.description().geometry;
        let options = BuildOptions { page: geometry.page()[0], ..BuildOptions::default() };
        build(&[fixture(name)], &output, &options, &()).unwrap();
        let container = Arc::new(Container::open_file(&output).unwrap());
        assert_eq!(source.description(), container.description(), "{name}");
        let mut pages = 0;
        assert!(shown(source.clone(), 0) == shown(container.clone(), 0), "level 0 of {name} differs");
        // With their borders, but for a picture whose levels all lie in one tile.
        for pos in geometry.pages_of_level(0).filter(|pos| !geometry.is_tail(*pos)) {
            let texels = |tiles: &dyn TileSource| {
                block_on(tiles.read(pos)).unwrap().decode(container.description()).unwrap()
            };
            assert!(texels(&*source) == texels(&*container), "{pos} of {name} differs");
            pages += 1;
        }
        assert!(pages > 0 || geometry.tail().first_level() == 0, "{name}");
        // A level that the file lacks is made as a build makes it.
        if source.levels().iter().all(|level| level.level != 1) {
            assert!(shown(source.clone(), 1) == shown(container.clone(), 1), "level 1 of {name} differs");
        }
    }
}

/// Texels as a layer has them: colours with alpha.
fn widened(texels: &[u8], format: PixelFormat) -> Vec<u8> {
    match format == PixelFormat::RGB8 {
        true => texels.as_chunks::<3>().0.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect(),
        false => texels.to_vec(),
    }
}

#[test]
fn a_coarser_level_shows_what_the_file_stores_there() {
    let mut compared = 0;
    for (name, levels, _) in FIXTURES {
        let format = open_rows(&fixture(name)).unwrap().header().format;
        // What is shown of palettes and bits is made of what is stored.
        if ["cog-palette.tif", "scan-fax4.tif"].contains(name) {
            continue;
        }
        // Others become numbers of another kind.
        if ![PixelFormat::GREY8, PixelFormat::GREY16, PixelFormat::RGB8].contains(&format) {
            continue;
        }
        let source = open(&fixture(name));
        for level in *levels {
            let stored_size = source.levels().iter().find(|found| found.level == *level).unwrap().size;
            let (size, texels) = shown(source.clone(), *level);
            let expected = widened(&stored(&fixture(name), *level), format);
            let texel = texels.len() / (size[0] * size[1]) as usize;
            let rows = texels.chunks(size[0] as usize * texel);
            let expected_rows = expected.chunks(stored_size[0] as usize * texel);
            for (row, expected) in rows.zip(expected_rows) {
                let count = row.len().min(expected.len());
                assert!(row[..count] == expected[..count], "level {level} of {name} differs");
            }
            compared += 1;
        }
    }
    assert!(compared > 20, "{compared}");
}

/// The images of a chain by the crate `tiff`, which has no part in what is compared with it.
#[test]
fn chains_are_what_another_reader_finds() {
    for (name, chain) in [
        ("vips-chained.tif", &[(0, 0), (1, 1), (2, 2)][..]),
        ("maketx.tx", &[(0, 0), (1, 1), (2, 2), (3, 3)]),
        ("cog-deflate-u16.tif", &[(0, 0), (1, 1)]),
        ("cog-lzw-i16.tif", &[(0, 0), (1, 1)]),
    ] {
        let mut decoder = Decoder::new(File::open(fixture(name)).unwrap()).unwrap();
        for (image, level) in chain {
            decoder.seek_to_image(*image).unwrap();
            let expected: Vec<u8> = match decoder.read_image().unwrap() {
                DecodingResult::U8(texels) => texels,
                DecodingResult::U16(texels) => texels.iter().flat_map(|v| v.to_le_bytes()).collect(),
                DecodingResult::I16(texels) => texels.iter().flat_map(|v| v.to_le_bytes()).collect(),
                other => panic!("{name}: {other:?}"),
            };
            assert!(stored(&fixture(name), *level) == expected, "level {level} of {name} differs");
        }
    }
}

/// Of compression 33003, what OpenSlide shows: it decodes by OpenJPEG and has a conversion of its own.
#[test]
fn ycbcr_in_jpeg_2000_is_what_openslide_shows() {
    for (name, most) in [("slide-jpeg2000-ycbcr", 0), ("slide-jpeg2000-ycbcr-420", 0)] {
        let expected = std::io::BufReader::new(File::open(fixture(&format!("{name}.png"))).unwrap());
        let mut expected = png::Decoder::new(expected).read_info().unwrap();
        let mut texels = vec![0; expected.output_buffer_size().unwrap()];
        expected.next_frame(&mut texels).unwrap();
        let found = stored(&fixture(&format!("{name}.svs")), 0);
        assert_eq!(found.len(), texels.len(), "{name}");
        let apart = found.iter().zip(&texels).map(|(found, expected)| found.abs_diff(*expected));
        let worst = apart.max().unwrap();
        assert!(worst <= most, "{name}: {worst}");
    }
}

#[test]
fn images_of_ome_are_what_their_names_say() {
    let slide = open(&fixture("ome-slide.ome.tif"));
    let named: Vec<_> =
        slide.others().iter().map(|other| (&*other.name, other.title.as_deref(), other.size)).collect();
    let expected = [
        // Half as large as the slide, and no level of it.
        ("macro", Some("macro image"), [101, 70]),
        ("label", Some("label image"), [17, 15]),
        ("image", Some("detail & edge"), [50, 40]),
    ];
    assert_eq!(named, expected);
    let shown_of = |name: &str| {
        let path = PathBuf::from(format!("{}:{name}", fixture("ome-slide.ome.tif").display()));
        shown(open(&path), 0).1
    };
    let whole = shown(slide.clone(), 0).1;
    let texel = |x: usize, y: usize| whole[4 * (203 * y + x)..][..4].to_vec();
    let label: Vec<u8> = (0..15 * 17).flat_map(|n| texel(n % 17 * 12, n / 17 * 10)).collect();
    assert!(shown_of("label") == label);
    let detail: Vec<u8> = (0..40 * 50).flat_map(|n| texel(n % 50, n / 50)).collect();
    assert!(shown_of("image") == detail);
}

#[test]
fn sizes_places_and_magnifications_are_told() {
    let cog = open(&fixture("cog-deflate-u16.tif"));
    let place = cog.about().place.as_ref().unwrap();
    assert_eq!(
        (place.from_texels, place.epsg),
        ([10.0, 0.0, 500_000.0, 0.0, -10.0, 4_600_000.0], Some(32633))
    );
    assert!(place.name.as_deref().unwrap().contains("UTM zone 33N"), "{place:?}");
    let texel = cog.about().pixel_size.as_ref().unwrap();
    assert_eq!((texel.size, texel.unit.as_str()), ([10.0; 2], "metre"));
    for name in ["slide-jpeg.svs", "slide-jpeg2000.svs"] {
        let slide = open(&fixture(name));
        let texel = slide.about().pixel_size.as_ref().unwrap();
        assert_eq!((texel.size, texel.unit.as_str()), ([0.499; 2], "µm"));
        assert_eq!(slide.about().magnification, Some(20.0));
    }
    let ome = open(&fixture("ome-slide.ome.tif"));
    assert_eq!(ome.about().pixel_size.as_ref().unwrap().size, [0.25; 2]);
    let ome = open(&fixture("ome-subifds.ome.tif"));
    let texel = ome.about().pixel_size.as_ref().unwrap();
    assert_eq!((texel.size, texel.unit.as_str()), ([0.325; 2], "µm"));
    assert_eq!(ome.about().place, None);
    assert_eq!(ome.about().nodata, None);
    // The same of a file that nobody opens as a pyramid, and nothing of one that is no TIFF.
    for (name, source) in [("cog-deflate-u16.tif", &cog), ("ome-subifds.ome.tif", &ome)] {
        assert_eq!(TiffAbout::of_file(&fixture(name)).as_ref(), Some(source.about()));
    }
    assert_eq!(TiffAbout::of_file(&fixture("gone.tif")), None);
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
    assert_eq!(TiffAbout::of_file(std::path::Path::new(manifest)), None);
}

#[test]
fn the_value_without_data_is_told() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("heights.tif");
    for (text, expected) in [("-9999", Some(-9999.0)), (" -3.5e38 ", Some(-3.5e38)), ("none", None)] {
        let mut encoder = TiffEncoder::new(File::create(&path).unwrap()).unwrap();
        let mut image = encoder.new_image::<Gray32Float>(4, 2).unwrap();
        image.encoder().write_tag(Tag::Unknown(42113), text).unwrap();
        image.write_data(&[-9999.0f32; 8]).unwrap();
        assert_eq!(TiffAbout::of_file(&path).unwrap().nodata, expected, "{text:?}");
    }
}

#[test]
fn other_images_are_opened_by_their_names() {
    let of = |name: &str, image: &str| PathBuf::from(format!("{}:{image}", fixture(name).display()));
    for (name, ..) in FIXTURES.iter().filter(|(.., others)| !others.is_empty()) {
        let listed = open(&fixture(name)).others().to_vec();
        assert_eq!(TiffOther::of_file(&fixture(name)), listed);
        for other in listed {
            let path = of(name, &other.name);
            let image = TiffSource::open(&path).unwrap();
            let [width, height, _] = image.description().geometry.size();
            assert_eq!([u64::from(width), u64::from(height)], other.size, "{}", path.display());
            assert_eq!(conformance(&image), Ok(()), "{}", path.display());
            assert!(image.others().is_empty() && image.about().magnification.is_none());
        }
    }
    let cog = open(&fixture("cog-jpeg.tif"));
    assert_eq!(cog.others().iter().map(|other| &*other.name).collect::<Vec<_>>(), ["mask", "mask2"]);
    for (name, image, place) in [
        (
            "slide-jpeg.svs",
            "labels",
            "no image 'labels' beside its first one; the others are thumbnail, label, macro",
        ),
        ("maketx.tx", "label", "there is no other"),
    ] {
        let error = TiffSource::open(of(name, image)).err().unwrap().to_string();
        assert!(error.contains(place), "{error}");
    }
    assert_eq!(image_in_file(&fixture("maketx.tx")), None);
    assert_eq!(image_in_file(&of("gone.tif", "label")), None);
}
