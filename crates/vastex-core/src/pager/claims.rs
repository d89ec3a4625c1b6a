//! What holds pages against what is out of view: prefetches and pins, and predictions. Every page held is known to the residency.

#[cfg(feature = "checks")]
use rustc_hash::FxHashMap;

use crate::pager::prediction::Prediction;
use crate::pager::tickets::{Ask, Progress, Ticket, Tickets};
use crate::residency::Residency;
use crate::table::pool::PoolId;
use crate::texture::page::{PageId, TextureId};

/// See the head of the file.
#[derive(Debug)]
pub(crate) struct Claims {
    tickets: Tickets,
    prediction: Prediction,
}

impl Claims {
    pub(crate) fn new(pool: PoolId) -> Claims {
        Claims { tickets: Tickets::new(pool), prediction: Prediction::default() }
    }

    /// Returns true if no ticket is open and nothing is expected.
    pub(crate) fn are_none(&self) -> bool {
        self.tickets.is_empty() && self.prediction.is_empty()
    }

    /// Opens a ticket for pages of one texture, each once, coarsest first.
    pub(crate) fn open(
        &mut self,
        ask: Ask,
        texture: TextureId,
        pages: Vec<PageId>,
        residency: &mut Residency,
    ) -> Ticket {
        if ask != Ask::Pin {
            pages.iter().for_each(|&page| residency.claim(page));
        }
        self.tickets.open(ask, texture, pages)
    }

    /// Lets go of a ticket. Gives what it was, and its pages; `None` if it had ended.
    pub(crate) fn release(
        &mut self,
        ticket: Ticket,
        residency: &mut Residency,
    ) -> Option<(Ask, Vec<PageId>)> {
        let (ask, pages) = self.tickets.release(ticket, residency)?;
        if ask != Ask::Pin {
            pages.iter().for_each(|&page| residency.unclaim(page));
        }
        Some((ask, pages))
    }

    /// Lets go of everything of a texture, which is about to go.
    pub(crate) fn forget(&mut self, texture: TextureId, residency: &mut Residency) {
        for ticket in self.tickets.of_texture(texture) {
            self.release(ticket, residency);
        }
        self.prediction.forget(texture);
    }

    /// Once per frame: ends tickets and predictions whose time has come, and adds the pages that they held to `released`.
    ///
    /// Costs a visit of each page of the open tickets, and of each that is expected.
    pub(crate) fn begin_frame(&mut self, frame: u64, residency: &mut Residency, released: &mut Vec<PageId>) {
        self.prediction.begin_frame(frame, released);
        self.tickets.begin_frame(frame, residency, released);
        released.iter().for_each(|&page| residency.unclaim(page));
    }

    /// The page is expected to be wanted, over so many pixels.
    pub(crate) fn expect(&mut self, page: PageId, pixels: u32, residency: &mut Residency) {
        if self.prediction.name(page, residency.frame(), pixels) {
            residency.claim(page);
        }
    }

    /// The pages that are held against what is out of view, in the order in which they should be loaded. A page may come several times.
    pub(crate) fn pages_in_order(&mut self) -> impl Iterator<Item = PageId> + '_ {
        let expected = self.prediction.pages_in_order().iter().map(|&(page, _)| page);
        expected.chain(self.tickets.pages_in_order())
    }

    /// How far a ticket is; `None` if it has ended.
    pub(crate) fn progress(&self, ticket: Ticket, residency: &Residency) -> Option<Progress> {
        self.tickets.progress(ticket, residency)
    }

    /// A ticket that has ended, or a pin whose pages are all here, and how; each comes once.
    pub(crate) fn poll_ended(&mut self) -> Option<(Ticket, Progress)> {
        self.tickets.poll_ended()
    }

    /// The pages that are pinned, each once.
    pub(crate) fn pinned(&self) -> impl Iterator<Item = PageId> + '_ {
        self.tickets.pinned()
    }

    /// Returns true if the page is pinned.
    pub(crate) fn pins(&self, page: PageId) -> bool {
        self.tickets.pins(page)
    }

    /// The pages of a pin that is open; none of anything else.
    #[cfg(feature = "sim")]
    pub(crate) fn pages_of_pin(&self, ticket: Ticket) -> Vec<PageId> {
        self.tickets.pages_of_pin(ticket)
    }

    /// How often each page is held against what is out of view, found anew.
    #[cfg(feature = "checks")]
    pub(crate) fn count(&self) -> FxHashMap<PageId, u32> {
        let mut counts = FxHashMap::default();
        for page in self.tickets.prefetched().chain(self.prediction.pages()) {
            *counts.entry(page).or_insert(0) += 1;
        }
        counts
    }
}
