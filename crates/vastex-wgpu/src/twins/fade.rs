//! Twin of fade.wgsl and fade_reach.wgsl: what is shown of tiles that fade in, or are there at once.

use vastex_core::Slot;

use super::Texture;
use super::lookup::{Place, Position};

impl Texture<'_> {
    /// How much of what was there before the tile of a slot remains.
    fn old_share(&self, slot: Slot) -> f32 {
        self.fades.get(slot.index() as usize).map_or(0.0, |&share| f32::from(share) / 255.0)
    }

    /// `vastexi_shown` and `vastexi_shown_beside`: what is shown at a position, of which `taken` says what
    /// there is of each tile.
    pub(super) fn shown(
        &self,
        position: Position,
        wanted: u8,
        taken: impl Fn(Place) -> [f32; 4],
    ) -> [f32; 4] {
        let (mut sum, mut left) = ([0.0; 4], 1.0);
        let mut place = self.place_of(position, wanted);
        loop {
            let old_share = self.old_share(place.slot);
            if old_share < 1.0 {
                let tile = taken(place);
                sum = std::array::from_fn(|c| sum[c] + left * (1.0 - old_share) * tile[c]);
            }
            left *= old_share;
            if left == 0.0 || place.level >= self.geometry.tail().first_level() {
                return sum;
            }
            place = self.place_of(position, place.level + 1);
        }
    }
}
