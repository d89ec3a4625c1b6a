//! What a pool is made with: its slots, its budgets and its rule of the mip bias.

use crate::pager::bias::BiasRule;

/// The budgets of a pool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PagerSettings {
    /// Slots of the pool.
    pub slots: u32,
    /// Bytes of a tile.
    pub tile_bytes: u64,
    /// Bytes uploaded per frame; see [`UploadBucket`]. A budget below one tile still gets there, only later.
    pub upload_bytes_per_frame: u64,
    /// Bytes of tiles with the loader or waiting for the upload budget; at least one tile is always allowed.
    pub in_flight_bytes: u64,
    /// How much coarser the picture becomes so that the working set fits. Without a rule it never does, and too small a pool shows
    /// what came first.
    pub mip_bias: Option<BiasRule>,
    /// The share of the slots that pins may take, tails included, in percent; at most [`PagerSettings::MOST_PINS`] counts.
    pub pin_share: u32,
}

impl PagerSettings {
    /// Percent of the slots that pins may take where nothing else is said.
    pub const PIN_SHARE: u32 = 50;
    /// Percent of the slots that pins may take at most, so that there is always room for a view.
    pub const MOST_PINS: u32 = 80;

    /// Slots that pins may take, tails included.
    pub(crate) fn pin_slots(&self) -> u32 {
        (u64::from(self.slots) * u64::from(self.pin_share.min(Self::MOST_PINS)) / 100) as u32
    }
}
