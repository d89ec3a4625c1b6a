//! The pager of one pool: what is wanted of its textures, how much coarser than wanted the picture is, and
//! what follows for each page.
//!
//! This file only joins: the set of pages wanted is `working_set`'s, how much coarser it is `bias`'s, the
//! states of pages `residency`'s, what is missing in view `load_order`'s, what comes after the view
//! `explicit_plan`'s. What all pools share (budgets, views, events, the numbers of textures) is the whole
//! pager's.

use bytes::Bytes;

use crate::pager::bias::{BiasControl, BiasRule};
use crate::pager::claims::Claims;
use crate::pager::decision::{Request, Upload};
use crate::pager::event::{Event, EventQueue};
use crate::pager::explicit_plan::ExplicitPlan;
use crate::pager::flight_share::FlightShare;
#[cfg(feature = "checks")]
use crate::pager::inspect::check_pace::CheckPace;
use crate::pager::load_order::LoadOrder;
use crate::pager::reranks::Reranks;
use crate::pager::rest::{PoolRest, do_without_given_up};
use crate::pager::working_set::WorkingSet;
use crate::residency::{PageState, Residency};
use crate::table::pool::{PoolId, Slot};
use crate::texture::page::PageId;
use crate::texture::textures::Textures;
use crate::wanted::feedback::Feedback;
use crate::wanted::view::ViewId;

/// One pool of a [`Pager`](crate::Pager), to be asked about its pages and its state.
#[derive(Debug)]
pub struct PoolPager {
    pool: PoolId,
    pub(super) textures: Textures,
    pub(super) residency: Residency,
    /// What the application, and predictions, hold pages by.
    pub(super) claims: Claims,
    pub(super) set: WorkingSet,
    pub(super) bias: BiasControl,
    pub(super) load_order: LoadOrder,
    pub(super) plan: ExplicitPlan,
    pub(super) reranks: Reranks,
    pub(super) rest: PoolRest,
    /// True if what has been ingested begins a new main view.
    cut: bool,
    /// The frame of the newest feedback.
    pub(super) newest_feedback: Option<u64>,
    /// Nothing was newly wanted in the last decision, and nothing was missing.
    quiet: bool,
    converged: bool,
    /// The mip bias of the last working set, and the last frame in which it fell.
    bias_before: u16,
    bias_fell: u64,
    /// Reused between frames to avoid allocating.
    pub(super) expected: Vec<(PageId, u32)>,
    #[cfg(feature = "checks")]
    pub(super) check_pace: CheckPace,
}

impl PoolPager {
    /// An empty pool of so many slots for tiles of so many bytes. Without a rule there is never a mip bias.
    pub(super) fn new(pool: PoolId, slots: u32, tile_bytes: u64, mip_bias: Option<BiasRule>) -> PoolPager {
        PoolPager {
            pool,
            textures: Textures::default(),
            residency: Residency::new(slots, tile_bytes),
            claims: Claims::new(pool),
            set: WorkingSet::new(),
            bias: BiasControl::new(mip_bias),
            load_order: LoadOrder::new(slots),
            plan: ExplicitPlan::default(),
            reranks: Reranks::default(),
            rest: PoolRest::default(),
            cut: false,
            newest_feedback: None,
            quiet: false,
            converged: false,
            bias_before: 0,
            bias_fell: 0,
            expected: Vec::new(),
            #[cfg(feature = "checks")]
            check_pace: CheckPace::default(),
        }
    }

    /// A frame begins: its clock is set, and claims and refreshes whose time has come are looked at.
    pub(super) fn begin_frame(&mut self, frame: u64, events: &mut EventQueue) {
        self.residency.begin_frame(frame);
        self.set.begin_frame();
        self.reranks.clear();
        self.load_order.begin_frame();
        self.begin_plan(frame, events);
    }

    /// Takes in what a view wanted of the pool's textures. The working set follows when it is next
    /// recomputed.
    pub(super) fn ingest(&mut self, feedback: &Feedback) {
        if self.set.is_cut(feedback, &self.textures) {
            self.set.restart(feedback.view);
            // Of other views a cut leaves the bias as it is: the main view would feel it, and they may jump
            // often.
            if feedback.view == ViewId::MAIN {
                self.bias.restart();
                self.cut = true;
            }
        }
        self.newest_feedback = self.newest_feedback.max(Some(feedback.frame));
        self.set.observe(feedback, &self.textures);
    }

