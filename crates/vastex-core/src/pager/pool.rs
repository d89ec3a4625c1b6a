//! The pager: feedback goes in, decisions come out.
//!
//! Each frame: [`Pager::begin_frame`], [`Pager::observe`] for the feedback that has arrived, the loader's results
//! ([`Pager::tile_ready`], [`Pager::tile_failed`], [`Pager::tile_cancelled`]), then the decisions, as values:
//! [`Pager::poll_cancel`], [`Pager::poll_rerank`] and [`Pager::poll_request`] for the loader, [`Pager::poll_upload`] and
//! [`Pager::take_table_changes`] for the GPU, [`Pager::poll_event`] for the application. It never calls back, and nothing
//! that it does can fail once a texture is in: too little memory makes the picture coarser.
//!
//! This file only joins: the set of pages wanted is `working_set`'s, how much coarser it is `bias`'s, the states of pages
//! `residency`'s, the order of loading `order`'s, what the loader is told of it `ranks`', the rate of uploads `budget`'s, each texture's
//! share of what is in flight `flight`'s.

use std::collections::VecDeque;

use bytes::Bytes;

use crate::pager::bias::BiasControl;
use crate::pager::budget::{Beside, UploadBucket};
use crate::pager::claims::Claims;
use crate::pager::decision::{Request, Upload};
use crate::pager::event::{Event, EventQueue};
#[cfg(feature = "checks")]
use crate::pager::inspect::savings::Savings;
use crate::pager::order::Ranking;
use crate::pager::reranks::Reranks;
use crate::pager::settings::PagerSettings;
use crate::pager::working_set::{Node, WorkingSet};
use crate::residency::rank::{Band, rank_of};
use crate::residency::records::RecordHint;
use crate::residency::{PageState, Residency};
use crate::table::pool::{PoolId, Slot};
use crate::texture::page::{PageId, TextureId};
use crate::texture::textures::Textures;
use crate::wanted::feedback::Feedback;
use crate::wanted::view::ViewId;

/// Loads given up at once for which there is room from the start: that is seldom exceeded, so frames allocate nothing for more of them.
const CANCELS: usize = 64;

/// Decides what is loaded, what is evicted and how coarse the picture is, for the textures of one pool.
#[derive(Debug)]
pub struct Pager {
    /// The pool that events name.
    pool: PoolId,
    pub(super) settings: PagerSettings,
    pub(super) textures: Textures,
    pub(super) residency: Residency,
    /// What the application, and predictions, hold pages by.
    pub(super) claims: Claims,
    pub(super) set: WorkingSet,
    pub(super) bias: BiasControl,
    pub(super) bucket: UploadBucket,
    ranking: Ranking,
    /// Missing pages of the working set, best first; of those of one content the one that is loaded for all.
    pub(super) order: Vec<PageId>,
    /// The others.
    pub(super) waiting: Vec<PageId>,
    /// Where the search for the next request goes on.
    pub(super) next_request: usize,
    /// The first place that was passed over since its texture has its share of what is in flight.
    pub(super) held_back: Option<usize>,
    /// What shares the budget.
    pub(super) beside: Beside,
    /// Where the search for the next upload goes on.
    pub(super) next_upload: usize,
    /// Slots that no page in view and no tile in flight has a claim to: so many more loads find one.
    pub(super) room: u32,
    /// What comes after everything in view, best first; see `by_hand`.
    pub(super) by_hand: Vec<PageId>,
    /// The last plan, kept for its memory.
    pub(super) was_by_hand: Vec<PageId>,
    /// Where the search for the next request among these goes on.
    pub(super) next_by_hand: usize,
    /// Where the search for the next upload among these goes on.
    pub(super) next_upload_by_hand: usize,
    /// Something has changed for what was asked for by hand.
    pub(super) plan_due: bool,
    pub(super) pins_changed: bool,
    pub(super) cancels: VecDeque<PageId>,
    pub(super) reranks: Reranks,
    pub(super) events: EventQueue,
    /// Whether what has been taken in begins a new main view.
    cut: bool,
    /// The frame of the newest feedback.
    pub(super) newest_feedback: Option<u64>,
    converged: bool,
    #[cfg(feature = "checks")]
    pub(super) savings: Savings,
}

impl Pager {
    /// A pager for an empty pool, which is the only one.
    pub fn new(settings: PagerSettings) -> Pager {
        Pager::of_pool(PoolId::default(), settings)
    }

