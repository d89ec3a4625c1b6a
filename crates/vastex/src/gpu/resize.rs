//! Pools that grow and shrink while pictures are drawn, and keep their tiles.
//!
//! What stays and where it goes is the pager's decision (`vastex_core::Pager::resize_pool`); here the memory
//! is taken and tiles and page tables follow.

use vastex_core::{PoolId, PoolLayout, SlotMove};

use super::{Gpu, PoolState};
use crate::error::Error;

/// What resizing a pool came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoolResize {
    /// Bytes of the pool before; 0 while it had no textures.
    pub before: u64,
    /// Bytes of the pool now.
    pub bytes: u64,
    /// Bytes that both took together while tiles were copied. They are the old pool's and the new one's, and
    /// the old one's are given back when the GPU is done with the copies.
    pub transient: u64,
}

impl Gpu {
    /// Where the slots of a pool would lie if it were as large as `bytes` allow.
    pub(crate) fn pool_layout(&self, pool: PoolId, bytes: u64) -> Result<PoolLayout, Error> {
        self.pools[usize::from(pool.number())].fit(&self.device, bytes)
    }

    /// A pool with other slots, empty, beside the one that there is.
    pub(crate) fn resized_pool(&self, pool: PoolId, slots: PoolLayout) -> Result<PoolState, Error> {
        self.pools[usize::from(pool.number())].resized(&self.device, &self.queue, slots)
    }

    /// Notes that somebody chose the size of a pool, or that nobody has.
    pub(crate) fn set_sized(&mut self, pool: PoolId, is_sized: bool) {
        self.pools[usize::from(pool.number())].is_sized = is_sized;
    }

    /// Copies the tiles that stay, and puts the new pool in the place of the old one. The page tables of its
    /// textures are to be begun anew, which the next [`Gpu::carry_out`] does.
    pub(crate) fn replace_pool(
        &mut self,
        pool: PoolId,
        mut new: PoolState,
        moves: &[SlotMove],
    ) -> Result<PoolResize, Error> {
        let number = usize::from(pool.number());
        let mut encoder = self.device.create_command_encoder(&Default::default());
        new.copy_from(&mut encoder, &self.pools[number], moves);
        self.queue.submit([encoder.finish()]);
        let (before, bytes) = (self.pools[number].bytes(), new.bytes());
        self.pools[number] = new;
        // Its tables are new ones, which know no texture yet.
        let textures = self.texture_ids().into_iter().filter_map(|texture| {
            let state = self.texture(texture).filter(|state| state.pool == pool)?;
            Some((texture, state.description.clone(), state.tail_slot))
        });
        let textures: Vec<_> = textures.collect();
        if let Some(tables) = self.pools[number].tables_mut() {
            for (texture, description, slot) in textures {
                tables.add(texture, &description.geometry, slot)?;
            }
        }
        self.pending_tables.pools.insert(pool);
        Ok(PoolResize { before, bytes, transient: before + bytes })
    }
}
