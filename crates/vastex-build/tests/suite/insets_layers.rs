//! Insets into textures of several layers, of layers compressed in blocks and across wrapping edges; and
//! builds with insets that are interrupted.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::path::PathBuf;

use crate::common::sandbox::{Sandbox, assert_neighbours_agree, hills, layer};
use crate::common::{texels, tiles};
use png::ColorType::{self, Grayscale, Rgb};
use vastex_build::{BuildError, BuildOptions, Inset, LayerInput, PartOf, Progress, Quality, build};
use vastex_core::AddressMode::{self, Clamp, Wrap};
use vastex_core::LayerFormat;
use vastex_tiles::Compression;

/// Of the colours at the coarse level.
const SIZE: [u32; 2] = [112, 84];

/// An image of some texels.
struct Picture {
    size: [u32; 2],
    color: ColorType,
    data: Vec<u8>,
}

impl Picture {
    fn new(size: [u32; 2], color: ColorType) -> Picture {
        Picture { size, color, data: hills(size, color.samples()) }
    }

    fn noise(size: [u32; 2], color: ColorType, seed: u32) -> Picture {
        Picture { size, color, data: texels((size[0] * size[1]) as usize * color.samples(), seed) }
    }

    fn write(&self, sandbox: &Sandbox, name: &str) -> PathBuf {
        sandbox.image(name, self.size, self.color, &self.data)
    }

    /// Each texel as often as levels are finer.
    fn enlarged(&self, finer: u8) -> Picture {
        let (size, texel) = (self.size.map(|n| n << finer), self.color.samples());
        let places = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x >> finer, y >> finer]));
        let at = |[x, y]: [u32; 2]| (y * self.size[0] + x) as usize * texel;
        let data = places.flat_map(|place| self.data[at(place)..at(place) + texel].to_vec()).collect();
        Picture { size, data, ..*self }
    }

    /// Puts another over it, round the edges.
    fn put(&mut self, over: &Picture, at: [u32; 2]) {
        let texel = self.color.samples();
        for (i, new) in over.data.chunks_exact(texel).enumerate() {
            let [x, y] = [i as u32 % over.size[0] + at[0], i as u32 / over.size[0] + at[1]];
            let at = (y % self.size[1] * self.size[0] + x % self.size[0]) as usize * texel;
            self.data[at..at + texel].copy_from_slice(new);
        }
    }
}

/// A coarse world of colour, normals at half its resolution and heights at a quarter.
struct World {
    sandbox: Sandbox,
    pictures: [Picture; 3],
    formats: [LayerFormat; 3],
}

const NAMES: [&str; 3] = ["color", "normal", "height"];

impl World {
    fn new(formats: [LayerFormat; 3]) -> World {
        let [half, quarter] = [2, 4].map(|n| SIZE.map(|size| size / n));
        let pictures =
            [Picture::new(SIZE, Rgb), Picture::new(half, Rgb), Picture::noise(quarter, Grayscale, 3)];
        World { sandbox: Sandbox::new(), pictures, formats }
    }

    fn inputs(&self, prefix: &str, pictures: &[Picture; 3]) -> Vec<LayerInput> {
        let input = |n: usize| {
            let path = pictures[n].write(&self.sandbox, &format!("{prefix}-{}.png", NAMES[n]));
            let filter = Some("box".parse().unwrap());
            LayerInput { filter, ..layer(NAMES[n], &path, Some(self.formats[n])) }
        };
        (0..3).map(input).collect()
    }

    fn inset(&self, layer: usize, at: [u32; 2], size: [u32; 2], finer: u8) -> (Inset, Picture) {
        let picture = Picture::noise(size, self.pictures[layer].color, 7 * size[0] + at[0]);
        let image = picture.write(&self.sandbox, &format!("inset-{layer}-{}.png", at[0]));
        (Inset { layer: Some(NAMES[layer].into()), image, at, finer }, picture)
    }

    /// What the insets make of the pictures at the finest level.
    fn whole(&self, finest: u8, insets: &[(Inset, Picture)]) -> [Picture; 3] {
        std::array::from_fn(|n| {
            let mut whole = self.pictures[n].enlarged(finest);
            for finer in 0..=finest {
                let of_layer = |inset: &Inset| inset.layer.as_deref() == Some(NAMES[n]);
                for (inset, picture) in insets.iter().filter(|(i, _)| i.finer == finer && of_layer(i)) {
                    let up = finest - finer;
                    whole.put(&picture.enlarged(up), inset.at.map(|n| n << up));
                }
            }
            whole
        })
    }
}

