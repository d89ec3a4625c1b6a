//! From a raw feedback target to a sorted list of distinct pages, beside a hash set and a sort.

use std::hint::black_box;

use rustc_hash::FxHashSet;
use vastex_core::shared::FEEDBACK_WANTED;
use vastex_core::sim::Path;
use vastex_core::{Feedback, FeedbackCompactor, Geometry, GeometrySpec, TextureId};

use crate::{medians, micros};

/// Feedback targets of 80x60 texels, and of 1280x720 and 3840x2160 pixels at 1/8 per axis.
const SIZES: [[u32; 2]; 3] = [[80, 60], [160, 90], [480, 270]];
/// A well-known prototype's: 80x60 texels in 0.5 ms.
const ANCHOR_TEXELS_PER_MS: f64 = 9600.0;

pub(crate) fn measure() {
    println!("## From a raw feedback target to a sorted list of distinct pages\n");
    println!(
        "The view of a tilted plane of 32768x16384 texels; the hash set is a `FxHashSet`, sorted afterwards.\n"
    );
    println!(
        "| target | distinct pages | µs | of the hash set, µs | times as fast | texels/ms | times 9600 |"
    );
    println!("|---|---|---|---|---|---|---|");
    for size in SIZES {
        let pixels = target(size);
        let (mut compactor, mut feedback) = (FeedbackCompactor::new(), Feedback::default());
        let [ours, theirs] =
            medians([&mut || compactor.compact(0, black_box(&pixels), &mut feedback), &mut || {
                drop(black_box(hash_set(black_box(&pixels))));
            }]);
        let rate = pixels.len() as f64 / (ours.as_secs_f64() * 1e3);
        println!(
            "| {}x{} | {} | {:.1} | {:.1} | {:.1} | {rate:.0} | {:.0} |",
            size[0],
            size[1],
            feedback.pages.len(),
            micros(ours),
            micros(theirs),
            theirs.as_secs_f64() / ours.as_secs_f64(),
            rate / ANCHOR_TEXELS_PER_MS,
        );
        assert_eq!(feedback.pages.len(), hash_set(&pixels).len());
    }
}

fn target([width, height]: [u32; 2]) -> Vec<[u32; 4]> {
    let geometry = Geometry::new(GeometrySpec::image(32_768, 16_384)).unwrap();
    let (view, texture) = (Path::Fly.view(0), TextureId::new(3).unwrap());
    let pixel =
        |n: u32| match view.want(texture, &geometry, [width * 8, height * 8], [n % width * 8, n / width * 8])
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
