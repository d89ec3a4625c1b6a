//! What is stored below a pixel, and which values are in view: on every surface those of the texels that a
//! camera sees there, as f64 has it.

use std::f64::consts::{PI, TAU};
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use glam::{DMat3, DVec2, DVec3};
use vastex::source::ReadFuture;
use vastex::{
    AddressMode, Description, Filter, Geometry, GeometrySpec, Layer, LayerFormat, PagePos, Region,
    TileSource, Urgency,
};
use vastex_core::{Box3, Dims};
use vastex_scenes::{DisplayOptions, Heights, Offscreen, PlanetLight, PlanetOptions, Pose, Scene};
use vastex_tiles::PropertySource;
use vastex_viewer::camera::{Aim, Controller, Move};
use vastex_viewer::inspect::{Histogram, texel_at};

use crate::common::{Tiles, gpu, settings};

pub(crate) const SIZE: [u32; 2] = [1024, 512];
const PICTURE: [u32; 2] = [192, 120];
/// Of half the view's height.
const TANGENT: f64 = 0.577_350_269_189_625_8;

/// Colours that say which texel they are of, and heights of hills beside them.
pub(crate) struct Ground {
    description: Arc<Description>,
    tiles: Tiles,
}

impl Ground {
    /// The only one there is: all tests draw the same.
    pub(crate) fn new() -> Arc<Ground> {
        static GROUND: LazyLock<Arc<Ground>> = LazyLock::new(Ground::make);
        GROUND.clone()
    }

    fn make() -> Arc<Ground> {
        let address = [AddressMode::Wrap, AddressMode::Clamp, AddressMode::Clamp];
        let spec = GeometrySpec { page: 64, address, ..GeometrySpec::image(SIZE[0], SIZE[1]) };
        let geometry = Geometry::new(spec).unwrap();
        let layers = vec![Layer::new("color", LayerFormat::Rgba8), Layer::new("height", LayerFormat::R16)];
        let description = Description { layers, ..Description::one_layer(geometry, LayerFormat::Rgba8) };
        Arc::new(Ground { description: Arc::new(description), tiles: Tiles::default() })
    }

    /// Hills some tens of texels long, flat at the poles, where all meridians meet.
    fn height(place: DVec2) -> f64 {
        let [turns, down] = (place / DVec2::from(SIZE.map(f64::from))).to_array();
        let flat = (down * PI).sin();
        0.5 + 0.22 * flat * flat * ((TAU * 16.0 * turns).sin() + (TAU * 9.0 * down + 0.7).cos())
    }

    fn fill(&self, level: u8, level_box: Box3, offset: [u32; 3], tile: &mut [u8]) {
        let geometry = &self.description.geometry;
        for (y, x) in (0..level_box.size[1]).flat_map(|y| (0..level_box.size[0]).map(move |x| (y, x))) {
            let texel = std::array::from_fn(|a| level_box.origin[a] + i64::from([x, y, 0][a]));
            let inside = geometry.fold_texel(level, texel);
            let middle = (DVec2::new(inside[0].into(), inside[1].into()) + 0.5) * f64::from(1 << level);
            let height = ((Ground::height(middle) * 65535.0).round() as u16).to_le_bytes();
            let color = PropertySource::color_from_texel(Dims::D2, level, inside);
            let texel = ((offset[1] + y) * geometry.tile()[0] + offset[0] + x) as usize;
            for (index, bytes) in [&color[..], &height[..]].into_iter().enumerate() {
                let at = self.description.layer_range(index).start + texel * bytes.len();
                tile[at..at + bytes.len()].copy_from_slice(bytes);
            }
        }
    }
}

impl TileSource for Ground {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let tile = self.tiles.get(pos, || {
            let mut tile = vec![0; self.description.tile_bytes()];
            for (level, level_box, offset) in self.description.geometry.tile_boxes(pos) {
                self.fill(level, level_box, offset, &mut tile);
            }
            tile
        });
        Box::pin(async move { Ok(tile) })
    }
}

