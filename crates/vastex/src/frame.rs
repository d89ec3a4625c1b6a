//! The frame loop: what is wanted, what has arrived, what changes on the GPU. There is one, and everything that shows a
//! virtual texture calls it. How views say what they want is `views`' business.
//!
//! Nothing is decided here: the pager decides, the loader and the GPU carry out.

use vastex_core::{Event, PageId};
use vastex_tiles::{LoadError, Loaded};

use crate::error::Error;
use crate::textures::Textures;

impl Textures {
    /// Takes in what has arrived, asks for what is missing, uploads, and changes the page tables. Never waits, unless the
    /// pace is lock-step.
    ///
    /// To be called once per frame, before anything is drawn with [`Textures::bind_group`]: tiles are replaced when the
    /// encoder's commands begin.
    pub fn update(&mut self, encoder: &mut wgpu::CommandEncoder) -> Result<(), Error> {
        self.pagers.begin_frame(self.frame);
        self.follow_tickets();
        self.observe()?;
        self.exchange_with_loader();
        self.upload(encoder)?;
        self.record_telemetry();
        self.frame += 1;
        Ok(())
    }

    /// The feedback that has arrived, or in lock-step that of the frame before the last; what all views wanted in a frame together.
    fn observe(&mut self) -> Result<(), Error> {
        for views in self.arrived_feedback()?.chunk_by(|a, b| a.frame == b.frame) {
            self.counters.degenerate = views.iter().map(|feedback| feedback.degenerate).sum();
            if let Some(recorder) = &mut self.recorder {
                recorder.note(views, &self.places, &self.pagers, &self.textures);
            }
            self.pagers.observe_views(views);
        }
        self.pagers.feedback_under_way(self.oldest_feedback());
        Ok(())
    }

    /// Hands the loader's results to the pagers, and the pagers' decisions to the loader.
    fn exchange_with_loader(&mut self) {
        let pagers = &mut self.pagers;
        let mut arrived = |loaded: Loaded| match loaded.result {
            Ok(bytes) => pagers.tile_ready(loaded.page, bytes),
            Err(LoadError::Cancelled) => pagers.tile_cancelled(loaded.page),
            Err(error) => pagers.tile_failed(loaded.page, error.to_string()),
        };
        match &mut self.lock_step {
            None => std::iter::from_fn(|| self.loader.poll()).for_each(&mut arrived),
            Some(lock_step) => {
                lock_step.due_loads(self.frame, &mut self.loader).into_iter().for_each(&mut arrived);
            }
        }
        self.send_cancels();
        while let Some(request) = self.pagers.poll_rerank() {
            self.loader.rerank(request.page, request.rank);
        }
        while let Some(request) = self.pagers.poll_request() {
            self.loader.request(request.page, request.rank);
            if let Some(lock_step) = &mut self.lock_step {
                lock_step.requested(request.page, self.frame);
            }
        }
    }

    /// Calls off the loads that are not worth finishing.
    pub(crate) fn send_cancels(&mut self) {
        while let Some(page) = self.pagers.poll_cancel() {
            match &mut self.lock_step {
                None => self.loader.cancel(page),
                Some(lock_step) => lock_step.cancel(page),
            }
        }
    }

    /// Carries out the pagers' uploads, then the page-table changes of exactly these.
    fn upload(&mut self, encoder: &mut wgpu::CommandEncoder) -> Result<(), Error> {
        self.pass_fades();
        while let Some((pool, upload)) = self.pagers.poll_upload() {
            self.pools[usize::from(pool.number())].upload(&self.queue, upload.slot, &upload.bytes)?;
            self.note_fade(pool, upload.slot);
            self.note_for_cpu(pool, &upload);
        }
        for (pool, pager) in self.pools.iter_mut().zip(self.pagers.iter()) {
            pool.set_bias(&self.queue, pager.bias_eighths());
        }
        self.update_groups();
        self.change_tables(encoder)?;
        Ok(())
    }

    /// The next thing that the application may want to know.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.pagers.poll_event()
    }

    /// The pages in view that could not be had so far.
    pub fn failed_pages(&self) -> Vec<PageId> {
        self.pagers.failed_pages().collect()
    }
}
