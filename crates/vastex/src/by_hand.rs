//! What an application asks for by hand: prefetches and pins, as tickets that can be awaited, predictions, and content that changes.
//!
//! What comes when, and for how long it stays, `vastex-core` decides; here its tickets become futures that need no runtime.

use std::collections::HashMap;
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::task::{Context, Poll, Waker};

use vastex_core::{AskError, Feedback, Progress, Region, TextureId, TicketState, Urgency};

use crate::textures::Textures;

/// What was asked for by hand. Awaited, it says how it ended: for a pin, when all its pages were here for the first time.
///
/// To be awaited by any executor, or by none: [`Ticket::progress`] looks. It moves on in [`Textures::update`]. Dropping it changes
/// nothing; [`Textures::release`] lets go of what it stands for.
#[derive(Clone, Debug)]
#[must_use = "a pin lasts until its ticket is released"]
pub struct Ticket {
    id: vastex_core::Ticket,
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    inner: Mutex<Inner>,
}

#[derive(Debug)]
struct Inner {
    progress: Progress,
    wakers: Vec<Waker>,
}

impl Shared {
    /// What is locked is whole at any moment, so a panic elsewhere does it no harm.
    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Ticket {
    /// How far it is, as of the last [`Textures::update`].
    pub fn progress(&self) -> Progress {
        self.shared.inner().progress
    }
}

impl Future for Ticket {
    type Output = Progress;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Progress> {
        let mut inner = self.shared.inner();
        if inner.progress.state != TicketState::Open {
            return Poll::Ready(inner.progress);
        }
        if !inner.wakers.iter().any(|waker| waker.will_wake(context.waker())) {
            inner.wakers.push(context.waker().clone());
        }
        Poll::Pending
    }
}

/// The tickets that somebody may still look at.
#[derive(Debug, Default)]
pub(crate) struct OpenTickets(HashMap<vastex_core::Ticket, Weak<Shared>>);

impl OpenTickets {
    fn open(&mut self, id: vastex_core::Ticket, progress: Progress) -> Ticket {
        let shared = Arc::new(Shared { inner: Mutex::new(Inner { progress, wakers: Vec::new() }) });
        self.0.insert(id, Arc::downgrade(&shared));
        Ticket { id, shared }
    }

    fn end(&mut self, id: vastex_core::Ticket, progress: Progress) {
        if let Some(shared) = self.0.remove(&id).and_then(|shared| shared.upgrade()) {
            end(&shared, progress);
        }
    }
}

impl Drop for OpenTickets {
    /// Nobody waits forever for what is gone.
    fn drop(&mut self) {
        for shared in self.0.values().filter_map(Weak::upgrade) {
            let progress = shared.inner().progress;
            end(&shared, Progress { state: TicketState::Released, ..progress });
        }
    }
}

fn end(shared: &Shared, progress: Progress) {
    let wakers = {
        let mut inner = shared.inner();
        inner.progress = progress;
        std::mem::take(&mut inner.wakers)
    };
    wakers.into_iter().for_each(Waker::wake);
}

impl Textures {
    /// Loads a region of a texture after everything in view, and keeps it until all of it is here or until its deadline; see
    /// [`vastex_core::Pager::prefetch`]. A deadline is a number of frames, as [`Textures::frame`] counts them.
    ///
    /// ```no_run
    /// # use vastex::{Region, Urgency};
    /// # fn look_ahead(textures: &mut vastex::Textures, earth: vastex::TextureId) -> Result<(), vastex::AskError> {
    /// // Where the camera will be in two seconds, at 60 frames a second, on levels 2 to 4.
    /// let landing = Region::image(8000..12000, 4000..6000).on_levels(2..=4);
    /// let deadline = Some(textures.frame() + 120);
    /// let ticket = textures.prefetch(earth, &landing, Urgency { priority: 0, deadline })?;
    /// // ... frames later: ticket.progress(), or ticket.await
    /// # let _ = ticket;
    /// # Ok(()) }
    /// ```
    pub fn prefetch(
        &mut self,
        texture: TextureId,
        region: &Region,
        urgency: Urgency,
    ) -> Result<Ticket, AskError> {
        let id = self.pager.prefetch(texture, region, urgency)?;
        Ok(self.open(id))
    }

    /// Loads a region of a texture and keeps it, whatever the view wants, until its ticket is released; see
    /// [`vastex_core::Pager::pin`].
    pub fn pin(&mut self, texture: TextureId, region: &Region) -> Result<Ticket, AskError> {
        let id = self.pager.pin(texture, region)?;
        Ok(self.open(id))
    }

    fn open(&mut self, id: vastex_core::Ticket) -> Ticket {
        // A ticket that was just opened has not ended.
        let none = Progress { state: TicketState::Open, pages: 0, resident: 0, failed: 0 };
        let progress = Progress { state: TicketState::Open, ..self.pager.progress(id).unwrap_or(none) };
        self.tickets.open(id, progress)
    }

    /// Cancels a prefetch, or unpins. Says whether there was anything to let go of. What has been loaded stays until its slot is
    /// needed.
    pub fn release(&mut self, ticket: &Ticket) -> bool {
        let was_open = self.pager.release(ticket.id);
        self.end_tickets();
        was_open
    }

    /// Says what the view is expected to want when tiles that are asked for now will be here: the feedback of a camera that goes
    /// on as it does, for as many frames ahead as a tile takes. To be called once per frame, before [`Textures::update`];
    /// [`crate::CpuFeedback`] makes such a feedback without drawing anything. What is in view comes first, so a prediction
    /// costs nothing where bandwidth is short; see [`vastex_core::Pager::expect`].
    pub fn expect(&mut self, feedback: &Feedback) {
        self.pager.expect(feedback);
    }

    /// The content of a region has changed where it comes from: its resident tiles are read again and replaced where they
    /// are, the old ones staying on screen until then. What caches keep of it is dropped; see [`TileSource::changed`]. Says
    /// how many pages the pager knew of.
    ///
    /// [`TileSource::changed`]: crate::TileSource::changed
    pub fn invalidate(&mut self, texture: TextureId, region: &Region) -> u32 {
        if let Some(Some(state)) = self.textures.get(usize::from(texture.number())) {
            state.source.changed(region);
            self.cpu_tiles.forget(texture, &state.description.geometry, region);
        }
        self.pager.invalidate(texture, region)
    }

    /// Whether, for a whole jitter cycle, no page was newly wanted and none was missing, in any pool.
    pub fn is_converged(&self) -> bool {
        self.has_converged()
    }

    /// Frames so far: the number of the frame that the next [`Textures::update`] plays.
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// Tells the tickets how far they are.
    pub(crate) fn follow_tickets(&mut self) {
        self.end_tickets();
        let pager = &self.pager;
        self.tickets.0.retain(|&id, shared| {
            let (Some(shared), Some(progress)) = (shared.upgrade(), pager.progress(id)) else {
                return false;
            };
            // That all is here is said once the pager has said so.
            shared.inner().progress = Progress { state: TicketState::Open, ..progress };
            true
        });
    }

    fn end_tickets(&mut self) {
        while let Some((id, progress)) = self.pager.poll_ended() {
            self.tickets.end(id, progress);
        }
    }
}
