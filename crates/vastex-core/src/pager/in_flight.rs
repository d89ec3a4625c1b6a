//! Which page is asked for next, while no texture holds so much of the in-flight budget that others cannot begin.
//!
//! What is in flight of each texture is counted in `residency::flight`; the rule stands at its head.

use crate::pager::pool::Pager;
use crate::residency::PageState;
use crate::texture::page::{PageId, TextureId};

impl Pager {
    /// The best queued page that would find a slot and whose texture may hold more of the in-flight budget. Costs a look at each page that is
    /// passed over, again in each frame.
    pub(crate) fn next_queued(&mut self) -> Option<PageId> {
        while let Some(&page) = self.order.get(self.next_request) {
            if self.residency.state(page) == PageState::Queued && self.residency.may_load(page) {
                if self.may_hold_more(page.texture()) {
                    return Some(page).filter(|_| !self.has_no_room());
                }
                self.held_back = self.held_back.or(Some(self.next_request));
                self.residency.note_passed_over(page.texture());
            }
            self.next_request += 1;
        }
        None
    }

    /// Whether no more than one texture, of all pools, has pages to ask for.
    pub(crate) fn is_alone(&self) -> bool {
        self.textures.with_pages() + self.beside.textures <= 1
    }

    /// Whether a texture may begin another load in view, as far as other textures are concerned.
    fn may_hold_more(&self, texture: TextureId) -> bool {
        let own = self.residency.bytes_for_view(texture);
        if self.is_alone() || own == 0 {
            return true;
        }
        let in_flight = self.residency.stats().in_flight_bytes + self.beside.in_flight_bytes;
        own + self.residency.flight_bytes() <= self.settings.in_flight_bytes.saturating_sub(in_flight)
    }

    /// What was passed over is looked at again.
    pub(crate) fn look_again(&mut self) {
        if let Some(place) = self.held_back.take() {
            self.next_request = self.next_request.min(place);
        }
    }
}
