//! GPU memory: pools that grow and shrink while pictures are drawn, budgets and rules that change, and a
//! device that is lost.
//!
//! What stays in a pool and where it goes is the pager's decision; the memory is taken, and tiles and page
//! tables follow.

use vastex_core::{BiasRule, PoolId};

use super::Textures;
use crate::error::Error;
use crate::gpu::{PoolResize, PoolState};
use crate::settings::Settings;

/// The GPU's memory and its device; returned by [`Textures::memory`].
pub struct Memory<'a> {
    textures: &'a mut Textures,
}

impl Textures {
    /// The GPU's memory and its device: sizes of pools, and what to do if the device is lost.
    pub fn memory(&mut self) -> Memory<'_> {
        Memory { textures: self }
    }

    /// Makes a pool that there is as large as `bytes` allow.
    pub(super) fn resize_to(&mut self, pool: PoolId, bytes: u64) -> Result<PoolResize, Error> {
        let old = &self.gpu.pools()[usize::from(pool.number())];
        let before = old.bytes();
        let unchanged = PoolResize { before, bytes: before, transient: before };
        let (old_slots, tiles) = (old.slots, old.tiles.clone());
        // What a frame could not do speaks of slots as they are.
        self.carry_out()?;
        let slots = self.gpu.pool_layout(pool, bytes)?;
        if slots == old_slots {
            return Ok(unchanged);
        }
        let new = self.gpu.resized_pool(pool, slots)?;
        let mut moves = Vec::new();
        self.paging.resize_pool(pool, new.slots.slots(), &mut moves)?;
        self.cpu.moved(pool, &moves);
        let resize = self.gpu.replace_pool(pool, new, &moves)?;
        // From here on the pool is the new one for the pager and for the GPU. Its tables follow; where that
        // fails, in the next frame.
        self.carry_out()?;
        let PoolResize { before, bytes, .. } = resize;
        tracing::info!(pool = %tiles, before, bytes, tiles = moves.len(), "a pool was resized");
        Ok(resize)
    }
}

