//! What an application asks a pager for by hand: to prefetch, to pin, to refresh.
//!
//! What is in view comes first. After it, with half of the in-flight budget and the slots that the view does not need, come
//! the refreshes of resident pages whose content has changed (those in view before the others), what the view is expected
//! to want (`expectation`), and the prefetches in their order. Who holds which page is `tickets`' business, what becomes of
//! a refresh `refresh`'s.

use rustc_hash::FxHashSet;

use crate::pager::Pagers;
use crate::pager::decision::{Request, Upload};
use crate::pager::event::Event;
use crate::pager::pool::Pager;
use crate::pager::tickets::{Ask, AskError, Progress, Ticket, Urgency};
use crate::residency::PageState;
use crate::residency::rank::{Band, rank_of};
use crate::residency::records::RecordHint;
use crate::residency::sharing::ContentId;
use crate::texture::geometry::page_id;
use crate::texture::page::{PageId, TextureId};
use crate::texture::region::{Reach, Region};
use crate::wanted::feedback::{Feedback, Need};

/// Where pages share slots, so many of them may be asked for at once for each slot of the pool.
const PAGES_A_SLOT: u64 = 64;

impl Pager {
    /// Loads the pages of a region, with their ancestors, after everything in view, and keeps them until all are here or, where
    /// there is one, until the deadline, as long as what is in view leaves slots. A region that reaches beyond the texture
    /// is cut off there, and so may be empty, which is done at once.
    ///
    /// Fails where the pool could never hold it. Costs a visit of each page now, and in each frame while the ticket is open.
    pub fn prefetch(
        &mut self,
        texture: TextureId,
        region: &Region,
        urgency: Urgency,
    ) -> Result<Ticket, AskError> {
        let pages = self.pages_of_region(texture, region)?;
        self.plan_due = true;
        Ok(self.claims.open(Ask::Prefetch(urgency), texture, pages, &mut self.residency))
    }

    /// Loads the pages of a region, with their ancestors, and keeps them until [`Pager::release`]: they are in view, as it
    /// were, at every mip bias.
    ///
    /// Fails where pins, tails included, would take more than [`crate::PagerSettings::pin_share`] of the slots. Pages that share a slot
    /// count one by one, since the content of each may change.
    pub fn pin(&mut self, texture: TextureId, region: &Region) -> Result<Ticket, AskError> {
        let pages = self.pages_of_region(texture, region)?;
        let most = self.settings.pin_slots();
        let pinned = self.pinned_with(&pages) + u64::from(self.residency.tails());
        if pinned > u64::from(most) {
            return Err(AskError::TooManyPins { pages: pinned, most });
        }
        self.pins_changed = true;
        Ok(self.claims.open(Ask::Pin, texture, pages, &mut self.residency))
    }

    /// Cancels a prefetch, or unpins. Says whether the ticket was open. What has been loaded stays until its slot is needed.
    pub fn release(&mut self, ticket: Ticket) -> bool {
        match self.claims.release(ticket, &mut self.residency) {
            Some((Ask::Pin, _)) => self.pins_changed = true,
            Some((Ask::Prefetch(_), pages)) => self.let_go(&pages),
            None => return false,
        }
        true
    }

    /// Takes in what the view is expected to want when tiles that are asked for now will be here. To be called as often as there
    /// is a prediction, best once per frame after [`Pager::observe`]; what was not named for a jitter cycle is let go of.
    ///
    /// A prediction that is wrong costs slots of pages out of view, and what bandwidth the view does not need. Costs a visit of
    /// each page named and of its ancestors, and in each frame of each page expected.
    pub fn expect(&mut self, feedback: &Feedback) {
        let bias = self.bias_eighths();
        for wanted in feedback.pages.iter().filter(|wanted| self.textures.contains(wanted.page)) {
            let level = Need::new(wanted.page.level(), wanted.eighth).level_at(bias);
            let line = std::iter::once(wanted.page).chain(self.textures.ancestors(wanted.page));
            for page in line.skip_while(|page| page.level() < level) {
                let page = self.textures.present_page(page);
                if !self.textures.is_tail(page) {
                    self.claims.expect(page, wanted.pixels, &mut self.residency);
                }
            }
        }
        self.plan_due = true;
    }

    /// How far a ticket is; nothing where it has ended.
    pub fn progress(&self, ticket: Ticket) -> Option<Progress> {
        self.claims.progress(ticket, &self.residency)
    }

