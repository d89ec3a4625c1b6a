//! What is in flight, of each texture, and how much of the budget one may hold.
//!
//! A tile takes its bytes of the in-flight budget from its request until it is in a slot. A source that does not answer keeps them
//! until its reads are overdue, so no texture may hold so many that others cannot begin. Where several textures have pages, a texture
//! that holds anything begins a load in view only while, with it, it holds no more than was left free. So one texture that never
//! gives anything back holds half of the budget, several at once leave as much as each of them holds, and those that come one after
//! the other leave half, a quarter and so on: always more than nothing, until a tile no longer fits. What is asked for by hand has half
//! of the whole budget anyway.
//!
//! A page whose texture has its share is passed over: better ones do not keep up those of others. One texture alone may hold all.

use crate::page::{PageId, TextureId};
use crate::pager::Pager;
use crate::residency::{PageState, Residency};

/// Tiles in flight of each texture, by its number.
#[derive(Debug, Default)]
pub(crate) struct Flight {
    tiles: Vec<u32>,
}

impl Flight {
    pub(crate) fn tiles(&self, texture: TextureId) -> u32 {
        self.tiles.get(usize::from(texture.number())).copied().unwrap_or(0)
    }

    /// Of all textures.
    #[cfg(feature = "checks")]
    pub(crate) fn by_texture(&self) -> impl Iterator<Item = (u16, u32)> + '_ {
        (0..).zip(self.tiles.iter().copied()).filter(|(_, tiles)| *tiles > 0)
    }

    fn tiles_mut(&mut self, texture: TextureId) -> &mut u32 {
        let number = usize::from(texture.number());
        if self.tiles.len() <= number {
            self.tiles.resize(number + 1, 0);
        }
        &mut self.tiles[number]
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
        *self.flight.tiles_mut(texture) += 1;
        self.stats.requests += 1;
        self.stats.in_flight += 1;
        self.stats.in_flight_bytes += self.flight_bytes;
    }

    pub(crate) fn leave_flight(&mut self, texture: TextureId) {
        *self.flight.tiles_mut(texture) -= 1;
        self.stats.in_flight -= 1;
        self.stats.in_flight_bytes -= self.flight_bytes;
    }

    /// A tile that was in flight is of no use.
    pub(crate) fn waste_one(&mut self, texture: TextureId) {
        self.stats.wasted += 1;
        self.leave_flight(texture);
    }
}

impl Pager {
    /// The best page that is to be asked for, would find a slot, and is of a texture that has not its share of what is in flight.
    pub(crate) fn next_queued(&mut self) -> Option<PageId> {
        let (first, left) = (self.next_request, self.order.get(self.next_request..)?);
        let mut held_back = None;
        let found = (first..).zip(left).find_map(|(place, &page)| {
            if self.residency.state(page) != PageState::Queued || !self.residency.may_load(page) {
                return None;
            }
            let may_begin = self.may_hold_more(page.texture());
            if !may_begin && held_back.is_none() {
                held_back = Some(place);
            }
            may_begin.then_some(place)
        });
        self.next_request = found.unwrap_or(self.order.len());
        self.held_back = self.held_back.or(held_back);
        self.order.get(self.next_request).copied().filter(|_| !self.has_no_room())
    }

    /// Whether a texture may begin another load in view, as far as other textures are concerned.
    fn may_hold_more(&self, texture: TextureId) -> bool {
        let own = u64::from(self.residency.flight.tiles(texture)) * self.residency.flight_bytes;
        let is_alone = self.textures.with_pages() + self.beside.textures <= 1;
        if is_alone || own == 0 {
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
