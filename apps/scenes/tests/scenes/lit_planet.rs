//! A planet under a sun: each of its parts changes what it should and nothing else, and may be left out.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use vastex::{AddressMode, FeedbackMode, Filter, Settings, TileSource};
use vastex_scenes::{
    Comparison, DisplayOptions, Heights, LayerOptions, Offscreen, OffscreenError, Path, Picture, PlanetLight,
    PlanetOptions, Pose, Scene, SceneImage, Until,
};
use vastex_viewer::camera::Aim;
use vastex_viewer::stage::TargetKind;

use crate::common::{Image, gpu, settings};

const SIZE: [u32; 2] = [192, 108];
/// Where the ground is the sea's, of heights that go from 0 to about a third.
const SEA: f32 = 0.12;

/// A texture of a planet; each has pages of its own size, and so a pool of its own.
fn texture(size: [u32; 2], page: u32, channels: png::ColorType, sixteen_bit: bool) -> Arc<dyn TileSource> {
    let address = [AddressMode::Wrap, AddressMode::Clamp];
    let image = Image { address, channels, sixteen_bit, ..Image::new(size[0], size[1], page) };
    let (_directory, file) = image.build();
    vastex::open(file).unwrap()
}

/// Colours, heights, lights and clouds.
fn textures() -> [Arc<dyn TileSource>; 4] {
    use png::ColorType::{Grayscale, Rgb};
    [
        texture([1024, 512], 64, Rgb, false),
        texture([512, 256], 32, Grayscale, true),
        texture([512, 256], 48, Grayscale, false),
        texture([384, 192], 40, Grayscale, false),
    ]
}

/// All parts, the sun in the west.
fn options() -> DisplayOptions {
    let of = |texture| Some(LayerOptions { texture, ..LayerOptions::default() });
    DisplayOptions {
        layers: vec![LayerOptions::default()],
        heights: Heights { texture: Some(1), zero: Some(SEA), ..Heights::default() },
        planet: PlanetOptions {
            night: of(2),
            clouds: of(3),
            light: PlanetLight { sun: Some([-90.0, 0.0]), exaggeration: 4.0, ..PlanetLight::default() },
        },
        ..DisplayOptions::default()
    }
}

/// All of it, over the place where the day ends.
fn whole() -> Pose {
    Pose::globe(0.0, 0.0, 1.3)
}

fn planet(textures: &[Arc<dyn TileSource>], options: &DisplayOptions, scene: Scene) -> Offscreen {
    planet_by(textures, options, scene, settings(16, Filter::Trilinear))
}

fn planet_by(
    textures: &[Arc<dyn TileSource>],
    options: &DisplayOptions,
    scene: Scene,
    settings: Settings,
) -> Offscreen {
    let over: Vec<SceneImage> = textures[1..].iter().cloned().map(SceneImage::from).collect();
    let images = (textures[0].clone().into(), &*over);
    Offscreen::showing_together(options, gpu(), images, scene, SIZE, settings).unwrap()
}

fn drawn_at(mut planet: Offscreen, pose: Pose) -> Picture {
    planet.stand_at(pose);
    let outcome = planet.run(Path::Still, Until::Converged, |_, _| ()).unwrap();
    assert!(outcome.converged, "{:?}", outcome.stats);
    planet.picture()
}

fn drawn(textures: &[Arc<dyn TileSource>], options: &DisplayOptions) -> Picture {
    drawn_at(planet(textures, options, Scene::Planet), whole())
}

/// The options with another light.
fn lit(options: &DisplayOptions, change: impl FnOnce(&mut PlanetLight)) -> DisplayOptions {
    let mut options = options.clone();
    change(&mut options.planet.light);
    options
}

