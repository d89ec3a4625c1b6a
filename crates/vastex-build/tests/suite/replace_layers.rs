//! Regions replaced in textures of several layers, and of layers compressed in blocks.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::common::image::Image;
use crate::common::sandbox::{Sandbox, assert_neighbours_agree, hills, layer_texels, values};
use crate::common::{texels, tiles};
use png::{BitDepth, ColorType};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use vastex_build::{
    BuildOptions, LayerFilter, LayerImage, LayerInput, Notice, Quality, ReplaceError, ReplaceOptions, replace,
};
use vastex_core::AddressMode::{Border, Clamp, Mirror, Wrap};
use vastex_core::{Description, LayerFormat, PagePos};
use vastex_tiles::{Container, FileStore, TileSource, ends_within, verify};

/// Longer than any test takes on any machine.
const PATIENCE: Duration = Duration::from_secs(300);

fn inputs(sandbox: &Sandbox, images: &[Image]) -> Vec<LayerInput> {
    images.iter().map(|image| image.input(sandbox)).collect()
}

fn options() -> ReplaceOptions {
    ReplaceOptions { threads: 2, ..ReplaceOptions::default() }
}

fn assert_sound(path: &Path) {
    let found = pollster::block_on(verify(std::sync::Arc::new(FileStore::open(path).unwrap()), |_, _| {}));
    assert_eq!(found.faults, []);
}

/// Colour, normals at half and heights at a quarter of its resolution.
fn ground(size: [u32; 2]) -> Vec<Image> {
    let height = Image { depth: BitDepth::Sixteen, ..Image::new("height", 4, ColorType::Grayscale, size) };
    let [width, rows] = height.size();
    vec![
        Image::new("color", 1, ColorType::Rgb, size),
        Image { format: Some(LayerFormat::Rg8), ..Image::new("normal", 2, ColorType::Rgb, size) },
        Image { data: texels((2 * width * rows) as usize, 9), ..height },
    ]
}

fn any_filter() -> impl Strategy<Value = Option<LayerFilter>> {
    let names = ["box", "box-linear", "gauss4", "sharpen4", "kaiser", "lanczos-linear", "min"];
    prop::option::of(prop::sample::select(names.to_vec()).prop_map(|name| name.parse().unwrap()))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, rng_seed: RngSeed::Fixed(3), failure_persistence: None, ..Default::default() })]

    #[test]
    fn replaced_layers_are_what_a_build_makes(
        size in prop::array::uniform2(prop_oneof![5u32..40, 40u32..260]),
        page in 4u32..20,
        border in 0u32..100,
        address in prop::array::uniform2(prop::sample::select(vec![Clamp, Wrap, Mirror, Border])),
        filters in prop::array::uniform3(any_filter()),
        shares in prop::array::uniform4(0u32..100),
        which in 1u32..8,
    ) {
        let (sandbox, page) = (Sandbox::new(), 4 * page);
        let border = 4 * (1 + (page / 8 - 1) * border / 100);
        let build =
            BuildOptions { page, border, address, border_color: [9, 200, 80, 130], threads: 2, ..BuildOptions::default() };
        let mut images = ground(size);
        images.iter_mut().zip(filters).for_each(|(image, filter)| image.filter = filter);
        let changed = sandbox.build_as("changed.vastex", &inputs(&sandbox, &images), &build);
        // From any texel that is one of all layers to any other, or round a wrapping edge.
        let at = [0, 1].map(|a| size[a] * shares[a] / 100 / 4 * 4);
        let len = [0, 1].map(|a| {
            let most = if address[a] == Wrap { size[a] } else { size[a] - at[a] };
            1 + (most - 1) * shares[a + 2] / 99
        });
        let parts: Vec<LayerImage> = (0..3).filter(|n| which >> n & 1 == 1)
            .map(|n| images[n].change(&sandbox, at, len, |[x, y], byte| (x * 7 + y * 31 + byte as u32 * 90) as u8))
            .collect();
        replace(&changed, at, &parts, &options(), &()).unwrap();
        assert_sound(&changed);
        let (description, built) = tiles(&sandbox.build_as("built.vastex", &inputs(&sandbox, &images), &build));
        let (_, changed) = tiles(&changed);
        for ((pos, changed), (_, built)) in changed.iter().zip(&built) {
            for (n, layer) in description.layers.iter().enumerate() {
                let part = description.layer_range(n);
                prop_assert!(changed[part.clone()] == built[part], "{} {} at {:?} {:?}", pos, layer.name, at, len);
            }
        }
    }
}

