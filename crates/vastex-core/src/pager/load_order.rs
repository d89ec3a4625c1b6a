//! What is missing in view, best first: how far its requests and its uploads are, and for how many more loads
//! there is a slot.
//!
//! Of the missing pages of one content one is loaded, the others wait and join it in its slot.

use crate::pager::flight_share::FlightShare;
use crate::pager::ranking::{Missing, Ranking};
use crate::pager::reranks::Reranks;
use crate::pager::working_set::WorkingSet;
use crate::residency::rank::{RankBand, rank_of};
use crate::residency::records::RecordHint;
use crate::residency::{PageState, Residency};
use crate::texture::page::{PageId, TextureNumber};
use crate::texture::textures::Textures;

/// What is missing in view, best first, and how far its requests and uploads are.
#[derive(Debug)]
pub(super) struct LoadOrder {
    ranking: Ranking,
    /// Missing pages of the working set, best first. Of several pages with one content, only the one that is
    /// loaded for all of them.
    order: Vec<Missing>,
    /// Missing pages whose content another page is already loading.
    waiting: Vec<PageId>,
    /// Where the search for the next request goes on.
    next_request: usize,
    /// Where the search for the next upload goes on.
    next_upload: usize,
    /// The first page that was passed over since its texture has its share of what is in flight.
    held_back: Option<usize>,
    /// Slots that no page in view and no tile in flight has a claim to: so many more loads find one.
    room: u32,
}

impl LoadOrder {
    pub(super) fn new(slots: u32) -> LoadOrder {
        LoadOrder {
            ranking: Ranking::default(),
            order: Vec::new(),
            waiting: Vec::new(),
            next_request: 0,
            next_upload: 0,
            held_back: None,
            room: slots,
        }
    }