    pub(crate) fn of_pool(pool: PoolId, settings: PagerSettings) -> Pager {
        Pager {
            pool,
            settings,
            textures: Textures::default(),
            residency: Residency::new(settings.slots, settings.tile_bytes),
            claims: Claims::new(pool),
            set: WorkingSet::new(),
            bias: BiasControl::new(settings.slots, settings.mip_bias),
            bucket: UploadBucket::new(settings.upload_bytes_per_frame, settings.tile_bytes),
            ranking: Ranking::default(),
            order: Vec::new(),
            waiting: Vec::new(),
            next_request: 0,
            held_back: None,
            beside: Beside::default(),
            next_upload: 0,
            room: settings.slots,
            by_hand: Vec::new(),
            was_by_hand: Vec::new(),
            next_by_hand: 0,
            next_upload_by_hand: 0,
            plan_due: false,
            pins_changed: false,
            cancels: VecDeque::with_capacity(CANCELS),
            reranks: Reranks::default(),
            events: EventQueue::default(),
            cut: false,
            newest_feedback: None,
            converged: false,
            #[cfg(feature = "checks")]
            savings: Savings::default(),
        }
    }

    /// A frame begins. `frame` never falls.
    pub fn begin_frame(&mut self, frame: u64) {
        self.residency.begin_frame(frame);
        self.bucket.begin_frame();
        self.reranks.clear();
        self.look_again();
        self.begin_by_hand(frame);
    }

    /// Takes in what a view wanted: marks what is resident as used and queues the rest.
    ///
    /// Costs a visit of each page of the working set and of the pages now missing.
    pub fn observe(&mut self, feedback: &Feedback) {
        self.observe_views(std::slice::from_ref(feedback));
    }

    /// Takes in what several views wanted in a frame, and decides once: what each wanted is in the working set. Feedback of
    /// a view that there is not is dropped.
    pub fn observe_views(&mut self, feedbacks: &[Feedback]) {
        feedbacks.iter().for_each(|feedback| self.ingest(feedback));
        if !feedbacks.is_empty() {
            self.decide();
        }
    }

    /// The working set follows when it is next worked out.
    pub(crate) fn ingest(&mut self, feedback: &Feedback) {
        if self.set.is_cut(feedback, &self.textures) {
            self.set.restart(feedback.view);
            // Of other views a cut leaves the bias as it is: the main view would feel it, and they may jump often.
            if feedback.view == ViewId::MAIN {
                self.bias.restart();
                self.cut = true;
            }
        }
        self.newest_feedback = self.newest_feedback.max(Some(feedback.frame));
        self.set.observe(feedback, &self.textures);
    }

    /// What follows from the feedback that was taken in.
    pub(crate) fn decide(&mut self) {
        let newly_wanted = self.recompute();
        self.residency.trim_shared(&self.textures);
        let in_view = self.set.pages_at(self.bias.bias()).filter(|(_, node)| node.pixels > 0);
        let cut = std::mem::take(&mut self.cut);
        self.residency.observe_view(in_view.map(|(page, _)| page), cut, &self.textures);
        self.note_convergence(newly_wanted);
        self.check();
    }

    /// Works out the set and the bias, and what follows for every page; says how many pages were not in the last set.
    pub(crate) fn recompute(&mut self) -> u32 {
        self.rebuild_set();
        self.update_bias();
        let newly_wanted = self.want_pages();
        if self.plan_due || self.has_by_hand() {
            self.plan_by_hand();
        }
        newly_wanted
    }

    pub(super) fn rebuild_set(&mut self) {
        let residency = &self.residency;
        self.set.rebuild(|page, record| residency.find(page, record), |page| residency.sharing().of(page));
    }

    fn update_bias(&mut self) {
        let pins = self.residency.tails();
        if self.bias.update(&self.set, pins) {
            self.events.push(Event::Oversubscribed {
                pool: self.pool,
                wanted: self.set.size_at(0) + pins,
                slots: self.settings.slots,
                occupied: self.residency.stats().occupied,
                bias_eighths: self.bias.bias(),
                largest: self.largest_textures(),
            });
        }
    }

