//! After a lost device: everything on the GPU is made again, from what the pager knows and main memory has.

use vastex_core::TextureId;
use vastex_wgpu::{FeedbackWay, TableBuffers, TableChanger, alive};

use crate::error::Error;
use crate::feedback::FeedbackPipelines;
use crate::frame::Undone;
use crate::tables::MovingTables;
use crate::textures::Textures;

impl Textures {
    /// Fails with [`vastex_wgpu::GpuError::DeviceLost`] where the device is lost. The frame loop says so by itself; this is for frames that
    /// do not get as far, as when a window gives no picture. Costs a buffer of 4 bytes.
    pub fn check_device(&self) -> Result<(), Error> {
        Ok(alive(&self.device)?)
    }

    /// Goes on with another device, after [`vastex_wgpu::GpuError::DeviceLost`]: makes the pools and page tables anew and puts
    /// the tails there, which are in main memory, so that it waits for no source; in the next frames the tiles of the view come
    /// again, from the RAM cache as far as it has them. Textures keep their ids, tickets and pins stay, as do levels that were set.
    ///
    /// What the application made from the old device it makes again: its pipelines with [`Textures::wgsl`] and
    /// [`Textures::bind_group_layout`], its own buffers. Fails where the new device is lost as well, or cannot hold what the
    /// old one could; then it may be called again with another.
    pub fn restore(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<(), Error> {
        (self.device, self.queue) = (device.clone(), queue.clone());
        self.way = FeedbackWay::choose(self.settings.feedback, device)?;
        self.forget_texture_space(None);
        self.undone = Undone::default();
        self.moving = MovingTables::default();
        self.asked_pixels.clear();
        self.uploads.begin_anew(device, &self.settings);
        self.pager.tiles_lost();
        self.cpu_tiles.tiles_lost();
        self.restore_views();
        self.changer = TableChanger::new(device, self.way);
        self.pipelines = FeedbackPipelines::new(device, self.way);
        for pool in &mut self.pools {
            pool.restore(device, queue, self.way)?;
        }
        let textures: Vec<TextureId> = self.iter().collect();
        textures.into_iter().try_for_each(|texture| self.restore_texture(texture))?;
        self.restore_groups()?;
        tracing::info!("everything was made again on another device");
        Ok(())
    }

    /// Its tail, its page table and its bind groups.
    fn restore_texture(&mut self, texture: TextureId) -> Result<(), Error> {
        let number = usize::from(texture.number());
        let (Some(pool), Some(Some(state))) = (self.pool_of(texture), self.textures.get_mut(number)) else {
            return Ok(());
        };
        let Some(slot) = self.pager.pool(pool).tail_slot(texture) else { return Ok(()) };
        let pool = &self.pools[usize::from(pool.number())];
        // It is as the pool holds tiles, and the newest that was to be uploaded.
        pool.upload(&self.queue, slot, &state.tail)?;
        let (rule, geometry) = (state.table.rule(), &state.description.geometry);
        state.table = TableBuffers::new(
            &self.device,
            &self.queue,
            geometry,
            texture,
            slot,
            state.page_table,
            self.way,
        )?;
        state.table.set_rule(&self.queue, rule);
        self.make_bind_groups(texture);
        Ok(())
    }
}