    /// What follows from the feedback that was ingested, but for what pools have to know of each other first:
    /// [`PoolPager::end_round`] follows.
    pub(super) fn decide(&mut self, events: &mut EventQueue) {
        self.rest.follow(&self.set, &mut self.bias, &mut self.residency);
        let bias_before = self.bias.bias();
        let newly_wanted = self.recompute(events);
        self.rest.settle(bias_before, &self.set, &mut self.bias, &mut self.residency);
        self.residency.trim_shared(&self.textures, self.rest.is_under_way());
        let in_view = self.set.pages_at(self.bias.bias()).filter(|(_, node)| node.pixels > 0);
        let cut = std::mem::take(&mut self.cut);
        self.residency.observe_view(in_view.map(|(page, _)| page), cut, &self.textures);
        self.quiet = newly_wanted == 0 && self.load_order.pages().all(|page| self.residency.has_failed(page));
        let residency = &self.residency;
        self.set.note_failed(residency.remembers_failures(), |page| residency.has_failed(page));
    }

    /// What a decision has come to, once it was made in every pool.
    pub(super) fn end_round(&mut self, frame: u64) {
        // A view that rests has its gaps looked for whatever others newly want.
        let is_settled = |view: &ViewId| self.quiet || self.has_all_of(*view);
        let settled = self.set.views_with_gaps().filter(|(_, view)| is_settled(view));
        let settled = settled.fold(0, |settled, (index, _)| settled | 1_u64 << index);
        self.set.look_again(self.last_change());
        self.converged = self.set.end_round(self.quiet, settled, frame);
        self.check();
    }

    /// Makes the set and the bias anew, and what follows for every page; gives how many pages were not in the
    /// last set.
    pub(super) fn recompute(&mut self, events: &mut EventQueue) -> u32 {
        self.rebuild_set();
        self.update_bias(events);
        self.note_bias();
        let newly_wanted = self.want_pages();
        if self.plan.is_due() || !self.plan.is_empty() || !self.claims.are_none() {
            self.rebuild_plan();
        }
        newly_wanted
    }

    fn note_bias(&mut self) {
        let bias = self.bias.bias();
        let fell = std::mem::replace(&mut self.bias_before, bias) > bias;
        // By another rule it may rise and fall for ever.
        if fell && self.bias.rule() == Some(BiasRule::Solved) {
            self.bias_fell = self.residency.frame();
        }
    }

    /// The last frame in which a page made room or the mip bias fell: looks for gaps from before it do not
    /// count.
    pub(super) fn last_change(&self) -> u64 {
        self.residency.last_evicted().max(self.bias_fell)
    }

    pub(super) fn rebuild_set(&mut self) {
        let residency = &self.residency;
        self.set.rebuild(
            |page, record| residency.find(page, record),
            |page| residency.has_given_up(page),
            |page| residency.sharing().of(page),
        );
    }

    pub(super) fn rebuild_plan(&mut self) {
        let in_view = self.in_view() + self.residency.tails();
        let PoolPager { plan, claims, residency, textures, reranks, .. } = self;
        plan.rebuild(in_view, claims, residency, textures, reranks);
    }

    /// Tiles of the working set at the bias in force, without tails.
    fn in_view(&self) -> u32 {
        self.set.size_at(self.bias.bias())
    }

    fn update_bias(&mut self, events: &mut EventQueue) {
        let (tails, slots) = (self.residency.tails(), self.residency.slot_count());
        let mut needs_more = self.bias.update(&self.set, slots, tails);
        let updated = self.bias.bias();
        do_without_given_up(&self.set, &mut self.bias, &self.residency);
        needs_more |= self.bias.bias() > updated;
        if needs_more {
            events.push(Event::Oversubscribed {
                pool: self.pool,
                wanted: self.set.size_at(0) + tails,
                slots,
                occupied: self.residency.stats().occupied,
                bias_eighths: self.bias.bias(),
                largest: self.largest_textures(),
            });
        }
    }

    /// Makes the new working set known to the residency; gives how many pages were not in the last one.
    fn want_pages(&mut self) -> u32 {
        let PoolPager { set, bias, residency, textures, load_order, reranks, .. } = self;
        residency.begin_round();
        let wanted = set.pages_at(bias.bias());
        let newly =
            wanted.map(|(page, node)| u32::from(residency.want(page, node.content, node.record))).sum();
        load_order.call_off_unused(residency);
        load_order.rebuild(set, bias.bias(), residency, textures);
        reranks.clear();
        self.fit_slots();
        newly
    }

