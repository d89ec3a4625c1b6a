//! Surfaces with heights of any size: texels stand where f64 says, to a tenth of a pixel, from the whole to
//! 64 pixels a texel.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use vastex::source::{ReadFuture, Tile};
use vastex::{
    AddressMode, Description, Filter, Geometry, GeometrySpec, Layer, LayerFormat, PagePos, TileSource,
};
use vastex_core::Box3;
use vastex_scenes::{DisplayOptions, Heights, Offscreen, Overlay, Pose, Scene};
use vastex_tiles::Codec;
use vastex_viewer::camera::{Controller, Move};

use crate::common::{gpu, settings, settle};

const SIZE: [u32; 2] = [112, 63];
const TANGENT: f64 = 0.577_350_269_189_625_8;
/// The value that is not displaced: all ground lies above the surface without heights.
const ZERO: f32 = -5.0;

/// Ground in waves about as long as a view is wide.
struct Waves {
    description: Arc<Description>,
    texels: DVec2,
    /// Waves round the texture and from its top to its bottom.
    counts: DVec2,
    poles: Poles,
}

/// What the ground of a globe is like at its poles.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Poles {
    /// There are none.
    None,
    /// Waves end in a plain round each pole, where the pages of all meridians meet, more than are loaded,
    /// so that what is seen of heights is coarser than elsewhere.
    Plain,
    /// Each meridian comes to the pole at another height: there are so many waves round the globe.
    Several(u32),
}

impl Waves {
    /// 2^bits texels wide, for views of so many pixels a texel.
    fn new(bits: u32, magnification: f64, poles: Poles) -> Arc<Waves> {
        let (width, height) = (1 << bits, 1 << (bits - 1));
        let address = [AddressMode::Wrap, AddressMode::Clamp, AddressMode::Clamp];
        let spec = GeometrySpec { page: 128, address, ..GeometrySpec::image(width, height) };
        let geometry = Geometry::new(spec).unwrap();
        let layers =
            vec![Layer::new("color", LayerFormat::Rgba8), Layer::new("height", LayerFormat::R32Float)];
        let description = Description { layers, ..Description::one_layer(geometry, LayerFormat::Rgba8) };
        let texels = DVec2::new(width.into(), height.into());
        let length = (f64::from(SIZE[0]) / magnification).max(16.0);
        let mut counts = (texels / length).round().max(DVec2::ONE);
        if let Poles::Several(around) = poles {
            counts.x = around.into();
        }
        Arc::new(Waves { description: Arc::new(description), texels, counts, poles })
    }

    /// The value at a place in texels of level 0, 0 to 1.
    fn value(&self, place: DVec2) -> f64 {
        let turns = place / self.texels * self.counts;
        let from_pole = (place.y / self.texels.y * PI).sin().powi(2);
        let [along, around] = match self.poles {
            Poles::None => [1.0, 1.0],
            Poles::Plain => [from_pole, from_pole],
            Poles::Several(_) => [from_pole, 1.0],
        };
        0.5 + 0.25 * (along * (TAU * turns.y.fract()).sin() + around * (TAU * turns.x.fract() + 0.7).sin())
    }

    /// The value of the surface of a globe at a place, where it is drawn at a level: that of the texels,
    /// but that within half a texel of a pole heights go straight to the mean of those round it, which is
    /// 0.5.
    fn on_globe(&self, place: DVec2, level: f64) -> f64 {
        let from_pole = place.y.min(self.texels.y - place.y).max(0.0);
        let share = (from_pole * (1.0 - level.max(0.0)).exp2()).min(1.0);
        0.5 + (self.value(place) - 0.5) * share
    }

    /// The level at which what is so far from the camera is drawn, on a globe in a picture of [`SIZE`]:
    /// that whose texels are as far apart as vertices, of which 16 lie along a patch, which is drawn from
    /// 4.25 of its diagonals on.
    fn level(&self, distance: f64) -> f64 {
        let patch = 4.25 * (2.0 * PI * PI).sqrt() / 0.5;
        (2.0 / (16.0 * patch) * self.texels.x * distance).log2()
    }

