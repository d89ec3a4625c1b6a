//! What is wanted and what is loaded for it: the pager, which decides, the loader, which reads, and the
//! tickets of explicit requests.
//!
//! Nothing here knows of a GPU. What the pager decides for the GPU is handed out by `frame`.

mod convergence;
mod frame;
mod loading;
mod lock_step;
mod tickets;

use std::sync::Arc;

use bytes::Bytes;
use vastex_core::{
    BiasRule, Budgets, Description, Event, Feedback, GroupError, GroupNumber, LevelRule, Pager, PoolError,
    PoolId, PoolLayout, Region, Slot, SlotMove, TextureNumber, ViewError, ViewId,
};
use vastex_tiles::{Loader, RamBudget, SystemClock, Tiers, TileSource};

use crate::error::Error;
use crate::settings::Settings;
pub use convergence::Convergence;
use convergence::OpenConvergences;
use lock_step::LockStep;
use tickets::OpenTickets;
pub use tickets::Ticket;

/// The pager and what it works with.
pub(crate) struct Paging {
    pager: Pager,
    loader: Loader,
    /// Main memory for the encoded tiles of all textures.
    ram: Arc<RamBudget>,
    /// There in lock-step.
    lock_step: Option<LockStep>,
    tickets: OpenTickets,
    convergences: OpenConvergences,
    /// The number of the frame that the next update plays.
    frame: u64,
    /// What the application has said that views want.
    reported: Vec<Feedback>,
    /// That the pager has converged, while some of a view has not been seen.
    converged: Option<Event>,
    /// By number; `None` if the texture was removed.
    textures: Vec<Option<PagedTexture>>,
}

/// A texture as it is read.
pub(crate) struct PagedTexture {
    /// As its source has it.
    pub(crate) description: Arc<Description>,
    /// What the loader reads from, its caches in front.
    pub(crate) source: Arc<dyn TileSource>,
    /// The tail's tile as the pool holds it, so that there is always an answer, also for another device.
    pub(crate) tail: Bytes,
}

impl Paging {
    /// Fails where the system gives no threads, and in a browser for
    /// [`Pace::LockStep`](crate::Pace::LockStep).
    pub(crate) fn new(settings: &Settings) -> Result<Paging, Error> {
        Ok(Paging {
            lock_step: LockStep::of(settings.pace, cfg!(target_family = "wasm"))?,
            pager: Pager::new(budgets(settings)),
            loader: Loader::with(settings.of_loader(), Arc::new(SystemClock::new()))?,
            ram: RamBudget::new(settings.ram_cache_bytes),
            tickets: OpenTickets::default(),
            convergences: OpenConvergences::default(),
            frame: 0,
            reported: Vec::new(),
            converged: None,
            textures: Vec::new(),
        })
    }

    /// The pager, to be asked.
    pub(crate) fn pager(&self) -> &Pager {
        &self.pager
    }

    /// Main memory for the encoded tiles of all textures.
    pub(crate) fn ram(&self) -> &Arc<RamBudget> {
        &self.ram
    }

    /// The number of the frame that the next update plays.
    pub(crate) fn frame(&self) -> u64 {
        self.frame
    }

    /// A pool with these slots.
    pub(crate) fn add_pool(
        &mut self,
        slots: &PoolLayout,
        mip_bias: Option<BiasRule>,
    ) -> Result<PoolId, PoolError> {
        self.pager.add_pool(slots.slots(), slots.tile_bytes, mip_bias)
    }

    pub(crate) fn set_pin_share(&mut self, pool: PoolId, percent: u32) {
        self.pager.set_pin_share(pool, percent);
    }

    /// Bytes that a tile of a pool takes on its way.
    pub(crate) fn set_flight_bytes(&mut self, pool: PoolId, bytes: u64) {
        self.pager.set_flight_bytes(pool, bytes);
    }

    /// Says which slots the pool keeps, and where.
    pub(crate) fn resize_pool(
        &mut self,
        pool: PoolId,
        slots: u32,
        moves: &mut Vec<SlotMove>,
    ) -> Result<(), PoolError> {
        self.pager.resize_pool(pool, slots, moves)
    }

    /// Sets how the mip bias of a pool is decided.
    pub(crate) fn set_bias_rule(&mut self, pool: PoolId, rule: Option<BiasRule>) {
        self.pager.set_bias_rule(pool, rule);
    }

    /// Sets the budgets that are said of uploads and of loads.
    pub(crate) fn set_budgets(&mut self, settings: &Settings) {
        self.pager.set_budgets(budgets(settings));
    }

    /// The pools are empty but for the tails.
    pub(crate) fn tiles_lost(&mut self) {
        self.pager.tiles_lost();
    }

    /// Checks that one more texture or group can have a number.
    pub(crate) fn check_free_number(&self) -> Result<(), PoolError> {
        if self.pager.has_free_number() { Ok(()) } else { Err(PoolError::TooManyTextures) }
    }

