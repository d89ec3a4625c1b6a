//! Parts made one by one and joined give the very bytes of one build; what does not belong together is
//! refused.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use crate::common::{build_file, texels, write_png};
use png::{BitDepth, ColorType};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use vastex_build::{BuildOptions, MergeError, PartOf, Written, build, merge};
use vastex_core::AddressMode::{Clamp, Mirror, Wrap};
use vastex_tiles::{Compression, Container};

fn go_on(_: u64, _: u64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn join(parts: &[PathBuf], output: &Path) -> Result<Written, MergeError> {
    merge(parts, output, false, go_on)
}

/// All parts of a container, beside the image.
fn build_parts(input: &Path, options: &BuildOptions, parts: u32) -> Vec<PathBuf> {
    let build_part = |part| {
        let output = input.with_file_name(format!("{part}.part"));
        let options = BuildOptions { part: PartOf::new(part, parts), ..options.clone() };
        build(&[input], &output, &options, &()).unwrap();
        output
    };
    (1..=parts).map(build_part).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, rng_seed: RngSeed::Fixed(9), failure_persistence: None, ..Default::default() })]

    #[test]
    fn joined_parts_are_the_bytes_of_one_build(
        size in prop::array::uniform2(prop_oneof![1u32..12, 12u32..150, 150u32..350]),
        (page, share) in (8u32..90, 0u32..100),
        address in prop::array::uniform2(prop::sample::select(vec![Clamp, Wrap, Mirror])),
        compression in prop::sample::select(vec![Compression::None, Compression::Lz4, Compression::Zstd(1)]),
        filter in prop::sample::select(vec!["box-linear", "box-linear", "kaiser@zero", "sharpen5@two"]),
        parts in 1u32..9,
        reversed: bool,
    ) {
        let dir = tempfile::tempdir().unwrap();
        let input = dir.path().join("in.png");
        let mut data = texels((3 * size[0] * size[1]) as usize, size[0] + size[1]);
        let half = data.len() / 2;
        data[half..].fill(9);
        write_png(&input, size, ColorType::Rgb, BitDepth::Eight, &data);
        let border = 1 + (page / 2 - 1) * share / 100;
        let filter = Some(filter.parse().unwrap());
        let options =
            BuildOptions { page, border, address, compression, filter, threads: 2, ..BuildOptions::default() };
        let mut paths = build_parts(&input, &options, parts);
        if reversed {
            paths.reverse();
        }
        let (whole, report) = build_file(&input, &options);
        let joined = dir.path().join("joined.vastex");
        let written = join(&paths, &joined).unwrap();
        prop_assert!(std::fs::read(&joined).unwrap() == std::fs::read(&whole).unwrap());
        prop_assert_eq!((written.tiles, written.bytes), (report.tiles, report.bytes));
    }
}

