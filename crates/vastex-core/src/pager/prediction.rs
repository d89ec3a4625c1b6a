//! Prediction: what the view is expected to want when tiles that are asked for now will be here.
//!
//! The application draws, or works out, the feedback of the view that a camera which goes on as it does will
//! have in so many frames as a tile takes; its pages are loaded after everything in view and before
//! prefetches, and held against what is out of view. Since anything that is missing in view comes first,
//! predictions cost nothing where bandwidth is short.

use rustc_hash::FxHashMap;

use crate::shader_constants::JITTER_CYCLE;
use crate::texture::page::{PageId, TextureNumber};

/// Frames for which a page stays expected after a feedback has named it.
const FRAMES: u64 = JITTER_CYCLE as u64;

/// The pages that are expected.
#[derive(Debug, Default)]
pub(crate) struct Prediction {
    /// The frame in which each was named last, and its pixels then.
    pages: FxHashMap<PageId, (u64, u32)>,
    /// Reused between frames to avoid allocating.
    ordered: Vec<(PageId, u32)>,
}

impl Prediction {
    pub(crate) fn is_empty(&self) -> bool {
        self.pages.is_empty()
    }

    /// The pages, in no order.
    #[cfg(feature = "checks")]
    pub(crate) fn pages(&self) -> impl Iterator<Item = PageId> + '_ {
        self.pages.keys().copied()
    }

    /// The pages, coarse ones first, of equally coarse ones those of most pixels.
    pub(crate) fn pages_in_order(&mut self) -> &[(PageId, u32)] {
        self.ordered.clear();
        self.ordered.extend(self.pages.iter().map(|(&page, &(_, pixels))| (page, pixels)));
        self.ordered.sort_unstable_by_key(|&(page, pixels)| std::cmp::Reverse((page.level(), pixels, page)));
        &self.ordered
    }

    /// Forgets the pages that were not named for a while, and adds them to `released`.
    pub(crate) fn begin_frame(&mut self, frame: u64, released: &mut Vec<PageId>) {
        self.pages.retain(|&page, &mut (named, _)| {
            let stays = named + FRAMES > frame;
            if !stays {
                released.push(page);
            }
            stays
        });
    }

    pub(crate) fn forget(&mut self, texture: TextureNumber) {
        self.pages.retain(|page, _| page.texture() != texture);
    }

    /// Returns true if the page was not expected before.
    pub(crate) fn name(&mut self, page: PageId, frame: u64, pixels: u32) -> bool {
        let before = self.pages.insert(page, (frame, pixels));
        if let Some((_, others)) = before.filter(|&(named, _)| named == frame) {
            self.pages.insert(page, (frame, others.saturating_add(pixels)));
        }
        before.is_none()
    }
}
