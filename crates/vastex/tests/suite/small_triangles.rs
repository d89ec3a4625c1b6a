//! Triangles smaller than pixels, in perspective: they show and want what one rectangle in their place does.
//! Interpolation over so small a triangle leaves the last bits of a gradient open, so that some pixels may be
//! of the next level, and want another page; texels are the same or neighbours.
//!
//! How many, on a GPU and by a software driver, stands in docs/draw-checks.md, "What a GPU may differ by".

use std::collections::BTreeMap;

use crate::common::texts::quarter;
use crate::common::{Mapping, PICTURE, Screen, property, settings};
use vastex::{AddressMode, Dims, PageId};
use vastex_tiles::PropertySource;

const SIZE: [u32; 2] = [3000, 2200];
/// Of so many tiles one may come for one of the two pictures alone.
const TILES: u64 = 20;

/// What is seen on a quarter of the picture.
struct Seen {
    /// Of each pixel the level and the texel; level 255 where nothing is drawn.
    texels: Vec<(u8, [u32; 3])>,
    /// How many pixels want each page.
    wanted: BTreeMap<PageId, u32>,
    /// Tiles that came by the feedback of frames, which is of one pixel in 64.
    loaded: u64,
    is_processor: bool,
}

fn seen(is_small: bool, by_gradients: bool, mapping: &Mapping) -> Seen {
    let (text, vertices) = quarter(is_small, by_gradients);
    let mut screen = Screen::showing(settings(), &text, |textures| {
        textures.add_blocking(property(SIZE, 16, AddressMode::Clamp)).unwrap()
    });
    screen.set_vertices(0, vertices);
    screen.set_mapping(0, mapping);
    screen.converge();
    let [width, height] = PICTURE.map(|side| side as usize);
    let picture = screen.picture();
    let pixels = picture.chunks(width).take(height / 2).flat_map(|row| &row[..width / 2]);
    let texels = pixels.map(|colour| PropertySource::texel_from_color(Dims::D2, *colour)).collect();
    let wanted = screen.feedback_of_every_pixel().pages;
    let wanted = wanted.iter().map(|wanted| (wanted.page, wanted.pixels)).collect();
    let is_processor = screen.gpu.is_processor();
    Seen { texels, wanted, loaded: screen.textures.stats().pager.loaded, is_processor }
}

#[expect(clippy::print_stdout, reason = "how near to its bounds a device is")]
fn check(texels: f64, stretch: f64, by_gradients: bool) {
    let mapping = Mapping::new(SIZE, [0.55, 0.6], texels, stretch, 0.4);
    let [rectangle, small] = [false, true].map(|is_small| seen(is_small, by_gradients, &mapping));
    let of = format!("{texels} texels a pixel, by gradients: {by_gradients}");
    let drawn = rectangle.texels.iter().filter(|(level, _)| *level != u8::MAX).count();
    assert!(drawn > 3000, "{of}: {drawn} pixels");

    // Of so many pixels one may be of another level, and of so many one may want another page.
    let (levels, pages) = if rectangle.is_processor { (200, 100) } else { (100, 50) };
    let mut other_levels = 0;
    for (n, (expected, found)) in rectangle.texels.iter().zip(&small.texels).enumerate() {
        if expected.0 == found.0 {
            let steps = [0, 1].map(|axis| expected.1[axis].abs_diff(found.1[axis]));
            assert!(steps.iter().all(|step| *step <= 1), "{of}: pixel {n}: {found:?} for {expected:?}");
        } else {
            assert_eq!(expected.0.abs_diff(found.0), 1, "{of}: pixel {n}: {found:?} for {expected:?}");
            other_levels += 1;
        }
    }
    println!("{of}: {other_levels} of {drawn} pixels are of another level");
    assert!(other_levels * levels <= drawn, "{of}: {other_levels} of {drawn} pixels are of another level");

    let wanted = rectangle.wanted.keys().chain(small.wanted.keys());
    let pixels = |seen: &Seen, page| seen.wanted.get(page).copied().unwrap_or(0);
    let differing: u32 = wanted
        .collect::<std::collections::BTreeSet<_>>()
        .into_iter()
        .map(|page| pixels(&rectangle, page).abs_diff(pixels(&small, page)))
        .sum();
    let [expected, found] = [rectangle.loaded, small.loaded];
    println!("{of}: {differing} pixels want other pages, {found} tiles came instead of {expected}");
    assert!(differing as usize * pages <= 2 * drawn, "{of}: {differing} of {drawn} pixels want other pages");
    assert!(
        expected > 20 && expected.abs_diff(found) * TILES <= expected,
        "{of}: {found} tiles for {expected}"
    );
}

#[test]
fn triangles_smaller_than_pixels_show_and_want_what_a_rectangle_does() {
    for (texels, stretch) in [(0.6, 1.0), (1.87, 1.2), (5.3, 2.0)] {
        check(texels, stretch, false);
        check(texels, stretch, true);
    }
}