impl Memory<'_> {
    /// Makes a pool as large as `bytes` allow, between two frames; the picture does not change, except that
    /// pages that no longer fit become coarser at once, and pages that now fit sharpen as they are loaded.
    ///
    /// The bind groups of the pool's textures, and of groups, are new ones; pipelines stay valid. Fails if
    /// the device has no memory for the new pool beside the old one
    /// ([`GpuError::OutOfMemory`](crate::GpuError::OutOfMemory)), if `bytes` are too few for the pinned
    /// pages, and if everything is in view and may not become coarser; the pool is then as it was. If there
    /// is no memory for a page table after that, pictures are as they were, and the next
    /// [update](Textures::update) goes on with the new pool. Costs a copy of each tile on the GPU, and new
    /// page tables of the pool's textures.
    ///
    /// From then on the pool has a size of its own, which [`Memory::set_picture`] does not change, until
    /// [`Memory::fit_pool`].
    pub fn resize_pool(&mut self, pool: PoolId, bytes: u64) -> Result<PoolResize, Error> {
        self.resize_as(pool, |_| bytes, true)
    }

    /// Makes a pool as large as the settings say for the picture, as before [`Memory::resize_pool`], and has
    /// it follow the picture again. Fails and costs as [`Memory::resize_pool`] does; if it fails, the pool
    /// keeps a size of its own if it had one. Bind groups are replaced as by [`Memory::resize_pool`].
    pub fn fit_pool(&mut self, pool: PoolId) -> Result<PoolResize, Error> {
        let Settings { pools, picture, .. } = self.textures.settings.clone();
        self.resize_as(pool, |state| state.planned(&pools, picture), false)
    }

    fn resize_as(
        &mut self,
        pool: PoolId,
        bytes: impl FnOnce(&PoolState) -> u64,
        is_sized: bool,
    ) -> Result<PoolResize, Error> {
        let Some(old) = self.textures.gpu.pools().get(usize::from(pool.number())) else {
            return Err(Error::NoPool(pool));
        };
        if old.is_whole {
            // As large as its textures, whatever is asked for.
            let before = old.bytes();
            return Ok(PoolResize { before, bytes: before, transient: before });
        }
        let bytes = bytes(old);
        let resize = self.textures.resize_to(pool, bytes)?;
        self.textures.gpu.set_sized(pool, is_sized);
        Ok(resize)
    }

    /// Makes pools follow a picture of so many pixels: those made by later calls of [`Textures::add`], and of
    /// the existing ones those without a size of their own ([`PoolTuning::bytes`](crate::PoolTuning::bytes),
    /// [`Memory::resize_pool`]). A pool that would change by less than a quarter stays as it is, so that
    /// dragging a window does not copy tiles at every step. Returns what was resized; fails and costs as
    /// [`Memory::resize_pool`] does.
    pub fn set_picture(&mut self, picture: [u32; 2]) -> Result<Vec<(PoolId, PoolResize)>, Error> {
        self.textures.settings.picture = picture;
        self.textures.gpu.fit_main_view(picture);
        let mut resized = Vec::new();
        for (number, pool) in (0..).map(PoolId::new).zip(0..self.textures.gpu.pools().len()) {
            let PoolState { slots, is_whole, is_sized, .. } = &self.textures.gpu.pools()[pool];
            if *is_whole || *is_sized {
                continue;
            }
            let planned = self.textures.gpu.pools()[pool].planned(&self.textures.settings.pools, picture);
            if planned.abs_diff(slots.bytes()) * 4 >= slots.bytes() {
                resized.push((number, self.textures.resize_to(number, planned)?));
            }
        }
        Ok(resized)
    }

    /// Sets how the mip bias of a pool is decided, between two frames; `None` for no bias. If the new rule
    /// says so, the picture becomes coarser at once, and sharper as tiles come. Pools made later have the
    /// rule of their settings. Fails if there is no such pool. Costs a visit of each page of the working set.
    pub fn set_bias_rule(&mut self, pool: PoolId, rule: Option<BiasRule>) -> Result<(), Error> {
        if self.textures.gpu.pools().get(usize::from(pool.number())).is_none() {
            return Err(Error::NoPool(pool));
        }
        self.textures.paging.set_bias_rule(pool, rule);
        Ok(())
    }

    /// Sets [`Settings::upload_bytes_per_frame`](crate::Settings::upload_bytes_per_frame) and
    /// [`Settings::in_flight_bytes`](crate::Settings::in_flight_bytes) from the next frame on. Loads beyond a
    /// smaller budget still arrive, and no others begin until they have; tiles that wait on a belt then go
    /// through the queue.
    pub fn set_budgets(&mut self, upload_bytes_per_frame: u64, in_flight_bytes: u64) {
        let Textures { settings, paging, gpu, .. } = &mut *self.textures;
        let before = (settings.upload_bytes_per_frame, settings.in_flight_bytes);
        if before != (upload_bytes_per_frame, in_flight_bytes) {
            (settings.upload_bytes_per_frame, settings.in_flight_bytes) =
                (upload_bytes_per_frame, in_flight_bytes);
            paging.set_budgets(settings);
            gpu.set_budgets(settings);
        }
    }

    /// Goes on with another device, after [`GpuError::DeviceLost`](crate::GpuError::DeviceLost): makes new
    /// pools and page tables and puts the tails there, which are in main memory, so that it waits for no
    /// source; in the next frames the tiles of the view are loaded again, from the RAM cache as far as it has
    /// them. Textures keep their ids, tickets, pins and levels.
    ///
    /// The application makes again what it had made from the old device: its pipelines with
    /// [`Textures::wgsl`] and [`Textures::bind_group_layout`], its own buffers. Fails if the new device lacks
    /// what the settings ask for, and changes nothing then; fails also if the new device is lost as well, or
    /// cannot hold what the old one could: then it may be called again with another.
    pub fn restore(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<(), Error> {
        self.textures.gpu.check_device_for(device, &self.textures.settings)?;
        self.textures.watch.device_lost();
        self.textures.paging.tiles_lost();
        self.textures.cpu.tiles_lost();
        self.textures.gpu.restore(device, queue, &self.textures.settings)?;
        for (texture, state) in self.textures.paging.textures() {
            self.textures.gpu.restore_texture(texture, &state.tail, self.textures.paging.pager())?;
        }
        // Bind groups are made anew with it, those of groups too.
        self.textures.gpu.bind_all_anew();
        self.textures.carry_out()?;
        tracing::info!("everything was made again on another device");
        Ok(())
    }
}
