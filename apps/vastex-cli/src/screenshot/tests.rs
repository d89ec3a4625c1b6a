//! Pictures of the window as keys in it ask for them.

use clap::Parser as _;
use vastex_scenes::Picture;
use vastex_viewer::LayerOptions;
use vastex_viewer::layers::CompareMode;

use super::*;
use crate::args::{Args, Command};

const SIZE: [u32; 2] = [128, 64];

/// The picture of a made-up image of 256x64 texels, as the window has it: `change` says what of the picture
/// is other than at first.
fn taken(change: impl FnOnce(&mut Shot)) -> Picture {
    taken_in_parts(None, change)
}

/// The same with at most so many pixels a side drawn at once.
fn taken_in_parts(part_side: Option<u32>, change: impl FnOnce(&mut Shot)) -> Picture {
    let directory = tempfile::tempdir().unwrap();
    let (source, output) = (directory.path().join("a.png"), directory.path().join("out.png"));
    let texels = vec![[90u8, 90, 90]; 256 * 64];
    let mut encoder = png::Encoder::new(std::fs::File::create(&source).unwrap(), 256, 64);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(texels.as_flattened()).unwrap();
    let line = ["vastex", "view", "--cache", "off", source.to_str().unwrap()];
    let Command::View(mut args) = Args::parse_from(line).command else { panic!() };
    args.scene.part_side = part_side;
    let mut shot = shot_of(&args);
    change(&mut shot);
    assert!(shot.write(&args, &Output::at(&output).unwrap()).unwrap());
    let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&output).unwrap()));
    reader.set_transformations(png::Transformations::ALPHA);
    let mut reader = reader.read_info().unwrap();
    let mut rgba = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut rgba).unwrap();
    let (width, height) = reader.info().size();
    Picture { size: [width, height], rgba }
}

/// A picture of the source of a command line.
fn shot_of(args: &ViewArgs) -> Shot {
    Shot {
        source: args.scene.source.clone(),
        over: Vec::new(),
        scene: Scene::Image,
        camera: ShotCamera::First,
        options: args.scene.shown(),
        overlay: None,
        may_be_crisp: true,
        range_is_free: false,
        ground: Ground::Dark,
        size: SIZE,
        pixels_per_point: 1.0,
        has_guides: false,
        measure: None,
        has_hud: false,
    }
}

fn pixel(picture: &Picture, x: u32, y: u32) -> [u8; 4] {
    picture.rgba.as_chunks().0[(y * picture.size[0] + x) as usize]
}

/// The first and the last column of a row that show the image.
fn columns(picture: &Picture, row: u32) -> [u32; 2] {
    let is_image = |x: &u32| pixel(picture, *x, row)[..3].iter().all(|value| value.abs_diff(90) < 3);
    let seen: Vec<u32> = (0..SIZE[0]).filter(is_image).collect();
    [*seen.first().unwrap(), *seen.last().unwrap()]
}

/// Beside a panel all of an image is in half of the window; the picture has no panel.
#[test]
fn all_of_an_image_fills_a_picture_that_has_no_panel() {
    let half = Pose::fitted(SIZE, [256, 64], [DVec2::ZERO, DVec2::new(64.0, 64.0)]);
    let beside = taken(|shot| shot.camera = ShotCamera::At(half));
    let [first, last] = columns(&beside, 32);
    assert!(last < 66, "{first}..{last}");
    let fitted = taken(|shot| shot.camera = ShotCamera::Fitted);
    let [first, last] = columns(&fitted, 32);
    assert!(first < 8 && last > 120, "{first}..{last}");
}

#[test]
fn what_is_measured_is_in_the_picture() {
    let mut measure = Measure::default();
    [[20.0, 32.0], [236.0, 32.0]].into_iter().for_each(|texel| measure.add(DVec2::from(texel)));
    let is_line = |picture: &Picture| {
        let yellow = |x: u32| {
            let [red, _, blue, _] = pixel(picture, x, 32);
            red > 200 && blue < 120
        };
        (20..80).filter(|x| yellow(*x)).count()
    };
    assert_eq!(is_line(&taken(|_| {})), 0);
    let painted = taken(|shot| (shot.camera, shot.measure) = (ShotCamera::Fitted, Some(measure)));
    assert!(is_line(&painted) > 50, "{}", is_line(&painted));
}

/// A globe lies in the middle of what the figures leave free, and is as large as that allows.
#[test]
fn a_globe_lies_beside_the_figures_of_the_machine() {
    let globe = |has_hud: bool| {
        let picture = taken(|shot| {
            (shot.scene, shot.has_hud, shot.size) = (Scene::Globe, has_hud, [448, 96]);
        });
        // What the figures cover is not looked at.
        let first = if has_hud { 348 } else { 0 };
        let is_globe = |x: &u32| pixel(&picture, *x, 48)[..3].iter().all(|value| value.abs_diff(90) < 3);
        let seen: Vec<u32> = (first..448).filter(is_globe).collect();
        [*seen.first().unwrap(), *seen.last().unwrap()]
    };
    let [first, last] = globe(false);
    assert!((first + last + 1).abs_diff(448) <= 1 && (78..82).contains(&(last - first)), "{first}..{last}");
    let [first, last] = globe(true);
    assert!((first + last + 1).abs_diff(348 + 448) <= 1, "{first}..{last}");
    assert!((78..82).contains(&(last - first)), "{first}..{last}");
}

