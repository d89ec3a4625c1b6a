//! The pagers of all pools, behind one set of budgets.
//!
//! A [`Pager`] decides for the textures of one pool. Here textures get numbers that are unique over all pools, feedback is
//! split by the pool of each page's texture, and uploads and loads share their budgets: by turns, so that each pool with
//! something to do gets the same bytes, whatever the size of its tiles. Which page is best is each pager's own business.

pub(crate) mod bias;
pub(crate) mod budget;
pub(crate) mod claims;
pub(crate) mod decision;
pub(crate) mod event;
pub(crate) mod groups;
pub(crate) mod in_flight;
pub(crate) mod inspect;
pub(crate) mod membership;
pub(crate) mod memory;
pub(crate) mod order;
pub(crate) mod pool;
pub(crate) mod prediction;
pub(crate) mod requests;
pub(crate) mod reranks;
pub(crate) mod settings;
pub(crate) mod shared_slots;
pub(crate) mod table_changes;
pub(crate) mod texture_ids;
pub(crate) mod tickets;
pub(crate) mod views;
pub(crate) mod working_set;

use std::sync::Arc;

use bytes::Bytes;

use crate::pager::bias::BiasRule;
use crate::pager::budget::{Bandwidth, Beside, Claim, FairShare, UploadBucket};
use crate::pager::decision::{Request, Upload};
use crate::pager::event::{Event, EventQueue};
use crate::pager::pool::Pager;
use crate::pager::settings::PagerSettings;
use crate::pager::texture_ids::Numbers;
use crate::pager::tickets::AskError;
use crate::pager::views::Views;
use crate::residency::PageState;
use crate::residency::stats::Stats;
use crate::table::TableChange;
use crate::table::pool::{PoolError, PoolId, Slot};
use crate::texture::geometry::Geometry;
use crate::texture::page::{PageId, TextureId};
use crate::texture::page_contents::PageContents;
use crate::texture::page_set::PageSet;
use crate::wanted::feedback::merge_same;
use crate::wanted::feedback::{Feedback, WantedPage};
use crate::wanted::groups::Groups;
use crate::wanted::view::ViewId;

/// What all pools share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budgets {
    /// Bytes uploaded per frame; see [`UploadBucket`], whose tile is the largest of any pool.
    pub upload_bytes_per_frame: u64,
    /// Bytes of tiles with the loader or waiting for the upload budget; at least one tile is always allowed.
    pub in_flight_bytes: u64,
}

/// See the head of the file. The order of calls within a frame is that of [`Pager`].
#[derive(Debug)]
pub struct Pagers {
    budgets: Budgets,
    pools: Vec<Pool>,
    views: Views,
    bandwidth: Bandwidth,
    numbers: Numbers,
    groups: Groups,
    /// What a feedback with entries of groups comes to, kept for its memory.
    members_wanted: Feedback,
    /// Entries that take turns in a feedback pixel at most.
    turns: u32,
    bucket: UploadBucket,
    uploads: FairShare,
    requests: FairShare,
    events: EventQueue,
    frame: u64,
    converged: bool,
}

#[derive(Debug)]
struct Pool {
    pager: Pager,
    /// Its part of the feedback that is being taken in.
    feedback: Feedback,
    /// A tile waits for a slot that is not to be had in this frame.
    is_stuck: bool,
}

impl Pool {
    /// Its claim to the in-flight budget for what `next` finds, where only tiles that take fewer bytes than so many go on.
    fn claim(&mut self, below: u64, next: fn(&mut Pager) -> Option<PageId>) -> Claim {
        match next(&mut self.pager).is_some() {
            true if self.pager.residency.flight_bytes() < below => Claim::Waits,
            false if self.pager.held_back.is_none() => Claim::Nothing,
            _ => Claim::HeldBack,
        }
    }
}

