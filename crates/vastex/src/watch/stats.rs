//! How the loop stands after a frame, of all pools together and of each.

use std::sync::Arc;

use vastex_core::{PoolId, Stats};

/// How a pool stands after a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct PoolStats {
    /// The pool, as events name it.
    pub pool: PoolId,
    /// Its tiles, for people: size in texels, formats of the layers.
    pub tiles: Arc<str>,
    /// Its bytes in GPU memory; 0 while it has no textures.
    pub bytes: u64,
    /// Of its pager: slots, the working set, loads and evictions.
    pub pager: Stats,
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
