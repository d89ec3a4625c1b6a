//! What the pager has decided is carried out, all of a frame at once: what can fail comes first, and touches
//! nothing that a picture reads; then tiles, page tables, fades, biases and parameters change together.

use vastex_core::{Pager, PoolId, TableChange, TextureNumber, Upload};
use vastex_wgpu::PoolTables;

use super::Gpu;
use crate::error::Error;

/// What the pager has decided and the GPU has not been told. Empty between two frames, but where one failed
/// midway.
#[derive(Debug, Default)]
pub(super) struct Undone {
    /// In the order in which they were decided.
    pub(super) uploads: Vec<(PoolId, Upload)>,
    /// True if page tables were being changed, which was not submitted: they begin anew with what is
    /// resident.
    has_tables: bool,
}

impl Undone {
    pub(super) fn is_empty(&self) -> bool {
        self.uploads.is_empty() && !self.has_tables
    }
}

impl Gpu {
    /// Returns true if all that was decided has been carried out, and all that was set has been told.
    pub(crate) fn is_done(&self) -> bool {
        self.undone.is_empty() && self.pending_tables.is_empty()
    }

    /// Takes an upload of this frame.
    pub(crate) fn take_upload(&mut self, pool: PoolId, upload: Upload) {
        self.note_fade(pool, upload.slot);
        self.note_range(pool, &upload);
        self.undone.uploads.push((pool, upload));
    }

    /// An empty list for the changes of a frame.
    pub(crate) fn changes_to_fill(&mut self) -> Vec<TableChange> {
        std::mem::take(&mut self.changes)
    }

    /// Carries out the uploads that were taken and the page-table changes of exactly these, in one
    /// submission. Where it fails nothing that a picture reads has changed, and the next call carries out the
    /// same and what has come to it. Beside updates it is called between two, where something is to be seen
    /// at once.
    pub(crate) fn carry_out(
        &mut self,
        pager: &Pager,
        mut changes: Vec<TableChange>,
        is_update: bool,
    ) -> Result<(), Error> {
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("vastex update") });
        if std::mem::replace(&mut self.undone.has_tables, true) {
            // What the call before was given of any pool is gone with its commands.
            self.pools.iter_mut().filter_map(|pool| pool.tables_mut()).for_each(PoolTables::lost);
        }
        let moved = self.change_tables(&mut encoder, pager, &changes)?;
        changes.clear();
        self.changes = changes;
        let copied = self.copy_tiles(&mut encoder)?;
        self.send_fades();
        for (pool, pager) in self.pools.iter_mut().zip(pager.pools()) {
            pool.set_bias(&self.queue, pager.bias_eighths());
            pool.send_ranges(&self.queue);
        }
        self.queue.submit([encoder.finish()]);
        // The belt's tiles were kept until their copies were submitted.
        drop(copied);
        self.undone.uploads.clear();
        self.undone.has_tables = false;
        self.tables_submitted(&moved, is_update);
        Ok(())
    }

    /// Forgets what was still to be done for a texture of a pool that was removed. An upload stays where
    /// another texture shares its slot.
    pub(super) fn forget_undone(&mut self, texture: TextureNumber, pool: PoolId, pager: &Pager) {
        if self.undone.uploads.iter().any(|(_, upload)| upload.page.texture() == texture) {
            let slots = pager.pool(pool).slots();
            let is_taken =
                |upload: &Upload| slots.get(upload.slot.index() as usize).is_some_and(Option::is_some);
            self.undone.uploads.retain(|(_, upload)| upload.page.texture() != texture || is_taken(upload));
        }
    }
}
