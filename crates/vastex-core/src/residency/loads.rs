//! Loads: from a page's request to its tile in a slot, or to its failure, or to its being called off. The
//! states are those of the table at the head of `residency`.

use bytes::Bytes;

use crate::residency::failures::back_off;
use crate::residency::rank::RankClass;
use crate::residency::records::{Cancel, RecordHint, State};
use crate::residency::{RELOAD_FRAMES, Residency};
use crate::table::pool::Slot;
use crate::texture::page::PageId;
use crate::texture::textures::Textures;

impl Residency {
    /// `Queued -> Loading`, asked for with this rank.
    pub(crate) fn begin_load(&mut self, page: PageId, rank: u64) -> bool {
        let Some(record) = self.records.get_mut(page).filter(|r| r.state == State::Queued) else {
            return false;
        };
        record.state = State::Loading(Cancel::No);
        (record.asked_at, record.rank) = (self.frame, RankClass::of(rank));
        if let Some(content) = self.sharing.content_of(page) {
            content.representative = page;
        }
        self.enter_flight(page.texture());
        if RankClass::of(rank).is_for_view() {
            self.fly_for_view(page);
        }
        true
    }

    /// Hands out a cancellation that is due.
    pub(super) fn send_cancel(&mut self, page: PageId) -> bool {
        let Some(record) = self.records.get_mut(page) else { return false };
        let due = record.state == State::Loading(Cancel::Due);
        if due {
            record.state = State::Loading(Cancel::Sent);
        }
        due
    }

    /// `Loading -> Ready`, or `Absent` where the page is no longer wanted. Returns true if it is `Ready`.
    pub(crate) fn loaded(&mut self, page: PageId, bytes: Bytes) -> bool {
        let wanted = self.has_use_for(page, RecordHint::default());
        let is_stale = self.refreshes.take_stale(page);
        let Some(record) = self.records.get_mut(page) else { return false };
        if !matches!(record.state, State::Loading(_)) {
            return self.refresh_loaded(page, &bytes);
        }
        if wanted && !is_stale {
            record.state = State::Ready;
            self.ready.insert(page, bytes);
            self.flight.note_answer(page.texture(), self.frame);
            return true;
        }
        record.state = State::Queued;
        self.waste_one(page);
        if !wanted {
            self.drop_page(page);
        }
        false
    }

    /// `Loading -> Failed`. Returns true if this is the first failure in a row.
    pub(crate) fn load_failed(&mut self, page: PageId) -> bool {
        let frame = self.frame;
        self.refreshes.take_stale(page);
        let Some(record) = self.records.get_mut(page) else { return false };
        if !matches!(record.state, State::Loading(_)) {
            return self.refresh_failed(page).unwrap_or(false);
        }
        let wait = back_off(u32::from(record.failures));
        record.failures = record.failures.saturating_add(1);
        record.retry_at = frame + wait;
        record.state = State::Failed;
        let (failures, retry_at) = (record.failures, record.retry_at);
        let first = failures == 1;
        self.failing.note(page, failures, frame, retry_at);
        self.stats.failures += 1;
        self.leave_flight(page);
        first
    }

    /// The loader has let go of a load: `Loading -> Absent`, or `Queued` where the page is wanted again.
    pub(crate) fn load_cancelled(&mut self, page: PageId) {
        let wanted = self.has_use_for(page, RecordHint::default());
        self.refreshes.take_stale(page);
        let Some(record) = self.records.get_mut(page) else { return };
        if !matches!(record.state, State::Loading(_)) {
            self.refresh_cancelled(page);
            return;
        }
        record.state = State::Queued;
        self.stats.cancelled += 1;
        self.leave_flight(page);
        if !wanted {
            self.drop_page(page);
        }
    }

    /// Returns true if the loader has the page, not called off, with a rank that this one should replace.
    pub(crate) fn needs_rerank(&self, page: PageId, rank: u64) -> bool {
        let Some(record) = self.records.get(page) else { return false };
        let is_loading = match record.state {
            State::Loading(cancel) => cancel == Cancel::No,
            State::Resident(_) => self.refreshes.is_loading(page),
            _ => false,
        };
        is_loading && record.rank.gives_way_to(RankClass::of(rank))
    }

    /// The loader has the page with this rank from now on.
    pub(crate) fn rerank(&mut self, page: PageId, rank: u64) {
        if let Some(record) = self.records.get_mut(page) {
            record.rank = RankClass::of(rank);
        }
        if RankClass::of(rank).is_for_view() {
            self.fly_for_view(page);
        }
    }

    /// Returns true if the page's tile is for what is in view: the page itself, or another of its content
    /// that it is loaded for.
    pub(crate) fn is_for_view(&self, page: PageId) -> bool {
        let content =
            self.sharing.get(self.sharing.of(page)).filter(|content| content.representative == page);
        self.is_wanted(page, RecordHint::default())
            || content.is_some_and(|content| content.wanted_round >= self.round)
    }

    /// The tile of a page that waited for a slot is out of date.
    pub(crate) fn discard_ready(&mut self, page: PageId) {
        self.ready.remove(page);
        self.waste_one(page);
    }

    /// `Ready -> Resident`, into a slot of [`Residency::take_slot`]; gives the tile's bytes.
    pub(crate) fn settle(&mut self, page: PageId, slot: Slot, textures: &Textures) -> Option<Bytes> {
        let bytes = self.ready.remove(page)?;
        let content = self.sharing.of(page);
        let was_evicted = match self.sharing.get_mut(content) {
            Some(content) => {
                content.representative = PageId::NONE;
                content.evicted_at.take().is_some_and(|at| at + RELOAD_FRAMES >= self.frame)
            }
            None => self.evicted_at.remove(page).is_some(),
        };
        self.put_in(slot, content);
        let asked_at = self.records.get_mut(page).map_or(self.frame, |record| record.asked_at);
        self.arrivals.note(self.frame - asked_at);
        self.become_resident(page, slot, textures);
        self.moves.settled.push(page);
        self.leave_flight(page);
        self.stats.loaded += 1;
        self.stats.uploaded_bytes += self.tile_bytes;
        self.stats.reloaded += u64::from(was_evicted);
        Some(bytes)
    }

    /// The page's tile is in a slot now.
    pub(super) fn become_resident(&mut self, page: PageId, slot: Slot, textures: &Textures) {
        let record = self.records.get_or_add(page, RecordHint::default());
        record.state = State::Resident(slot);
        record.settled_at = self.frame;
        if std::mem::take(&mut record.failures) > 0 {
            self.moves.recovered.push(page);
        }
        if record.wanted_round >= self.round {
            let waited = self.frame - record.since;
            self.waits.note(waited);
            self.stats.waited_frames += waited;
        } else {
            // What a prefetch has brought is as good as what was in view a moment ago.
            (record.wanted_round, record.was_wanted) = (self.round - 1, false);
        }
        for ancestor in textures.ancestors(page) {
            self.records.get_or_add(ancestor, RecordHint::default()).below += 1;
        }
    }
}
