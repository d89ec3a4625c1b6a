//! Builds that leave pages out: by a mask, where everything is transparent, and where a tile directory has no
//! tiles.

use std::path::Path;

use crate::common::{texels, tiles, write_png};
use png::BitDepth::Eight;
use png::ColorType::{Grayscale, Rgb, Rgba};
use vastex_build::{BuildError, BuildOptions, BuildReport, PartOf, build, merge};
use vastex_core::{PagePos, PageSet};
use vastex_tiles::{Compression, Container, TileSource, conformance};

const SIZE: [u32; 2] = [300, 210];

fn options() -> BuildOptions {
    BuildOptions { page: 16, border: 4, compression: Compression::Lz4, ..BuildOptions::default() }
}

fn image(directory: &Path, color: png::ColorType, data: &[u8]) -> std::path::PathBuf {
    let path = directory.join("image.png");
    write_png(&path, SIZE, color, Eight, data);
    path
}

/// A picture that is transparent but for a disc.
fn disc() -> Vec<u8> {
    let mut data = texels((SIZE[0] * SIZE[1] * 4) as usize, 7);
    for (i, texel) in (0..).zip(data.chunks_exact_mut(4)) {
        let [x, y] = [i % SIZE[0], i / SIZE[0]];
        texel[3] = if (x.abs_diff(100)).pow(2) + (y.abs_diff(90)).pow(2) < 50 * 50 { 255 } else { 0 };
    }
    data
}

fn pages(path: &Path) -> (Container, PageSet, u64) {
    let container = Container::open_file(path).unwrap();
    assert_eq!(conformance(&container), Ok(()));
    let geometry = &container.description().geometry;
    let present =
        container.present().map_or_else(|| PageSet::from_pages(geometry, |_| true), |set| (**set).clone());
    let count = geometry.page_count();
    (container, present, count)
}

fn built(input: &Path, output: &Path, options: &BuildOptions) -> BuildReport {
    build(&[input], output, options, &()).unwrap()
}

#[test]
fn a_mask_of_any_size_leaves_out_what_it_does_not_mark() {
    let dir = tempfile::tempdir().unwrap();
    let input = image(dir.path(), Rgb, &texels((SIZE[0] * SIZE[1] * 3) as usize, 3));
    let whole = dir.path().join("whole.vastex");
    built(&input, &whole, &options());
    let (_, all) = tiles(&whole);
    for scale in [1, 3, 30] {
        let mask = dir.path().join("mask.png");
        let size = SIZE.map(|n| n / scale);
        // The west of the upper half.
        let marks: Vec<u8> = (0..size[0] * size[1])
            .map(|i| u8::from(i % size[0] < size[0] / 2 && i / size[0] < size[1] / 2))
            .collect();
        write_png(&mask, size, Grayscale, Eight, &marks);
        let output = dir.path().join("masked.vastex");
        let report = built(&input, &output, &BuildOptions { mask: Some(mask), ..options() });
        let (container, present, count) = pages(&output);
        assert_eq!((report.tiles, report.absent_tiles), (present.count(), count - present.count()));
        let geometry = &container.description().geometry;
        for pos in geometry.pages_of_level(0) {
            let marked = pos.x * 16 < size[0] / 2 * scale && pos.y * 16 < size[1] / 2 * scale;
            assert_eq!(present.contains(pos), marked, "{pos} at 1/{scale}");
        }
        // What is there is what the whole has.
        let (_, some) = tiles(&output);
        assert_eq!(some.len() as u64, present.count());
        assert!(some.iter().all(|tile| all.contains(tile)));
    }
}

#[test]
fn transparent_pages_are_left_out_with_their_transparent_ancestors() {
    let dir = tempfile::tempdir().unwrap();
    let data = disc();
    let input = image(dir.path(), Rgba, &data);
    let output = dir.path().join("disc.vastex");
    let dropping = BuildOptions { drop_transparent: true, ..options() };
    built(&input, &output, &dropping);
    let (container, present, _) = pages(&output);
    let geometry = &container.description().geometry;
    let opaque = |x: i64, y: i64| {
        let [x, y] = [x.clamp(0, i64::from(SIZE[0]) - 1), y.clamp(0, i64::from(SIZE[1]) - 1)];
        data[(y as usize * SIZE[0] as usize + x as usize) * 4 + 3] != 0
    };
    let shows = |pos: PagePos| {
        let shown = geometry.level_box_of_tile(pos);
        (0..24).any(|v| (0..24).any(|u| opaque(shown.origin[0] + u, shown.origin[1] + v)))
    };
    assert_eq!(
        present,
        PageSet::from_pages(geometry, |pos| {
            let (lo, hi) = geometry.descendants(pos, 0);
            (lo[1]..hi[1]).any(|y| (lo[0]..hi[0]).any(|x| shows(PagePos::new_2d(0, x, y))))
        })
    );
    let all = dir.path().join("all.vastex");
    assert_eq!(built(&input, &all, &options()).absent_tiles, 0);
}

#[test]
fn parts_that_leave_pages_out_join_to_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let input = image(dir.path(), Rgba, &disc());
    let mask = dir.path().join("mask.png");
    write_png(
        &mask,
        [30, 21],
        Grayscale,
        Eight,
        &texels(30 * 21, 5).iter().map(|v| v / 200).collect::<Vec<_>>(),
    );
    let options = BuildOptions { mask: Some(mask), drop_transparent: true, ..options() };
    let whole = dir.path().join("whole.vastex");
    built(&input, &whole, &options);
    let parts: Vec<_> = (1..=3).map(|part| dir.path().join(format!("{part}.part"))).collect();
    for (part, path) in (1..).zip(&parts) {
        let part = PartOf::new(part, 3);
        built(&input, path, &BuildOptions { part, ..options.clone() });
        // Going on with a whole part makes nothing anew.
        let again = dir.path().join("again.part");
        built(&input, &again, &BuildOptions { part, resume: true, ..options.clone() });
        assert_eq!(std::fs::read(&again).unwrap(), std::fs::read(path).unwrap());
    }
    let merged = dir.path().join("merged.vastex");
    merge(&parts, &merged, false, |_, _| std::ops::ControlFlow::Continue(())).unwrap();
    assert_eq!(std::fs::read(merged).unwrap(), std::fs::read(whole).unwrap());
}

#[test]
fn what_cannot_say_what_to_leave_out_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let input = image(dir.path(), Grayscale, &texels((SIZE[0] * SIZE[1]) as usize, 3));
    let output = dir.path().join("out.vastex");
    let refused = |options: BuildOptions| build(&[&input], &output, &options, &()).unwrap_err();
    assert!(matches!(refused(BuildOptions { drop_transparent: true, ..options() }), BuildError::NoAlpha));
    let mask = dir.path().join("mask.png");
    write_png(&mask, [100, 100], Grayscale, Eight, &[1; 10_000]);
    let message = refused(BuildOptions { mask: Some(mask.clone()), ..options() }).to_string();
    assert!(message.contains("mask.png") && message.contains("300x210"), "{message}");
    let message =
        build(&[&input], &mask, &BuildOptions { mask: Some(mask.clone()), ..options() }, &()).unwrap_err();
    assert!(matches!(message, BuildError::SameFile(_)), "{message}");
    assert!(!output.exists());
}