/// As [`ground`], the colours and the normals in blocks.
fn blocks(size: [u32; 2]) -> Vec<Image> {
    let mut images = ground(size);
    images[0].format = Some(LayerFormat::Bc7Srgb);
    images[1].format = Some(LayerFormat::Bc5);
    for image in &mut images[..2] {
        image.data = hills(image.size(), 3);
    }
    images
}

fn block_pages() -> BuildOptions {
    BuildOptions { page: 32, border: 8, threads: 2, quality: Quality::Fast, ..BuildOptions::default() }
}

fn fast() -> ReplaceOptions {
    ReplaceOptions { quality: Quality::Fast, ..options() }
}

/// Hills, turned round.
fn valleys([x, y]: [u32; 2], byte: usize) -> u8 {
    let height = (f64::from(x) / 7.0).cos() + (f64::from(y) / (8.0 + byte as f64)).sin();
    (120.0 + 55.0 * height) as u8
}

/// The same layers, not compressed.
fn plain(images: &[Image]) -> Vec<Image> {
    let format = |image: &Image| image.format.map(LayerFormat::decoded);
    images.iter().map(|image| Image { format: format(image), ..image.clone() }).collect()
}

/// How near the texels of a layer are to those of another container, over all pages finer than the tail, in
/// dB.
fn psnr(number: usize, of: &(Description, Vec<(PagePos, Vec<u8>)>), plain: &Path) -> f64 {
    let ((description, tiles), (plain_description, plain)) = (of, crate::common::tiles(plain));
    let (mut sum, mut count) = (0.0, 0usize);
    for ((pos, tile), (_, plain)) in tiles.iter().zip(&plain) {
        let [a, b] = [(description, tile), (&plain_description, plain)].map(|(description, tile)| {
            values(description.layers[number].format, &layer_texels(description, number, tile))
        });
        if !description.geometry.is_tail(*pos) {
            sum += a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            count += a.len();
        }
    }
    10.0 * (count as f64 / sum).log10()
}