fn options(mode: AddressMode) -> BuildOptions {
    BuildOptions {
        page: 32,
        border: 8,
        address: [mode, Clamp],
        threads: 2,
        quality: Quality::Fast,
        ..BuildOptions::default()
    }
}

#[test]
fn insets_in_layers_and_blocks_are_what_a_whole_build_has() {
    use LayerFormat::{Bc1Srgb, Bc4, Bc5, Bc7, R8, Rg8, Rgba8Srgb};
    for (formats, mode, compression) in [
        ([Rgba8Srgb, Rg8, R8], Clamp, Compression::Lz4),
        ([Rgba8Srgb, Rg8, R8], Wrap, Compression::None),
        ([Bc7, Bc5, R8], Wrap, Compression::Zstd(1)),
        ([Bc1Srgb, Rg8, Bc4], Clamp, Compression::Lz4),
    ] {
        // Blocks at a quarter of the resolution need borders of 16.
        let border = if formats[2] == Bc4 { 16 } else { 8 };
        let options = BuildOptions { border, compression, ..options(mode) };
        let world = World::new(formats);
        let mut insets = vec![
            world.inset(0, [210, 130], [190, 170], 2),
            world.inset(1, [40, 20], [50, 31], 1),
            world.inset(2, [50, 41], [37, 30], 2),
            world.inset(0, [20, 10], [31, 17], 0),
        ];
        if mode == Wrap {
            // Beyond the last column of 448, and of 112 at half the resolution.
            insets.push(world.inset(0, [400, 200], [120, 60], 2));
            insets.push(world.inset(1, [100, 5], [33, 9], 1));
        }
        let with_insets = BuildOptions {
            insets: insets.iter().map(|(inset, _)| inset.clone()).collect(),
            ..options.clone()
        };
        let inputs = world.inputs("coarse", &world.pictures);
        let (description, found) = tiles(&world.sandbox.build_as("insets.vastex", &inputs, &with_insets));
        assert_eq!(description.layers.iter().map(|layer| layer.format).collect::<Vec<_>>(), formats);
        let whole = world.inputs("whole", &world.whole(2, &insets));
        let (whole_description, whole) = tiles(&world.sandbox.build_as("whole.vastex", &whole, &options));
        assert_eq!(description, whole_description);
        let expected = |pos| whole.iter().find(|(at, _)| *at == pos).map(|(_, tile)| tile);
        for (pos, tile) in &found {
            for (n, name) in NAMES.iter().enumerate() {
                let part = description.layer_range(n);
                let expected = &expected(*pos).unwrap()[part.clone()];
                assert!(tile[part] == *expected, "{pos} {name} {mode:?}");
            }
        }
        let on_level = |level| found.iter().filter(|(pos, _)| pos.level == level).count();
        assert!(on_level(0) > 30 && on_level(0) < 120 && on_level(1) > 12, "{} {}", on_level(0), on_level(1));
        assert!(assert_neighbours_agree(&description, &found) > 100);
    }
}

#[test]
fn layers_that_insets_do_not_name_are_refused() {
    let world = World::new([LayerFormat::Rgba8Srgb, LayerFormat::Rg8, LayerFormat::R8]);
    let inputs = world.inputs("coarse", &world.pictures);
    let (inset, _) = world.inset(0, [20, 10], [31, 17], 1);
    let before = world.sandbox.names();
    let refused = |change: &dyn Fn(&mut BuildOptions)| {
        let mut options = BuildOptions { insets: vec![inset.clone()], ..options(Clamp) };
        change(&mut options);
        let error = build(&inputs, &world.sandbox.path("out.vastex"), &options, &()).unwrap_err().to_string();
        assert_eq!(world.sandbox.names(), before);
        error
    };
    for name in [None, Some("colour".to_string())] {
        let error = refused(&|options| options.insets[0].layer = name.clone());
        assert!(error.contains("the layers color, normal, height") && error.contains("NAME="), "{error}");
    }
    let error = refused(&|options| options.insets[0].layer = Some("height".into()));
    assert!(error.contains("holds") && error.contains("r8"), "{error}");
    let error = refused(&|options| options.part = PartOf::new(1, 2));
    assert!(error.contains("without --shard"), "{error}");
    // Only across an edge that wraps.
    let error = refused(&|options| (options.insets[0].at, options.address) = ([20, 160], [Wrap, Clamp]));
    assert!(error.contains("beyond the texture"), "{error}");
}