/// Two images side by side share what the figures leave free, so that all of each is seen, in a picture that
/// is drawn in parts as well.
#[test]
fn images_side_by_side_lie_beside_the_figures_of_the_machine() {
    let beside = |part_side: Option<u32>| {
        taken_in_parts(part_side, |shot| {
            shot.over = vec![shot.source.clone()];
            shot.options.layers =
                [0, 1].map(|texture| LayerOptions { texture, ..LayerOptions::default() }).to_vec();
            shot.options.compare_mode = CompareMode::Beside;
            // A column is left over after the second pane.
            (shot.has_hud, shot.size, shot.ground) = (true, [348 + 281, 96], Ground::Light);
        })
    };
    let (whole, in_parts) = (beside(None), beside(Some(100)));
    let is_image =
        |picture: &Picture, x: u32, y: u32| pixel(picture, x, y)[..3].iter().all(|v| v.abs_diff(90) < 3);
    for picture in [&whole, &in_parts] {
        for pane in [348..488, 488..628] {
            let seen: Vec<u32> = pane.clone().filter(|x| is_image(picture, *x, 48)).collect();
            let [first, last] = [seen[0], seen[seen.len() - 1]];
            assert!(first - pane.start < 8 && pane.end - last < 9, "{first}..{last} of {pane:?}");
            // As wide as its pane, and a quarter as high, beside its title and the scale.
            let rows = (0..96).filter(|y| is_image(picture, pane.start + 9, *y));
            assert!((28..38).contains(&rows.count()), "{pane:?}");
        }
    }
    // The figures themselves are as those of the whole, up to some digits, and so is what is left over.
    let is_alike = |x: u32, y: u32| {
        let [one, other] = [&whole, &in_parts].map(|picture| pixel(picture, x, y));
        one.iter().zip(other).all(|(one, other)| one.abs_diff(other) <= 3)
    };
    let alike = (0..348).flat_map(|x| (0..96).map(move |y| (x, y))).filter(|(x, y)| is_alike(*x, *y)).count();
    assert!(alike > 348 * 96 * 3 / 4, "{alike}");
    assert!(
        (0..96).all(|y| is_alike(628, y)),
        "{:?}, {:?}",
        pixel(&whole, 628, 48),
        pixel(&in_parts, 628, 48)
    );
}

/// Where the window closes, what lies open or is read where it lies is drawn all the same.
#[cfg(feature = "build")]
#[test]
fn a_pyramid_is_drawn_while_the_window_waits_for_its_end() {
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/tiff/slide-jpeg.svs");
    let directory = tempfile::tempdir().unwrap();
    let (source, output) = (PathBuf::from(source), directory.path().join("out.png"));
    let line = ["vastex", "view", "--cache", "off", source.to_str().unwrap()];
    let Command::View(args) = Args::parse_from(line).command else { panic!() };
    let shot = Shot { source, ..shot_of(&args) };
    let write = |patience: &Patience| shot.write_while(&args, (&Output::at(&output).unwrap(), patience));
    let patience = Patience::default();
    patience.shorten();
    assert!(write(&patience).unwrap());
    assert!(output.exists());
    patience.end();
    assert!(write(&patience).is_err());
}

/// TIFF of 4x4 texels in so many bands of 8 bits.
#[cfg(feature = "build")]
fn tiff_of_bands(bands: u32) -> Vec<u8> {
    let entries: [[u32; 4]; 9] = [
        [256, 4, 1, 4],
        [257, 4, 1, 4],
        [258, 3, 1, 8],
        [259, 3, 1, 1],
        [262, 3, 1, 1],
        [273, 4, 1, 8 + 2 + 9 * 12 + 4],
        [277, 3, 1, bands],
        [278, 4, 1, 4],
        [279, 4, 1, 16 * bands],
    ];
    let mut file = vec![b'I', b'I', 42, 0, 8, 0, 0, 0, 9, 0];
    for [tag, kind, count, value] in entries {
        file.extend((tag as u16).to_le_bytes().into_iter().chain((kind as u16).to_le_bytes()));
        file.extend(count.to_le_bytes().into_iter().chain(value.to_le_bytes()));
    }
    file.resize(file.len() + 4 + 16 * bands as usize, 0);
    file
}

/// A person may have chosen other bands than those that the command line names.
#[cfg(feature = "build")]
#[test]
fn shapes_of_a_file_are_in_pictures_of_any_bands_of_it() {
    let directory = tempfile::tempdir().unwrap();
    let [file, other, shapes] = ["six.tif", "b.tif", "a.geojson"].map(|name| directory.path().join(name));
    [&file, &other].into_iter().for_each(|file| std::fs::write(file, tiff_of_bands(6)).unwrap());
    std::fs::write(&shapes, r#"{"type":"Point","coordinates":[1,1]}"#).unwrap();
    let [named, path] = [&file, &shapes].map(|path| path.to_str().unwrap());
    let line = ["vastex", "view", "--cache", "off", "--shapes", path, named];
    let Command::View(args) = Args::parse_from(line).command else { panic!() };
    let of_bands = open::path_of_bands(&file, &[5, 4, 3]);
    for (source, has_shapes) in [(&file, true), (&of_bands, true), (&other, false)] {
        let sources =
            Shot { source: source.clone(), ..shot_of(&args) }.open(&args, &Patience::default()).unwrap();
        assert_eq!(sources.shapes.is_some(), has_shapes, "{}", source.display());
    }
}
