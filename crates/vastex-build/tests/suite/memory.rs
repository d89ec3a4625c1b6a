//! Images in memory: the same tiles as those of a container, whole, as they grow, and at a share of their size.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use png::ColorType;
use vastex_build::{
    BuildError, BuildOptions, DecodeOptions, ImageHeader, MemoryImage, Progress, build, decode, open,
    open_smaller,
};
use vastex_core::{AddressMode, PagePos, Region};
use vastex_tiles::{TileSource, conformance};

use crate::common::files::jpeg;
use crate::common::sandbox::{Sandbox, hills};
use crate::common::{texels, tiles, write_png};

fn tile(image: &MemoryImage, pos: PagePos) -> Vec<u8> {
    pollster::block_on(image.read(pos)).unwrap().decode(image.description()).unwrap().to_vec()
}

/// Every page of an image in memory is that of the container which is built of it.
fn check_as_built(sandbox: &Sandbox, image: &Path, wraps: bool) {
    let x = if wraps { AddressMode::Wrap } else { AddressMode::Clamp };
    let options = BuildOptions { address: [x, AddressMode::Clamp], ..BuildOptions::default() };
    let (description, built) = tiles(&sandbox.build_as("built.vastex", &[image.into()], &options));
    let decoded = decode(image, &DecodeOptions { wraps, ..DecodeOptions::default() }, &(), |_| ()).unwrap();
    assert!(decoded.is_whole() && decoded.factor() == 1);
    assert_eq!(conformance(&*decoded), Ok(()));
    assert_eq!(decoded.description().geometry, description.geometry);
    assert_eq!(decoded.description().layers, description.layers);
    for (pos, expected) in built {
        assert!(tile(&decoded, pos) == expected, "{}: {pos}", image.display());
    }
}

#[test]
fn an_image_in_memory_has_the_tiles_of_its_container() {
    let sandbox = Sandbox::new();
    for (name, color, channels, size, wraps) in [
        ("rgb.png", ColorType::Rgb, 3, [301, 517], false),
        ("rgba.png", ColorType::Rgba, 4, [640, 129], true),
        ("grey.png", ColorType::Grayscale, 1, [257, 1], true),
        ("dot.png", ColorType::Grayscale, 1, [1, 1], false),
    ] {
        let data = texels((size[0] * size[1]) as usize * channels, 3);
        check_as_built(&sandbox, &sandbox.image(name, size, color, &data), wraps);
    }
    let path = sandbox.path("deep.png");
    write_png(&path, [300, 140], ColorType::Rgb, png::BitDepth::Sixteen, &texels(300 * 140 * 6, 9));
    check_as_built(&sandbox, &path, false);
}

/// Keeps what it hears.
#[derive(Default)]
struct Listener {
    heard: Mutex<Vec<u8>>,
    header: Mutex<Option<ImageHeader>>,
    calls: AtomicU64,
    /// Breaks off after so many calls, if that is not 0.
    last: u64,
}

impl Progress for Listener {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        let calls = self.calls.fetch_add(1, Ordering::Relaxed) + 1;
        if calls == self.last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn rows(&self, image: &ImageHeader, rows: &[u8]) {
        self.heard.lock().unwrap().extend(rows);
        *self.header.lock().unwrap() = Some(image.clone());
    }
}

#[test]
fn a_build_gives_out_the_rows_that_it_reads_and_a_picture_grows_with_them() {
    let (sandbox, size) = (Sandbox::new(), [400, 300]);
    let data = texels((size[0] * size[1] * 3) as usize, 7);
    let path = sandbox.image("image.png", size, ColorType::Rgb, &data);
    let listener = Listener::default();
    build(&[path.as_path()], &sandbox.path("out.vastex"), &BuildOptions::default(), &listener).unwrap();
    assert!(*listener.heard.lock().unwrap() == data);
    let header = listener.header.lock().unwrap().clone().unwrap();
    let picture = MemoryImage::new(&header, 1, false).unwrap();
    assert_eq!((picture.rows(), picture.image_size()), (0, size));
    let corner = PagePos { level: 0, x: 0, y: 0, z: 0 };
    assert!(tile(&picture, corner).iter().all(|&value| value == 0), "nothing is there yet");
    picture.push(&data[..100 * 400 * 3]);
    assert_eq!((picture.rows(), picture.is_whole()), (100, false));
    assert_eq!(picture.region_since(60), Region::image(0..u32::MAX, 60..100));
    let half = tile(&picture, corner);
    picture.push(&data[100 * 400 * 3..]);
    assert!(picture.is_whole());
    let whole = tile(&picture, corner);
    // Four rows of border above, and 136 texels a row.
    let (row, there) = (136 * 4, (4 + 100) * 136 * 4);
    assert!(half[..there] == whole[..there] && half[there..].iter().all(|&value| value == 0));
    assert!(whole[there..].chunks(row).all(|row| row.iter().any(|&value| value != 0)));
    picture.push(&data);
    assert!(picture.rows() == 300 && tile(&picture, corner) == whole, "rows too many are left out");
    assert_eq!(conformance(&picture), Ok(()));
}

