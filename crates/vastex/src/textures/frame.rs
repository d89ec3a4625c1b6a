//! The frame loop: what is wanted, what has arrived, what changes on the GPU. There is one, and everything
//! that shows a virtual texture calls it. How views say what they want is `feedback`'s business.
//!
//! Nothing is decided here: the pager decides, the loader and the GPU carry out. What the GPU is to do in a
//! frame is submitted by [`Gpu::carry_out`](crate::gpu::Gpu::carry_out), all of it at once.

use std::time::Duration;
#[cfg(not(target_family = "wasm"))]
use std::time::Instant;

use vastex_core::{Event, PoolId};
#[cfg(not(target_family = "wasm"))]
use vastex_core::{Progress, TicketState};
use vastex_tiles::TileSource;

use super::Textures;
use crate::error::Error;
#[cfg(not(target_family = "wasm"))]
use crate::paging::Ticket;

impl Textures {
    /// Takes in feedback and tiles that have arrived, requests missing pages, uploads tiles, and changes the
    /// page tables. Never waits, unless the pace is lock-step.
    ///
    /// To be called once per frame. It submits its own commands: everything submitted afterwards shows the
    /// new state, whenever it was recorded, and the application's command buffers may be dropped. [Bind
    /// groups](Textures::bind_group) may have been replaced afterwards.
    ///
    /// Commands may be recorded two frames ahead: commands that were recorded after one update and are
    /// submitted after one or two more, but before the third, show what is resident then, correctly even if
    /// page tables have grown or pools were resized meanwhile. For a texture that was removed they show
    /// [`Settings::unknown_color`](crate::Settings::unknown_color), and everything else correctly.
    ///
    /// Fails if the device is lost ([`GpuError::DeviceLost`](crate::GpuError::DeviceLost)) or has no memory
    /// for a growing page table; then pictures stay as they were, and the next call, in the next frame or at
    /// once, does what this one could not. Commands recorded before a failed call must be submitted before
    /// the next call, or recorded anew.
    pub fn update(&mut self) -> Result<(), Error> {
        self.paging.begin_frame();
        let played = self.play();
        self.record_telemetry();
        self.paging.end_frame();
        let cycle = self.paging.pager().feedback_cycle();
        let Textures { gpu, paging, .. } = self;
        gpu.look_for_gaps(cycle, |view| paging.looks_for_gaps(view).then(|| paging.gaps_by_turns(view)));
        self.follow_views();
        played
    }

    /// What a frame does that may fail. The frame is over either way, so that the next has feedback of its
    /// own.
    fn play(&mut self) -> Result<(), Error> {
        self.observe()?;
        self.paging.exchange_with_loader();
        self.take_uploads();
        self.carry_out_in(true)
    }

    /// Tells who waits for a view.
    fn follow_views(&mut self) {
        let (gpu, frame, cycle) = (&self.gpu, self.paging.frame(), self.paging.pager().feedback_cycle());
        self.paging.follow_views(|view| gpu.is_view_seen_whole(view, frame, cycle));
    }

    /// The feedback that has arrived, or in lock-step that of the frame before the last; what all views
    /// wanted in a frame together.
    fn observe(&mut self) -> Result<(), Error> {
        let cycle = self.paging.pager().feedback_cycle();
        let mut arrived = self.gpu.arrived_feedback(self.paging.frame(), cycle)?;
        self.paging.take_reported(&mut arrived);
        for views in arrived.chunk_by(|a, b| a.frame == b.frame) {
            let textures = self.paging.textures().map(|(texture, state)| (texture, &state.description));
            self.watch.note_feedback(views, self.paging.pager(), textures);
            self.paging.observe(views);
        }
        self.paging.feedback_under_way(self.gpu.oldest_feedback());
        Ok(())
    }

    /// Takes the pager's uploads of this frame.
    fn take_uploads(&mut self) {
        self.gpu.pass_fades();
        while let Some((pool, upload)) = self.paging.poll_upload() {
            self.cpu.uploaded(pool, &upload, &self.paging);
            self.gpu.take_upload(pool, upload);
        }
    }

    /// Carries out the uploads that were taken and the page-table changes of exactly these. Where it fails
    /// nothing that a picture reads has changed, and the next call carries out the same and what has come to
    /// it.
    pub(super) fn carry_out(&mut self) -> Result<(), Error> {
        self.carry_out_in(false)
    }

    fn carry_out_in(&mut self, is_update: bool) -> Result<(), Error> {
        let mut changes = self.gpu.changes_to_fill();
        self.paging.take_table_changes(&mut changes);
        self.gpu.carry_out(self.paging.pager(), changes, is_update)
    }

    /// Carries out what the last update failed to do. To be called before bind groups are made, since page
    /// tables may lie elsewhere by then.
    pub(super) fn catch_up(&mut self) -> Result<(), Error> {
        if self.gpu.is_done() { Ok(()) } else { self.carry_out() }
    }

    /// Adds the frame that has just been played.
    fn record_telemetry(&mut self) {
        let pager = self.paging.pager();
        let sources = self.paging.textures().filter_map(|(texture, state)| {
            let source: &dyn TileSource = &*state.source;
            Some((pager.pool_of(texture)?, source)) as Option<(PoolId, _)>
        });
        self.watch.record_telemetry(self.paging.frame(), pager, sources);
    }

    /// The next thing that the application may want to know.
    pub fn poll_event(&mut self) -> Option<Event> {
        for pool in self.gpu.take_rebound() {
            self.paging.report(Event::BindGroupsChanged { pool });
        }
        let is_seen_whole = self.is_seen_whole();
        self.paging.poll_event(is_seen_whole)
    }

    /// Returns true if every view that is drawn has been looked at at every sample position, one of rays that
    /// rests at every pixel, and all that follows is on the GPU.
    pub(super) fn is_seen_whole(&self) -> bool {
        self.gpu.is_seen_whole(self.paging.frame(), self.paging.pager().feedback_cycle())
    }

    /// Says how much time passes from one frame to the next, for tiles that fade in
    /// ([`Settings::fade`](crate::Settings::fade)): the application's delta time. It holds from the next
    /// [`Textures::update`] on until it is set again, and is 1/60 of a second at first. No clock is read, so
    /// that the same frames give the same pictures.
    pub fn set_frame_time(&mut self, time: Duration) {
        self.gpu.set_frame_time(time);
    }

    /// Waits for a ticket: calls [`Textures::update`] until it ends or so much time has passed, and returns
    /// how far it is then. For loading screens and tools. Nothing is drawn meanwhile, so views go on wanting
    /// the same pages; frames are counted ([`Inspect::frame`](crate::Inspect::frame)), so a deadline of the
    /// ticket may pass. Events can be polled afterwards. Not in a browser, where nothing may be waited for.
    ///
    /// Fails as an update does; the ticket is still open then.
    #[cfg(not(target_family = "wasm"))]
    pub fn finish(&mut self, ticket: &Ticket, at_most: Duration) -> Result<Progress, Error> {
        /// As often as a fast display has frames, so that the budget of uploads is one of bytes in time.
        const FRAME: Duration = Duration::from_millis(4);
        let begin = Instant::now();
        loop {
            self.update()?;
            let progress = ticket.progress();
            let left = at_most.saturating_sub(begin.elapsed());
            if progress.state != TicketState::Open || left.is_zero() {
                return Ok(progress);
            }
            std::thread::sleep(left.min(FRAME));
        }
    }
}
