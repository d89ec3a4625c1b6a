//! A region replaced gives, texel for texel, what building the whole changed image gives.

use std::ops::ControlFlow;
use std::path::Path;

use crate::common::{build_file, texels, tiles, write_png};
use png::{BitDepth, ColorType};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use vastex_build::{
    BuildOptions, Kernel, LayerFilter, LevelsFrom, Meaning, Progress, ReplaceError, ReplaceOptions, replace,
};
use vastex_core::AddressMode::{self, Border, Clamp, Mirror, Wrap};
use vastex_tiles::{Compression, Container, FileStore, TileSource, verify};

#[derive(Clone, Copy, Debug)]
struct Kind {
    color: ColorType,
    depth: BitDepth,
}

const GREY: Kind = Kind { color: ColorType::Grayscale, depth: BitDepth::Eight };

impl Kind {
    fn texel(self) -> usize {
        self.depth as usize / 8 * self.color.samples()
    }

    fn write(self, path: &Path, size: [u32; 2], texels: &[u8]) {
        write_png(path, size, self.color, self.depth, texels);
    }
}

/// The texels of an image with those of another put into it.
fn put(whole: &mut [u8], size: [u32; 2], at: [u32; 2], part: &[u8], part_size: [u32; 2], texel: usize) {
    let row = part_size[0] as usize * texel;
    for (y, part_row) in part.chunks(row).enumerate() {
        let start = ((at[1] as usize + y) * size[0] as usize + at[0] as usize) * texel;
        whole[start..start + row].copy_from_slice(part_row);
    }
}

fn options() -> ReplaceOptions {
    ReplaceOptions { threads: 2, ..ReplaceOptions::default() }
}

fn assert_sound(path: &Path) {
    let found = pollster::block_on(verify(std::sync::Arc::new(FileStore::open(path).unwrap()), |_, _| {}));
    assert_eq!(found.faults, []);
}

fn assert_same(changed: &Path, built: &Path) {
    let (changed, built) = (tiles(changed), tiles(built));
    assert_eq!(changed.0, built.0);
    for ((pos, changed), (_, built)) in changed.1.iter().zip(&built.1) {
        assert!(changed == built, "{pos} differs from what build makes");
    }
}

fn check(size: [u32; 2], kind: Kind, build: &BuildOptions, regions: &[[u32; 4]]) {
    let dir = tempfile::tempdir().unwrap();
    let (input, part_path) = (dir.path().join("in.png"), dir.path().join("part.png"));
    let mut whole = texels(kind.texel() * (size[0] * size[1]) as usize, size[0] * 31 + size[1]);
    kind.write(&input, size, &whole);
    let (built, _) = build_file(&input, build);
    let changed = dir.path().join("changed.vastex");
    std::fs::rename(built, &changed).unwrap();
    for (n, &[x, y, w, h]) in (1..).zip(regions) {
        let (at, part_size) = ([x, y], [w, h]);
        let part = texels(kind.texel() * (w * h) as usize, 1000 * n + w);
        kind.write(&part_path, part_size, &part);
        replace(&changed, at, &[&part_path], &options(), &()).unwrap();
        put(&mut whole, size, at, &part, part_size, kind.texel());
    }
    assert_sound(&changed);
    kind.write(&input, size, &whole);
    assert_same(&changed, &build_file(&input, build).0);
}

fn any_kind() -> impl Strategy<Value = Kind> {
    let color = prop::sample::select(vec![
        ColorType::Grayscale,
        ColorType::GrayscaleAlpha,
        ColorType::Rgb,
        ColorType::Rgba,
    ]);
    (color, any::<bool>()).prop_map(|(color, deep)| Kind {
        color,
        depth: if deep { BitDepth::Sixteen } else { BitDepth::Eight },
    })
}

/// Any that suits every format here, and none at all.
fn any_filter() -> impl Strategy<Value = Option<LayerFilter>> {
    let kernel = prop::sample::select(Kernel::ALL.to_vec());
    prop::option::of((kernel, any::<bool>()).prop_map(|(kernel, linear)| {
        let linear = linear && !kernel.picks();
        LayerFilter::new(kernel, if linear { Meaning::LinearColor } else { Meaning::Stored })
    }))
}

