//! The examples work as they stand.

#[path = "../../examples/async_add/main.rs"]
#[allow(dead_code, reason = "the test gives the argument that `main` reads")]
mod async_add;

#[path = "../../examples/fog/main.rs"]
#[allow(dead_code, clippy::duplicate_mod, reason = "the test gives the argument that `main` reads")]
mod fog;

use std::sync::Arc;
use std::time::Duration;

use async_add::existing_renderer;
use existing_renderer::common::painted::Painted;
use glam::{Vec2, Vec3};
use vastex::{GeometrySpec, LayerFormat, TileSource};

const SIZE: [u32; 2] = [160, 90];
/// What the example draws behind everything.
const SKY: Vec3 = Vec3::new(0.46, 0.62, 0.82);

fn pixel(pixels: &[u8], x: u32, y: u32) -> [u8; 4] {
    pixel_of(pixels, SIZE[0], x, y)
}

/// A pixel of a picture of so many columns.
fn pixel_of(pixels: &[u8], columns: u32, x: u32, y: u32) -> [u8; 4] {
    let at = ((y * columns + x) * 4) as usize;
    std::array::from_fn(|channel| pixels[at + channel])
}

#[test]
fn the_example_draws_ground_under_a_sky() {
    let source = existing_renderer::landscape::landscape().unwrap();
    let (pixels, frames) = existing_renderer::render(Arc::new(source), SIZE).unwrap();
    assert!(frames > 60, "it flies before it stays: {frames}");
    assert_eq!(pixels.len() as u32, SIZE[0] * SIZE[1] * 4);
    let sky = pixel(&pixels, SIZE[0] / 2, 0);
    assert!(sky[2] > sky[0] && sky == pixel(&pixels, SIZE[0] / 2, 1), "the top is sky: {sky:?}");
    let lower_half = &pixels[pixels.len() / 2..];
    let colours: std::collections::BTreeSet<_> = lower_half.chunks_exact(4).collect();
    assert!(colours.len() > 200, "the ground has detail: {} colours", colours.len());
}

/// The light at a place of an image that is an affine function of the place, so that whatever samples it
/// rightly gives that. No channel is so dark that a step of 8 bits is many of sRGB.
fn light([u, v]: [f32; 2]) -> [f32; 3] {
    [0.3 + 0.6 * u, 0.9 - 0.6 * v, 0.4 + 0.2 * (u + v)]
}

/// That image.
fn shade([width, height]: [u32; 2]) -> Arc<dyn TileSource> {
    let paint = move |[x, y]: [f32; 2], _| {
        let [r, g, b] = light([x / width as f32, y / height as f32]).map(|n| (n * 255.0).round() as u8);
        [r, g, b, 255]
    };
    Arc::new(Painted::new(GeometrySpec::image(width, height), LayerFormat::Rgba8, paint).unwrap())
}

/// Each pixel is what the ray through it meets: the image in the haze, the sky beside it.
#[test]
fn it_draws_the_image_that_it_is_given_where_it_lies() {
    let size = [1000, 777];
    let (pixels, _) = existing_renderer::render(shade(size), SIZE).unwrap();
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
            Vec3::from(light(uv.to_array())).lerp(SKY, 1.0 - (-0.35 * met.distance(eye)).exp())
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

/// While a source takes its second, frames go on and none is another; then it is shown as if it had been
/// there from the beginning.
#[test]
fn a_texture_comes_while_frames_are_drawn_and_nothing_waits_for_it() {
    let source: Arc<dyn TileSource> = shade([1000, 777]);
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

/// Mist lies over the ground: without any the picture is that of the ground alone, and with it pixels go
/// toward its colour, more so where they look through more of it, and nowhere away from it.
#[test]
fn mist_lies_over_the_ground_and_ends_at_it() {
    // Few pixels: each is a long way through mist.
    const SIZE: [u32; 2] = [96, 54];
    let (clear, _) = fog::render(SIZE, 0.0).unwrap();
    let (thin, _) = fog::render(SIZE, 8.0).unwrap();
    let (thick, frames) = fog::render(SIZE, 60.0).unwrap();
    assert!(frames < 400, "{frames}");
    // Its colour as sRGB codes.
    let mist =
        Vec3::new(0.8, 0.83, 0.86).to_array().map(|light| 255.0 * (1.055 * light.powf(1.0 / 2.4) - 0.055));
    let distance = |pixels: &[u8], x: u32, y: u32| {
        let [r, g, b, _] = pixel_of(pixels, SIZE[0], x, y).map(f32::from);
        Vec3::new(r, g, b).distance(Vec3::from_array(mist))
    };
    let places = || (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
    let mean =
        |pixels: &[u8]| places().map(|(x, y)| distance(pixels, x, y)).sum::<f32>() / places().count() as f32;
    for (x, y) in places() {
        let [none, some, much] = [&clear, &thin, &thick].map(|pixels| distance(pixels, x, y));
        assert!(some <= none + 1.5 && much <= some + 1.5, "{x},{y}: {none} {some} {much}");
    }
    let [none, some, much] = [&clear, &thin, &thick].map(|pixels| mean(pixels));
    assert!(some < 0.95 * none && much < 0.7 * none, "{none} {some} {much}");
}
