//! TIFF files of signed numbers, with channels in planes, with colours multiplied by alpha, and such as claim
//! too much.

use vastex_build::{Notice, PixelFormat, Sample, open};

use crate::common::files::HandmadeTiff;
use crate::common::texels;
use crate::readers::{SIZE, check, read};

#[test]
fn tiff_of_channels_in_planes() {
    for (bits, channels, photometric) in [(8, 3, 2), (16, 3, 2), (8, 4, 2), (8, 2, 1)] {
        let sample = bits as usize / 8;
        let data = texels((SIZE[0] * SIZE[1]) as usize * channels * sample, 41);
        for (chunk, tiled) in [([SIZE[0], 16], false), ([SIZE[0], SIZE[1]], false), ([32, 16], true)] {
            let mut file = HandmadeTiff::new(SIZE, &vec![bits; channels], photometric, chunk, tiled);
            file.set(284, 2);
            if channels % 2 == 0 {
                file.set(338, 2);
            }
            for plane in 0..channels {
                let of_plane = |texel: &[u8]| texel[plane * sample..][..sample].to_vec();
                let plane: Vec<u8> = data.chunks(channels * sample).flat_map(of_plane).collect();
                file.cut(SIZE, sample, chunk, &plane);
            }
            let format = PixelFormat::new(channels as u8, if bits == 8 { Sample::U8 } else { Sample::U16 });
            check(&file.bytes(), format.unwrap(), &data);
        }
    }
}

#[test]
fn tiff_of_signed_numbers_holds_them_as_floats() {
    let n = (SIZE[0] * SIZE[1]) as usize;
    let grey = |bits: u32, data: &[u8], tiled: bool, big_endian: bool| {
        let chunk = if tiled { [32, 16] } else { [SIZE[0], 16] };
        let mut file = HandmadeTiff::new(SIZE, &[bits], 1, chunk, tiled);
        file.set(339, 2);
        file.big_endian = big_endian;
        file.cut(SIZE, bits as usize / 8, chunk, data);
        file.bytes()
    };
    let noise = texels(4 * n, 43);
    for tiled in [false, true] {
        let bytes: Vec<i8> = noise[..n].iter().map(|v| *v as i8).collect();
        let expected: Vec<u8> =
            bytes.iter().flat_map(|v| half::f16::from_f32((*v).into()).to_le_bytes()).collect();
        let file = grey(8, &noise[..n], tiled, false);
        check(&file, PixelFormat::GREY8.with_sample(Sample::F16), &expected);
        assert_eq!(read(&file).0.range, Some([-128, 127]));
        for big_endian in [false, true] {
            let words: Vec<i16> =
                noise[..2 * n].as_chunks().0.iter().map(|v| i16::from_le_bytes(*v)).collect();
            let stored: Vec<u8> = words
                .iter()
                .flat_map(|v| if big_endian { v.to_be_bytes() } else { v.to_le_bytes() })
                .collect();
            let expected: Vec<u8> = words.iter().flat_map(|v| f32::from(*v).to_le_bytes()).collect();
            let file = grey(16, &stored, tiled, big_endian);
            assert_eq!(check(&file, PixelFormat::GREY8.with_sample(Sample::F32), &expected), []);
            assert_eq!(read(&file).0.range, Some([-32768, 32767]));
        }
        let large: Vec<i32> = noise.as_chunks().0.iter().map(|v| i32::from_le_bytes(*v)).collect();
        let expected: Vec<u8> = large.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect();
        let notices =
            check(&grey(32, &noise, tiled, false), PixelFormat::GREY8.with_sample(Sample::F32), &expected);
        assert_eq!(notices, [Notice::IntegersRounded]);
    }
}

#[test]
fn tiff_that_cannot_hold_what_it_claims_is_refused_when_it_is_opened() {
    for compression in [1, 5, 8, 32773] {
        let mut file = HandmadeTiff::new([60_000; 2], &[8], 1, [60_000, 60_000], true);
        file.set(259, compression);
        file.chunks = vec![vec![0; 1000]];
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.tif");
        std::fs::write(&path, file.bytes()).unwrap();
        let fault = open(&path).map(|reader| reader.header().clone()).unwrap_err().to_string();
        assert!(fault.contains("cannot hold 3600000000"), "{fault}");
    }
}

/// Colour of one kind under alpha of all kinds, multiplied by it, in sRGB-encoded numbers of 16 bits.
#[test]
fn premultiplied_colours_stay_the_same_on_every_level() {
    let stored = 39_000u32;
    let alphas: Vec<u32> =
        texels((SIZE[0] * SIZE[1]) as usize, 45).iter().map(|v| u32::from(*v) * 257).collect();
    let data: Vec<u8> = alphas
        .iter()
        .flat_map(|alpha| {
            [0, 1, 2, 3].map(|c| if c == 3 { *alpha } else { (stored * alpha + 32_767) / 65_535 })
        })
        .flat_map(|v| (v as u16).to_le_bytes())
        .collect();
    let chunk = [SIZE[0], 16];
    let mut file = HandmadeTiff::new(SIZE, &[16; 4], 2, chunk, false);
    file.set(338, 1);
    file.cut(SIZE, 8, chunk, &data);
    let dir = tempfile::tempdir().unwrap();
    let (image, output) = (dir.path().join("a.tif"), dir.path().join("a.vastex"));
    std::fs::write(&image, file.bytes()).unwrap();
    let options = vastex_build::BuildOptions { page: 32, ..Default::default() };
    let report = vastex_build::build(&[&image], &output, &options, &()).unwrap();
    assert!(report.notices().any(|notice| *notice == Notice::PremultipliedAlpha));
    let light = ((f64::from(stored) / 65_535.0 + 0.055) / 1.055).powf(2.4) * 65_535.0;
    let (_, tiles) = crate::common::tiles(&output);
    let mut seen = 0;
    for (pos, tile) in tiles {
        for texel in tile.as_chunks::<8>().0 {
            let [red, _, _, alpha] =
                std::array::from_fn(|c| u16::from_le_bytes([texel[2 * c], texel[2 * c + 1]]));
            // Where alpha is low the file itself has few steps.
            if alpha > 6000 {
                seen += 1;
                assert!(
                    (f64::from(red) - light).abs() < 0.002 * 65_535.0,
                    "{pos}: {red} of {light} at {alpha}"
                );
            }
        }
    }
    assert!(seen > 10_000, "{seen}");
}
