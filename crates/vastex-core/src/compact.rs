//! Compaction of a feedback target on the CPU: from its raw pixels to distinct pages, in ascending order.
//!
//! For devices without compute shaders, and the measure of those that have them: both give the same [`Feedback`]. How
//! the pixels come to the CPU is the GPU crate's business.

use crate::feedback::{Feedback, WantedPage};
use crate::page::PageId;
use crate::shared::{FEEDBACK_DEGENERATE, FEEDBACK_WANTED, STEPS_PER_LEVEL};

/// Slots of the table at first; it doubles whenever it is half full.
const FIRST_SLOTS: usize = 1024;
/// Pixels that are compared with their neighbours at once.
const BLOCK: usize = 64;
/// Before the first page of a target, and after its last.
const NOWHERE: u32 = u32::MAX;

/// A pixel of a feedback target: page id low, page id high, eighth, flag.
type Pixel = [u32; 4];

/// Compacts feedback targets, one after the other, in memory that it keeps.
///
/// Neighbouring pixels mostly want the same page, so only the first of a run is looked at; where the runs of a row are
/// those of the row above, each run's page is the one that followed its predecessor's page the last time, so that a look-up is
/// rare: it goes to a table of open addressing whose memory follows the number of distinct pages, not that of the pixels.
///
/// ```
/// use vastex_core::{Feedback, FeedbackCompactor, PageId};
/// let (mut compactor, mut feedback) = (FeedbackCompactor::new(), Feedback::default());
/// // Page id low, page id high, eighth, flag (1: wanted).
/// compactor.compact(7, &[[5, 0, 3, 1], [5, 0, 1, 1], [0, 0, 0, 0], [4, 0, 2, 1]], &mut feedback);
/// let pages: Vec<_> = feedback.pages.iter().map(|w| (w.page.to_bits(), w.pixels, w.eighth)).collect();
/// assert_eq!((feedback.frame, pages), (7, vec![(4, 1, 2), (5, 2, 1)]));
/// ```
#[derive(Clone, Debug)]
pub struct FeedbackCompactor {
    /// A place in `pages` counted from 1, or 0; a power of two of them.
    table: Vec<u32>,
    /// What is in the table, in the order in which it came.
    pages: Vec<WantedPage>,
    /// For each of them, the place of the page that was wanted after it the last time.
    next: Vec<u32>,
    /// The place of the page that was wanted last.
    last: u32,
    degenerate: u32,
}

impl Default for FeedbackCompactor {
    fn default() -> FeedbackCompactor {
        FeedbackCompactor::new()
    }
}

impl FeedbackCompactor {
    /// One that has seen nothing.
    pub fn new() -> FeedbackCompactor {
        FeedbackCompactor {
            table: vec![0; FIRST_SLOTS],
            pages: Vec::new(),
            next: Vec::new(),
            last: NOWHERE,
            degenerate: 0,
        }
    }

    /// Puts what the pixels want into `feedback`, as that of `frame`. A pixel is page id low, page id high, eighth (at most
    /// 7) and flag, as `vastex_feedback` wrote it; one that names no page is left out.
    ///
    /// Costs a comparison of each pixel with its neighbour, a look at each run of equal ones, and a sort of the distinct
    /// pages. Allocates only for more distinct pages than ever before.
    pub fn compact(&mut self, frame: u64, pixels: &[Pixel], feedback: &mut Feedback) {
        let Some(&first) = pixels.first() else {
            *feedback = Feedback { frame, ..Feedback::default() };
            return;
        };
        let (mut run, mut start) = (first, 0);
        for (number, block) in pixels.chunks(BLOCK).enumerate() {
            let before = if number == 0 { first } else { pixels[number * BLOCK - 1] };
            let mut changes = changes(before, block);
            while changes != 0 {
                let at = number * BLOCK + changes.trailing_zeros() as usize;
                self.add(run, (at - start) as u32);
                (run, start) = (pixels[at], at);
                changes &= changes - 1;
            }
        }
        self.add(run, (pixels.len() - start) as u32);
        self.finish(frame, feedback);
    }

    fn finish(&mut self, frame: u64, feedback: &mut Feedback) {
        self.pages.sort_unstable_by_key(|wanted| wanted.page);
        std::mem::swap(&mut feedback.pages, &mut self.pages);
        (feedback.frame, feedback.degenerate) = (frame, std::mem::take(&mut self.degenerate));
        self.pages.clear();
        self.next.clear();
        self.last = NOWHERE;
        self.table.fill(0);
    }

    /// `count` pixels in a row are `pixel`.
    #[inline]
    fn add(&mut self, [low, high, eighth, flag]: Pixel, count: u32) {
        match flag {
            FEEDBACK_WANTED => {
                if let Some(page) = PageId::from_bits(u64::from(high) << 32 | u64::from(low)) {
                    self.want(page, eighth.min(STEPS_PER_LEVEL - 1) as u8, count);
                }
            }
            FEEDBACK_DEGENERATE => self.degenerate += count,
            _ => {}
        }
    }

