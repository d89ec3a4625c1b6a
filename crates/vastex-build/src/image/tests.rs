//! Tests of reading with help: that it is truly done at once, gives the same rows, the same faults and the
//! same containers.

#[path = "../../tests/suite/common/exr.rs"]
#[allow(unreachable_pub, reason = "shared with the other test program")]
mod exr_files;
#[path = "../../tests/suite/common/files.rs"]
#[allow(dead_code, unreachable_pub, reason = "shared with the other test program, which uses all of it")]
mod files;

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use exr::prelude::{Blocks, Compression, FlatSamples, Vec2};
use png::{BitDepth, ColorType, ScaledFloat};
use tempfile::TempDir;
use tiff::encoder::{Compression as TiffCompression, DeflateLevel, TiffEncoder, colortype};

use self::exr_files::{encoding, exr_of};
use self::files::HandmadeTiff;
use super::{Helpers, Rendezvous, RowReader, in_srgb, open};
use crate::{BuildError, BuildOptions, LayerInput, Progress, build};

const SIZE: [u32; 2] = [1024, 384];
const TILE: u32 = 128;
const PIECES: usize = 6;

/// A file of every kind that can be decoded in pieces.
struct Sandbox {
    dir: TempDir,
    data: Vec<u8>,
}

const ALL: [&str; 7] =
    ["strips.tif", "tiles.tif", "planes.tif", "lines.exr", "tiles.exr", "zoom.dzi", "profile.png"];

