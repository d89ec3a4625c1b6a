//! Images in memory: the same tiles as those of a container, whole, as they grow, and at a share of their
//! size.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use exr::prelude::{Blocks, Compression, FlatSamples, Vec2, f16};
use png::ColorType;
use vastex_build::{
    BuildError, BuildOptions, DecodeOptions, Decoding, ImageHeader, LayerInput, MemoryImage, Progress, build,
    open, open_reduced, read_first_rows, read_further_rows,
};
use vastex_core::{AddressMode, PagePos};
use vastex_tiles::{TileSource, conformance};

use crate::common::exr::{encoding, exr_of};
use crate::common::files::{exif, interlaced_png, jpeg, jpeg_with_segment};
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
    let options = DecodeOptions { wraps, ..DecodeOptions::default() };
    let decoded = Decoding::open(image, &options).unwrap().run(&()).unwrap();
    assert!(decoded.is_whole() && decoded.halvings() == 0);
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

    fn rows(&self, image: &ImageHeader, first_row: u32, rows: &[u8]) {
        let heard = self.heard.lock().unwrap().len();
        assert_eq!(first_row as usize * image.row_bytes(), heard, "each row comes once, in order");
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
    // Beside another layer, of half its size, whose rows are nobody's business.
    let half = sandbox.image("half.png", [200, 150], ColorType::Grayscale, &texels(200 * 150, 2));
    let layers = [("color", &path), ("mask", &half)];
    let layers = layers.map(|(name, path)| LayerInput { name: name.into(), ..path.as_path().into() });
    build(&layers, &sandbox.path("out.vastex"), &BuildOptions::default(), &listener).unwrap();
    assert!(*listener.heard.lock().unwrap() == data);
    let header = listener.header.lock().unwrap().clone().unwrap();
    let picture = MemoryImage::new(&header, 0, false).unwrap();
    assert_eq!((picture.rows(), picture.image_size()), (0, size));
    let corner = PagePos { level: 0, x: 0, y: 0, z: 0 };
    assert!(tile(&picture, corner).iter().all(|&value| value == 0), "nothing is there yet");
    picture.push(&data[..100 * 400 * 3]);
    assert_eq!((picture.rows(), picture.image_rows(), picture.is_whole()), (100, 100, false));
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

/// A value of 0 would be one of the image, black or the level of the sea.
#[test]
fn rows_of_grey_that_are_not_there_yet_repeat_the_last_one() {
    let (sandbox, size) = (Sandbox::new(), [120, 90]);
    let data = texels((size[0] * size[1]) as usize, 5);
    let path = sandbox.image("grey.png", size, ColorType::Grayscale, &data);
    let picture = MemoryImage::new(open(&path).unwrap().header(), 0, false).unwrap();
    picture.push(&data[..120 * 50]);
    let there = tile(&picture, PagePos { level: 0, x: 0, y: 0, z: 0 });
    let row = |row: usize| &there[(4 + row) * 136 + 4..][..120];
    assert!(row(49) == &data[49 * 120..50 * 120]);
    assert!((50..90).all(|missing| row(missing) == row(49)));
}

/// The four texels of a square that stand for it, by their place along an axis of an image of `size` texels.
fn picked(square: u32, halvings: u32, size: u32) -> [u32; 2] {
    let side = 1 << halvings;
    let first = square * side;
    [side / 4, side - 1 - side / 4].map(|place| (first + place).min(size - 1))
}

#[test]
fn a_halved_picture_has_means_of_four_texels_of_each_square() {
    let (sandbox, size) = (Sandbox::new(), [1003u32, 618]);
    let data = texels((size[0] * size[1]) as usize, 11);
    // Grey, of which the mean is that of the numbers.
    let path = sandbox.image("image.png", size, ColorType::Grayscale, &data);
    let header = open(&path).unwrap().header().clone();
    for (side, halvings) in [(1003, 0), (1002, 1), (300, 2), (126, 3), (63, 4)] {
        assert_eq!(MemoryImage::halvings_to_side(&header, side), halvings);
        if halvings == 0 {
            continue;
        }
        let picture = MemoryImage::new(&header, halvings, false).unwrap();
        data.chunks(1003 * 50).for_each(|rows| picture.push(rows));
        assert!(picture.is_whole() && picture.image_size() == size);
        let [width, height, _] = picture.description().geometry.size();
        assert_eq!([width, height], size.map(|side| side.div_ceil(1 << halvings)));
        // The first page and the last, with the squares that the edges cut.
        let pages = [width, height].map(|side| (side - 1) / 128);
        for [page_x, page_y] in [[0, 0], pages] {
            let pos = PagePos { level: 0, x: page_x, y: page_y, z: 0 };
            if picture.description().geometry.is_tail(pos) {
                continue;
            }
            let tile = tile(&picture, pos);
            for y in (page_y * 128)..height.min(page_y * 128 + 128) {
                for x in (page_x * 128)..width.min(page_x * 128 + 128) {
                    let rows = picked(y, halvings, size[1]);
                    let four =
                        rows.map(|y| picked(x, halvings, size[0]).map(|x| data[(y * size[0] + x) as usize]));
                    let sum: u32 = four.as_flattened().iter().map(|&value| u32::from(value)).sum();
                    let value = tile[((y % 128 + 4) * 136 + x % 128 + 4) as usize];
                    assert!((4 * u32::from(value)).abs_diff(sum) <= 2, "1/{} at {x},{y}", 1 << halvings);
                }
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
    let bytes = MemoryImage::bytes_at(&header, 0);
    assert_eq!(bytes, 300 * 200 * 4 + 300 * 200 * 4 / 3);
    for (image_bytes, halvings) in [(bytes, 0), (bytes - 1, 1), (bytes / 5, 2), (0, 31)] {
        assert_eq!(MemoryImage::halvings_to_fit(&header, image_bytes), halvings);
        let options = DecodeOptions { image_bytes, ..DecodeOptions::default() };
        let decoding = Decoding::open(&path, &options).unwrap();
        assert_eq!((decoding.image().halvings(), decoding.image().rows()), (halvings, 0));
        assert!(decoding.run(&()).unwrap().is_whole());
    }
    let breaking = Listener { last: 1, ..Listener::default() };
    let broken = Decoding::open(&path, &DecodeOptions::default()).unwrap().run(&breaking);
    assert!(matches!(broken, Err(BuildError::Cancelled)));
    std::fs::write(sandbox.path("slow.jpg"), jpeg([256, 256], 3, true, &hills([256, 256], 3))).unwrap();
    let options = DecodeOptions { reader_bytes: 1000, ..DecodeOptions::default() };
    let refused = Decoding::open(&sandbox.path("slow.jpg"), &options);
    assert!(matches!(refused, Err(BuildError::Memory { limit: 1000, .. })));
}

#[test]
fn a_jpeg_is_read_at_a_share_of_its_size() {
    let (sandbox, size) = (Sandbox::new(), [333, 210]);
    let data = hills(size, 3);
    let path = sandbox.path("image.jpg");
    std::fs::write(&path, jpeg(size, 3, false, &data)).unwrap();
    for (side, share) in [(40, 8), (41, 8), (42, 4), (100, 2), (160, 2)] {
        let mut reader = open_reduced(&path, side).unwrap().unwrap();
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
    assert!(open_reduced(&path, 200).unwrap().is_none(), "it is not much larger than that");
    // One that is stored turned is upright, too.
    let turned = jpeg_with_segment(&jpeg(size, 3, false, &data), 0xe1, &[b"Exif\0\0", &exif(6)[..]].concat());
    std::fs::write(sandbox.path("turned.jpg"), turned).unwrap();
    let turned = open_reduced(&sandbox.path("turned.jpg"), 40).unwrap().unwrap();
    assert_eq!([turned.header().width, turned.header().height], [210u32.div_ceil(8), 333u32.div_ceil(8)]);
    std::fs::write(&path, jpeg(size, 3, true, &data)).unwrap();
    // Of a progressive one there is an eighth, which other tests compare.
    let eighth = open_reduced(&path, 82).unwrap().unwrap();
    assert_eq!([eighth.header().width, eighth.header().height], [42, 27]);
    assert!(open_reduced(&path, 84).unwrap().is_none(), "it is not much larger than that");
    let png = sandbox.image("image.png", size, ColorType::Rgb, &data);
    assert!(open_reduced(&png, 40).unwrap().is_none());
    assert!(open_reduced(&sandbox.path("gone.jpg"), 40).is_err());
}

/// Hears of what is decoded before the first row, and breaks it off if it is to.
#[derive(Default)]
struct Impatient {
    shares: Mutex<Vec<f64>>,
    is_broken_off: bool,
}

impl Progress for Impatient {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn beginning(&self, share: f64) -> ControlFlow<()> {
        self.shares.lock().unwrap().push(share);
        if self.is_broken_off { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn what_is_decoded_before_the_first_row_is_watched_and_can_be_broken_off() {
    let (sandbox, size) = (Sandbox::new(), [400, 300]);
    let progressive = jpeg(size, 3, true, &hills(size, 3));
    let turned = |file: &[u8]| jpeg_with_segment(file, 0xe1, &[&b"Exif\0\0"[..], &exif(6)].concat());
    let halves = (0..400 * 300).map(|n| f16::from_f32(n as f32)).collect();
    let tiles = encoding(Compression::Uncompressed, Blocks::Tiles(Vec2(64, 64)));
    let upright = jpeg(size, 3, false, &hills(size, 3));
    for file in [
        progressive.clone(),
        turned(&progressive),
        turned(&upright),
        interlaced_png(size, &hills(size, 3)),
        exr_of([400, 300], tiles, vec![("Y", FlatSamples::F16(halves))], false),
    ] {
        check_beginning(&sandbox, &file);
    }
    // Rows of other images come at once.
    let path = sandbox.path("image.jpg");
    std::fs::write(&path, upright).unwrap();
    assert!(open(&path).unwrap().beginning().is_none());
}

/// Pieces that are decoded whole begin in any row.
#[test]
fn a_mosaic_can_be_broken_off_in_any_row() {
    let sandbox = Sandbox::new();
    let size = [64, 40];
    let data = texels(64 * 40 * 3, 3);
    sandbox.image("plain.png", size, ColorType::Rgb, &data);
    let slow = sandbox.path("slow.png");
    std::fs::write(&slow, interlaced_png(size, &data)).unwrap();
    let path = sandbox.path("a.mosaic");
    let describe = |lower: &str| {
        std::fs::write(&path, format!("vastex mosaic\n0 0 plain.png\n0 40 {lower}\n")).unwrap();
    };
    describe("plain.png");
    assert!(open(&path).unwrap().beginning().is_none());
    describe("slow.png");
    let rows = &mut vec![0; 64 * 40 * 4][..];
    // A mosaic has alpha where its pieces are colours.
    let opaque: Vec<u8> = data.as_chunks::<3>().0.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect();
    // The work begins with the lower half.
    for goes_on in [true, false] {
        let mut reader = open(&path).unwrap();
        assert!(reader.beginning().unwrap().is_of_all_rows());
        let heard = Listener::default();
        read_first_rows(&mut *reader, rows, &heard).unwrap().unwrap();
        assert!(heard.calls.load(Ordering::Relaxed) > 0);
        assert!(*rows == opaque[..]);
        rows.fill(0);
        let tell = || if goes_on { ControlFlow::Continue(()) } else { ControlFlow::Break(()) };
        match read_further_rows(&mut *reader, rows, &tell) {
            Some(read) => read.unwrap(),
            None => assert!(!goes_on && reader.read_rows(rows).is_err()),
        }
        assert!(!goes_on || *rows == opaque[..]);
    }
    // The first call comes before anything is read, the second while that is done.
    let [decoding, building] = [(); 2].map(|()| Listener { last: 2, ..Listener::default() });
    let decoded = Decoding::open(&path, &DecodeOptions::default()).unwrap().run(&decoding).map(drop);
    let out = sandbox.path("out.vastex");
    let built = build(&[path.as_path()], &out, &BuildOptions::default(), &building).map(drop);
    for (done, listener) in [(decoded, decoding), (built, building)] {
        assert!(matches!(done, Err(BuildError::Cancelled)));
        assert!(listener.heard.lock().unwrap().is_empty());
    }
}

/// Of an image of which all is decoded before the first row.
fn check_beginning(sandbox: &Sandbox, file: &[u8]) {
    let path = sandbox.path("image");
    std::fs::write(&path, file).unwrap();
    let mut reader = vastex_build::in_srgb(open(&path).unwrap());
    let beginning = reader.beginning().unwrap();
    assert_eq!(beginning.share(), 0.0);
    let mut row = vec![0; reader.header().row_bytes()];
    reader.read_rows(&mut row).unwrap();
    assert!(beginning.share() > 0.9, "{}", beginning.share());
    let mut reader = open(&path).unwrap();
    reader.beginning().unwrap().break_off();
    assert!(reader.read_rows(&mut row).is_err());
    // A build and a decoding tell of it, and end where nobody wants them any more.
    let decode = |progress: &Impatient| {
        Decoding::open(&path, &DecodeOptions::default()).unwrap().run(progress).map(drop)
    };
    let out = sandbox.path("out.vastex");
    let make =
        |progress: &Impatient| build(&[path.as_path()], &out, &BuildOptions::default(), progress).map(drop);
    for work in [&decode as &dyn Fn(&Impatient) -> Result<(), BuildError>, &make] {
        let (patient, impatient) =
            (Impatient::default(), Impatient { is_broken_off: true, ..Impatient::default() });
        assert!(matches!(work(&impatient), Err(BuildError::Cancelled)) && !out.exists());
        work(&patient).unwrap();
        for heard in [&patient, &impatient] {
            let shares = heard.shares.lock().unwrap();
            assert!(
                !shares.is_empty() && shares.is_sorted() && shares.iter().all(|s| (0.0..=1.0).contains(s))
            );
        }
    }
    std::fs::remove_file(out).unwrap();
}