#[test]
fn blocks_change_where_a_texel_of_them_does_and_nowhere_else() {
    let (sandbox, size) = (Sandbox::new(), [203, 150]);
    let mut images = blocks(size);
    let changed = sandbox.build_as("changed.vastex", &inputs(&sandbox, &images), &block_pages());
    let (description, before) = tiles(&changed);
    let (at, len) = ([52, 40], [77, 61]);
    let parts = [0, 1].map(|n| images[n].change(&sandbox, at, len, valleys));
    replace(&changed, at, &parts, &fast(), &()).unwrap();
    assert_sound(&changed);
    let after = tiles(&changed);
    assert!(assert_neighbours_agree(&description, &after.1) > 60);
    let built = tiles(&sandbox.build_as("built.vastex", &inputs(&sandbox, &images), &block_pages()));
    let heights = description.layer_range(2);
    let (mut kept, mut new) = (0, 0);
    for (((pos, after), (_, before)), (_, built)) in after.1.iter().zip(&before).zip(&built.1) {
        assert_eq!(after[heights.clone()], before[heights.clone()], "{pos}");
        if description.geometry.is_tail(*pos) {
            continue;
        }
        for (n, image) in images[..2].iter().enumerate() {
            let geometry = description.geometry.of_layer(image.scale);
            let (shown, across) = (geometry.level_box_of_tile(*pos), geometry.tile()[0] as usize / 4);
            let [end, first] = [0, 1].map(|one| {
                [0, 1].map(|a| match one {
                    0 => (at[a] + len[a]).div_ceil(image.scale),
                    _ => at[a] / image.scale,
                })
            });
            let level = 1i64 << pos.level;
            let parts = [after, before, built].map(|tile| &tile[description.layer_range(n)]);
            for (block, [after, before, built]) in
                (0..across * across).map(|block| (block, parts.map(|part| &part[block * 16..][..16])))
            {
                // The texels of its level from `lo` to `hi`.
                let lo = [0, 1].map(|a| shown.origin[a] + 4 * [block % across, block / across][a] as i64);
                let size = geometry.level(pos.level).size;
                if (0..2).any(|a| lo[a] < 0 || lo[a] + 4 > i64::from(size[a])) {
                    continue;
                }
                let untouched = (0..2).any(|a| {
                    (lo[a] + 4) * level <= i64::from(first[a]) || lo[a] * level >= i64::from(end[a])
                });
                let all_new = (0..2).all(|a| {
                    lo[a] * level >= i64::from(first[a]) && (lo[a] + 4) * level <= i64::from(end[a])
                });
                if untouched {
                    assert!(after == before, "{pos} {} block {block}", image.name);
                } else if all_new {
                    assert!(after == built, "{pos} {} block {block}", image.name);
                }
                kept += usize::from(untouched);
                new += usize::from(all_new);
            }
        }
    }
    assert!(kept > 3000 && new > 900, "{kept} {new}");
    let plain = sandbox.build_as("plain.vastex", &inputs(&sandbox, &plain(&images)), &block_pages());
    for (n, name) in ["color", "normal"].into_iter().enumerate() {
        let [replaced, built] = [psnr(n, &after, &plain), psnr(n, &built, &plain)];
        assert!(built > 35.0 && replaced > built - 0.45, "{name}: {replaced} {built}");
    }
}

#[test]
fn every_block_format_can_be_replaced_at_every_edge() {
    let size = [101, 67];
    let formats = LayerFormat::ALL.into_iter().filter(|format| format.is_compressed());
    for (format, mode) in formats.zip([Clamp, Wrap, Mirror, Border].into_iter().cycle()) {
        let sandbox = Sandbox::new();
        let color = if format.channels() == 1 { ColorType::Grayscale } else { ColorType::Rgb };
        let mut images = [Image { format: Some(format), ..Image::new("color", 1, color, size) }];
        images[0].data = hills(size, color.samples());
        let build =
            BuildOptions { page: 16, border: 4, address: [mode; 2], border_color: [90; 4], ..block_pages() };
        let file = sandbox.build_as("file.vastex", &inputs(&sandbox, &images), &build);
        for (at, len) in [([0, 0], [30, 9]), ([93, 60], [8, 7]), ([17, 31], [50, 1]), ([0, 40], [101, 20])] {
            let part = images[0].change(&sandbox, at, len, valleys);
            replace(&file, at, &[part], &fast(), &()).unwrap();
        }
        assert_sound(&file);
        let after = tiles(&file);
        assert!(assert_neighbours_agree(&after.0, &after.1) > 50, "{}", format.name());
        let built = tiles(&sandbox.build_as("built.vastex", &inputs(&sandbox, &images), &build));
        let plain = sandbox.build_as("plain.vastex", &inputs(&sandbox, &plain(&images)), &build);
        let [replaced, built] = [psnr(0, &after, &plain), psnr(0, &built, &plain)];
        assert!(built > 28.0 && replaced > built - 1.0, "{} {mode:?}: {replaced} {built}", format.name());
    }
}

