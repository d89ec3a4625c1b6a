//! Lists of layers: one over the other in their order, by opacity, in light, each with its own range,
//! exponent and colour map.

use std::path::Path as FilePath;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec2;
use vastex::{Filter, Textures, TileSource, ViewId};
use vastex_scenes::{Comparison, DisplayOptions, LayerOptions, Offscreen, Path, Picture, Pose, Scene, Until};
use vastex_viewer::layers::{CompareMode, Ground};
use vastex_viewer::stage::{Canvas, Frame, Pictures, StageView, TargetKind, TextureRead, draw_again};
use vastex_viewer::{
    Bands, ColorMap, Curve, Layers, LayersError, Nodata, Palette, SceneDesc, SceneRenderer, ShownLayer, Tone,
};
use vastex_wgpu::test_device::finish;

use crate::common::{Image, gpu, is_processor, settings};

const SIZE: [u32; 2] = [120, 80];
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
const POSE: Pose = Pose::image(DVec2::new(0.5, 0.5), 1.3);

/// Where layers lie, from the first file's to the last's.
fn list(files: &[&FilePath]) -> (Textures, Vec<ShownLayer>) {
    let gpu = gpu();
    let mut textures = Textures::new(&gpu.device, &gpu.queue, settings(16, Filter::Trilinear)).unwrap();
    let shown = files.iter().map(|file| {
        let texture = textures.add_blocking(vastex::open(file).unwrap()).unwrap();
        ShownLayer::new(texture.into(), &textures.texture(texture).unwrap().description().layers[0])
    });
    let shown = shown.collect();
    (textures, shown)
}

/// The picture of a list once everything of it is there.
fn draw(textures: &mut Textures, shown: Vec<ShownLayer>) -> Picture {
    let layers = Layers::new(textures, shown, None).unwrap();
    draw_list(textures, layers, Scene::Image, (POSE, false))
}

pub(crate) fn draw_list(
    textures: &mut Textures,
    layers: Layers,
    scene: Scene,
    (pose, always_fixed): (Pose, bool),
) -> Picture {
    let gpu = gpu();
    let kind = SceneRenderer::target_kind(&gpu.adapter, &layers);
    assert_eq!(kind == TargetKind::Linear, layers.count() > 1, "one layer is drawn straight");
    let format = kind.drawn_format(FORMAT);
    let (device, queue) = (&gpu.device, &gpu.queue);
    let drawn = SceneDesc {
        scene,
        layers,
        relief: None,
        tiling: Default::default(),
        always_fixed,
        light: Default::default(),
    };
    let renderer = SceneRenderer::new(gpu, textures, drawn, format).unwrap();
    let canvas = Canvas::new(gpu, SIZE, FORMAT, kind);
    for frame in 0.. {
        let views = [StageView { view: ViewId::MAIN, camera: renderer.camera(), pose }];
        let pictures = Pictures::ForFeedback;
        let frame_of = Frame { views: &views, expected: None, picture: SIZE, has_feedback: true, pictures };
        let encoder = frame_of.record(gpu, textures, &renderer, &canvas.target(), |_, _| Ok(())).unwrap();
        queue.submit([encoder.finish()]);
        if frame > 20 && textures.stats().converged {
            break;
        }
        assert!(frame < 1000, "{:?}", textures.stats());
    }
    let mut encoder = device.create_command_encoder(&Default::default());
    draw_again(&mut encoder, textures, &renderer, renderer.camera(), &canvas.target());
    let read = TextureRead::submit(gpu, encoder, canvas.picture(), 4);
    // The device is shared, and the thread of another test may be about to hand the picture over.
    let rgba = loop {
        finish(device);
        if let Some(rgba) = read.take() {
            break rgba.unwrap();
        }
        std::thread::yield_now();
    };
    Picture { size: SIZE, rgba }
}