#[test]
fn a_smaller_picture_has_means_of_what_it_stands_for() {
    let (sandbox, size) = (Sandbox::new(), [1003u32, 618]);
    // Planes that rise to the right and downwards: means lie in the middle of what they are of.
    let value = |x: u32, y: u32| [(x * 250 / size[0]) as u8, (y * 250 / size[1]) as u8, 90];
    let data: Vec<u8> = (0..size[1]).flat_map(|y| (0..size[0]).flat_map(move |x| value(x, y))).collect();
    let path = sandbox.image("image.png", size, ColorType::Rgb, &data);
    let header = open(&path).unwrap().header().clone();
    assert_eq!(MemoryImage::factor_of_side(&header, 1003), 1);
    for (side, factor) in [(1002, 2), (300, 4), (126, 8), (63, 16)] {
        assert_eq!(MemoryImage::factor_of_side(&header, side), factor);
        let picture = MemoryImage::new(&header, factor, false).unwrap();
        data.chunks(1003 * 3 * 50).for_each(|rows| picture.push(rows));
        assert!(picture.is_whole() && picture.image_size() == size);
        let [width, height, _] = picture.description().geometry.size();
        assert_eq!([width, height], size.map(|side| side.div_ceil(factor)));
        let texels = tile(&picture, PagePos { level: 0, x: 0, y: 0, z: 0 });
        for (x, y) in [(0, 0), (width.min(128) - 2, 3), (20, height.min(128) - 2)] {
            let at = ((y + 4) * 136 + x + 4) as usize * 4;
            let middle =
                |at: u32, size: u32| (f64::from(at) + 0.5) * f64::from(factor) * 250.0 / f64::from(size);
            let expected = [middle(x, size[0]), middle(y, size[1]), 90.0];
            for (value, expected) in texels[at..at + 3].iter().zip(expected) {
                assert!((f64::from(*value) - expected).abs() <= 2.0, "1/{factor} at {x},{y}");
            }
        }
    }
}

#[test]
fn what_is_too_large_for_memory_is_decoded_at_a_share_of_its_size() {
    let (sandbox, size) = (Sandbox::new(), [300, 200]);
    let data = texels(300 * 200 * 3, 1);
    let path = sandbox.image("image.png", size, ColorType::Rgb, &data);
    let header = open(&path).unwrap().header().clone();
    let bytes = MemoryImage::bytes(&header, 1);
    assert_eq!(bytes, 300 * 200 * 4 + 300 * 200 * 4 / 3);
    for (limit, factor) in [(bytes, 1), (bytes - 1, 2), (bytes / 5, 4), (0, 1 << 31)] {
        assert_eq!(MemoryImage::factor_within(&header, limit), factor);
        let options = DecodeOptions { limit, ..DecodeOptions::default() };
        let mut begun = 0;
        let decoded = decode(&path, &options, &(), |image| begun = image.factor()).unwrap();
        assert!(decoded.is_whole() && [decoded.factor(), begun] == [factor; 2]);
    }
    let breaking = Listener { last: 1, ..Listener::default() };
    let broken = decode(&path, &DecodeOptions::default(), &breaking, |_| ());
    assert!(matches!(broken, Err(BuildError::Cancelled)));
    std::fs::write(sandbox.path("slow.jpg"), jpeg([256, 256], 3, true, &hills([256, 256], 3))).unwrap();
    let options = DecodeOptions { memory_limit: 1000, ..DecodeOptions::default() };
    let refused = decode(&sandbox.path("slow.jpg"), &options, &(), |_| ());
    assert!(matches!(refused, Err(BuildError::Memory { limit: 1000, .. })));
}

#[test]
fn a_jpeg_is_read_at_a_share_of_its_size() {
    let (sandbox, size) = (Sandbox::new(), [333, 210]);
    let data = hills(size, 3);
    let path = sandbox.path("image.jpg");
    std::fs::write(&path, jpeg(size, 3, false, &data)).unwrap();
    for (side, share) in [(40, 8), (41, 8), (42, 4), (100, 2), (160, 2)] {
        let mut reader = open_smaller(&path, side).unwrap().unwrap();
        let header = reader.header().clone();
        assert_eq!([header.width, header.height], size.map(|side| side.div_ceil(share)), "{side}");
        let mut rows = vec![0; header.image_bytes() as usize];
        reader.read_rows(&mut rows).unwrap();
        // Near the means of the blocks, which the compression and its filter leave as they are.
        let mean = |x: u32, y: u32, channel: usize| {
            let blocks = (0..share * share).map(|n| [x * share + n % share, y * share + n / share]);
            let values = blocks.map(|[x, y]| f64::from(data[(y * size[0] + x) as usize * 3 + channel]));
            values.sum::<f64>() / f64::from(share * share)
        };
        for [x, y] in [[1, 1], [header.width - 3, 2], [5, header.height - 3]] {
            for channel in 0..3 {
                let value = f64::from(rows[(y * header.width + x) as usize * 3 + channel]);
                let expected = mean(x, y, channel);
                assert!((value - expected).abs() < 12.0, "1/{share} at {x},{y}: {value} {expected}");
            }
        }
        assert!(reader.read_rows(&mut rows[..header.row_bytes()]).is_err(), "there are no more rows");
    }
    assert!(open_smaller(&path, 200).unwrap().is_none(), "it is not much larger than that");
    std::fs::write(&path, jpeg(size, 3, true, &data)).unwrap();
    assert!(open_smaller(&path, 40).unwrap().is_none(), "a progressive one is decoded whole in any case");
    let png = sandbox.image("image.png", size, ColorType::Rgb, &data);
    assert!(open_smaller(&png, 40).unwrap().is_none());
    assert!(open_smaller(&sandbox.path("gone.jpg"), 40).is_err());
}
