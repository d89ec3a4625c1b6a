//! Who claims pages against what is out of view, and until when: prefetches and pins (tickets), and
//! predictions. How often each page is claimed the residency counts (`residency/claimed`).

#[cfg(feature = "checks")]
use rustc_hash::FxHashMap;

use crate::pager::prediction::Prediction;
use crate::pager::tickets::{Ask, AskError, Progress, Ticket, Tickets};
use crate::residency::Residency;
use crate::table::pool::PoolId;
use crate::texture::page::{PageId, TextureNumber};

/// Percent of the slots that pins may take where nothing else is said.
pub(super) const PIN_SHARE: u32 = 50;
/// Percent of the slots that pins may take at most, so that there is always room for a view.
pub(super) const MOST_PINS: u32 = 80;

/// What holds pages against what is out of view: prefetches, pins and predictions.
#[derive(Debug)]
pub(crate) struct Claims {
    tickets: Tickets,
    prediction: Prediction,
    /// The share of the slots that pins may take, tails included, in percent.
    pin_share: u32,
    /// Other pages are pinned than the working set knows of.
    pins_changed: bool,
}

impl Claims {
    pub(crate) fn new(pool: PoolId) -> Claims {
        Claims {
            tickets: Tickets::new(pool),
            prediction: Prediction::default(),
            pin_share: PIN_SHARE,
            pins_changed: false,
        }
    }

    /// Returns true if no ticket is open and nothing is expected.
    pub(crate) fn are_none(&self) -> bool {
        self.tickets.is_empty() && self.prediction.is_empty()
    }

    /// Opens a ticket for pages of one texture, each once, coarsest first.
    pub(crate) fn open(
        &mut self,
        ask: Ask,
        texture: TextureNumber,
        pages: Vec<PageId>,
        residency: &mut Residency,
    ) -> Ticket {
        match ask {
            Ask::Pin => self.pins_changed = true,
            Ask::Prefetch(_) => pages.iter().for_each(|&page| residency.claim(page)),
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
        match ask {
            Ask::Pin => self.pins_changed = true,
            Ask::Prefetch(_) => pages.iter().for_each(|&page| residency.unclaim(page)),
        }
        Some((ask, pages))
    }

    /// Lets go of everything of a texture, which is about to go, also out of the working set and the
    /// residency.
    pub(crate) fn forget(&mut self, texture: TextureNumber, residency: &Residency) {
        self.tickets.forget(texture, residency);
        self.prediction.forget(texture);
    }

    pub(super) fn set_pin_share(&mut self, percent: u32) {
        self.pin_share = percent;
    }

    /// Fails where pins, tails included, would take more than their share of the slots with these pages as
    /// well.
    pub(super) fn may_pin(&self, pages: &[PageId], residency: &Residency) -> Result<(), AskError> {
        let share = u64::from(self.pin_share.min(MOST_PINS));
        let most = (u64::from(residency.slot_count()) * share / 100) as u32;
        let more = pages.iter().filter(|&&page| !self.pins(page)).count();
        let pages = (self.pinned().count() + more) as u64 + u64::from(residency.tails());
        if pages > u64::from(most) { Err(AskError::TooManyPins { pages, most }) } else { Ok(()) }
    }

    /// Returns true if other pages are pinned than at the last call.
    pub(super) fn take_pins_changed(&mut self) -> bool {
        std::mem::take(&mut self.pins_changed)
    }

    /// Once per frame: ends tickets and predictions whose time has come, and adds the pages that they held to
    /// `released`.
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

    /// The pages that are held against what is out of view, in the order in which they should be loaded. A
    /// page may come several times.
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
