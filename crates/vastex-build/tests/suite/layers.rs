//! Layers: every format that an image can become, several of them in one texture, and block compression.

use std::path::{Path, PathBuf};

use crate::common::sandbox::{Sandbox, hills, layer, layer_texels, values};
use crate::common::{texels, tiles, write_png};
use bytes::Bytes;
use png::{BitDepth, ColorType};
use vastex_build::{BuildOptions, LayerInput, LevelsFrom, Notice, PartOf, Quality, build, merge};
use vastex_core::{AddressMode, Description, LayerFormat, PagePos};
use vastex_tiles::decode_layer;

fn small_pages() -> BuildOptions {
    BuildOptions { page: 16, border: 4, ..BuildOptions::default() }
}

fn decoded(description: &Description, tile: &[u8]) -> Vec<u8> {
    decode_layer(description, 0, &Bytes::copy_from_slice(tile)).to_vec()
}

fn linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// The parts of a tile that are shown, as texel numbers: for the tail its boxes, else everything inside the
/// level.
fn shown(description: &Description, pos: PagePos) -> Vec<usize> {
    let geometry = &description.geometry;
    let (tile, border) = (geometry.tile(), geometry.border());
    let boxes: Vec<([u32; 2], [u32; 2])> = if geometry.is_tail(pos) {
        let levels = geometry.tail().first_level()..=geometry.coarsest();
        let place = |level| {
            let (at, size) = (geometry.tail().offset(level), geometry.level(level).size);
            ([at[0], at[1]], [size[0] + 2 * border[0], size[1] + 2 * border[1]])
        };
        levels.map(place).collect()
    } else {
        let (level, first) = (geometry.level(pos.level).size, geometry.level_texel_from_page(pos));
        let inside = |a: usize| tile[a].min(level[a] - first[a] as u32 + 2 * border[a]);
        vec![([0, 0], [inside(0), inside(1)])]
    };
    let texels = boxes.into_iter().flat_map(|(at, size)| {
        (0..size[1])
            .flat_map(move |y| (0..size[0]).map(move |x| ((at[1] + y) * tile[0] + at[0] + x) as usize))
    });
    texels.collect()
}

#[test]
fn every_format_holds_the_finest_level() {
    use LayerFormat::*;
    let (sandbox, size) = (Sandbox::new(), [43, 21]);
    let data = texels((size[0] * size[1] * 3) as usize, 3);
    let grey = &data[..(size[0] * size[1]) as usize];
    let (grey_png, rgb_png) = (
        sandbox.image("grey.png", size, ColorType::Grayscale, grey),
        sandbox.image("rgb.png", size, ColorType::Rgb, &data),
    );
    for (image, format, step) in [
        (&grey_png, R8, 1e-9),
        (&grey_png, R16, 1e-9),
        (&grey_png, R16Float, 3e-4),
        (&grey_png, R32Float, 1e-7),
        (&rgb_png, Rg8, 1e-9),
        (&rgb_png, Rgba8, 1e-9),
        (&rgb_png, Rgba8Srgb, 1e-9),
        (&rgb_png, Rgba16, 8e-6),
        (&rgb_png, Rgba16Float, 5e-4),
    ] {
        let (description, tiles) =
            tiles(&sandbox.build(&[layer("color", image, Some(format))], &small_pages()));
        let channels = format.channels();
        let expected = |x: usize, y: usize, channel: usize| {
            let at = y * size[0] as usize + x;
            match channel {
                3 => 1.0,
                _ if image == &grey_png => f64::from(grey[at]) / 255.0,
                _ if matches!(format, Rgba16 | Rgba16Float) => {
                    linear(f64::from(data[3 * at + channel]) / 255.0)
                }
                _ => f64::from(data[3 * at + channel]) / 255.0,
            }
        };
        for (pos, tile) in
            tiles.iter().filter(|(pos, _)| !description.geometry.is_tail(*pos) && pos.level == 0)
        {
            let stored = values(format, tile);
            let first = description.geometry.level_texel_from_page(*pos);
            for (texel, stored) in stored.chunks(channels).enumerate() {
                let at = |n: usize, first: u64, size: u32| {
                    (n as i64 - 4 + first as i64).clamp(0, i64::from(size) - 1) as usize
                };
                let (x, y) = (at(texel % 24, first[0], size[0]), at(texel / 24, first[1], size[1]));
                for (channel, stored) in stored.iter().enumerate() {
                    let error = (stored - expected(x, y, channel)).abs();
                    assert!(error <= step, "{} {pos} {x},{y}: {stored} is {error} off", format.name());
                }
            }
        }
    }
}

