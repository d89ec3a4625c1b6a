//! Inputs beyond PNG, JPEG and plain TIFF: OpenEXR, raw files with a description, mosaics, floats.

use std::cell::Cell;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use crate::common::exr::{encoding, exr_of};
use crate::common::{texels, write_png};
use exr::prelude::{Blocks, Compression, Encoding, FlatSamples, LineOrder, Vec2, f16};
use tempfile::TempDir;
use tiff::encoder::{TiffEncoder, colortype};
use vastex_build::{
    BuildCache, BuildError, BuildOptions, CacheError, DecodeOptions, Decoding, ImageHeader, Inset, Notice,
    PixelFormat, Progress, ReplaceError, ReplaceOptions, Sample, open, replace,
};

/// All texels of an image, read three rows at a time, and what was said at the end.
fn read(path: &Path) -> Result<(ImageHeader, Vec<u8>), String> {
    let mut reader = open(path).map_err(|fault| fault.to_string())?;
    let (row, height) = (reader.header().row_bytes(), reader.header().height as usize);
    let mut image = vec![0; row * height];
    for rows in image.chunks_mut(3 * row) {
        reader.read_rows(rows).map_err(|fault| fault.to_string())?;
    }
    Ok((reader.header().clone(), image))
}

#[track_caller]
fn expect_fault(path: &Path, words: &[&str]) {
    let fault = read(path).map(|(header, _)| header).unwrap_err();
    for word in words {
        assert!(fault.contains(word), "{fault} lacks {word}");
    }
}

fn sandbox() -> (TempDir, impl Fn(&str) -> PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().to_owned();
    (dir, move |name: &str| path.join(name))
}

const SIZE: [usize; 2] = [37, 45];

fn numbers(seed: f32) -> Vec<f32> {
    (0..SIZE[0] * SIZE[1]).map(|n| (n as f32 * 0.37 + seed).sin() * 100.0).collect()
}

fn halves(seed: f32) -> Vec<f16> {
    numbers(seed).into_iter().map(f16::from_f32).collect()
}

fn exr_file(path: &Path, encoding: Encoding, channels: Vec<(&str, FlatSamples)>, moved: bool) {
    fs::write(path, exr_of(SIZE, encoding, channels, moved)).unwrap();
}

fn scan_lines(compression: Compression) -> Encoding {
    encoding(compression, Blocks::ScanLines)
}

#[test]
fn exr_of_halves_and_floats_by_rows_and_by_tiles() {
    let (_dir, path) = sandbox();
    let file = path("a.exr");
    let whole_orders = [
        Encoding { line_order: LineOrder::Decreasing, ..scan_lines(Compression::ZIP16) },
        Encoding { blocks: Blocks::Tiles(Vec2(16, 16)), ..scan_lines(Compression::ZIP1) },
    ];
    let by_rows = [Compression::Uncompressed, Compression::ZIP16, Compression::RLE].map(scan_lines);
    for (is_whole, encoding) in by_rows
        .map(|encoding| (false, encoding))
        .into_iter()
        .chain(whole_orders.map(|encoding| (true, encoding)))
    {
        let channels = ["R", "G", "B"].into_iter().zip([1.0, 2.0, 3.0]);
        exr_file(&file, encoding, channels.map(|(n, s)| (n, FlatSamples::F16(halves(s)))).collect(), false);
        let (header, image) = read(&file).unwrap();
        let half = PixelFormat::new(3, Sample::F16).unwrap();
        assert_eq!((header.format, header.linear), (half, true));
        let [r, g, b] = [halves(1.0), halves(2.0), halves(3.0)];
        let expected: Vec<u8> =
            (0..r.len()).flat_map(|n| [r[n], g[n], b[n]]).flat_map(|half| half.to_le_bytes()).collect();
        assert!(image == expected, "{encoding:?}");
        // What needs the whole image says so, and how much that is; nothing else is said.
        match (is_whole, header.notices.as_slice()) {
            (false, []) => assert!(header.memory < 3 * header.image_bytes()),
            (true, [Notice::WholeImage { bytes, .. }]) => {
                assert_eq!(*bytes, expected.len() as u64);
                assert!(header.memory >= *bytes);
            }
            other => panic!("{encoding:?}: {other:?}"),
        }
    }
}