/// A scene with every page of the texture in memory.
fn loaded(scene: Scene, options: &DisplayOptions, pose: Pose) -> Offscreen {
    let settings = settings(32, Filter::Trilinear);
    let mut offscreen = Offscreen::showing(options, gpu(), Ground::new(), scene, PICTURE, settings).unwrap();
    let texture = offscreen.renderer().layer().texture();
    let textures = offscreen.textures_mut();
    let ticket = textures.ahead().prefetch(texture, &Region::whole(), Urgency::default()).unwrap();
    textures.finish(&ticket, Duration::from_secs(60)).unwrap();
    look(&mut offscreen, pose);
    offscreen
}

/// Looks from a pose: every page is in memory, so nothing has to come.
pub(crate) fn look(offscreen: &mut Offscreen, pose: Pose) {
    for _ in 0..2 {
        offscreen.frame(pose).unwrap();
    }
}

/// Where a camera is, and its directions to the right, upwards and ahead.
fn camera(pose: &Pose) -> (DVec3, DMat3) {
    match *pose {
        Pose::Globe { longitude, latitude, altitude, aim } => {
            let ((sin_lon, cos_lon), (sin_lat, cos_lat)) = (longitude.sin_cos(), latitude.sin_cos());
            let up = DVec3::new(cos_lon * cos_lat, sin_lon * cos_lat, sin_lat);
            let (east, north) = (
                DVec3::new(-sin_lon, cos_lon, 0.0),
                DVec3::new(-cos_lon * sin_lat, -sin_lon * sin_lat, cos_lat),
            );
            let along = east * aim.heading().sin() + north * aim.heading().cos();
            let ahead = along * aim.tilt().sin() - up * aim.tilt().cos();
            let above = along * aim.tilt().cos() + up * aim.tilt().sin();
            (up * (1.0 + altitude), DMat3::from_cols(ahead.cross(above), above, ahead))
        }
        Pose::Plane { eye, yaw, pitch } => {
            let ahead = DVec3::new(-yaw.sin() * pitch.cos(), yaw.cos() * pitch.cos(), -pitch.sin());
            let right = DVec3::new(yaw.cos(), yaw.sin(), 0.0);
            (eye, DMat3::from_cols(right, right.cross(ahead), ahead))
        }
        Pose::Image { .. } => panic!("an image is seen without perspective"),
    }
}

/// Where a texel's middle is on a surface, in the world, and the direction upwards there.
fn on_surface(scene: Scene, place: DVec2) -> (DVec3, DVec3) {
    let uv = place / DVec2::from(SIZE.map(f64::from));
    if scene.is_round() {
        let (longitude, latitude) = ((uv.x - 0.5) * TAU, (0.5 - uv.y) * PI);
        let up =
            DVec3::new(longitude.cos() * latitude.cos(), longitude.sin() * latitude.cos(), latitude.sin());
        return (up, up);
    }
    (DVec3::new(2.0 * uv.x - 1.0, 0.5 - uv.y, 0.0), DVec3::Z)
}

/// Where a pixel sees a place of a surface, and how far ahead that is; `None` if it does not.
fn seen(pose: &Pose, scene: Scene, place: DVec2) -> Option<(DVec2, f64)> {
    seen_in(PICTURE, pose, scene, place)
}

/// The same in a picture of so many pixels.
pub(crate) fn seen_in(size: [u32; 2], pose: &Pose, scene: Scene, place: DVec2) -> Option<(DVec2, f64)> {
    let picture = DVec2::from(size.map(f64::from));
    let (pixel, ahead) = match pose.placement(size, SIZE) {
        Some(placed) => (placed.pixel(place), placed.scale.recip()),
        None => {
            let ((eye, axes), (point, up)) = (camera(pose), on_surface(scene, place));
            let from_eye = axes.transpose() * (point - eye);
            if from_eye.z <= 0.0 || up.dot((eye - point).normalize()) < 0.02 {
                return None;
            }
            let at = from_eye.truncate() / from_eye.z / TANGENT * picture.y / 2.0;
            (picture / 2.0 + at * DVec2::new(1.0, -1.0), from_eye.z)
        }
    };
    let is_within = pixel.cmpge(DVec2::ZERO).all() && pixel.cmplt(picture).all();
    is_within.then_some((pixel, ahead))
}