/// Pages reach beyond the image, and what lies there has no alpha; that is no transparency.
#[test]
fn only_texels_of_the_image_are_transparent() {
    let (sandbox, size) = (Sandbox::new(), [37, 21]);
    let mut rgba = hills(size, 4);
    rgba.chunks_exact_mut(4).for_each(|texel| texel[3] = 255);
    let opaque = sandbox.image("opaque.png", size, ColorType::Rgba, &rgba);
    rgba[4 * (20 * 37 + 36) + 3] = 254;
    let transparent = sandbox.image("transparent.png", size, ColorType::Rgba, &rgba);
    let rgb = sandbox.image("rgb.png", size, ColorType::Rgb, &hills(size, 3));
    let grey = sandbox.image("grey.png", size, ColorType::Grayscale, &hills(size, 1));
    let lost = |image: &Path, format: LayerFormat| {
        let input = layer("color", image, Some(format));
        let report = build(&[input], &sandbox.path("out.vastex"), &small_pages(), &()).unwrap();
        report.notices().any(|notice| *notice == Notice::NotOpaque(format))
    };
    use LayerFormat::*;
    for format in [Bc1, Bc1Srgb, Bc6h, Bc5, Rg8] {
        assert!(!lost(&opaque, format) && !lost(&rgb, format), "{}", format.name());
        assert!(lost(&transparent, format), "{}", format.name());
    }
    for format in [R8, Bc4, Bc1, Bc6h] {
        assert!(!lost(&grey, format), "{}", format.name());
    }
    for format in [Rgba8, Bc3, Bc7, Rgba16Float] {
        assert!(!lost(&transparent, format), "{}", format.name());
    }
}

#[test]
fn blocks_decode_to_what_they_were_made_of() {
    let (sandbox, size) = (Sandbox::new(), [75, 41]);
    for format in LayerFormat::ALL.into_iter().filter(|format| format.is_compressed()) {
        let color = if format.channels() == 1 { ColorType::Grayscale } else { ColorType::Rgb };
        let image = sandbox.image("in.png", size, color, &hills(size, color.samples()));
        for quality in [Quality::Fast, Quality::Normal, Quality::Best] {
            let options = BuildOptions { quality, ..small_pages() };
            let (description, blocks) =
                tiles(&sandbox.build(&[layer("color", &image, Some(format))], &options));
            let (_, plain) =
                tiles(&sandbox.build(&[layer("color", &image, Some(format.decoded()))], &options));
            assert_eq!(blocks.len(), plain.len());
            for ((pos, blocks), (_, plain)) in blocks.iter().zip(&plain) {
                let [a, b] =
                    [decoded(&description, blocks), plain.clone()].map(|texels| values(format, &texels));
                let channels = a.len() / (24 * 24);
                let squares = shown(&description, *pos).into_iter().flat_map(|texel| {
                    let texel = texel * channels..(texel + 1) * channels;
                    a[texel.clone()].iter().zip(&b[texel]).map(|(a, b)| (a - b).powi(2)).collect::<Vec<_>>()
                });
                let squares: Vec<f64> = squares.collect();
                let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
                let worst = squares.iter().fold(0.0f64, |worst, &square| worst.max(square)).sqrt();
                assert!(rms < 0.035 && worst < 0.2, "{} {quality:?} {pos}: {rms} {worst}", format.name());
            }
        }
    }
}