/// Stops after so many steps.
struct StopAfter(Cell<u32>);

impl Progress for StopAfter {
    fn advance(&self, done: u64, total: u64, _: u64) -> ControlFlow<()> {
        assert!(done <= total, "{done} of {total}");
        let left = self.0.get();
        self.0.set(left.saturating_sub(1));
        if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// A world, its inputs and options with three insets, and the bytes that they make.
fn interrupted() -> (World, Vec<LayerInput>, BuildOptions, Vec<u8>) {
    let world = World::new([LayerFormat::Bc7, LayerFormat::Rg8, LayerFormat::R8]);
    let insets = [(0, [210, 130], [190, 170], 2), (1, [40, 20], [50, 31], 1), (0, [20, 10], [31, 17], 0)]
        .map(|(layer, at, size, finer)| world.inset(layer, at, size, finer).0);
    let options = BuildOptions { insets: insets.to_vec(), resume: true, ..options(Clamp) };
    let inputs = world.inputs("coarse", &world.pictures);
    let whole = std::fs::read(world.sandbox.build(&inputs, &options)).unwrap();
    std::fs::remove_file(world.sandbox.path("out.vastex")).unwrap();
    (world, inputs, options, whole)
}

fn stop(world: &World, inputs: &[LayerInput], options: &BuildOptions, steps: u32) -> bool {
    let output = world.sandbox.path("out.vastex");
    match build(inputs, &output, options, &StopAfter(steps.into())) {
        Err(BuildError::Cancelled) => true,
        Err(error) => panic!("{error}"),
        Ok(_) => false,
    }
}

#[test]
fn an_interrupted_build_with_insets_goes_on_to_the_same_bytes() {
    let (world, inputs, options, whole) = interrupted();
    let before = world.sandbox.names();
    let (mut steps, mut resumed) = (0, 0);
    // Stopped once and, a few steps on, once more.
    while stop(&world, &inputs, &options, steps) {
        stop(&world, &inputs, &options, 2 + steps % 7);
        let report = build(&inputs, &world.sandbox.path("out.vastex"), &options, &()).unwrap();
        resumed += u32::from(report.resumed_tiles > 0);
        assert!(std::fs::read(world.sandbox.path("out.vastex")).unwrap() == whole, "{steps}");
        std::fs::remove_file(world.sandbox.path("out.vastex")).unwrap();
        assert_eq!(world.sandbox.names(), before, "{steps}");
        steps += 11;
    }
    assert!(steps > 60 && resumed > 2, "{steps} {resumed}");
}

#[test]
fn what_a_build_with_insets_left_is_removed_or_refused() {
    let (world, inputs, options, whole) = interrupted();
    let before = world.sandbox.names();
    let output = world.sandbox.path("out.vastex");
    let leave = || {
        let _ = std::fs::remove_file(&output);
        assert!(stop(&world, &inputs, &options, 70));
        let left = world.sandbox.names();
        assert!(left.iter().any(|name| name.ends_with(".insets")), "{left:?}");
        left
    };
    let anew = BuildOptions { resume: false, ..options.clone() };
    let plain = BuildOptions { insets: Vec::new(), ..options.clone() };
    let other = BuildOptions { insets: options.insets[..2].to_vec(), ..options.clone() };
    for refused in [&plain, &other] {
        let left = leave();
        let error = build(&inputs, &output, refused, &()).unwrap_err().to_string();
        assert!(error.contains("without --resume"), "{error}");
        assert_eq!(world.sandbox.names(), left);
    }
    for (options, whole) in [
        (anew.clone(), Some(&whole)),
        (BuildOptions { resume: false, ..plain.clone() }, None),
        (BuildOptions { resume: false, ..other }, None),
        (BuildOptions { part: PartOf::new(1, 2), resume: false, ..plain.clone() }, None),
    ] {
        leave();
        build(&inputs, &output, &options, &()).unwrap();
        assert!(whole.is_none_or(|whole| std::fs::read(&output).unwrap() == *whole));
        std::fs::remove_file(&output).unwrap();
        assert_eq!(world.sandbox.names(), before);
    }
    // A build without insets that was interrupted is not gone on with by one with insets.
    assert!(stop(&world, &inputs, &plain, 1));
    let error = build(&inputs, &output, &options, &()).unwrap_err().to_string();
    assert!(error.contains("without --resume"), "{error}");
    build(&inputs, &output, &anew, &()).unwrap();
    assert!(std::fs::read(&output).unwrap() == whole);
}