    pub(super) fn fit_slots(&mut self) {
        let in_view = self.in_view();
        self.load_order.fit_slots(in_view, &mut self.residency, &mut self.reranks);
    }

    /// The best page in view that is to be asked for, as far as the share of its texture allows.
    pub(super) fn next_in_view(&mut self, share: FlightShare) -> Option<PageId> {
        self.load_order.next_request(&mut self.residency, share)
    }

    /// The best page that is to be asked for after everything in view.
    pub(super) fn next_after_view(&mut self) -> Option<PageId> {
        self.plan.next_request(&self.residency)
    }

    /// Asks for the page that [`PoolPager::next_in_view`] has given.
    pub(super) fn request_in_view(&mut self, page: PageId) -> Option<Request> {
        let rank = self.load_order.begin_request();
        self.residency.begin_load(page, rank);
        self.check();
        self.request(page, rank)
    }

    /// Asks for the page that [`PoolPager::next_after_view`] has given.
    pub(super) fn request_after_view(&mut self, page: PageId) -> Option<Request> {
        let rank = self.plan.begin_request(page, &self.residency);
        let _ = self.residency.begin_load(page, rank) || self.residency.begin_refresh(page, rank);
        self.check();
        self.request(page, rank)
    }

    pub(super) fn poll_rerank(&mut self) -> Option<Request> {
        while let Some((page, rank)) = self.reranks.pop(&self.residency) {
            self.residency.rerank(page, rank);
            // A texture that is gone has no position for its page, and others may wait behind it.
            if let Some(request) = self.request(page, rank) {
                return Some(request);
            }
        }
        None
    }

    fn request(&self, page: PageId, rank: u64) -> Option<Request> {
        self.textures.pos(page).map(|(_, pos)| Request { page, pos, rank })
    }

    pub(super) fn tile_ready(&mut self, page: PageId, bytes: Bytes) {
        self.residency.loaded(page, bytes);
        self.load_order.rewind_uploads();
        self.plan.rewind_uploads();
        self.check();
    }

    pub(super) fn tile_failed(&mut self, page: PageId, why: String, events: &mut EventQueue) {
        if !self.textures.contains(page) {
            self.residency.load_cancelled(page); // its texture was removed, so there is nothing to try again
        } else if self.residency.load_failed(page) {
            events.push(Event::Failed { pool: self.pool, page, why });
        }
        self.check();
    }

    pub(super) fn tile_cancelled(&mut self, page: PageId) {
        self.residency.load_cancelled(page);
        self.check();
    }

    /// The best page in view whose tile waits for the upload budget.
    pub(super) fn next_upload_in_view(&mut self) -> Option<PageId> {
        self.load_order.next_upload(&self.residency)
    }

    /// The best page after everything in view whose tile waits for the upload budget.
    pub(super) fn next_upload_after_view(&mut self) -> Option<PageId> {
        self.plan.next_upload(&self.residency)
    }

    /// Puts the tile of a page, which waits for the upload budget, into a slot; `None` if none is to be had
    /// in this frame.
    pub(super) fn upload(&mut self, page: PageId) -> Option<Upload> {
        if self.residency.refreshes().is_ready(page) {
            return self.upload_refresh(page).or_else(|| self.unblock_eviction());
        }
        let Some((slot, evicted)) = self.slot_for(page) else {
            return self.unblock_eviction();
        };
        let bytes = self.residency.settle(page, slot, &self.textures)?;
        self.check();
        Some(Upload { page, slot, bytes, evicted })
    }

    /// A slot for the tile of a page, and the page that gave it up.
    fn slot_for(&mut self, page: PageId) -> Option<(Slot, Option<PageId>)> {
        let (slot, evicted) = self.residency.take_slot(&self.textures)?;
        if let Some(evicted) = evicted.filter(|_| !self.residency.is_for_view(page)) {
            self.residency.allow_again(evicted);
        }
        Some((slot, evicted))
    }

    /// Puts the new tile of a page over the old one, or, where that is others' too, into a slot of its own;
    /// `None` if none has come for the page, or no slot is to be had.
    fn upload_refresh(&mut self, page: PageId) -> Option<Upload> {
        let mut evicted = None;
        if self.residency.is_stale_sharer(page) && self.residency.refreshes().is_ready(page) {
            let (slot, gone) = self.slot_for(page)?;
            self.residency.move_stale_sharer(page, slot);
            evicted = gone;
        }
        let (slot, bytes) = self.residency.settle_refresh(page)?;
        self.check();
        Some(Upload { page, slot, bytes, evicted })
    }