fn any_build() -> impl Strategy<Value = BuildOptions> {
    let address = || prop::sample::select(vec![Clamp, Wrap, Mirror, Border]);
    let page = prop_oneof![8u32..20, 20u32..140];
    let compression = prop::sample::select(vec![Compression::None, Compression::Lz4, Compression::Zstd(1)]);
    (page, 0u32..100, address(), address(), any_filter(), any::<bool>(), compression).prop_map(
        |(page, share, x, y, filter, linear, compression)| BuildOptions {
            filter,
            border_color: [9, 200, 80, 130],
            page,
            border: 1 + (page / 2 - 1) * share / 100,
            address: [x, y],
            linear,
            compression,
            threads: 2,
            ..BuildOptions::default()
        },
    )
}

/// Where a region begins and how far it reaches, in shares of what there is.
fn region(size: [u32; 2], shares: [u32; 4]) -> [u32; 4] {
    let at = [0, 1].map(|a| size[a] * shares[a] / 100);
    let extent = [0, 1].map(|a| 1 + (size[a] - at[a] - 1) * shares[a + 2] / 99);
    [at[0], at[1], extent[0], extent[1]]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 80, rng_seed: RngSeed::Fixed(8), failure_persistence: None, ..Default::default() })]

    #[test]
    fn replaced_regions_are_what_a_build_makes(
        size in prop::array::uniform2(prop_oneof![1u32..12, 12u32..150, 150u32..330]),
        kind in any_kind(),
        build in any_build(),
        shares in prop::collection::vec(prop::array::uniform4(0u32..100), 1..4),
    ) {
        let regions: Vec<_> = shares.into_iter().map(|shares| region(size, shares)).collect();
        check(size, kind, &build, &regions);
    }
}

#[test]
fn single_texels_at_every_edge_change_what_they_must() {
    let size = [101, 67];
    let rgba = Kind { color: ColorType::Rgba, depth: BitDepth::Eight };
    for mode in [Clamp, Wrap, Mirror] {
        let build = BuildOptions { page: 16, border: 4, address: [mode; 2], ..BuildOptions::default() };
        for [x, y] in [[0, 0], [100, 0], [0, 66], [100, 66], [50, 33], [15, 16], [96, 64]] {
            check(size, rgba, &build, &[[x, y, 1, 1]]);
        }
        check(size, rgba, &build, &[[0, 0, 101, 67]]);
    }
}

#[test]
fn only_pages_that_show_the_region_are_written() {
    let dir = tempfile::tempdir().unwrap();
    let (input, part) = (dir.path().join("in.png"), dir.path().join("part.png"));
    let size = [1024, 1024];
    let whole = texels(1024 * 1024, 3);
    GREY.write(&input, size, &whole);
    let built = |address: AddressMode| {
        let options = BuildOptions { page: 64, address: [address; 2], ..BuildOptions::default() };
        build_file(&input, &options).0
    };
    GREY.write(&part, [8, 8], &[7; 64]);
    let tiles = |mode, at| replace(&built(mode), at, &[&part], &options(), &()).unwrap().updated.tiles;
    // One page of each of 5 levels, and the tail; at a corner of four pages, four of each level that has so
    // many.
    assert_eq!(tiles(Clamp, [24, 24]), 5 + 1);
    assert_eq!(tiles(Clamp, [508, 508]), 4 * 4 + 1 + 1);
    // At the corner of the texture, those at the other sides too.
    assert_eq!((tiles(Clamp, [0, 0]), tiles(Wrap, [0, 0])), (5 + 1, 4 * 4 + 1 + 1));
    // The same texels again change nothing.
    let file = built(Clamp);
    replace(&file, [24, 24], &[&part], &options(), &()).unwrap();
    let before = std::fs::read(&file).unwrap();
    let again = replace(&file, [24, 24], &[&part], &options(), &()).unwrap().updated;
    assert_eq!((again.tiles, again.bytes_added, again.bytes), (0, 0, before.len() as u64));
    assert!(again.bytes_superseded > 0 && std::fs::read(&file).unwrap() == before);
}

