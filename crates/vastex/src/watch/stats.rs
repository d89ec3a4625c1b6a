//! How the loop stands after a frame, of all pools together and of each.

use std::sync::Arc;

use vastex_core::{BiasRule, PoolId, Stats};

/// The state of a pool after a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct PoolStats {
    /// The pool, as events name it.
    pub pool: PoolId,
    /// The pool's tiles, for people: size in texels, formats of the layers.
    pub tiles: Arc<str>,
    /// The pool's bytes in GPU memory; 0 while it has no textures.
    pub bytes: u64,
    /// Figures of the pool's pager: slots, the working set, loads and evictions.
    pub pager: Stats,
}

impl PoolStats {
    /// Bytes of a slot, about: those of the pool divided among its slots.
    pub fn tile_bytes(&self) -> u64 {
        self.bytes / u64::from(self.pager.slots.max(1))
    }

    /// The slots that a view may take before it becomes coarser: 90 %, so that what comes into view finds
    /// room.
    pub fn room(&self) -> u32 {
        BiasRule::room(self.pager.slots)
    }

    /// Returns true if all pages wanted now take no more than 80 % of the slots, so that a mip bias still in
    /// force falls.
    pub fn fits(&self) -> bool {
        u64::from(self.pager.wanted) * 5 <= u64::from(self.pager.slots) * 4
    }

    /// Returns true if the pool is too small for what views want now: the picture is coarser than wanted, and
    /// stays so.
    pub fn is_oversubscribed(&self) -> bool {
        let Stats { wanted, slots, bias_eighths, .. } = self.pager;
        bias_eighths > 0 && !self.fits() || wanted > slots
    }

    /// The size, in bytes, of a pool that shows all pages wanted now without a mip bias: they take 80 % of
    /// it; in whole MiB.
    pub fn bytes_wanted(&self) -> u64 {
        (u64::from(self.pager.wanted) * self.tile_bytes() * 5).div_ceil(4).next_multiple_of(1 << 20)
    }
}

/// The state of the frame loop after a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// Frames so far.
    pub frame: u64,
    /// Sums over all pools: slots, the working sets, loads and evictions; the largest mip bias of any.
    pub pager: Stats,
    /// True if, for a whole jitter cycle, nothing was newly wanted and nothing missing, in any pool; of views
    /// of rays that rest ([`ViewMut::set_resting`](crate::ViewMut::set_resting)), for every pixel.
    pub converged: bool,
    /// Bytes of all pools in GPU memory.
    pub pool_bytes: u64,
    /// Each pool, in the order of their numbers.
    pub pools: Vec<PoolStats>,
    /// Bytes of all page tables in GPU memory. While a table grows or moves, both count: the one being filled
    /// and, for commands recorded before, the old one.
    pub table_bytes: u64,
    /// Bytes of page-table changes sent to the GPU so far.
    pub table_bytes_sent: u64,
    /// Tiles that are fading in: the picture of a view is final when the view has converged and nothing
    /// fades.
    pub fading: usize,
    /// Bytes of feedback brought back so far.
    pub feedback_bytes_read: u64,
    /// Pixels of the newest feedback, of all views together, whose gradients are undefined.
    pub degenerate_pixels: u32,
}
