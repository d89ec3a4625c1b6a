//! What an application asks for explicitly: to prefetch, to pin, to refresh; and what it expects to want.
//!
//! What is in view comes first. What was asked for comes after it, with half of the in-flight budget and the
//! slots that the view does not need; in which order, `explicit_plan` says. Who holds which page is the
//! business of `claims`, what becomes of a refresh that of `residency::refresh`.

use rustc_hash::FxHashSet;

use crate::pager::Pager;
use crate::pager::claims::{MOST_PINS, PIN_SHARE};
use crate::pager::event::EventQueue;
use crate::pager::explicit_plan::call_off_unused;
use crate::pager::pool::PoolPager;
use crate::pager::tickets::{Ask, AskError, Progress, Ticket, Urgency};
use crate::residency::sharing::ContentId;
use crate::table::pool::PoolId;
use crate::texture::geometry::page_id;
use crate::texture::page::{PageId, TextureNumber};
use crate::texture::region::{Reach, Region};
use crate::wanted::feedback::{Feedback, Need};

/// Where pages share slots, so many of them may be asked for at once for each slot of the pool.
const PAGES_A_SLOT: u64 = 64;

impl Pager {
    /// Percent of a pool's slots that pins may take where nothing else is said.
    pub const PIN_SHARE: u32 = PIN_SHARE;
    /// Percent of a pool's slots that pins may take at most, so that there is always room for a view.
    pub const MOST_PINS: u32 = MOST_PINS;

    /// Sets the share of a pool's slots that pins may take, tails included, in percent; at most
    /// [`Pager::MOST_PINS`] counts. Pins that there are stay.
    pub fn set_pin_share(&mut self, pool: PoolId, percent: u32) {
        if let Some(pager) = self.pool_mut(pool) {
            pager.claims.set_pin_share(percent);
        }
    }

    /// Loads the pages of a region, with their ancestors, after everything in view, and keeps them until all
    /// are here or, where there is one, until the deadline, as long as what is in view leaves slots. A region
    /// that reaches beyond the texture is cut off there, and so may be empty, which is done at once.
    ///
    /// Fails where the pool could never hold it. Costs a visit of each page now, and in each frame while the
    /// ticket is open.
    pub fn prefetch(
        &mut self,
        texture: TextureNumber,
        region: &Region,
        urgency: Urgency,
    ) -> Result<Ticket, AskError> {
        self.owner_of(texture)?.ask(Ask::Prefetch(urgency), texture, region)
    }

    /// Loads what a view wants, at the mip bias in force for each pool and with the ancestors, as
    /// [`Pager::prefetch`] does a region: one ticket for each texture of which there are pages to load.
    ///
    /// Fails where a pool could never hold its part, and then asks for nothing. What is wanted of textures
    /// that there are not is left out. Costs a visit of each page and of its ancestors now, and in each frame
    /// while the tickets are open.
    pub fn prefetch_view(&mut self, feedback: &Feedback, urgency: Urgency) -> Result<Vec<Ticket>, AskError> {
        self.with_members(feedback, |pager, wanted| {
            let parts: Vec<_> =
                pager.pools().map(|pool| pool.parts_of_view(wanted)).collect::<Result<_, _>>()?;
            let open = |(pool, parts): (&mut PoolPager, Vec<(TextureNumber, Vec<PageId>)>)| {
                let open = |(texture, pages)| pool.open(Ask::Prefetch(urgency), texture, pages);
                parts.into_iter().map(open).collect::<Vec<Ticket>>()
            };
            Ok(pager.pools_mut().zip(parts).flat_map(open).collect())
        })
    }

    /// Loads the pages of a region, with their ancestors, and keeps them until [`Pager::release`]: they count
    /// as in view, at every mip bias.
    ///
    /// Fails where pins, tails included, would take more than their share of the slots
    /// ([`Pager::set_pin_share`]). Pages that share a slot count one by one, since the content of each may
    /// change.
    pub fn pin(&mut self, texture: TextureNumber, region: &Region) -> Result<Ticket, AskError> {
        self.owner_of(texture)?.ask(Ask::Pin, texture, region)
    }

    /// Cancels a prefetch, or unpins. Returns true if the ticket was open. What has been loaded stays until
    /// its slot is needed.
    pub fn release(&mut self, ticket: Ticket) -> bool {
        self.pool_mut(ticket.pool()).is_some_and(|pager| pager.release(ticket))
    }

    /// How far a ticket is; `None` if it has ended.
    pub fn progress(&self, ticket: Ticket) -> Option<Progress> {
        let pager = &self.pools.get(usize::from(ticket.pool().number()))?.pager;
        pager.claims.progress(ticket, &pager.residency)
    }

    /// A ticket that has ended, or a pin whose pages are all here for the first time, and how. Each is said
    /// once, after [`Pager::begin_frame`] has found it so.
    pub fn poll_ended(&mut self) -> Option<(Ticket, Progress)> {
        self.pools_mut().find_map(|pager| pager.claims.poll_ended())
    }

