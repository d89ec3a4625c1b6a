//! Colour profiles: what becomes of colours is computed here from primaries and curves alone, in f64.

use crate::common::files::{HandmadeTiff, jpeg, jpeg_with_segment, png_with_chunk};
use crate::common::profiles::{
    ADOBE_RGB, Curve, DISPLAY_P3, Points, SRGB, grey_profile, in_srgb, profile, rgb_profile,
};
use crate::common::{texels, tiles};
use png::{BitDepth, ColorType};
use vastex_build::{BuildOptions, ImageHeader, LayerInput, Notice, build};
use vastex_core::LayerFormat;

/// As the file `curv` of a profile and `gAMA` of PNG can hold them.
const ADOBE_GAMMA: Curve = Curve::Gamma(563.0 / 256.0);
const OLD_MAC_GAMMA: Curve = Curve::Gamma(461.0 / 256.0);

/// Colours from all over the cube, `CUBE` along each side, as numbers 0 to 8.
const CUBE: u32 = 9;
const SIZE: [u32; 2] = [CUBE * CUBE, CUBE];

fn cube() -> impl Iterator<Item = [u32; 3]> {
    (0..CUBE).flat_map(|r| (0..CUBE).flat_map(move |g| (0..CUBE).map(move |b| [r, g, b])))
}

/// The cube in 8 bits.
fn cube8() -> Vec<u8> {
    cube().flat_map(|color| color.map(|v| (v * 255 / 8) as u8)).collect()
}

/// The cube in 16 bits with alpha, little-endian.
fn cube16() -> Vec<u8> {
    let alpha = (0..).map(|i: u32| (i * 89) as u16);
    let texel = |(color, alpha): ([u32; 3], u16)| {
        [color.map(|v| (v * 65535 / 8) as u16).as_slice(), &[alpha]].concat()
    };
    cube().zip(alpha).flat_map(texel).flat_map(u16::to_le_bytes).collect()
}

fn swapped(samples: &[u8]) -> Vec<u8> {
    samples.chunks(2).flat_map(|s| [s[1], s[0]]).collect()
}

/// The image as a picture in sRGB.
fn read(bytes: &[u8]) -> (ImageHeader, Vec<u8>) {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    let mut reader = vastex_build::in_srgb(vastex_build::open(file.path()).unwrap());
    let row = reader.header().row_bytes();
    let mut image = vec![0; row * reader.header().height as usize];
    let (first, rest) = image.split_at_mut(row);
    reader.read_rows(first).unwrap();
    reader.read_rows(rest).unwrap();
    (reader.header().clone(), image)
}