    fn fill(&self, level: u8, level_box: Box3, offset: [u32; 3], tile: &mut [u8]) {
        let geometry = &self.description.geometry;
        for (y, x) in (0..level_box.size[1]).flat_map(|y| (0..level_box.size[0]).map(move |x| (y, x))) {
            let texel = std::array::from_fn(|a| level_box.origin[a] + i64::from([x, y, 0][a]));
            let [u, v, _] = geometry.fold_texel(level, texel);
            let middle = (DVec2::new(u.into(), v.into()) + 0.5) * f64::from(level).exp2();
            let height = self.value(middle) as f32;
            let texel = (offset[1] + y) * geometry.tile()[0] + offset[0] + x;
            let shade = if (u + v) % 2 == 0 { 150 } else { 110 };
            let of_height = height.to_le_bytes();
            for (index, bytes) in [[shade, shade, shade, 255], of_height].into_iter().enumerate() {
                let at = self.description.layer_range(index).start + texel as usize * bytes.len();
                tile[at..at + bytes.len()].copy_from_slice(&bytes);
            }
        }
    }
}

impl TileSource for Waves {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let (geometry, mut tile) = (&self.description.geometry, vec![0; self.description.tile_bytes()]);
        match geometry.is_tail(pos) {
            true => (geometry.tail().first_level()..=geometry.coarsest()).for_each(|level| {
                let (of_level, offset) = (geometry.level_box_of_tail(level), geometry.tail().offset(level));
                self.fill(level, of_level, offset, &mut tile);
            }),
            false => self.fill(pos.level, geometry.level_box_of_tile(pos), [0; 3], &mut tile),
        }
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes: tile.into() }) })
    }
}

/// A scene, and how high a value of 1 rises on it in the world.
fn scene(source: &Arc<Waves>, scene: Scene, scale: f64) -> Offscreen {
    // Of a terrain scales are told in its widths, which are 2.
    let told = if scene == Scene::Terrain { scale / 2.0 } else { scale };
    let heights = Heights { scale: Some(told as f32), zero: Some(ZERO), ..Heights::default() };
    let shown = DisplayOptions { heights, always_fixed: true, ..DisplayOptions::default() };
    Offscreen::showing(&shown, gpu(), source.clone(), scene, SIZE, settings(16, Filter::Trilinear)).unwrap()
}

/// From all of it to 64 pixels a texel.
fn magnifications(texels: f64, count: u32) -> impl Iterator<Item = f64> {
    let whole = f64::from(SIZE[0]) / texels;
    (0..count).map(move |n| whole * (64.0 / whole).powf(f64::from(n) / f64::from(count - 1)))
}

fn pixels() -> impl Iterator<Item = DVec2> {
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| DVec2::new(x.into(), y.into()) + 0.5))
}

fn on_screen(right: f64, up: f64, forward: f64) -> DVec2 {
    let [width, height] = SIZE.map(f64::from);
    let seen = DVec2::new(right, -up) / forward / TANGENT * height / 2.0;
    DVec2::new(width, height) / 2.0 + seen
}