    /// The pages of a pin that is open.
    #[cfg(feature = "sim")]
    pub(crate) fn pages_of_pin(&self, ticket: Ticket) -> Vec<PageId> {
        let pool = self.pools.get(usize::from(ticket.pool().number()));
        pool.map_or_else(Vec::new, |pool| pool.pager.claims.pages_of_pin(ticket))
    }

    /// The content of a region has changed: what is resident of it is loaded again and replaced where it is,
    /// so that the old tiles stay on screen until the new ones are here. The region is that of the texels
    /// that have changed; the tiles that hold one in their borders follow. Says how many pages are concerned.
    ///
    /// A page that shared its slot with others does so no more, whether its content is now that of others or
    /// not: a tile of its own is loaded, and the table is changed when that is here. Until its texture is
    /// added anew it is like no other.
    ///
    /// Caches between the source and the pager are the caller's to tell. Costs a visit of each page of the
    /// region that exists, or of each that has a state, whichever are fewer; of the former where the texture
    /// said which pages are the same.
    pub fn invalidate(&mut self, texture: TextureNumber, region: &Region) -> u32 {
        self.owner_of(texture).map_or(0, |pager| pager.invalidate(texture, region))
    }

    /// Takes in what the view is expected to want when tiles that are asked for now will be here. To be
    /// called as often as there is a prediction, best once per frame after [`Pager::observe`]; what was not
    /// named for a jitter cycle is let go of.
    ///
    /// A prediction that is wrong costs slots of pages out of view, and what bandwidth the view does not
    /// need. Costs a visit of each page named and of its ancestors, and in each frame of each page expected.
    pub fn expect(&mut self, feedback: &Feedback) {
        // Each pool drops the pages of textures that are not its own.
        self.with_members(feedback, |pager, wanted| pager.pools_mut().for_each(|pool| pool.expect(wanted)));
    }

    /// Returns true if there is no bandwidth for a prediction, so that drawing one would be for nothing:
    /// pages in view have waited for the in-flight budget in two frames in a row, and there were no eight in
    /// a row since in which they have not.
    pub fn is_short_of_bandwidth(&self) -> bool {
        self.bandwidth.is_short
    }

    /// Frames after which 95 % of the last 256 tiles of each pool were in their slots, counted from their
    /// requests; the most of any pool, `None` before the first tile. A prediction is best of the view in so
    /// many frames, and those that feedback takes.
    pub fn arrival_frames(&self) -> Option<u32> {
        let arrivals = self.pools().filter_map(|pager| pager.residency.arrivals().percentiles());
        arrivals.map(|arrival| arrival.p95).max()
    }
}

impl PoolPager {
    fn ask(&mut self, ask: Ask, texture: TextureNumber, region: &Region) -> Result<Ticket, AskError> {
        let pages = self.pages_of_region(texture, region)?;
        if ask == Ask::Pin {
            self.claims.may_pin(&pages, &self.residency)?;
        }
        Ok(self.open(ask, texture, pages))
    }

    /// Opens a ticket for pages of one texture, each once, coarsest first.
    fn open(&mut self, ask: Ask, texture: TextureNumber, pages: Vec<PageId>) -> Ticket {
        if ask != Ask::Pin {
            self.plan.note_change();
        }
        self.claims.open(ask, texture, pages, &mut self.residency)
    }

    /// The pages that a view wants of each of the pool's textures, each once and coarsest first.
    fn parts_of_view(&self, feedback: &Feedback) -> Result<Vec<(TextureNumber, Vec<PageId>)>, AskError> {
        let mut pages = Vec::new();
        self.for_pages_of_view(feedback, |page, _| pages.push(page));
        pages.sort_unstable_by_key(|&page| (page.texture(), std::cmp::Reverse(page.level()), page));
        pages.dedup();
        let tiles = self.tiles_of(pages.iter().copied());
        let slots = self.residency.slot_count() - self.residency.tails();
        if tiles > u64::from(slots) {
            return Err(AskError::TooManyPages { pages: tiles, slots });
        }
        let parts = pages.chunk_by(|a, b| a.texture() == b.texture());
        Ok(parts.map(|part| (part[0].texture(), part.to_vec())).collect())
    }

    /// Calls `act` with each page that a view wants at the bias in force, and its ancestors, but for tails;
    /// with a page as often as it is wanted, and the pixels.
    fn for_pages_of_view(&self, feedback: &Feedback, mut act: impl FnMut(PageId, u32)) {
        let bias = self.bias_eighths();
        for wanted in feedback.pages.iter().filter(|wanted| self.textures.contains(wanted.page)) {
            let level = Need::new(wanted.page.level(), wanted.eighth).level_at(bias);
            let line = std::iter::once(wanted.page).chain(self.textures.ancestors(wanted.page));
            for page in line.skip_while(|page| page.level() < level) {
                let page = self.textures.present_page(page);
                if !self.textures.is_tail(page) {
                    act(page, wanted.pixels);
                }
            }
        }
    }