    /// The missing pages, best first. Of several pages with one content, only the one that is loaded for all
    /// of them.
    pub(super) fn pages(&self) -> impl Iterator<Item = PageId> + '_ {
        self.order.iter().map(|missing| missing.page)
    }

    /// Gives up what was missing and is of no use in the working set that the residency now knows.
    pub(super) fn call_off_unused(&mut self, residency: &mut Residency) {
        for page in self.waiting.drain(..) {
            if !residency.has_use_for(page, RecordHint::default()) {
                residency.leave_working_set(page); // the load is another's
            }
        }
        for &Missing { page, record } in &self.order {
            if !residency.has_use_for(page, record) {
                residency.call_off(page);
            }
        }
    }

    /// Lists what is missing of the set at a bias, and begins the searches anew.
    pub(super) fn rebuild(
        &mut self,
        set: &WorkingSet,
        bias: u16,
        residency: &mut Residency,
        textures: &Textures,
    ) {
        self.ranking.order_missing(set, bias, textures, &mut self.order);
        if !residency.sharing().is_empty() {
            self.choose_representatives(residency, textures);
        }
        self.rewind();
    }

    /// Of the missing pages of one content leaves the one in the order that is loaded, and none where the
    /// content is here.
    fn choose_representatives(&mut self, residency: &mut Residency, textures: &Textures) {
        let LoadOrder { order, waiting, .. } = self;
        order.retain_mut(|missing| {
            let page = missing.page;
            match residency.load_for(page, textures) {
                Some(representative) if representative == page => true,
                Some(representative) => {
                    waiting.push(page);
                    *missing = Missing { page: representative, record: RecordHint::default() };
                    true
                }
                None => {
                    waiting.extend(Some(page).filter(|&page| residency.state(page) == PageState::Queued));
                    false
                }
            }
        });
    }

    /// Pages that wait for a tile which has come join it.
    pub(super) fn join_waiting(&self, residency: &mut Residency, textures: &Textures) {
        for &page in &self.waiting {
            if residency.state(page) == PageState::Queued {
                residency.join(page, textures);
            }
        }
    }

    /// Counts the slots that further loads can have, where so many tiles of the set are in view; gives up
    /// tiles in flight that would find none, and ranks the others. Slots run out only where the mip bias may
    /// not act: there a tile that waited for a slot forever would hold a part of the in-flight budget.
    pub(super) fn fit_slots(&mut self, in_view: u32, residency: &mut Residency, reranks: &mut Reranks) {
        let here = in_view.saturating_sub(self.order.len() as u32) + residency.tails();
        // What stays for a while makes no room for what is missing.
        let kept = if self.order.is_empty() { 0 } else { residency.kept_from_views() };
        self.room = residency.slot_count().saturating_sub(here + kept);
        let mut in_flight = residency.stats().in_flight;
        for (index, &Missing { page, .. }) in self.order.iter().enumerate() {
            if in_flight == 0 {
                break;
            }
            if !matches!(residency.state(page), PageState::Loading | PageState::Ready) {
                continue;
            }
            in_flight -= 1;
            if self.room > 0 {
                self.room -= 1;
                reranks.note(residency, page, rank_of(RankBand::View, index));
            } else {
                residency.call_off(page);
            }
        }
    }

    /// The best queued page that would find a slot and whose texture may hold more of the in-flight budget.
    /// Costs a look at each page that is passed over, again in each frame.
    pub(super) fn next_request(&mut self, residency: &mut Residency, share: FlightShare) -> Option<PageId> {
        while let Some(&Missing { page, .. }) = self.order.get(self.next_request) {
            if residency.state(page) == PageState::Queued && residency.may_load(page) {
                if share.may_hold_more(residency, page.texture()) {
                    return Some(page).filter(|_| self.has_room());
                }
                self.held_back = self.held_back.or(Some(self.next_request));
                residency.note_passed_over(page.texture());
            }
            self.next_request += 1;
        }
        None
    }

    /// The next request is made; gives its rank.
    pub(super) fn begin_request(&mut self) -> u64 {
        let rank = rank_of(RankBand::View, self.next_request);
        self.next_request += 1;
        self.room -= 1;
        rank
    }

    /// The best page whose tile waits for the upload budget.
    pub(super) fn next_upload(&mut self, residency: &Residency) -> Option<PageId> {
        if !residency.has_ready() {
            return None;
        }
        let left = self.order.get(self.next_upload..)?;
        let is_ready = |missing: &Missing| residency.state(missing.page) == PageState::Ready;
        self.next_upload += left.iter().position(is_ready).unwrap_or(left.len());
        self.order.get(self.next_upload).map(|missing| missing.page)
    }

    /// A tile has come: the search for uploads begins anew.
    pub(super) fn rewind_uploads(&mut self) {
        self.next_upload = 0;
    }

    fn rewind(&mut self) {
        (self.next_request, self.next_upload, self.held_back) = (0, 0, None);
    }

    /// A frame begins: what was passed over is looked at again.
    pub(super) fn begin_frame(&mut self) {
        if let Some(index) = self.held_back.take() {
            self.next_request = self.next_request.min(index);
        }
    }

    /// Returns true if a page was passed over since its texture has its share of what is in flight.
    pub(super) fn is_held_back(&self) -> bool {
        self.held_back.is_some()
    }

    /// Returns true if a load that began now would find a slot.
    pub(super) fn has_room(&self) -> bool {
        self.room > 0
    }

    /// A texture has come, whose tail has taken a slot; `shares` where its pages may wait for each other.
    pub(super) fn add_texture(&mut self, slots: u32, shares: bool) {
        self.room = self.room.saturating_sub(1);
        if shares {
            self.waiting.reserve(slots as usize);
        }
    }

    /// Forgets a texture that is gone.
    pub(super) fn forget(&mut self, texture: TextureNumber) {
        self.order.retain(|missing| missing.page.texture() != texture);
        self.waiting.retain(|page| page.texture() != texture);
        self.rewind();
    }
}