/// The level of level-0 texels that are seen so far ahead.
fn level_seen(pose: &Pose, scene: Scene, ahead: f64, coarser: f64) -> u8 {
    let texels_a_pixel = match pose {
        Pose::Image { .. } => ahead,
        _ if scene.is_round() => ahead * 2.0 * TANGENT / f64::from(PICTURE[1]) * f64::from(SIZE[0]) / TAU,
        _ => ahead * 2.0 * TANGENT / f64::from(PICTURE[1]) * f64::from(SIZE[0]) / 2.0,
    };
    (texels_a_pixel * coarser).log2().floor().max(0.0) as u8
}

fn color_of(level: u8, [x, y]: [u32; 2]) -> [u8; 4] {
    PropertySource::color_from_texel(Dims::D2, level, [x >> level, y >> level, 0])
}

fn scenes() -> Vec<(Scene, Vec<Pose>)> {
    let plane = |x, y, z, yaw, pitch| Pose::Plane { eye: DVec3::new(x, y, z), yaw, pitch };
    vec![
        (Scene::Image, vec![Pose::first(Scene::Image), Pose::image(DVec2::new(0.3, 0.7), 9.0)]),
        (
            Scene::Plane,
            vec![Pose::first(Scene::Plane), plane(0.2, -0.1, 0.02, 0.6, 0.3), plane(0.0, 0.0, 1.2, 0.0, 1.5)],
        ),
        (
            Scene::Globe,
            vec![
                Pose::first(Scene::Globe),
                Pose::globe(PI - 0.01, 0.2, 0.05), // over the date line
                Pose::globe(0.4, 1.53, 0.4),       // and a pole
                Pose::globe(2.0, -0.4, 0.02).with_aim(Aim::new(4.0, 1.2)),
            ],
        ),
    ]
}

#[test]
fn the_value_below_a_pixel_is_that_of_the_texel_that_is_seen_there() {
    for (scene, poses) in scenes() {
        let mut offscreen = loaded(scene, &DisplayOptions::default(), poses[0]);
        for pose in poses {
            look(&mut offscreen, pose);
            let (textures, renderer) = (offscreen.textures(), offscreen.renderer());
            let asked = (renderer, renderer.layer());
            let mut count = 0;
            for (y, x) in (0..SIZE[1]).step_by(5).flat_map(|y| (0..SIZE[0]).step_by(7).map(move |x| (y, x))) {
                let place = DVec2::new(x.into(), y.into()) + 0.5;
                let Some((pixel, ahead)) = seen(&pose, scene, place) else { continue };
                let found = texel_at(textures, asked, &pose, (PICTURE, SIZE), pixel);
                let found = found.unwrap_or_else(|| panic!("{scene:?} {pose:?}: nothing at {pixel}"));
                let level = level_seen(&pose, scene, ahead, 1.0);
                assert_eq!((found.texel, found.level), ([x, y], level), "{scene:?} {pose:?} at {pixel}");
                let color = color_of(level, [x, y]).map(f64::from);
                let channels = if level == 0 { 3 } else { 4 };
                assert_eq!(found.values, color[..channels], "{scene:?} {pose:?} at {pixel}");
                // The same of an image of which the texture is a preview of half its size.
                let whole = texel_at(textures, asked, &pose, (PICTURE, SIZE.map(|side| 2 * side)), pixel);
                let whole = whole.unwrap();
                assert_eq!(whole.texel.map(|at| at / 2), [x, y]);
                assert_eq!(whole.level, level + 1);
                count += 1;
            }
            assert!(count > 5, "{scene:?} {pose:?}: {count} texels are seen");
        }
        let beside: &[(f64, f64)] = match scene {
            // Above and beside an image, above a horizon, beside a globe.
            Scene::Image => &[(-1.0, 60.0), (96.0, 1.0)],
            Scene::Plane => &[(96.0, 1.0)],
            _ => &[(2.0, 2.0), (190.0, 118.0)],
        };
        let pose = if scene == Scene::Plane {
            Pose::Plane { eye: DVec3::new(0.0, -0.4, 0.2), yaw: 0.0, pitch: 0.2 }
        } else {
            Pose::first(scene)
        };
        let (textures, renderer) = (offscreen.textures(), offscreen.renderer());
        for &(x, y) in beside {
            let asked = (renderer, renderer.layer());
            let found = texel_at(textures, asked, &pose, (PICTURE, SIZE), DVec2::new(x, y));
            assert_eq!(found, None, "{scene:?} at {x},{y}");
        }
    }
}