#[test]
fn exr_of_other_channels_says_what_it_leaves_out() {
    let (_dir, path) = sandbox();
    let file = path("a.exr");
    let counts: Vec<u32> = (0..(SIZE[0] * SIZE[1]) as u32).map(|n| n * 30_000).collect();
    let depth = |seed| FlatSamples::F32(numbers(seed));
    let zip = scan_lines(Compression::ZIP16);
    exr_file(&file, zip, vec![("depth", FlatSamples::U32(counts.clone()))], false);
    let (header, image) = read(&file).unwrap();
    assert_eq!(header.format, PixelFormat::GREY8.with_sample(Sample::F32));
    assert_eq!(header.notices, [Notice::IntegersRounded]);
    assert_eq!(image, counts.iter().flat_map(|&n| (n as f32).to_le_bytes()).collect::<Vec<u8>>());

    exr_file(
        &file,
        zip,
        vec![("Y", depth(1.0)), ("A", FlatSamples::F16(halves(2.0))), ("Z", depth(3.0))],
        true,
    );
    let (header, image) = read(&file).unwrap();
    assert_eq!(header.format, PixelFormat::GREY_ALPHA8.with_sample(Sample::F32));
    assert_eq!(header.notices.len(), 3);
    assert!(header.notices.contains(&Notice::DataWindow { at: [5, -2], of: [100, 90] }));
    assert!(header.notices.contains(&Notice::ChannelsIgnored("Z".into())));
    assert!(header.notices.contains(&Notice::PremultipliedAlpha));
    let expected: Vec<u8> = numbers(1.0)
        .into_iter()
        .zip(halves(2.0))
        .map(|(y, a)| [if a.to_f32() > 0.0 { y / a.to_f32() } else { y }, a.to_f32()])
        .flat_map(|texel| texel.map(f32::to_le_bytes).concat())
        .collect();
    assert!(image == expected);

    exr_file(&file, zip, vec![("X", depth(1.0)), ("Z", depth(3.0))], false);
    expect_fault(&file, &["channels X, Z", "R, G, B"]);
}

#[test]
fn exr_cut_anywhere_is_refused() {
    let (_dir, path) = sandbox();
    let file = path("a.exr");
    exr_file(&file, scan_lines(Compression::ZIP16), vec![("Y", FlatSamples::F32(numbers(1.0)))], false);
    let whole = fs::read(&file).unwrap();
    for len in (8..whole.len()).step_by(31) {
        fs::write(&file, &whole[..len]).unwrap();
        assert!(read(&file).is_err(), "{len} of {}", whole.len());
    }
    fs::write(&file, &whole[..whole.len() - 9]).unwrap();
    expect_fault(&file, &["truncated"]);
    for at in 4..whole.len().min(400) {
        let mut broken = whole.clone();
        broken[at] ^= 0x41;
        fs::write(&file, &broken).unwrap();
        // Whatever comes of it, nothing panics.
        let _ = read(&file);
    }
}

