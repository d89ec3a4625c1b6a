//! Prediction: what the view is expected to want when tiles that are asked for now will be here.
//!
//! The application draws, or works out, the feedback of the view that a camera which goes on as it does will have in so many
//! frames as a tile takes; its pages are loaded after everything in view and before prefetches, and held against what is out of
//! view. Since anything that is missing in view comes first, predictions cost nothing where bandwidth is short.

use rustc_hash::FxHashMap;

use crate::pager::pool::Pager;
use crate::shader_constants::JITTER_CYCLE;
use crate::texture::page::{PageId, TextureId};
use crate::wanted::feedback::{Feedback, Need};

/// Frames for which a page stays expected after a feedback has named it.
const FRAMES: u64 = JITTER_CYCLE as u64;

/// The pages that are expected.
#[derive(Debug, Default)]
pub(crate) struct Expectation {
    /// The frame in which each was named last, and its pixels then.
    pages: FxHashMap<PageId, (u64, u32)>,
    /// Kept for its memory.
    ordered: Vec<(PageId, u32)>,
}

impl Expectation {
    pub(crate) fn is_empty(&self) -> bool {
        self.pages.is_empty()
    }

    pub(crate) fn holds(&self, page: PageId) -> bool {
        self.pages.contains_key(&page)
    }

    /// The pages, in no order.
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

    /// Lets go of what was not named for a while, and says so to `let_go`.
    pub(crate) fn begin_frame(&mut self, frame: u64, let_go: &mut Vec<PageId>) {
        self.pages.retain(|&page, &mut (named, _)| {
            let stays = named + FRAMES > frame;
            if !stays {
                let_go.push(page);
            }
            stays
        });
    }

    pub(crate) fn forget(&mut self, texture: TextureId) {
        self.pages.retain(|page, _| page.texture() != texture);
    }

    fn name(&mut self, page: PageId, frame: u64, pixels: u32) {
        let entry = self.pages.entry(page).or_insert((frame, 0));
        *entry = if entry.0 == frame { (frame, entry.1.saturating_add(pixels)) } else { (frame, pixels) };
    }
}

impl Pager {
    /// Takes in what the view is expected to want when tiles that are asked for now will be here. To be called as often as there
    /// is a prediction, best once per frame after [`Pager::observe`]; what was not named for a jitter cycle is let go of.
    ///
    /// A prediction that is wrong costs slots of pages out of view, and what bandwidth the view does not need. Costs a visit of
    /// each page named and of its ancestors, and in each frame of each page expected.
    pub fn expect(&mut self, feedback: &Feedback) {
        let (frame, bias) = (self.residency.frame, self.bias_eighths());
        for wanted in feedback.pages.iter().filter(|wanted| self.textures.contains(wanted.page)) {
            let level = Need::new(wanted.page.level(), wanted.eighth).level_at(bias);
            let line = std::iter::once(wanted.page).chain(self.textures.ancestors(wanted.page));
            for page in line.skip_while(|page| page.level() < level) {
                let page = self.textures.present_page(page);
                if !self.textures.is_tail(page) {
                    self.residency.expected.name(page, frame, wanted.pixels);
                }
            }
        }
        self.plan_due = true;
    }
}

impl crate::pager::Pagers {
    /// Takes in what a view is expected to want, each pool the pages of its own textures; see [`Pager::expect`].
    pub fn expect(&mut self, feedback: &Feedback) {
        // Each pager drops the pages of textures that are not its own.
        self.with_members(feedback, |pagers, wanted| {
            pagers.iter_mut().for_each(|pager| pager.expect(wanted));
        });
    }

    /// Whether there is no bandwidth for a prediction, so that drawing one would be for nothing: pages in view have waited
    /// for the in-flight budget in two frames in a row, and there were no eight in a row since in which they have not.
    pub fn is_short_of_bandwidth(&self) -> bool {
        self.bandwidth.is_short
    }

    /// Frames after which 95 % of the last 256 tiles of each pool were in their slots, counted from their requests; the most of any
    /// pool, nothing before the first tile. A prediction is best of the view in so many frames, and those that feedback takes.
    pub fn arrival_frames(&self) -> Option<u32> {
        self.iter().filter_map(crate::pager::pool::Pager::arrival_frames).max()
    }
}