    /// Called when no victim exists. Pages out of view with a refresh in flight cannot be evicted, so either
    /// uploads one such refresh now, or discards its tile so that its page can be evicted.
    fn unblock_eviction(&mut self) -> Option<Upload> {
        let residency = &self.residency;
        let ready = || self.plan.pages().filter(|&page| residency.refreshes().is_ready(page));
        let in_own_slot = ready().find(|&page| !residency.is_stale_sharer(page));
        let out_of_view = ready().find(|&page| !residency.is_in_view(page));
        if let Some(page) = in_own_slot {
            return self.upload_refresh(page);
        }
        // A page out of view that stays for a while is no reason to lose what has come for another.
        if !self.residency.keeps_all_of_rest() {
            self.residency.invalidate(out_of_view?);
        }
        None
    }

    /// Returns true if, for a whole jitter cycle of every view that is being drawn, and of one whose gaps are
    /// looked for ([`Pager::set_gap_passes`](crate::Pager::set_gap_passes)) for all pixels, no page was newly
    /// wanted and none missing at the bias in force. A page that has failed counts as answered. A view that
    /// was not drawn for a jitter cycle of the others is not waited for.
    pub fn is_converged(&self) -> bool {
        self.converged && !self.set.is_outdated(self.last_change()) && !self.becomes_sharper()
    }

    /// Returns true if the views rest and the mip bias falls as soon as there were enough feedbacks.
    pub(super) fn becomes_sharper(&self) -> bool {
        let (slots, tails) = (self.residency.slot_count(), self.residency.tails());
        // Also where a rest was ended that the next feedback begins anew.
        self.set.rest_number().is_some() && self.bias.may_fall(&self.set, slots, tails)
    }

    /// Returns true if a view has been seen for a whole jitter cycle, and all that it wanted of the pool in
    /// that is resident at the bias in force, or could not be had. Costs a visit of each page of the working
    /// set.
    pub(super) fn has_all_of(&self, view: ViewId) -> bool {
        let is_had =
            |page| self.residency.has_failed(page) || matches!(self.state(page), PageState::Resident(_));
        self.set.pages_of(view, self.bias_eighths()).is_some_and(|mut pages| pages.all(is_had))
    }

    /// The pool.
    pub fn pool(&self) -> PoolId {
        self.pool
    }

    /// How the mip bias is decided; `None` if the pool never has one.
    pub fn bias_rule(&self) -> Option<BiasRule> {
        self.bias.rule()
    }

    /// The mip bias in force, in eighths of a level.
    pub fn bias_eighths(&self) -> u16 {
        self.bias.bias()
    }

    /// The state of a page; of one that waits for another of the same content, that one's.
    pub fn state(&self, page: PageId) -> PageState {
        let state = self.residency.state(page);
        let representative =
            self.residency.sharing().representative_of(page).filter(|_| state == PageState::Queued);
        representative.map_or(state, |representative| self.residency.state(representative))
    }

    /// The pages whose tiles are in slots, tails among them, and the slot of each: the same for pages that
    /// share one. In no order. Costs a visit of every page that has a state.
    pub fn resident(&self) -> impl Iterator<Item = (PageId, Slot)> + '_ {
        self.residency.resident()
    }

    /// The pages of the working set that could not be had so far.
    pub fn failed_pages(&self) -> impl Iterator<Item = PageId> + '_ {
        self.load_order.pages().filter(|&page| self.residency.has_failed(page))
    }
}

/// What the simulated world looks at.
#[cfg(feature = "sim")]
impl PoolPager {
    /// Bytes of each of its tiles.
    pub(crate) fn tile_bytes(&self) -> u64 {
        self.residency.tile_bytes()
    }

    /// Returns true if there is such a texture.
    pub(crate) fn has_texture(&self, texture: crate::texture::page::TextureNumber) -> bool {
        self.textures.geometry(texture).is_some()
    }

    /// Returns true if the page's tile is for what is in view.
    pub(crate) fn is_for_view(&self, page: PageId) -> bool {
        self.residency.is_for_view(page)
    }

    /// The pages of the working set at the bias in force.
    pub(crate) fn pages_in_view(&self) -> impl Iterator<Item = PageId> + '_ {
        self.set.pages_at(self.bias.bias()).map(|(page, _)| page)
    }
}
