//! Page tables: what the pagers have changed is carried out, and a direct one grows when a finer level comes to it, a hashed one
//! with what is resident.

use vastex_core::{Slot, TextureId};

use crate::error::Error;
use crate::textures::{TextureState, Textures};

impl Textures {
    /// Records the page-table changes of exactly the uploads of this frame, and says which tables lie elsewhere then. Nothing that a
    /// picture reads changes before the commands are submitted.
    pub(crate) fn change_tables(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<Vec<TextureId>, Error> {
        let mut changes = std::mem::take(&mut self.changes);
        self.pagers.take_table_changes(&mut changes);
        self.begin_fades(&changes);
        // A stable order: what is decided of one texture stays in sequence.
        changes.sort_by_key(|change| change.page.texture());
        let anew = self.undone.tables.clone();
        self.undone.tables.extend(changes.iter().map(|change| change.page.texture()));
        let mut moved = Vec::new();
        for &texture in &anew {
            self.begin_table_anew(encoder, texture)?;
            moved.push(texture);
        }
        for changes in changes.chunk_by(|a, b| a.page.texture() == b.page.texture()) {
            let texture = changes[0].page.texture();
            let finest = changes.iter().map(|change| change.page.level()).min().unwrap_or(0);
            let Some(Some(TextureState { table, .. })) = self.textures.get_mut(usize::from(texture.number()))
            else {
                continue;
            };
            if anew.contains(&texture) {
                continue;
            }
            if table.has_level(finest) {
                let applied = self.changer.apply(&self.device, &self.queue, encoder, table, changes)?;
                self.counters.table_bytes_sent += applied.bytes;
                if applied.has_moved {
                    moved.push(texture);
                }
            } else {
                self.counters.table_bytes_sent += table.grow(&self.device, &self.queue, finest)?;
                self.tell_table(encoder, texture)?;
                moved.push(texture);
            }
        }
        self.changes = changes;
        Ok(moved)
    }

    /// Makes the bind groups of tables that lie elsewhere now.
    pub(crate) fn bind_moved_tables(&mut self, moved: &[TextureId]) {
        moved.iter().for_each(|&texture| self.make_bind_groups(texture));
        if !moved.is_empty() {
            self.update_groups();
            self.bind_groups_anew();
        }
    }

    /// Begins the page table of a texture anew, with its tail and all that is resident.
    pub(crate) fn begin_table_anew(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        texture: TextureId,
    ) -> Result<(), Error> {
        let Some(pool) = self.pool_of(texture) else { return Ok(()) };
        let slot: Option<Slot> = self.pagers.pager(pool).tail_slot(texture);
        let state = self.textures.get_mut(usize::from(texture.number()));
        let (Some(slot), Some(Some(state))) = (slot, state) else { return Ok(()) };
        self.counters.table_bytes_sent += state.table.reset(&self.device, &self.queue, slot);
        self.tell_table(encoder, texture)
    }

    /// Tells a page table in which every entry leads to the tail what is resident.
    fn tell_table(&mut self, encoder: &mut wgpu::CommandEncoder, texture: TextureId) -> Result<(), Error> {
        let (pool, state) = (self.pool_of(texture), self.textures.get_mut(usize::from(texture.number())));
        let (Some(pool), Some(Some(TextureState { table, .. }))) = (pool, state) else { return Ok(()) };
        let mut resident = Vec::new();
        self.pagers.pager(pool).resident_changes(texture, &mut resident);
        let applied = self.changer.apply(&self.device, &self.queue, encoder, table, &resident)?;
        self.counters.table_bytes_sent += applied.bytes;
        Ok(())
    }
}
