//! Images finer than the texture in which they lie, and regions replaced where pages have no tiles.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use crate::common::files::jpeg;
use crate::common::{texels, tiles, write_png};
use png::BitDepth::Eight;
use png::ColorType::{Grayscale, Rgb, Rgba};
use vastex_build::{
    BuildError, BuildOptions, BuildReport, Inset, Kernel, LayerFilter, LayerInput, LevelsFrom, Meaning,
    PartOf, Progress, ReplaceOptions, build, replace,
};
use vastex_core::AddressMode::{self, Clamp, Wrap};
use vastex_core::{Geometry, PagePos};
use vastex_tiles::{Compression, Container, FileStore, conformance, verify};

/// Size of the coarse image.
const SIZE: [u32; 2] = [150, 105];

fn options() -> BuildOptions {
    BuildOptions { page: 16, border: 4, threads: 2, ..BuildOptions::default() }
}

/// Grey texels of an image, each as often as it has `finer` levels more.
fn enlarged(texels: &[u8], size: [u32; 2], finer: u8) -> Vec<u8> {
    let [width, height] = size.map(|n| n << finer);
    (0..width * height)
        .map(|i| texels[(((i / width) >> finer) * size[0] + ((i % width) >> finer)) as usize])
        .collect()
}

/// Puts grey texels over others.
fn over(whole: &mut [u8], width: u32, part: &[u8], at: [u32; 2], part_width: u32) {
    for (y, row) in (at[1]..).zip(part.chunks_exact(part_width as usize)) {
        whole[(y * width + at[0]) as usize..][..row.len()].copy_from_slice(row);
    }
}

fn all_tiles(path: &Path) -> (Geometry, BTreeMap<PagePos, Vec<u8>>) {
    let container = Container::open_file(path).unwrap();
    assert_eq!(conformance(&container), Ok(()));
    let found = pollster::block_on(verify(std::sync::Arc::new(FileStore::open(path).unwrap()), |_, _| {}));
    assert_eq!(found.faults, []);
    let (description, tiles) = tiles(path);
    (description.geometry, tiles.into_iter().collect())
}

/// A directory with the coarse image in grey, and more images as they are asked for.
struct World {
    dir: tempfile::TempDir,
    coarse: Vec<u8>,
}