impl Sandbox {
    fn new() -> Sandbox {
        let texels = SIZE[0] * SIZE[1] * 3;
        let data = (0..texels)
            .map(|i| if i / 5000 % 2 == 0 { (i / 91) as u8 } else { (i.wrapping_mul(i) >> 7) as u8 });
        let sandbox = Sandbox { dir: tempfile::tempdir().unwrap(), data: data.collect() };
        sandbox.strips();
        sandbox.handmade("tiles.tif", [TILE; 2], true, 1);
        sandbox.handmade("planes.tif", [SIZE[0], 48], false, 3);
        sandbox.exr("lines.exr", Blocks::ScanLines);
        sandbox.exr("tiles.exr", Blocks::Tiles(Vec2(128, 64)));
        sandbox.zoom();
        sandbox.profile();
        sandbox
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn strips(&self) {
        let file = fs::File::create(self.path("strips.tif")).unwrap();
        let deflate = TiffCompression::Deflate(DeflateLevel::Fast);
        let mut encoder = TiffEncoder::new(file).unwrap().with_compression(deflate);
        let mut image = encoder.new_image::<colortype::RGB8>(SIZE[0], SIZE[1]).unwrap();
        image.rows_per_strip(24).unwrap();
        image.write_data(&self.data).unwrap();
    }

    fn handmade(&self, name: &str, chunk: [u32; 2], tiled: bool, planes: usize) {
        let mut file = HandmadeTiff::new(SIZE, &[8; 3], 2, chunk, tiled);
        if planes > 1 {
            file.set(284, 2);
        }
        for plane in 0..planes {
            let of_plane = |texel: &[u8]| texel[plane * 3 / planes..][..3 / planes].to_vec();
            let texels: Vec<u8> = self.data.chunks(3).flat_map(of_plane).collect();
            file.cut(SIZE, 3 / planes, chunk, &texels);
        }
        fs::write(self.path(name), file.bytes()).unwrap();
    }

    fn exr(&self, name: &str, blocks: Blocks) {
        let channel = |(c, name): (usize, &'static str)| {
            let samples = self.data.iter().skip(c).step_by(3).map(|v| f32::from(*v) / 255.0);
            (name, FlatSamples::F32(samples.collect()))
        };
        let channels = ["R", "G", "B"].into_iter().enumerate().map(channel).collect();
        let file = exr_of(SIZE.map(|n| n as usize), encoding(Compression::ZIP16, blocks), channels, false);
        fs::write(self.path(name), file).unwrap();
    }

    fn png(&self, path: &Path, at: [u32; 2], size: [u32; 2], gamma: Option<f32>) {
        let mut encoder = png::Encoder::new(fs::File::create(path).unwrap(), size[0], size[1]);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        if let Some(gamma) = gamma {
            encoder.set_source_gamma(ScaledFloat::new(gamma));
        }
        let row = |y: u32| &self.data[((at[1] + y) * SIZE[0] + at[0]) as usize * 3..][..size[0] as usize * 3];
        let rows: Vec<u8> = (0..size[1]).flat_map(row).copied().collect();
        encoder.write_header().unwrap().write_image_data(&rows).unwrap();
    }

    fn zoom(&self) {
        let [width, height] = SIZE;
        let manifest = format!(
            "<Image TileSize=\"{TILE}\" Overlap=\"0\" Format=\"png\"><Size Width=\"{width}\" Height=\"{height}\"/></Image>"
        );
        fs::write(self.path("zoom.dzi"), manifest).unwrap();
        fs::create_dir_all(self.path("zoom_files/10")).unwrap();
        for (row, y) in (0..height).step_by(TILE as usize).enumerate() {
            for (column, x) in (0..width).step_by(TILE as usize).enumerate() {
                let size = [TILE.min(width - x), TILE.min(height - y)];
                self.png(&self.path(&format!("zoom_files/10/{column}_{row}.png")), [x, y], size, None);
            }
        }
    }

    /// Its colours must be converted.
    fn profile(&self) {
        self.png(&self.path("profile.png"), [0; 2], SIZE, Some(1.0 / 1.8));
    }

    /// Changes bytes of a file from some shares of it on.
    fn damage(&self, name: &str, shares: &[f64]) {
        let mut bytes = fs::read(self.path(name)).unwrap();
        for share in shares {
            let at = (bytes.len() as f64 * share) as usize;
            bytes[at..at + 40].fill(0xa5);
        }
        fs::write(self.path(name), bytes).unwrap();
    }
}

/// Rows that have the samples of the file are converted from nothing.
#[test]
fn what_is_handed_out_as_it_is_stored_is_not_converted() {
    let directory = tempfile::tempdir().unwrap();
    let (jpeg, png) = (directory.path().join("a.jpg"), directory.path().join("a.png"));
    let mut compress = mozjpeg::Compress::new(mozjpeg::ColorSpace::JCS_CMYK);
    compress.set_size(8, 8);
    let mut started = compress.start_compress(Vec::new()).unwrap();
    started.write_scanlines(&[90; 8 * 8 * 4]).unwrap();
    fs::write(&jpeg, started.finish().unwrap()).unwrap();
    let mut encoder = png::Encoder::new(fs::File::create(&png).unwrap(), 2, 1);
    encoder.set_color(ColorType::Indexed);
    encoder.set_palette(vec![0, 0, 0, 255, 0, 0]);
    encoder.write_header().unwrap().write_image_data(&[0, 1]).unwrap();
    for (path, from) in [(jpeg, "from inks (CMYK)"), (png, "from numbers of a palette")] {
        assert_eq!(open(&path).unwrap().header().conversions(), [from]);
        let (stored, _) = super::open::open_stored(&path).unwrap();
        assert_eq!(stored.header().conversions(), [""; 0], "{}", path.display());
    }
}

fn opened(path: &Path) -> Box<dyn RowReader> {
    in_srgb(open(path).unwrap())
}

/// All rows that can be read, and the fault that ends them.
fn rows(mut reader: Box<dyn RowReader>) -> (Vec<u8>, Option<String>) {
    let row_bytes = reader.header().row_bytes();
    let mut texels = vec![0; row_bytes * reader.header().height as usize];
    let mut done = 0;
    for portion in texels.chunks_mut(7 * row_bytes) {
        if let Err(fault) = reader.read_rows(portion) {
            texels.truncate(done);
            return (texels, Some(fault.to_string()));
        }
        done += portion.len();
    }
    (texels, None)
}

#[test]
fn pieces_are_decoded_at_once_and_rows_are_the_same() {
    let sandbox = Sandbox::new();
    for name in ALL {
        let path = sandbox.path(name);
        let (alone, fault) = rows(opened(&path));
        assert_eq!(fault, None, "{name}");
        let (rendezvous, mut reader) = (Arc::new(Rendezvous::default()), opened(&path));
        assert!(reader.memory_ahead(PIECES) > 0 && reader.memory_ahead(0) == 0, "{name}");
        reader.take_help(&Helpers::watched(3, PIECES, rendezvous.watch(4)));
        assert!(rows(reader) == (alone.clone(), None), "{name}");
        assert_eq!(rendezvous.most(), 4, "{name}: three helpers and who reads are not at work at once");
        match name {
            "profile.png" => assert!(alone != sandbox.data),
            _ if name.ends_with(".exr") => {}
            "zoom.dzi" => assert!(alone.chunks(4).zip(sandbox.data.chunks(3)).all(|(a, b)| a[..3] == *b)),
            _ => assert!(alone == sandbox.data, "{name}"),
        }
    }
}

#[test]
fn the_first_damage_ends_the_rows_whoever_finds_it() {
    let sandbox = Sandbox::new();
    let zoom = ["zoom_files/10/3_1.png", "zoom_files/10/1_2.png", "zoom_files/10/5_1.png"];
    zoom.iter().for_each(|tile| sandbox.damage(tile, &[0.5]));
    for name in ["strips.tif", "lines.exr", "tiles.exr", "profile.png"] {
        sandbox.damage(name, &[0.9, 0.5, 0.6]);
    }
    for name in ["strips.tif", "lines.exr", "tiles.exr", "zoom.dzi", "profile.png"] {
        let path = sandbox.path(name);
        let alone = rows(opened(&path));
        assert!(alone.1.is_some(), "{name} is not damaged");
        for _ in 0..2 {
            let mut reader = opened(&path);
            reader.take_help(&Helpers::watched(3, PIECES, Arc::new(|| {})));
            let helped = rows(reader);
            assert_eq!((helped.0.len(), &helped.1), (alone.0.len(), &alone.1), "{name}");
            assert!(helped.0 == alone.0, "{name}");
        }
        let errors = [1, 4].map(|threads| {
            let options = BuildOptions { threads, ..BuildOptions::default() };
            let output = sandbox.path("out.vastex");
            let error = build(&[&path], &output, &options, &()).unwrap_err().to_string();
            assert!(!output.exists());
            error
        });
        assert!(errors[0] == errors[1] && errors[0].contains(alone.1.as_ref().unwrap()), "{errors:?}");
    }
}

fn bytes_of(
    sandbox: &Sandbox,
    inputs: &[LayerInput],
    options: &BuildOptions,
) -> Result<(u64, Vec<u8>), BuildError> {
    let output = sandbox.path("out.vastex");
    let report = build(inputs, &output, options, &())?;
    Ok((report.memory, fs::read(output).unwrap()))
}

fn input(sandbox: &Sandbox, name: &str) -> LayerInput {
    LayerInput { name: name.replace('.', "-"), ..LayerInput::from(sandbox.path(name)) }
}

#[test]
fn containers_depend_on_no_number_of_threads() {
    let sandbox = Sandbox::new();
    let several = ["strips.tif", "lines.exr", "profile.png"].map(|name| input(&sandbox, name));
    let cases = ALL.map(|name| vec![input(&sandbox, name)]).into_iter().chain([several.to_vec()]);
    for inputs in cases {
        let build = |threads| {
            bytes_of(&sandbox, &inputs, &BuildOptions { threads, ..BuildOptions::default() }).unwrap().1
        };
        assert!(build(1) == build(4), "{:?}", inputs[0].path);
    }
}

#[test]
fn pieces_count_as_memory_and_are_given_up_where_there_is_little() {
    let sandbox = Sandbox::new();
    // Read straight from the file.
    sandbox.handmade("plain.tif", [SIZE[0], 24], false, 1);
    let (compressed, plain) = (opened(&sandbox.path("strips.tif")), opened(&sandbox.path("plain.tif")));
    let (held, ahead) = (compressed.header().memory, compressed.memory_ahead(8));
    assert!(ahead > 1 << 20 && (plain.header().memory, plain.memory_ahead(8)) == (0, 0));
    let options = BuildOptions { threads: 4, ..BuildOptions::default() };
    let built = |name| bytes_of(&sandbox, &[input(&sandbox, name)], &options).unwrap();
    let ((most, expected), (without, _)) = (built("strips.tif"), built("plain.tif"));
    assert!(most >= without + held + ahead, "{most} {without} {held} {ahead}");
    let mut limit = most;
    let limited = |memory_limit| {
        bytes_of(
            &sandbox,
            &[input(&sandbox, "strips.tif")],
            &BuildOptions { memory_limit, ..options.clone() },
        )
    };
    while let Ok((memory, bytes)) = limited(limit) {
        assert!(memory <= limit && bytes == expected, "{memory} of {limit}");
        limit = memory - 1;
    }
    assert!(limit + ahead < most);
}

#[test]
fn a_false_length_takes_neither_memory_nor_help() {
    let sandbox = Sandbox::new();
    sandbox.handmade("false.tif", [TILE; 2], true, 1);
    let memory = |name| {
        let reader = opened(&sandbox.path(name));
        (reader.header().memory, reader.memory_ahead(PIECES))
    };
    let (held, ahead) = memory("false.tif");
    let mut bytes = fs::read(sandbox.path("false.tif")).unwrap();
    // The last of the lengths, all of which are those of a whole tile.
    let length = (TILE * TILE * 3).to_le_bytes();
    let lengths = [length, length].concat();
    let at = bytes.windows(8).rposition(|two| two == lengths).unwrap() + 4;
    bytes[at..at + 4].fill(0xff);
    fs::write(sandbox.path("false.tif"), &bytes).unwrap();
    let (false_held, false_ahead) = memory("false.tif");
    assert!(ahead > 0 && false_ahead >= ahead, "{false_ahead} {ahead}");
    assert!(false_held <= held + bytes.len() as u64, "{false_held} {held}");
    let error = bytes_of(&sandbox, &[input(&sandbox, "false.tif")], &BuildOptions::default()).unwrap_err();
    assert!(error.to_string().contains("truncated"), "{error}");
}

#[test]
fn a_build_that_is_helped_can_be_cancelled() {
    struct Impatient;
    impl Progress for Impatient {
        fn advance(&self, rows_done: u64, _: u64, _: u64) -> ControlFlow<()> {
            if rows_done > 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
    }
    let sandbox = Sandbox::new();
    for name in ALL {
        let (output, options) =
            (sandbox.path("out.vastex"), BuildOptions { threads: 4, ..BuildOptions::default() });
        let cancelled = build(&[sandbox.path(name)], &output, &options, &Impatient);
        assert!(matches!(cancelled, Err(BuildError::Cancelled)) && !output.exists(), "{name}");
    }
}
