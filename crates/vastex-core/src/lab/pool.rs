//! The pool of a replay: what is resident, what the present frame wants, and what may be evicted.

use crate::lab::pages::Pages;

/// The pool of a replay: what is resident, what the present frame wants, and what may be evicted.
///
/// Tails are neither counted nor held.
#[derive(Debug)]
pub(crate) struct Pool<'a> {
    pages: &'a Pages,
    slots: usize,
    frame: usize,
    residents: Vec<u32>,
    /// Where each page stands among the residents.
    place: Vec<Option<u32>>,
    /// Resident descendants of each page.
    below: Vec<u32>,
    /// The last frame that wanted each page, one too large; 0 where none did.
    wanted: Vec<u64>,
}

impl<'a> Pool<'a> {
    pub(crate) fn new(pages: &'a Pages, slots: usize) -> Pool<'a> {
        Pool {
            pages,
            slots,
            frame: 0,
            residents: Vec::new(),
            place: vec![None; pages.len()],
            below: vec![0; pages.len()],
            wanted: vec![0; pages.len()],
        }
    }

    pub(crate) fn begin_frame(&mut self, frame: usize) {
        self.frame = frame;
        for &page in self.pages.set(frame) {
            self.wanted[page as usize] = frame as u64 + 1;
        }
    }

    pub(crate) fn pages(&self) -> &'a Pages {
        self.pages
    }

    /// Slots for pages that are no tails.
    pub(crate) fn slots(&self) -> usize {
        self.slots
    }

    pub(crate) fn frame(&self) -> u64 {
        self.frame as u64
    }

    /// Frames of the trace.
    pub(crate) fn frames(&self) -> usize {
        self.pages.sets().len()
    }

    /// The present frame's set, from coarse to fine.
    pub(crate) fn set(&self) -> &'a [u32] {
        self.pages.set(self.frame)
    }

    pub(crate) fn residents(&self) -> &[u32] {
        &self.residents
    }

    pub(crate) fn is_full(&self) -> bool {
        self.residents.len() >= self.slots
    }

    pub(crate) fn is_resident(&self, page: u32) -> bool {
        self.place[page as usize].is_some()
    }

    pub(crate) fn is_wanted(&self, page: u32) -> bool {
        self.wanted[page as usize] == self.frame as u64 + 1
    }

    /// Frames since the page was last wanted; 0 in the frame that wants it.
    pub(crate) fn age(&self, page: u32) -> u64 {
        self.frame as u64 + 1 - self.wanted[page as usize]
    }

    /// Returns true if the page is resident, not wanted, and without resident descendants.
    pub(crate) fn may_evict(&self, page: u32) -> bool {
        self.below[page as usize] == 0 && self.is_resident(page) && !self.is_wanted(page)
    }

    /// Returns true if it will be so when one descendant has gone.
    pub(crate) fn may_evict_after(&self, page: u32) -> bool {
        self.below[page as usize] == 1 && self.is_resident(page) && !self.is_wanted(page)
    }

    /// Puts a page into a free slot.
    pub(crate) fn admit(&mut self, page: u32) {
        self.place[page as usize] = Some(self.residents.len() as u32);
        self.residents.push(page);
        for ancestor in self.pages.ancestors(page) {
            self.below[ancestor as usize] += 1;
        }
    }

    pub(crate) fn evict(&mut self, page: u32) {
        let Some(place) = self.place[page as usize].take() else { return };
        self.residents.swap_remove(place as usize);
        if let Some(&moved) = self.residents.get(place as usize) {
            self.place[moved as usize] = Some(place);
        }
        for ancestor in self.pages.ancestors(page) {
            self.below[ancestor as usize] -= 1;
        }
    }
}