impl Pagers {
    /// No pools yet.
    pub fn new(budgets: Budgets) -> Pagers {
        Pagers {
            budgets,
            pools: Vec::new(),
            views: Views::default(),
            bandwidth: Bandwidth::default(),
            numbers: Numbers::default(),
            groups: Groups::default(),
            members_wanted: Feedback::default(),
            turns: 1,
            bucket: UploadBucket::new(budgets.upload_bytes_per_frame, 0),
            uploads: FairShare::default(),
            requests: FairShare::default(),
            events: EventQueue::default(),
            frame: 0,
            converged: false,
        }
    }

    /// Adds a pool of so many slots for tiles of so many bytes; `mip_bias` as in [`PagerSettings`].
    pub fn add_pool(
        &mut self,
        slots: u32,
        tile_bytes: u64,
        mip_bias: Option<BiasRule>,
    ) -> Result<PoolId, PoolError> {
        let pool = PoolId::new(u16::try_from(self.pools.len()).map_err(|_| PoolError::TooManyPools)?);
        let Budgets { upload_bytes_per_frame, in_flight_bytes } = self.budgets;
        // Alone, a pool may have all; that together they keep to it is seen to here.
        let pin_share = PagerSettings::PIN_SHARE;
        let settings =
            PagerSettings { slots, tile_bytes, upload_bytes_per_frame, in_flight_bytes, mip_bias, pin_share };
        let mut pager = Pager::of_pool(pool, settings);
        self.views.tell(&mut pager);
        pager.set.set_turns(self.turns);
        pager.begin_frame(self.frame);
        self.bucket.allow_tile(tile_bytes);
        self.uploads.add();
        self.requests.add();
        self.pools.push(Pool { pager, feedback: Feedback::default(), is_stuck: false });
        Ok(pool)
    }

    /// Sets the share of a pool's slots that pins may take, in percent; see [`PagerSettings::pin_share`]. Pins that there are stay.
    pub fn set_pin_share(&mut self, pool: PoolId, percent: u32) {
        if let Some(pager) = self.pager_mut(pool) {
            pager.settings.pin_share = percent;
        }
    }

    /// Sets the bytes that each tile of a pool takes from its request until it is in a slot, where that is more than its own: what the
    /// in-flight budget counts. To be called before anything is asked for.
    pub fn set_flight_bytes(&mut self, pool: PoolId, bytes: u64) {
        if let Some(pager) = self.pager_mut(pool) {
            pager.residency.set_flight_bytes(bytes);
        }
    }

    /// Adds a texture to a pool under a number of its own; else as [`Pager::add_texture`].
    pub fn add_texture(
        &mut self,
        pool: PoolId,
        geometry: &Geometry,
        present: Option<Arc<PageSet>>,
        contents: Option<Arc<PageContents>>,
    ) -> Result<(TextureId, Slot), PoolError> {
        let texture = self.numbers.first_free().ok_or(PoolError::TooManyTextures)?;
        let pager = &mut self.pools[usize::from(pool.number())].pager;
        let slot = pager.add_texture(texture, geometry, present, contents)?;
        self.numbers.take(texture, pool);
        Ok((texture, slot))
    }

    /// Removes a texture in the frame `frame`, the newest whose feedback may name it; see [`Pager::remove_texture`]. Says
    /// whether there was one. Its number is given to another texture when nothing can name this one any more, which
    /// [`Pagers::feedback_under_way`] finds. Events that were not polled yet may still name it.
    pub fn remove_texture(&mut self, texture: TextureId, frame: u64) -> bool {
        let Some(pool) = self.numbers.pool_of(texture) else { return false };
        let loads = self.pools[usize::from(pool.number())].pager.remove_texture(texture);
        self.numbers.leave(texture, frame, loads.unwrap_or(0));
        self.groups.forget(texture);
        true
    }

    /// Once per frame: the oldest frame whose feedback has yet to come, nothing where none has.
    pub fn feedback_under_way(&mut self, oldest: Option<u64>) {
        self.numbers.free_those_left(oldest);
    }

