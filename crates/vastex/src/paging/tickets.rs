//! Tickets of prefetches and pins, as futures that need no runtime.
//!
//! What comes when, and for how long it stays, `vastex-core` decides.

use std::collections::HashMap;
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::task::{Context, Poll, Waker};

use vastex_core::{AskError, Feedback, Progress, Region, TextureNumber, TicketState, Urgency};

use super::Paging;

/// An explicit request: a prefetch or a pin. Awaited, it gives how it ended: for a pin, when all its pages
/// were here for the first time.
///
/// To be awaited by any executor, or polled by [`Ticket::progress`] without one. Only
/// [`Textures::update`](crate::Textures::update) drives it, so the thread that calls that must not block on
/// it: `block_on` on the thread that draws would never return. Let another thread wait while frames go on,
/// look at [`Ticket::progress`] in each frame, or call [`Textures::finish`](crate::Textures::finish), which
/// runs the update itself. Dropping a ticket changes nothing; [`Ahead::release`](crate::Ahead::release) ends
/// its request. If the [`Textures`](crate::Textures) are dropped it ends as released.
#[derive(Clone, Debug)]
#[must_use = "a pin lasts until its ticket is released"]
pub struct Ticket {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    inner: Mutex<Inner>,
    /// That of whom it was asked, since others have tickets of the same numbers.
    owner: Weak<()>,
}

#[derive(Debug)]
struct Inner {
    /// What it consists of, each with how far it is: one of a region, several of a view.
    parts: Vec<(vastex_core::Ticket, Progress)>,
    wakers: Vec<Waker>,
}

impl Inner {
    /// That of all parts together: open while one is, and then what is worst of them.
    fn progress(&self) -> Progress {
        let none = Progress { state: TicketState::Done, pages: 0, resident: 0, failed: 0 };
        self.parts.iter().fold(none, |all, (_, part)| Progress {
            state: worse(all.state, part.state),
            pages: all.pages + part.pages,
            resident: all.resident + part.resident,
            failed: all.failed + part.failed,
        })
    }

    fn is_open(&self) -> bool {
        self.parts.iter().any(|(_, part)| part.state == TicketState::Open)
    }
}

fn worse(a: TicketState, b: TicketState) -> TicketState {
    use TicketState::{Done, Late, Open, Released};
    *[Open, Released, Late].iter().find(|state| [a, b].contains(state)).unwrap_or(&Done)
}

impl Shared {
    /// What is locked is whole at any moment, so a panic elsewhere does it no harm.
    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How far a part is now. Who waits is woken when the last has ended.
    fn set(&self, id: vastex_core::Ticket, progress: Progress) {
        let wakers = {
            let mut inner = self.inner();
            let was_open = inner.is_open();
            let part = inner.parts.iter_mut().find(|(part, _)| *part == id);
            part.into_iter().for_each(|(_, before)| *before = progress);
            match was_open && !inner.is_open() {
                true => std::mem::take(&mut inner.wakers),
                false => Vec::new(),
            }
        };
        wakers.into_iter().for_each(Waker::wake);
    }
}

impl Ticket {
    /// How far the ticket's pages are, as of the last [`Textures::update`](crate::Textures::update).
    pub fn progress(&self) -> Progress {
        self.shared.inner().progress()
    }

    /// Returns true if pages are still missing and the ticket's deadline has not passed.
    pub fn is_open(&self) -> bool {
        self.shared.inner().is_open()
    }

    fn ids(&self) -> Vec<vastex_core::Ticket> {
        self.shared.inner().parts.iter().map(|(id, _)| *id).collect()
    }
}

impl Future for Ticket {
    type Output = Progress;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Progress> {
        let mut inner = self.shared.inner();
        if !inner.is_open() {
            return Poll::Ready(inner.progress());
        }
        if !inner.wakers.iter().any(|waker| waker.will_wake(context.waker())) {
            inner.wakers.push(context.waker().clone());
        }
        Poll::Pending
    }
}