fn png(
    size: [u32; 2],
    color: ColorType,
    depth: BitDepth,
    data: &[u8],
    set: impl FnOnce(&mut png::Info<'_>),
) -> Vec<u8> {
    let mut out = Vec::new();
    let mut info = png::Info::with_size(size[0], size[1]);
    (info.color_type, info.bit_depth) = (color, depth);
    set(&mut info);
    let mut writer = png::Encoder::with_info(&mut out, info).unwrap().write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    out
}

fn png8(set: impl FnOnce(&mut png::Info<'_>)) -> Vec<u8> {
    png(SIZE, ColorType::Rgb, BitDepth::Eight, &cube8(), set)
}

fn png_with_profile(profile: &[u8]) -> Vec<u8> {
    png8(|info| info.icc_profile = Some(profile.to_vec().into()))
}

fn converted(from: &str) -> Notice {
    Notice::ConvertedToSrgb { from: from.into(), is_linear: false }
}

fn ignored(name: &str, why: &'static str) -> Notice {
    Notice::ProfileIgnored { name: name.into(), why }
}

/// The greatest difference from what is right, in steps of 1/255, of colours of 8 bits.
fn error8(image: &[u8], stored: &[u8], curve: Curve, points: Points) -> f64 {
    let differences = image.chunks(3).zip(stored.chunks(3)).flat_map(|(image, stored)| {
        let expected = in_srgb([0, 1, 2].map(|c| f64::from(stored[c]) / 255.0), curve, points, false);
        [0, 1, 2].map(|c| (f64::from(image[c]) - 255.0 * expected[c]).abs())
    });
    differences.fold(0.0, f64::max)
}

#[test]
fn png_of_8_and_16_bits_with_profiles() {
    for (name, curve, points) in [
        ("Display P3", Curve::Srgb, DISPLAY_P3),
        ("Adobe", ADOBE_GAMMA, ADOBE_RGB),
        ("Old", OLD_MAC_GAMMA, SRGB),
    ] {
        let profile = rgb_profile(name, curve, points);
        let (header, image) = read(&png_with_profile(&profile));
        assert_eq!((header.notices, header.linear), (vec![converted(name)], false));
        let worst = error8(&image, &cube8(), curve, points);
        assert!(worst <= 1.5, "{name}: {worst}");

        let stored = cube16();
        let file = png(SIZE, ColorType::Rgba, BitDepth::Sixteen, &swapped(&stored), |info| {
            info.icc_profile = Some(profile.clone().into());
        });
        let (header, image) = read(&file);
        assert_eq!(
            (header.notices, header.format),
            (vec![converted(name)], vastex_build::PixelFormat::RGBA16)
        );
        let (mut worst, mut sum) = (0f64, 0.0);
        for (image, stored) in image.chunks(8).zip(stored.chunks(8)) {
            assert_eq!(image[6..], stored[6..]);
            let number =
                |texel: &[u8], c: usize| f64::from(u16::from_le_bytes([texel[2 * c], texel[2 * c + 1]]));
            let expected = in_srgb([0, 1, 2].map(|c| number(stored, c) / 65535.0), curve, points, false);
            for (c, expected) in expected.iter().enumerate() {
                let error = (number(image, c) / 65535.0 - expected).abs() * 255.0;
                (worst, sum) = (worst.max(error), sum + error);
            }
        }
        // The worst is where primaries cancel. The mean would be a quarter if 16 bits did not stay so.
        let mean = sum / f64::from(3 * CUBE.pow(3));
        assert!(worst <= 1.0 && mean <= 0.05, "{name}: {worst}, {mean}");
    }
}

/// Blocks of one colour each, which JPEG keeps nearly as they are.
#[test]
fn jpeg_with_a_profile_in_several_segments() {
    let size = [27 * 8, 8];
    let color = |x: u32| [x / 9, x / 3 % 3, x % 3].map(|v| (40 + 80 * v) as u8);
    let stored: Vec<u8> = (0..8).flat_map(|_| (0..size[0]).flat_map(|x| color(x / 8))).collect();
    let file = jpeg(size, 3, false, &stored);
    let profile = rgb_profile("Display P3", Curve::Srgb, DISPLAY_P3);
    let part = |number: u8, count: u8, bytes: &[u8]| [b"ICC_PROFILE\0", &[number, count][..], bytes].concat();
    // The last in front, since each is put right after the start.
    let cut = profile.len() / 3;
    let whole = jpeg_with_segment(&file, 0xe2, &part(3, 3, &profile[2 * cut..]));
    let lacking = jpeg_with_segment(&whole, 0xe2, &part(1, 3, &profile[..cut]));
    let whole = jpeg_with_segment(&lacking, 0xe2, &part(2, 3, &profile[cut..2 * cut]));

    let (_, decoded) = read(&file);
    let (header, image) = read(&whole);
    assert_eq!(header.notices, [converted("Display P3")]);
    let worst = error8(&image, &decoded, Curve::Srgb, DISPLAY_P3);
    assert!(worst <= 1.5, "{worst}");

    let (header, image) = read(&lacking);
    assert_eq!(header.notices, [ignored("an ICC profile", "it is damaged")]);
    assert!(image == decoded);
}

#[test]
fn tiff_with_a_profile() {
    for tiled in [false, true] {
        let chunk = if tiled { [16, 16] } else { [SIZE[0], 2] };
        let mut file = HandmadeTiff::new(SIZE, &[8, 8, 8], 2, chunk, tiled);
        file.profile = Some(rgb_profile("Adobe", ADOBE_GAMMA, ADOBE_RGB));
        file.cut(SIZE, 3, chunk, &cube8());
        let (header, image) = read(&file.bytes());
        assert_eq!(header.notices, [converted("Adobe")]);
        let worst = error8(&image, &cube8(), ADOBE_GAMMA, ADOBE_RGB);
        assert!(worst <= 1.5, "{worst}");
    }
}

#[test]
fn what_is_srgb_or_its_light_already_costs_nothing() {
    let (plain, stored) = read(&png8(|_| ()));
    assert!(stored == cube8());
    for (curve, linear) in [(Curve::Srgb, false), (Curve::Gamma(1.0), true)] {
        let (header, image) = read(&png_with_profile(&rgb_profile("any name", curve, SRGB)));
        assert_eq!((&header.notices, header.linear, header.memory), (&vec![], linear, plain.memory));
        assert!(image == stored);
    }
    // Light of other primaries stays light.
    let (header, image) = read(&png_with_profile(&rgb_profile("light", Curve::Gamma(1.0), DISPLAY_P3)));
    assert_eq!(header.notices, [Notice::ConvertedToSrgb { from: "light".into(), is_linear: true }]);
    assert!(header.linear && header.memory > plain.memory);
    for (image, stored) in image.chunks(3).zip(stored.chunks(3)) {
        let light = [0, 1, 2].map(|c| f64::from(stored[c]) / 255.0);
        let expected = in_srgb(light, Curve::Gamma(1.0), DISPLAY_P3, true);
        assert!((0..3).all(|c| (f64::from(image[c]) - 255.0 * expected[c]).abs() <= 1.0), "{stored:?}");
    }
}

#[test]
fn grey_with_a_profile() {
    let ramp: Vec<u8> = (0..=255).flat_map(|v| [v, 255 - v]).collect();
    let profile = grey_profile("Grey 1.8", OLD_MAC_GAMMA);
    let file = png([256, 2], ColorType::GrayscaleAlpha, BitDepth::Eight, &ramp.repeat(2), |info| {
        info.icc_profile = Some(profile.clone().into());
    });
    let file_of_16 = png([256, 2], ColorType::Grayscale, BitDepth::Sixteen, &ramp.repeat(2), |info| {
        info.icc_profile = Some(profile.clone().into());
    });
    let expected = |grey: f64| in_srgb([grey; 3], OLD_MAC_GAMMA, SRGB, false)[1];
    let (header, image) = read(&file);
    assert_eq!(header.notices, [converted("Grey 1.8")]);
    for (image, stored) in image.chunks(2).zip(ramp.chunks(2).cycle()) {
        let right = 255.0 * expected(f64::from(stored[0]) / 255.0);
        assert!((f64::from(image[0]) - right).abs() <= 1.0 && image[1] == stored[1], "{stored:?}: {image:?}");
    }
    let (_, image) = read(&file_of_16);
    for (image, stored) in image.chunks(2).zip(ramp.chunks(2).cycle()) {
        let right = expected(f64::from(u16::from_be_bytes([stored[0], stored[1]])) / 65535.0);
        let found = f64::from(u16::from_le_bytes([image[0], image[1]])) / 65535.0;
        assert!((found - right).abs() <= 0.1 / 255.0, "{stored:?}: {found} for {right}");
    }
    let (header, image) = read(&png_with_profile(&profile));
    assert_eq!(header.notices, [ignored("Grey 1.8", "it is for grey images")]);
    assert!(image == cube8());
}

fn gamma(scaled: u32) -> Option<png::ScaledFloat> {
    Some(png::ScaledFloat::from_scaled(scaled))
}

fn chromaticities(points: Points) -> Option<png::SourceChromaticities> {
    let [white, red, green, blue] = points.map(|[x, y]| (x as f32, y as f32));
    Some(png::SourceChromaticities::new(white, red, green, blue))
}

#[test]
fn png_with_gamma_and_primaries() {
    let (header, image) = read(&png8(|info| info.source_gamma = gamma(55_556)));
    assert_eq!(header.notices, [converted("gamma 0.55556")]);
    let worst = error8(&image, &cube8(), Curve::Gamma(1.8), SRGB);
    assert!(worst <= 1.5, "{worst}");

    let adobe = |info: &mut png::Info<'_>| {
        info.source_gamma = gamma(45_470);
        info.source_chromaticities = chromaticities(ADOBE_RGB);
    };
    let (header, image) = read(&png8(adobe));
    assert_eq!(header.notices, [converted("gamma 0.45470 with its own primaries")]);
    // So near to sRGB's gamma, it stands for sRGB's curve.
    let worst = error8(&image, &cube8(), Curve::Srgb, ADOBE_RGB);
    assert!(worst <= 1.5, "{worst}");

    let srgb = |info: &mut png::Info<'_>| {
        info.source_gamma = gamma(45_455);
        info.source_chromaticities = chromaticities(SRGB);
    };
    let (header, image) = read(&png8(srgb));
    assert_eq!(header.notices, []);
    assert!(image == cube8());

    for (g, points) in [(5, SRGB), (55_556, [[0.3; 2]; 4]), (55_556, [[0.0; 2]; 4])] {
        let (header, image) = read(&png8(|info| {
            info.source_gamma = gamma(g);
            info.source_chromaticities = chromaticities(points);
        }));
        assert!(matches!(header.notices[..], [Notice::ProfileIgnored { .. }]), "{:?}", header.notices);
        assert!(image == cube8());
    }
}

