//! What the tiles of a crowd hold: a number for each page, that of the change which its content saw last.

use std::collections::BTreeMap;

use bytes::Bytes;

use crate::page::PageId;

/// What sources would give, what is under way, and what slots hold.
#[derive(Debug, Default)]
pub(crate) struct Contents {
    now: BTreeMap<PageId, u64>,
    under_way: BTreeMap<PageId, u64>,
    shown: BTreeMap<PageId, u64>,
}

impl Contents {
    fn now(&self, page: PageId) -> u64 {
        self.now.get(&page).copied().unwrap_or(0)
    }

    pub(crate) fn change(&mut self, page: PageId) {
        *self.now.entry(page).or_insert(0) += 1;
    }

    /// A load reads when it begins: the most out of date that a tile can be.
    pub(crate) fn read(&mut self, page: PageId) {
        self.under_way.insert(page, self.now(page));
    }

    pub(crate) fn tile(&mut self, page: PageId) -> Bytes {
        Bytes::copy_from_slice(&self.under_way.remove(&page).unwrap_or(0).to_le_bytes())
    }

    pub(crate) fn show(&mut self, page: PageId, tile: &[u8], evicted: Option<PageId>) {
        evicted.map(|page| self.shown.remove(&page));
        let content = tile.try_into().map_or(u64::MAX, u64::from_le_bytes);
        self.shown.insert(page, content);
    }

    pub(crate) fn show_as_it_is(&mut self, page: PageId) {
        self.shown.insert(page, self.now(page));
    }

    /// Every slot is empty.
    pub(crate) fn lose(&mut self) {
        self.shown.clear();
    }

    /// Whether the page is shown as it is now. A tail that was never replaced is as it was in the beginning.
    pub(crate) fn is_shown_as_it_is(&self, page: PageId) -> bool {
        self.shown.get(&page).copied().unwrap_or(0) == self.now(page)
    }

    pub(crate) fn forget(&mut self, is_gone: impl Fn(PageId) -> bool) {
        self.now.retain(|&page, _| !is_gone(page));
        self.shown.retain(|&page, _| !is_gone(page));
    }
}