/// Where a place of the globe is in the picture, in pixels, and how steeply it is seen: 1 from straight
/// above.
fn of_globe(source: &Waves, pose: &Pose, scale: f64, place: DVec2) -> (DVec2, f64) {
    let Pose::Globe { longitude: lon, latitude: lat, altitude, .. } = *pose else { panic!("{pose:?}") };
    let texels = source.texels;
    let (longitude, latitude) = ((place.x / texels.x - 0.5) * TAU, (0.5 - place.y / texels.y) * PI);
    // East, north and up from the ground below the camera, by half angles so that of small ones nothing is
    // lost.
    let east = (longitude - lon + PI).rem_euclid(TAU) - PI;
    let versed = 2.0 * (east / 2.0).sin().powi(2);
    let (half_sum, half) = ((latitude + lat) / 2.0, (latitude - lat) / 2.0);
    let chord = DVec2::new(-2.0 * half_sum.sin() * half.sin(), 2.0 * half_sum.cos() * half.sin()); // of cosine and sine
    let point = DVec3::new(
        latitude.cos() * east.sin(),
        chord.y * lat.cos() - chord.x * lat.sin() + latitude.cos() * versed * lat.sin(),
        chord.x * lat.cos() + chord.y * lat.sin() - latitude.cos() * versed * lat.cos(),
    );
    let below = DVec2::new((lon / TAU + 0.5).rem_euclid(1.0), 0.5 - lat / PI) * texels;
    let away = (point - DVec3::Z * altitude).length();
    let here = source.on_globe(place, source.level(away)) * scale;
    let there = source.on_globe(below, source.level(altitude)) * scale;
    let lift = here - f64::from(ZERO) * scale;
    let from_camera = point * (1.0 + lift) + DVec3::Z * (here - there - altitude);
    let steepness = -(point + DVec3::Z).dot(from_camera.normalize());
    (on_screen(from_camera.x, from_camera.y, -from_camera.z), steepness)
}

/// By how many pixels texels stand beside their places in the picture of a globe, at most; its rim left out,
/// where a texel is as long as one likes.
fn error_on_globe(offscreen: &mut Offscreen, source: &Waves, pose: &Pose, scale: f64) -> f64 {
    assert!(offscreen.is_in_fixed_point(pose));
    settle(offscreen, *pose);
    let (mut worst, mut seen) = (0f64, 0);
    for (at, place) in pixels().zip(offscreen.places(pose)) {
        let Some(place) = place else { continue };
        let (expected, steepness) = of_globe(source, pose, scale, place);
        if steepness > 0.3 {
            worst = worst.max((expected - at).length());
            seen += 1;
        }
    }
    assert!(seen > 1000, "{pose:?}: {seen}");
    worst
}

/// Of a globe that is so large.
fn altitude(texels: f64, magnification: f64) -> f64 {
    f64::from(SIZE[1]) / (2.0 * TANGENT * magnification * texels / TAU)
}

/// From the whole to 64 pixels a texel, at one place after another: at the date line and elsewhere, and at
/// and near both poles, to which meridians come at one height or at several. On the smaller globe one place
/// at each size of a texel stands for both.
#[test]
fn texels_of_a_globe_with_heights_stand_where_they_should() {
    for (bits, count) in [(12, 2), (31, 4)] {
        let texels = 2f64.powi(bits);
        for (n, magnification) in magnifications(texels, count).enumerate() {
            let altitude = altitude(texels, magnification);
            let scale = 0.05 * altitude;
            let beside_pole = FRAC_PI_2 - (0.2 * altitude).min(1e-3);
            let at_pole = FRAC_PI_2 - 1e-9;
            let plain = [(PI - 1e-9, -0.2), (-2.5, beside_pole), (0.3, 0.7), (2.0, -at_pole)][n % 4];
            let several = [(1.0, at_pole), (2.0, -beside_pole), (3.0, -at_pole), (-2.5, beside_pole)][n % 4];
            let of_both = [(Poles::Plain, plain), (Poles::Several(2), several)];
            let shown = if bits == 31 { &of_both[..] } else { &of_both[n % 2..][..1] };
            for &(poles, (longitude, latitude)) in shown {
                let source = Waves::new(bits as u32, magnification, poles);
                let mut offscreen = scene(&source, Scene::Globe, scale);
                let pose = Pose::globe(longitude, latitude, altitude);
                let error = error_on_globe(&mut offscreen, &source, &pose, scale);
                assert!(
                    error < 0.1,
                    "2^{bits} at {magnification} pixels a texel, {poles:?}, {pose:?}: {error}"
                );
            }
        }
    }
}

