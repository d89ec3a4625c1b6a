//! How the loop and its pools stand.

use vastex_core::PoolPager;

use super::Textures;
use crate::gpu::PoolState;
use crate::watch::{FrameStats, PoolStats};

impl Textures {
    /// How the loop stands.
    pub fn stats(&self) -> FrameStats {
        let of_pool = |(pool, pager): (&PoolState, &PoolPager)| PoolStats {
            pool: pager.pool(),
            tiles: pool.tiles.clone(),
            bytes: pool.bytes(),
            pager: pager.stats(),
        };
        let pools: Vec<_> = self.gpu.pools().iter().zip(self.paging.pager().pools()).map(of_pool).collect();
        FrameStats {
            frame: self.paging.frame(),
            pager: self.paging.pager().stats(),
            converged: self.inspect().is_converged(),
            pool_bytes: pools.iter().map(|pool| pool.bytes).sum(),
            pools,
            table_bytes: self.gpu.table_bytes(),
            table_bytes_sent: self.gpu.table_bytes_sent(),
            fading: self.gpu.fading(),
            feedback_bytes_read: self.gpu.feedback_bytes_read(),
            degenerate_pixels: self.watch.degenerate_pixels(),
        }
    }
}
