//! How the loop stands: counters of its own, beside the pager's.

use vastex_core::{PoolPager, Stats};

use crate::pools::{PoolState, PoolStats};
use crate::textures::Textures;
use crate::views::ViewState;

/// Totals of the loop.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counters {
    pub(crate) table_bytes_sent: u64,
    /// By feedback paths that are gone.
    pub(crate) feedback_bytes_read: u64,
    /// Of the newest feedback.
    pub(crate) degenerate: u32,
}

/// How the loop stands after a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// Frames so far.
    pub frame: u64,
    /// Of all pools together: slots, the working sets, loads and evictions; the largest mip bias of any.
    pub pager: Stats,
    /// Whether, for a whole jitter cycle, nothing was newly wanted and nothing missing, in any pool.
    pub converged: bool,
    /// Bytes of all pools in GPU memory.
    pub pool_bytes: u64,
    /// Each pool, in the order of their numbers.
    pub pools: Vec<PoolStats>,
    /// Bytes of all page tables in GPU memory. Where one grows or lies elsewhere that is twice for a while: what is being filled and, for
    /// commands that were recorded before, what was there count, too.
    pub table_bytes: u64,
    /// Bytes of page-table changes sent to the GPU so far.
    pub table_bytes_sent: u64,
    /// Tiles that fade in at the moment: a picture is the last of its view when that has converged and nothing fades.
    pub fading: usize,
    /// Bytes of feedback brought back so far.
    pub feedback_bytes_read: u64,
    /// Pixels of the newest feedback, of all views together, whose gradients said nothing.
    pub degenerate_pixels: u32,
}

impl Textures {
    /// How the loop stands.
    pub fn stats(&self) -> FrameStats {
        let read = self.views.iter().map(ViewState::bytes_read).sum::<u64>();
        let of_pool = |(pool, pager): (&PoolState, &PoolPager)| PoolStats {
            pool: pager.pool(),
            tiles: pool.tiles.clone(),
            bytes: pool.bytes(),
            pager: pager.stats(),
        };
        let pools: Vec<_> = self.pools.iter().zip(self.pager.pools()).map(of_pool).collect();
        let tables = self.textures.iter().flatten().map(|texture| texture.table.bytes()).sum::<u64>();
        FrameStats {
            frame: self.frame,
            pager: self.pager.stats(),
            converged: self.has_converged(),
            pool_bytes: pools.iter().map(|pool| pool.bytes).sum(),
            pools,
            table_bytes: tables + self.moving.bytes(),
            table_bytes_sent: self.counters.table_bytes_sent,
            fading: self.fading(),
            feedback_bytes_read: self.counters.feedback_bytes_read + read,
            degenerate_pixels: self.counters.degenerate,
        }
    }
}
