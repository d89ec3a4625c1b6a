//! The pager: feedback goes in, decisions come out, for the textures of all pools behind one set of budgets.
//!
//! Each frame: [`Pager::begin_frame`], [`Pager::observe`] for the feedback that has arrived, the loader's
//! results ([`Pager::tile_ready`], [`Pager::tile_failed`], [`Pager::tile_cancelled`]), then the decisions, as
//! values: [`Pager::poll_cancel`], [`Pager::poll_rerank`] and [`Pager::poll_request`] for the loader,
//! [`Pager::poll_upload`] and [`Pager::take_table_changes`] for the GPU, [`Pager::poll_event`] for the
//! application. It never calls back, and nothing that it does can fail once a texture is in: too little
//! memory makes the picture coarser.
//!
//! Here textures get numbers that are unique over all pools, and feedback is split by the pool of each page's
//! texture. Which page is best is decided for each pool by itself (`pool`); whose turn it is to load and to
//! upload, by `turns`.

pub(crate) mod bias;
pub(crate) mod budget;
pub(crate) mod claims;
pub(crate) mod decision;
pub(crate) mod event;
pub(crate) mod explicit_plan;
pub(crate) mod flight_share;
pub(crate) mod groups;
pub(crate) mod inspect;
pub(crate) mod load_order;
pub(crate) mod membership;
pub(crate) mod pool;
pub(crate) mod pool_changes;
pub(crate) mod prediction;
pub(crate) mod ranking;
pub(crate) mod requests;
pub(crate) mod reranks;
pub(crate) mod rest;
pub(crate) mod table_changes;
pub(crate) mod texture_ids;
pub(crate) mod tickets;
pub(crate) mod turns;
pub(crate) mod views;
pub(crate) mod working_set;

use std::sync::Arc;

use bytes::Bytes;

use crate::pager::bias::BiasRule;
use crate::pager::budget::{Bandwidth, FairShare, UploadBucket};
use crate::pager::decision::Request;
use crate::pager::event::{Event, EventQueue};
use crate::pager::pool::PoolPager;
use crate::pager::texture_ids::TextureIds;
use crate::pager::tickets::AskError;
use crate::pager::views::Views;
use crate::residency::PageState;
use crate::residency::stats::Stats;
use crate::table::pool::{PoolError, PoolId, Slot};
use crate::texture::geometry::Geometry;
use crate::texture::page::{PageId, TextureNumber};
use crate::texture::page_contents::PageContents;
use crate::texture::page_set::PageSet;
use crate::wanted::feedback::{Feedback, WantedPage, merge_same};
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

/// Decides what is loaded, what is evicted and how coarse the picture is, for the textures of all pools.
///
/// Each frame: [`Pager::begin_frame`]; [`Pager::observe`] for the feedback that has arrived; the loader's
/// results ([`Pager::tile_ready`], [`Pager::tile_failed`], [`Pager::tile_cancelled`]); then, until each
/// returns `None`, [`Pager::poll_cancel`], [`Pager::poll_rerank`] and [`Pager::poll_request`] for the loader,
/// [`Pager::poll_upload`] for the GPU with [`Pager::take_table_changes`] after it, and [`Pager::poll_event`]
/// for the application. It never calls back, and nothing that it does can fail once a texture is in: too
/// little memory makes the picture coarser. A frame allocates nothing in the steady state
/// (docs/bench-decide.md has the times).
#[derive(Debug)]
pub struct Pager {
    budgets: Budgets,
    pools: Vec<Pool>,
    views: Views,
    bandwidth: Bandwidth,
    ids: TextureIds,
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
    pager: PoolPager,
    /// The pool's part of the feedback that is being ingested.
    feedback: Feedback,
    /// A tile waits for a slot that is not to be had in this frame.
    is_stuck: bool,
}

