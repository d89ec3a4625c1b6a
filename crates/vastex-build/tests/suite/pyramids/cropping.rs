//! Regions of containers, directories and images, in each format, against texels that are known.

use std::io::Cursor;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use tiff::decoder::{Decoder, DecodingResult};
use vastex_build::{
    BuildOptions, CropError, CropFormat, CropRegion, CropSource, ExportOptions, Layout, Number, Progress,
    TileFormat, build, crop, export,
};
use vastex_core::LayerFormat;
use vastex_tiles::{Container, TileSource};

use super::whole;
use crate::common::files::{HandmadeTiff, jpeg};
use crate::common::{texels, write_png};

fn cut(
    source: &mut CropSource,
    at: [u32; 2],
    size: [u32; 2],
    format: CropFormat,
) -> Result<Vec<u8>, CropError> {
    let mut bytes = Vec::new();
    crop(source, CropRegion { at, size }, format, &mut bytes, &()).map(|()| bytes)
}

/// A region of rows of `width` texels.
fn region(data: &[u8], width: u32, texel: usize, at: [u32; 2], size: [u32; 2]) -> Vec<u8> {
    let row = |y: u32| {
        let from = ((at[1] + y) * width + at[0]) as usize * texel;
        data[from..from + size[0] as usize * texel].to_vec()
    };
    (0..size[1]).flat_map(row).collect()
}

fn write_rgb(path: &Path, size: [u32; 2]) -> Vec<u8> {
    let data = texels((size[0] * size[1] * 3) as usize, 5);
    write_png(path, size, png::ColorType::Rgb, png::BitDepth::Eight, &data);
    data
}

#[test]
fn numpy_reads_the_header() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.png");
    let data = write_rgb(&path, [50, 40]);
    let mut source = CropSource::open(&path, 0).unwrap();
    let found = cut(&mut source, [7, 11], [5, 3], CropFormat::Npy).unwrap();
    let mut header =
        b"\x93NUMPY\x01\x00\x76\x00{'descr': '|u1', 'fortran_order': False, 'shape': (3, 5, 3), }".to_vec();
    header.resize(127, b' ');
    header.push(b'\n');
    assert_eq!(found, [header, region(&data, 50, 3, [7, 11], [5, 3])].concat());
}

#[test]
fn every_region_of_every_format_is_what_is_stored() {
    let directory = tempfile::tempdir().unwrap();
    let size = [300, 200];
    for (channels, bits) in [(1, 8), (1, 16), (2, 8), (3, 16), (4, 8)] {
        let sample = bits as usize / 8;
        let texel = channels * sample;
        let data = texels((size[0] * size[1]) as usize * texel, 3);
        let chunk = [64, 48];
        let mut file =
            HandmadeTiff::new(size, &vec![bits; channels], if channels > 2 { 2 } else { 1 }, chunk, true);
        if channels % 2 == 0 {
            file.set(338, 2);
        }
        file.cut(size, texel, chunk, &data);
        let path = directory.path().join("a.tif");
        std::fs::write(&path, file.bytes()).unwrap();
        for (at, of) in [([0, 0], size), ([63, 47], [2, 2]), ([299, 199], [1, 1]), ([10, 100], [290, 51])] {
            let expected = region(&data, size[0], texel, at, of);
            let mut source = CropSource::open(&path, 0).unwrap();
            let npy = cut(&mut source, at, of, CropFormat::Npy).unwrap();
            assert!(npy.ends_with(&expected));
            let png = cut(&mut source, at, of, CropFormat::Png).unwrap();
            let mut reader = png::Decoder::new(Cursor::new(png)).read_info().unwrap();
            let mut read = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut read).unwrap();
            if sample == 2 {
                read.chunks_mut(2).for_each(<[u8]>::reverse);
            }
            assert!(read == expected, "{channels} channels of {bits} bits as PNG");
            let tif = cut(&mut source, at, of, CropFormat::Tiff).unwrap();
            let mut decoder = Decoder::new(Cursor::new(&tif)).unwrap();
            assert_eq!(decoder.dimensions().unwrap(), (of[0], of[1]));
            let read = match decoder.read_image().unwrap() {
                DecodingResult::U8(texels) => texels,
                DecodingResult::U16(texels) => texels.iter().flat_map(|v| v.to_le_bytes()).collect(),
                other => panic!("{other:?}"),
            };
            assert!(read == expected, "{channels} channels of {bits} bits as TIFF");
            // What is written can be opened again.
            let again = directory.path().join("again.tif");
            std::fs::write(&again, &tif).unwrap();
            assert!(whole(CropSource::open(&again, 0).unwrap()) == expected);
        }
    }
}