#[test]
fn neighbours_agree_where_their_borders_are_the_same_blocks() {
    let (sandbox, size) = (Sandbox::new(), [100, 70]);
    let formats = || LayerFormat::ALL.into_iter().filter(|format| format.is_compressed());
    let best = [LayerFormat::Bc1, LayerFormat::Bc3].map(|format| (format, Quality::Best));
    for (format, quality) in formats().map(|format| (format, Quality::Normal)).chain(best) {
        let color = if format.channels() == 1 { ColorType::Grayscale } else { ColorType::Rgba };
        let data = texels((size[0] * size[1]) as usize * color.samples(), 9);
        let image = sandbox.image("in.png", size, color, &data);
        let options = BuildOptions { address: [AddressMode::Wrap; 2], quality, ..small_pages() };
        let (description, tiles) = tiles(&sandbox.build(&[layer("color", &image, Some(format))], &options));
        let tile_of = |pos: PagePos| {
            let tile = tiles.iter().find(|(at, _)| *at == pos);
            tile.map(|(_, tile)| decoded(&description, tile))
        };
        let texel = format.texel_bytes();
        let mut compared = 0;
        for (pos, tile) in tiles.iter().filter(|(pos, _)| !description.geometry.is_tail(*pos)) {
            let (tile, [x, y, _]) = (decoded(&description, tile), pos.coords());
            // The last eight columns and rows are the first eight of the next page.
            if let Some(right) = tile_of(PagePos::new_2d(pos.level, x + 1, y)) {
                for (a, b) in tile.chunks(24 * texel).zip(right.chunks(24 * texel)) {
                    assert_eq!(a[16 * texel..], b[..8 * texel], "{} {pos}", format.name());
                }
                compared += 1;
            }
            if let Some(below) = tile_of(PagePos::new_2d(pos.level, x, y + 1)) {
                assert_eq!(tile[16 * 24 * texel..], below[..8 * 24 * texel], "{} {pos}", format.name());
                compared += 1;
            }
        }
        assert!(compared > 50);
    }
}

/// The mean squared distance of the decoded colours of level 0 from those that the blocks were made of.
fn mean_square(sandbox: &Sandbox, image: &Path, format: LayerFormat, quality: Quality) -> f64 {
    let options = BuildOptions { quality, ..small_pages() };
    let [(description, blocks), (_, plain)] = [format, format.decoded()]
        .map(|format| tiles(&sandbox.build(&[layer("color", image, Some(format))], &options)));
    let finest = blocks.iter().zip(&plain).filter(|((pos, _), _)| pos.level == 0);
    let texels = finest.flat_map(|((_, blocks), (_, plain))| {
        let pairs = decoded(&description, blocks).into_iter().zip(plain.clone());
        pairs.map(|(a, b)| f64::from(a.abs_diff(b)).powi(2)).collect::<Vec<_>>()
    });
    let squares: Vec<f64> = texels.collect();
    squares.iter().sum::<f64>() / squares.len() as f64
}

#[test]
fn the_best_preset_is_nearer_to_the_image() {
    let (sandbox, size) = (Sandbox::new(), [96, 64]);
    // Hills with grain: blocks whose colours are near a line, but not on it.
    let grain = texels((size[0] * size[1]) as usize, 5);
    let data: Vec<u8> = hills(size, 3)
        .iter()
        .zip(grain.iter().flat_map(|grain| [grain; 3]))
        .map(|(hill, grain)| hill.saturating_add(grain / 8))
        .collect();
    let image = sandbox.image("in.png", size, ColorType::Rgb, &data);
    for format in [LayerFormat::Bc1Srgb, LayerFormat::Bc3, LayerFormat::Bc7] {
        let [normal, best] =
            [Quality::Normal, Quality::Best].map(|quality| mean_square(&sandbox, &image, format, quality));
        assert!(best < 0.95 * normal, "{}: {best} against {normal}", format.name());
    }
}