#[test]
fn raw_in_every_order() {
    let (_dir, path) = sandbox();
    let (file, description) = (path("a.raw"), path("a.raw.toml"));
    let [width, height] = [5usize, 7];
    let data = texels(width * height * 3 * 2, 9);
    let expected = |planar: bool, bottom: bool, big: bool| -> Vec<u8> {
        let sample = |x: usize, y: usize, c: usize| {
            let y = if bottom { height - 1 - y } else { y };
            let n = if planar { (c * height + y) * width + x } else { (y * width + x) * 3 + c };
            let [a, b] = [data[2 * n], data[2 * n + 1]];
            if big { [b, a] } else { [a, b] }
        };
        let places = (0..height).flat_map(|y| (0..width).flat_map(move |x| (0..3).map(move |c| (x, y, c))));
        places.flat_map(|(x, y, c)| sample(x, y, c)).collect()
    };
    fs::write(&file, [&b"head"[..], &data].concat()).unwrap();
    for (planar, bottom, big) in
        [(false, false, false), (true, false, true), (false, true, true), (true, true, false)]
    {
        let text = format!(
            "width = 5\nheight = 7\nchannels = 3\nsample = \"f16\"\noffset = 4\norder = \"{}\"\nfirst_row = \"{}\"\nendian = \"{}\"\n",
            if planar { "planar" } else { "interleaved" },
            if bottom { "bottom" } else { "top" },
            if big { "big" } else { "little" },
        );
        fs::write(&description, text).unwrap();
        for named in [&file, &description] {
            let (header, image) = read(named).unwrap();
            assert_eq!((header.format, header.linear), (PixelFormat::RGB8.with_sample(Sample::F16), true));
            assert_eq!(image, expected(planar, bottom, big));
        }
    }
}

#[test]
fn raw_descriptions_that_lie_are_refused() {
    let (_dir, path) = sandbox();
    let (file, description) = (path("a.raw"), path("a.raw.toml"));
    fs::write(&file, [0; 24]).unwrap();
    expect_fault(&file, &["without a description", "width, height"]);
    for (text, words) in [
        ("width = 4\nheight = 6\nsample = \"u16\"", &["has 24 bytes", "makes 48"][..]),
        ("width = 4\nheight = 5\nsample = \"u8\"", &["has 24 bytes", "makes 20"]),
        ("width = 4294967295\nheight = 4294967295\nsample = \"f32\"\nchannels = 4", &["has 24 bytes"]),
        ("width = 4\nheight = 6\nsample = \"u8\"\noffset = 9223372036854775807", &["has 24 bytes"]),
        ("width = 0\nheight = 6\nsample = \"u8\"", &["0x6"]),
        ("width = 4\nheight = 6\nsample = \"u8\"\nchannels = 5", &["5 channels"]),
        ("width = 4\nheight = 6\nsample = \"i8\"", &["a.raw.toml", "i8"]),
        ("width = 4\nheight = 6", &["a.raw.toml", "sample"]),
        ("width = 4\nheight = 6\nsample = \"u8\"\nskip = 4", &["a.raw.toml", "skip"]),
    ] {
        fs::write(&description, text).unwrap();
        expect_fault(&file, words);
    }
}

#[test]
fn a_mosaic_is_put_together() {
    let (_dir, path) = sandbox();
    let piece = |name: &str, size: [u32; 2], color: png::ColorType, seed: u32| {
        let data = texels(size[0] as usize * size[1] as usize * color.samples(), seed);
        write_png(&path(name), size, color, png::BitDepth::Eight, &data);
        data
    };
    let grey = piece("grey.png", [6, 5], png::ColorType::Grayscale, 1);
    let rgb = piece("a b.png", [4, 4], png::ColorType::Rgb, 2);
    fs::write(path("m.mosaic"), "vastex mosaic\n# pieces\n0 0 grey.png\n\n4 3 a b.png\n").unwrap();
    let (header, image) = read(&path("m.mosaic")).unwrap();
    assert_eq!((header.width, header.height, header.format), (8, 7, PixelFormat::RGBA8));
    // Rows 0 to 2 lack the right, 5 and 6 the left; the later piece wins where both lie.
    assert_eq!(header.notices, [Notice::Gaps(5)]);
    for (n, texel) in image.chunks(4).enumerate() {
        let (x, y) = (n % 8, n / 8);
        let expected = if x >= 4 && y >= 3 {
            let at = ((y - 3) * 4 + x - 4) * 3;
            [rgb[at], rgb[at + 1], rgb[at + 2], 255]
        } else if x < 6 && y < 5 {
            [grey[y * 6 + x], grey[y * 6 + x], grey[y * 6 + x], 255]
        } else {
            [0; 4]
        };
        assert_eq!(texel, expected, "{x}, {y}");
    }
}