impl World {
    fn new() -> World {
        let world =
            World { dir: tempfile::tempdir().unwrap(), coarse: texels((SIZE[0] * SIZE[1]) as usize, 5) };
        world.image("coarse.png", SIZE, &world.coarse);
        world
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn image(&self, name: &str, size: [u32; 2], texels: &[u8]) -> PathBuf {
        write_png(&self.path(name), size, Grayscale, Eight, texels);
        self.path(name)
    }

    fn inset(&self, name: &str, at: [u32; 2], size: [u32; 2], finer: u8) -> (Inset, Vec<u8>) {
        let texels = texels((size[0] * size[1]) as usize, 77 + at[0]);
        (Inset { layer: None, image: self.image(name, size, &texels), at, finer }, texels)
    }

    fn built(&self, name: &str, input: &str, options: &BuildOptions) -> (PathBuf, BuildReport) {
        let output = self.path(name);
        let report = build(&[self.path(input)], &output, options, &()).unwrap();
        (output, report)
    }

    fn files(&self) -> Vec<String> {
        let names = std::fs::read_dir(self.dir.path()).unwrap();
        let mut names: Vec<_> = names.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

/// Returns true if the texels of the tile of `pos` all lie within the box from `at` of so many texels of its
/// level.
fn is_within(geometry: &Geometry, pos: PagePos, at: [i64; 2], size: [i64; 2]) -> bool {
    let shown = geometry.level_box_of_tile(pos);
    (0..2).all(|a| shown.origin[a] >= at[a] && shown.origin[a] + i64::from(shown.size[a]) <= at[a] + size[a])
}

/// Returns true if the payload of `pos` shows any of the box.
fn touches(geometry: &Geometry, pos: PagePos, at: [u32; 2], size: [u32; 2]) -> bool {
    let page = geometry.page()[0];
    [pos.x, pos.y]
        .iter()
        .zip(at.iter().zip(size))
        .all(|(&p, (&at, size))| p * page < at + size && (p + 1) * page > at)
}

/// Breaks off what is decoded before a first row, and nothing else.
struct Impatient;

impl Progress for Impatient {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn beginning(&self, _: f64) -> ControlFlow<()> {
        ControlFlow::Break(())
    }
}

#[test]
fn what_is_decoded_before_the_first_row_is_broken_off_with_insets_as_without() {
    let world = World::new();
    let output = world.path("out.vastex");
    let (slow, quick) = (world.path("coarse.jpg"), world.path("coarse.png"));
    std::fs::write(&slow, jpeg(SIZE, 1, true, &world.coarse)).unwrap();
    let (inset, texels) = world.inset("inset.png", [32, 32], [64, 64], 1);
    let image = world.path("inset.jpg");
    std::fs::write(&image, jpeg([64, 64], 1, true, &texels)).unwrap();
    let slow_inset = Inset { image, ..inset.clone() };
    for (image, insets) in [(&slow, vec![]), (&slow, vec![inset]), (&quick, vec![slow_inset])] {
        let options = BuildOptions { insets, ..options() };
        let built = build(&[image.as_path()], &output, &options, &Impatient);
        assert!(matches!(built, Err(BuildError::Cancelled)) && !output.exists(), "{}", image.display());
    }
    let masked = BuildOptions { mask: Some(slow.clone()), ..options() };
    let built = build(&[quick.as_path()], &output, &masked, &Impatient);
    assert!(matches!(built, Err(BuildError::Cancelled)) && !output.exists(), "a mask");
    // A layer that is enlarged.
    let [width, height] = SIZE.map(|n| n * 5 / 6);
    let small = world.path("small.jpg");
    let gray = vec![99; (width * height) as usize];
    std::fs::write(&small, jpeg([width, height], 1, true, &gray)).unwrap();
    let other = LayerInput { name: "height".into(), ..LayerInput::from(&quick) };
    let built = build(&[small.into(), other], &output, &options(), &Impatient);
    assert!(matches!(built, Err(BuildError::Cancelled)) && !output.exists(), "{built:?}");
}

#[test]
fn an_inset_is_what_a_whole_build_of_the_same_picture_has() {
    let world = World::new();
    let (at, size, finer) = ([210, 130], [190, 170], 2u8);
    let (inset, texels) = world.inset("inset.png", at, size, finer);
    for kernel in [Kernel::Box, Kernel::Kaiser] {
        let filter = Some(LayerFilter::new(kernel, Meaning::Stored));
        let options = BuildOptions { filter, ..options() };
        let with_inset = BuildOptions { insets: vec![inset.clone()], ..options.clone() };
        let (output, report) = world.built("inset.vastex", "coarse.png", &with_inset);
        let (geometry, tiles) = all_tiles(&output);
        let large = SIZE.map(|n| n << finer);
        assert_eq!((report.size, geometry.size()), (large, [large[0], large[1], 1]));
        assert_eq!(
            (report.tiles, report.absent_tiles),
            (tiles.len() as u64, geometry.page_count() - report.tiles)
        );
        assert_eq!(report.bytes, std::fs::metadata(&output).unwrap().len());

        let mut whole = enlarged(&world.coarse, SIZE, finer);
        over(&mut whole, large[0], &texels, at, size[0]);
        world.image("whole.png", large, &whole);
        let (_, whole) = all_tiles(&world.built("whole.vastex", "whole.png", &options).0);
        // With a box, magnified texels become again what they were; wide kernels smooth them.
        let exact = kernel == Kernel::Box;
        let (mut same, mut at_edge) = (0, 0);
        for (pos, expected) in &whole {
            let scale = 1 << pos.level;
            let of_level = |n: [u32; 2]| n.map(|n| i64::from(n / scale));
            let inside = is_within(
                &geometry,
                *pos,
                of_level(at.map(|n| n + 12 * scale)),
                of_level(size.map(|n| n.saturating_sub(24 * scale))),
            );
            let is_there = pos.level >= finer
                || touches(&geometry, *pos, at.map(|n| n / scale), size.map(|n| n.div_ceil(scale)));
            match tiles.get(pos) {
                Some(tile) if exact || inside => {
                    assert!(is_there && tile == expected, "{pos} {kernel:?}");
                    same += u32::from(inside);
                    at_edge += u32::from(!inside && pos.level < finer);
                }
                tile => assert_eq!(tile.is_some(), is_there, "{pos}"),
            }
        }
        assert!(same > 50 && (at_edge > 30 || !exact), "{same} {at_edge}");
    }
}

#[test]
fn many_insets_of_many_levels_are_as_one_picture() {
    let world = World::new();
    // Of three levels, overlapping, at the edges, and out of order.
    let places = [
        ([900, 500], [290, 300], 3),
        ([140, 80], [160, 130], 1),
        ([20, 10], [40, 33], 0),
        ([0, 0], [99, 41], 3),
        ([60, 30], [99, 41], 3),
        ([299, 209], [1, 1], 1),
    ];
    let made: Vec<_> = places
        .iter()
        .enumerate()
        .map(|(n, &(at, size, finer))| world.inset(&format!("{n}.png"), at, size, finer))
        .collect();
    for mode in [Clamp, Wrap, AddressMode::Mirror] {
        let options = BuildOptions { address: [mode; 2], ..options() };
        let insets = made.iter().map(|(inset, _)| inset.clone()).collect();
        let (output, _) =
            world.built("insets.vastex", "coarse.png", &BuildOptions { insets, ..options.clone() });
        let (geometry, tiles) = all_tiles(&output);

        let large = SIZE.map(|n| n << 3);
        let mut whole = enlarged(&world.coarse, SIZE, 3);
        for finer in 0..=3 {
            for (inset, texels) in made.iter().filter(|(inset, _)| inset.finer == finer) {
                let size = places[made.iter().position(|(other, _)| other == inset).unwrap()].1;
                let up = 3 - finer;
                over(
                    &mut whole,
                    large[0],
                    &enlarged(texels, size, up),
                    inset.at.map(|n| n << up),
                    size[0] << up,
                );
            }
        }
        world.image("whole.png", large, &whole);
        let (_, whole) = all_tiles(&world.built("whole.vastex", "whole.png", &options).0);
        for (pos, tile) in &tiles {
            assert!(tile == &whole[pos], "{pos} {mode:?}");
        }
        // Every page's ancestors are there.
        for parent in tiles.keys().filter_map(|&pos| geometry.parent(pos)) {
            assert!(geometry.is_tail(parent) || tiles.contains_key(&parent), "{parent}");
        }
        assert!(tiles.len() * 2 < whole.len());
    }
}

#[test]
fn replacing_where_pages_have_no_tiles_makes_them() {
    let world = World::new();
    let mut marks = vec![255; (SIZE[0] * SIZE[1]) as usize];
    (0..marks.len()).filter(|i| i % SIZE[0] as usize > 60).for_each(|i| marks[i] = 0);
    let mask = world.image("mask.png", SIZE, &marks);
    let options = BuildOptions { mask: Some(mask), ..options() };
    let (output, before) = world.built("masked.vastex", "coarse.png", &options);
    let (geometry, old) = all_tiles(&output);
    let (at, size) = ([50, 37], [60, 40]);
    let (part, part_texels) = world.inset("part.png", at, size, 0);
    let replaced =
        replace(&output, at, &[&part.image], &ReplaceOptions { threads: 2, ..Default::default() }, &())
            .unwrap()
            .updated;
    let (_, new) = all_tiles(&output);
    assert!(new.len() as u64 > before.tiles && replaced.tiles >= new.len() as u64 - before.tiles);
    for pos in geometry.pages_of_level(0) {
        let touched = touches(&geometry, pos, at, size);
        assert_eq!(new.contains_key(&pos), touched || old.contains_key(&pos), "{pos}");
        let Some(tile) = new.get(&pos) else { continue };
        // Payloads show the image where it lies, else what was shown before.
        let shown = geometry.level_box_of_tile(pos);
        for (i, &texel) in tile.iter().enumerate() {
            let [x, y] = [i % 24, i / 24];
            let texture = [
                shown.origin[0] + x as i64 - i64::from(at[0]),
                shown.origin[1] + y as i64 - i64::from(at[1]),
            ];
            let in_part = (0..2).all(|a| (0..i64::from(size[a])).contains(&texture[a]));
            if in_part {
                assert_eq!(
                    texel,
                    part_texels[(texture[1] * i64::from(size[0]) + texture[0]) as usize],
                    "{pos} {x} {y}"
                );
            }
        }
    }
    seamless(&geometry, &new);
    // The same again changes nothing.
    let again = replace(&output, at, &[&part.image], &ReplaceOptions::default(), &()).unwrap().updated;
    assert_eq!(again.tiles, 0);
}

/// Where two pages beside each other have tiles, their borders show each other's payload.
fn seamless(geometry: &Geometry, tiles: &BTreeMap<PagePos, Vec<u8>>) {
    let (page, border, side) =
        (geometry.page()[0] as usize, geometry.border()[0] as usize, geometry.tile()[0] as usize);
    let mut compared = 0;
    for (pos, left) in tiles.iter().filter(|(pos, _)| !geometry.is_tail(**pos)) {
        let [beside, below] = [PagePos { x: pos.x + 1, ..*pos }, PagePos { y: pos.y + 1, ..*pos }];
        if let Some(right) = tiles.get(&beside) {
            for y in border..border + page {
                let row = |tile: &[u8], x: usize| tile[y * side + x..][..2 * border].to_vec();
                assert_eq!(row(left, page), row(right, 0), "{pos} and {beside}, row {y}");
                compared += 1;
            }
        }
        if let Some(lower) = tiles.get(&below) {
            for x in border..border + page {
                let column = |tile: &[u8], y: usize| -> Vec<u8> {
                    (y..y + 2 * border).map(|y| tile[y * side + x]).collect()
                };
                assert_eq!(column(left, page), column(lower, 0), "{pos} and {below}, column {x}");
            }
        }
    }
    assert!(compared > 100);
}

#[test]
fn partly_covered_pages_have_no_seams() {
    let world = World::new();
    // With a kernel under which magnified texels do not become again what they were.
    for kernel in [Kernel::Box, Kernel::Gauss4, Kernel::Lanczos] {
        let filter = Some(LayerFilter::new(kernel, Meaning::Stored));
        let insets = vec![
            world.inset("a.png", [37, 51], [70, 45], 1).0,
            world.inset("b.png", [190, 170], [133, 97], 2).0,
        ];
        let options = BuildOptions { insets, filter, ..options() };
        let (geometry, tiles) = all_tiles(&world.built("out.vastex", "coarse.png", &options).0);
        // The last page of an edge is not whole.
        let whole = tiles.into_iter().filter(|(pos, _)| {
            let (level, page) = (geometry.level(pos.level), geometry.page()[0]);
            (pos.x + 1) * page <= level.size[0] && (pos.y + 1) * page <= level.size[1]
        });
        seamless(&geometry, &whole.collect());
    }
}

#[test]
fn insets_lie_on_masked_and_transparent_textures() {
    let world = World::new();
    let mut data = texels((SIZE[0] * SIZE[1] * 4) as usize, 7);
    data.chunks_exact_mut(4).enumerate().for_each(|(i, texel)| texel[3] = if i % 150 < 75 { 255 } else { 0 });
    write_png(&world.path("half.png"), SIZE, Rgba, Eight, &data);
    write_png(&world.path("in.png"), [90, 60], Rgba, Eight, &[200; 90 * 60 * 4]);
    let inset = Inset { layer: None, image: world.path("in.png"), at: [200, 20], finer: 1 };
    let options = BuildOptions {
        drop_transparent: true,
        insets: vec![inset],
        compression: Compression::Zstd(3),
        align: 4096,
        ..options()
    };
    let (output, report) = world.built("half.vastex", "half.png", &options);
    let (geometry, tiles) = all_tiles(&output);
    assert!(tiles.contains_key(&PagePos::new_2d(1, 7, 2)) && !tiles.contains_key(&PagePos::new_2d(1, 7, 5)));
    assert!(tiles.contains_key(&PagePos::new_2d(0, 15, 3)) && report.constant_tiles > 0);
    let container = Container::open_file(&output).unwrap();
    assert_eq!((container.align(), container.info().tiles), (4096, report.tiles));
    assert_eq!(geometry.size()[0], 2 * SIZE[0]);
}

struct StopAfter(std::cell::Cell<u32>);

impl Progress for StopAfter {
    fn advance(&self, done: u64, total: u64, _: u64) -> ControlFlow<()> {
        assert!(done <= total, "{done} of {total}");
        let left = self.0.get();
        self.0.set(left.saturating_sub(1));
        if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn what_does_not_suit_is_refused_and_nothing_is_left_behind() {
    let world = World::new();
    let (inset, _) = world.inset("inset.png", [100, 50], [60, 40], 1);
    write_png(&world.path("rgb.png"), SIZE, Rgb, Eight, &texels((SIZE[0] * SIZE[1] * 3) as usize, 3));
    world.image("small.png", [1, 1], &[1]);
    let before = world.files();
    let output = world.path("out.vastex");
    let refused = |input: &str, change: &dyn Fn(&mut BuildOptions)| {
        let mut options = BuildOptions { insets: vec![inset.clone()], ..options() };
        change(&mut options);
        let error = build(&[world.path(input)], &output, &options, &()).unwrap_err().to_string();
        assert_eq!(world.files(), before);
        error
    };
    let error = refused("coarse.png", &|options| options.insets[0].at = [241, 0]);
    assert!(
        error.contains("inset.png: 60x40 texels at 241,0") && error.contains("300x210 texels at that level"),
        "{error}"
    );
    let error = refused("coarse.png", &|options| options.insets[0].finer = 30);
    assert!(error.contains("30 levels finer than 150x105 texels") && error.contains("coarser"), "{error}");
    let error = refused("coarse.png", &|options| {
        options.insets[0] = Inset { layer: None, image: world.path("rgb.png"), at: [0, 0], finer: 1 };
    });
    assert!(error.contains("rgb.png: holds") && error.contains("r8"), "{error}");
    let error = refused("coarse.png", &|options| options.insets[0].image = world.path("none.png"));
    assert!(error.contains("none.png"), "{error}");
    let error = refused("coarse.png", &|options| options.part = PartOf::new(1, 2));
    assert!(error.contains("one machine"), "{error}");
    let error = refused("coarse.png", &|options| options.levels_from = LevelsFrom::TwoFiner);
    assert!(error.contains("box@two") && error.contains("next finer one"), "{error}");
    let error = refused("coarse.png", &|options| options.memory_limit = 10 << 20);
    assert!(error.contains("MiB"), "{error}");
    let error = refused("small.png", &|options| options.insets[0].at = [0, 0]);
    assert!(error.contains("1x1 texels are too few"), "{error}");
    let error = refused("coarse.png", &|options| options.insets[0].image = output.clone());
    assert!(error.contains("out.vastex"), "{error}");

    let options = BuildOptions { insets: vec![inset.clone()], ..options() };
    let at_inset = build(&[world.path("coarse.png")], &inset.image, &options, &()).unwrap_err();
    assert!(matches!(at_inset, BuildError::SameFile(_)), "{at_inset}");
    let nowhere =
        build(&[world.path("coarse.png")], &world.path("none/out.vastex"), &options, &()).unwrap_err();
    assert!(nowhere.to_string().starts_with(world.path("none/out.vastex").to_str().unwrap()), "{nowhere}");
    // What stands at the output's place stays until the whole is there.
    std::fs::write(&output, "old").unwrap();
    let before = world.files();
    let mut steps = 0;
    while build(&[world.path("coarse.png")], &output, &options, &StopAfter(steps.into())).is_err() {
        assert_eq!(
            (std::fs::read(&output).unwrap().as_slice(), world.files()),
            (&b"old"[..], before.clone())
        );
        steps += 3;
    }
    assert!(steps > 30 && world.files() == before, "{steps}");
    all_tiles(&output);
}
