//! How the loop stands: counters of its own, beside the pager's.

use vastex_core::Stats;

use crate::textures::Textures;

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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// Frames so far.
    pub frame: u64,
    /// Of the pager: the pool, the working set, loads and evictions.
    pub pager: Stats,
    /// Whether, for a whole jitter cycle, nothing was newly wanted and nothing missing.
    pub converged: bool,
    /// Bytes of the pool in GPU memory.
    pub pool_bytes: u64,
    /// Bytes of page-table changes sent to the GPU so far.
    pub table_bytes_sent: u64,
    /// Bytes of feedback brought back so far.
    pub feedback_bytes_read: u64,
    /// Pixels of the newest feedback whose gradients said nothing.
    pub degenerate_pixels: u32,
}

impl Textures {
    /// How the loop stands.
    pub fn stats(&self) -> FrameStats {
        let Some(pool) = &self.pool else { return FrameStats::default() };
        let read = self.feedback.as_ref().map_or(0, |path| path.readback.bytes_read());
        FrameStats {
            frame: self.frame,
            pager: pool.pager.stats(),
            converged: pool.pager.is_converged(),
            pool_bytes: pool.gpu.layout().bytes(),
            table_bytes_sent: self.counters.table_bytes_sent,
            feedback_bytes_read: self.counters.feedback_bytes_read + read,
            degenerate_pixels: self.counters.degenerate,
        }
    }
}