/// The numbers of a file stay what they are, whatever a layer would hold of them.
#[test]
fn numbers_keep_their_kind() {
    let directory = tempfile::tempdir().unwrap();
    for (bits, kind, number) in [
        (32, 1, Number::U32),
        (8, 2, Number::I8),
        (16, 2, Number::I16),
        (32, 2, Number::I32),
        (16, 3, Number::F16),
        (32, 3, Number::F32),
        (64, 3, Number::F64),
    ] {
        let size = [20, 10];
        let data = texels(200 * bits as usize / 8, 11);
        let mut file = HandmadeTiff::new(size, &[bits], 1, [20, 4], false);
        file.set(339, kind);
        file.cut(size, bits as usize / 8, [20, 4], &data);
        let path = directory.path().join("a.tif");
        std::fs::write(&path, file.bytes()).unwrap();
        let mut source = CropSource::open(&path, 0).unwrap();
        assert_eq!((source.number(), source.channels()), (number, 1));
        let npy = cut(&mut source, [0, 0], size, CropFormat::Npy).unwrap();
        let descr = format!("'{}{}'", if bits == 8 { '|' } else { '<' }, number.name());
        assert!(String::from_utf8_lossy(&npy[..64]).contains(&descr) && npy.ends_with(&data), "{number:?}");
        let tif = directory.path().join("b.tif");
        std::fs::write(&tif, cut(&mut source, [0, 0], size, CropFormat::Tiff).unwrap()).unwrap();
        let again = CropSource::open(&tif, 0).unwrap();
        assert_eq!(again.number(), number);
        assert!(whole(again) == data, "{number:?}");
        let error = cut(&mut source, [0, 0], size, CropFormat::Png).unwrap_err().to_string();
        assert!(error.contains("PNG cannot hold") && error.contains(".npy"), "{error}");
    }
}

#[test]
fn containers_give_the_texels_of_their_layers_on_every_level() {
    let directory = tempfile::tempdir().unwrap();
    let (image, output) = (directory.path().join("a.png"), directory.path().join("a.vastex"));
    let size = [300, 170];
    let data = write_rgb(&image, size);
    let options = BuildOptions { page: 64, ..BuildOptions::default() };
    build(&[&image], &output, &options, &()).unwrap();
    let container = Arc::new(Container::open_file(&output).unwrap());
    let rgba: Vec<u8> = data.as_chunks::<3>().0.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect();
    for (at, of) in [([0, 0], size), ([60, 62], [9, 5]), ([299, 169], [1, 1])] {
        let mut source = CropSource::of_tiles(container.clone(), Some("color"), 0).unwrap();
        let npy = cut(&mut source, at, of, CropFormat::Npy).unwrap();
        assert!(npy.ends_with(&region(&rgba, size[0], 4, at, of)));
    }
    // Whole levels come as the tiles have them, the tail's too.
    let levels = container.description().geometry.levels().len() as u32;
    for level in 0..levels {
        let source = CropSource::of_tiles(container.clone(), None, level).unwrap();
        let of = container.description().geometry.level(level as u8).size;
        assert_eq!(source.size(), [of[0], of[1]]);
        assert_eq!(whole(source).len(), (of[0] * of[1] * 4) as usize);
    }
    let error = CropSource::of_tiles(container.clone(), None, levels).err().unwrap().to_string();
    assert!(error.contains(&format!("levels 0 to {}", levels - 1)), "{error}");
    let error = CropSource::of_tiles(container, Some("height"), 0).err().unwrap().to_string();
    assert!(error.contains("color"), "{error}");
}

/// What is exported and read as a directory is what the container has.
#[test]
fn directories_give_the_texels_of_their_tiles() {
    let directory = tempfile::tempdir().unwrap();
    let (image, output) = (directory.path().join("a.png"), directory.path().join("a.vastex"));
    write_rgb(&image, [300, 170]);
    build(&[&image], &output, &BuildOptions::default(), &()).unwrap();
    let container = Arc::new(Container::open_file(&output).unwrap());
    let tree = directory.path().join("tree");
    let options = ExportOptions { format: Some(TileFormat::Png), ..ExportOptions::new(Layout::DeepZoom) };
    export(&*container, &tree, &options, &()).unwrap();
    for level in 0..4 {
        let of_tiles = whole(CropSource::of_tiles(container.clone(), None, level).unwrap());
        assert!(whole(CropSource::open(&tree, level).unwrap()) == of_tiles, "level {level}");
    }
    assert!(CropSource::open(&tree, 40).is_err());
}

#[cfg(feature = "bc")]
#[test]
fn layers_in_blocks_are_decoded() {
    let directory = tempfile::tempdir().unwrap();
    let (image, output) = (directory.path().join("a.png"), directory.path().join("a.vastex"));
    let size = [64, 48];
    // Of one colour, which blocks hold exactly.
    write_png(&image, size, png::ColorType::Rgb, png::BitDepth::Eight, &[255, 0, 255].repeat(64 * 48));
    for (format, number, channels) in [
        (LayerFormat::Bc1Srgb, Number::U8, 4),
        (LayerFormat::Bc7Srgb, Number::U8, 4),
        (LayerFormat::Bc5, Number::U8, 2),
    ] {
        let input = vastex_build::LayerInput { format: Some(format), ..(&image).into() };
        build(&[input], &output, &BuildOptions::default(), &()).unwrap();
        let container = Arc::new(Container::open_file(&output).unwrap());
        let source = CropSource::of_tiles(container, None, 0).unwrap();
        assert_eq!((source.number(), source.channels()), (number, channels));
        let texel = [255, 0, 255, 255];
        assert_eq!(whole(source), texel[..usize::from(channels)].repeat(64 * 48), "{format:?}");
    }
}

