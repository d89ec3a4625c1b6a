//! Surfaces displaced by heights: no cracks, light as the slopes say, colours as from an ordinary texture, a
//! camera above the ground.

use std::f64::consts::PI;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{Vec2, Vec3};
use vastex::source::{ReadFuture, Tile};
use vastex::{
    AddressMode, Description, FeedbackMode, Filter, Geometry, GeometrySpec, Layer, LayerFormat, PagePos,
    Settings, TileSource,
};
use vastex_core::Box3;
use vastex_scenes::{
    Comparison, DisplayOptions, Heights, HeightsError, Offscreen, OffscreenError, Overlay, Picture, Pose,
    Scene,
};
use vastex_tiles::Codec;

use crate::common::{Tiles, gpu, settings};
use crate::pictures::assert_alike;

const SIZE: [u32; 2] = [1024, 512];
const PICTURE: [u32; 2] = [240, 136];

/// A colour and a height; the value of the height at a point of uv, 0 to 1.
struct Ground {
    description: Arc<Description>,
    height: fn(Vec2) -> f32,
    tiles: Tiles,
}

impl Ground {
    fn new(address: [AddressMode; 2], heights: LayerFormat, height: fn(Vec2) -> f32) -> Arc<Ground> {
        let address = [address[0], address[1], AddressMode::Clamp];
        let spec = GeometrySpec { page: 64, address, ..GeometrySpec::image(SIZE[0], SIZE[1]) };
        let geometry = Geometry::new(spec).unwrap();
        let layers = vec![Layer::new("color", LayerFormat::Rgba8), Layer::new("height", heights)];
        let one = Description::one_layer(geometry, LayerFormat::Rgba8);
        let description = Description { layers, ..one };
        Arc::new(Ground { description: Arc::new(description), height, tiles: Tiles::default() })
    }

