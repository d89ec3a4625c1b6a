//! From a raw feedback target to a sorted list of distinct pages, beside a hash set and a sort.

use std::hint::black_box;

use rustc_hash::FxHashSet;
use vastex_core::shader_constants::{FEEDBACK_SCALE, FEEDBACK_WANTED};
use vastex_core::sim::Path;
use vastex_core::{Feedback, FeedbackCompactor, Geometry, GeometrySpec, TextureNumber};

use crate::{medians, micros};

/// The picture, in pixels, and a smaller one.
const PICTURE: [u32; 2] = [1920, 1080];
const SMALL_PICTURE: [u32; 2] = [640, 480];
/// The frame of each path that is looked at: none of them is where a path begins, but that of the camera that
/// stands.
const FRAME: u64 = 45;
/// A well-known prototype's: 80x60 texels in 0.5 ms.
const ANCHOR_TEXELS_PER_MS: f64 = 9600.0;

pub(crate) fn measure() {
    println!("## From a raw feedback target to a sorted list of distinct pages\n");
    println!(
        "What the cameras of the simulated world see of an image of 32768x16384 texels on a tilted plane, in frame {FRAME} of\n\
         their paths: on screens of {}x{} and {}x{} pixels, at 1/{FEEDBACK_SCALE} per axis and in full. Beside it what is usually done: every wanted\n\
         pixel's page is put into a `FxHashSet`, whose pages are then sorted; that counts no pixels and finds no sharpest need.\n",
        SMALL_PICTURE[0], SMALL_PICTURE[1], PICTURE[0], PICTURE[1]
    );
    println!(
        "| path | target | distinct pages | µs | of the hash set, µs | times as fast | texels/ms | times 9600 |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let mut slowest: [f64; 2] = [f64::INFINITY; 2];
    let mut note = |figures: [f64; 2]| slowest = std::array::from_fn(|i| slowest[i].min(figures[i]));
    note(compare(Path::Fly, SMALL_PICTURE, FEEDBACK_SCALE));
    for scale in [FEEDBACK_SCALE, 1] {
        Path::ALL.into_iter().for_each(|path| note(compare(path, PICTURE, scale)));
    }
    println!(
        "\nAt least {:.1} times as fast as the hash set (4 are asked for), at least {:.0} times 9600 texels per ms (20 are).",
        slowest[0], slowest[1]
    );
}

/// Prints a row; gives how many times as fast as the hash set, and as the prototype.
fn compare(path: Path, picture: [u32; 2], scale: u32) -> [f64; 2] {
    let (pixels, size) = (target(path, picture, scale), picture.map(|side| side / scale));
    let (mut compactor, mut feedback) = (FeedbackCompactor::new(), Feedback::default());
    let [ours, theirs] =
        medians([&mut || compactor.compact(0, black_box(&pixels), &mut feedback), &mut || {
            drop(black_box(hash_set(black_box(&pixels))));
        }]);
    assert_eq!(feedback.pages.len(), hash_set(&pixels).len());
    let rate = pixels.len() as f64 / (ours.as_secs_f64() * 1e3);
    let figures = [theirs.as_secs_f64() / ours.as_secs_f64(), rate / ANCHOR_TEXELS_PER_MS];
    println!(
        "| {path:?} | {}x{} | {} | {:.1} | {:.1} | {:.1} | {rate:.0} | {:.0} |",
        size[0],
        size[1],
        feedback.pages.len(),
        micros(ours),
        micros(theirs),
        figures[0],
        figures[1],
    );
    figures
}

/// What every `scale`th pixel along each axis wants.
fn target(path: Path, picture: [u32; 2], scale: u32) -> Vec<[u32; 4]> {
    let geometry = Geometry::new(GeometrySpec::image(32_768, 16_384)).unwrap();
    let (view, texture) = (path.view(FRAME), TextureNumber::new(3).unwrap());
    let [width, height] = picture.map(|side| side / scale);
    let pixel = |n: u32| match view.want(texture, &geometry, picture, [n % width * scale, n / width * scale])
    {
        Some((page, eighth)) => {
            let id = page.to_bits();
            [id as u32, (id >> 32) as u32, u32::from(eighth), FEEDBACK_WANTED]
        }
        None => [0; 4],
    };
    (0..width * height).map(pixel).collect()
}

fn hash_set(pixels: &[[u32; 4]]) -> Vec<u64> {
    let wanted = pixels.iter().filter(|pixel| pixel[3] == FEEDBACK_WANTED);
    let set: FxHashSet<u64> = wanted.map(|pixel| u64::from(pixel[1]) << 32 | u64::from(pixel[0])).collect();
    let mut pages: Vec<u64> = set.into_iter().collect();
    pages.sort_unstable();
    pages
}