    /// Whether another texture would get a number.
    pub fn has_free_number(&self) -> bool {
        self.numbers.first_free().is_some()
    }

    /// The pool of a texture that there is.
    pub fn pool_of(&self, texture: TextureId) -> Option<PoolId> {
        self.numbers.pool_of(texture)
    }

    /// The pager of a pool that there is.
    pub fn pager(&self, pool: PoolId) -> &Pager {
        &self.pools[usize::from(pool.number())].pager
    }

    /// The pagers of all pools, in the order of their numbers.
    pub fn iter(&self) -> impl Iterator<Item = &Pager> {
        self.pools.iter().map(|pool| &pool.pager)
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Pager> {
        self.pools.iter_mut().map(|pool| &mut pool.pager)
    }

    /// The pager of a page whose load has ended, also where its texture was removed meanwhile.
    fn load_ended(&mut self, page: PageId) -> Option<&mut Pager> {
        let pool = self.numbers.load_ended(page.texture())?;
        Some(&mut self.pools[usize::from(pool.number())].pager)
    }

    /// A frame begins. `frame` never falls.
    pub fn begin_frame(&mut self, frame: u64) {
        self.frame = frame;
        self.bandwidth.begin_frame();
        self.bucket.begin_frame();
        self.collect_events();
        for pool in &mut self.pools {
            pool.pager.begin_frame(frame);
            pool.is_stuck = false;
        }
    }

    /// Takes in what a view wanted, each pool the pages of its own textures, those of groups among them; see
    /// [`Pager::observe`].
    pub fn observe(&mut self, feedback: &Feedback) {
        self.observe_views(std::slice::from_ref(feedback));
    }

    /// Takes in what several views wanted in a frame, see [`Pager::observe_views`], and what is expected to be wanted.
    pub fn observe_views(&mut self, feedbacks: &[Feedback]) {
        let mut any = false;
        for feedback in feedbacks {
            let is_known = self.knows(feedback);
            if is_known {
                self.with_members(feedback, Pagers::ingest);
            }
            any |= is_known;
        }
        if any {
            self.decide();
        }
        let expected = feedbacks.iter().filter(|feedback| feedback.view == ViewId::EXPECTED);
        expected.for_each(|feedback| self.expect(feedback));
    }

    fn decide(&mut self) {
        let shared = self.iter().filter_map(|pager| pager.bias.shared()).max().unwrap_or(0);
        for Pool { pager, .. } in &mut self.pools {
            pager.bias.set_shared(shared);
            pager.decide();
        }
        let converged = !self.pools.is_empty() && self.iter().all(Pager::is_converged);
        if converged && !self.converged {
            self.events.push(Event::Converged { frame: self.frame });
        }
        self.converged = converged;
    }

    /// Each pool takes in the pages of its own textures.
    fn ingest(&mut self, feedback: &Feedback) {
        for pool in &mut self.pools {
            (pool.feedback.view, pool.feedback.frame) = (feedback.view, feedback.frame);
            pool.feedback.pages.clear();
        }
        for wanted in &feedback.pages {
            if let Some(pool) = self.pool_of(wanted.page.texture()) {
                self.pools[usize::from(pool.number())].feedback.pages.push(*wanted);
            }
        }
        self.pools.iter_mut().for_each(|Pool { pager, feedback, .. }| pager.ingest(feedback));
    }

    /// What the feedback of a frame's views comes down to, for a trace: the pages that exist, for each without a tile the one that
    /// stands for it; in ascending order, each once.
    pub fn pages_of(&self, views: &[Feedback]) -> Vec<WantedPage> {
        let standing = |wanted: &WantedPage| {
            let textures = &self.pager(self.pool_of(wanted.page.texture())?).textures;
            textures.contains(wanted.page).then(|| wanted.present(textures))
        };
        let seen = views.iter().filter(|feedback| self.knows(feedback));
        let wanted = seen.flat_map(|feedback| self.of_members(feedback).pages);
        let mut pages: Vec<WantedPage> = wanted.filter_map(|wanted| standing(&wanted)).collect();
        merge_same(&mut pages);
        pages
    }

    /// The next tile to load, while the in-flight budget allows one. Its rank compares with those of all pools.
    ///
    /// What is in view of any pool comes before what was asked for by hand of any, which has half of the budget. Where several textures
    /// have pages, none holds so much of it that others cannot begin: a page whose texture has its share is passed over.
    pub fn poll_request(&mut self) -> Option<Request> {
        self.tell_beside();
        let mut below = u64::MAX;
        loop {
            let (who, is_in_view) = self.whose_request(below)?;
            let Pager { settings, residency, .. } = &self.pools[who].pager;
            let (tile_bytes, flight_bytes) = (settings.tile_bytes, residency.flight_bytes());
            let in_flight = self.in_flight_bytes();
            let budget = self.budgets.in_flight_bytes / if is_in_view { 1 } else { 2 };
            if in_flight == 0 || in_flight + flight_bytes <= budget {
                self.requests.serve(who, tile_bytes);
                return self.pools[who].pager.poll_request();
            }
            // Whose turn it is waits for what it needs, so that small tiles do not keep out large ones; but not for what nobody answers.
            let unanswered: u64 = self.iter().map(|pager| pager.residency.unanswered_bytes()).sum();
            let is_to_be_had = unanswered == 0 || unanswered + flight_bytes <= budget;
            if is_to_be_had || !is_in_view || self.pools[who].pager.is_alone() {
                self.bandwidth.view_waits |= is_in_view;
                return None;
            }
            below = flight_bytes;
        }
    }

    /// The pool whose turn it is to ask for a tile that takes fewer bytes than so many, and whether for one in view.
    fn whose_request(&mut self, below: u64) -> Option<(usize, bool)> {
        // A pool that others hold back catches up when they do not. One whose source is silent is held back for long: so much and no more.
        let credit = self.budgets.in_flight_bytes;
        let Pagers { requests, pools, bandwidth, .. } = self;
        let in_view = requests.next_of(credit, |pool| pools[pool].claim(below, Pager::next_queued));
        for pool in pools.iter_mut() {
            bandwidth.view_waits |= pool.pager.residency.take_view_waits();
        }
        if let Some(who) = in_view {
            return Some((who, true));
        }
        let by_hand = requests.next_of(credit, |pool| pools[pool].claim(below, Pager::next_queued_by_hand));
        by_hand.map(|who| (who, false))
    }

    /// Tells each pool what is in the others.
    fn tell_beside(&mut self) {
        let (in_flight_bytes, textures) =
            (self.in_flight_bytes(), self.iter().map(|pager| pager.textures.with_pages()).sum::<u32>());
        for pager in self.iter_mut() {
            pager.beside = Beside {
                in_flight_bytes: in_flight_bytes - pager.residency.stats().in_flight_bytes,
                textures: textures - pager.textures.with_pages(),
            };
        }
    }

    fn in_flight_bytes(&self) -> u64 {
        self.iter().map(|pager| pager.residency.stats().in_flight_bytes).sum()
    }

    /// A load that the loader should move within its queue; see [`Pager::poll_rerank`]. Its rank compares with those of all pools.
    pub fn poll_rerank(&mut self) -> Option<Request> {
        self.iter_mut().find_map(Pager::poll_rerank)
    }

    /// A load that is no longer worth finishing; see [`Pager::poll_cancel`].
    pub fn poll_cancel(&mut self) -> Option<PageId> {
        self.pools.iter_mut().find_map(|pool| pool.pager.poll_cancel())
    }

    /// The tile of a request is here; see [`Pager::tile_ready`].
    pub fn tile_ready(&mut self, page: PageId, bytes: Bytes) {
        if let Some(pager) = self.load_ended(page) {
            pager.tile_ready(page, bytes);
        }
    }

    /// The tile of a request cannot be had; see [`Pager::tile_failed`].
    pub fn tile_failed(&mut self, page: PageId, why: impl Into<String>) {
        if let Some(pager) = self.load_ended(page) {
            pager.tile_failed(page, why);
        }
    }

    /// The loader has dropped a request that was called off.
    pub fn tile_cancelled(&mut self, page: PageId) {
        if let Some(pager) = self.load_ended(page) {
            pager.tile_cancelled(page);
        }
    }

    /// The next tile to copy into a slot, and of which pool, while the upload budget allows one.
    pub fn poll_upload(&mut self) -> Option<(PoolId, Upload)> {
        loop {
            let Pagers { uploads, pools, .. } = self;
            let in_view =
                uploads.next(|pool| !pools[pool].is_stuck && pools[pool].pager.next_ready().is_some());
            let who = in_view.or_else(|| {
                uploads.next(|pool| !pools[pool].is_stuck && pools[pool].pager.next_ready_by_hand().is_some())
            })?;
            let pager = &mut pools[who].pager;
            let (pool, tile_bytes) = (pager.pool(), pager.settings.tile_bytes);
            if self.bucket.available() < tile_bytes {
                return None;
            }
            if let Some(upload) = pager.poll_upload() {
                self.bucket.take(tile_bytes);
                uploads.serve(who, tile_bytes);
                return Some((pool, upload));
            }
            pools[who].is_stuck = true;
        }
    }

    /// Replaces `changes` with the page-table changes of the uploads handed out since the last call, of every pool:
    /// evictions before loads in each.
    pub fn take_table_changes(&mut self, changes: &mut Vec<TableChange>) {
        changes.clear();
        self.pools.iter_mut().for_each(|pool| pool.pager.append_table_changes(changes));
    }

    /// The pager of a texture that there is.
    pub(crate) fn pager_of(&mut self, texture: TextureId) -> Result<&mut Pager, AskError> {
        let pool = self.numbers.pool_of(texture).ok_or(AskError::NoTexture(texture.number()))?;
        Ok(&mut self.pools[usize::from(pool.number())].pager)
    }

    pub(crate) fn pager_mut(&mut self, pool: PoolId) -> Option<&mut Pager> {
        self.pools.get_mut(usize::from(pool.number())).map(|pool| &mut pool.pager)
    }

    /// Puts something that whoever carries out the decisions has to say among the events.
    pub fn say(&mut self, event: Event) {
        self.events.push(event);
    }

    /// The next thing that an application wants to know. The oldest of over a thousand that nobody asks for are dropped, and
    /// [`Event::Lost`] says how many.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.collect_events();
        self.events.poll()
    }

    fn collect_events(&mut self) {
        for pool in &mut self.pools {
            // That one pool has converged says nothing of the view.
            let said = std::iter::from_fn(|| pool.pager.poll_event());
            said.filter(|event| !matches!(event, Event::Converged { .. }))
                .for_each(|event| self.events.push(event));
        }
    }

    /// Whether every pool has converged; see [`Pager::is_converged`].
    pub fn is_converged(&self) -> bool {
        self.converged
    }

    /// The state of a page.
    pub fn state(&self, page: PageId) -> PageState {
        self.pool_of(page.texture()).map_or(PageState::Absent, |pool| self.pager(pool).state(page))
    }

    /// The pages of the working sets that could not be had so far.
    pub fn failed_pages(&self) -> impl Iterator<Item = PageId> + '_ {
        self.iter().flat_map(Pager::failed_pages)
    }

    /// Totals and gauges of all pools together; the mip bias is the largest of any.
    pub fn stats(&self) -> Stats {
        self.iter().map(Pager::stats).fold(Stats::default(), Stats::joined)
    }
}