/// `cICP` counts before a profile, that before `sRGB`, and that before `gAMA`.
#[test]
fn png_of_several_words_on_its_colours() {
    let code_points = |primaries, transfer, matrix| [primaries, transfer, matrix, 1];
    let adobe = rgb_profile("Adobe", ADOBE_GAMMA, ADOBE_RGB);
    let p3 = png_with_chunk(&png_with_profile(&adobe), b"cICP", &code_points(12, 13, 0));
    let (header, image) = read(&p3);
    assert_eq!(header.notices, [converted("Display P3 (cICP)")]);
    let worst = error8(&image, &cube8(), Curve::Srgb, DISPLAY_P3);
    assert!(worst <= 1.5, "{worst}");

    let (header, _) = read(&png_with_chunk(&png_with_profile(&adobe), b"cICP", &code_points(1, 13, 0)));
    assert_eq!(header.notices, []);
    for (points, expected) in [
        (code_points(9, 16, 0), ignored("BT.2100 PQ (cICP)", "it is for high dynamic range")),
        (code_points(9, 18, 0), ignored("BT.2100 HLG (cICP)", "it is for high dynamic range")),
        (code_points(200, 13, 0), ignored("cICP 200/13", "its numbers are not known")),
    ] {
        let (header, image) = read(&png_with_chunk(&png8(|_| ()), b"cICP", &points));
        assert_eq!(header.notices, [expected]);
        assert!(image == cube8());
    }

    let said = png8(|info| info.srgb = Some(png::SrgbRenderingIntent::Perceptual));
    let (header, image) = read(&png_with_chunk(&said, b"gAMA", &55_556u32.to_be_bytes()));
    assert_eq!(header.notices, []);
    assert!(image == cube8());
}