    fn fill(&self, level: u8, level_box: Box3, offset: [u32; 3], tile: &mut [u8]) {
        let (geometry, layers) = (&self.description.geometry, &self.description.layers);
        for (y, x) in (0..level_box.size[1]).flat_map(|y| (0..level_box.size[0]).map(move |x| (y, x))) {
            let texel = std::array::from_fn(|a| level_box.origin[a] + i64::from([x, y, 0][a]));
            let [u, v, _] = geometry.fold_texel(level, texel);
            let middle = (Vec2::new(u as f32, v as f32) + 0.5) * (1 << level) as f32;
            let height = (self.height)(middle / Vec2::new(SIZE[0] as f32, SIZE[1] as f32));
            let texel = (offset[1] + y) * geometry.tile()[0] + offset[0] + x;
            let shade = if (u / 8 + v / 8) % 2 == 0 { 150 } else { 110 };
            let of_height = match layers[1].format {
                LayerFormat::R32Float => height.to_le_bytes().to_vec(),
                _ => ((height * 65535.0) as u16).to_le_bytes().to_vec(),
            };
            for (index, bytes) in [vec![shade, shade, shade, 255], of_height].into_iter().enumerate() {
                let at = self.description.layer_range(index).start + texel as usize * bytes.len();
                tile[at..at + bytes.len()].copy_from_slice(&bytes);
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

/// Hills and ridges down to a few texels, which differ from level to level.
fn rough(uv: Vec2) -> f32 {
    let wave = |f: f32, g: f32| (uv.x * f + uv.y * g).sin();
    let ridge = 1.0 - wave(57.0, 31.0).abs();
    0.45 + 0.2 * wave(9.0, -14.0) * wave(5.0, 11.0)
        + 0.15 * ridge
        + 0.08 * wave(170.0, 230.0) * wave(-310.0, 190.0)
}

fn shown(scale: f32) -> DisplayOptions {
    let heights = Heights { scale: Some(scale), ..Heights::default() };
    DisplayOptions { heights, ..DisplayOptions::default() }
}

fn offscreen(scene: Scene, source: Arc<dyn TileSource>, scale: f32) -> Offscreen {
    Offscreen::showing(&shown(scale), gpu(), source, scene, PICTURE, settings(16, Filter::Trilinear)).unwrap()
}

fn converge(offscreen: &mut Offscreen, pose: Pose) {
    for frame in 0..3000 {
        offscreen.frame(pose).unwrap();
        if frame > 20 && offscreen.textures().stats().converged {
            return;
        }
    }
    panic!("not converged: {:?}", offscreen.textures().stats());
}

const fn over(x: f64, y: f64, above: f64, yaw: f64, pitch: f64) -> Pose {
    Pose::Plane { eye: glam::DVec3::new(x, y, above), yaw, pitch }
}

/// Over the terrain: straight down, over the plain, at its edge.
const FLIGHT: [Pose; 5] = [
    over(0.0, -0.1, 0.3, 0.0, 1.5),
    over(0.03, -0.2, 0.02, 0.0, 0.3),
    over(-0.4, 0.1, 0.05, 0.7, 0.15),
    over(0.51, -0.3, 0.1, 0.3, 0.6),
    over(0.2, 0.13, 0.004, 2.0, 0.2),
];

/// Round the globe, by longitude, latitude and altitude: the date line, the poles, near the ground.
const ORBIT: [(f64, f64, f64); 5] =
    [(PI, 0.3, 1.5), (PI - 0.02, -0.2, 0.15), (0.4, 1.54, 0.8), (2.0, -1.53, 0.2), (0.1, 0.2, 0.05)];

fn covered(picture: &Picture, x: u32, y: u32) -> bool {
    picture.rgba[((y * picture.size[0] + x) * 4 + 3) as usize] != 0
}

/// Pixels of the background below ground that is seen.
fn holes_in_terrain(picture: &Picture) -> usize {
    let [width, height] = picture.size;
    let holes_in = |x: u32| {
        let first = (0..height).find(|&y| covered(picture, x, y)).unwrap_or(height);
        (first..height).filter(|&y| !covered(picture, x, y)).count()
    };
    (0..width).map(holes_in).sum()
}

/// Pixels of the background where a sphere is that is smaller than the globe, and seen from so far that it is
/// in front of no rim.
fn holes_in_globe(picture: &Picture, altitude: f32) -> usize {
    let [width, height] = picture.size;
    let slope = (0.95 / (1.2 + altitude)).asin().tan();
    let radius = slope / std::f32::consts::FRAC_PI_6.tan() * 0.5 * height as f32;
    let from_middle = |x: u32, y: u32| {
        let at = |n: u32, size: u32| n as f32 + 0.5 - 0.5 * size as f32;
        at(x, width).hypot(at(y, height))
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels.filter(|&(x, y)| from_middle(x, y) < radius && !covered(picture, x, y)).count()
}

fn covered_share(picture: &Picture) -> f32 {
    let covered = picture.rgba.chunks_exact(4).filter(|pixel| pixel[3] != 0).count();
    covered as f32 / (picture.size[0] * picture.size[1]) as f32
}

#[test]
fn a_terrain_has_no_cracks() {
    let mut offscreen =
        offscreen(Scene::Terrain, Ground::new([AddressMode::Clamp; 2], LayerFormat::R16, rough), 0.06);
    for (nth, pose) in FLIGHT.into_iter().enumerate() {
        // While it streams as well as at rest: the heights are coarser, and the same on both sides of every
        // edge.
        for frame in 0..6 {
            offscreen.frame(pose).unwrap();
            assert_eq!(holes_in_terrain(&offscreen.picture()), 0, "pose {nth}, frame {frame}");
        }
        converge(&mut offscreen, pose);
        let picture = offscreen.picture();
        assert_eq!(holes_in_terrain(&picture), 0, "pose {nth}");
        assert!(covered_share(&picture) > 0.3, "pose {nth}: {}", covered_share(&picture));
        // Every pixel's: the feedback pass looks at one in four in a cycle.
        assert!(offscreen.share_at_wanted_level().unwrap() > 0.999, "pose {nth}");
    }
}

/// What the test before this one looks for is there where vertices do not move. Through most tears more
/// terrain is seen, so the terrain is higher than there and seen from above.
#[test]
fn a_torn_terrain_has_cracks() {
    for is_torn in [false, true] {
        let mut shown = shown(0.3);
        shown.heights.is_torn = is_torn;
        let source = Ground::new([AddressMode::Clamp; 2], LayerFormat::R16, rough);
        let settings = settings(16, Filter::Trilinear);
        let mut offscreen =
            Offscreen::showing(&shown, gpu(), source, Scene::Terrain, PICTURE, settings).unwrap();
        let mut holes = 0;
        for pose in [FLIGHT[0], FLIGHT[3]] {
            converge(&mut offscreen, pose);
            holes += holes_in_terrain(&offscreen.picture());
        }
        assert!(if is_torn { holes >= 10 } else { holes == 0 }, "torn: {is_torn}, {holes} holes");
    }
}

#[test]
fn a_displaced_globe_has_no_cracks_at_the_date_line_and_the_poles() {
    let wrapped = [AddressMode::Wrap, AddressMode::Clamp];
    for address in [wrapped, [AddressMode::Clamp; 2]] {
        let source = Ground::new(address, LayerFormat::R32Float, rough);
        let mut offscreen = offscreen(Scene::Globe, source, 0.2);
        for (longitude, latitude, altitude) in ORBIT {
            let pose = Pose::globe(longitude, latitude, altitude);
            converge(&mut offscreen, pose);
            let picture = offscreen.picture();
            assert_eq!(holes_in_globe(&picture, altitude as f32), 0, "{pose:?}");
            assert!(covered_share(&picture) > 0.2, "{pose:?}");
        }
    }
}

#[test]
fn every_way_of_feedback_finds_what_a_terrain_wants() {
    let source = Ground::new([AddressMode::Clamp; 2], LayerFormat::R16, rough);
    let picture = |feedback| {
        let settings = Settings { feedback: Some(feedback), ..settings(16, Filter::Trilinear) };
        let mut offscreen =
            Offscreen::showing(&shown(0.06), gpu(), source.clone(), Scene::Terrain, PICTURE, settings)
                .unwrap();
        converge(&mut offscreen, over(0.03, -0.2, 0.05, 0.0, 0.3));
        assert!(offscreen.share_at_wanted_level().unwrap() > 0.999, "{feedback:?}");
        offscreen.picture()
    };
    let separate = picture(FeedbackMode::Separate);
    for mode in [FeedbackMode::Inline, FeedbackMode::Raw] {
        assert_alike(&Comparison::of(&picture(mode), &separate), &format!("{mode:?}"));
    }
}

#[test]
fn ground_fades_in_and_ends_where_it_is_without_fading() {
    let source = Ground::new([AddressMode::Clamp; 2], LayerFormat::R16, rough);
    let fade = Duration::from_millis(100);
    let pose = over(0.03, -0.2, 0.05, 0.0, 0.3);
    let [mut fading, at_once] = [fade, Duration::ZERO].map(|fade| {
        let settings = Settings { fade, ..settings(16, Filter::Trilinear) };
        let mut offscreen =
            Offscreen::showing(&shown(0.06), gpu(), source.clone(), Scene::Terrain, PICTURE, settings)
                .unwrap();
        offscreen.textures_mut().set_frame_time(Duration::ZERO);
        converge(&mut offscreen, pose);
        offscreen
    });
    assert!(fading.textures().stats().fading > 3 && fading.picture() != at_once.picture());
    fading.textures_mut().set_frame_time(fade);
    fading.frame(pose).unwrap();
    // Where the ground lies, other pages may be in view.
    converge(&mut fading, pose);
    assert_eq!(fading.textures().stats().fading, 0);
    assert_alike(&Comparison::of(&fading.picture(), &at_once.picture()), "all there");
}

#[test]
fn colours_on_heights_are_those_of_an_ordinary_texture() {
    let source = Ground::new([AddressMode::Wrap, AddressMode::Clamp], LayerFormat::R16, rough);
    for (scene, pose) in
        [(Scene::Terrain, over(0.03, -0.2, 0.05, 0.0, 0.4)), (Scene::Globe, Pose::globe(3.1, 0.6, 0.5))]
    {
        let mut offscreen = offscreen(scene, source.clone(), 0.05);
        converge(&mut offscreen, pose);
        assert_alike(&offscreen.compare().unwrap().0, scene.name());
    }
}

/// A driver in software must not take minutes for the four heights of a slope by several taps each.
#[test]
fn heights_by_filters_of_several_taps_are_drawn_at_once() {
    const LIMIT: Duration = Duration::from_secs(100);
    let source = Ground::new([AddressMode::Wrap, AddressMode::Clamp], LayerFormat::R16, rough);
    let (near, globe) = (over(0.2, 0.13, 0.004, 2.0, 0.2), Pose::globe(0.1, 0.2, 0.05));
    let surfaces =
        [(Scene::Terrain, near, false), (Scene::Terrain, near, true), (Scene::Globe, globe, false)];
    for (scene, pose, always_fixed) in surfaces {
        let drawn = |filter| {
            let shown = DisplayOptions { always_fixed, ..shown(0.05) };
            let settings = settings(16, filter);
            let mut offscreen =
                Offscreen::showing(&shown, gpu(), source.clone(), scene, [96, 64], settings).unwrap();
            converge(&mut offscreen, pose);
            offscreen
        };
        let trilinear = drawn(Filter::Trilinear).picture();
        for filter in [Filter::Bicubic, Filter::KINDS[3]] {
            let begun = Instant::now();
            let offscreen = drawn(filter);
            let what = format!("{scene:?} {filter} {always_fixed}");
            assert_alike(&offscreen.compare().unwrap().0, &what);
            // Straight below a camera pixels are round, and have one tap.
            let is_aslant = filter == Filter::Bicubic || scene == Scene::Terrain;
            assert!(!is_aslant || offscreen.picture() != trilinear, "{what}");
            assert!(begun.elapsed() < LIMIT, "{what}: {:?}", begun.elapsed());
        }
    }
}

/// On ground that is all there, nothing is missing of the colours, and each overlay covers what the picture
/// covers.
#[test]
fn overlays_go_with_heights() {
    let source = Ground::new([AddressMode::Wrap, AddressMode::Clamp], LayerFormat::R16, rough);
    let globe = Pose::globe(3.1, 0.6, 0.5);
    for (scene, pose) in [(Scene::Terrain, over(0.03, -0.2, 0.05, 0.0, 0.4)), (Scene::Globe, globe)] {
        let mut offscreen = offscreen(scene, source.clone(), 0.05);
        converge(&mut offscreen, pose);
        let picture = offscreen.picture();
        for overlay in [Overlay::Levels, Overlay::Wanted, Overlay::Deficit, Overlay::Pages] {
            let shown = offscreen.overlay(overlay).unwrap();
            assert_ne!(shown, picture, "{overlay:?}");
            assert_eq!(covered_share(&shown), covered_share(&picture), "{overlay:?}");
        }
        let deficit = offscreen.overlay(Overlay::Deficit).unwrap();
        let covered = || deficit.rgba.chunks_exact(4).filter(|pixel| pixel[3] != 0);
        let green = covered().filter(|pixel| pixel[1] > pixel[0] && pixel[1] > pixel[2]).count();
        assert!(green * 100 >= covered().count() * 99, "{green} of {}", covered().count());
    }
}

/// The mean brightness of a picture straight down on ground of one slope.
fn brightness(height: fn(Vec2) -> f32) -> f32 {
    let source = Ground::new([AddressMode::Clamp; 2], LayerFormat::R32Float, height);
    let mut offscreen = offscreen(Scene::Terrain, source, 1.0);
    converge(&mut offscreen, over(0.0, 0.0, 0.1, 0.0, 1.5));
    let picture = offscreen.picture();
    assert_eq!(covered_share(&picture), 1.0);
    picture.rgba.chunks_exact(4).map(|pixel| f32::from(pixel[0])).sum::<f32>()
        / (PICTURE[0] * PICTURE[1]) as f32
}

#[test]
fn light_follows_from_the_slope() {
    let flat = brightness(|_| 0.5);
    assert!((flat - 130.0).abs() < 3.0, "level ground is as bright as its colour: {flat}");
    // The sun of relief.wgsl; heights of 1 are 2 high, on a rectangle of 2 by 1.
    let sun = Vec3::new(-0.5, 0.35, 0.79);
    let expected = |slope: Vec2| {
        let normal = Vec3::new(-slope.x, -slope.y, 1.0).normalize();
        130.0 * (0.7 * normal.dot(sun).max(0.0) / sun.z + 0.3)
    };
    for (height, slope) in [
        ((|uv| 0.2 + 0.3 * uv.x) as fn(Vec2) -> f32, Vec2::new(0.3, 0.0)),
        (|uv| 0.8 - 0.3 * uv.x, Vec2::new(-0.3, 0.0)),
        (|uv| 0.2 + 0.2 * uv.y, Vec2::new(0.0, -0.4)),
    ] {
        let (found, expected) = (brightness(height), expected(slope));
        assert!((found - expected).abs() < 4.0, "{slope}: {found}, not {expected}");
    }
}

#[test]
fn the_camera_stays_above_the_ground() {
    // A plateau as high as the rectangle is wide, which begins a quarter from the left.
    let plateau: fn(Vec2) -> f32 = |uv| if uv.x > 0.25 { 0.6 } else { 0.0 };
    let source = Ground::new([AddressMode::Clamp; 2], LayerFormat::R16, plateau);
    let mut offscreen = offscreen(Scene::Terrain, source, 1.0);
    for x in [-0.8, 0.0, 0.3] {
        converge(&mut offscreen, over(x, -0.3, 0.02, 0.0, 0.1));
        let picture = offscreen.picture();
        let row = |y: u32| {
            let row = &picture.rgba[(y * PICTURE[0] * 4) as usize..][..PICTURE[0] as usize * 4];
            row.chunks_exact(4).filter(|pixel| pixel[3] != 0).count() as u32
        };
        assert_eq!(row(PICTURE[1] - 1), PICTURE[0], "ground at the feet, at {x}");
        assert!(row(0) < PICTURE[0], "sky above, at {x}");
    }
}

#[test]
fn without_heights_there_is_no_terrain() {
    let source = |names: [&str; 1], format| {
        let spec = GeometrySpec::image(100, 50);
        let one = Description::one_layer(Geometry::new(spec).unwrap(), format);
        let layers = vec![Layer::new(names[0], format)];
        let description = Arc::new(Description { layers, ..one });
        Arc::new(Ground { description, height: |_| 0.0, tiles: Tiles::default() })
    };
    let showing = |source: Arc<dyn TileSource>, shown: &DisplayOptions| {
        Offscreen::showing(shown, gpu(), source, Scene::Terrain, [8, 8], settings(4, Filter::Trilinear)).err()
    };
    let colour =
        showing(Arc::new(OneLayer(source(["color"], LayerFormat::Rgba8))), &DisplayOptions::default());
    assert!(matches!(colour, Some(OffscreenError::Heights(HeightsError::None(_)))), "{colour:?}");
    let unknown = Heights { layer: Some("depth".into()), ..Heights::default() };
    let grey = || Arc::new(OneLayer(source(["grey"], LayerFormat::R8)));
    let named = showing(grey(), &DisplayOptions { heights: unknown, ..DisplayOptions::default() });
    assert!(matches!(named, Some(OffscreenError::Heights(HeightsError::Layer(_)))), "{named:?}");
    assert!(showing(grey(), &DisplayOptions::default()).is_none(), "one channel is heights enough");
}

/// Zeros.
struct OneLayer(Arc<Ground>);

impl TileSource for OneLayer {
    fn description(&self) -> &Arc<Description> {
        &self.0.description
    }

    fn read(&self, _: PagePos) -> ReadFuture<'_> {
        let bytes = vec![0; self.0.description.tile_bytes()].into();
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes }) })
    }
}