    /// Adds a texture to a pool, and says into which slot its tail is to come.
    pub(crate) fn add_texture(
        &mut self,
        pool: PoolId,
        texture: PagedTexture,
        share_contents: bool,
    ) -> Result<(TextureNumber, Slot), PoolError> {
        let PagedTexture { description, source, .. } = &texture;
        let contents = if share_contents { source.contents().cloned() } else { None };
        let present = source.present().cloned();
        let (id, slot) = self.pager.add_texture(pool, &description.geometry, present, contents)?;
        let number = usize::from(id.number());
        if self.textures.len() <= number {
            self.textures.resize_with(number + 1, || None);
        }
        self.textures[number] = Some(texture);
        Ok((id, slot))
    }

    /// Lets the loader read a texture.
    pub(crate) fn open_source(&mut self, texture: TextureNumber) {
        if let Some(source) = self.texture(texture).map(|state| state.source.clone()) {
            self.loader.add_source(texture, source);
        }
    }

    /// Removes a texture, and calls off its loads; what its caches have done is told.
    pub(crate) fn remove_texture(&mut self, texture: TextureNumber) -> Tiers {
        self.pager.remove_texture(texture, self.frame);
        self.send_cancels();
        self.loader.remove_source(texture);
        let mut tiers = Tiers::default();
        if let Some(gone) = self.textures.get_mut(usize::from(texture.number())).and_then(Option::take) {
            gone.source.add_tiers(&mut tiers);
        }
        tiers
    }

    /// A texture, if there is one of this number.
    pub(crate) fn texture(&self, texture: TextureNumber) -> Option<&PagedTexture> {
        self.textures.get(usize::from(texture.number()))?.as_ref()
    }

    /// All textures, in the order of their numbers.
    pub(crate) fn textures(&self) -> impl Iterator<Item = (TextureNumber, &PagedTexture)> {
        let numbers = (0..=TextureNumber::MAX).filter_map(TextureNumber::new).zip(&self.textures);
        numbers.filter_map(|(id, texture)| Some((id, texture.as_ref()?)))
    }

    pub(crate) fn set_levels(&mut self, texture: TextureNumber, rule: LevelRule) -> bool {
        self.pager.set_levels(texture, rule)
    }

    pub(crate) fn add_group(&mut self, members: &[TextureNumber]) -> Result<GroupNumber, GroupError> {
        self.pager.add_group(members)
    }

    pub(crate) fn remove_group(&mut self, group: GroupNumber) -> bool {
        self.pager.remove_group(group, self.frame)
    }

    /// As many feedback entries may take turns in a pixel.
    pub(crate) fn set_turns(&mut self, turns: u32) {
        self.pager.set_turns(turns);
    }

    /// So many feedbacks of a view that rests look at all of its pixels for gaps; 0: it does not rest.
    pub(crate) fn set_gap_passes(&mut self, view: ViewId, passes: u32) {
        self.pager.set_gap_passes(view, passes);
    }

    /// Of how many bricks that a ray of a view lacks it is to name one.
    pub(crate) fn gaps_by_turns(&self, view: ViewId) -> u32 {
        self.pager.gaps_by_turns(view)
    }

    /// Returns true if the next feedback of a view that rests is to look for gaps.
    pub(crate) fn looks_for_gaps(&mut self, view: ViewId) -> bool {
        self.pager.looks_for_gaps(view)
    }

    /// A view says all that it wants in as many jitter cycles.
    pub(crate) fn set_view_turns(&mut self, view: ViewId, turns: u32) {
        self.pager.set_view_turns(view, turns);
    }

    pub(crate) fn add_view(&mut self, weight: f32) -> Result<ViewId, ViewError> {
        self.pager.add_view(weight)
    }

    pub(crate) fn set_view_weight(&mut self, view: ViewId, weight: f32) -> bool {
        self.pager.set_weight(view, weight)
    }

    pub(crate) fn remove_view(&mut self, view: ViewId) -> bool {
        self.pager.remove_view(view)
    }

    /// Waits for a view.
    pub(crate) fn converged_view(&mut self, view: ViewId) -> Convergence {
        self.convergences.open(view)
    }

    /// Ends what waits for views that have converged, where `is_seen_whole` says so of one too, or that are
    /// gone.
    pub(crate) fn follow_views(&mut self, is_seen_whole: impl Fn(ViewId) -> Option<bool>) {
        let pager = &self.pager;
        self.convergences.follow(|view| match is_seen_whole(view) {
            // What is only expected is no view that converges.
            None => Some(false),
            Some(_) if view == ViewId::EXPECTED => Some(false),
            Some(is_seen) => (is_seen && pager.is_view_converged(view)).then_some(true),
        });
    }

    pub(crate) fn view_cut(&mut self, view: ViewId) {
        self.pager.view_cut(view, self.frame);
    }

    /// The content of a region has changed: what the caches have of it is dropped, and what is resident is
    /// read again.
    pub(crate) fn invalidate(&mut self, texture: TextureNumber, region: &Region) -> u32 {
        if let Some(state) = self.texture(texture) {
            state.source.changed(region);
        }
        self.pager.invalidate(texture, region)
    }
}

/// What the pager is told of the settings.
fn budgets(settings: &Settings) -> Budgets {
    let Settings { upload_bytes_per_frame, in_flight_bytes, .. } = *settings;
    Budgets { upload_bytes_per_frame, in_flight_bytes }
}