pub(crate) fn with_heights(scale: f32) -> DisplayOptions {
    let heights = Heights { scale: Some(scale), zero: Some(0.1), ..Heights::default() };
    let light = PlanetLight { exaggeration: 3.0, ..PlanetLight::default() };
    let planet = PlanetOptions { light, ..PlanetOptions::default() };
    DisplayOptions { heights, planet, ..DisplayOptions::default() }
}

/// Over heights the oracle is what is drawn: the place that each pixel of the picture has, by the shaders.
#[test]
fn over_heights_the_place_below_a_pixel_is_the_one_that_is_drawn_there() {
    let plane = |x, y, z, yaw, pitch| Pose::Plane { eye: DVec3::new(x, y, z), yaw, pitch };
    let globes = [
        Pose::first(Scene::Globe),
        Pose::globe(PI - 0.01, 0.2, 0.15).with_aim(Aim::new(1.0, 1.1)),
        Pose::globe(0.1, -0.5, 0.004).with_aim(Aim::new(5.0, 1.2)),
    ];
    let terrains = [
        Pose::first(Scene::Terrain),
        plane(0.2, -0.1, 0.03, 0.6, 0.25),
        plane(0.1, 0.0, 0.9, 0.0, 1.5),
        plane(-1.1, 0.1, 0.02, -1.4, 0.1),
    ];
    for (scene, scale, poses) in [
        (Scene::Terrain, 0.06, &terrains[..]),
        (Scene::Globe, 0.08, &globes[..]),
        (Scene::Planet, 0.03, &globes[..2]),
    ] {
        let mut offscreen = loaded(scene, &with_heights(scale), poses[0]);
        for (n, &pose) in poses.iter().enumerate() {
            look(&mut offscreen, pose);
            let drawn = offscreen.places(&pose);
            let (textures, renderer) = (offscreen.textures(), offscreen.renderer());
            let mut sight = renderer.sight(textures, &pose, (PICTURE, SIZE));
            let width = PICTURE[0] as usize;
            // How far apart two places are, round the globe the shorter way.
            let apart = |a: DVec2, b: DVec2| {
                let way = (a - b).abs();
                let turn = f64::from(SIZE[0]);
                way.with_x(if scene.is_round() { way.x.min(turn - way.x) } else { way.x }).length()
            };
            let (mut covered, mut other_cover, mut far, mut worst) = (0, 0, 0, 0.0_f64);
            // One pixel of a square of four.
            let is_asked = |at: usize| at.is_multiple_of(2) && (at / width).is_multiple_of(2);
            for (at, place) in drawn.iter().enumerate().filter(|(at, _)| is_asked(*at)) {
                let pixel = DVec2::new((at % width) as f64, (at / width) as f64) + 0.5;
                let found = sight.at(pixel).map(|seen| seen.texel);
                covered += usize::from(place.is_some());
                other_cover += usize::from(place.is_some() != found.is_some());
                let (Some(place), Some(found)) = (place, found) else { continue };
                let beside = [at + 1, at + width].map(|n| drawn.get(n).copied().flatten());
                let pixel =
                    beside.into_iter().flatten().map(|beside| apart(*place, beside)).fold(0.0, f64::max);
                let off = apart(*place, found) / (pixel + 0.25);
                worst = worst.max(off);
                far += usize::from(off > 1.5);
            }
            let what = format!(
                "{scene:?} {pose:?}: {far} of {covered} are elsewhere, by {worst} pixels at most; of \
                 {other_cover} one is beside"
            );
            assert!(covered > 500, "{what}");
            // Along outlines either side may be seen: of those there are many where the ground is seen from
            // beside its edge.
            let few = if scene == Scene::Terrain && n == 3 { 20 } else { 50 };
            assert!(far * 50 <= covered && other_cover * few <= covered, "{what}");
            // And what is stored there is told.
            let asked = (renderer, renderer.layer());
            let pixels = (0..drawn.len())
                .step_by(1001)
                .map(|at| DVec2::new((at % width) as f64, (at / width) as f64) + 0.5);
            let mut values =
                pixels.filter_map(|pixel| texel_at(textures, asked, &pose, (PICTURE, SIZE), pixel));
            let found = values.nth(1).unwrap();
            let color = color_of(found.level, found.texel).map(f64::from);
            assert_eq!(found.values[..3], color[..3], "{what}");
        }
    }
}

