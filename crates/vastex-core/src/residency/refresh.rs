//! Refreshing: the content of resident pages changes, and their tiles are loaded again into the same slots.
//!
//! Until the new tile is here the old one stays on screen, so there is no hole, no other slot and no
//! page-table change. A page that is resident keeps that state; what is under way for it stands here:
//!
//! | from | to | when |
//! |---|---|---|
//! | - | `Queued` | its content has changed |
//! | `Queued` | `Loading` | the loader takes it |
//! | `Loading` | `Ready` | its bytes are here |
//! | `Loading` | `Queued` | the load was called off, or the content has changed again meanwhile |
//! | `Loading` | `Failed` | the source could not give it; the old tile stays, and it is tried again with back-off |
//! | `Failed` | `Queued` | its time has come |
//! | `Ready` | - | the upload budget allows it |
//! | `Queued`, `Failed` | - | the page is evicted |
//!
//! A page that shares its slot with others stays in it as well, but gets one of its own with its new tile
//! (`slots`).
//!
//! While a tile is in flight the page keeps its slot. A page whose first load is under way when its content
//! changes is loaded once more when that answers.

use bytes::Bytes;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::residency::Residency;
use crate::residency::failures::back_off;
use crate::residency::rank::RankClass;
use crate::residency::records::{RecordHint, State};
use crate::table::pool::Slot;
use crate::texture::page::{PageId, TextureNumber};

#[derive(Debug)]
struct Refresh {
    step: Step,
    /// Loads that failed in a row.
    failures: u32,
}

#[derive(Debug)]
enum Step {
    Queued,
    /// `again` where what comes is out of date already.
    Loading {
        again: bool,
    },
    Ready(Bytes),
    Failed {
        until: u64,
    },
}

impl Refresh {
    fn is_in_flight(&self) -> bool {
        matches!(self.step, Step::Loading { .. } | Step::Ready(_))
    }
}

/// New content of resident pages, which is loaded into the same slots.
#[derive(Debug, Default)]
pub(crate) struct Refreshes {
    pages: FxHashMap<PageId, Refresh>,
    /// How many refreshes are `Ready`.
    ready: u32,
    /// Pages whose first load is under way and will bring what is out of date.
    stale: FxHashSet<PageId>,
}

impl Refreshes {
    pub(crate) fn is_empty(&self) -> bool {
        self.pages.is_empty()
    }

    /// Returns true if a tile is with the loader, or waits for the upload budget.
    pub(crate) fn is_in_flight(&self, page: PageId) -> bool {
        self.pages.get(&page).is_some_and(Refresh::is_in_flight)
    }

    /// The page has lost its slot without being evicted: a load of it goes on as a first load. Returns true
    /// if there is one.
    pub(crate) fn becomes_first_load(&mut self, page: PageId) -> bool {
        let Some(Refresh { step: Step::Loading { again }, .. }) = self.remove(page) else {
            return false;
        };
        if again {
            self.stale.insert(page);
        }
        true
    }

    pub(crate) fn is_loading(&self, page: PageId) -> bool {
        self.pages.get(&page).is_some_and(|refresh| matches!(refresh.step, Step::Loading { .. }))
    }

    pub(crate) fn is_queued(&self, page: PageId) -> bool {
        self.pages.get(&page).is_some_and(|refresh| matches!(refresh.step, Step::Queued))
    }

    pub(crate) fn is_ready(&self, page: PageId) -> bool {
        self.pages.get(&page).is_some_and(|refresh| matches!(refresh.step, Step::Ready(_)))
    }

    /// Returns true if any tile waits for the upload budget.
    pub(crate) fn any_ready(&self) -> bool {
        self.ready > 0
    }

    fn remove(&mut self, page: PageId) -> Option<Refresh> {
        let refresh = self.pages.remove(&page)?;
        self.ready -= u32::from(matches!(refresh.step, Step::Ready(_)));
        Some(refresh)
    }

    /// Returns true if the tiles that wait for the upload budget are counted right.
    #[cfg(feature = "checks")]
    pub(crate) fn ready_are_counted(&self) -> bool {
        let ready = self.pages.values().filter(|refresh| matches!(refresh.step, Step::Ready(_)));
        ready.count() as u32 == self.ready
    }

    /// Tiles with the loader or waiting for the upload budget.
    #[cfg(feature = "checks")]
    pub(crate) fn in_flight(&self) -> usize {
        self.pages.values().filter(|refresh| refresh.is_in_flight()).count()
    }

