//! Policies that give every page a rank of its own: the highest goes first. LRU and Belady's optimum are
//! such.

use std::collections::BinaryHeap;

use crate::lab::policies::Evictor;
use crate::lab::pool::Pool;
use crate::residency::retention::Candidate;

/// A rule that says how far off the next use of a page is thought to be.
pub(crate) trait Rank {
    /// A frame begins: `pool` knows its set already.
    fn begin_frame(&mut self, _pool: &Pool<'_>) {}

    /// How late the page, which is not in the frame's set, is thought to be wanted again. The latest goes
    /// first, among equals the finest.
    fn reuse_distance(&self, page: u32, pool: &Pool<'_>) -> f64;
}

/// Follows a rank: lists the candidates when the first victim of a frame is needed, and gives them in order.
pub(crate) struct Ranked<R> {
    rank: R,
    candidates: BinaryHeap<Candidate<u32>>,
    listed: bool,
}

impl<R: Rank> Ranked<R> {
    pub(crate) fn new(rank: R) -> Ranked<R> {
        Ranked { rank, candidates: BinaryHeap::new(), listed: false }
    }

    fn list(&mut self, pool: &Pool<'_>) {
        let mut candidates = std::mem::take(&mut self.candidates).into_vec();
        candidates.clear();
        let evictable = pool.residents().iter().copied().filter(|&page| pool.may_evict(page));
        candidates.extend(evictable.map(|page| self.candidate(page, pool)));
        self.candidates = BinaryHeap::from(candidates);
        self.listed = true;
    }

    fn candidate(&self, page: u32, pool: &Pool<'_>) -> Candidate<u32> {
        Candidate::new(self.rank.reuse_distance(page, pool), pool.pages().level(page), page)
    }
}

impl<R: Rank> Evictor for Ranked<R> {
    fn begin_frame(&mut self, pool: &Pool<'_>) {
        self.rank.begin_frame(pool);
        self.listed = false;
    }

    fn admit(&mut self, _page: u32) {}

    fn victim(&mut self, pool: &Pool<'_>) -> Option<u32> {
        if !self.listed {
            self.list(pool);
        }
        while let Some(candidate) = self.candidates.pop() {
            if pool.may_evict(candidate.page()) {
                // Without it, its ancestors may have no descendant left.
                for ancestor in pool.pages().ancestors(candidate.page()) {
                    if pool.may_evict_after(ancestor) {
                        let ancestor = self.candidate(ancestor, pool);
                        self.candidates.push(ancestor);
                    }
                }
                return Some(candidate.page());
            }
        }
        None
    }
}

/// LRU.
pub(crate) struct LeastRecent;

impl Rank for LeastRecent {
    fn reuse_distance(&self, page: u32, pool: &Pool<'_>) -> f64 {
        pool.age(page) as f64
    }
}

/// The finest level first, LRU within.
pub(crate) struct LevelFirst;

impl Rank for LevelFirst {
    fn reuse_distance(&self, page: u32, pool: &Pool<'_>) -> f64 {
        pool.age(page) as f64 - f64::from(pool.pages().level(page)) * pool.frames() as f64
    }
}

/// Belady's MIN: the page whose next use is the farthest off.
///
/// With the sets of whole frames for requests it is still optimal. An ancestor is in the set of every frame
/// that has a descendant, so its next use is never later; ties go to the finest; so MIN keeps ancestors by
/// itself, and the optimum is the same with that rule and without.
pub(crate) struct Farthest {
    /// The frames that want each page, the next one last.
    uses: Vec<Vec<u64>>,
}

impl Farthest {
    pub(crate) fn new(pool: &Pool<'_>) -> Farthest {
        let mut uses = vec![Vec::new(); pool.pages().len()];
        for (frame, set) in pool.pages().sets().enumerate().rev() {
            set.iter().for_each(|&page| uses[page as usize].push(frame as u64));
        }
        Farthest { uses }
    }
}

impl Rank for Farthest {
    fn begin_frame(&mut self, pool: &Pool<'_>) {
        for &page in pool.set() {
            self.uses[page as usize].pop();
        }
    }

    fn reuse_distance(&self, page: u32, _pool: &Pool<'_>) -> f64 {
        self.uses[page as usize].last().map_or(f64::INFINITY, |&frame| frame as f64)
    }
}
