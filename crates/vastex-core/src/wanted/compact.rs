//! Compaction of a feedback target on the CPU: from its raw pixels to distinct pages, in ascending order.
//!
//! For devices without compute shaders, and the measure of those that have them: both give the same
//! [`Feedback`]. How the pixels come to the CPU is the GPU crate's business.

use crate::shader_constants::{
    FEEDBACK_DEGENERATE, FEEDBACK_WANTED, MOST_WEIGHT, STEP_BITS, STEPS_PER_LEVEL,
};
use crate::texture::page::PageId;
use crate::wanted::feedback::{Feedback, WantedPage};

/// Buckets of the table at first; it doubles whenever it is half full.
const FIRST_BUCKETS: usize = 256;
/// Pixels that are compared with their neighbours at once.
const BLOCK: usize = 64;
/// Pixels that are compared with so few instructions that there is no number for them.
const PART: usize = 16;
/// A pixel of a feedback target: page id low, page id high, eighth, flag.
type Pixel = [u32; 4];

/// Compacts feedback targets, one after the other, in memory that it keeps.
///
/// Neighbouring pixels mostly want the same page, so only the first of a run is looked at; where the runs of
/// a row are those of the row above, each run's page is the one that followed its predecessor's page the last
/// time, so that a look-up is rare: it goes to a table of open addressing whose memory follows the number of
/// distinct pages, not that of the pixels.
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
    /// A place in `seen`, or 0; a power of two of them.
    table: Vec<u32>,
    /// What is in the table, in the order in which it came, behind a page that is none.
    seen: Vec<Seen>,
    /// The place of the page that was wanted last.
    last: u32,
    degenerate: u32,
}

/// A page that pixels want.
#[derive(Clone, Copy, Debug)]
struct Seen {
    page: PageId,
    pixels: u32,
    /// The place of the page that was wanted after it the last time; of none at first.
    next: u32,
    eighth: u8,
}

impl Seen {
    const fn new(page: PageId) -> Seen {
        Seen { page, pixels: 0, next: 0, eighth: u8::MAX }
    }
}

impl Default for FeedbackCompactor {
    fn default() -> FeedbackCompactor {
        FeedbackCompactor::new()
    }
}

impl FeedbackCompactor {
    /// One that has seen nothing.
    pub fn new() -> FeedbackCompactor {
        let seen = vec![Seen::new(PageId::NONE)];
        FeedbackCompactor { table: vec![0; FIRST_BUCKETS], seen, last: 0, degenerate: 0 }
    }

    /// Puts what the pixels want into `feedback`, as that of `frame`; of which view it is stays. A pixel is
    /// page id low, page id high, eighth and flag, as `vastex_feedback` wrote it; one that names no page is
    /// left out. Above the three bits of the eighth stands as how many more pixels it counts, 15 at most.
    ///
    /// Costs a comparison of each pixel with its neighbour, a look at each run of equal ones, and a sort of
    /// the distinct pages. Allocates only for more distinct pages than ever before.
    pub fn compact(&mut self, frame: u64, pixels: &[Pixel], feedback: &mut Feedback) {
        if pixels.is_empty() {
            feedback.pages.clear();
            (feedback.frame, feedback.degenerate) = (frame, 0);
            return;
        }
        let (mut start, mut from) = (0, 1);
        // Each look ahead begins with the pixel that the first of the block is compared with.
        while let Some(block) = pixels[from - 1..].first_chunk() {
            start = self.add_runs(changes(block), pixels, from, start);
            from += BLOCK;
        }
        let rest = pixels[from - 1..].windows(2).enumerate();
        let changes = rest.fold(0, |bits, (i, pair)| bits | u64::from(pair[0] != pair[1]) << i);
        start = self.add_runs(changes, pixels, from, start);
        self.add(&pixels[start], (pixels.len() - start) as u32);
        self.finish(frame, feedback);
    }

    /// Takes in the run that begins at `start` and those after it, as far as they end: bit i of `changes`
    /// says whether one does before pixel `from + i`. Gives the beginning of the one that does not.
    #[inline]
    fn add_runs(&mut self, mut changes: u64, pixels: &[Pixel], from: usize, mut start: usize) -> usize {
        while changes != 0 {
            let end = from + changes.trailing_zeros() as usize;
            self.add(&pixels[start], (end - start) as u32);
            start = end;
            changes &= changes - 1;
        }
        start
    }

    fn finish(&mut self, frame: u64, feedback: &mut Feedback) {
        let wanted = |seen: &Seen| WantedPage { page: seen.page, pixels: seen.pixels, eighth: seen.eighth };
        feedback.pages.clear();
        // Within a level pages mostly come in order, and levels one way or the other: turned round, little is
        // left to sort.
        let levels = self.seen[1..].chunk_by(|a, b| a.page.level() == b.page.level());
        if self.seen[1..].first().map(|seen| seen.page) > self.seen[1..].last().map(|seen| seen.page) {
            feedback.pages.extend(levels.rev().flatten().map(wanted));
        } else {
            feedback.pages.extend(levels.flatten().map(wanted));
        }
        feedback.pages.sort_unstable_by_key(|wanted| wanted.page);
        (feedback.frame, feedback.degenerate) = (frame, std::mem::take(&mut self.degenerate));
        self.seen.truncate(1);
        self.seen[0] = Seen::new(PageId::NONE);
        self.last = 0;
        self.table.fill(0);
    }

