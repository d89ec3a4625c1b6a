//! Twin of compact.wgsl: from the pixels of a feedback target to distinct pages.

use std::collections::BTreeMap;

use vastex_core::shared::{FEEDBACK_DEGENERATE, FEEDBACK_WANTED};
use vastex_core::{Feedback, PageId, WantedPage};

/// The feedback in a target's pixels, each (page id low, page id high, eighth, flag). The same as the GPU's, also
/// where there is no compute. Pixels that name no page are left out.
pub fn compact(frame: u64, pixels: &[[u32; 4]]) -> Feedback {
    let mut pages: BTreeMap<PageId, (u32, u8)> = BTreeMap::new();
    let mut degenerate = 0;
    for &[low, high, eighth, flag] in pixels {
        match flag {
            FEEDBACK_DEGENERATE => degenerate += 1,
            FEEDBACK_WANTED => {
                let Some(page) = PageId::from_bits(u64::from(high) << 32 | u64::from(low)) else { continue };
                let (pixels, sharpest) = pages.entry(page).or_insert((0, u8::MAX));
                *pixels += 1;
                *sharpest = (*sharpest).min(eighth as u8);
            }
            _ => {}
        }
    }
    let pages =
        pages.into_iter().map(|(page, (pixels, eighth))| WantedPage { page, pixels, eighth }).collect();
    Feedback { frame, pages, degenerate }
}