#[test]
fn readers_keep_the_version_that_they_opened() {
    let dir = tempfile::tempdir().unwrap();
    let (input, part) = (dir.path().join("in.png"), dir.path().join("part.png"));
    GREY.write(&input, [300, 200], &texels(300 * 200, 1));
    GREY.write(&part, [100, 50], &texels(100 * 50, 2));
    let (file, _) = build_file(&input, &BuildOptions { page: 32, ..BuildOptions::default() });
    let before = tiles(&file).1;
    let reader = Container::open_file(&file).unwrap();
    let replaced = replace(&file, [90, 80], &[&part], &options(), &()).unwrap().updated.tiles;
    for (pos, expected) in &before {
        let tile = pollster::block_on(reader.read(*pos)).unwrap();
        assert!(tile.decode(reader.description()).unwrap() == *expected, "{pos}");
    }
    let differing = before.iter().zip(&tiles(&file).1).filter(|(a, b)| a != b).count();
    assert_eq!(differing as u64, replaced);
}

#[test]
fn a_damaged_tile_is_named_once_and_the_container_stays() {
    let dir = tempfile::tempdir().unwrap();
    let (input, part) = (dir.path().join("in.png"), dir.path().join("part.png"));
    GREY.write(&input, [300, 200], &texels(300 * 200, 1));
    GREY.write(&part, [20, 20], &texels(400, 2));
    let build = BuildOptions { page: 32, compression: Compression::None, ..BuildOptions::default() };
    let (file, _) = build_file(&input, &build);
    let mut bytes = std::fs::read(&file).unwrap();
    // Of every tile.
    (1400..bytes.len() - 8000).step_by(400).for_each(|at| bytes[at] ^= 1);
    std::fs::write(&file, &bytes).unwrap();
    let error = replace(&file, [9, 9], &[&part], &options(), &()).unwrap_err().to_string();
    for once in [file.to_str().unwrap(), "level 0", "rebuild the file"] {
        assert_eq!(error.matches(once).count(), 1, "{error}");
    }
    assert!(!error.contains("build the container again"), "{error}");
    assert!(std::fs::read(&file).unwrap() == bytes);
}

struct StopAfter(std::cell::Cell<u32>);

impl Progress for StopAfter {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        let left = self.0.get();
        self.0.set(left.saturating_sub(1));
        if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn what_cannot_be_replaced_is_refused_and_changes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let (input, part) = (dir.path().join("in.png"), dir.path().join("part.png"));
    GREY.write(&input, [300, 200], &texels(300 * 200, 1));
    GREY.write(&part, [20, 20], &texels(400, 2));
    let (file, _) = build_file(&input, &BuildOptions { page: 32, ..BuildOptions::default() });
    let before = std::fs::read(&file).unwrap();
    let refused = |at, image: &Path| replace(&file, at, &[image], &options(), &()).unwrap_err().to_string();
    for at in [[281, 0], [0, 181], [u32::MAX, 0], [300, 200]] {
        let error = refused(at, &part);
        assert!(error.contains("beyond the texture of 300x200"), "{error}");
    }
    let rgb = dir.path().join("rgb.png");
    write_png(&rgb, [20, 20], ColorType::Rgb, BitDepth::Eight, &texels(1200, 2));
    assert!(refused([0, 0], &rgb).contains("cannot become the container's r8"));
    assert!(refused([0, 0], &dir.path().join("none.png")).contains("none.png"));
    let error = replace(&part, [0, 0], &[&part], &options(), &()).unwrap_err().to_string();
    assert!(error.contains("not a Vastex container (it is a PNG image)"), "{error}");
    let of_far = dir.path().join("far.png");
    GREY.write(&of_far, [300, 200], &texels(300 * 200, 1));
    for (levels_from, name) in [(LevelsFrom::TwoFiner, "\"box@two\""), (LevelsFrom::Finest, "\"box@zero\"")] {
        let far = BuildOptions { levels_from, page: 32, ..BuildOptions::default() };
        let error =
            replace(&build_file(&of_far, &far).0, [0, 0], &[&part], &options(), &()).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains("next finer"), "{error}");
    }
    let small = ReplaceOptions { memory_limit: 1000, ..options() };
    let error = replace(&file, [0, 0], &[&part], &small, &()).unwrap_err();
    assert!(matches!(error, ReplaceError::Memory { .. }), "{error}");
    for steps in [0, 5, 20, 21] {
        let stop = StopAfter(steps.into());
        let error = replace(&file, [9, 9], &[&part], &options(), &stop).unwrap_err();
        assert!(matches!(error, ReplaceError::Cancelled), "{error}");
    }
    assert!(std::fs::read(&file).unwrap() == before);
}
