//! Which page is asked for next, while no texture holds so much of the in-flight budget that others cannot begin.
//!
//! What is in flight of each texture is counted in `residency::flight`; the rule stands at its head.

use crate::pager::pool::Pager;
use crate::residency::PageState;
use crate::texture::page::{PageId, TextureId};

/// What is in other pools that share the budget.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Beside {
    /// Bytes in flight.
    pub(crate) in_flight_bytes: u64,
    /// Textures that have pages to ask for.
    pub(crate) textures: u32,
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
