//! Which resident page gives up its slot: the one that [`crate::policy::retention`] thinks back last, of those that may go.
//!
//! Candidates are listed when the first victim of a working set is needed: that costs a visit of every slot, a victim a
//! step of a heap. A page that loses its last resident descendant joins them.

use std::collections::BinaryHeap;

use crate::page::PageId;
use crate::policy::retention::{Candidate, Retention};
use crate::residency::{Residency, State};
use crate::textures::Textures;

/// What is known of pages out of view, and the candidates of a round.
#[derive(Debug, Default)]
pub(crate) struct Victims {
    pub(crate) retention: Retention,
    candidates: BinaryHeap<Candidate<PageId>>,
    /// The round that they were listed in.
    round: u64,
    /// Pages out of view with their ages, kept for its memory.
    out_of_view: Vec<(PageId, u64)>,
}

impl Victims {
    /// What was listed may be gone.
    pub(crate) fn clear(&mut self) {
        self.candidates.clear();
    }
}

impl Residency {
    /// The next page to give up its slot; nothing where none may.
    pub(crate) fn next_victim(&mut self, textures: &Textures) -> Option<PageId> {
        if self.victims.round != self.round {
            self.list_victims(textures);
        }
        for listed_anew in [false, true] {
            while let Some(candidate) = self.victims.candidates.pop() {
                if self.age_if_evictable(candidate.page).is_some() {
                    return Some(candidate.page);
                }
            }
            // What has come into a slot since may be a victim too.
            if !listed_anew {
                self.list_victims(textures);
            }
        }
        None
    }

    /// A resident descendant of the page has gone, perhaps the last.
    pub(crate) fn note_descendant_gone(&mut self, page: PageId, textures: &Textures) {
        if self.victims.round == self.round
            && let Some(age) = self.age_if_evictable(page)
        {
            let lateness = self.victims.retention.lateness(page, age, textures);
            self.victims.candidates.push(Candidate { lateness, level: page.level(), page });
        }
    }

    /// Rounds since the page was last wanted, if it is resident, out of view and without resident descendants.
    fn age_if_evictable(&self, page: PageId) -> Option<u64> {
        self.age_out_of_view(page).filter(|_| !self.below.contains_key(&page))
    }

    fn age_out_of_view(&self, page: PageId) -> Option<u64> {
        let record = self.records.get(&page)?;
        let is_resident = matches!(record.state, State::Resident(_));
        self.round.checked_sub(record.wanted_round).filter(|&age| is_resident && age > 0)
    }

    fn list_victims(&mut self, textures: &Textures) {
        debug_assert!(textures.count() == self.stats.pinned);
        let mut victims = std::mem::take(&mut self.victims);
        let pages = self.slots.iter().flatten();
        victims.out_of_view.clear();
        victims.out_of_view.extend(pages.filter_map(|&page| Some((page, self.age_out_of_view(page)?))));
        let ages = victims.out_of_view.iter().map(|&(_, age)| age);
        victims.retention.size_reserve(ages, victims.out_of_view.len());
        let mut candidates = victims.candidates.into_vec();
        candidates.clear();
        let leaves = victims.out_of_view.iter().filter(|(page, _)| !self.below.contains_key(page));
        candidates.extend(leaves.map(|&(page, age)| {
            let lateness = victims.retention.lateness(page, age, textures);
            Candidate { lateness, level: page.level(), page }
        }));
        victims.candidates = BinaryHeap::from(candidates);
        victims.round = self.round;
        self.victims = victims;
    }
}