#[test]
fn what_does_not_belong_together_is_refused_and_leaves_nothing_behind() {
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("in.png");
    write_png(&input, [300, 200], ColorType::Grayscale, BitDepth::Eight, &texels(60_000, 1));
    let options = BuildOptions { page: 32, ..BuildOptions::default() };
    let [a, b, c] = build_parts(&input, &options, 3).try_into().unwrap();
    let keep = |path: &Path, name: &str| {
        let kept = dir.path().join(name);
        std::fs::copy(path, &kept).unwrap();
        kept
    };
    let [a, b, c] = [keep(&a, "a"), keep(&b, "b"), keep(&c, "c")];
    let with = |options: BuildOptions, name: &str| keep(&build_parts(&input, &options, 3)[1], name);
    let other_page = with(BuildOptions { page: 40, ..options.clone() }, "page");
    let other_compression = with(BuildOptions { compression: Compression::None, ..options.clone() }, "lz4");
    write_png(&input, [300, 200], ColorType::Grayscale, BitDepth::Eight, &texels(60_000, 2));
    let other_image = with(options.clone(), "image");
    write_png(&input, [300, 200], ColorType::Grayscale, BitDepth::Eight, &texels(60_000, 1));
    let of_four = keep(&build_parts(&input, &options, 4)[1], "four");
    let whole = build_file(&input, &options).0;
    let output = dir.path().join("out.vastex");
    let refused = |parts: &[&PathBuf]| {
        let parts: Vec<PathBuf> = parts.iter().map(|&part| part.clone()).collect();
        let error = join(&parts, &output).unwrap_err().to_string();
        assert!(!output.exists());
        error
    };
    assert!(refused(&[]).contains("name all parts"));
    assert!(refused(&[&a, &c]).contains("part 2 of 3 is missing; make it with `vastex build --shard 2/3`"));
    assert!(refused(&[&a, &b, &c, &b]).contains("are both part 2 of 3"));
    assert!(refused(&[&a, &other_page, &c]).contains("differ in size, pages, layers or filters"));
    assert!(refused(&[&a, &other_compression, &c]).contains("differ in the image or the compression"));
    assert!(refused(&[&a, &other_image, &c]).contains("differ in the image or the compression"));
    assert!(refused(&[&a, &of_four, &c]).contains("differ in the number of parts"));
    assert!(refused(&[&a, &input, &c]).contains("this is no part of a container"));
    assert!(refused(&[&a, &dir.path().join("none"), &c]).contains("none: cannot be read"));
    assert!(refused(&[&a, &dir.path().to_path_buf(), &c]).contains("is a directory, a device or a pipe"));
    if cfg!(unix) {
        let pipe = dir.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        assert!(refused(&[&a, &pipe, &c]).contains("pipe: is a directory, a device or a pipe"));
    }
    let error = join(&[a.clone(), b.clone(), c.clone()], &b).unwrap_err();
    assert!(matches!(error, MergeError::SameFile(_)), "{error}");
    let cancelled = merge(&[&a, &b, &c], &output, false, |_, _| ControlFlow::Break(())).unwrap_err();
    assert!(matches!(cancelled, MergeError::Cancelled) && !output.exists());
    let error = Container::open_file(&a).unwrap_err().to_string();
    assert!(
        error.contains("this is part 1 of 3 of a container; join all parts with `vastex merge`"),
        "{error}"
    );
    for (input, says) in
        [(&a, "a part of a Vastex container; join all parts"), (&whole, "a Vastex container already")]
    {
        let error = build(&[input], &output, &options, &()).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

#[cfg(unix)]
#[test]
fn what_a_killed_merge_left_goes_with_the_next() {
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("in.png");
    write_png(&input, [40, 30], ColorType::Grayscale, BitDepth::Eight, &texels(1200, 1));
    let options = BuildOptions { page: 16, border: 1, ..BuildOptions::default() };
    let (parts, output) = (build_parts(&input, &options, 2), dir.path().join("out.vastex"));
    join(&parts, &output).unwrap();
    let whole = std::fs::read(&output).unwrap();
    std::fs::remove_file(&output).unwrap();
    // Of a number that no process has, nobody is at work on it; the other is no output of this merge.
    let left = dir.path().join(".out.vastex.4194999-0.partial");
    let other = dir.path().join(".other.vastex.4194999-0.partial");
    for path in [&left, &other] {
        std::fs::write(path, &whole[..whole.len() / 2]).unwrap();
    }
    // Nor does one that is refused or stopped leave anything.
    let stopped = merge(&parts, &output, false, |_, _| ControlFlow::Break(()));
    assert!(matches!(stopped, Err(MergeError::Cancelled)) && !left.exists() && !output.exists());
    std::fs::write(&left, b"left").unwrap();
    join(&parts, &output).unwrap();
    assert!(!left.exists() && other.exists());
    assert!(std::fs::read(&output).unwrap() == whole);
    let names = std::fs::read_dir(dir.path()).unwrap();
    let partial =
        names.filter(|entry| entry.as_ref().unwrap().file_name().to_string_lossy().ends_with(".partial"));
    assert_eq!(partial.count(), 1, "the other's");
}

#[test]
fn damaged_parts_are_refused_whatever_the_damage() {
    let dir = tempfile::tempdir().unwrap();
    let input = dir.path().join("in.png");
    write_png(&input, [40, 30], ColorType::Grayscale, BitDepth::Eight, &texels(1200, 1));
    let options = BuildOptions { page: 16, border: 1, ..BuildOptions::default() };
    let parts = build_parts(&input, &options, 2);
    let output = dir.path().join("out.vastex");
    let sound = std::fs::read(&parts[1]).unwrap();
    for at in 0..sound.len() {
        let mut flipped = sound.clone();
        flipped[at] ^= 1 << (at % 8);
        std::fs::write(&parts[1], flipped).unwrap();
        assert!(join(&parts, &output).is_err(), "byte {at} of {}", sound.len());
        std::fs::write(&parts[1], &sound[..at]).unwrap();
        assert!(join(&parts, &output).is_err(), "cut off at {at}");
    }
    std::fs::write(&parts[1], [&sound[..], &[0]].concat()).unwrap();
    assert!(join(&parts, &output).unwrap_err().to_string().contains("goes on after its last tile"));
    assert!(!output.exists());
}
