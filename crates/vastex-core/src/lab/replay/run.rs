//! One run through a trace: what is asked for, what arrives, who gives up a slot, and how far the picture is
//! from sharp.

use std::collections::VecDeque;

use crate::lab::policies::Evictor;
use crate::lab::pool::Pool;

/// How loads come.
#[derive(Clone, Copy, Debug)]
pub(super) struct Delivery {
    pub(super) latency_frames: u64,
    pub(super) tiles_per_frame: u64,
}

impl Delivery {
    pub(super) const AT_ONCE: Delivery = Delivery { latency_frames: 0, tiles_per_frame: u64::MAX };
}

/// The fields of [`Replay`](crate::Replay) that a run counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Counts {
    pub(super) loads: u64,
    pub(super) evictions: u64,
    pub(super) reloads: u64,
    pub(super) wasted: u64,
    pub(super) cuts: u64,
    pub(super) frames_to_full: u64,
    pub(super) frames_to_full_bound: u64,
    pub(super) missing_level_frames: f64,
}

/// A view on its way to full residency.
struct View {
    first: u64,
    /// Pages that were resident or under way when it began.
    had: Vec<bool>,
    is_full: bool,
    /// True if one that knew the future could have filled it.
    could_be_full: bool,
}

pub(super) struct Run<'a> {
    pool: Pool<'a>,
    evictor: Box<dyn Evictor>,
    delivery: Delivery,
    counts: Counts,
    /// The frame in which each load arrives, the next one first.
    under_way: VecDeque<(u64, u32)>,
    is_under_way: Vec<bool>,
    was_loaded: Vec<bool>,
    view: Option<View>,
}

impl<'a> Run<'a> {
    pub(super) fn new(pool: Pool<'a>, evictor: Box<dyn Evictor>, delivery: Delivery) -> Run<'a> {
        let pages = pool.pages().len();
        Run {
            pool,
            evictor,
            delivery,
            counts: Counts::default(),
            under_way: VecDeque::new(),
            is_under_way: vec![false; pages],
            was_loaded: vec![false; pages],
            view: None,
        }
    }

    pub(super) fn play(mut self) -> Counts {
        for frame in 0..self.pool.frames() {
            self.note_cut(frame);
            self.pool.begin_frame(frame);
            self.evictor.begin_frame(&self.pool);
            self.request();
            self.arrive();
            self.note_view();
            self.counts.missing_level_frames += self.missing_levels();
        }
        self.counts
    }

    /// Begins a view where a frame shares less than half of its set with the one before, which the pool still
    /// stands at.
    fn note_cut(&mut self, frame: usize) {
        let set = self.pool.pages().set(frame);
        let again = set.iter().filter(|&&page| self.pool.is_wanted(page)).count();
        if frame > 0 && 2 * again >= set.len() {
            return;
        }
        let pages = 0..self.pool.pages().len() as u32;
        let had = pages.map(|page| self.pool.is_resident(page) || self.is_under_way[page as usize]);
        self.view =
            Some(View { first: frame as u64, had: had.collect(), is_full: false, could_be_full: false });
        self.counts.cuts += 1;
    }

    /// Asks for what is missing: coarse before fine, as the set stands.
    fn request(&mut self) {
        let due = self.pool.frame().saturating_add(self.delivery.latency_frames);
        let mut left = self.delivery.tiles_per_frame;
        for &page in self.pool.set() {
            if left == 0 {
                return;
            }
            if !self.pool.is_resident(page) && !std::mem::replace(&mut self.is_under_way[page as usize], true)
            {
                self.under_way.push_back((due, page));
                self.counts.loads += 1;
                self.counts.reloads +=
                    u64::from(std::mem::replace(&mut self.was_loaded[page as usize], true));
                left -= 1;
            }
        }
    }

    fn arrive(&mut self) {
        let frame = self.pool.frame();
        while let Some((_, page)) = self.under_way.pop_front_if(|(due, _)| *due <= frame) {
            self.is_under_way[page as usize] = false;
            if self.pool.is_full() && !(self.pool.is_wanted(page) && self.evict()) {
                self.counts.wasted += 1;
                continue;
            }
            self.pool.admit(page);
            self.evictor.admit(page);
        }
    }

    fn evict(&mut self) -> bool {
        let Some(victim) = self.evictor.victim(&self.pool) else { return false };
        debug_assert!(self.pool.may_evict(victim));
        self.pool.evict(victim);
        self.counts.evictions += 1;
        true
    }

    /// Counts a frame of the view while its set is not resident, and one of the bound while nobody could have
    /// filled it.
    fn note_view(&mut self) {
        let Some(view) = &mut self.view else { return };
        view.is_full |= self.pool.set().iter().all(|&page| self.pool.is_resident(page));
        let missing = self.pool.set().iter().filter(|&&page| !view.had[page as usize]).count() as u64;
        // Loads begun in the view's first frame arrive after the latency.
        let batches = (self.pool.frame() - view.first + 1).saturating_sub(self.delivery.latency_frames);
        view.could_be_full |= missing <= batches.saturating_mul(self.delivery.tiles_per_frame);
        self.counts.frames_to_full += u64::from(!view.is_full);
        self.counts.frames_to_full_bound += u64::from(!view.could_be_full);
    }

    /// Levels between what a feedback pixel wants and what is resident, on average.
    fn missing_levels(&self) -> f64 {
        let pages = self.pool.pages();
        let (mut missing, mut all) = (0, 0);
        for &(page, pixels) in pages.named(self.pool.frame() as usize) {
            let shown = std::iter::once(page).chain(pages.ancestors(page));
            let gap = shown.take_while(|&page| !self.pool.is_resident(page)).count() as u64;
            missing += gap * u64::from(pixels);
            all += u64::from(pixels);
        }
        if all == 0 { 0.0 } else { missing as f64 / all as f64 }
    }
}