/// Counted without the viewer: a ray through the middle of each of 128x72 parts of the picture, where it
/// meets the sphere, and the texel there.
#[test]
fn the_histogram_of_a_globe_is_that_of_what_is_seen_of_it() {
    for pose in [Pose::first(Scene::Globe), Pose::globe(PI - 0.1, 0.9, 0.3).with_aim(Aim::new(2.0, 0.7))] {
        let offscreen = loaded(Scene::Globe, &DisplayOptions::default(), pose);
        let (textures, renderer) = (offscreen.textures(), offscreen.renderer());
        let map = renderer.color_map();
        let asked = (renderer.layer(), &map);
        let found = Histogram::of_view(textures, renderer, asked, &pose, (PICTURE, SIZE), None).unwrap();

        let mut counts = [[0usize; 256]; 3];
        let (eye, axes) = camera(&pose);
        let places = DVec2::new(128.0, 72.0);
        let picture = DVec2::from(PICTURE.map(f64::from));
        let pixels_a_place = (picture / places).min_element();
        for (row, column) in (0..72u32).flat_map(|row| (0..128u32).map(move |column| (row, column))) {
            let pixel = (DVec2::new(column.into(), row.into()) + 0.5) / places * picture;
            let at = (pixel - picture / 2.0) / (picture.y / 2.0) * TANGENT;
            let ray = axes * DVec3::new(at.x, -at.y, 1.0);
            let (a, b, c) = (ray.length_squared(), ray.dot(eye), eye.length_squared() - 1.0);
            let root = b * b - a * c;
            if root < 0.0 {
                continue;
            }
            let ahead = (-b - root.sqrt()) / a;
            let point = eye + ray * ahead;
            let uv = DVec2::new(point.y.atan2(point.x) / TAU + 0.5, 0.5 - point.z.asin() / PI);
            let texel = (uv * DVec2::from(SIZE.map(f64::from))).floor();
            let level = level_seen(&pose, Scene::Globe, ahead, pixels_a_place / 4.0);
            let color = color_of(level, [texel.x as u32, texel.y as u32]);
            (0..3).for_each(|channel| counts[channel][usize::from(color[channel])] += 1);
        }
        let edges: Vec<f32> = (0..=256).map(|n| (n as f32 - 0.5) / 255.0).collect();
        assert!(counts[0].iter().sum::<usize>() > 3000);
        for (channel, counts) in counts.iter().enumerate() {
            assert_eq!(found.counts(channel, &edges), counts, "{pose:?}: channel {channel}");
        }
    }
    // Heights are looked for along rays; what is beside the ground counts nothing.
    let pose = Pose::first(Scene::Terrain);
    let offscreen = loaded(Scene::Terrain, &with_heights(0.06), pose);
    let (textures, renderer) = (offscreen.textures(), offscreen.renderer());
    let height = textures.texture(renderer.layer().texture()).unwrap().layer("height").unwrap();
    let map = vastex_scenes::ColorMap::new(&Layer::new("height", LayerFormat::R16), None);
    let found = Histogram::of_view(textures, renderer, (height, &map), &pose, (PICTURE, SIZE), None).unwrap();
    let mut expected: Vec<f64> = offscreen.places(&pose).into_iter().flatten().map(Ground::height).collect();
    expected.sort_unstable_by(f64::total_cmp);
    for share in [0.1, 0.5, 0.9] {
        let [at, _] = found.between(share, share).unwrap();
        let expected = expected[(share * expected.len() as f64) as usize];
        assert!((f64::from(at) - expected).abs() < 0.04, "{share}: {at} for {expected}");
    }
    let counted: usize = found.counts(0, &[0.0, 2.0]).iter().sum();
    assert!((500..2304).contains(&counted), "{counted} of 64x36");
}

