//! Chooses which page gives up its slot: of those that may go, the one with the longest predicted time to
//! reuse ([`residency::retention`](crate::residency::retention)). `slots` evicts it.
//!
//! Candidates are listed when the first victim of a working set is needed: in a small pool that costs a visit
//! of every record; in a large one of every fourth, the others having been visited for the working sets
//! before. A victim costs a step of a heap. A page that loses its last resident descendant joins them.

use std::collections::BinaryHeap;

use crate::residency::Residency;
use crate::residency::claimed::Claimed;
use crate::residency::records::Record;
use crate::residency::retention::{Candidate, Retention};
use crate::texture::page::PageId;
use crate::texture::textures::Textures;

/// The parts of the records that take turns in being looked at.
const PARTS: usize = 4;
/// With fewer records all are looked at.
const FEW_RECORDS: usize = 4096;

/// What is known of pages out of view, and the candidates of a round.
#[derive(Debug, Default)]
pub(crate) struct Victims {
    pub(super) retention: Retention,
    /// Of each part of the records.
    candidates: [BinaryHeap<Candidate<PageId>>; PARTS],
    /// The round in which each part was listed.
    listed: [u64; PARTS],
    /// The round that the candidates are for.
    round: u64,
    /// Pages out of view, kept for its memory.
    out_of_view: Vec<OutOfView>,
}

/// A resident page out of view.
#[derive(Clone, Copy, Debug)]
struct OutOfView {
    page: PageId,
    /// Rounds since it was last wanted.
    age: u64,
    has_descendants: bool,
    /// The page's tile came while the views rest.
    is_of_rest: bool,
}

impl Victims {
    /// What was listed may be gone.
    pub(crate) fn clear(&mut self) {
        self.candidates.iter_mut().for_each(BinaryHeap::clear);
    }

    /// The best candidate of all parts.
    fn pop(&mut self) -> Option<PageId> {
        let best = self.candidates.iter_mut().max_by(|a, b| a.peek().cmp(&b.peek()));
        best.and_then(BinaryHeap::pop).map(|candidate| candidate.page())
    }
}

impl Residency {
    /// The next page to give up its slot; `None` if none may.
    pub(crate) fn next_victim(&mut self, textures: &Textures) -> Option<PageId> {
        if self.victims.round != self.round {
            self.list_due_victims(textures);
        }
        for listed_anew in [false, true] {
            while let Some(page) = self.victims.pop() {
                if self.records.get(page).and_then(|record| self.age_if_evictable(record)).is_some() {
                    return Some(page);
                }
            }
            // What has come into a slot since, or has left the view, may be a victim too.
            if !listed_anew {
                self.list_all_victims(textures);
            }
        }
        None
    }

    /// The page of the record has no resident descendant any more.
    pub(crate) fn note_last_descendant_gone(&mut self, record: &Record, textures: &Textures) {
        if self.victims.round == self.round
            && let Some(age) = self.age_if_evictable(record)
        {
            let is_of_rest = self.rest.has_brought(record);
            let out = OutOfView { page: record.page, age, has_descendants: false, is_of_rest };
            let candidate = candidate(&self.claimed, &self.victims.retention, out, textures);
            self.victims.candidates[0].push(candidate);
        }
    }

    /// Rounds since the page was last wanted, if it is resident, out of view and without resident
    /// descendants, no new tile is under way for its slot, and it is not kept while the views rest.
    pub(crate) fn age_if_evictable(&self, record: &Record) -> Option<u64> {
        let age = record.age_out_of_view(self.round);
        age.filter(|_| record.below == 0 && !self.is_busy(record) && !self.rest.keeps(record))
    }

    /// Returns true if a tile has come into the page's slot in this frame, or a new one is under way for it.
    pub(crate) fn is_busy(&self, record: &Record) -> bool {
        // A frame's evictions act before its loads, so that a page is not loaded and evicted in one.
        record.settled_at == self.frame || self.refreshes.is_in_flight(record.page)
    }

    /// Lists the part whose turn it is, and those that have missed theirs.
    fn list_due_victims(&mut self, textures: &Textures) {
        let (parts, round) = (self.parts(), self.round);
        for part in 0..parts as usize {
            let listed = self.victims.listed[part];
            if round % parts == part as u64 || listed == 0 || listed + parts <= round {
                self.list_victims(part, textures);
            }
        }
        self.victims.round = round;
    }

    fn list_all_victims(&mut self, textures: &Textures) {
        (0..self.parts() as usize).for_each(|part| self.list_victims(part, textures));
    }

    fn parts(&self) -> u64 {
        if self.records.len() < FEW_RECORDS { 1 } else { PARTS as u64 }
    }

    fn list_victims(&mut self, part: usize, textures: &Textures) {
        debug_assert!(textures.count() == self.stats.tails);
        let parts = self.parts() as usize;
        let Residency { records, slots, claimed, victims, rest, round, .. } = self;
        victims.out_of_view.clear();
        // At once, for parts are of about one size: growing with them would allocate in a frame now and then.
        victims.out_of_view.reserve(2 * slots.len() / parts + 1);
        victims.out_of_view.extend(records.part(part, parts).filter_map(|record| {
            let age = record.age_out_of_view(*round)?;
            let (has_descendants, is_of_rest) = (record.below > 0, rest.has_brought(record));
            Some(OutOfView { page: record.page, age, has_descendants, is_of_rest })
        }));
        // Records lie in no order, so that the ages in a part are as those of all.
        let ages = victims.out_of_view.iter().map(|out| out.age);
        victims.retention.size_reserve(ages, victims.out_of_view.len());
        let mut candidates = std::mem::take(&mut victims.candidates[part]).into_vec();
        candidates.clear();
        let leaves = victims.out_of_view.iter().filter(|out| !out.has_descendants);
        candidates.extend(leaves.map(|&out| candidate(claimed, &victims.retention, out, textures)));
        victims.candidates[part] = BinaryHeap::from(candidates);
        victims.listed[part] = *round;
    }
}

/// A page out of view, with its age, as one that may give up its slot. A claimed page has the least time to
/// reuse, so it goes after all others; it does go where the view would be left without a slot. Before those
/// goes what has come while the views rest.
fn candidate(
    claimed: &Claimed,
    retention: &Retention,
    OutOfView { page, age, is_of_rest, .. }: OutOfView,
    textures: &Textures,
) -> Candidate<PageId> {
    let reuse_distance = match is_of_rest {
        _ if claimed.has(page) => -2.0,
        true => -1.0,
        false => retention.reuse_distance(page, age, textures),
    };
    Candidate::new(reuse_distance, page.level(), page)
}