#[test]
fn images_are_read_down_to_the_region() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.jpg");
    let size = [200, 1000];
    std::fs::write(&path, jpeg(size, 3, false, &crate::common::files::smooth(size, 3))).unwrap();
    let all = whole(CropSource::open(&path, 0).unwrap());
    let mut source = CropSource::open(&path, 0).unwrap();
    let npy = cut(&mut source, [13, 700], [50, 77], CropFormat::Npy).unwrap();
    assert!(npy.ends_with(&region(&all, 200, 3, [13, 700], [50, 77])));
    let error = CropSource::open(&path, 1).err().unwrap().to_string();
    assert!(error.contains("level 0 only"), "{error}");
}

#[test]
fn a_region_over_the_edge_is_refused_and_work_can_be_cancelled() {
    struct Stop;
    impl Progress for Stop {
        fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
            ControlFlow::Break(())
        }
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.png");
    write_rgb(&path, [50, 40]);
    let mut source = CropSource::open(&path, 0).unwrap();
    for (at, size) in [([0, 0], [51, 1]), ([50, 0], [1, 1]), ([49, 39], [1, 2]), ([u32::MAX, 0], [2, 1])] {
        let error = cut(&mut source, at, size, CropFormat::Npy).unwrap_err().to_string();
        assert!(error.contains("level 0 has 50x40 texels"), "{error}");
    }
    for (at, said) in [([-1, 0], "2x1 texels at -1,0 reach"), ([0, 1 << 32], "at 0,4294967296 reach")] {
        let error = source.region(at, [2, 1]).unwrap_err().to_string();
        assert!(error.contains(said) && error.contains("level 0 has 50x40 texels"), "{error}");
    }
    assert_eq!(source.region([48, 39], [2, 1]).unwrap(), CropRegion { at: [48, 39], size: [2, 1] });
    let stopped =
        crop(&mut source, CropRegion { at: [0, 0], size: [1, 1] }, CropFormat::Npy, &mut Vec::new(), &Stop);
    assert!(matches!(stopped, Err(CropError::Cancelled)));
}

/// Of strips that are too large to be decoded at once rows are, from the top of a strip down to the region.
#[test]
fn strips_of_any_size_give_what_they_store() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.tif");
    // Two strips, of 263 MiB and of 30 rows. Of the first ten rows are something, and the others zeros.
    let (size, rows, texel) = ([16_384u32, 2830u32], 2800, 6);
    let row = size[0] as usize * texel;
    let data = texels(40 * row, 41);
    let (top, bottom) = data.split_at(10 * row);
    let packed = |bytes: &[u8]| -> Vec<u8> {
        bytes.chunks(128).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect()
    };
    let mut file = HandmadeTiff::new(size, &[16; 3], 2, [size[0], rows], false);
    file.set(259, 32773);
    file.chunks = vec![[packed(top), [0x81, 0].repeat(2790 * row / 128)].concat(), packed(bottom)];
    std::fs::write(&path, file.bytes()).unwrap();
    let mut source = CropSource::open(&path, 0).unwrap();
    // Back and forth, on the same source.
    for (at, of, from) in [
        ([16_380, 2805], [4, 25], 2790),
        ([5, 3], [70, 7], 0),
        ([0, 0], [16_384, 2], 0),
        ([9, 2800], [1, 1], 2790),
    ] {
        let npy = cut(&mut source, at, of, CropFormat::Npy).unwrap();
        assert!(npy.ends_with(&region(&data, size[0], texel, [at[0], at[1] - from], of)), "{at:?}");
    }
    let band = format!("{}:bands=2", path.display());
    let mut source = CropSource::open(band.as_ref(), 0).unwrap();
    let npy = cut(&mut source, [5, 3], [70, 7], CropFormat::Npy).unwrap();
    let expected = region(&data, size[0], texel, [5, 3], [70, 7]);
    let expected: Vec<u8> = expected.chunks_exact(6).flat_map(|texel| [texel[2], texel[3]]).collect();
    assert!(npy.ends_with(&expected));
}

/// A source that failed fails once more, where one plane can be read and the next one cannot.
#[test]
fn a_source_that_failed_says_so_again() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.tif");
    let size = [16_384u32, 2800u32];
    let mut file = HandmadeTiff::new(size, &[16; 3], 2, size, false);
    file.set(259, 32773);
    file.set(284, 2);
    let plane = [0x81, 0].repeat(2800 * 16_384 * 2 / 128);
    file.chunks = vec![plane.clone(), vec![0; 10], plane];
    std::fs::write(&path, file.bytes()).unwrap();
    let mut source = CropSource::open(&path, 0).unwrap();
    for _ in 0..2 {
        let error = cut(&mut source, [5, 0], [7, 2], CropFormat::Npy).unwrap_err().to_string();
        assert!(error.contains("a strip has 10 bytes"), "{error}");
    }
}