    /// The pages that are being refreshed.
    pub(crate) fn pages(&self) -> impl Iterator<Item = PageId> + '_ {
        self.pages.keys().copied()
    }

    /// The page has lost its slot.
    pub(crate) fn evicted(&mut self, page: PageId) {
        self.remove(page);
    }

    /// Returns true if what a load has brought for a page that is not resident is out of date. Asked once.
    pub(crate) fn take_stale(&mut self, page: PageId) -> bool {
        self.stale.remove(&page)
    }

    /// Forgets everything of a texture; gives the pages that the loader has, and how many tiles waited for
    /// the upload budget.
    pub(crate) fn forget(&mut self, texture: TextureNumber) -> (Vec<PageId>, u32) {
        let (mut loading, mut ready) = (Vec::new(), 0);
        self.stale.retain(|page| page.texture() != texture);
        self.pages.retain(|page, refresh| {
            let goes = page.texture() == texture;
            match refresh.step {
                Step::Loading { .. } if goes => loading.push(*page),
                Step::Ready(_) if goes => ready += 1,
                _ => {}
            }
            !goes
        });
        self.ready -= ready;
        (loading, ready)
    }
}

impl Residency {
    /// The content of the page has changed. Returns true if anything is known of the page.
    pub(crate) fn invalidate(&mut self, page: PageId) -> bool {
        let frame = self.frame;
        let Some(record) = self.records.get_mut(page) else { return false };
        match record.state {
            State::Absent => return false,
            State::Queued => {}
            State::Loading(_) => drop(self.refreshes.stale.insert(page)),
            State::Failed => record.retry_at = frame,
            State::Ready => {
                record.state = State::Queued;
                self.discard_ready(page);
            }
            State::Resident(_) => self.invalidate_tile(page),
        }
        true
    }

    fn invalidate_tile(&mut self, page: PageId) {
        let fresh = Refresh { step: Step::Queued, failures: 0 };
        match &mut self.refreshes.pages.entry(page).or_insert(fresh).step {
            Step::Queued => {}
            Step::Loading { again } => *again = true,
            step @ Step::Failed { .. } => *step = Step::Queued,
            step @ Step::Ready(_) => {
                *step = Step::Queued;
                self.refreshes.ready -= 1;
                self.waste_one(page);
            }
        }
    }

    /// `Failed -> Queued` for the refreshes whose time has come.
    pub(crate) fn retry_refreshes(&mut self) {
        for Refresh { step, .. } in self.refreshes.pages.values_mut() {
            if matches!(step, Step::Failed { until } if *until <= self.frame) {
                *step = Step::Queued;
            }
        }
    }

    /// `Queued -> Loading`, asked for with this rank.
    pub(crate) fn begin_refresh(&mut self, page: PageId, rank: u64) -> bool {
        let is_queued = self.refreshes.is_queued(page);
        if let Some(refresh) = self.refreshes.pages.get_mut(&page).filter(|_| is_queued) {
            refresh.step = Step::Loading { again: false };
            self.records.get_or_add(page, RecordHint::default()).rank = RankClass::of(rank);
            self.enter_flight(page.texture());
        }
        is_queued
    }

    fn loading_refresh(&mut self, page: PageId) -> Option<&mut Refresh> {
        self.refreshes.pages.get_mut(&page).filter(|refresh| matches!(refresh.step, Step::Loading { .. }))
    }

    /// `Loading -> Ready`, or `Queued` where the content has changed since. Returns true if a refresh was
    /// loading.
    pub(crate) fn refresh_loaded(&mut self, page: PageId, bytes: &Bytes) -> bool {
        let Some(refresh) = self.loading_refresh(page) else { return false };
        if matches!(refresh.step, Step::Loading { again: true }) {
            refresh.step = Step::Queued;
            self.waste_one(page);
        } else {
            refresh.step = Step::Ready(bytes.clone());
            self.refreshes.ready += 1;
        }
        true
    }

    /// `Loading -> Failed`. Returns true if this is the first failure in a row, or `None` if no refresh was
    /// loading.
    pub(crate) fn refresh_failed(&mut self, page: PageId) -> Option<bool> {
        let frame = self.frame;
        let refresh = self.loading_refresh(page)?;
        refresh.step = Step::Failed { until: frame + back_off(refresh.failures) };
        refresh.failures += 1;
        let first = refresh.failures == 1;
        self.stats.failures += 1;
        self.leave_flight(page);
        Some(first)
    }

    /// `Loading -> Queued`: the loader has let go. Returns true if a refresh was loading.
    pub(crate) fn refresh_cancelled(&mut self, page: PageId) -> bool {
        let Some(refresh) = self.loading_refresh(page) else { return false };
        refresh.step = Step::Queued;
        self.stats.cancelled += 1;
        self.leave_flight(page);
        true
    }

    /// Ends a refresh whose tile waited for the upload budget: the slot, and what goes into it.
    pub(crate) fn settle_refresh(&mut self, page: PageId) -> Option<(Slot, Bytes)> {
        let slot = self.slot_of(page).filter(|_| self.refreshes.is_ready(page))?;
        let Refresh { step: Step::Ready(bytes), failures } = self.refreshes.remove(page)? else {
            return None;
        };
        self.take_over(slot);
        self.leave_flight(page);
        self.stats.refreshed += 1;
        self.stats.uploaded_bytes += self.tile_bytes;
        if failures > 0 {
            self.moves.recovered.push(page);
        }
        Some((slot, bytes))
    }
}
