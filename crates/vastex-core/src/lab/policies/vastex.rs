//! Vastex's own policy, as replays see it: [`Retention`], and the jitter cycle.
//!
//! While the view stands, feedback repeats with the jitter cycle, so what the cycle showed comes back at its
//! own time. The pager's working set is that of a whole cycle, and so needs nothing of the kind.

use crate::lab::pages::Pages;
use crate::lab::policies::ranked::Rank;
use crate::lab::pool::Pool;
use crate::residency::retention::Retention;
use crate::shader_constants::JITTER_CYCLE;

const CYCLE: u64 = JITTER_CYCLE as u64;

pub(crate) struct Vastex {
    retention: Retention,
    /// The frames of the last cycle in which each page was wanted, as bits; the last of them is bit 0.
    seen: Vec<u16>,
    /// The frame of bit 0, one too large.
    seen_at: Vec<u64>,
    /// The frame in which this view began.
    cut: u64,
}

impl Vastex {
    pub(crate) fn new(pages: &Pages) -> Vastex {
        Vastex {
            retention: Retention::default(),
            seen: vec![0; pages.len()],
            seen_at: vec![0; pages.len()],
            cut: 0,
        }
    }

    fn note_set(&mut self, pool: &Pool<'_>) {
        let frame = pool.frame();
        let mut again = 0;
        for &page in pool.set() {
            let (seen, at) = (&mut self.seen[page as usize], &mut self.seen_at[page as usize]);
            again += usize::from(*at == frame);
            let gap = (frame + 1 - *at).min(CYCLE);
            *seen = if gap < CYCLE { *seen << gap | 1 } else { 1 };
            *at = frame + 1;
        }
        let is_cut = 2 * again < pool.set().len();
        if is_cut {
            self.cut = frame;
        }
        let pages = pool.set().iter().map(|&page| pool.pages().id(page));
        self.retention.observe(pages, is_cut, pool.pages().textures());
    }

    /// Frames until the cycle shows a page again that it has shown in this view, if that stands.
    fn frames_until_cycle(&self, page: u32, age: u64, frame: u64) -> Option<f64> {
        if age >= CYCLE || frame - age < self.cut || !self.retention.is_still() {
            return None;
        }
        let seen = self.seen[page as usize] << age;
        let oldest = (seen != 0).then(|| u64::from(seen.ilog2()))?;
        Some((CYCLE - oldest) as f64)
    }
}

impl Rank for Vastex {
    fn begin_frame(&mut self, pool: &Pool<'_>) {
        self.note_set(pool);
        let out_of_view = pool.residents().iter().map(|&page| pool.age(page)).filter(|&age| age > 0);
        self.retention.size_reserve(out_of_view, pool.slots() - pool.set().len());
    }

    fn reuse_distance(&self, page: u32, pool: &Pool<'_>) -> f64 {
        let age = pool.age(page);
        if let Some(frames) = self.frames_until_cycle(page, age, pool.frame()) {
            return frames - LATER; // before all that only may come back
        }
        self.retention.reuse_distance(pool.pages().id(page), age, pool.pages().textures())
    }
}

/// More frames than any page is thought to stay away.
const LATER: f64 = 1e9;
