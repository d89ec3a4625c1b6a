//! What comes after everything in view, best first, as far as there are slots: refreshes of resident pages
//! whose content has changed (those in view before the others), what the view is expected to want, and
//! prefetches in their order.

use std::cmp::Reverse;

use rustc_hash::FxHashSet;

use crate::pager::claims::Claims;
use crate::pager::reranks::Reranks;
use crate::residency::rank::{RankBand, rank_of};
use crate::residency::records::RecordHint;
use crate::residency::{PageState, Residency};
use crate::texture::page::{PageId, TextureNumber};
use crate::texture::textures::Textures;

/// What comes after everything in view, best first, as far as there are slots.
#[derive(Debug, Default)]
pub(super) struct ExplicitPlan {
    pages: Vec<PageId>,
    /// The last plan.
    before: Vec<PageId>,
    /// Where the search for the next request goes on.
    next_request: usize,
    /// Where the search for the next upload goes on.
    next_upload: usize,
    /// Something has changed for what was asked for.
    is_due: bool,
}

impl ExplicitPlan {
    /// Something has changed for what was asked for: the plan has to be made anew.
    pub(super) fn note_change(&mut self) {
        self.is_due = true;
    }

    /// Returns true if the plan has to be made anew before it is used.
    pub(super) fn is_due(&self) -> bool {
        self.is_due
    }

    pub(super) fn is_empty(&self) -> bool {
        self.pages.is_empty()
    }

    /// The pages planned, best first.
    pub(super) fn pages(&self) -> impl Iterator<Item = PageId> + Clone + '_ {
        self.pages.iter().copied()
    }

    /// Makes the plan anew, beside a view that needs so many slots, tails included.
    pub(super) fn rebuild(
        &mut self,
        in_view: u32,
        claims: &mut Claims,
        residency: &mut Residency,
        textures: &Textures,
        reranks: &mut Reranks,
    ) {
        self.is_due = false;
        std::mem::swap(&mut self.pages, &mut self.before);
        self.pages.clear();
        self.rewind();
        residency.begin_plan();
        residency.evict_stale_sharers(textures);
        // Slots that neither the view needs nor claimed pages are in, nor what stays for a while.
        let taken = in_view + residency.slots_claimed() + residency.kept_from_claims();
        let mut spare = residency.slot_count().saturating_sub(taken);
        self.list_refreshes(in_view, &mut spare, residency, textures);
        let too_many = self.list_claimed(&mut spare, claims, residency, textures);
        for (index, &page) in self.pages.iter().enumerate() {
            let rank = rank(residency, page, index);
            residency.hold(page);
            reranks.note(residency, page, rank);
        }
        for page in too_many {
            if matches!(residency.state(page), PageState::Loading | PageState::Ready) {
                residency.call_off(page);
            }
        }
        if !residency.sharing().is_empty() {
            // What was loaded for another page of the same content that nobody holds any more.
            call_off_unused(residency, &self.before);
        }
    }

    /// Lists the refreshes, those in view first. A stale sharer of a slot needs one of its own: in view it is
    /// counted with that, else, where it stays for its descendants, it takes one of those to spare, or goes
    /// with them where there is none.
    fn list_refreshes(
        &mut self,
        in_view: u32,
        spare: &mut u32,
        residency: &mut Residency,
        textures: &Textures,
    ) {
        self.pages.extend(residency.refreshes().pages());
        let is_wanted = |page: PageId| residency.is_wanted(page, RecordHint::default());
        self.pages.sort_unstable_by_key(|&page| (!is_wanted(page), Reverse(page.level()), page));
        if residency.sharing().is_empty() {
            return;
        }
        let view_fits = in_view <= residency.slot_count();
        let mut without_room = Vec::new();
        self.pages.retain(|&page| {
            if !residency.is_stale_sharer(page) || residency.refreshes().is_in_flight(page) {
                return true;
            }
            if is_wanted(page) {
                return view_fits;
            }
            let left = spare.checked_sub(1);
            match left {
                Some(left) => *spare = left,
                None => without_room.push(page),
            }
            left.is_some()
        });
        residency.evict_branches(&without_room, textures);
    }

    /// Lists the claimed pages that are missing, as far as there are slots; gives those for which there is
    /// none.
    fn list_claimed(
        &mut self,
        spare: &mut u32,
        claims: &mut Claims,
        residency: &mut Residency,
        textures: &Textures,
    ) -> Vec<PageId> {
        let (mut listed, mut too_many) = (FxHashSet::default(), Vec::new());
        for page in claims.pages_in_order() {
            let is_here = matches!(residency.state(page), PageState::Resident(_));
            let in_view = residency.is_wanted(page, RecordHint::default());
            // A page may be expected, and be in several tickets: it needs one slot.
            if is_here || in_view || !listed.insert(page) {
                continue;
            }
            let Some(page) = residency.load_after_view_for(page, textures) else { continue };
            match spare.checked_sub(1) {
                Some(left) => (*spare, ()) = (left, self.pages.push(page)),
                None => too_many.push(page),
            }
        }
        too_many
    }

    /// The best page that is to be asked for.
    pub(super) fn next_request(&mut self, residency: &Residency) -> Option<PageId> {
        let left = self.pages.get(self.next_request..)?;
        let is_due = |page: &PageId| {
            residency.state(*page) == PageState::Queued && residency.may_load(*page)
                || residency.refreshes().is_queued(*page)
        };
        self.next_request += left.iter().position(is_due).unwrap_or(left.len());
        self.pages.get(self.next_request).copied()
    }

    /// The next request, which is for this page, is made; gives its rank.
    pub(super) fn begin_request(&mut self, page: PageId, residency: &Residency) -> u64 {
        let rank = rank(residency, page, self.next_request);
        self.next_request += 1;
        rank
    }

    /// The best page whose tile waits for the upload budget.
    pub(super) fn next_upload(&mut self, residency: &Residency) -> Option<PageId> {
        if !residency.has_ready() && !residency.refreshes().any_ready() {
            return None;
        }
        let left = self.pages.get(self.next_upload..)?;
        let is_ready = |page: &PageId| {
            residency.state(*page) == PageState::Ready || residency.refreshes().is_ready(*page)
        };
        self.next_upload += left.iter().position(is_ready).unwrap_or(left.len());
        self.pages.get(self.next_upload).copied()
    }

    /// A tile has come: the search for uploads begins anew.
    pub(super) fn rewind_uploads(&mut self) {
        self.next_upload = 0;
    }

    fn rewind(&mut self) {
        (self.next_request, self.next_upload) = (0, 0);
    }

    /// Forgets a texture that is gone.
    pub(super) fn forget(&mut self, texture: TextureNumber) {
        self.pages.retain(|page| page.texture() != texture);
        self.rewind();
        self.is_due = true;
    }
}

/// Gives up loads of pages that nothing has a use for any more.
pub(super) fn call_off_unused(residency: &mut Residency, pages: &[PageId]) {
    for &page in pages {
        if !residency.has_use_for(page, RecordHint::default()) {
            residency.call_off(page);
        }
    }
}

/// The rank of a page of the plan.
fn rank(residency: &Residency, page: PageId, index: usize) -> u64 {
    let in_view = residency.is_wanted(page, RecordHint::default());
    rank_of(if in_view { RankBand::RefreshInView } else { RankBand::AfterView }, index)
}
