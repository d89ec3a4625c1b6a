//! What is in flight, of each texture, and how much of the budget one may hold.
//!
//! A tile takes its bytes of the in-flight budget from its request until it is in a slot. A source that does not answer keeps them
//! until its reads are overdue, so no texture may hold so many that others cannot begin. Where several textures have pages, a texture
//! that holds anything for the view begins a load in view only if it then holds no more bytes for the view than were free before. So one
//! texture that never gives anything back holds half of the budget, several at once leave as much as each of them holds, and those that
//! come one after the other leave half, a quarter and so on: always more than nothing, until a tile no longer fits.
//!
//! What is asked for by hand has half of the whole budget anyway and counts as no texture's own, unless it comes into view with the loader.
//! What was asked for in view counts until it has ended, in view or not.
//!
//! A page whose texture has its share is passed over: better ones do not keep up those of others. One texture alone may hold all.
//!
//! A texture of which nothing was answered for long, though something is in flight, is not waited for: what it holds back does not say
//! that bandwidth is short, and where a tile would need what it holds, smaller ones of other pools go on (`pagers`).

use crate::page::{PageId, TextureId};
use crate::pager::Pager;
use crate::records::State;
use crate::residency::{PageState, Residency};

/// Frames without an answer after which a texture that has something in flight is not waited for.
const PATIENCE: u64 = 64;

#[derive(Clone, Copy, Debug, Default)]
struct OfTexture {
    /// Tiles in flight.
    tiles: u32,
    /// Those of them that are for the view, or were.
    for_view: u32,
    /// The frame in which a load was last answered or a tile left, or in which the first of those in flight was asked for.
    answered_at: u64,
}

impl OfTexture {
    fn is_answered(self, frame: u64) -> bool {
        self.answered_at + PATIENCE > frame
    }
}

/// What is in flight of each texture, by its number.
#[derive(Debug, Default)]
pub(crate) struct Flight {
    textures: Vec<OfTexture>,
    /// A page was passed over whose texture is being answered.
    view_waits: bool,
}

impl Flight {
    fn of(&self, texture: TextureId) -> OfTexture {
        self.textures.get(usize::from(texture.number())).copied().unwrap_or_default()
    }

    fn of_mut(&mut self, texture: TextureId) -> &mut OfTexture {
        let number = usize::from(texture.number());
        if self.textures.len() <= number {
            self.textures.resize(number + 1, OfTexture::default());
        }
        &mut self.textures[number]
    }

    /// Tiles of all textures, and those of them that are for the view, or were.
    #[cfg(feature = "checks")]
    pub(crate) fn totals(&self) -> (u32, u32) {
        self.textures.iter().fold((0, 0), |(tiles, for_view), of| (tiles + of.tiles, for_view + of.for_view))
    }

    /// A load has been answered, and its tile is still in flight.
    pub(crate) fn note_answer(&mut self, texture: TextureId, frame: u64) {
        self.of_mut(texture).answered_at = frame;
    }

    /// Whether a page was passed over whose texture is being answered. Says so once.
    pub(crate) fn take_view_waits(&mut self) -> bool {
        std::mem::take(&mut self.view_waits)
    }
}

/// What is in other pools that share the budget.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Beside {
    /// Bytes in flight.
    pub(crate) in_flight_bytes: u64,
    /// Textures that have pages to ask for.
    pub(crate) textures: u32,
}

impl Residency {
    pub(crate) fn enter_flight(&mut self, texture: TextureId) {
        let of = self.flight.of_mut(texture);
        if of.tiles == 0 {
            of.answered_at = self.frame;
        }
        of.tiles += 1;
        self.stats.requests += 1;
        self.stats.in_flight += 1;
        self.stats.in_flight_bytes += self.flight_bytes;
    }

    /// The page's tile, which is in flight, is for the view, and counts so until it leaves.
    pub(crate) fn fly_for_view(&mut self, page: PageId) {
        let Some(record) = self.records.get_mut(page) else { return };
        let is_in_flight = matches!(record.state, State::Loading(_) | State::Ready);
        if is_in_flight && !std::mem::replace(&mut record.for_view, true) {
            self.flight.of_mut(page.texture()).for_view += 1;
        }
    }

    pub(crate) fn leave_flight(&mut self, page: PageId) {
        let record = self.records.get_mut(page);
        let for_view = record.is_some_and(|record| std::mem::take(&mut record.for_view));
        self.leave_flight_of(page.texture(), 1, u32::from(for_view));
    }

    /// So many tiles of a texture leave, and so many of them were for the view.
    pub(crate) fn leave_flight_of(&mut self, texture: TextureId, tiles: u32, for_view: u32) {
        let of = self.flight.of_mut(texture);
        (of.tiles, of.for_view) = (of.tiles - tiles, of.for_view - for_view);
        of.answered_at = self.frame;
        self.stats.in_flight -= tiles;
        self.stats.in_flight_bytes -= u64::from(tiles) * self.flight_bytes;
    }

    /// A tile that was in flight is of no use.
    pub(crate) fn waste_one(&mut self, page: PageId) {
        self.stats.wasted += 1;
        self.leave_flight(page);
    }

    /// Bytes in flight of textures of which nothing was answered for long; none while tiles wait for their slots.
    pub(crate) fn unanswered_bytes(&self) -> u64 {
        if self.has_ready() || self.refreshes.any_ready() {
            return 0;
        }
        let unanswered = self.flight.textures.iter().filter(|of| !of.is_answered(self.frame));
        unanswered.map(|of| u64::from(of.tiles) * self.flight_bytes).sum()
    }
}

impl Pager {
    /// The best queued page that would find a slot and whose texture may hold more of the in-flight budget. Costs a look at each page that is
    /// passed over, again in each frame.
    pub(crate) fn next_queued(&mut self) -> Option<PageId> {
        let (first, left) = (self.next_request, self.order.get(self.next_request..)?);
        let (mut held_back, mut view_waits) = (None, false);
        let found = (first..).zip(left).find_map(|(place, &page)| {
            if self.residency.state(page) != PageState::Queued || !self.residency.may_load(page) {
                return None;
            }
            let may_begin = self.may_hold_more(page.texture());
            if !may_begin {
                held_back = held_back.or(Some(place));
                view_waits |= self.residency.flight.of(page.texture()).is_answered(self.residency.frame);
            }
            may_begin.then_some(place)
        });
        self.next_request = found.unwrap_or(self.order.len());
        self.held_back = self.held_back.or(held_back);
        self.residency.flight.view_waits |= view_waits;
        self.order.get(self.next_request).copied().filter(|_| !self.has_no_room())
    }

    /// Whether no more than one texture, of all pools, has pages to ask for.
    pub(crate) fn is_alone(&self) -> bool {
        self.textures.with_pages() + self.beside.textures <= 1
    }

    /// Whether a texture may begin another load in view, as far as other textures are concerned.
    fn may_hold_more(&self, texture: TextureId) -> bool {
        let own = u64::from(self.residency.flight.of(texture).for_view) * self.residency.flight_bytes;
        if self.is_alone() || own == 0 {
            return true;
        }
        let in_flight = self.residency.stats.in_flight_bytes + self.beside.in_flight_bytes;
        own + self.residency.flight_bytes <= self.settings.in_flight_bytes.saturating_sub(in_flight)
    }

    /// What was passed over is looked at again.
    pub(crate) fn look_again(&mut self) {
        if let Some(place) = self.held_back.take() {
            self.next_request = self.next_request.min(place);
        }
    }
}