#[test]
fn profiles_for_other_things_are_told() {
    for (space, why) in [
        (b"CMYK", "it is for CMYK"),
        (b"Lab ", "it is neither for RGB nor for grey"),
        (b"RGB ", "it is incomplete"),
    ] {
        let (header, image) = read(&png_with_profile(&profile(space, "Press", &[])));
        assert_eq!(header.notices, [ignored("Press", why)]);
        assert!(image == cube8());
    }
}

/// Cut off anywhere, or with any bytes replaced: it is converted by what is left, or told of, and never
/// worse.
#[test]
fn profiles_that_are_cut_off_or_nonsense() {
    let sound = rgb_profile("Adobe", ADOBE_GAMMA, ADOBE_RGB);
    let check = |profile: &[u8]| {
        let (header, image) = read(&png_with_profile(profile));
        match &header.notices[..] {
            [Notice::ProfileIgnored { .. }] | [] => assert!(image == cube8()),
            [Notice::ConvertedToSrgb { .. }] => assert_eq!(image.len(), cube8().len()),
            others => panic!("{others:?}"),
        }
        header.notices
    };
    let cuts = || (1..sound.len() - 4).step_by(47);
    let told = cuts().filter(|&len| check(&sound[..len]) != [converted("Adobe")]).count();
    assert!(told * 5 > cuts().count() * 4, "{told}");
    let noise = texels(150, 41);
    for (i, bytes) in noise.chunks(5).enumerate() {
        let mut profile = sound.clone();
        let at = (usize::from(bytes[0]) + 256 * usize::from(bytes[1]) + i) % (profile.len() - 3);
        profile[at..at + 3].copy_from_slice(&bytes[2..]);
        check(&profile);
        check(&bytes.repeat(1 + i));
    }
}

