//! What a ticket is, and when it ends: a prefetch of pages that an application will need, or a pin of pages
//! that must stay.
//!
//! | asked for | loaded | holds its pages | ends |
//! |---|---|---|---|
//! | prefetch | after everything in view, by priority, then by deadline | against pages out of view, until all are here, or until its deadline | `Done`, `Late` at its deadline, `Released` |
//! | pin | with what is in view, which it is counted as | against everything, at every mip bias | `Released` |
//!
//! With a page come its ancestors, so that a page which comes into view is not alone. A page that could not
//! be had counts as answered. In which order tickets are served is decided in `explicit_plan`, which pages
//! they hold in `claims`.

use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, VecDeque};

use crate::residency::{PageState, Residency};
use crate::table::pool::PoolId;
use crate::texture::page::{PageId, TextureNumber};

/// Tickets that have ended and are kept however long nobody asks for them, and the frames for which all
/// others are.
const KEPT: usize = 1024;
const KEPT_FRAMES: u64 = 60;

/// Stands for what was asked for: a prefetch or a pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ticket {
    pool: PoolId,
    number: u64,
}

impl Ticket {
    /// The pool whose slots the pages take.
    pub fn pool(self) -> PoolId {
        self.pool
    }
}

/// How much a prefetch matters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Urgency {
    /// The greater comes first.
    pub priority: i32,
    /// The frame by which the pages should be here, and until which they are kept; among equals the earliest
    /// deadline comes first. Without one, pages are kept until the last has come.
    pub deadline: Option<u64>,
}

/// Where a ticket stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TicketState {
    /// Pages are still missing.
    Open,
    /// All pages are resident, or could not be had.
    Done,
    /// The deadline has passed with pages missing.
    Late,
    /// The application released the ticket, or its texture is gone.
    Released,
}

/// How far a ticket is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// The ticket is open, or how it ended.
    pub state: TicketState,
    /// Pages that the ticket asks for, their ancestors included.
    pub pages: u32,
    /// Pages of the ticket that are in their slots.
    pub resident: u32,
    /// Pages of the ticket that could not be had so far.
    pub failed: u32,
}

