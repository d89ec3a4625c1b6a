//! What is in flight, of each texture, and how much of the budget one may hold.
//!
//! A tile takes its bytes of the in-flight budget from its request until it is in a slot. A source that does
//! not answer keeps them until its reads are overdue, so no texture may hold so many that others cannot
//! begin. Where several textures have pages, a texture that holds anything for the view begins a load in view
//! only if it then holds no more bytes for the view than were free before. So one texture that never gives
//! anything back holds half of the budget, several at once leave as much as each of them holds, and those
//! that come one after the other leave half, a quarter and so on: always more than nothing, until a tile no
//! longer fits.
//!
//! What is asked for explicitly has half of the whole budget anyway and counts as no texture's own, unless it
//! comes into view with the loader. What was asked for in view counts until it has ended, in view or not.
//!
//! A page whose texture has its share is passed over: better ones do not keep up those of others. One texture
//! alone may hold all.
//!
//! A texture of which nothing was answered for long, though something is in flight, is not waited for: what
//! it holds back does not say that bandwidth is short, and where a tile would need what it holds, smaller
//! ones of other pools go on (`pager::turns`).

use crate::residency::Residency;
use crate::residency::records::State;
use crate::texture::page::{PageId, TextureNumber};

/// Frames without an answer after which a texture that has something in flight is not waited for.
const FRAMES_UNANSWERED: u64 = 64;

#[derive(Clone, Copy, Debug, Default)]
struct OfTexture {
    /// Tiles in flight.
    tiles: u32,
    /// How many tiles in flight are for the view, or were.
    for_view: u32,
    /// The frame in which a load was last answered or a tile left, or in which the first of those in flight
    /// was asked for.
    answered_at: u64,
}

impl OfTexture {
    fn is_answered(self, frame: u64) -> bool {
        self.answered_at + FRAMES_UNANSWERED > frame
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
    fn of(&self, texture: TextureNumber) -> OfTexture {
        self.textures.get(usize::from(texture.number())).copied().unwrap_or_default()
    }

    fn of_mut(&mut self, texture: TextureNumber) -> &mut OfTexture {
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
    pub(crate) fn note_answer(&mut self, texture: TextureNumber, frame: u64) {
        self.of_mut(texture).answered_at = frame;
    }
}

impl Residency {
    /// Bytes that a tile takes from its request until it is in a slot.
    pub(crate) fn flight_bytes(&self) -> u64 {
        self.flight_bytes
    }

    /// Sets these bytes.
    pub(crate) fn set_flight_bytes(&mut self, bytes: u64) {
        self.flight_bytes = bytes;
        self.stats.in_flight_bytes = bytes * u64::from(self.stats.in_flight);
    }

    /// Bytes in flight of a texture that are for the view, or were.
    pub(crate) fn bytes_for_view(&self, texture: TextureNumber) -> u64 {
        u64::from(self.flight.of(texture).for_view) * self.flight_bytes
    }

    /// A page of the texture was passed over, since that has its share of the in-flight budget. The view
    /// waits for it, unless nothing of the texture was answered for long.
    pub(crate) fn note_passed_over(&mut self, texture: TextureNumber) {
        self.flight.view_waits |= self.flight.of(texture).is_answered(self.frame);
    }

    /// Returns true if a page was passed over whose texture is being answered, since the last call.
    pub(crate) fn take_view_waits(&mut self) -> bool {
        std::mem::take(&mut self.flight.view_waits)
    }

    pub(crate) fn enter_flight(&mut self, texture: TextureNumber) {
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
    pub(crate) fn leave_flight_of(&mut self, texture: TextureNumber, tiles: u32, for_view: u32) {
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

    /// Bytes in flight of textures of which nothing was answered for long; none while tiles wait for their
    /// slots.
    pub(crate) fn unanswered_bytes(&self) -> u64 {
        if self.has_ready() || self.refreshes.any_ready() {
            return 0;
        }
        let unanswered = self.flight.textures.iter().filter(|of| !of.is_answered(self.frame));
        unanswered.map(|of| u64::from(of.tiles) * self.flight_bytes).sum()
    }
}