    /// A ticket that has ended, or a pin whose pages are all here for the first time, and how. Each is said once, after
    /// [`Pager::begin_frame`] has found it so.
    pub fn poll_ended(&mut self) -> Option<(Ticket, Progress)> {
        self.claims.poll_ended()
    }

    /// The content of a region has changed: what is resident of it is loaded again and replaced where it is, so that the old
    /// tiles stay on screen until the new ones are here. The region is that of the texels that have changed; the
    /// tiles that hold one in their borders follow. Says how many pages are concerned.
    ///
    /// A page that shared its slot with others does so no more, whether its content is now that of others or not: a tile of
    /// its own is loaded, and the table is changed when that is here. Until its texture is added anew it is like no other.
    ///
    /// Caches between the source and the pager are the caller's to tell. Costs a visit of each page of the region that
    /// exists, or of each that has a state, whichever are fewer; of the former where the texture said which pages are the same.
    pub fn invalidate(&mut self, texture: TextureId, region: &Region) -> u32 {
        let Some(geometry) = self.textures.geometry(texture).cloned() else { return 0 };
        self.plan_due = true;
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

    /// The pages of a region and their ancestors that have tiles, each once, coarsest first; the tail is not counted, since
    /// it always is here.
    fn pages_of_region(&self, texture: TextureId, region: &Region) -> Result<Vec<PageId>, AskError> {
        let geometry = self.textures.geometry(texture).ok_or(AskError::NoTexture(texture.number()))?;
        let (pages, slots) = (region.page_count(geometry), self.settings.slots - self.residency.tails());
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
    pub(crate) fn tiles_of(&self, pages: impl Iterator<Item = PageId>) -> u64 {
        let sharing = self.residency.sharing();
        let mut contents = FxHashSet::default();
        let is_another = |page: &PageId| match sharing.of(*page) {
            ContentId::NONE => true,
            content => contents.insert(content),
        };
        pages.filter(is_another).count() as u64
    }

    /// Pages that would be pinned by hand with these as well.
    fn pinned_with(&self, pages: &[PageId]) -> u64 {
        let more = pages.iter().filter(|&&page| !self.claims.pins(page)).count();
        (self.claims.pinned().count() + more) as u64
    }

    /// Once per frame: ends tickets, and plans what their pages and the refreshes need.
    pub(crate) fn begin_by_hand(&mut self, frame: u64) {
        if !self.claims.are_none() {
            let mut let_go = Vec::new();
            self.claims.begin_frame(frame, &mut self.residency, &mut let_go);
            let_go.sort_unstable(); // the order of a map is not the same on every machine
            self.let_go(&let_go);
            self.plan_due = true;
        }
        if !self.residency.refreshes().is_empty() {
            self.residency.retry_refreshes();
            self.plan_due = true;
        }
        if std::mem::take(&mut self.pins_changed) {
            let mut pinned: Vec<PageId> = self.claims.pinned().collect();
            pinned.sort_unstable(); // as above
            self.set.set_pins(pinned, &self.textures);
            self.recompute();
        }
        if self.plan_due {
            self.plan_by_hand();
        }
    }

    /// Whether anything is asked for by hand, listed in the plan or not.
    pub(crate) fn has_by_hand(&self) -> bool {
        !(self.by_hand.is_empty() && self.claims.are_none())
    }

    /// Calls off what is under way for pages that nobody has a use for any more.
    fn let_go(&mut self, pages: &[PageId]) {
        self.plan_due = true;
        for &page in pages {
            if !self.residency.has_use_for(page, RecordHint::default()) {
                self.drop_load(page);
            }
        }
    }

    /// Lists what comes after everything in view, best first, as far as there are slots.
    pub(crate) fn plan_by_hand(&mut self) {
        self.plan_due = false;
        std::mem::swap(&mut self.by_hand, &mut self.was_by_hand);
        self.by_hand.clear();
        (self.next_by_hand, self.next_upload_by_hand) = (0, 0);
        self.residency.begin_plan();
        self.residency.evict_stale_sharers(&self.textures);
        let mut spare = self.slots_to_spare();
        self.plan_refreshes(&mut spare);
        let (mut listed, mut too_many) = (FxHashSet::default(), Vec::new());
        for page in self.claims.pages_in_order() {
            let is_here = matches!(self.residency.state(page), PageState::Resident(_));
            let in_view = self.residency.is_wanted(page, RecordHint::default());
            // A page may be expected, and be in several tickets: it needs one slot.
            if is_here || in_view || !listed.insert(page) {
                continue;
            }
            let Some(page) = self.residency.load_by_hand_for(page, &self.textures) else { continue };
            match spare.checked_sub(1) {
                Some(left) => (spare, ()) = (left, self.by_hand.push(page)),
                None => too_many.push(page),
            }
        }
        for place in 0..self.by_hand.len() {
            let (page, rank) = (self.by_hand[place], self.rank_by_hand(place));
            self.residency.hold(page);
            self.reranks.note(&self.residency, page, rank);
        }
        for page in too_many {
            if matches!(self.residency.state(page), PageState::Loading | PageState::Ready) {
                self.drop_load(page);
            }
        }
        self.release_representatives();
        self.emit_recovered();
    }

    /// Lists the refreshes, those in view first. A stale sharer of a slot needs one of its own: in view it is counted with that, else,
    /// where it stays for its descendants, it takes one of those to spare, or goes with them where there is none.
    fn plan_refreshes(&mut self, spare: &mut u32) {
        self.by_hand.extend(self.residency.refreshes().pages());
        let residency = &self.residency;
        self.by_hand.sort_unstable_by_key(|&page| {
            (!residency.is_wanted(page, RecordHint::default()), std::cmp::Reverse(page.level()), page)
        });
        if residency.sharing().is_empty() {
            return;
        }
        let in_view = self.set.size_at(self.bias_eighths()) + residency.tails();
        let view_fits = in_view <= self.settings.slots;
        let mut without_room = Vec::new();
        self.by_hand.retain(|&page| {
            if !residency.is_stale_sharer(page) || residency.refreshes().is_in_flight(page) {
                return true;
            }
            if residency.is_wanted(page, RecordHint::default()) {
                return view_fits;
            }
            let left = spare.checked_sub(1);
            match left {
                Some(left) => *spare = left,
                None => without_room.push(page),
            }
            left.is_some()
        });
        self.residency.evict_branches(&without_room, &self.textures);
    }

    /// Drops what was loaded for another page of the same content that nobody holds any more.
    fn release_representatives(&mut self) {
        if self.residency.sharing().is_empty() {
            return;
        }
        let was_by_hand = std::mem::take(&mut self.was_by_hand);
        for &page in &was_by_hand {
            if !self.residency.has_use_for(page, RecordHint::default()) {
                self.drop_load(page);
            }
        }
        self.was_by_hand = was_by_hand;
    }

    /// Slots that neither the view needs nor claimed pages are in.
    fn slots_to_spare(&mut self) -> u32 {
        let in_view = self.set.size_at(self.bias_eighths()) + self.residency.tails();
        self.settings.slots.saturating_sub(in_view + self.residency.slots_claimed())
    }

    /// The best of these pages that is to be asked for.
    pub(crate) fn next_queued_by_hand(&mut self) -> Option<PageId> {
        let left = self.by_hand.get(self.next_by_hand..)?;
        let is_due = |page: &PageId| {
            self.residency.state(*page) == PageState::Queued && self.residency.may_load(*page)
                || self.residency.refreshes().is_queued(*page)
        };
        self.next_by_hand += left.iter().position(is_due).unwrap_or(left.len());
        self.by_hand.get(self.next_by_hand).copied()
    }

    /// The rank of a place among what comes after what is missing in view.
    pub(crate) fn rank_by_hand(&self, place: usize) -> u64 {
        let is_in_view = |page: &PageId| self.residency.is_wanted(*page, RecordHint::default());
        let band = if self.by_hand.get(place).is_some_and(is_in_view) {
            Band::RefreshInView
        } else {
            Band::AfterView
        };
        rank_of(band, place)
    }

    /// The next of these tiles to load, while half of the in-flight budget allows one.
    pub(crate) fn poll_request_by_hand(&mut self) -> Option<Request> {
        let in_flight = self.residency.stats().in_flight_bytes;
        if in_flight > 0 && in_flight + self.residency.flight_bytes() > self.settings.in_flight_bytes / 2 {
            return None;
        }
        let page = self.next_queued_by_hand()?;
        let rank = self.rank_by_hand(self.next_by_hand);
        self.next_by_hand += 1;
        let _ = self.residency.begin_load(page, rank) || self.residency.begin_refresh(page, rank);
        self.check();
        self.textures.pos(page).map(|(_, pos)| Request { page, pos, rank })
    }

    /// Puts the new tile of a page over the old one, or, where that is others' too, into a slot of its own; nothing where none
    /// has come for the page, or no slot is to be had.
    pub(crate) fn upload_refresh(&mut self, page: PageId) -> Option<Upload> {
        let mut evicted = None;
        if self.residency.is_stale_sharer(page) && self.residency.refreshes().is_ready(page) {
            let (slot, gone) = self.residency.take_slot(&self.textures)?;
            self.residency.move_stale_sharer(page, slot);
            evicted = gone;
        }
        let (slot, bytes, recovered) = self.residency.settle_refresh(page)?;
        self.bucket.take(self.settings.tile_bytes);
        if recovered {
            self.events.push(Event::Recovered { pool: self.pool(), page });
        }
        self.check();
        Some(Upload { page, slot, bytes, evicted })
    }

    /// No page may be evicted: every one out of view may be one whose new tile waits for its turn after the view. Then it gets
    /// that, or, where it would need a slot, has to be loaded again, so that it can go.
    pub(crate) fn make_way(&mut self) -> Option<Upload> {
        let residency = &self.residency;
        let is_ready = |page: &&PageId| residency.refreshes().is_ready(**page);
        let mut ready = self.by_hand.iter().filter(is_ready).copied();
        if let Some(page) = ready.clone().find(|&page| !residency.is_stale_sharer(page)) {
            return self.upload_refresh(page);
        }
        let out_of_view = ready.find(|&page| !residency.is_wanted(page, RecordHint::default()))?;
        self.residency.invalidate(out_of_view);
        None
    }

    /// The best of these pages whose tile waits for the upload budget.
    pub(crate) fn next_ready_by_hand(&mut self) -> Option<PageId> {
        if !self.residency.has_ready() && !self.residency.refreshes().any_ready() {
            return None;
        }
        let left = self.by_hand.get(self.next_upload_by_hand..)?;
        let is_ready = |page: &PageId| {
            self.residency.state(*page) == PageState::Ready || self.residency.refreshes().is_ready(*page)
        };
        self.next_upload_by_hand += left.iter().position(is_ready).unwrap_or(left.len());
        self.by_hand.get(self.next_upload_by_hand).copied()
    }
}

impl Pagers {
    /// Loads the pages of a region after everything in view; see [`Pager::prefetch`].
    pub fn prefetch(
        &mut self,
        texture: TextureId,
        region: &Region,
        urgency: Urgency,
    ) -> Result<Ticket, AskError> {
        self.pager_of(texture)?.prefetch(texture, region, urgency)
    }

    /// Keeps the pages of a region; see [`Pager::pin`].
    pub fn pin(&mut self, texture: TextureId, region: &Region) -> Result<Ticket, AskError> {
        self.pager_of(texture)?.pin(texture, region)
    }

    /// Cancels a prefetch, or unpins; see [`Pager::release`].
    pub fn release(&mut self, ticket: Ticket) -> bool {
        self.pager_mut(ticket.pool()).is_some_and(|pager| pager.release(ticket))
    }

    /// How far a ticket is; nothing where it has ended.
    pub fn progress(&self, ticket: Ticket) -> Option<Progress> {
        self.iter().nth(usize::from(ticket.pool().number()))?.progress(ticket)
    }

    /// A ticket that has ended, or a pin that is all here, and how; see [`Pager::poll_ended`].
    pub fn poll_ended(&mut self) -> Option<(Ticket, Progress)> {
        self.iter_mut().find_map(Pager::poll_ended)
    }

    /// The pages of a pin that is open.
    #[cfg(feature = "sim")]
    pub(crate) fn pages_of_pin(&self, ticket: Ticket) -> Vec<PageId> {
        let pager = self.iter().nth(usize::from(ticket.pool().number()));
        pager.map_or_else(Vec::new, |pager| pager.claims.pages_of_pin(ticket))
    }

    /// The content of a region has changed; see [`Pager::invalidate`].
    pub fn invalidate(&mut self, texture: TextureId, region: &Region) -> u32 {
        self.pager_of(texture).map_or(0, |pager| pager.invalidate(texture, region))
    }

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
        self.iter().filter_map(Pager::arrival_frames).max()
    }
}