    /// `count` pixels in a row are `pixel`.
    #[inline]
    fn add(&mut self, &[low, high, eighth, flag]: &Pixel, count: u32) {
        if flag != FEEDBACK_WANTED {
            self.degenerate += if flag == FEEDBACK_DEGENERATE { count } else { 0 };
            return;
        }
        let (bits, last) = (u64::from(high) << 32 | u64::from(low), self.seen[self.last as usize]);
        // Where only the eighth has changed, the page is the last one itself.
        let mut at = if last.page.to_bits() == bits { self.last } else { last.next };
        if self.seen[at as usize].page.to_bits() != bits {
            let Some(page) = PageId::from_bits(bits) else { return };
            at = self.place(page);
            self.seen[self.last as usize].next = at;
        }
        let seen = &mut self.seen[at as usize];
        let weight = 1 + (eighth >> STEP_BITS).min(MOST_WEIGHT - 1);
        seen.pixels = seen.pixels.saturating_add(count.saturating_mul(weight));
        seen.eighth = seen.eighth.min((eighth % STEPS_PER_LEVEL) as u8);
        self.last = at;
    }

    /// The page's place, a new one where it has none.
    #[inline(never)]
    fn place(&mut self, page: PageId) -> u32 {
        let bucket = self.find(page);
        if self.table[bucket] != 0 {
            return self.table[bucket];
        }
        let place = self.seen.len() as u32;
        self.seen.push(Seen::new(page));
        self.table[bucket] = place;
        if self.seen.len() * 2 > self.table.len() {
            self.table = vec![0; self.table.len() * 2];
            for place in 1..self.seen.len() {
                let bucket = self.find(self.seen[place].page);
                self.table[bucket] = place as u32;
            }
        }
        place
    }

    /// The bucket that has the page, or the free one where it belongs. The table is never more than half
    /// full.
    fn find(&self, page: PageId) -> usize {
        let mask = self.table.len() - 1;
        // Fibonacci hashing: the highest bits of the product depend on all bits of the page, and no others on
        // the texture's number.
        let hash = page.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut bucket = (hash >> (u64::BITS - self.table.len().trailing_zeros())) as usize;
        while self.table[bucket] != 0 && self.seen[self.table[bucket] as usize].page != page {
            bucket = (bucket + 1) & mask;
        }
        bucket
    }
}

/// Bit i: whether pixel i + 1 differs from the one before it.
///
/// Where runs end is as good as random, so there is no branch for it.
#[inline]
fn changes(pixels: &[Pixel; BLOCK + 1]) -> u64 {
    let of_part = |part: usize| {
        let pixels = pixels[part * PART..].first_chunk();
        pixels.map_or(0, |pixels| u64::from(!equal_neighbours(pixels)) << (part * PART))
    };
    of_part(0) | of_part(1) | of_part(2) | of_part(3)
}

/// Bit i: whether pixel i + 1 is as the one before it.
#[cfg(not(target_arch = "x86_64"))]
#[inline]
fn equal_neighbours(pixels: &[Pixel; PART + 1]) -> u16 {
    (0..16).fold(0, |bits, i| bits | u16::from(pixels[i] == pixels[i + 1]) << i)
}

/// Bit i: whether pixel i + 1 is as the one before it.
#[cfg(target_arch = "x86_64")]
#[inline]
fn equal_neighbours(pixels: &[Pixel; PART + 1]) -> u16 {
    #[expect(unsafe_code, reason = "what names the instructions of a processor is unsafe to call")]
    // SAFETY: SSE2 is part of every x86-64.
    unsafe {
        x86_64::equal_neighbours(pixels)
    }
}

#[cfg(target_arch = "x86_64")]
mod x86_64 {
    use super::{PART, Pixel};
    use std::arch::x86_64::{
        __m128i, _mm_cmpeq_epi32, _mm_movemask_epi8, _mm_packs_epi16, _mm_packs_epi32, _mm_set_epi32,
        _mm_set1_epi32,
    };

    /// A lane is all ones where it is equal, and stays so when it is packed.
    #[target_feature(enable = "sse2")]
    pub(super) fn equal_neighbours(pixels: &[Pixel; PART + 1]) -> u16 {
        let mut of_four = [_mm_set1_epi32(0); 4];
        for (four, equal) in of_four.iter_mut().enumerate() {
            let mut words = [_mm_set1_epi32(0); 4];
            for (i, words) in words.iter_mut().enumerate() {
                *words = _mm_cmpeq_epi32(lanes(pixels[four * 4 + i]), lanes(pixels[four * 4 + i + 1]));
            }
            *equal = _mm_cmpeq_epi32(pack(words), _mm_set1_epi32(-1));
        }
        _mm_movemask_epi8(pack(of_four)) as u16
    }

    #[target_feature(enable = "sse2")]
    fn lanes([a, b, c, d]: Pixel) -> __m128i {
        _mm_set_epi32(d as i32, c as i32, b as i32, a as i32)
    }

    /// A byte for each lane.
    #[target_feature(enable = "sse2")]
    fn pack(four: [__m128i; 4]) -> __m128i {
        _mm_packs_epi16(_mm_packs_epi32(four[0], four[1]), _mm_packs_epi32(four[2], four[3]))
    }
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
            *entry = (entry.0 + 1 + eighth / 8, entry.1.min((eighth % 8) as u8));
        }
        let degenerate = pixels.iter().filter(|pixel| pixel[3] == FEEDBACK_DEGENERATE).count() as u32;
        let pages = pages.into_iter().map(|(page, (pixels, eighth))| WantedPage { page, pixels, eighth });
        Feedback { frame, pages: pages.collect(), degenerate, ..Feedback::default() }
    }

    proptest! {
        #[test]
        fn distinct_pages_are_counted(
            runs in prop::collection::vec((0u32..3000, prop_oneof![Just(0u32), Just(7), Just(u32::MAX)], 0u32..128, 0u32..3, 1usize..9), 0..4000),
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