/// The same again finds its rim encoded already.
#[test]
fn the_same_change_soon_changes_nothing() {
    let (sandbox, size) = (Sandbox::new(), [203, 150]);
    let mut images = blocks(size);
    let file = sandbox.build_as("file.vastex", &inputs(&sandbox, &images), &block_pages());
    let parts = [0, 1].map(|n| images[n].change(&sandbox, [52, 40], [77, 61], valleys));
    let again = || replace(&file, [52, 40], &parts, &fast(), &()).unwrap().updated.tiles;
    assert!(again() > 20);
    let plain = sandbox.build_as("plain.vastex", &inputs(&sandbox, &plain(&images)), &block_pages());
    let first = psnr(0, &tiles(&file), &plain);
    for _ in 0..5 {
        again();
    }
    assert_eq!(again(), 0);
    let [then, now] = [first, psnr(0, &tiles(&file), &plain)];
    assert!(now > then - 0.05, "{then} {now}");
}

/// Many images, one after the other beside each other, each of which cuts through blocks.
#[test]
fn what_many_generations_lose_is_bounded() {
    let (sandbox, size) = (Sandbox::new(), [180, 140]);
    let mut images = blocks(size);
    let file = sandbox.build_as("file.vastex", &inputs(&sandbox, &images), &block_pages());
    for n in 0..12 {
        let at = [10 + 10 * n, 38 + 2 * (n % 3)];
        let parts = [0, 1].map(|layer| {
            images[layer].change(&sandbox, at, [10, 50], |[x, y], byte| valleys([x + at[0], y], byte))
        });
        replace(&file, at, &parts, &fast(), &()).unwrap();
    }
    assert_sound(&file);
    let after = tiles(&file);
    assert_neighbours_agree(&after.0, &after.1);
    let built = tiles(&sandbox.build_as("built.vastex", &inputs(&sandbox, &images), &block_pages()));
    let plain = sandbox.build_as("plain.vastex", &inputs(&sandbox, &plain(&images)), &block_pages());
    for (n, name) in ["color", "normal"].into_iter().enumerate() {
        let [replaced, built] = [psnr(n, &after, &plain), psnr(n, &built, &plain)];
        assert!(replaced > built - 2.0, "{name}: {replaced} {built}");
    }
}

