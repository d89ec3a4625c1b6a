//! Page tables: what the pager has changed is carried out, and a direct one grows when a finer level comes to it, a hashed one
//! with what is resident.

use std::collections::BTreeSet;

use vastex_core::{TableChange, TextureId};
use vastex_wgpu::{Applied, TableBuffers};

use crate::error::Error;
use crate::textures::{TextureState, Textures};

/// How many updates may lie between the recording of commands and their submission.
const RECORDED_AHEAD: u64 = 2;
/// Bytes that a frame sends of page tables that grow in textures.
const GROWTH_BYTES: u64 = 1 << 20;

/// Page tables that are on their way from one place to another.
#[derive(Debug, Default)]
pub(crate) struct MovingTables {
    /// As they lay before, for what was recorded with them; each with the frame in which it moved.
    before: Vec<(TextureId, u64, Box<TableBuffers>)>,
    /// Textures whose tables are yet to be sent, in part.
    growing: BTreeSet<TextureId>,
}

impl MovingTables {
    /// A texture is removed, or its table begins anew beside another pool.
    pub(crate) fn forget(&mut self, texture: TextureId) {
        self.before.retain(|(of, ..)| *of != texture);
        self.growing.remove(&texture);
    }

    /// GPU memory of tables as they lay before.
    pub(crate) fn bytes(&self) -> u64 {
        self.before.iter().map(|(.., before)| before.bytes()).sum()
    }

    /// Whether every table has been sent whole. Old tables that are still followed do not count.
    pub(crate) fn is_settled(&self) -> bool {
        self.growing.is_empty()
    }
}

impl Textures {
    /// Records the page-table changes of exactly the uploads of this frame, and says which tables lie elsewhere then. Nothing that a
    /// picture reads changes before the commands are submitted.
    pub(crate) fn change_tables(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<Vec<TextureId>, Error> {
        let mut changes = std::mem::take(&mut self.changes);
        self.pager.take_table_changes(&mut changes);
        self.begin_fades(&changes);
        // A stable order: what is decided of one texture stays in sequence.
        changes.sort_by_key(|change| change.page.texture());
        let anew = self.undone.tables.clone();
        self.undone.tables.extend(changes.iter().map(|change| change.page.texture()));
        self.undone.tables.extend(&self.moving.growing);
        let frame = self.frame;
        self.moving.before.retain(|(_, moved, _)| moved + RECORDED_AHEAD > frame);
        let mut moved = Vec::new();
        for &texture in &anew {
            self.begin_table_anew(encoder, texture)?;
            moved.push(texture);
        }
        for changes in changes.chunk_by(|a, b| a.page.texture() == b.page.texture()) {
            let texture = changes[0].page.texture();
            if !anew.contains(&texture) {
                let applied = self.change_table(encoder, texture, changes)?;
                self.note_moved(texture, applied, &mut moved);
            }
        }
        self.go_on_growing(encoder, &mut moved)?;
        self.changes = changes;
        Ok(moved)
    }

    /// Records the changes of one texture.
    fn change_table(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        texture: TextureId,
        changes: &[TableChange],
    ) -> Result<Applied, Error> {
        let finest = changes.iter().map(|change| change.page.level()).min().unwrap_or(0);
        let number = usize::from(texture.number());
        let Some(Some(TextureState { table, .. })) = self.textures.get(number) else {
            return Ok(Applied::default());
        };
        let grows = !table.has_level(finest);
        let resident = if grows { self.resident_pages(texture) } else { Vec::new() };
        let Some(Some(TextureState { table, .. })) = self.textures.get_mut(number) else {
            return Ok(Applied::default());
        };
        let (device, queue, changer) = (&self.device, &self.queue, &self.changer);
        let applied = match grows {
            false => changer.apply(device, queue, encoder, table, changes)?,
            true => changer.grow(device, queue, encoder, table, finest, changes, &resident)?,
        };
        if table.is_growing() {
            self.moving.growing.insert(texture);
        }
        for (of, _, before) in &mut self.moving.before {
            if *of == texture {
                let sent = changer.follow(device, queue, encoder, table, before, changes)?;
                self.counters.table_bytes_sent += sent;
            }
        }
        Ok(applied)
    }

    /// Sends more of the tables that grow in textures.
    fn go_on_growing(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        moved: &mut Vec<TextureId>,
    ) -> Result<(), Error> {
        let mut budget = GROWTH_BYTES;
        let growing: Vec<TextureId> = self.moving.growing.iter().copied().collect();
        for texture in growing {
            let state = self.textures.get_mut(usize::from(texture.number()));
            let Some(Some(TextureState { table, .. })) = state else { continue };
            let (device, queue) = (&self.device, &self.queue);
            let applied = self.changer.go_on(device, queue, encoder, table, &mut budget)?;
            if !table.is_growing() {
                self.moving.growing.remove(&texture);
            }
            self.note_moved(texture, applied, moved);
        }
        Ok(())
    }

    /// Keeps a table as it lay before.
    fn note_moved(&mut self, texture: TextureId, applied: Applied, moved: &mut Vec<TextureId>) {
        self.counters.table_bytes_sent += applied.bytes;
        if let Some(before) = applied.before {
            self.moving.before.push((texture, self.frame, before));
            moved.push(texture);
        }
    }

    /// Makes the bind groups of tables that lie elsewhere now.
    pub(crate) fn bind_moved_tables(&mut self, moved: &[TextureId]) {
        moved.iter().for_each(|&texture| self.make_bind_groups(texture));
        self.bind_groups_of(moved);
    }

    /// Begins the page table of a texture anew, with its tail and all that is resident.
    fn begin_table_anew(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        texture: TextureId,
    ) -> Result<(), Error> {
        let slot = self.pool_of(texture).and_then(|pool| self.pager.pool(pool).tail_slot(texture));
        let resident = self.resident_pages(texture);
        self.moving.forget(texture);
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
            self.pager.pool(pool).resident_changes(texture, &mut resident);
        }
        resident
    }
}