/// Colour in blocks, normals at half and heights at a quarter of its resolution.
fn ground(sandbox: &Sandbox, size: [u32; 2]) -> Vec<LayerInput> {
    let share = |scale| size.map(|n: u32| n.div_ceil(scale));
    let ([w2, h2], [w4, h4]) = (share(2), share(4));
    let color = sandbox.image("c.png", size, ColorType::Rgb, &hills(size, 3));
    let normal = sandbox.image("n.png", [w2, h2], ColorType::Rgb, &hills([w2, h2], 3));
    write_png(
        &sandbox.path("h.png"),
        [w4, h4],
        ColorType::Grayscale,
        BitDepth::Sixteen,
        &texels((w4 * h4 * 2) as usize, 4),
    );
    vec![
        layer("color", &color, Some(LayerFormat::Bc7Srgb)),
        layer("normal", &normal, Some(LayerFormat::Bc5)),
        layer("height", &sandbox.path("h.png"), None),
    ]
}

/// Pages that suit blocks at half the resolution.
fn ground_pages() -> BuildOptions {
    BuildOptions { page: 32, border: 8, ..BuildOptions::default() }
}

#[test]
fn a_layer_of_a_fraction_is_that_of_its_own_texture() {
    for (address, levels_from) in [
        (AddressMode::Clamp, LevelsFrom::Chain),
        (AddressMode::Wrap, LevelsFrom::Chain),
        (AddressMode::Wrap, LevelsFrom::Finest),
        (AddressMode::Mirror, LevelsFrom::TwoFiner),
    ] {
        let sandbox = Sandbox::new();
        let layers = ground(&sandbox, [201, 133]);
        let options = BuildOptions { address: [address; 2], levels_from, ..ground_pages() };
        let (description, together) = tiles(&sandbox.build(&layers, &options));
        assert_eq!(description.layers.iter().map(|layer| layer.scale).collect::<Vec<_>>(), [1, 2, 4]);
        assert_eq!(description.layers[2].format, LayerFormat::R16);
        for (number, input) in layers.iter().enumerate() {
            let scale = description.layers[number].scale;
            let options = BuildOptions { page: 32 / scale, border: 8 / scale, ..options.clone() };
            let (alone, own) = tiles(&sandbox.build(std::slice::from_ref(input), &options));
            let mut compared = 0;
            for (pos, tile) in &together {
                // Its own tail, aligned otherwise, may begin at another level.
                let is_tail =
                    [&description, &alone].iter().any(|one| one.geometry.tail().first_level() <= pos.level);
                if is_tail {
                    continue;
                }
                let (_, own) = own.iter().find(|(at, _)| at == pos).unwrap();
                assert!(tile[description.layer_range(number)] == own[..], "{pos} {}", input.name);
                compared += 1;
            }
            assert!(compared > 20, "{compared}");
        }
    }
}

#[test]
fn every_level_of_the_tail_is_there_in_every_layer() {
    let sandbox = Sandbox::new();
    let layers = ground(&sandbox, [201, 133]);
    let (description, tiles) = tiles(&sandbox.build(&layers, &ground_pages()));
    let (_, tail) = tiles.iter().find(|(pos, _)| description.geometry.is_tail(*pos)).unwrap();
    let heights = values(LayerFormat::R16, &tail[description.layer_range(2)]);
    let own = description.geometry.of_layer(4);
    // The texel of the coarsest level, its border around it.
    let (at, side) = (own.tail().offset(own.coarsest()), own.tile()[0]);
    let texel = |x: u32, y: u32| heights[((at[1] + y) * side + at[0] + x) as usize];
    let mean = texel(2, 2);
    assert!((0.3..0.7).contains(&mean));
    assert!((0..5).all(|y| (0..5).all(|x| texel(x, y) == mean)));
}