    fn release(&mut self, ticket: Ticket) -> bool {
        let released = self.claims.release(ticket, &mut self.residency);
        if let Some((Ask::Prefetch(_), pages)) = &released {
            self.plan.note_change();
            call_off_unused(&mut self.residency, pages);
        }
        released.is_some()
    }

    fn expect(&mut self, feedback: &Feedback) {
        let mut expected = std::mem::take(&mut self.expected);
        self.for_pages_of_view(feedback, |page, pixels| expected.push((page, pixels)));
        for (page, pixels) in expected.drain(..) {
            self.claims.expect(page, pixels, &mut self.residency);
        }
        self.expected = expected;
        self.plan.note_change();
    }

    fn invalidate(&mut self, texture: TextureNumber, region: &Region) -> u32 {
        let Some(geometry) = self.textures.geometry(texture).cloned() else { return 0 };
        self.plan.note_change();
        if self.residency.sharing().has(texture) {
            let mut concerned = 0;
            // As many as there are, so they are not listed.
            for pos in region.pages(&geometry, Reach::Tile) {
                let Some(page) = page_id(texture, &geometry, pos) else { continue };
                self.residency.leave_content(page);
                self.set.forget_content(page);
                concerned += u32::from(self.residency.invalidate(page));
            }
            return concerned;
        }
        let known = self.residency.known() as u64;
        let pages: Vec<PageId> = if region.page_count(&geometry) <= known {
            region.pages(&geometry, Reach::Tile).filter_map(|pos| page_id(texture, &geometry, pos)).collect()
        } else {
            let known = self.residency.known_pages().filter(|page| page.texture() == texture);
            let mut pages: Vec<_> = known
                .filter(|page| region.touches(&geometry, page.pos(geometry.dims()), Reach::Tile))
                .collect();
            pages.sort_unstable(); // the order of a map is not the same on every machine
            pages
        };
        pages.into_iter().map(|page| u32::from(self.residency.invalidate(page))).sum()
    }

    /// The pages of a region and their ancestors that have tiles, each once, coarsest first; the tail is not
    /// counted, since it always is here.
    fn pages_of_region(&self, texture: TextureNumber, region: &Region) -> Result<Vec<PageId>, AskError> {
        let geometry = self.textures.geometry(texture).ok_or(AskError::NoTexture(texture.number()))?;
        let (pages, slots) =
            (region.page_count(geometry), self.residency.slot_count() - self.residency.tails());
        let most = match self.residency.sharing().has(texture) {
            true => u64::from(slots) * PAGES_A_SLOT,
            false => u64::from(slots) + 1,
        };
        if pages > most {
            return Err(AskError::TooManyPages { pages, slots });
        }
        let mut pages = Vec::with_capacity(pages as usize);
        for page in region.pages(geometry, Reach::Payload).filter_map(|pos| page_id(texture, geometry, pos)) {
            let page = self.textures.present_page(page);
            pages.push(page);
            pages.extend(self.textures.ancestors(page));
        }
        pages.retain(|&page| !self.textures.is_tail(page));
        pages.sort_unstable_by_key(|&page| (std::cmp::Reverse(page.level()), page));
        pages.dedup();
        let tiles = self.tiles_of(pages.iter().copied());
        if tiles > u64::from(slots) {
            return Err(AskError::TooManyPages { pages: tiles, slots });
        }
        Ok(pages)
    }

    /// Slots that the pages need, each of which comes once: those of one content need one.
    fn tiles_of(&self, pages: impl Iterator<Item = PageId>) -> u64 {
        let sharing = self.residency.sharing();
        let mut contents = FxHashSet::default();
        let is_another = |page: &PageId| match sharing.of(*page) {
            ContentId::NONE => true,
            content => contents.insert(content),
        };
        pages.filter(is_another).count() as u64
    }

    /// Once per frame: ends claims whose time has come, and plans what the others and the refreshes need.
    pub(super) fn begin_plan(&mut self, frame: u64, events: &mut EventQueue) {
        if !self.claims.are_none() {
            let mut released = Vec::new();
            self.claims.begin_frame(frame, &mut self.residency, &mut released);
            released.sort_unstable(); // the order of a map is not the same on every machine
            call_off_unused(&mut self.residency, &released);
            self.plan.note_change();
        }
        if !self.residency.refreshes().is_empty() {
            self.residency.retry_refreshes();
            self.plan.note_change();
        }
        if self.claims.take_pins_changed() {
            let mut pinned: Vec<PageId> = self.claims.pinned().collect();
            pinned.sort_unstable(); // as above
            // Without some of them the picture may become sharper.
            if self.set.pins().iter().any(|page| pinned.binary_search(page).is_err()) {
                self.end_rest();
            }
            self.set.set_pins(pinned, &self.textures);
            self.recompute(events);
        }
        if self.plan.is_due() {
            self.rebuild_plan();
        }
    }
}
