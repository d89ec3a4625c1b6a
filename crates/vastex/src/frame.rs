//! The frame loop: what is wanted, what has arrived, what changes on the GPU. There is one, and everything that shows a
//! virtual texture calls it.
//!
//! Nothing is decided here: the pager decides, the loader and the GPU carry out.

use vastex_core::{Event, Feedback, FeedbackCompactor, PageId, ViewId};
use vastex_tiles::{LoadError, Loaded};
use vastex_wgpu::{FeedbackScale, FeedbackTarget, RawFeedback, Readback};

use crate::error::Error;
use crate::textures::{BindGroups, FeedbackPath, TextureState, Textures};

impl Textures {
    /// Draws the feedback pass of this frame, for a picture of so many pixels: `draw` draws the scene with a pipeline whose
    /// vertex shader ends in `vastex_feedback_clip(clip)` and whose fragment shader returns `vastex_feedback(uv)`, into
    /// [`Textures::FEEDBACK_FORMAT`] and [`Textures::FEEDBACK_DEPTH_FORMAT`] (cleared to 1).
    ///
    /// To be called before [`Textures::update`], once per frame; a frame without it keeps what was wanted.
    pub fn feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<(), Error> {
        if self.feedback.as_ref().is_none_or(|path| path.target.picture() != picture) {
            self.replace_feedback_path(picture)?;
        }
        let Some(path) = &mut self.feedback else { return Ok(()) };
        draw(&mut path.target.begin(&self.queue, encoder, &self.view, self.frame, 1.0), &self.groups);
        let recorded = path.readback.record(encoder, self.frame);
        if let Some(lock_step) = self.lock_step.as_mut().filter(|_| recorded) {
            lock_step.feedback_recorded(self.frame);
        }
        Ok(())
    }

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

    /// The feedback that has arrived, or in lock-step that of the frame before the last.
    fn observe(&mut self) -> Result<(), Error> {
        while let Some(feedback) = self.next_feedback()? {
            self.counters.degenerate = feedback.degenerate;
            if let Some(recorder) = &mut self.recorder {
                recorder.note(&feedback, &self.pagers, &self.textures);
            }
            self.pagers.observe(&feedback);
        }
        let under_way = self.feedback.as_ref().and_then(|path| path.readback.oldest());
        self.pagers.feedback_under_way(under_way);
        Ok(())
    }

    fn next_feedback(&mut self) -> Result<Option<Feedback>, Error> {
        let Some(path) = &mut self.feedback else { return Ok(None) };
        let Some(lock_step) = &mut self.lock_step else { return Ok(path.readback.poll(&self.device)?) };
        match lock_step.due_feedback(self.frame) {
            Some(frame) => Ok(Some(path.readback.wait(&self.device, &self.queue, frame)?)),
            None => Ok(None),
        }
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
        while let Some((pool, upload)) = self.pagers.poll_upload() {
            let pool = &self.pools[usize::from(pool.number())];
            pool.upload(&self.queue, upload.slot, &upload.bytes)?;
        }
        for (pool, pager) in self.pools.iter_mut().zip(self.pagers.iter()) {
            pool.set_bias(&self.queue, pager.bias_eighths());
        }
        self.pagers.take_table_changes(&mut self.changes);
        // A stable order: what is decided of one texture stays in sequence.
        self.changes.sort_by_key(|change| change.page.texture());
        for changes in self.changes.chunk_by(|a, b| a.page.texture() == b.page.texture()) {
            let number = usize::from(changes[0].page.texture().number());
            let Some(TextureState { table, .. }) = &mut self.textures[number] else { continue };
            self.counters.table_bytes_sent +=
                self.changer.apply(&self.device, &self.queue, encoder, table, changes)?;
        }
        Ok(())
    }

    fn replace_feedback_path(&mut self, picture: [u32; 2]) -> Result<(), Error> {
        let target = FeedbackTarget::new(&self.device, picture, FeedbackScale::Reduced)?;
        let readback = Readback::new(&self.device, &target)?;
        self.forget_feedback_path();
        self.feedback = Some(FeedbackPath { target, readback });
        Ok(())
    }

    /// Gives up the feedback that is under way.
    pub(crate) fn forget_feedback_path(&mut self) {
        if let Some(lock_step) = &mut self.lock_step {
            lock_step.forget_feedback();
        }
        if let Some(old) = self.feedback.take() {
            self.counters.feedback_bytes_read += old.readback.bytes_read();
        }
    }

    /// What every pixel of a picture wants, without acting on it: for statistics. Draws as [`Textures::feedback`] does,
    /// at full resolution, and waits for the answer.
    pub fn feedback_of_every_pixel(
        &mut self,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<Feedback, Error> {
        let target = FeedbackTarget::new(&self.device, picture, FeedbackScale::Full)?;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        draw(&mut target.begin(&self.queue, &mut encoder, &self.view, self.frame, 1.0), &self.groups);
        self.queue.submit([encoder.finish()]);
        let raw = RawFeedback::read(&self.device, &self.queue, &target)?;
        let mut feedback = Feedback::default();
        FeedbackCompactor::new().compact(self.frame, &raw.pixels, &mut feedback);
        Ok(feedback)
    }

    /// The view has jumped: what was wanted before says nothing of what is wanted from this frame on.
    pub fn view_cut(&mut self) {
        self.pagers.view_cut(ViewId::MAIN, self.frame);
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
