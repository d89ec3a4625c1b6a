//! Page tables: what the pagers have changed is carried out, and a direct one grows when a finer level comes to it, a hashed one
//! with what is resident.

use vastex_core::{TableChange, TextureId};

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
                let resident = self.resident_pages(texture);
                let Some(Some(TextureState { table, .. })) =
                    self.textures.get_mut(usize::from(texture.number()))
                else {
                    continue;
                };
                let (device, queue) = (&self.device, &self.queue);
                let sent = self.changer.grow(device, queue, encoder, table, finest, changes, &resident)?;
                self.counters.table_bytes_sent += sent;
                moved.push(texture);
            }
        }
        self.changes = changes;
        Ok(moved)
    }

    /// Makes the bind groups of tables that lie elsewhere now.
    pub(crate) fn bind_moved_tables(&mut self, moved: &[TextureId]) {
        moved.iter().for_each(|&texture| self.make_bind_groups(texture));
        self.bind_groups_of(moved);
    }

    /// Begins the page table of a texture anew, with its tail and all that is resident.
    pub(crate) fn begin_table_anew(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        texture: TextureId,
    ) -> Result<(), Error> {
        let slot = self.pool_of(texture).and_then(|pool| self.pagers.pager(pool).tail_slot(texture));
        let resident = self.resident_pages(texture);
        let state = self.textures.get_mut(usize::from(texture.number()));
        let (Some(slot), Some(Some(TextureState { table, .. }))) = (slot, state) else { return Ok(()) };
        let (device, queue) = (&self.device, &self.queue);
        let sent = self.changer.begin_anew(device, queue, encoder, table, slot, &resident)?;
        self.counters.table_bytes_sent += sent;
        Ok(())
    }

    /// What a page table in which every entry leads to the tail is to be told.
    fn resident_pages(&self, texture: TextureId) -> Vec<TableChange> {
        let mut resident = Vec::new();
        if let Some(pool) = self.pool_of(texture) {
            self.pagers.pager(pool).resident_changes(texture, &mut resident);
        }
        resident
    }
}