/// The pixels that differ by more than a step of 1/255: by the distance from the middle in radii of the
/// planet's disc, and how far to the right they are.
fn changes(a: &Picture, b: &Picture) -> Vec<(f64, f64)> {
    // The disc's radius: the tangent of the angle at which the edge is seen, by that of half the view.
    let radius =
        (1.0 / (2.3f64 * 2.3 - 1.0)).sqrt() / (std::f64::consts::FRAC_PI_6).tan() * f64::from(SIZE[1]) / 2.0;
    let pixels = a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4)).enumerate();
    let is_other = |(a, b): (&[u8], &[u8])| (0..3).any(|n| a[n].abs_diff(b[n]) > 1);
    pixels
        .filter(|(_, pair)| is_other(*pair))
        .map(|(n, _)| {
            let x = (n as u32 % SIZE[0]) as f64 + 0.5 - f64::from(SIZE[0]) / 2.0;
            let y = (n as u32 / SIZE[0]) as f64 + 0.5 - f64::from(SIZE[1]) / 2.0;
            (x.hypot(y) / radius, x / radius)
        })
        .collect()
}

#[test]
fn parts_of_a_planet_change_what_they_should_and_nothing_else() {
    let (textures, options) = (textures(), options());
    let picture = drawn(&textures, &options);
    assert_eq!(picture, drawn(&textures, &options), "twice the same");

    // Lights are seen where it is night, which is to the right.
    let changed = changes(&picture, &drawn(&textures, &lit(&options, |light| light.night = 0.0)));
    assert!(changed.len() > 500, "{} pixels", changed.len());
    assert!(changed.iter().all(|(out, right)| *out < 1.05 && *right > -0.15), "lights by day");

    // Clouds hide ground on both sides, and nothing beside it.
    let mut cloudless = options.clone();
    cloudless.planet.clouds.as_mut().unwrap().opacity = 0.0;
    let changed = changes(&picture, &drawn(&textures, &cloudless));
    assert!(changed.iter().any(|(_, right)| *right < -0.3), "clouds by day");
    assert!(changed.iter().all(|(out, _)| *out < 1.05));

    // Air is seen before the ground and beside it, where the sun shines.
    let airless = drawn(&textures, &lit(&options, |light| light.atmosphere = 0.0));
    let changed = changes(&picture, &airless);
    assert!(changed.iter().any(|(out, right)| *out > 1.01 && *out < 1.05 && *right < 0.0), "a rim");
    assert!(changed.iter().any(|(out, right)| *out < 0.9 && *right < 0.0), "haze");
    assert!(changed.iter().all(|(out, _)| *out < 1.3));

    // Mountains, and the sea that covers valleys.
    let changed = changes(&picture, &drawn(&textures, &lit(&options, |light| light.exaggeration = 0.0)));
    assert!(changed.len() > 500 && changed.iter().all(|(out, _)| *out < 1.1), "{}", changed.len());
    let mut dry = options.clone();
    dry.heights.zero = None;
    assert!(!changes(&picture, &drawn(&textures, &dry)).is_empty());

    // The sun shines on the other side.
    let dark = lit(&options, |light| light.night = 0.0);
    let picture = drawn(&textures, &dark);
    let turned = drawn(&textures, &lit(&dark, |light| light.sun = Some([90.0, 0.0])));
    let light = |picture: &Picture, half: usize| -> u64 {
        let rows = picture.rgba.chunks_exact(SIZE[0] as usize * 4);
        rows.flat_map(|row| &row[half * row.len() / 2..(half + 1) * row.len() / 2])
            .map(|&byte| u64::from(byte))
            .sum()
    };
    assert!(light(&picture, 0) > light(&picture, 1) * 3 / 2, "to the left");
    assert!(light(&turned, 1) > light(&turned, 0) * 3 / 2, "to the right");
}

#[test]
fn a_planet_without_sun_and_air_is_the_globe() {
    let (textures, mut options) = (textures(), options());
    options.planet = PlanetOptions {
        light: PlanetLight { sun: None, exaggeration: 0.0, atmosphere: 0.0, night: 0.0 },
        ..PlanetOptions::default()
    };
    let planet = drawn(&textures, &options);
    // The same patches, which rise by nothing.
    options.heights.scale = Some(0.0);
    options.target = Some(TargetKind::Linear);
    let globe = drawn_at(self::planet(&textures, &options, Scene::Globe), whole());
    let changed = changes(&planet, &globe);
    let inside = changed.iter().filter(|(out, _)| *out < 0.97).count();
    assert_eq!(inside, 0, "of {} pixels that differ, the others at the edge or beside it", changed.len());
}