    #[inline]
    fn want(&mut self, page: PageId, eighth: u8, count: u32) {
        let same = |place: &u32| self.pages.get(*place as usize).is_some_and(|wanted| wanted.page == page);
        // Where only the eighth has changed, the page is the last one itself.
        let guess = [self.last, self.next.get(self.last as usize).copied().unwrap_or(NOWHERE)];
        let place = guess.into_iter().find(same).unwrap_or_else(|| self.place(page));
        let wanted = &mut self.pages[place as usize];
        wanted.pixels += count;
        wanted.eighth = wanted.eighth.min(eighth);
        if place != self.last {
            if let Some(next) = self.next.get_mut(self.last as usize) {
                *next = place;
            }
            self.last = place;
        }
    }

    /// The page's place, a new one where it has none.
    fn place(&mut self, page: PageId) -> u32 {
        let slot = self.find(page);
        if let Some(place) = self.table[slot].checked_sub(1) {
            return place;
        }
        self.pages.push(WantedPage { page, pixels: 0, eighth: u8::MAX });
        self.next.push(NOWHERE);
        self.table[slot] = self.pages.len() as u32;
        if self.pages.len() * 2 > self.table.len() {
            self.table = vec![0; self.table.len() * 2];
            for place in 0..self.pages.len() {
                let slot = self.find(self.pages[place].page);
                self.table[slot] = place as u32 + 1;
            }
        }
        self.pages.len() as u32 - 1
    }

    /// The slot that has the page, or the free one where it belongs. The table is never more than half full.
    fn find(&self, page: PageId) -> usize {
        let mask = self.table.len() - 1;
        // Fibonacci hashing: the high bits of the product depend on all bits of the page.
        let hash = page.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut slot = (hash >> 32) as usize & mask;
        while let Some(place) = self.table[slot].checked_sub(1) {
            if self.pages[place as usize].page == page {
                break;
            }
            slot = (slot + 1) & mask;
        }
        slot
    }
}

/// Bit i: whether pixel i of a block differs from the one before it, which for pixel 0 is `before`.
fn changes(mut before: Pixel, block: &[Pixel]) -> u64 {
    let (fours, rest) = block.as_chunks::<4>();
    let (mut bits, mut at) = (0, 0);
    for four in fours {
        // Most often all four are the one before them, which is told with few wide instructions.
        let differs =
            four.iter().fold([0; 4], |any, pixel| std::array::from_fn(|i| any[i] | (pixel[i] ^ before[i])));
        if differs != [0; 4] {
            bits |= changes_one_by_one(before, four) << at;
        }
        (before, at) = (four[3], at + 4);
    }
    bits | if rest.is_empty() { 0 } else { changes_one_by_one(before, rest) << at }
}

fn changes_one_by_one(mut before: Pixel, pixels: &[Pixel]) -> u64 {
    let mut differs = |pixel: &Pixel| u64::from(std::mem::replace(&mut before, *pixel) != *pixel);
    (0..).zip(pixels).fold(0, |bits, (at, pixel)| bits | differs(pixel) << at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    fn naive(frame: u64, pixels: &[[u32; 4]]) -> Feedback {
        let mut pages = BTreeMap::<PageId, (u32, u8)>::new();
        let wanted = pixels.iter().filter(|pixel| pixel[3] == FEEDBACK_WANTED);
        for &[low, high, eighth, _] in wanted {
            let Some(page) = PageId::from_bits(u64::from(high) << 32 | u64::from(low)) else { continue };
            let entry = pages.entry(page).or_insert((0, 7));
            *entry = (entry.0 + 1, entry.1.min(eighth as u8));
        }
        let degenerate = pixels.iter().filter(|pixel| pixel[3] == FEEDBACK_DEGENERATE).count() as u32;
        let pages = pages.into_iter().map(|(page, (pixels, eighth))| WantedPage { page, pixels, eighth });
        Feedback { frame, pages: pages.collect(), degenerate }
    }

    proptest! {
        #[test]
        fn distinct_pages_are_counted(
            runs in prop::collection::vec((0u32..3000, prop_oneof![Just(0u32), Just(7), Just(u32::MAX)], 0u32..8, 0u32..3, 1usize..9), 0..4000),
        ) {
            let (mut compactor, mut feedback) = (FeedbackCompactor::new(), Feedback::default());
            let pixels: Vec<_> = runs
                .iter()
                .flat_map(|&(low, high, eighth, flag, n)| vec![[if high == u32::MAX { high } else { low }, high, eighth, flag]; n])
                .collect();
            // The second time in memory that the first has left behind.
            for part in [&pixels[..pixels.len() / 2], &pixels] {
                compactor.compact(3, part, &mut feedback);
                prop_assert_eq!(&feedback, &naive(3, part));
            }
        }
    }
}
