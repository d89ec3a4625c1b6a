//! What has happened to a page, as far as it is remembered.

use crate::residency::Residency;
use crate::residency::records::State;
use crate::texture::page::PageId;

/// What has happened to a page, each in its frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PageHistory {
    /// Since then it is in the working set without a break.
    pub(crate) wanted_since: Option<u64>,
    /// When the page's load was asked for.
    pub(crate) asked_at: Option<u64>,
    /// When the page's tile came into its slot.
    pub(crate) settled_at: Option<u64>,
    /// Loads of it that failed in a row.
    pub(crate) failures: u32,
}

impl Residency {
    /// What has happened to a page, as far as it is known.
    pub(crate) fn history(&self, page: PageId) -> PageHistory {
        let Some(record) = self.records.get(page) else { return PageHistory::default() };
        let is_here = matches!(record.state, State::Resident(_));
        let was_asked = is_here || matches!(record.state, State::Loading(_) | State::Ready);
        PageHistory {
            wanted_since: (record.wanted_round >= self.round).then_some(record.since),
            // A page that came into a slot with others was never asked for.
            asked_at: (was_asked && record.asked_at > 0).then_some(record.asked_at),
            settled_at: is_here.then_some(record.settled_at),
            failures: u32::from(record.failures),
        }
    }

    /// The frame in which the page's tile lost its slot, where that is remembered.
    pub(crate) fn evicted_at(&self, page: PageId) -> Option<u64> {
        let of_content = || self.sharing.get(self.sharing.of(page)).and_then(|content| content.evicted_at);
        self.evicted_at.get(page).copied().or_else(of_content)
    }
}
