//! A build that goes on, and parts that are joined, are of one and the same input, whatever files it is made
//! of; and no file of an input is the output.

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use png::{BitDepth, ColorType};
use vastex_build::{BuildError, BuildOptions, Inset, LayerInput, PartOf, Progress, build, merge};

use crate::common::{texels, write_png};

/// Stops a build when some rows are done.
struct Stop;

impl Progress for Stop {
    fn advance(&self, rows_done: u64, rows_total: u64, _: u64) -> ControlFlow<()> {
        if rows_done > 0 && rows_done * 2 >= rows_total {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

struct Sandbox(tempfile::TempDir);

impl Sandbox {
    fn new() -> Sandbox {
        Sandbox(tempfile::tempdir().unwrap())
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn png(&self, name: &str, size: [u32; 2], seed: u32) {
        let data = texels((size[0] * size[1]) as usize, seed);
        write_png(&self.at(name), size, ColorType::Grayscale, BitDepth::Eight, &data);
    }

    /// A raw file of noise, tall, so that a build has written tiles when half of it is read.
    fn raw(&self) {
        fs::write(self.at("a.raw"), texels(RAW[0] * RAW[1] * 2, 3)).unwrap();
        self.describe("");
    }

    fn describe(&self, more: &str) {
        let [width, height] = RAW;
        let text = format!("width = {width}\nheight = {height}\nsample = \"u16\"\n{more}\n");
        fs::write(self.at("a.raw.toml"), text).unwrap();
    }

    fn mosaic(&self) {
        for (n, name) in ["p_0_0.png", "p_1_0.png", "p_0_1.png", "p_1_1.png"].into_iter().enumerate() {
            self.png(name, [128, 600], n as u32);
        }
        fs::write(self.at("m.txt"), "vastex mosaic\ngrid p_{x}_{y}.png\n").unwrap();
    }

    /// Files as they are now, to be put back: times and all.
    fn keep(&self, name: &str) -> (PathBuf, Vec<u8>, std::time::SystemTime) {
        let path = self.at(name);
        (path.clone(), fs::read(&path).unwrap(), path.metadata().unwrap().modified().unwrap())
    }
}

fn put_back((path, bytes, time): (PathBuf, Vec<u8>, std::time::SystemTime)) {
    fs::write(&path, bytes).unwrap();
    fs::File::options().write(true).open(path).unwrap().set_modified(time).unwrap();
}

const RAW: [usize; 2] = [256, 1200];

fn options() -> BuildOptions {
    BuildOptions { page: 64, threads: 1, ..BuildOptions::default() }
}

/// Interrupts a build of `input`, changes a file, and expects that nobody goes on; and that it does when all
/// is as it was.
#[track_caller]
fn expect_told(sandbox: &Sandbox, input: &LayerInput, options: &BuildOptions, file: &str, change: &dyn Fn()) {
    let (kept, output) = (sandbox.keep(file), sandbox.at("out.vastex"));
    let resume = BuildOptions { resume: true, ..options.clone() };
    let input = std::slice::from_ref(input);
    let build = |options: &BuildOptions, progress: &dyn Progress| build(input, &output, options, progress);
    assert!(matches!(build(&resume, &Stop), Err(BuildError::Cancelled)));
    change();
    let error = build(&resume, &()).unwrap_err().to_string();
    assert!(error.contains("build without --resume"), "{file}: {error}");
    put_back(kept);
    let report = build(&resume, &()).unwrap();
    assert!(report.resumed_tiles > 0, "{file}");
    fs::remove_file(output).unwrap();
}

/// Builds one part, changes a file, builds the other: they are not joined.
#[track_caller]
fn expect_parts_told(sandbox: &Sandbox, input: &Path, file: &str, change: &dyn Fn()) {
    let kept = sandbox.keep(file);
    let part = |n: u32| {
        let output = sandbox.at(&format!("{n}.part"));
        let options = BuildOptions { part: PartOf::new(n, 2), ..options() };
        build(&[input], &output, &options, &()).unwrap();
        output
    };
    let first = part(1);
    change();
    let parts = [first, part(2)];
    let join =
        |parts: &[PathBuf]| merge(parts, &sandbox.at("out.vastex"), false, |_, _| ControlFlow::Continue(()));
    let error = join(&parts).unwrap_err().to_string();
    assert!(error.contains("do not belong together"), "{file}: {error}");
    put_back(kept);
    // Other times are no matter: parts come from several machines.
    fs::File::options()
        .write(true)
        .open(sandbox.at(file))
        .unwrap()
        .set_modified(std::time::SystemTime::now())
        .unwrap();
    part(2);
    join(&parts).unwrap();
}

#[test]
fn a_raw_file_and_its_description_are_one_input_however_it_is_named() {
    for named in ["a.raw", "a.raw.toml"] {
        let sandbox = Sandbox::new();
        sandbox.raw();
        let input = LayerInput::from(sandbox.at(named));
        for change in ["endian = \"big\"", "first_row = \"bottom\""] {
            expect_told(&sandbox, &input, &options(), "a.raw.toml", &|| sandbox.describe(change));
            expect_parts_told(&sandbox, &sandbox.at(named), "a.raw.toml", &|| sandbox.describe(change));
        }
        let texels = || fs::write(sandbox.at("a.raw"), texels(RAW[0] * RAW[1] * 2, 4)).unwrap();
        expect_told(&sandbox, &input, &options(), "a.raw", &texels);
        expect_parts_told(&sandbox, &sandbox.at(named), "a.raw", &texels);
    }
}

#[test]
fn every_piece_of_a_mosaic_counts() {
    let sandbox = Sandbox::new();
    sandbox.mosaic();
    let input = LayerInput::from(sandbox.at("m.txt"));
    for piece in ["p_0_0.png", "p_1_1.png"] {
        expect_told(&sandbox, &input, &options(), piece, &|| sandbox.png(piece, [128, 600], 77));
        expect_parts_told(&sandbox, &sandbox.at("m.txt"), piece, &|| sandbox.png(piece, [128, 600], 77));
    }
}

#[test]
fn masks_and_insets_count_with_all_their_files() {
    let sandbox = Sandbox::new();
    sandbox.png("a.png", [256, 1200], 1);
    sandbox.raw();
    sandbox.mosaic();
    let input = LayerInput::from(sandbox.at("a.png"));
    let mask = BuildOptions { mask: Some(sandbox.at("m.txt")), ..options() };
    expect_told(&sandbox, &input, &mask, "p_1_0.png", &|| sandbox.png("p_1_0.png", [128, 600], 78));
    let inset = Inset { layer: None, image: sandbox.at("a.raw"), at: [0, 0], finer: 0 };
    let insets = BuildOptions { insets: vec![inset], ..options() };
    expect_told(&sandbox, &input, &insets, "a.raw.toml", &|| sandbox.describe("endian = \"big\""));
}

#[test]
fn bytes_that_no_sample_sees_are_told_by_their_time() {
    let sandbox = Sandbox::new();
    sandbox.raw();
    let input = LayerInput::from(sandbox.at("a.raw"));
    let change = || {
        let mut bytes = fs::read(sandbox.at("a.raw")).unwrap();
        // Of 614,400 bytes 64 blocks of 4,096 are looked at, about every 9,687.
        bytes[6000] ^= 1;
        fs::write(sandbox.at("a.raw"), bytes).unwrap();
        // File systems' clocks may be slower than this test.
        let file = fs::File::options().write(true).open(sandbox.at("a.raw")).unwrap();
        file.set_modified(std::time::SystemTime::now() + std::time::Duration::from_secs(2)).unwrap();
    };
    expect_told(&sandbox, &input, &options(), "a.raw", &change);
}

#[test]
fn no_file_of_an_input_is_the_output() {
    let sandbox = Sandbox::new();
    sandbox.raw();
    sandbox.mosaic();
    sandbox.png("a.png", [64, 64], 1);
    fs::write(sandbox.at("list.txt"), "vastex mosaic\n0 0 a.raw\n").unwrap();
    let mask = |name: &str| BuildOptions { mask: Some(sandbox.at(name)), ..options() };
    let inset = |name: &str| Inset { layer: None, image: sandbox.at(name), at: [0, 0], finer: 0 };
    let over = |name: &str| BuildOptions { insets: vec![inset(name)], ..options() };
    let cases = [
        ("a.raw.toml", "a.raw", options()),
        ("a.raw", "a.raw.toml", options()),
        ("a.raw", "a.raw", options()),
        ("m.txt", "p_0_0.png", options()),
        ("m.txt", "p_1_1.png", options()),
        ("m.txt", "m.txt", options()),
        ("list.txt", "a.raw", options()),
        ("list.txt", "a.raw.toml", options()),
        ("a.png", "p_0_1.png", mask("m.txt")),
        ("a.png", "a.raw", mask("a.raw.toml")),
        ("m.txt", "a.png", over("a.png")),
        ("m.txt", "a.raw.toml", over("a.raw")),
    ];
    for (input, output, options) in cases {
        let before = fs::read(sandbox.at(output)).unwrap();
        let error = build(&[sandbox.at(input)], &sandbox.at(output), &options, &()).unwrap_err();
        assert!(matches!(error, BuildError::SameFile(_)), "{input} -o {output}: {error}");
        assert!(error.to_string().contains(output), "{error}");
        assert!(fs::read(sandbox.at(output)).unwrap() == before, "{input} -o {output}");
    }
    // Another name of the same file is that file, too.
    fs::hard_link(sandbox.at("a.raw"), sandbox.at("linked.vastex")).unwrap();
    let before = fs::read(sandbox.at("a.raw")).unwrap();
    let error = build(&[sandbox.at("a.raw")], &sandbox.at("linked.vastex"), &options(), &()).unwrap_err();
    assert!(matches!(error, BuildError::SameFile(_)), "{error}");
    assert!(fs::read(sandbox.at("a.raw")).unwrap() == before);
}