/// Pages that get their first tile get all layers, compressed ones too, and no seam.
#[test]
fn layers_of_pages_without_tiles_are_made() {
    for mode in [Clamp, Wrap] {
        let (sandbox, size) = (Sandbox::new(), [203, 150]);
        let mut images = blocks(size);
        let mut marks = vec![255; (size[0] * size[1]) as usize];
        (0..marks.len()).filter(|i| i % size[0] as usize > 70).for_each(|i| marks[i] = 0);
        let mask = Some(sandbox.image("mask.png", size, ColorType::Grayscale, &marks));
        let build = BuildOptions { mask, address: [mode; 2], ..block_pages() };
        let file = sandbox.build_as("file.vastex", &inputs(&sandbox, &images), &build);
        let (description, before) = tiles(&file);
        let (at, len) = ([60, 36], [110, 70]);
        let part = images[0].change(&sandbox, at, len, valleys);
        let replaced = replace(&file, at, &[part], &fast(), &()).unwrap();
        assert_sound(&file);
        let after = tiles(&file);
        assert!(after.1.len() > before.len() + 8 && replaced.updated.tiles > 20);
        let pairs = assert_neighbours_agree(&description, &after.1);
        assert!(pairs > 40, "{pairs}");
        // Where the image lies, it is there; normals and heights are those of the coarser level.
        let pos = PagePos::new_2d(0, 4, 2);
        let tile = &after.1.iter().find(|(at, _)| *at == pos).unwrap().1;
        let color = layer_texels(&description, 0, tile);
        let first = [4 * 32 - 8 - at[0], 2 * 32 - 8 - at[1]];
        for (i, texel) in color.chunks(4).enumerate() {
            let [x, y] = [i as u32 % 48 + first[0], i as u32 / 48 + first[1]];
            if x < len[0] && y < len[1] {
                assert!((0..3).all(|c| texel[c].abs_diff(valleys([x, y], c)) < 30), "{x},{y}");
            }
        }
        // As the finest page that was there over it shows them.
        let geometry = &description.geometry;
        let over = (1..geometry.tail().first_level()).map(|level| geometry.ancestor(pos, level));
        let over = over.into_iter().find_map(|over| before.iter().find(|(at, _)| *at == over)).unwrap();
        for (layer, most) in [(1, 0.06), (2, 1e-9)] {
            let own_geometry = geometry.of_layer(description.layers[layer].scale);
            let [own, coarse] = [tile, &over.1].map(|tile| {
                values(description.layers[layer].format, &layer_texels(&description, layer, tile))
            });
            let (side, border) = (own_geometry.tile()[0], own_geometry.border()[0]);
            let channels = own.len() / (side * side) as usize;
            let [shown, shown_over] = [pos, over.0].map(|pos| own_geometry.level_box_of_tile(pos).origin);
            for (x, y) in (border..side - border).flat_map(|y| (border..side - border).map(move |x| (x, y))) {
                let source = [0, 1].map(|a| {
                    let texel = shown[a] + i64::from([x, y][a]);
                    ((texel >> over.0.level) - shown_over[a]) as u32
                });
                for c in 0..channels {
                    let at = |[x, y]: [u32; 2]| (y * side + x) as usize * channels + c;
                    let (own, coarse) = (own[at([x, y])], coarse[at(source)]);
                    assert!((own - coarse).abs() < most, "{layer}: {x},{y}: {own} {coarse}");
                }
            }
        }
        // Again it changes no page's presence, and sharing goes on.
        let part = images[1].change(&sandbox, at, len, valleys);
        replace(&file, at, &[part], &fast(), &()).unwrap();
        let again = tiles(&file);
        assert_eq!(again.1.len(), after.1.len());
        assert_neighbours_agree(&description, &again.1);
    }
}

#[test]
fn readers_go_on_with_the_version_that_they_opened() {
    ends_within(PATIENCE, replace_while_reading).unwrap();
}

fn replace_while_reading() {
    let (sandbox, size) = (Sandbox::new(), [203, 150]);
    let mut images = blocks(size);
    let file = sandbox.build_as("file.vastex", &inputs(&sandbox, &images), &block_pages());
    let before = tiles(&file).1;
    let reader = Container::open_file(&file).unwrap();
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let reading = scope.spawn(|| {
            let mut rounds = 0;
            // Nobody says that it is done where a replacement fails.
            let begun = Instant::now();
            while (!done.load(Ordering::Relaxed) && begun.elapsed() < PATIENCE) || rounds == 0 {
                for (pos, expected) in &before {
                    let tile = pollster::block_on(reader.read(*pos)).unwrap();
                    assert!(tile.decode(reader.description()).unwrap() == *expected, "{pos}");
                }
                rounds += 1;
            }
        });
        for n in 0..5 {
            let at = [20 * n, 12 * n];
            let parts = [0, 1, 2].map(|layer| images[layer].change(&sandbox, at, [60, 50], valleys));
            replace(&file, at, &parts, &fast(), &()).unwrap();
        }
        done.store(true, Ordering::Relaxed);
        reading.join().unwrap();
    });
    assert_sound(&file);
    assert!(tiles(&file).1 != before);
}