    /// Tells the residency the new working set; says how many pages were not in the last one.
    fn want_pages(&mut self) -> u32 {
        let bias = self.bias.bias();
        let was_missing = std::mem::take(&mut self.order);
        self.residency.begin_round();
        let want =
            |(page, node): (PageId, &Node)| u32::from(self.residency.want(page, node.content, node.record));
        let newly = self.set.pages_at(bias).map(want).sum();
        for page in self.waiting.drain(..) {
            if !self.residency.has_use_for(page, RecordHint::default()) {
                self.residency.unwant(page); // the load is another's
            }
        }
        // A hint of another page, as after a removal, does no harm.
        for (&page, record) in was_missing.iter().zip(self.ranking.records()) {
            if !self.residency.has_use_for(page, record) {
                self.residency.unwant(page);
                if self.residency.state(page) == PageState::Loading {
                    self.cancels.push_back(page);
                }
            }
        }
        self.order = was_missing;
        self.ranking.order_missing(&self.set, bias, &self.textures, &mut self.order);
        self.order_shared();
        (self.next_request, self.held_back, self.next_upload) = (0, None, 0);
        self.reranks.clear();
        self.make_room();
        newly
    }

    /// Counts the slots that further loads can have, lets go of tiles in flight that would find none, and ranks the others. There is
    /// none only where the bias may not act: a tile that waited for a slot forever would hold a part of the in-flight budget.
    pub(super) fn make_room(&mut self) {
        let missing = self.order.len() as u32;
        let in_view = self.set.size_at(self.bias.bias()).saturating_sub(missing) + self.residency.tails();
        self.room = self.settings.slots.saturating_sub(in_view);
        let mut in_flight = self.residency.stats().in_flight;
        for place in 0..self.order.len() {
            if in_flight == 0 {
                break;
            }
            let page = self.order[place];
            let state = self.residency.state(page);
            in_flight -= u32::from(matches!(state, PageState::Loading | PageState::Ready));
            match state {
                PageState::Loading | PageState::Ready if self.room > 0 => {
                    self.room -= 1;
                    self.reranks.note(&self.residency, page, rank_of(Band::View, place));
                }
                PageState::Loading | PageState::Ready => self.drop_load(page),
                _ => {}
            }
        }
    }

    /// The page is not resident, and its load is worth nothing.
    pub(crate) fn drop_load(&mut self, page: PageId) {
        self.residency.unwant(page);
        if self.residency.state(page) == PageState::Loading {
            self.cancels.push_back(page);
        }
    }

    fn note_convergence(&mut self, newly_wanted: u32) {
        let quiet = newly_wanted == 0 && self.order.iter().all(|&page| self.residency.has_failed(page));
        let converged = self.set.end_round(quiet);
        if converged && !self.converged {
            self.events.push(Event::Converged { frame: self.residency.frame() });
        }
        self.converged = converged;
    }

    /// Whether a load that began now would find no slot.
    pub(crate) fn has_no_room(&self) -> bool {
        self.room == 0
    }

    /// The next tile to load, best first, while the in-flight budget allows one.
    pub fn poll_request(&mut self) -> Option<Request> {
        self.poll_request_in_view().or_else(|| self.poll_request_by_hand())
    }

    fn poll_request_in_view(&mut self) -> Option<Request> {
        let in_flight = self.residency.stats().in_flight_bytes;
        if in_flight > 0 && in_flight + self.residency.flight_bytes() > self.settings.in_flight_bytes {
            return None;
        }
        let page = self.next_queued()?;
        let rank = rank_of(Band::View, self.next_request);
        self.next_request += 1;
        self.room -= 1;
        self.residency.begin_load(page, rank);
        self.check();
        self.textures.pos(page).map(|(_, pos)| Request { page, pos, rank })
    }

    /// A load that the loader has and should move within its queue: the request again, with the rank that it has from now on. What
    /// the loader has begun or ended already stays as it is, and each load is answered once all the same.
    ///
    /// To be asked for in each frame before [`Pager::poll_request`]; what is left when the next decision is made is forgotten, and
    /// comes again if it still holds.
    pub fn poll_rerank(&mut self) -> Option<Request> {
        let (page, rank) = self.reranks.pop(&self.residency)?;
        self.residency.rerank(page, rank);
        self.textures.pos(page).map(|(_, pos)| Request { page, pos, rank })
    }

    /// A load that is no longer worth finishing. The loader answers every request, this one too: with
    /// [`Pager::tile_cancelled`], or with the tile if it was too late.
    pub fn poll_cancel(&mut self) -> Option<PageId> {
        while let Some(page) = self.cancels.pop_front() {
            if self.residency.send_cancel(page) {
                return Some(page);
            }
        }
        None
    }

