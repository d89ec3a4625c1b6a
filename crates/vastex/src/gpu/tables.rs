//! Page tables and records: what the pager has changed is carried out, for all textures of a pool at once.

use std::collections::BTreeSet;

use vastex_core::{Pager, PoolId, TableChange, TextureNumber};
use vastex_wgpu::{RecordOf, group_record, no_record, texture_record};

use super::{Gpu, TextureOnGpu, tail_slot};
use crate::error::Error;

/// Bytes that a frame sends of page tables that grow in textures.
const GROWTH_BYTES: u64 = 1 << 20;

/// What of page tables and records is to be told to the GPU beside the changes of a frame. Empty between two
/// frames, but where one failed midway or something was set since.
#[derive(Debug, Default)]
pub(super) struct PendingTables {
    /// Pools that lie elsewhere: their page tables begin anew, and the records of their textures part from
    /// those that recorded commands see.
    pub(super) pools: BTreeSet<PoolId>,
    /// True if a record was set, or a table begun.
    pub(super) has_records: bool,
}

impl PendingTables {
    pub(super) fn is_empty(&self) -> bool {
        self.pools.is_empty() && !self.has_records
    }
}

/// What lies elsewhere once the commands of a frame are submitted.
#[derive(Debug, Default)]
pub(super) struct Moved {
    pools: BTreeSet<PoolId>,
    records: bool,
}

impl Gpu {
    /// Records the page-table changes of exactly the uploads of this frame, and says what lies elsewhere
    /// then. Nothing that a picture reads changes before the commands are submitted.
    pub(super) fn change_tables(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        pager: &Pager,
        changes: &[TableChange],
    ) -> Result<Moved, Error> {
        self.begin_fades(changes);
        let mut moved = Moved::default();
        for pool in self.pending_tables.pools.clone() {
            self.begin_tables_anew(pool, pager);
            moved.pools.insert(pool);
        }
        let mut budget = GROWTH_BYTES;
        let mut of_pool = std::mem::take(&mut self.changes_of_pool);
        for number in 0..self.pools.len() as u16 {
            let pool = PoolId::new(number);
            of_pool.clear();
            of_pool.extend(changes.iter().filter(|change| self.pool_of(change.page.texture()) == Some(pool)));
            if moved.pools.contains(&pool) {
                of_pool = self.resident_of(pool, pager);
            }
            let Some(tables) = self.pools[usize::from(number)].tables_mut() else { continue };
            let mut resident = |texture, resident: &mut Vec<TableChange>| {
                pager.pool(pool).resident_changes(texture, resident);
            };
            let (changer, device, queue) = (&self.changer, &self.device, &self.queue);
            let applied =
                tables.apply(changer, device, queue, encoder, &of_pool, &mut resident, &mut budget)?;
            self.sent.table_bytes += applied.bytes;
            if applied.moved {
                moved.pools.insert(pool);
            }
            applied.placed.into_iter().for_each(|texture| self.set_record(texture));
        }
        self.changes_of_pool = of_pool;
        moved.records = self.params.write(&self.device, encoder)?.moved;
        Ok(moved)
    }

    /// The commands of [`Gpu::change_tables`] were submitted.
    pub(super) fn tables_submitted(&mut self, moved: &Moved, is_update: bool) {
        for tables in self.pools.iter_mut().filter_map(|pool| pool.tables_mut()) {
            if is_update { tables.submitted() } else { tables.submitted_between() }
        }
        if is_update {
            self.params.submitted();
        } else {
            self.params.submitted_between();
        }

        self.pending_tables = PendingTables::default();
        if moved.records {
            self.bind_all_anew();
        } else {
            self.bind_anew(&moved.pools);
        }
    }

    /// What new page tables of a pool are to be told, which is all that is resident.
    fn resident_of(&self, pool: PoolId, pager: &Pager) -> Vec<TableChange> {
        let (mut all, mut of_texture) = (Vec::new(), Vec::new());
        for texture in self.texture_ids().into_iter().filter(|&texture| self.pool_of(texture) == Some(pool)) {
            pager.pool(pool).resident_changes(texture, &mut of_texture);
            all.append(&mut of_texture);
        }
        all
    }

    /// Returns true if all tables have been sent whole.
    pub(super) fn tables_are_settled(&self) -> bool {
        self.pools.iter().filter_map(|pool| pool.tables()).all(vastex_wgpu::PoolTables::is_settled)
    }

    /// Lets the tables of a pool that lies elsewhere begin, with the slots that its tails have now.
    fn begin_tables_anew(&mut self, pool: PoolId, pager: &Pager) {
        let is_of_pool = |gpu: &Gpu, texture: TextureNumber| gpu.pool_of(texture) == Some(pool);
        let textures: Vec<TextureNumber> =
            self.texture_ids().into_iter().filter(|&texture| is_of_pool(self, texture)).collect();
        self.params.part(textures.iter().copied());
        for texture in textures {
            let Some(slot) = tail_slot(pager, texture) else { continue };
            if let Some(Some(state)) = self.textures.get_mut(usize::from(texture.number())) {
                state.tail_slot = slot;
            }
            if let Some(tables) = self.pools[usize::from(pool.number())].tables_mut() {
                tables.begin_anew(texture, slot);
            }
            self.set_record(texture);
        }
    }

    /// Sets what shaders are told of a texture, from the next update on.
    pub(super) fn set_record(&mut self, texture: TextureNumber) {
        let Some(TextureOnGpu { pool, description, id, tail_slot, voxels, rule, .. }) = self.texture(texture)
        else {
            return;
        };
        let Some(tables) = self.pools[usize::from(pool.number())].tables() else { return };
        let placement = tables.placement(texture);
        let record = texture_record(&RecordOf {
            geometry: &description.geometry,
            voxels: voxels.as_deref(),
            id: *id,
            tail_slot: *tail_slot,
            rule: *rule,
            placement: &placement,
        });
        self.params.set(texture, &record);
        self.pending_tables.has_records = true;
    }

    /// Sets what shaders are told of a group.
    pub(super) fn set_group_record(
        &mut self,
        number: TextureNumber,
        geometry: &vastex_core::Geometry,
        id: u32,
    ) {
        self.params.set(number, &group_record(geometry, id));
        self.pending_tables.has_records = true;
    }

    /// Shaders know no texture or group of this number from the next update on.
    pub(super) fn forget_record(&mut self, number: TextureNumber) {
        self.params.set(number, &no_record());
        self.pending_tables.has_records = true;
    }
}