impl Pager {
    /// No pools yet.
    pub fn new(budgets: Budgets) -> Pager {
        Pager {
            budgets,
            pools: Vec::new(),
            views: Views::default(),
            bandwidth: Bandwidth::default(),
            ids: TextureIds::default(),
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

    /// Adds a pool of so many slots for tiles of so many bytes. `mip_bias` says how much coarser the picture
    /// becomes so that the working set fits; without a rule it never does, and too small a pool shows what
    /// came first.
    pub fn add_pool(
        &mut self,
        slots: u32,
        tile_bytes: u64,
        mip_bias: Option<BiasRule>,
    ) -> Result<PoolId, PoolError> {
        let pool = PoolId::new(u16::try_from(self.pools.len()).map_err(|_| PoolError::TooManyPools)?);
        let mut pager = PoolPager::new(pool, slots, tile_bytes, mip_bias);
        self.views.add_to(&mut pager);
        pager.set.set_turns(self.turns);
        pager.begin_frame(self.frame, &mut self.events);
        self.bucket.allow_tile(tile_bytes);
        self.uploads.add();
        self.requests.add();
        self.pools.push(Pool { pager, feedback: Feedback::default(), is_stuck: false });
        Ok(pool)
    }

    /// Sets the bytes of the in-flight budget that each tile of a pool takes from its request until it is in
    /// a slot, if that is more than the tile's own. To be called before anything is requested.
    pub fn set_flight_bytes(&mut self, pool: PoolId, bytes: u64) {
        if let Some(pager) = self.pool_mut(pool) {
            pager.residency.set_flight_bytes(bytes);
        }
    }

    /// Adds a texture to a pool under a number of its own, and pins its tail, whose slot is returned: the
    /// caller puts the tail's tile there before it draws.
    ///
    /// `present` are the pages that have tiles, `None` if all have: where another is wanted, its nearest
    /// ancestor that has one is. `contents` are the pages that have the same tile, `None` if all differ:
    /// those share a load and a slot. A pool that would have no slot left to work with refuses the texture.
    pub fn add_texture(
        &mut self,
        pool: PoolId,
        geometry: &Geometry,
        present: Option<Arc<PageSet>>,
        contents: Option<Arc<PageContents>>,
    ) -> Result<(TextureNumber, Slot), PoolError> {
        let texture = self.ids.first_free().ok_or(PoolError::TooManyTextures)?;
        let pager = &mut self.pools[usize::from(pool.number())].pager;
        let slot = pager.add_texture(texture, geometry, present, contents)?;
        self.ids.take(texture, pool);
        Ok((texture, slot))
    }

    /// Removes a texture in the frame `frame`, the newest whose feedback may name it: its tiles and its tail
    /// give up their slots, what is in flight is called off. Returns true if there was one.
    ///
    /// Its number is given to another texture when nothing can name this one any more, which
    /// [`Pager::feedback_under_way`] finds. Events that were not polled yet may still name it. Its page table
    /// is the caller's, and is not told of. Costs a visit of every page of the pool that has a state.
    pub fn remove_texture(&mut self, texture: TextureNumber, frame: u64) -> bool {
        let Some(pool) = self.ids.pool_of(texture) else { return false };
        let loads = self.pools[usize::from(pool.number())].pager.remove_texture(texture);
        self.ids.leave(texture, frame, loads.unwrap_or(0));
        self.groups.forget(texture);
        true
    }

    /// Once per frame: the oldest frame whose feedback has yet to come, `None` if none has.
    pub fn feedback_under_way(&mut self, oldest: Option<u64>) {
        self.ids.free_those_left(oldest);
    }

    /// Returns true if another texture would get a number.
    pub fn has_free_number(&self) -> bool {
        self.ids.first_free().is_some()
    }

    /// The pool of a texture that there is.
    pub fn pool_of(&self, texture: TextureNumber) -> Option<PoolId> {
        self.ids.pool_of(texture)
    }

    /// A pool that there is, to look at.
    pub fn pool(&self, pool: PoolId) -> &PoolPager {
        &self.pools[usize::from(pool.number())].pager
    }

    /// All pools, in the order of their numbers.
    pub fn pools(&self) -> impl Iterator<Item = &PoolPager> {
        self.pools.iter().map(|pool| &pool.pager)
    }

    fn pools_mut(&mut self) -> impl Iterator<Item = &mut PoolPager> {
        self.pools.iter_mut().map(|pool| &mut pool.pager)
    }

    fn pool_mut(&mut self, pool: PoolId) -> Option<&mut PoolPager> {
        self.pools.get_mut(usize::from(pool.number())).map(|pool| &mut pool.pager)
    }

    /// The pool of a texture, if there is such a texture.
    fn owner_of(&mut self, texture: TextureNumber) -> Result<&mut PoolPager, AskError> {
        let pool = self.ids.pool_of(texture).ok_or(AskError::NoTexture(texture.number()))?;
        Ok(&mut self.pools[usize::from(pool.number())].pager)
    }

    /// A frame begins. `frame` never falls.
    pub fn begin_frame(&mut self, frame: u64) {
        self.frame = frame;
        self.bandwidth.begin_frame();
        self.bucket.begin_frame();
        self.collect_recovered();
        for pool in &mut self.pools {
            pool.pager.begin_frame(frame, &mut self.events);
            pool.is_stuck = false;
        }
    }

    /// Takes in what a view wanted, each pool the pages of its own textures, those of groups among them:
    /// marks what is resident as used and queues the rest.
    ///
    /// Costs a visit of each page of the working sets and of the pages now missing.
    pub fn observe(&mut self, feedback: &Feedback) {
        self.observe_views(std::slice::from_ref(feedback));
    }

    /// Takes in what several views wanted in a frame, and decides once: what each wanted is in the working
    /// set. Feedback of a view that there is not is dropped; that of [`ViewId::EXPECTED`] is what is expected
    /// to be wanted.
    pub fn observe_views(&mut self, feedbacks: &[Feedback]) {
        let mut any = false;
        for feedback in feedbacks {
            let is_known = self.knows(feedback);
            if is_known {
                self.with_members(feedback, Pager::ingest);
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
        let shared = self.pools().filter_map(|pager| pager.bias.shared()).max().unwrap_or(0);
        for Pool { pager, .. } in &mut self.pools {
            pager.bias.set_shared(shared);
            pager.decide(&mut self.events);
        }
        self.share_failed();
        let frame = self.frame;
        self.pools_mut().for_each(|pager| pager.end_round(frame));
        let converged = !self.pools.is_empty() && self.pools().all(PoolPager::is_converged);
        if converged && !self.converged {
            self.events.push(Event::Converged { frame: self.frame });
        }
        self.converged = converged;
    }

    /// Each pool ingests the pages of its own textures.
    fn ingest(&mut self, feedback: &Feedback) {
        for pool in &mut self.pools {
            (pool.feedback.view, pool.feedback.frame) = (feedback.view, feedback.frame);
            pool.feedback.gaps = feedback.gaps;
            pool.feedback.pages.clear();
        }
        for wanted in &feedback.pages {
            if let Some(pool) = self.pool_of(wanted.page.texture()) {
                self.pools[usize::from(pool.number())].feedback.pages.push(*wanted);
            }
        }
        self.pools.iter_mut().for_each(|Pool { pager, feedback, .. }| pager.ingest(feedback));
    }

    /// What the feedback of a frame's views comes down to, for a trace: the pages that exist, for each
    /// without a tile the one that stands for it; in ascending order, each once.
    pub fn pages_of(&self, views: &[Feedback]) -> Vec<WantedPage> {
        let standing = |wanted: &WantedPage| {
            let textures = &self.pool(self.pool_of(wanted.page.texture())?).textures;
            textures.contains(wanted.page).then(|| wanted.present(textures))
        };
        let seen = views.iter().filter(|feedback| self.knows(feedback));
        let wanted = seen.flat_map(|feedback| self.of_members(feedback).pages);
        let mut pages: Vec<WantedPage> = wanted.filter_map(|wanted| standing(&wanted)).collect();
        merge_same(&mut pages);
        pages
    }

    /// A load that the loader has and should move within its queue: the request again, with the rank that it
    /// has from now on. What the loader has begun or ended already stays as it is, and each load is answered
    /// once all the same. Its rank compares with those of all pools.
    ///
    /// To be asked for in each frame before [`Pager::poll_request`]; what is left when the next decision is
    /// made is forgotten, and comes again if it still holds.
    pub fn poll_rerank(&mut self) -> Option<Request> {
        self.pools_mut().find_map(PoolPager::poll_rerank)
    }

    /// A load that is no longer worth finishing. The loader answers every request, this one too: with
    /// [`Pager::tile_cancelled`], or with the tile if it was too late.
    pub fn poll_cancel(&mut self) -> Option<PageId> {
        self.pools_mut().find_map(|pager| pager.residency.poll_cancel())
    }

    /// The tile of a request is here, decoded: all layers, as many bytes as the pool's tiles have.
    pub fn tile_ready(&mut self, page: PageId, bytes: Bytes) {
        if let Some((pager, _)) = self.load_ended(page) {
            pager.tile_ready(page, bytes);
        }
    }

    /// The tile of a request cannot be read. It is tried again later; its ancestor stays on screen.
    pub fn tile_failed(&mut self, page: PageId, why: impl Into<String>) {
        if let Some((pager, events)) = self.load_ended(page) {
            pager.tile_failed(page, why.into(), events);
        }
    }

    /// The loader has dropped a request that was called off.
    pub fn tile_cancelled(&mut self, page: PageId) {
        if let Some((pager, _)) = self.load_ended(page) {
            pager.tile_cancelled(page);
        }
    }

    /// The pool of a page whose load has ended, also where its texture was removed meanwhile, and the events.
    fn load_ended(&mut self, page: PageId) -> Option<(&mut PoolPager, &mut EventQueue)> {
        let pool = self.ids.load_ended(page.texture())?;
        Some((&mut self.pools[usize::from(pool.number())].pager, &mut self.events))
    }

    /// Puts something that whoever acts on the decisions has to report among the events.
    pub fn report(&mut self, event: Event) {
        self.events.push(event);
    }

    /// The next thing that an application wants to know. The oldest of over a thousand that nobody asks for
    /// are dropped, and [`Event::Lost`] says how many.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.collect_recovered();
        self.events.poll()
    }

    fn collect_recovered(&mut self) {
        let Pager { pools, events, .. } = self;
        for Pool { pager, .. } in pools {
            let pool = pager.pool();
            pager.residency.drain_recovered().for_each(|page| events.push(Event::Recovered { pool, page }));
        }
    }

    /// Returns true if every pool has converged; see [`PoolPager::is_converged`].
    pub fn is_converged(&self) -> bool {
        self.converged && self.pools().all(PoolPager::is_converged)
    }

    /// The state of a page; of one that waits for another of the same content, that one's.
    pub fn state(&self, page: PageId) -> PageState {
        self.pool_of(page.texture()).map_or(PageState::Absent, |pool| self.pool(pool).state(page))
    }

    /// The pages of the working sets that could not be had so far.
    pub fn failed_pages(&self) -> impl Iterator<Item = PageId> + '_ {
        self.pools().flat_map(PoolPager::failed_pages)
    }

    /// Totals and gauges of all pools together; the mip bias is the largest of any.
    pub fn stats(&self) -> Stats {
        self.pools().map(PoolPager::stats).fold(Stats::default(), Stats::joined)
    }
}
