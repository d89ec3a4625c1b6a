//! How much of the in-flight budget a texture may hold, beside what all pools hold. The rule stands at the
//! head of `residency::flight`.

use crate::residency::Residency;
use crate::texture::page::TextureNumber;

/// The in-flight budget, as it stands for all pools.
#[derive(Clone, Copy, Debug)]
pub(super) struct FlightShare {
    /// Bytes that may be in flight.
    pub(super) budget: u64,
    /// Bytes that are.
    pub(super) in_flight: u64,
    /// No more than one texture, of all pools, has pages to ask for.
    pub(super) is_alone: bool,
}

impl FlightShare {
    /// Returns true if the texture may begin another load in view, as far as other textures are concerned.
    pub(super) fn may_hold_more(self, residency: &Residency, texture: TextureNumber) -> bool {
        let own = residency.bytes_for_view(texture);
        self.is_alone
            || own == 0
            || own + residency.flight_bytes() <= self.budget.saturating_sub(self.in_flight)
    }
}
