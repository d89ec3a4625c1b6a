//! The records of pages: one for each page that has a state other than `Absent`, or a resident descendant.
//!
//! Records lie side by side, so that a walk over all of them reads memory in order, and whoever remembers
//! where a record was finds it again without a look-up: a [`RecordHint`] is tried first and never trusted.
//! What the states mean, and who moves a page from one to the next, is `residency`'s business.

use crate::residency::page_map::PageMap;
use crate::residency::rank::RankClass;
use crate::table::pool::Slot;
use crate::texture::page::PageId;

/// How far the calling off of a load is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cancel {
    No,
    /// To be handed out as a decision.
    Due,
    /// Handed out; the loader has yet to let go.
    Sent,
}

/// The state of a page that has a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum State {
    /// Only descendants of it are resident.
    Absent,
    Queued,
    Loading(Cancel),
    Ready,
    Resident(Slot),
    Failed,
}

/// What is known of a page.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Record {
    pub(super) page: PageId,
    pub(super) state: State,
    /// The last round (see `Residency::begin_round`) whose working set contained the page.
    pub(super) wanted_round: u64,
    /// Loads that failed in a row, as far as they can be counted.
    pub(super) failures: u16,
    /// How the loader ranks its load, while there is one.
    pub(super) rank: RankClass,
    /// True if the page's tile is in flight, and was asked for when the page was in view, or was in view with
    /// the loader.
    pub(super) for_view: bool,
    /// True if the page was wanted when its tile came into its slot, or since then.
    pub(super) was_wanted: bool,
    /// Resident pages below it, at any depth.
    pub(super) below: u32,
    /// The frame from which on the page may be tried again after failures.
    pub(super) retry_at: u64,
    /// The frame since which the page is wanted without a break, if it is.
    pub(super) since: u64,
    /// The frame in which its load began.
    pub(super) asked_at: u64,
    /// The frame in which its tile was put into a slot.
    pub(super) settled_at: u64,
}

impl Record {
    /// The round in which a tail was wanted last: it always is.
    pub(super) const TAIL: u64 = u64::MAX;

    pub(super) fn is_tail(&self) -> bool {
        self.wanted_round == Record::TAIL
    }

    const fn new(page: PageId) -> Record {
        Record {
            page,
            state: State::Absent,
            wanted_round: 0,
            failures: 0,
            rank: RankClass::BEST,
            for_view: false,
            was_wanted: false,
            below: 0,
            retry_at: 0,
            since: 0,
            asked_at: 0,
            settled_at: 0,
        }
    }

    /// There is a use for the page: it is queued where nothing is under way, and nothing is called off that
    /// still can go on.
    pub(crate) fn use_for(&mut self, frame: u64) {
        match self.state {
            State::Absent => self.state = State::Queued,
            State::Loading(Cancel::Due) => self.state = State::Loading(Cancel::No),
            State::Failed if self.retry_at <= frame => self.state = State::Queued,
            _ => {}
        }
    }

    /// Rounds since the page was last wanted, if it is resident and out of view. Never for a tail.
    pub(crate) fn age_out_of_view(&self, round: u64) -> Option<u64> {
        let is_resident = matches!(self.state, State::Resident(_));
        round.checked_sub(self.wanted_round).filter(|&age| is_resident && age > 0)
    }
}

/// Where a record was the last time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RecordHint(u32);

impl Default for RecordHint {
    /// Nowhere yet.
    fn default() -> RecordHint {
        RecordHint(u32::MAX)
    }
}

/// Records that lie side by side in a part of them.
const PART_CHUNK: usize = 16;

#[cfg(test)]
std::thread_local! {
    /// Records that walks over all of them have visited, on this thread.
    pub(crate) static VISITED: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

/// A record for each page that has a state other than `Absent`, or a resident descendant.
#[derive(Clone, Debug, Default)]
pub(crate) struct Records {
    /// All records; those of no page are free.
    records: Vec<Record>,
    index: PageMap<u32>,
    free: Vec<u32>,
}

impl Records {
    /// Where the page's record is.
    pub(crate) fn find(&self, page: PageId, hint: RecordHint) -> Option<RecordHint> {
        match self.records.get(hint.0 as usize) {
            Some(record) if record.page == page && page != PageId::NONE => Some(hint),
            _ => self.index.get(page).map(|&at| RecordHint(at)),
        }
    }

    /// The record at a place that was just found.
    pub(crate) fn at(&self, found: RecordHint) -> &Record {
        &self.records[found.0 as usize]
    }

    pub(crate) fn get(&self, page: PageId) -> Option<&Record> {
        self.index.get(page).map(|&at| &self.records[at as usize])
    }

    /// The slot that the page's tile is in.
    pub(crate) fn slot_of(&self, page: PageId) -> Option<Slot> {
        match self.get(page)?.state {
            State::Resident(slot) => Some(slot),
            _ => None,
        }
    }

    pub(crate) fn get_mut(&mut self, page: PageId) -> Option<&mut Record> {
        self.index.get(page).map(|&at| &mut self.records[at as usize])
    }

    /// The page's record, made where there is none.
    pub(crate) fn get_or_add(&mut self, page: PageId, hint: RecordHint) -> &mut Record {
        let at = match self.find(page, hint) {
            Some(RecordHint(at)) => at,
            None => self.add(page),
        };
        &mut self.records[at as usize]
    }

    fn add(&mut self, page: PageId) -> u32 {
        let at = self.free.pop().unwrap_or(self.records.len() as u32);
        match self.records.get_mut(at as usize) {
            Some(place) => *place = Record::new(page),
            None => {
                self.records.push(Record::new(page));
                self.free.reserve(self.records.capacity()); // all may go at once; there is nothing in it now
            }
        }
        self.index.insert(page, at);
        at
    }

    /// Forgets all that is known of a page.
    pub(crate) fn remove(&mut self, page: PageId) {
        if let Some(at) = self.index.remove(page) {
            self.records[at as usize] = Record::new(PageId::NONE);
            self.free.push(at);
        }
    }

    /// Keeps only the pages for which `keep` returns true.
    pub(crate) fn retain(&mut self, mut keep: impl FnMut(&mut Record) -> bool) {
        for (at, record) in (0..).zip(&mut self.records) {
            if record.page != PageId::NONE && !keep(record) {
                self.index.remove(record.page);
                *record = Record::new(PageId::NONE);
                self.free.push(at);
            }
        }
    }

    /// Pages that have records.
    pub(crate) fn len(&self) -> usize {
        self.index.len()
    }

    /// One of `parts` parts of the records, which together are all.
    pub(crate) fn part(&self, part: usize, parts: usize) -> impl Iterator<Item = &Record> {
        let chunks = self.records.chunks(PART_CHUNK).skip(part).step_by(parts);
        chunks.flatten().filter(|record| record.page != PageId::NONE)
    }

    /// All records.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Record> {
        #[cfg(test)]
        VISITED.set(VISITED.get() + self.records.len());
        self.records.iter().filter(|record| record.page != PageId::NONE)
    }
}