#[test]
fn threads_and_parts_change_no_byte() {
    let sandbox = Sandbox::new();
    let layers = ground(&sandbox, [333, 190]);
    let whole = std::fs::read(sandbox.build(&layers, &ground_pages())).unwrap();
    for threads in [1, 2, 5] {
        let options = BuildOptions { threads, ..ground_pages() };
        assert!(std::fs::read(sandbox.build(&layers, &options)).unwrap() == whole, "{threads} threads");
    }
    let parts: Vec<PathBuf> = (1..=3).map(|part| sandbox.path(&format!("{part}.part"))).collect();
    for (part, path) in (1..).zip(&parts) {
        let options = BuildOptions { part: PartOf::new(part, 3), ..ground_pages() };
        build(&layers, path, &options, &()).unwrap();
    }
    let joined = sandbox.path("joined.vastex");
    merge(&parts, &joined, false, |_, _| std::ops::ControlFlow::Continue(())).unwrap();
    assert!(std::fs::read(joined).unwrap() == whole);
}

#[test]
fn what_a_format_cannot_keep_is_said() {
    let sandbox = Sandbox::new();
    let image = sandbox.image("in.png", [20, 20], ColorType::Rgba, &texels(20 * 20 * 4, 1));
    let notices = |format| {
        let layers = [layer("color", &image, Some(format))];
        let report = build(&layers, &sandbox.path("o.vastex"), &small_pages(), &()).unwrap();
        report.notices().map(ToString::to_string).collect::<Vec<_>>()
    };
    assert!(notices(LayerFormat::Bc1)[0].contains("bc3 and bc7"));
    assert!(notices(LayerFormat::Bc6h).iter().any(|notice| notice.contains("rgba16f")));
    assert_eq!(notices(LayerFormat::Bc3Srgb), [] as [String; 0]);
    assert!(notices(LayerFormat::Rgba16)[0].contains("light"));
}

#[test]
fn layers_that_do_not_suit_are_refused_with_a_remedy() {
    let sandbox = Sandbox::new();
    let image = |name: &str, size: [u32; 2]| {
        sandbox.image(name, size, ColorType::Grayscale, &texels((size[0] * size[1]) as usize, 1))
    };
    let whole = image("whole.png", [90, 60]);
    let twice = [layer("a", &whole, None), layer("a", &whole, None)];
    assert!(sandbox.error(&twice, &small_pages()).contains("two layers are called \"a\""));
    let odd = BuildOptions { page: 50, border: 3, ..BuildOptions::default() };
    let error = sandbox.error(&[layer("a", &whole, Some(LayerFormat::Bc4))], &odd);
    assert!(error.contains("pages of 52 with borders of 4"), "{error}");
    let error = sandbox.error(&[layer("a", &whole, Some(LayerFormat::Bc5))], &small_pages());
    assert!(error.contains("cannot become bc5") && error.contains("r8, rgba8"), "{error}");
}