#[test]
fn parts_may_be_left_out() {
    let (textures, all) = (textures(), options());
    let alone = DisplayOptions {
        layers: all.layers.clone(),
        planet: PlanetOptions { light: all.planet.light, ..PlanetOptions::default() },
        ..DisplayOptions::default()
    };
    let ground = drawn(&textures[..1], &alone);
    // What is there and not seen is as what is not there.
    let mut hidden = all.clone();
    hidden.heights = Heights { texture: Some(1), scale: Some(0.0), ..Heights::default() };
    for part in [&mut hidden.planet.night, &mut hidden.planet.clouds] {
        part.as_mut().unwrap().is_visible = false;
    }
    let alike = Comparison::of(&ground, &drawn(&textures, &hidden));
    assert!(alike.share_within_1_255 > 0.99, "{alike:?}");
    let mut no_night = all.clone();
    no_night.planet.night = None;
    let mut dark = all.clone();
    dark.planet.light.night = 0.0;
    let alike = Comparison::of(&drawn(&textures, &no_night), &drawn(&textures, &dark));
    assert!(alike.share_within_1_255 > 0.999, "{alike:?}");
    // A file of heights that is not there yet, and one that has no heights.
    let mut missing = all.clone();
    missing.heights.texture = Some(7);
    drawn(&textures, &missing);
    for scene in [Scene::Globe, Scene::Terrain] {
        let pose = Pose::first(scene);
        let level = DisplayOptions { planet: PlanetOptions::default(), ..missing.clone() };
        let flat = Heights { texture: Some(1), scale: Some(0.0), ..Heights::default() };
        let flat = DisplayOptions { heights: flat, ..level.clone() };
        let waiting = drawn_at(planet(&textures[..1], &level, scene), pose);
        let alike = Comparison::of(&waiting, &drawn_at(planet(&textures[..2], &flat, scene), pose));
        assert!(alike.share_within_1_255 > 0.999, "{scene:?}: {alike:?}");
        let mut high = flat.clone();
        high.heights.scale = Some(0.2);
        let alike = Comparison::of(&waiting, &drawn_at(planet(&textures[..2], &high, scene), pose));
        assert!(alike.share_within_1_255 < 0.9, "{scene:?}: {alike:?}");
    }
    let mut forgotten = missing.clone();
    forgotten.forget_textures_beside();
    let [night, clouds] = [&forgotten.planet.night, &forgotten.planet.clouds];
    assert!(night.is_none() && clouds.is_none() && forgotten.heights == Heights::default());
    assert_eq!(forgotten.layers, missing.layers);
    missing.heights = Heights { layer: Some("bumps".into()), ..Heights::default() };
    let set_up = |options: &DisplayOptions, scene| {
        let (source, settings) = (textures[0].clone(), settings(4, Filter::Trilinear));
        Offscreen::showing(options, gpu(), source, scene, SIZE, settings).map(|_| ())
    };
    assert!(matches!(set_up(&missing, Scene::Planet), Err(OffscreenError::Heights(_))));
    assert!(matches!(planet(&textures, &all, Scene::Planet).compare(), Err(OffscreenError::SeveralLayers)));
}

#[test]
fn feedback_wants_pages_of_all_textures_of_a_planet() {
    let (textures, options) = (textures(), options());
    let near = Pose::globe(0.3, 0.4, 0.2).with_aim(Aim::new(0.8, 0.7));
    let mut pictures = Vec::new();
    for feedback in [FeedbackMode::Separate, FeedbackMode::Inline] {
        let settings = Settings { feedback: Some(feedback), ..settings(16, Filter::Trilinear) };
        let mut planet = planet_by(&textures, &options, Scene::Planet, settings);
        planet.stand_at(near);
        assert!(planet.run(Path::Still, Until::Converged, |_, _| ()).unwrap().converged);
        let stats = planet.textures().stats();
        assert_eq!((stats.pools.len(), stats.pager.bias_eighths), (4, 0));
        for pool in &stats.pools {
            assert!(pool.pager.wanted > 2 && pool.pager.missing == 0, "{feedback:?}: {:?}", pool.pager);
        }
        pictures.push(planet.picture());
    }
    let alike = Comparison::of(&pictures[0], &pictures[1]);
    assert!(alike.share_within_1_255 > 0.99, "{alike:?}");
}