#[test]
fn a_grid_of_names_is_a_mosaic() {
    let (_dir, path) = sandbox();
    let data = texels(50 * 30, 3);
    for (y, x) in (0..2usize).flat_map(|y| (0..3usize).map(move |x| (y, x))) {
        let size = [if x == 2 { 10 } else { 20 }, 15];
        let rows = (0..15).flat_map(|v| &data[(y * 15 + v) * 50 + x * 20..][..size[0]]);
        let rows: Vec<u8> = rows.copied().collect();
        let name = path(&format!("t-{y}-{x}.png"));
        write_png(&name, [size[0] as u32, 15], png::ColorType::Grayscale, png::BitDepth::Eight, &rows);
    }
    fs::write(path("m.txt"), "vastex mosaic\ngrid t-{y}-{x}.png\n").unwrap();
    let (header, image) = read(&path("m.txt")).unwrap();
    assert_eq!((header.width, header.height, header.notices.as_slice()), (50, 30, &[][..]));
    assert!(image == data);
}

#[test]
fn a_mosaic_names_the_piece_that_is_wrong() {
    let (_dir, path) = sandbox();
    let write = |name: &str, depth| {
        write_png(
            &path(name),
            [4, 4],
            png::ColorType::Grayscale,
            depth,
            &texels(32, 1)[..16 * (depth as usize) / 8],
        );
    };
    write("a.png", png::BitDepth::Eight);
    write("deep.png", png::BitDepth::Sixteen);
    fs::write(path("short.png"), &fs::read(path("a.png")).unwrap()[..45]).unwrap();
    for (lines, words) in [
        ("", &["without pieces"][..]),
        ("0 0 a.png\n4 0 gone.png", &["gone.png", "there is no such file"]),
        ("0 0 a.png\n4 0 short.png", &["short.png", "truncated"]),
        ("0 0 a.png\n4 0 deep.png", &["deep.png", "one kind"]),
        ("0 a.png", &["line 2", "X Y FILE"]),
        ("-1 0 a.png", &["line 2"]),
        ("0 0", &["line 2"]),
        ("4294967295 0 a.png", &["texels"]),
        ("grid a.png", &["{x}"]),
        ("grid b_{x}_{y}.png", &["b_0_0.png"]),
    ] {
        fs::write(path("m.mosaic"), format!("vastex mosaic\n{lines}\n")).unwrap();
        expect_fault(&path("m.mosaic"), words);
    }
}

/// A picture of two texels whose numbers choose among two colours, or grey of 1 bit.
fn few_bits(path: &Path, color: png::ColorType) {
    let mut encoder = png::Encoder::new(fs::File::create(path).unwrap(), 2, 1);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::One);
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![0, 0, 0, 255, 0, 0]);
    }
    encoder.write_header().unwrap().write_image_data(&[0x40]).unwrap();
}

#[test]
fn a_mosaic_says_what_its_pieces_are_converted_from() {
    let (_dir, path) = sandbox();
    few_bits(&path("few.png"), png::ColorType::Grayscale);
    few_bits(&path("palette.png"), png::ColorType::Indexed);
    write_png(&path("rgb.png"), [2, 1], png::ColorType::Rgb, png::BitDepth::Eight, &texels(6, 1));
    let said = |names: &[&str]| {
        let lines = names.iter().enumerate().map(|(y, name)| format!("0 {y} {name}.png\n"));
        fs::write(path("m.txt"), format!("vastex mosaic\n{}", lines.collect::<String>())).unwrap();
        open(&path("m.txt")).unwrap().header().conversions()
    };
    assert_eq!(said(&["rgb", "rgb"]), [""; 0]);
    assert_eq!(said(&["palette", "palette"]), ["from numbers of a palette"]);
    assert_eq!(
        said(&["rgb", "palette", "few", "palette"]),
        ["from numbers of a palette in 2 of 4 pieces", "from grey of 1 bit in 1 of 4 pieces"]
    );
}