pub(crate) fn linear(encoded: u8) -> f64 {
    let value = f64::from(encoded) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

pub(crate) fn encoded(light: f64) -> f64 {
    255.0 * if light <= 0.003_130_8 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// How far a picture is from one picture over another, in steps of 1/255.
fn apart(found: &Picture, above: &Picture, below: &Picture, opacity: f64) -> f64 {
    let bytes = found.rgba.iter().zip(above.rgba.iter().zip(&below.rgba)).enumerate();
    let colours = bytes.filter(|(n, _)| n % 4 != 3 && found.rgba[n / 4 * 4 + 3] == 255);
    let apart = |(_, (found, (above, below))): (usize, (&u8, (&u8, &u8)))| {
        let light = linear(*above) * opacity + linear(*below) * (1.0 - opacity);
        (encoded(light) - f64::from(*found)).abs()
    };
    colours.map(apart).fold(0.0, f64::max)
}

#[test]
fn layers_are_drawn_in_their_order() {
    let (_one, colour) = Image::new(300, 200, 64).build();
    let grey = Image { channels: png::ColorType::Grayscale, sixteen_bit: true, ..Image::new(300, 200, 64) };
    let (_other, grey) = grey.build();
    let single = |file: &FilePath, change: fn(ColorMap) -> ColorMap| {
        let (mut textures, mut shown) = list(&[file]);
        shown[0].color_map = change(shown[0].color_map);
        draw(&mut textures, shown)
    };
    let as_viridis: fn(ColorMap) -> ColorMap = |map| {
        map.with_palette(Palette::VIRIDIS).with_tone(Tone {
            range: [0.1, 0.8],
            exposure: 0.5,
            curve: Curve::Log,
            gamma: 1.4,
        })
    };
    let (colour_alone, grey_alone) = (single(&colour, |map| map), single(&grey, as_viridis));
    // As the scene of one layer draws it.
    let plain = single(&grey, |map| map);
    let (options, settings) = (DisplayOptions::default(), settings(16, Filter::Trilinear));
    let source = vastex::open(&grey).unwrap();
    let mut offscreen = Offscreen::showing(&options, gpu(), source, Scene::Image, SIZE, settings).unwrap();
    crate::common::settle(&mut offscreen, POSE);
    let worst = plain.rgba.iter().zip(&offscreen.picture().rgba).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(worst <= Some(1), "{worst:?}");
    for (opacity, swapped) in [(0.4, false), (0.4, true), (1.0, false), (0.0, true)] {
        let files = if swapped { [&*grey, &*colour] } else { [&*colour, &*grey] };
        let (mut textures, mut shown) = list(&files);
        let n = usize::from(!swapped);
        shown[n].color_map = as_viridis(shown[n].color_map);
        shown[1].opacity = opacity as f32;
        let found = draw(&mut textures, shown);
        let (above, below) =
            if swapped { (&colour_alone, &grey_alone) } else { (&grey_alone, &colour_alone) };
        let apart = apart(&found, above, below, opacity);
        assert!(apart <= 2.0, "opacity {opacity}, swapped {swapped}: {apart}");
    }
    let (mut textures, mut shown) = list(&[&colour, &grey]);
    shown[1].is_visible = false;
    assert!(apart(&draw(&mut textures, shown), &colour_alone, &colour_alone, 1.0) <= 2.0);
}

#[test]
fn the_uppermost_layer_is_compared_with_those_beneath() {
    let (_one, lower) = Image::new(300, 200, 64).build();
    let (_other, upper) = Image { channels: png::ColorType::Grayscale, ..Image::new(300, 200, 64) }.build();
    let (_half, smaller) = Image::new(150, 100, 64).build();
    let alone = |file: &FilePath| {
        let (mut textures, shown) = list(&[file]);
        draw(&mut textures, shown)
    };
    let (below, above) = (alone(&lower), alone(&upper));
    let compared = |files: &[&FilePath], mode: CompareMode| {
        let (mut textures, shown) = list(files);
        let mut layers = Layers::new(&mut textures, shown, None).unwrap();
        layers.compare(mode);
        draw_list(&mut textures, layers, Scene::Image, (POSE, false))
    };
    let at = |picture: &Picture, x: u32, y: u32| {
        let n = (y * SIZE[0] + x) as usize * 4;
        [0, 1, 2].map(|channel| i32::from(picture.rgba[n + channel]))
    };
    let is_covered = |x: u32, y: u32| below.rgba[(y * SIZE[0] + x) as usize * 4 + 3] == 255;
    let pixels = || (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
    let worst = |found: &Picture, expected: &dyn Fn(u32, u32) -> [i32; 3]| {
        let covered = pixels().filter(|(x, y)| is_covered(*x, *y));
        let apart = |(x, y)| (0..3).map(|c| (at(found, x, y)[c] - expected(x, y)[c]).abs()).max().unwrap();
        covered.map(apart).max().unwrap()
    };
    for share in [0.0, 0.3, 1.0] {
        let found = compared(&[&lower, &upper], CompareMode::Swipe(share));
        let line = share * SIZE[0] as f32;
        let expected = |x: u32, y| at(if x as f32 + 0.5 >= line { &above } else { &below }, x, y);
        assert!(worst(&found, &expected) <= 2, "at {share}");
    }
    for times in [1.0, 4.0] {
        let found = compared(&[&lower, &upper], CompareMode::Difference(times));
        let expected = |x, y| {
            let (above, below) = (at(&above, x, y), at(&below, x, y));
            [0, 1, 2].map(|c| ((above[c] - below[c]).abs() * times as i32).min(255))
        };
        // Each picture is rounded to a step.
        assert!(worst(&found, &expected) <= 2 + 2 * times as i32, "{times} times");
    }
    // An image differs from itself in nothing, however much that is magnified. The two lie at different
    // places of an atlas: by a GPU's weights (docs/draw-checks.md, "What a GPU may differ by") they may be
    // two steps apart, one along each axis, which are magnified, and one more by rounding.
    let from_itself = |filter: Filter, times: f32| {
        let (mut textures, mut shown) = list(&[&upper, &upper]);
        shown.iter_mut().for_each(|shown| shown.filter = Some(filter));
        let mut layers = Layers::new(&mut textures, shown, None).unwrap();
        layers.compare(CompareMode::Difference(times));
        worst(&draw_list(&mut textures, layers, Scene::Image, (POSE, false)), &|_, _| [0; 3])
    };
    assert_eq!(from_itself(Filter::Nearest, 1000.0), 0);
    let (times, most) = if is_processor() { (1000, 0) } else { (16, 2 * 16 + 1) };
    let apart = from_itself(Filter::Trilinear, times as f32);
    assert!(apart <= most, "{apart}, {times} times");
    // One layer alone is not compared.
    let hidden = |mode| {
        let (mut textures, mut shown) = list(&[&lower, &upper]);
        shown[0].is_visible = false;
        let mut layers = Layers::new(&mut textures, shown, None).unwrap();
        layers.compare(mode);
        assert_eq!(layers.inspected_at(0.0), layers.inspected());
        draw_list(&mut textures, layers, Scene::Image, (POSE, false))
    };
    assert!(worst(&hidden(CompareMode::Swipe(1.0)), &|x, y| at(&above, x, y)) <= 2);
    // Files of other sizes are stretched over the same place.
    let (small, stretched) = (alone(&smaller), compared(&[&lower, &smaller], CompareMode::Swipe(0.0)));
    assert!(worst(&stretched, &|x, y| at(&small, x, y)) <= 2);
    let (mut textures, shown) = list(&[&lower, &upper]);
    let mut layers = Layers::new(&mut textures, shown.clone(), None).unwrap();
    layers.compare(CompareMode::Swipe(0.5));
    assert_eq!([0.2, 0.8].map(|across| *layers.inspected_at(across)), [shown[0], shown[1]]);
}

/// Channels that are exchanged, and what stands for no data, of a layer alone and of one in a list.
#[test]
fn bands_are_chosen_and_what_is_no_data_is_not_drawn() {
    let (_one, colour) = Image::new(300, 200, 64).build();
    let (_other, grey) = Image { channels: png::ColorType::Grayscale, ..Image::new(300, 200, 64) }.build();
    let picture = |file: &FilePath, is_alone: bool, change: &dyn Fn(ColorMap) -> ColorMap| {
        // A layer that is hidden makes a list of it.
        let (mut textures, mut shown) = list(&[file, file][usize::from(is_alone)..]);
        shown[0].color_map = change(shown[0].color_map);
        shown[0].filter = Some(Filter::Nearest);
        shown.iter_mut().skip(1).for_each(|shown| shown.is_visible = false);
        draw(&mut textures, shown).rgba
    };
    let [plain_colour, plain_grey] = [&colour, &grey].map(|file| picture(file, true, &|map| map));
    // Of a grey picture, the value that most pixels have.
    let covered = |rgba: &[u8]| {
        rgba.chunks(4).filter(|pixel| pixel[3] == 255).map(|pixel| pixel[0]).collect::<Vec<u8>>()
    };
    let values = covered(&plain_grey);
    let count = |value: u8| values.iter().filter(|other| **other == value).count();
    let missing = (0..=255).max_by_key(|value| count(*value)).unwrap();
    assert!((1..values.len()).contains(&count(missing)));
    for is_alone in [true, false] {
        let compare = |found: &[u8], plain: &[u8], expected: &dyn Fn(&[u8]) -> [u8; 3]| {
            for (found, plain) in found.chunks(4).zip(plain.chunks(4)).filter(|(_, plain)| plain[3] == 255) {
                let expected = expected(plain);
                let is_near =
                    found.iter().zip(expected).all(|(found, expected)| found.abs_diff(expected) <= 1);
                assert!(is_near, "{found:?} of {plain:?}, expected {expected:?}, alone {is_alone}");
            }
        };
        let swapped = picture(&colour, is_alone, &|map| map.with_bands(Bands::Color([2, 1, 0])));
        compare(&swapped, &plain_colour, &|plain| [plain[2], plain[1], plain[0]]);
        let green = picture(&colour, is_alone, &|map| map.with_bands(Bands::One(1)));
        compare(&green, &plain_colour, &|plain| [plain[1]; 3]);
        let nodata = Nodata::Value(f64::from(missing) / 255.0);
        let holes = picture(&grey, is_alone, &|map| map.with_nodata(nodata));
        let background = (vastex_viewer::layers::BACKGROUND.truncate().to_array())
            .map(|light| encoded(light.into()).round() as u8);
        compare(&holes, &plain_grey, &|plain| if plain[0] == missing { background } else { [plain[0]; 3] });
        let filled =
            picture(&grey, is_alone, &|map| map.with_nodata(nodata).with_nodata_color(Some([9, 200, 77])));
        compare(&filled, &plain_grey, &|plain| {
            if plain[0] == missing { [9, 200, 77] } else { [plain[0]; 3] }
        });
        // A range with all of it between black and white hides nothing, and no value is no number.
        let whole = picture(&grey, is_alone, &|map| map.with_nodata(Nodata::NotANumber));
        compare(&whole, &plain_grey, &|plain| [plain[0]; 3]);
    }
}

/// What is transparent shows the ground; around the image chequers are dark.
#[test]
fn the_ground_is_seen_through_what_is_transparent() {
    let (_directory, file) = Image::new(200, 150, 64).build();
    let transparent = LayerOptions { opacity: 0.0, ..LayerOptions::default() };
    let options = DisplayOptions { layers: vec![transparent], ..DisplayOptions::default() };
    let source = vastex::open(&file).unwrap();
    let settings = settings(16, Filter::Trilinear);
    let mut drawn = Offscreen::showing(&options, gpu(), source, Scene::Image, [160, 90], settings).unwrap();
    let mut seen = |ground: Ground, [x, y]: [usize; 2]| {
        drawn.lay_on(ground);
        drawn.run(Path::Still, Until::Frames(1), |_, _| ()).unwrap();
        drawn.picture().rgba[4 * (160 * y + x)]
    };
    // The image is 120 pixels wide, in the middle.
    for (ground, beside, squares) in
        [(Ground::Dark, 0..60, [0..60, 0..60]), (Ground::Light, 220..240, [220..240, 220..240])]
    {
        assert!(beside.contains(&seen(ground, [5, 40])), "{ground:?}");
        assert!(squares[0].contains(&seen(ground, [30, 5])) && squares[1].contains(&seen(ground, [42, 5])));
    }
    assert!(seen(Ground::Chequers, [5, 40]) < 60);
    let [darker, lighter] = [[30, 5], [42, 5]].map(|place| seen(Ground::Chequers, place));
    assert!((200..210).contains(&darker) && lighter > 250, "{darker} and {lighter}");
    assert_eq!(seen(Ground::Chequers, [42, 17]), darker, "and so on downwards");
}

#[test]
fn a_list_has_one_layer_or_some() {
    let (_directory, file) = Image::new(64, 64, 64).build();
    let (mut textures, shown) = list(&[&file]);
    assert!(matches!(Layers::new(&mut textures, Vec::new(), None), Err(LayersError::Count(0))));
    assert!(matches!(Layers::new(&mut textures, vec![shown[0]; 9], None), Err(LayersError::Count(9))));
}

/// Textures of different sizes over one another lie as exactly in fixed point as meshes have them, on an
/// image and a globe.
#[test]
fn a_list_is_the_same_in_fixed_point() {
    let (_one, colour) = Image::new(300, 200, 64).build();
    let grey = Image { channels: png::ColorType::Grayscale, ..Image::new(1100, 730, 64) };
    let (_other, grey) = grey.build();
    let globe = Pose::globe(0.4, 0.3, 0.4);
    for (scene, pose) in [(Scene::Image, POSE), (Scene::Globe, globe)] {
        let [mesh, fixed] = [false, true].map(|always_fixed| {
            let (mut textures, mut shown) = list(&[&colour, &grey]);
            shown[1].opacity = 0.5;
            let layers = Layers::new(&mut textures, shown, None).unwrap();
            draw_list(&mut textures, layers, scene, (pose, always_fixed))
        });
        let alike = Comparison::of(&mesh, &fixed);
        // A mesh of a globe is flat between its corners.
        let least = if scene == Scene::Globe { 30.0 } else { 45.0 };
        assert!(alike.psnr_db > least, "{scene:?}: {alike:?}");
        assert_ne!(mesh.rgba, vec![0; mesh.rgba.len()]);
    }
}

/// A texture whose reads are counted.
struct Counted {
    source: Arc<dyn TileSource>,
    reads: AtomicU64,
}

impl TileSource for Counted {
    fn description(&self) -> &Arc<vastex::Description> {
        self.source.description()
    }

    fn read(&self, pos: vastex::PagePos) -> vastex::source::ReadFuture<'_> {
        self.reads.fetch_add(1, Ordering::Relaxed);
        self.source.read(pos)
    }

    fn behind(&self) -> Option<&dyn TileSource> {
        Some(&*self.source)
    }
}

/// Of a hidden layer nothing is asked for but what is always there, until it is shown; of a list of hidden
/// layers nothing at all.
#[test]
fn pages_of_hidden_layers_are_not_asked_for() {
    let (_directory, file) = Image::new(700, 500, 64).build();
    let gpu = gpu();
    let counted = || {
        let source = vastex::open(&file).unwrap();
        Arc::new(Counted { source, reads: AtomicU64::new(0) })
    };
    for hidden in [vec![1], vec![0, 1]] {
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings(16, Filter::Trilinear)).unwrap();
        let sources = [counted(), counted(), counted()];
        let mut shown = Vec::new();
        for source in &sources {
            let texture = textures.add_blocking(source.clone()).unwrap();
            shown.push(ShownLayer::new(
                texture.into(),
                &textures.texture(texture).unwrap().description().layers[0],
            ));
        }
        shown.truncate(2.max(hidden.len()));
        let reads = || [0, 1].map(|n| sources[n].reads.load(Ordering::Relaxed));
        let before = reads();
        hidden.iter().for_each(|&n| shown[n].is_visible = false);
        let mut layers = Layers::new(&mut textures, shown, None).unwrap();
        draw_list(&mut textures, layers.clone(), Scene::Image, (POSE, false));
        let after = reads();
        for n in 0..2 {
            let asked = after[n] > before[n];
            assert_eq!(asked, !hidden.contains(&n), "layer {n} of {hidden:?}: {before:?}, {after:?}");
        }
        let again = ShownLayer { is_visible: true, ..*layers.iter().nth(1).unwrap() };
        assert!(!layers.set(&mut textures, 1, again).unwrap(), "nothing has to be made anew");
        draw_list(&mut textures, layers, Scene::Image, (POSE, false));
        assert!(reads()[1] > before[1]);
    }
}

/// Each layer is blended by its own filter.
#[test]
fn layers_have_filters_of_their_own() {
    let (_directory, file) = Image::new(60, 40, 64).build();
    let near = Pose::image(DVec2::new(0.5, 0.5), 8.0);
    let picture = |filters: [Option<Filter>; 2]| {
        let (mut textures, mut shown) = list(&[&file, &file]);
        shown.iter_mut().zip(filters).for_each(|(shown, filter)| shown.filter = filter);
        shown[1].opacity = 0.0;
        let layers = Layers::new(&mut textures, shown, None).unwrap();
        draw_list(&mut textures, layers, Scene::Image, (near, false))
    };
    let (nearest, smooth) = (picture([Some(Filter::Nearest), None]), picture([None, Some(Filter::Nearest)]));
    assert_eq!(smooth, picture([Some(Filter::Trilinear); 2]));
    let neighbours = |picture: &Picture| {
        picture.rgba.chunks_exact(4).collect::<Vec<_>>().windows(2).filter(|two| two[0] == two[1]).count()
    };
    // 8 to 16 pixels of each texel are alike.
    assert!(neighbours(&nearest) > 8000 && neighbours(&smooth) < 6000, "{}", neighbours(&smooth));
}