/// A layer of colours is converted; one of other numbers is not, and says so.
#[test]
fn layers_of_colours_are_converted_and_others_are_not() {
    let sandbox = tempfile::tempdir().unwrap();
    let image = sandbox.path().join("image.png");
    let output = sandbox.path().join("out.vastex");
    let options = BuildOptions { page: 128, ..BuildOptions::default() };
    let layer = |name: &str, format| LayerInput { name: name.into(), format, ..(&image).into() };
    let profile = rgb_profile("Display P3", Curve::Srgb, DISPLAY_P3);
    std::fs::write(&image, png_with_profile(&profile)).unwrap();
    let (_, in_srgb) = read(&png_with_profile(&profile));
    for (name, format, expected, notice) in [
        ("color", None, &in_srgb, converted("Display P3")),
        ("albedo", Some(LayerFormat::Rgba8), &in_srgb, converted("Display P3")),
        ("normal", Some(LayerFormat::Rgba8), &cube8(), ignored("Display P3", "the layer holds no colours")),
        ("mask", Some(LayerFormat::Rgba8), &cube8(), ignored("Display P3", "the layer holds no colours")),
    ] {
        let report = build(&[layer(name, format)], &output, &options, &()).unwrap();
        assert_eq!(report.layers[0].notices, [notice], "{name}");
        let (description, tiles) = tiles(&output);
        // All levels lie in the tail, whose first texels are level 0's.
        let (geometry, (_, tile)) = (&description.geometry, &tiles[0]);
        let offset = geometry.tail().offset(0).map(|n| n as usize);
        for y in 0..SIZE[1] as usize {
            for x in 0..SIZE[0] as usize {
                let at = (offset[1] + 4 + y) * geometry.tile()[0] as usize + offset[0] + 4 + x;
                let from = 3 * (y * SIZE[0] as usize + x);
                assert_eq!(tile[4 * at..][..3], expected[from..from + 3], "{name} {x} {y}");
            }
        }
    }
    // What changes nothing is not worth a word.
    std::fs::write(&image, png_with_profile(&rgb_profile("any", Curve::Srgb, SRGB))).unwrap();
    let report = build(&[layer("normal", Some(LayerFormat::Rgba8))], &output, &options, &()).unwrap();
    assert_eq!(report.layers[0].notices, []);
}

#[test]
fn a_profile_that_swells_is_not_followed_and_takes_no_memory() {
    let file = png_with_profile(&vec![0; 64 << 20]);
    assert!(file.len() < 1 << 20, "{}", file.len());
    let (header, image) = read(&file);
    assert!(image == cube8());
    assert!(matches!(header.notices[..], [Notice::ProfileIgnored { .. }]), "{:?}", header.notices);
    assert!(header.memory < 1 << 20, "{}", header.memory);
    // Of one that is read, what it takes counts.
    let large = png_with_profile(&vec![0; 20 << 20]);
    assert!(read(&large).0.memory > 39 << 20);
}