/// Counts how often it is asked before rows are read, and ends all at a time.
struct EndsAt {
    asked: Cell<u32>,
    end: u32,
}

impl Progress for EndsAt {
    fn opening(&self) -> ControlFlow<()> {
        self.asked.set(self.asked.get() + 1);
        if self.asked.get() < self.end { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }

    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        panic!("rows are read")
    }
}

/// A mosaic may have so many pieces that somebody changes their mind while they are opened, or looked at to
/// see whether they have been changed.
#[test]
fn the_opening_of_a_mosaic_is_broken_off_at_any_piece() {
    let (_dir, path) = sandbox();
    for name in ["p_0_0.png", "p_1_0.png", "p_2_0.png"] {
        few_bits(&path(name), png::ColorType::Grayscale);
    }
    fs::write(path("grid.txt"), "vastex mosaic\ngrid p_{x}_{y}.png\n").unwrap();
    fs::write(path("lines.txt"), "vastex mosaic\n0 0 p_0_0.png\n2 0 p_1_0.png\n4 0 p_2_0.png\n").unwrap();
    let cache = BuildCache::new(path("cache"), 1 << 20);
    // Names of the grid that are looked for and three pieces, each opened and then looked at with the text.
    for (name, opening, last) in [("grid.txt", 10, 14), ("lines.txt", 3, 7)] {
        let image = path(name);
        for end in 1..=last {
            let ends = || EndsAt { asked: Cell::new(0), end };
            let (building, caching, decoding) = (ends(), ends(), ends());
            let options = BuildOptions::default();
            let built = vastex_build::build(&[&*image], &path("o.vastex"), &options, &building).map(drop);
            assert!(matches!(built, Err(BuildError::Cancelled)), "{end}: {built:?}");
            assert!(!path("o.vastex").exists());
            let cached = cache.open(&image, &options, &caching).map(drop);
            assert!(matches!(cached, Err(CacheError::Build(BuildError::Cancelled))), "{end}: {cached:?}");
            // That it is no longer wanted may be found twice.
            for ended in [&building, &caching] {
                assert!((end..=end + 2).contains(&ended.asked.get()), "{end}: {}", ended.asked.get());
            }
            // Nothing is compared where all is decoded anew.
            let decoded = Decoding::open_while(&image, &DecodeOptions::default(), &decoding).map(drop);
            assert_eq!(matches!(decoded, Err(BuildError::Cancelled)), end <= opening, "{end}: {decoded:?}");
        }
    }
}