    /// The tile of a request is here, decoded: all layers, [`PagerSettings::tile_bytes`] bytes.
    pub fn tile_ready(&mut self, page: PageId, bytes: Bytes) {
        self.residency.loaded(page, bytes);
        (self.next_upload, self.next_upload_by_hand) = (0, 0);
        self.check();
    }

    /// The tile of a request cannot be had. It is tried again later; its ancestor stays on screen.
    pub fn tile_failed(&mut self, page: PageId, why: impl Into<String>) {
        if !self.textures.contains(page) {
            self.residency.load_cancelled(page); // its texture was removed, so there is nothing to try again
        } else if self.residency.load_failed(page) {
            self.events.push(Event::Failed { pool: self.pool, page, why: why.into() });
        }
        self.check();
    }

    /// The loader has dropped a request that was called off.
    pub fn tile_cancelled(&mut self, page: PageId) {
        self.residency.load_cancelled(page);
        self.check();
    }

    /// The next tile to copy into a slot, while the upload budget allows one.
    pub fn poll_upload(&mut self) -> Option<Upload> {
        let page = self.next_ready().or_else(|| self.next_ready_by_hand())?;
        if self.bucket.available() < self.settings.tile_bytes {
            return None;
        }
        if self.residency.refreshes().is_ready(page) {
            return self.upload_refresh(page).or_else(|| self.make_way());
        }
        let Some((slot, evicted)) = self.residency.take_slot(&self.textures) else {
            return self.make_way();
        };
        self.bucket.take(self.settings.tile_bytes);
        let (bytes, recovered) = self.residency.settle(page, slot, &self.textures)?;
        if recovered {
            self.events.push(Event::Recovered { pool: self.pool, page });
        }
        self.check();
        Some(Upload { page, slot, bytes, evicted })
    }

    /// The best page whose tile waits for the upload budget.
    pub(crate) fn next_ready(&mut self) -> Option<PageId> {
        if !self.residency.has_ready() {
            return None;
        }
        let left = self.order.get(self.next_upload..)?;
        let ready = |page: &PageId| self.residency.state(*page) == PageState::Ready;
        self.next_upload += left.iter().position(ready).unwrap_or(left.len());
        self.order.get(self.next_upload).copied()
    }

    /// The next thing that an application wants to know.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.poll()
    }

    /// Whether, for a whole jitter cycle of every view that is being drawn, no page was newly wanted and none missing at the bias
    /// in force. A page that has failed counts as answered. A view that was not drawn for a jitter cycle of the others is not
    /// waited for.
    pub fn is_converged(&self) -> bool {
        self.converged
    }

    /// The pool.
    pub fn pool(&self) -> PoolId {
        self.pool
    }

    /// The mip bias in force, in eighths of a level.
    pub fn bias_eighths(&self) -> u16 {
        self.bias.bias()
    }

    /// Bytes of each of its tiles.
    #[cfg(feature = "sim")]
    pub(crate) fn tile_bytes(&self) -> u64 {
        self.settings.tile_bytes
    }

    /// Returns true if there is such a texture.
    #[cfg(feature = "sim")]
    pub(crate) fn has_texture(&self, texture: TextureId) -> bool {
        self.textures.geometry(texture).is_some()
    }

    /// Returns true if the page's tile is for what is in view.
    #[cfg(feature = "sim")]
    pub(crate) fn is_for_view(&self, page: PageId) -> bool {
        self.residency.is_for_view(page)
    }

    /// The pages of the working set at the bias in force.
    #[cfg(feature = "sim")]
    pub(crate) fn pages_in_view(&self) -> impl Iterator<Item = PageId> + '_ {
        self.set.pages_at(self.bias.bias()).map(|(page, _)| page)
    }

    /// The state of a page; of one that waits for another of the same content, that one's.
    pub fn state(&self, page: PageId) -> PageState {
        let state = self.residency.state(page);
        let representative =
            self.residency.sharing().representative_of(page).filter(|_| state == PageState::Queued);
        representative.map_or(state, |representative| self.residency.state(representative))
    }

    /// The pages whose tiles are in slots, tails among them, and the slot of each: the same for pages that share one. In no
    /// order. Costs a visit of every page that has a state.
    pub fn resident(&self) -> impl Iterator<Item = (PageId, Slot)> + '_ {
        self.residency.resident()
    }

    /// The pages of the working set that could not be had so far.
    pub fn failed_pages(&self) -> impl Iterator<Item = PageId> + '_ {
        self.order.iter().copied().filter(|&page| self.residency.has_failed(page))
    }
}