/// What is drawn under the pointer says whether a mountain stays there: its texel before the camera moves and
/// after it.
#[test]
fn over_heights_what_is_seen_stays_under_the_pointer() {
    let plane = |x, y, z, yaw, pitch| Pose::Plane { eye: DVec3::new(x, y, z), yaw, pitch };
    for (scene, scale, pose) in [
        (Scene::Terrain, 0.12, plane(0.2, -0.4, 0.08, 0.3, 0.35)),
        (Scene::Globe, 0.08, Pose::globe(PI - 0.01, 0.2, 0.15).with_aim(Aim::new(1.0, 0.9))),
        (Scene::Planet, 0.03, Pose::globe(0.3, 0.2, 0.2).with_aim(Aim::new(4.0, 0.8))),
    ] {
        let mut offscreen = loaded(scene, &with_heights(scale), pose);
        let size = DVec2::from(PICTURE.map(f64::from));
        let aspects = [size.x / size.y, offscreen.renderer().image_aspect()];
        let (from, to) = (DVec2::new(60.5, 70.5), DVec2::new(80.5, 85.5));
        let point = |pixel: DVec2| (pixel - 0.5 * size) / size.y;
        let drawn_at = |offscreen: &Offscreen, pose: &Pose, pixel: DVec2| {
            offscreen.places(pose)[pixel.y as usize * PICTURE[0] as usize + pixel.x as usize].unwrap()
        };
        let held = drawn_at(&offscreen, &pose, from);
        let mut camera = Controller::new(pose);
        let mut moved = |offscreen: &mut Offscreen, moved: Move| {
            let heights = offscreen.renderer().heights(offscreen.textures(), PICTURE);
            let mut heights = heights.expect("the scene has heights");
            camera.apply_over(moved, aspects, Some(&mut heights));
            let pose = camera.pose();
            look(offscreen, pose);
            pose
        };
        for (what, pixel, step) in [
            ("dragged", to, Move::Grab(point(from), point(to))),
            ("zoomed in", to, Move::ZoomTo(1.6, point(to))),
            ("zoomed out", to, Move::ZoomTo(0.7, point(to))),
        ] {
            let pose = moved(&mut offscreen, step);
            let [here, right, below] =
                [DVec2::ZERO, DVec2::X, DVec2::Y].map(|beside| drawn_at(&offscreen, &pose, pixel + beside));
            // Levels blend as the camera comes nearer, and the surface moves with that by a little.
            let pixels = here.distance(held) / here.distance(right).max(here.distance(below));
            assert!(pixels < 2.0, "{scene:?} {what}: {pixels} pixels, at {here}, where {held} was");
        }
        // As if the ground were level it would not, but where it is as high as below the camera.
        let mut worst = 0.0_f64;
        for pixel in [from, DVec2::new(30.5, 60.5), DVec2::new(100.5, 90.5), DVec2::new(150.5, 75.5)] {
            look(&mut offscreen, pose);
            let held = drawn_at(&offscreen, &pose, pixel);
            let mut level = Controller::new(pose);
            level.apply(Move::ZoomTo(2.0, point(pixel)), aspects);
            look(&mut offscreen, level.pose());
            let [here, right] =
                [DVec2::ZERO, DVec2::X].map(|beside| drawn_at(&offscreen, &level.pose(), pixel + beside));
            worst = worst.max(here.distance(held) / here.distance(right));
        }
        assert!(worst > 3.0, "{scene:?}: {worst} pixels");
    }
}
