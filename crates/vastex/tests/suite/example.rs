//! The example works as it stands.

#[path = "../../examples/existing_renderer/main.rs"]
#[allow(dead_code, reason = "the test gives the arguments that `main` reads")]
mod existing_renderer;

use std::sync::Arc;

use vastex_core::{Geometry, GeometrySpec};
use vastex_tiles::PropertySource;

const SIZE: [u32; 2] = [160, 90];

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

#[test]
fn it_draws_the_image_that_it_is_given() {
    let spec = GeometrySpec::image(1000, 777);
    let source = Arc::new(PropertySource::new(Geometry::new(spec).unwrap()));
    let (pixels, _) = existing_renderer::render(source, SIZE).unwrap();
    let (left, right) = (pixel(&pixels, 20, 89), pixel(&pixels, 140, 89));
    assert_ne!(left, right);
}
