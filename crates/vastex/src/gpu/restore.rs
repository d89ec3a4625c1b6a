//! After a lost device: everything on the GPU is made again.

use bytes::Bytes;
use vastex_core::{Pager, TextureNumber};
use vastex_wgpu::{FeedbackMode, ParamStore, PoolTableChanger, RECORD_WORDS, new_sampler};

use super::carry_out::Undone;
use super::feedback_path::FeedbackPipelines;
use super::tables::PendingTables;
use super::{Gpu, tail_slot};
use crate::error::Error;
use crate::settings::Settings;

impl Gpu {
    /// Everything but textures, on another device. Pools are empty.
    /// The mode of feedback on a device. Fails where that lacks what the settings ask for.
    pub(crate) fn check_device_for(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
    ) -> Result<FeedbackMode, Error> {
        settings.binding.check(&device.limits())?;
        Ok(FeedbackMode::choose(settings.feedback, device)?)
    }

    pub(crate) fn restore(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        settings: &Settings,
    ) -> Result<(), Error> {
        let mode = self.check_device_for(device, settings)?;
        (self.device, self.queue, self.mode) = (device.clone(), queue.clone(), mode);
        self.forget_texture_space(None);
        self.undone = Undone::default();
        self.pending_tables = PendingTables::default();
        self.params = ParamStore::new(device, RECORD_WORDS)?;
        self.sampler = new_sampler(device);
        self.uploads.begin_anew(device, settings);
        self.restore_views();
        self.fit_main_view(settings.picture);
        self.changer = PoolTableChanger::new(device, self.mode);
        self.pipelines = FeedbackPipelines::new(device, self.mode);
        for pool in &mut self.pools {
            pool.restore(device, queue, self.mode)?;
        }
        // What texts and bindings are made for may be others on this device.
        self.forget_bind_groups();
        for texture in self.texture_ids() {
            self.bind_texture(texture);
        }
        self.restore_groups()
    }

    /// The tail of a texture, its page table and its record. The tail is as the pool holds tiles, and the
    /// newest that was to be uploaded.
    pub(crate) fn restore_texture(
        &mut self,
        texture: TextureNumber,
        tail: &Bytes,
        pager: &Pager,
    ) -> Result<(), Error> {
        let number = usize::from(texture.number());
        let (Some(slot), Some(Some(state))) = (tail_slot(pager, texture), self.textures.get_mut(number))
        else {
            return Ok(());
        };
        state.tail_slot = slot;
        let (pool, description) = (usize::from(state.pool.number()), state.description.clone());
        self.pools[pool].upload(&self.queue, slot, tail)?;
        self.pools[pool].note_range(slot, tail);
        if let Some(tables) = self.pools[pool].tables_mut() {
            tables.add(texture, &description.geometry, slot)?;
        }
        self.set_record(texture);
        Ok(())
    }
}