#[test]
fn a_planet_in_fixed_point_looks_the_same() {
    let (textures, options) = (textures(), options());
    for pose in [whole(), Pose::globe(3.0, 0.5, 0.3).with_aim(Aim::new(5.0, 0.9))] {
        let mesh = drawn_at(planet(&textures, &options, Scene::Planet), pose);
        let fixed = DisplayOptions { always_fixed: true, ..options.clone() };
        let alike = Comparison::of(&drawn_at(planet(&textures, &fixed, Scene::Planet), pose), &mesh);
        assert!(alike.psnr_db > 32.0, "{alike:?} at {pose:?}");
    }
}

/// Whatever it is made of: lavapipe crashes where what is told of the ground below the camera can be known
/// before a frame is drawn, and where that stands depends on how many textures there are.
#[test]
fn a_planet_of_any_parts_in_fixed_point_looks_the_same() {
    let (textures, all) = (textures(), options());
    let pose = Pose::globe(2.0, 0.4, 0.3).with_aim(Aim::new(0.3, 65f64.to_radians()));
    let of = |texture| Some(LayerOptions { texture, ..LayerOptions::default() });
    for (parts, has_heights) in [([None, None], true), ([Some(1), None], false), ([None, Some(1)], false)] {
        let beside = if has_heights { &textures[1..2] } else { &textures[3..] };
        let shown = [&textures[..1], beside].concat();
        let [night, clouds] = parts.map(|part| part.and_then(of));
        let heights = if has_heights { all.heights.clone() } else { Heights::default() };
        let planet = PlanetOptions { night, clouds, ..all.planet.clone() };
        let options = DisplayOptions { heights, planet, ..all.clone() };
        let fixed = DisplayOptions { always_fixed: true, ..options.clone() };
        let [mesh, fixed] =
            [options, fixed].map(|options| drawn_at(self::planet(&shown, &options, Scene::Planet), pose));
        let alike = Comparison::of(&fixed, &mesh);
        assert!(alike.psnr_db > 32.0, "{alike:?} with {parts:?}");
    }
    // Several layers over heights that are no planet's.
    let layers = vec![LayerOptions::default(), LayerOptions { opacity: 0.5, ..LayerOptions::default() }];
    let planet = PlanetOptions::default();
    let options = DisplayOptions { layers, planet, always_fixed: true, ..all };
    drawn_at(self::planet(&textures[..2], &options, Scene::Globe), pose);
}

/// From space to some metres above the ground, over all of it, in all directions.
#[test]
fn a_planet_is_drawn_from_wherever_a_camera_may_be() {
    let (textures, all) = (textures(), options());
    let options = DisplayOptions {
        planet: PlanetOptions { light: all.planet.light, ..PlanetOptions::default() },
        ..all
    };
    let mut planet = planet(&textures[..2], &options, Scene::Planet);
    let mut seed = 0x2545_f491_4f6c_dd1du64;
    let mut next = |low: f64, high: f64| {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        low + (high - low) * (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    for _ in 0..40 {
        let [longitude, latitude] = [next(-PI, PI), next(-0.5 * PI, 0.5 * PI)];
        let aim = Aim::new(next(0.0, TAU), next(0.0, 1.5));
        let pose = Pose::globe(longitude, latitude, 10f64.powf(next(-6.0, 0.5))).with_aim(aim);
        planet.stand_at(pose);
        planet.run(Path::Still, Until::Frames(3), |_, _| ()).unwrap();
    }
}

#[test]
fn a_tilted_globe_in_fixed_point_looks_the_same() {
    let textures = textures();
    let options = DisplayOptions::default();
    for aim in [Aim::new(0.0, 0.8), Aim::new(2.5, 1.2)] {
        let pose = Pose::globe(0.4, 0.3, 0.15).with_aim(aim);
        let mesh = drawn_at(planet(&textures[..1], &options, Scene::Globe), pose);
        let fixed = DisplayOptions { always_fixed: true, ..options.clone() };
        let alike = Comparison::of(&drawn_at(planet(&textures[..1], &fixed, Scene::Globe), pose), &mesh);
        assert!(alike.psnr_db > 32.0, "{alike:?} at {aim:?}");
    }
}