/// Where a place of the terrain is in the picture, in pixels.
fn of_terrain(source: &Waves, pose: &Pose, scale: f64, place: DVec2) -> DVec2 {
    let Pose::Plane { eye, yaw, pitch } = *pose else { panic!("{pose:?}") };
    let unit = source.texels.x / 2.0;
    let below = DVec2::new(eye.x + 1.0, 0.5 - eye.y) * unit;
    let rise = (source.value(place) - source.value(below)) * scale;
    let offset = (place - below) / unit;
    let from_camera = DVec3::new(offset.x, -offset.y, rise - eye.z);
    let forward = DVec3::new(-yaw.sin() * pitch.cos(), yaw.cos() * pitch.cos(), -pitch.sin());
    let right = DVec3::new(yaw.cos(), yaw.sin(), 0.0);
    let up = right.cross(forward);
    on_screen(from_camera.dot(right), from_camera.dot(up), from_camera.dot(forward))
}

#[test]
fn texels_of_a_terrain_stand_where_they_should() {
    for (bits, count) in [(12, 2), (31, 3)] {
        let texels = 2f64.powi(bits);
        for magnification in magnifications(texels, count) {
            let source = Waves::new(bits as u32, magnification, Poles::None);
            let above = f64::from(SIZE[1]) / (TANGENT * magnification * texels);
            let scale = 0.05 * above;
            let mut offscreen = scene(&source, Scene::Terrain, scale);
            for (x, y, yaw, pitch) in [(0.123_456_789, -0.2, 0.3, 1.3), (-0.7, 0.4, -2.0, 1.0)] {
                let pose = Pose::Plane { eye: DVec3::new(x, y, above), yaw, pitch };
                assert!(offscreen.is_in_fixed_point(&pose));
                settle(&mut offscreen, pose);
                let (mut worst, mut seen) = (0f64, 0);
                for (at, place) in pixels().zip(offscreen.places(&pose)) {
                    let Some(place) = place else { continue };
                    worst = worst.max((of_terrain(&source, &pose, scale, place) - at).length());
                    seen += 1;
                }
                assert!(
                    worst < 0.1 && seen > 1000,
                    "2^{bits} at {magnification}, {pose:?}: {worst} of {seen}"
                );
            }
        }
    }
}

/// After 10,000 small pans near the date line, and round a pole, texels stand where they should, overlays
/// cover what the picture covers, nothing that is in view is missing, and there is no hole.
#[test]
fn a_globe_with_heights_stands_still_after_many_pans() {
    let (texels, pan) = (2f64.powi(31), 0.013);
    let altitude = altitude(texels, 64.0);
    let scale = 0.05 * altitude;
    let view = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let moved = |longitude: f64, latitude: f64| {
        let mut camera = Controller::new(Pose::globe(longitude, latitude, altitude));
        (0..10_000).for_each(|_| camera.apply(Move::Drag(DVec2::new(-pan, 0.0)), [view, 2.0]));
        camera.pose()
    };
    let at_date_line = (PI - 1e-8, 0.1, Poles::Plain);
    for (longitude, latitude, poles) in [at_date_line, (0.5, FRAC_PI_2 - 1e-9, Poles::Several(2))] {
        let (source, pose) = (Waves::new(31, 64.0, poles), moved(longitude, latitude));
        let mut offscreen = scene(&source, Scene::Globe, scale);
        let error = error_on_globe(&mut offscreen, &source, &pose, scale);
        assert!(error < 0.1, "{pose:?}: {error}");
        let picture = offscreen.picture();
        assert!(picture.rgba.chunks_exact(4).all(|pixel| pixel[3] == 255), "there is no hole");
        if poles == Poles::Plain {
            assert!(offscreen.share_at_wanted_level().unwrap() > 0.999);
            let deficit = offscreen.overlay(Overlay::Deficit).unwrap();
            let is_green = |pixel: &[u8]| pixel[1] > pixel[0] && pixel[1] > pixel[2];
            let green = deficit.rgba.chunks_exact(4).filter(|pixel| is_green(pixel)).count();
            assert!(green * 1000 >= picture.rgba.len() / 4 * 999, "{green}");
            assert_ne!(offscreen.overlay(Overlay::Levels).unwrap(), picture);
        }
    }
}