/// The tickets that somebody may still look at, by their parts.
#[derive(Debug, Default)]
pub(crate) struct OpenTickets {
    open: HashMap<vastex_core::Ticket, Weak<Shared>>,
    owner: Arc<()>,
}

impl OpenTickets {
    fn open(&mut self, parts: Vec<(vastex_core::Ticket, Progress)>) -> Ticket {
        let ids: Vec<_> = parts.iter().map(|(id, _)| *id).collect();
        let inner = Mutex::new(Inner { parts, wakers: Vec::new() });
        let shared = Arc::new(Shared { inner, owner: Arc::downgrade(&self.owner) });
        self.open.extend(ids.into_iter().map(|id| (id, Arc::downgrade(&shared))));
        Ticket { shared }
    }

    /// Returns true if a ticket is one of these, open or not.
    fn own(&self, ticket: &Ticket) -> bool {
        std::ptr::eq(ticket.shared.owner.as_ptr(), Arc::as_ptr(&self.owner))
    }

    fn end(&mut self, id: vastex_core::Ticket, progress: Progress) {
        if let Some(shared) = self.open.remove(&id).and_then(|shared| shared.upgrade()) {
            shared.set(id, progress);
        }
    }
}

impl Drop for OpenTickets {
    /// Nobody waits forever for what is gone.
    fn drop(&mut self) {
        for (id, shared) in &self.open {
            let Some(shared) = shared.upgrade() else { continue };
            let part =
                shared.inner().parts.iter().find(|(part, _)| part == id).map(|(_, progress)| *progress);
            part.into_iter()
                .for_each(|part| shared.set(*id, Progress { state: TicketState::Released, ..part }));
        }
    }
}

impl Paging {
    pub(crate) fn prefetch(
        &mut self,
        texture: TextureNumber,
        region: &Region,
        urgency: Urgency,
    ) -> Result<Ticket, AskError> {
        let id = self.pager.prefetch(texture, region, urgency)?;
        Ok(self.open(&[id]))
    }

    /// What a view wants, of all textures.
    pub(crate) fn prefetch_view(
        &mut self,
        feedback: &Feedback,
        urgency: Urgency,
    ) -> Result<Ticket, AskError> {
        let parts = self.pager.prefetch_view(feedback, urgency)?;
        Ok(self.open(&parts))
    }

    pub(crate) fn pin(&mut self, texture: TextureNumber, region: &Region) -> Result<Ticket, AskError> {
        let id = self.pager.pin(texture, region)?;
        Ok(self.open(&[id]))
    }

    fn open(&mut self, parts: &[vastex_core::Ticket]) -> Ticket {
        // A ticket that was just opened has not ended.
        let none = Progress { state: TicketState::Open, pages: 0, resident: 0, failed: 0 };
        let open = |id| Progress { state: TicketState::Open, ..self.pager.progress(id).unwrap_or(none) };
        self.tickets.open(parts.iter().map(|&id| (id, open(id))).collect())
    }

    /// Returns true if there was anything to let go of.
    pub(crate) fn release(&mut self, ticket: &Ticket) -> bool {
        if !self.tickets.own(ticket) {
            return false;
        }
        let was_open = ticket.ids().into_iter().fold(false, |open, id| self.pager.release(id) | open);
        self.end_tickets();
        was_open
    }

    /// Tells the tickets how far they are.
    pub(super) fn follow_tickets(&mut self) {
        self.end_tickets();
        let pager = &self.pager;
        self.tickets.open.retain(|&id, shared| {
            let (Some(shared), Some(progress)) = (shared.upgrade(), pager.progress(id)) else {
                return false;
            };
            // That all is here is said once the pager has said so.
            shared.set(id, Progress { state: TicketState::Open, ..progress });
            true
        });
    }

    fn end_tickets(&mut self) {
        while let Some((id, progress)) = self.pager.poll_ended() {
            self.tickets.end(id, progress);
        }
    }
}