#[test]
fn layers_that_do_not_suit_are_refused_and_change_nothing() {
    let (sandbox, size) = (Sandbox::new(), [203, 150]);
    let mut images = blocks(size);
    images[2].filter = Some("box@two".parse().unwrap());
    let file = sandbox.build_as("file.vastex", &inputs(&sandbox, &images), &block_pages());
    let before = std::fs::read(&file).unwrap();
    let grey = |name: &str, size: [u32; 2]| -> PathBuf {
        sandbox.image(name, size, ColorType::Grayscale, &vec![9; (size[0] * size[1]) as usize])
    };
    let rgb = |name: &str, size: [u32; 2]| -> PathBuf {
        sandbox.image(name, size, ColorType::Rgb, &vec![9; (3 * size[0] * size[1]) as usize])
    };
    let (whole, half) = (rgb("whole.png", [40, 31]), rgb("half.png", [20, 16]));
    let image = |layer: &str, path: &Path| LayerImage { layer: Some(layer.into()), ..path.into() };
    let refused = |at, images: &[LayerImage]| {
        let error = replace(&file, at, images, &options(), &()).unwrap_err();
        assert!(std::fs::read(&file).unwrap() == before);
        error.to_string()
    };
    let error = refused([0, 0], &[whole.as_path().into()]);
    for says in ["file.vastex: has the layers color, normal, height", "whole.png goes", "--layer NAME="] {
        assert!(error.contains(says), "{error}");
    }
    let error = refused([0, 0], &[image("colour", &whole)]);
    assert!(error.contains("no layer \"colour\"; name one of color, normal, height"), "{error}");
    let error = refused([0, 0], &[image("color", &whole), image("color", &half)]);
    assert!(error.contains("half.png: the layer \"color\" has an image already"), "{error}");
    let error = refused([0, 0], &[image("color", &whole), image("normal", &whole)]);
    assert!(error.contains("whole.png: has 40x31 texels") && error.contains("20x16"), "{error}");
    let error = refused([6, 5], &[image("normal", &half)]);
    assert!(
        error.contains("6,5 is no whole texel of the layer \"normal\"") && error.contains("6,4"),
        "{error}"
    );
    let error = refused([190, 0], &[image("normal", &half)]);
    assert!(error.contains("95,0 reach beyond the layer \"normal\"") && error.contains("102x75"), "{error}");
    let error = refused([0, 0], &[image("height", &grey("h.png", [10, 8]))]);
    assert!(error.contains("layer \"height\"") && error.contains("box@two"), "{error}");
    let error = refused([0, 0], &[LayerImage { format: Some(LayerFormat::Bc1), ..image("color", &whole) }]);
    assert!(error.contains("\"color\" has bc7-srgb, and not bc1"), "{error}");
    let filter = Some("kaiser-linear".parse().unwrap());
    let error = refused([0, 0], &[LayerImage { filter, ..image("color", &whole) }]);
    assert!(error.contains("has box-linear, and not kaiser-linear"), "{error}");
    let error = refused([0, 0], &[image("normal", &grey("n.png", [20, 16]))]);
    assert!(error.contains("n.png: holds") && error.contains("bc5"), "{error}");
    let error = refused([0, 0], &[image("color", &sandbox.path("none.png"))]);
    assert!(error.contains("none.png"), "{error}");
    let small = ReplaceOptions { memory_limit: 1000, ..options() };
    let error = replace(&file, [0, 0], &[image("color", &whole)], &small, &()).unwrap_err();
    assert!(matches!(error, ReplaceError::Memory { .. }), "{error}");
    let rgba = sandbox.image("rgba.png", [40, 31], ColorType::Rgba, &texels(40 * 31 * 4, 3));
    let normals = sandbox.image("n.png", [20, 16], ColorType::Rgba, &texels(20 * 16 * 4, 3));
    let images = [image("color", &rgba), image("normal", &normals)];
    let replaced = replace(&file, [20, 40], &images, &options(), &()).unwrap();
    assert_eq!(replaced.notices, [(normals, Notice::NotOpaque(LayerFormat::Bc5))]);
    // What says what is there already is taken.
    let named = LayerImage {
        format: Some(LayerFormat::Bc7Srgb),
        filter: Some("box-linear".parse().unwrap()),
        ..image("color", &whole)
    };
    assert!(replace(&file, [6, 4], &[named, image("normal", &half)], &options(), &()).is_ok());
}
