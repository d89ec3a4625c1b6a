//! How a direct page table in a texture grows: piece by piece, coarse levels first, so that no frame sends much.
//!
//! The larger texture is filled from its end, where the coarse levels lie, beside the one that is there. It takes that one's place as soon
//! as it has a level more, and goes on from there: of each further level shaders are told when all of it has been sent. Tables in buffers
//! are filled on the GPU, at once (`table_changer`).

use vastex_core::{Geometry, TableChange};

use crate::device::{alive, guarded, staged};
use crate::error::GpuError;
use crate::table::{Entries, Kind, TableBuffers, Words, entry_count, first_entry};
use crate::table_changer::Applied;
use crate::table_texture::{TableTexture, mark_below};

/// How far a table is to grow, and where.
#[derive(Debug)]
pub(crate) struct Growth {
    /// The finest level that it is to have.
    level: u8,
    /// The texture that is being filled beside the table's, with room for the levels from this one on.
    beside: Option<(TableTexture, u8)>,
}

impl Growth {
    /// Of a table that has, or is given, the entries from a level on.
    pub(crate) fn to(level: u8) -> Growth {
        Growth { level, beside: None }
    }

    pub(crate) fn level(&self) -> u8 {
        self.level
    }

    /// GPU memory of what is being filled beside the table.
    pub(crate) fn bytes(&self) -> u64 {
        self.beside.as_ref().map_or(0, |(texture, _)| texture.bytes())
    }

    /// Entries from a level on are wanted.
    pub(crate) fn begin(&mut self, level: u8) {
        self.level = self.level.min(level);
    }

    /// Changes that the table has; they go to what was sent of the larger texture as well.
    pub(crate) fn mark(&mut self, geometry: &Geometry, changes: &[TableChange]) {
        if let Some((texture, begin)) = &mut self.beside {
            changes.iter().for_each(|change| mark_below(texture, geometry, *begin, change));
        }
    }
}

impl TableBuffers {
    /// Whether some of its entries are yet to be sent ([`crate::TableChanger::go_on`]). Only a direct table in a texture ever is.
    pub fn is_growing(&self) -> bool {
        matches!(self.kind, Kind::Direct { finest, .. } if finest > self.growth.level)
    }

    /// See [`crate::TableChanger::go_on`].
    pub(crate) fn grow_in_texture(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        budget: &mut u64,
    ) -> Result<Applied, GpuError> {
        let mut applied = Applied::default();
        while self.is_growing() && *budget > 0 {
            if !self.is_filling() && self.growth.beside.is_none() {
                self.grow_beside(device)?;
            }
            applied.bytes += self.send_more(device, encoder, budget);
            match self.growth.beside.take() {
                None => self.tell_filled(device, encoder),
                Some((texture, begin)) => {
                    let before = self.move_into(device, queue, texture, begin);
                    applied.before = applied.before.or(before.map(Box::new));
                }
            }
        }
        Ok(applied)
    }

    /// Whether the texture that it lies in has levels that are yet to be sent.
    fn is_filling(&self) -> bool {
        matches!(self.kind, Kind::Direct { finest, begin, .. } if finest > begin)
    }

    /// Takes a texture for all levels that are wanted.
    fn grow_beside(&mut self, device: &wgpu::Device) -> Result<(), GpuError> {
        alive(device)?;
        let bytes = 4 * entry_count(&self.geometry, self.growth.level);
        let texture = guarded(device, bytes, || TableTexture::new(device, bytes))?;
        self.growth.beside = Some((texture, self.growth.level));
        Ok(())
    }

    /// Sends changes of what was sent of the texture that is filled, and more of it; returns the bytes.
    fn send_more(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        budget: &mut u64,
    ) -> u64 {
        let Kind::Direct { begin, image: Some(image), .. } = &self.kind else { return 0 };
        let (texture, begin) = match (&mut self.growth.beside, &mut self.entries) {
            (Some((texture, begin)), _) => (texture, *begin),
            (None, Entries::Texture(texture)) => (texture, *begin),
            (None, Entries::Buffer(_)) => return 0,
        };
        let words = Words::of(image, &self.geometry, begin);
        texture.send(device, encoder, &words) + texture.send_more(device, encoder, &words, budget)
    }

    /// Lies in a texture from now on, with room for the levels from `begin` on, if that has a level more; gives the table as it lay before.
    fn move_into(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        texture: TableTexture,
        begin: u8,
    ) -> Option<TableBuffers> {
        let filled = filled_level(&self.geometry, &texture, begin);
        let Kind::Direct { finest, image, .. } = &mut self.kind else { return None };
        if filled >= *finest {
            self.growth.beside = Some((texture, begin));
            return None;
        }
        let kind = Kind::Direct { finest: filled, begin, image: image.take() };
        let level = self.growth.level;
        let before = self.take_place(device, queue, Entries::Texture(texture), kind, self.tail_slot());
        self.growth.begin(level);
        Some(before)
    }

    /// Tells shaders of the levels that have been sent whole, when the commands before are done.
    fn tell_filled(&mut self, device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder) {
        let (Kind::Direct { finest, begin, .. }, Entries::Texture(texture)) = (&mut self.kind, &self.entries)
        else {
            return;
        };
        let filled = filled_level(&self.geometry, texture, *begin);
        if filled < *finest {
            *finest = filled;
            let params = self.texture_params();
            // A lost device shows where the frame begins.
            if let Some(buffer) = staged(device, "vastex texture", bytemuck::bytes_of(&params)) {
                encoder.copy_buffer_to_buffer(&buffer, 0, self.params(), 0, buffer.size());
            }
        }
    }
}

/// The finest level of which all has been sent of a texture with room for the levels from `begin` on; beyond the coarsest where there is none.
fn filled_level(geometry: &Geometry, texture: &TableTexture, begin: u8) -> u8 {
    let of = |level: u8| first_entry(geometry, level) - first_entry(geometry, begin);
    let is_there = |level: &u8| of(*level) >= texture.first_sent();
    let tail = geometry.tail().first_level();
    (begin..tail).find(is_there).unwrap_or(tail)
}
