//! Pools that grow and shrink while pictures are drawn, and keep their tiles.
//!
//! What stays and where it goes is the pager's decision (`vastex_core::Pager::resize_pool`); here the memory is taken and tiles and page
//! tables follow.

use vastex_core::{PoolId, TextureId};

use crate::error::Error;
use crate::pools::PoolState;
use crate::textures::Textures;

/// What resizing a pool came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoolResize {
    /// Bytes of the pool before; 0 while it had no textures.
    pub before: u64,
    /// Its bytes now.
    pub bytes: u64,
    /// Bytes that both took together while tiles were copied. They are the old pool's and the new one's, and the old one's are
    /// given back when the GPU is done with the copies.
    pub transient: u64,
}

impl Textures {
    /// Makes a pool as large as `bytes` allow, between two frames; the picture does not change but for what no longer fits, which
    /// becomes coarser at once, and what now fits, which sharpens as it is loaded.
    ///
    /// The bind groups of the pool's textures, and of groups, are new ones; pipelines stay good. Fails where the device has no memory for the new pool beside the old one
    /// ([`vastex_wgpu::GpuError::OutOfMemory`]), where `bytes` are too few for what is pinned, and where everything is in view and may not become
    /// coarser; the pool is then as it was. Where there is no memory for a page table after that, pictures are as they were, and the next
    /// [update](Textures::update) goes on with the new pool. Costs a copy of each tile on the GPU, and anew the page tables of the pool's textures.
    pub fn resize_pool(&mut self, pool: PoolId, bytes: u64) -> Result<PoolResize, Error> {
        let number = usize::from(pool.number());
        let Some(old) = self.pools.get(number) else { return Err(Error::NoPool(pool)) };
        let before = old.bytes();
        if old.is_whole {
            // As large as its texture, whatever is asked for.
            return Ok(PoolResize { before, bytes: before, transient: before });
        }
        // What a frame could not do speaks of slots as they are.
        self.carry_out()?;
        let old = &self.pools[number];
        let slots = old.fit(&self.device, bytes)?;
        if slots == old.slots {
            return Ok(PoolResize { before, bytes: before, transient: before });
        }
        let mut new = old.resized(&self.device, &self.queue, slots)?;
        let mut moves = Vec::new();
        self.pager.resize_pool(pool, new.slots.slots(), &mut moves)?;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        new.copy_from(&mut encoder, old, &moves);
        self.queue.submit([encoder.finish()]);
        let resize = PoolResize { before, bytes: new.bytes(), transient: before + new.bytes() };
        self.cpu_tiles.moved(pool, &moves);
        let old = std::mem::replace(&mut self.pools[number], new);
        // From here on the pool is the new one for the pager and for the GPU. Its tables follow; where that fails, in the next frame.
        let of_pool = |id: &TextureId| self.pool_of(*id) == Some(pool);
        let textures: Vec<TextureId> = self.iter().filter(of_pool).collect();
        self.undone.tables.extend(textures);
        self.carry_out()?;
        let PoolResize { before, bytes, .. } = resize;
        tracing::info!(pool = %old.tiles, before, bytes, tiles = moves.len(), "a pool was resized");
        Ok(resize)
    }

    /// Makes pools follow a picture of so many pixels, from the next [`Textures::add`] on, and of those there are the ones that
    /// have no size of their own ([`crate::PoolTuning::bytes`]). A pool that would change by less than a quarter stays as it is, so
    /// that not every step of dragging a window copies tiles; see [`Textures::resize_pool`]. Says what was resized.
    pub fn set_picture(&mut self, picture: [u32; 2]) -> Result<Vec<(PoolId, PoolResize)>, Error> {
        self.settings.picture = picture;
        let mut resized = Vec::new();
        for (number, pool) in (0..).map(PoolId::new).zip(0..self.pools.len()) {
            let PoolState { slots, is_whole, .. } = &self.pools[pool];
            if *is_whole {
                continue;
            }
            let planned = self.pools[pool].planned(&self.settings.pools, picture);
            if planned.abs_diff(slots.bytes()) * 4 >= slots.bytes() {
                resized.push((number, self.resize_pool(number, planned)?));
            }
        }
        Ok(resized)
    }
}