/// Why something asked for explicitly is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AskError {
    /// There is no texture of this number.
    #[error("there is no texture {0}; it was removed, or is one of another device")]
    NoTexture(u16),
    /// More tiles than the pool could ever hold beside its tails; pages of the same content have one.
    #[error(
        "the region has {pages} pages, but the pool has {slots} slots for them; ask for a smaller region or for coarser \
         levels, or make the pool larger"
    )]
    TooManyPages {
        /// Pages of the region, without their ancestors.
        pages: u64,
        /// Slots that do not hold a tail.
        slots: u32,
    },
    /// The pins would take more than their share of the pool; pages of the same content take one slot.
    #[error(
        "with this region {pages} pages were pinned, tails included, but at most {most} of the pool's slots may be; unpin \
         others, pin coarser levels, or raise the share"
    )]
    TooManyPins {
        /// Pages pinned then.
        pages: u64,
        /// Slots that pins may take.
        most: u32,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ask {
    Prefetch(Urgency),
    Pin,
}

#[derive(Debug)]
struct Entry {
    ask: Ask,
    texture: TextureNumber,
    /// Each once, coarsest first.
    pages: Vec<PageId>,
    /// True if an event has said that all pages are here.
    is_done: bool,
}

/// The open tickets of a pool.
#[derive(Debug, Default)]
pub(crate) struct Tickets {
    pool: PoolId,
    next: u64,
    open: BTreeMap<u64, Entry>,
    /// Open pins of each page.
    pinned: FxHashMap<PageId, u32>,
    /// Tickets that have ended and that nobody has asked for yet, with the frame in which they did.
    ended: VecDeque<(u64, Ticket, Progress)>,
    frame: u64,
}

impl Tickets {
    pub(crate) fn new(pool: PoolId) -> Tickets {
        Tickets { pool, ..Tickets::default() }
    }

    /// Returns true if none is open.
    pub(crate) fn is_empty(&self) -> bool {
        self.open.is_empty()
    }

    /// Opens a ticket for pages of one texture, each once, coarsest first.
    pub(crate) fn open(&mut self, ask: Ask, texture: TextureNumber, pages: Vec<PageId>) -> Ticket {
        if ask == Ask::Pin {
            pages.iter().for_each(|&page| *self.pinned.entry(page).or_insert(0) += 1);
        }
        let number = self.next;
        self.next += 1;
        self.open.insert(number, Entry { ask, texture, pages, is_done: false });
        Ticket { pool: self.pool, number }
    }

    /// Lets go of a ticket. Says what it was, and its pages; `None` if it had ended.
    pub(crate) fn release(&mut self, ticket: Ticket, residency: &Residency) -> Option<(Ask, Vec<PageId>)> {
        let entry = self.open.get(&ticket.number)?;
        let (ask, mut progress) = (entry.ask, progress_of(entry, residency));
        if !entry.is_done {
            if progress.state == TicketState::Open {
                progress.state = TicketState::Released;
            }
            self.ended.push_back((self.frame, ticket, progress));
        }
        Some((ask, self.close(ticket.number)))
    }

    fn close(&mut self, number: u64) -> Vec<PageId> {
        let Some(Entry { ask, pages, .. }) = self.open.remove(&number) else { return Vec::new() };
        for page in pages.iter().filter(|_| ask == Ask::Pin) {
            if let Some(count) = self.pinned.get_mut(page) {
                *count -= 1;
                if *count == 0 {
                    self.pinned.remove(page);
                }
            }
        }
        pages
    }

    /// Lets go of all tickets of a texture, which is about to go.
    pub(crate) fn forget(&mut self, texture: TextureNumber, residency: &Residency) {
        let own = self.open.iter().filter(|(_, entry)| entry.texture == texture);
        let numbers: Vec<u64> = own.map(|(&number, _)| number).collect();
        for number in numbers {
            self.release(Ticket { pool: self.pool, number }, residency);
        }
    }

    /// Ends what is done or late, and adds the pages that no open ticket holds any more to `released`.
    ///
    /// Costs a visit of each page of the open tickets.
    pub(crate) fn begin_frame(&mut self, frame: u64, residency: &Residency, released: &mut Vec<PageId>) {
        self.frame = frame;
        self.drop_what_nobody_asks_for();
        let mut over = Vec::new();
        for (&number, entry) in &mut self.open {
            let mut progress = progress_of(entry, residency);
            let deadline = match entry.ask {
                Ask::Prefetch(urgency) => urgency.deadline,
                Ask::Pin => Some(u64::MAX),
            };
            let is_late = deadline.is_some_and(|deadline| deadline < frame);
            let is_done = progress.state == TicketState::Done;
            if !entry.is_done && (is_done || is_late) {
                entry.is_done = is_done;
                progress.state = if is_done { TicketState::Done } else { TicketState::Late };
                self.ended.push_back((frame, Ticket { pool: self.pool, number }, progress));
            }
            if is_late || (entry.is_done && deadline.is_none()) {
                over.push(number);
            }
        }
        over.into_iter().for_each(|number| released.extend(self.close(number)));
    }

    /// Of tickets that have ended over a second ago, keeps so many: an application that never asks has memory
    /// for its open ones.
    fn drop_what_nobody_asks_for(&mut self) {
        while self.ended.len() > KEPT
            && self.ended.front().is_some_and(|(ended, ..)| ended + KEPT_FRAMES < self.frame)
        {
            self.ended.pop_front();
        }
    }

    /// How far a ticket is that has not ended.
    pub(crate) fn progress(&self, ticket: Ticket, residency: &Residency) -> Option<Progress> {
        self.open.get(&ticket.number).map(|entry| progress_of(entry, residency))
    }

    /// A ticket that has ended, or a pin whose pages are all here, and how; each is said once.
    pub(crate) fn poll_ended(&mut self) -> Option<(Ticket, Progress)> {
        self.ended.pop_front().map(|(_, ticket, progress)| (ticket, progress))
    }

    /// The pages that are pinned, each once.
    pub(crate) fn pinned(&self) -> impl Iterator<Item = PageId> + '_ {
        self.pinned.keys().copied()
    }

    /// The pages of a pin that is open; none of anything else.
    #[cfg(feature = "sim")]
    pub(crate) fn pages_of_pin(&self, ticket: Ticket) -> Vec<PageId> {
        let entry = self.open.get(&ticket.number).filter(|entry| entry.ask == Ask::Pin);
        entry.map_or_else(Vec::new, |entry| entry.pages.clone())
    }

    /// Returns true if the page is pinned.
    pub(crate) fn pins(&self, page: PageId) -> bool {
        self.pinned.contains_key(&page)
    }

    /// The pages of the open prefetches, as often as they hold each.
    #[cfg(feature = "checks")]
    pub(crate) fn prefetched(&self) -> impl Iterator<Item = PageId> + '_ {
        self.open.values().filter(|entry| entry.ask != Ask::Pin).flat_map(|entry| entry.pages.iter().copied())
    }

    /// The pages of the prefetches in the order in which they should be loaded. A page may come several
    /// times.
    pub(crate) fn pages_in_order(&self) -> impl Iterator<Item = PageId> + '_ {
        let mut entries: Vec<_> = self
            .open
            .iter()
            .filter_map(|(number, entry)| match entry.ask {
                Ask::Prefetch(Urgency { priority, deadline }) => {
                    Some(((-i64::from(priority), deadline.unwrap_or(u64::MAX), *number), &entry.pages))
                }
                Ask::Pin => None,
            })
            .collect();
        entries.sort_unstable_by_key(|(key, _)| *key);
        entries.into_iter().flat_map(|(_, pages)| pages.iter().copied())
    }
}

fn progress_of(entry: &Entry, residency: &Residency) -> Progress {
    let (mut resident, mut failed) = (0, 0);
    for &page in &entry.pages {
        match residency.state(page) {
            PageState::Resident(_) => resident += 1,
            _ if residency.has_failed(page) => failed += 1,
            _ => {}
        }
    }
    let pages = entry.pages.len() as u32;
    let state = if resident + failed == pages { TicketState::Done } else { TicketState::Open };
    Progress { state, pages, resident, failed }
}