#[test]
fn an_image_of_another_size_is_resampled_to_the_nearest_layer() {
    let sandbox = Sandbox::new();
    let whole = sandbox.image("whole.png", [90, 61], ColorType::Rgb, &texels(90 * 61 * 3, 1));
    // Planes, so that whatever size they have, the texel at a place is known.
    let slope = |name: &str, [width, height]: [u32; 2]| {
        let at = |n: u32, of: u32| (f64::from(n) + 0.5) / f64::from(of);
        let value = |n: u32| 50.0 + 100.0 * at(n % width, width) + 60.0 * at(n / width, height);
        let data: Vec<u8> = (0..width * height).map(|n| value(n).round() as u8).collect();
        sandbox.image(name, [width, height], ColorType::Grayscale, &data)
    };
    for (size, scale, to) in [
        ([30u32, 20u32], 4, [23, 16]),
        ([88, 61], 1, [90, 61]),
        ([100, 50], 1, [90, 61]),
        ([50, 30], 2, [45, 31]),
        ([9, 6], 4, [23, 16]),
    ] {
        let image = slope("height.png", size);
        let inputs = [layer("color", &whole, None), layer("height", &image, None)];
        let report = build(&inputs, &sandbox.path("out.vastex"), &small_pages(), &()).unwrap();
        assert_eq!(report.layers[1].layer.scale, scale);
        assert_eq!(report.layers[1].notices, [Notice::LayerResampled { from: size, to, scale }]);
        assert!(report.layers[0].notices.is_empty());
        let (description, tiles) = tiles(&sandbox.path("out.vastex"));
        let (geometry, page) = (&description.geometry, description.geometry.page()[0] / scale);
        let border = geometry.border()[0] / scale;
        let side = description.geometry.tile()[0] / scale;
        for (pos, tile) in tiles.iter().filter(|(pos, _)| pos.level == 0 && !geometry.is_tail(*pos)) {
            let texels = layer_texels(&description, 1, tile);
            let inside = |n: u32, axis: usize| n > 2 && n + 3 < to[axis];
            for (x, y) in (0..page).flat_map(|y| (0..page).map(move |x| (x, y))) {
                let [u, v] = [pos.x * page + x, pos.y * page + y];
                // At the edges the outermost texels go on, so that the slope ends.
                if !inside(u, 0) || !inside(v, 1) || size[0] < 20 {
                    continue;
                }
                let at = |n: u32, axis: usize| (f64::from(n) + 0.5) / f64::from(to[axis]);
                let expected = 50.0 + 100.0 * at(u, 0) + 60.0 * at(v, 1);
                let got = f64::from(texels[((y + border) * side + x + border) as usize]);
                assert!((got - expected).abs() < 2.0, "{size:?} {u},{v}: {got}, expected {expected}");
            }
        }
    }
}

/// Vectors are as long as they were, and no label is made up.
#[test]
fn resampled_normals_and_labels_stay_what_they_are() {
    let sandbox = Sandbox::new();
    let whole = sandbox.image("whole.png", [90, 61], ColorType::Rgb, &texels(90 * 61 * 3, 1));
    // Steep and turning from texel to texel, so that a plain mean would be much shorter.
    let vector = |n: u32| {
        let (turn, rise) = (f64::from(n) * 2.4, 0.3);
        [turn.cos() * (1.0f64 - rise * rise).sqrt(), turn.sin() * (1.0f64 - rise * rise).sqrt(), rise]
    };
    let stored = |n: u32| vector(n).map(|v| (127.5 * v + 128.0) as u8);
    let normals: Vec<u8> = (0..30 * 20).flat_map(stored).collect();
    let labels: Vec<u8> = (0..30 * 20).map(|n: u32| [3, 90, 200][(n % 7 % 3) as usize]).collect();
    let inputs = [
        layer("color", &whole, None),
        layer(
            "normal",
            &sandbox.image("n.png", [30, 20], ColorType::Rgb, &normals),
            Some(LayerFormat::Rgba8),
        ),
        layer("label", &sandbox.image("l.png", [30, 20], ColorType::Grayscale, &labels), None),
    ];
    let (description, tiles) = tiles(&sandbox.build(&inputs, &small_pages()));
    let (mut vectors, mut picked) = (0, 0);
    for (pos, tile) in tiles.iter().filter(|(pos, _)| pos.level == 0 && !description.geometry.is_tail(*pos)) {
        for texel in layer_texels(&description, 1, tile).as_chunks::<4>().0 {
            let length: f64 = texel[..3].iter().map(|v| (f64::from(*v) / 127.5 - 1.0).powi(2)).sum();
            assert!((length.sqrt() - 1.0).abs() < 0.02, "{pos}: {texel:?}");
            vectors += 1;
        }
        for label in layer_texels(&description, 2, tile) {
            assert!([3, 90, 200].contains(&label), "{pos}: {label}");
            picked += 1;
        }
    }
    assert!(vectors > 500 && picked == vectors, "{vectors} {picked}");
}
