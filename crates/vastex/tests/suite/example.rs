//! The examples work as they stand.

#[path = "../../examples/async_add/main.rs"]
#[allow(dead_code, reason = "the test gives the argument that `main` reads")]
mod async_add;

use std::sync::Arc;
use std::time::Duration;

use crate::common::tiles::parts_of_tile;
use async_add::existing_renderer;
use glam::{Vec2, Vec3};
use vastex::source::{ReadFuture, Tile};
use vastex::{Description, Geometry, GeometrySpec, Layer, LayerFormat, PagePos, TileSource};
use vastex_core::Box3;
use vastex_tiles::Codec;

const SIZE: [u32; 2] = [160, 90];
/// What the example draws behind everything.
const SKY: Vec3 = Vec3::new(0.46, 0.62, 0.82);

fn pixel(pixels: &[u8], x: u32, y: u32) -> [u8; 4] {
    let at = ((y * SIZE[0] + x) * 4) as usize;
    std::array::from_fn(|channel| pixels[at + channel])
}

#[test]
fn the_example_draws_ground_under_a_sky() {
    let source = existing_renderer::landscape::Landscape::new().unwrap();
    let (pixels, frames) = existing_renderer::render(Arc::new(source), SIZE).unwrap();
    assert!(frames > 60, "it flies before it stays: {frames}");
    assert_eq!(pixels.len() as u32, SIZE[0] * SIZE[1] * 4);
    let sky = pixel(&pixels, SIZE[0] / 2, 0);
    assert!(sky[2] > sky[0] && sky == pixel(&pixels, SIZE[0] / 2, 1), "the top is sky: {sky:?}");
    let lower_half = &pixels[pixels.len() / 2..];
    let colours: std::collections::BTreeSet<_> = lower_half.chunks_exact(4).collect();
    assert!(colours.len() > 200, "the ground has detail: {} colours", colours.len());
}

/// An image that is an affine function of the place, on every level, so that whatever samples it rightly gives that.
struct Shade(Arc<Description>);

impl Shade {
    fn new(size: [u32; 2]) -> Shade {
        let geometry = Geometry::new(GeometrySpec::image(size[0], size[1])).unwrap();
        Shade(Arc::new(Description::new(geometry, vec![Layer::new("color", LayerFormat::Rgba8)])))
    }

    /// Light, 0 to 1: no channel is so dark that a step of 8 bits is many of sRGB.
    fn at([u, v]: [f64; 2]) -> [f64; 3] {
        [0.3 + 0.6 * u, 0.9 - 0.6 * v, 0.4 + 0.2 * (u + v)]
    }

    fn fill(&self, level: u8, of_level: Box3, offset: [u32; 3], tile: &mut [u8]) {
        let geometry = &self.0.geometry;
        let (scale, size) = (geometry.level(level).scale, geometry.size().map(f64::from));
        for (y, x) in (0..of_level.size[1]).flat_map(|y| (0..of_level.size[0]).map(move |x| (y, x))) {
            let texel = std::array::from_fn(|a| of_level.origin[a] + i64::from([x, y, 0][a]));
            let folded = geometry.fold_texel(level, texel);
            let light =
                Shade::at(std::array::from_fn(|a| (f64::from(folded[a]) + 0.5) * scale[a] as f64 / size[a]));
            let at = 4 * ((offset[1] + y) * geometry.tile()[0] + offset[0] + x) as usize;
            tile[at..at + 3].copy_from_slice(&light.map(|n| (n * 255.0).round() as u8));
        }
    }
}

impl TileSource for Shade {
    fn description(&self) -> &Arc<Description> {
        &self.0
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let (geometry, mut tile) = (&self.0.geometry, vec![255; self.0.tile_bytes()]);
        parts_of_tile(geometry, pos, |level, of_level, offset| self.fill(level, of_level, offset, &mut tile));
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes: tile.into() }) })
    }
}

/// Each pixel is what the ray through it meets: the image in the haze, the sky beside it.
#[test]
fn it_draws_the_image_that_it_is_given_where_it_lies() {
    let size = [1000, 777];
    let (pixels, _) = existing_renderer::render(Arc::new(Shade::new(size)), SIZE).unwrap();
    // Where its camera stays, and the ground that it looks at.
    let half = Vec2::new(1.0, 777.0 / 1000.0);
    let eye = Vec3::new(0.0, -0.4 * half.y, 0.06);
    let forward = Vec3::new(0.1, 1.0, -0.42).normalize();
    let right = forward.cross(Vec3::Z).normalize();
    let (up, tan) = (right.cross(forward), 0.5f32.tan());
    let (mut ground, mut sky) = (0, 0);
    for (y, x) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (y, x))) {
        let at = (Vec2::new(x as f32, y as f32) + 0.5) / Vec2::new(SIZE[0] as f32, SIZE[1] as f32);
        let at = (at * 2.0 - 1.0) * Vec2::new(SIZE[0] as f32 / SIZE[1] as f32, -1.0) * tan;
        let ray = forward + right * at.x + up * at.y;
        let met = eye - ray * (eye.z / ray.z);
        let uv = (met.truncate() / half * Vec2::new(1.0, -1.0) + 1.0) / 2.0;
        let from_edge = uv.min(1.0 - uv).min_element();
        let shown = pixel(&pixels, x, y);
        let expected = if ray.z < 0.0 && from_edge > 0.05 {
            ground += 1;
            let light = Vec3::from(Shade::at([f64::from(uv.x), f64::from(uv.y)]).map(|n| n as f32));
            light.lerp(SKY, 1.0 - (-0.35 * met.distance(eye)).exp())
        } else if ray.z >= 0.0 || from_edge < -0.05 {
            sky += 1;
            SKY
        } else {
            continue; // the edge
        };
        let encoded = |light: f32| 255.0 * (1.055 * light.powf(1.0 / 2.4) - 0.055);
        let is_close = (0..3).all(|c| (f32::from(shown[c]) - encoded(expected[c])).abs() < 3.0);
        assert!(is_close, "pixel {x},{y}: {shown:?} in the place of {:?}", expected.to_array().map(encoded));
    }
    assert!(ground > 3000 && sky > 500, "{ground} of the ground, {sky} of the sky");
}

/// While a source takes its second, frames go on and none is another; then it is shown as if it had been there from the beginning.
#[test]
fn a_texture_comes_while_frames_are_drawn_and_nothing_waits_for_it() {
    let source: Arc<dyn TileSource> = Arc::new(Shade::new([1000, 777]));
    let shown = async_add::show(source.clone(), SIZE).unwrap();
    assert!(shown.frames_meanwhile > 3, "{} frames in the second", shown.frames_meanwhile);
    assert_eq!(shown.frames_changed, 0, "of {}", shown.frames_meanwhile);
    let (by_this_thread, by_all) = shown.asked;
    assert_eq!(by_this_thread, 0, "the thread that draws has asked the source");
    assert!(by_all > 4, "{by_all} reads and polls");
    let at_hand = Arc::new(async_add::slow::Slow::new(source, Duration::ZERO));
    let (expected, _) = existing_renderer::render(at_hand, SIZE).unwrap();
    let differing = shown.at_the_end.iter().zip(&expected).filter(|(a, b)| a.abs_diff(**b) > 1).count();
    assert_eq!(differing, 0, "of {}", expected.len());
}