/// The same of a mosaic that is a mask, an inset, or put in the place of what is there.
#[test]
fn a_mosaic_is_broken_off_wherever_it_is_opened() {
    let (_dir, path) = sandbox();
    for name in ["p_0_0.png", "p_1_0.png", "p_2_0.png"] {
        few_bits(&path(name), png::ColorType::Grayscale);
    }
    let (mosaic, ground, kept) = (path("lines.txt"), path("ground.png"), path("kept.vastex"));
    fs::write(&mosaic, "vastex mosaic\n0 0 p_0_0.png\n2 0 p_1_0.png\n4 0 p_2_0.png\n").unwrap();
    vastex_build::build(&[&*mosaic], &kept, &BuildOptions::default(), &()).unwrap();
    // Insets are finer than the tail.
    write_png(&ground, [64, 48], png::ColorType::Grayscale, png::BitDepth::Eight, &texels(64 * 48, 3));
    let built = |input: &Path, options: &BuildOptions, progress: &dyn Progress| {
        let built = vastex_build::build(&[input], &path("o.vastex"), options, progress);
        assert!(built.is_ok() || matches!(built, Err(BuildError::Cancelled)), "{built:?}");
        built.is_ok()
    };
    let mask = BuildOptions { mask: Some(mosaic.clone()), ..BuildOptions::default() };
    let inset = Inset { layer: None, image: mosaic.clone(), at: [0; 2], finer: 2 };
    let insets = BuildOptions { page: 16, border: 4, insets: vec![inset], ..BuildOptions::default() };
    let replaced = |progress: &dyn Progress| {
        let replaced = replace(&kept, [0; 2], &[&*mosaic], &ReplaceOptions::default(), progress);
        assert!(replaced.is_ok() || matches!(replaced, Err(ReplaceError::Cancelled)), "{replaced:?}");
        replaced.is_ok()
    };
    type Run<'a> = &'a dyn Fn(&dyn Progress) -> bool;
    let runs: [(Run<'_>, u32); 3] = [
        // The mosaic is what is built and its mask; an inset is checked before the ground is built.
        (&|progress| built(&mosaic, &mask, progress), 6),
        (&|progress| built(&ground, &insets, progress), 6),
        (&replaced, 3),
    ];
    for (run, pieces) in runs {
        let asked_until = |end: u32| OpensUntil(EndsAt { asked: Cell::new(0), end });
        let whole = asked_until(u32::MAX);
        assert!(run(&whole));
        let asked = whole.0.asked.get();
        assert!(asked >= pieces, "{asked} of {pieces}");
        (1..=asked).for_each(|end| assert!(!run(&asked_until(end)), "{end} of {asked}"));
    }
}

/// Ends as [`EndsAt`] does, and reads rows.
struct OpensUntil(EndsAt);

impl Progress for OpensUntil {
    fn opening(&self) -> ControlFlow<()> {
        self.0.opening()
    }

    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Pieces are opened when their rows come, and may be others by then.
#[test]
fn a_piece_that_changes_its_size_meanwhile_is_refused() {
    let (_dir, path) = sandbox();
    let piece = |height: u32| {
        let data = texels(8 * height as usize, 3);
        write_png(&path("p.png"), [8, height], png::ColorType::Grayscale, png::BitDepth::Eight, &data);
    };
    fs::write(path("m.txt"), "vastex mosaic\n0 0 p.png\n").unwrap();
    for height in [5, 7] {
        piece(6);
        let mut reader = open(&path("m.txt")).unwrap();
        piece(height);
        let fault = reader.read_rows(&mut [0; 8]).unwrap_err().to_string();
        assert!(fault.contains("p.png: was changed while it was read"), "{fault}");
    }
}

#[test]
fn tiff_of_floats() {
    let (_dir, path) = sandbox();
    let file = path("a.tif");
    let size = [SIZE[0] as u32, SIZE[1] as u32];
    let singles = numbers(1.0);
    let mut out = std::io::Cursor::new(Vec::new());
    TiffEncoder::new(&mut out)
        .unwrap()
        .write_image::<colortype::Gray32Float>(size[0], size[1], &singles)
        .unwrap();
    fs::write(&file, out.into_inner()).unwrap();
    let (header, image) = read(&file).unwrap();
    assert_eq!((header.format, header.notices.len()), (PixelFormat::GREY8.with_sample(Sample::F32), 0));
    assert!(image == singles.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>());

    let doubles: Vec<f64> = singles.iter().map(|&v| f64::from(v) + 1e-9).collect();
    let mut out = std::io::Cursor::new(Vec::new());
    TiffEncoder::new(&mut out)
        .unwrap()
        .write_image::<colortype::Gray64Float>(size[0], size[1], &doubles)
        .unwrap();
    fs::write(&file, out.into_inner()).unwrap();
    let (header, image) = read(&file).unwrap();
    assert!(header.notices.contains(&Notice::DoublesNarrowed));
    assert!(image == doubles.iter().flat_map(|&v| (v as f32).to_le_bytes()).collect::<Vec<u8>>());
}
