//! The frame loop: what is wanted, what has arrived, what changes on the GPU. There is one, and everything that shows a
//! virtual texture calls it. How views say what they want is `views`' business.
//!
//! Nothing is decided here: the pager decides, the loader and the GPU carry out. What the GPU is to do in a frame is submitted here too, all
//! of it at once: what can fail comes first, and touches nothing that a picture reads; then tiles, page tables, fades, biases and
//! parameters change together.

use std::collections::BTreeSet;

use vastex_core::{Event, PageId, PoolId, TextureId, Upload};
use vastex_tiles::{LoadError, Loaded};

use crate::error::Error;
use crate::textures::Textures;

/// What the pager has decided and the GPU has not been told. Empty between two frames, but where one failed midway.
#[derive(Debug, Default)]
pub(crate) struct Undone {
    /// In the order in which they were decided.
    pub(crate) uploads: Vec<(PoolId, Upload)>,
    /// Textures whose page tables were being changed; where that was not submitted, each begins anew with what is resident.
    pub(crate) tables: BTreeSet<TextureId>,
}

impl Undone {
    pub(crate) fn is_empty(&self) -> bool {
        self.uploads.is_empty() && self.tables.is_empty()
    }
}

impl Textures {
    /// Takes in what has arrived, asks for what is missing, uploads, and changes the page tables. Never waits, unless the
    /// pace is lock-step.
    ///
    /// To be called once per frame. What it changes it submits by itself, so that everything that is submitted after it shows the
    /// new state, whenever it was recorded, and no command buffer of the application's has to be submitted for it: any may be dropped.
    /// [Bind groups](Textures::bind_group) may be others afterwards.
    ///
    /// Commands may be recorded ahead, by two frames: what was recorded after one update and is submitted after one or two more, but before
    /// the third, shows what is there then, and right. That holds where page tables have grown meanwhile or pools were resized, too. Of a
    /// texture that was removed such commands show whatever is in its slots by then, each time a texel of the pool; all that they show
    /// beside it is right.
    ///
    /// It fails where the device is lost ([`vastex_wgpu::GpuError::DeviceLost`]) or has no memory for a page table that grows; then pictures are
    /// as they were, and the next call does what this one could not. What was recorded before a call that failed is to be submitted before the
    /// next, or drawn anew.
    pub fn update(&mut self) -> Result<(), Error> {
        self.pager.begin_frame(self.frame);
        self.follow_tickets();
        self.observe()?;
        self.exchange_with_loader();
        self.take_uploads();
        self.carry_out()?;
        self.record_telemetry();
        self.frame += 1;
        Ok(())
    }

    /// The feedback that has arrived, or in lock-step that of the frame before the last; what all views wanted in a frame together.
    fn observe(&mut self) -> Result<(), Error> {
        for views in self.arrived_feedback()?.chunk_by(|a, b| a.frame == b.frame) {
            self.counters.degenerate = views.iter().map(|feedback| feedback.degenerate).sum();
            if let Some(recorder) = &mut self.recorder {
                recorder.note(views, &self.places, &self.pager, &self.textures);
            }
            self.pager.observe_views(views);
        }
        self.pager.feedback_under_way(self.oldest_feedback());
        Ok(())
    }

    /// Hands the loader's results to the pager, and the pager's decisions to the loader.
    fn exchange_with_loader(&mut self) {
        let pager = &mut self.pager;
        let mut arrived = |loaded: Loaded| match loaded.result {
            Ok(bytes) => pager.tile_ready(loaded.page, bytes),
            Err(LoadError::Cancelled) => pager.tile_cancelled(loaded.page),
            Err(error) => pager.tile_failed(loaded.page, error.to_string()),
        };
        match &mut self.lock_step {
            None => std::iter::from_fn(|| self.loader.poll()).for_each(&mut arrived),
            Some(lock_step) => {
                lock_step.due_loads(self.frame, &mut self.loader).into_iter().for_each(&mut arrived);
            }
        }
        self.send_cancels();
        while let Some(request) = self.pager.poll_rerank() {
            self.loader.rerank(request.page, request.rank);
        }
        while let Some(request) = self.pager.poll_request() {
            self.loader.request(request.page, request.rank);
            if let Some(lock_step) = &mut self.lock_step {
                lock_step.requested(request.page, self.frame);
            }
        }
    }

    /// Calls off the loads that are not worth finishing.
    pub(crate) fn send_cancels(&mut self) {
        while let Some(page) = self.pager.poll_cancel() {
            match &mut self.lock_step {
                None => self.loader.cancel(page),
                Some(lock_step) => lock_step.cancel(page),
            }
        }
    }

    /// Takes the pager's uploads of this frame.
    fn take_uploads(&mut self) {
        self.pass_fades();
        while let Some((pool, upload)) = self.pager.poll_upload() {
            self.note_fade(pool, upload.slot);
            self.note_for_cpu(pool, &upload);
            self.undone.uploads.push((pool, upload));
        }
    }

    /// Carries out the uploads that were taken and the page-table changes of exactly these, in one submission. Where it fails nothing that a
    /// picture reads has changed, and the next call carries out the same and what has come to it.
    pub(crate) fn carry_out(&mut self) -> Result<(), Error> {
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("vastex update") });
        let moved = self.change_tables(&mut encoder)?;
        self.renew_groups_of(&moved)?;
        let copied = self.copy_tiles(&mut encoder)?;
        self.send_fades();
        for (pool, pager) in self.pools.iter_mut().zip(self.pager.pools()) {
            pool.set_bias(&self.queue, pager.bias_eighths());
        }
        self.update_groups();
        self.queue.submit([encoder.finish()]);
        // From here on rooms on the belt may be given back.
        drop(copied);
        self.undone.uploads.clear();
        self.undone.tables.clear();
        self.bind_moved_tables(&moved);
        Ok(())
    }

    /// Carries out what the last update failed to do. To be called before bind groups are made, since page tables may lie elsewhere by then.
    pub(crate) fn catch_up(&mut self) -> Result<(), Error> {
        if self.undone.is_empty() { Ok(()) } else { self.carry_out() }
    }

    /// Forgets what was still to be done for a texture of a pool that was removed. An upload stays where another texture shares its slot.
    pub(crate) fn forget_undone(&mut self, texture: TextureId, pool: PoolId) {
        self.moving.forget(texture);
        self.undone.tables.remove(&texture);
        if self.undone.uploads.iter().any(|(_, upload)| upload.page.texture() == texture) {
            let slots = self.pager.pool(pool).slots();
            let is_taken =
                |upload: &Upload| slots.get(upload.slot.index() as usize).is_some_and(Option::is_some);
            self.undone.uploads.retain(|(_, upload)| upload.page.texture() != texture || is_taken(upload));
        }
    }

    /// The next thing that the application may want to know.
    pub fn poll_event(&mut self) -> Option<Event> {
        loop {
            self.converged.take_if(|_| !self.pager.is_converged());
            if self.converged.is_some() && self.is_seen_whole() {
                return self.converged.take();
            }
            match self.pager.poll_event()? {
                // Some pixels have not been looked at: their feedback was lost.
                event @ Event::Converged { .. } if !self.is_seen_whole() => self.converged = Some(event),
                event => return Some(event),
            }
        }
    }

    /// Whether nothing is missing in the views, and all of them has been seen.
    pub(crate) fn has_converged(&self) -> bool {
        self.pager.is_converged() && self.is_seen_whole()
    }

    /// The pages in view that could not be had so far.
    pub fn failed_pages(&self) -> Vec<PageId> {
        self.pager.failed_pages().collect()
    }
}
