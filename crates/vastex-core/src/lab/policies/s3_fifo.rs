//! S3-FIFO (Yang, Zhang, Qiu, Yue and Rashmi, 2023): a small queue on trial, a main queue, and a memory of
//! those that failed.
//!
//! A frame's set is one request of each of its pages.

use std::collections::VecDeque;

use crate::lab::pages::Pages;
use crate::lab::policies::Evictor;
use crate::lab::pool::Pool;

/// Requests beyond which they are no longer counted.
const MAX_USES: u8 = 3;

pub(crate) struct S3Fifo {
    small: VecDeque<u32>,
    main: VecDeque<u32>,
    /// Pages that failed the trial, the oldest first.
    ghosts: VecDeque<u32>,
    is_ghost: Vec<bool>,
    uses: Vec<u8>,
    small_slots: usize,
    main_slots: usize,
}

impl S3Fifo {
    pub(crate) fn new(pages: &Pages, slots: usize) -> S3Fifo {
        let small_slots = (slots / 10).max(1);
        S3Fifo {
            small: VecDeque::new(),
            main: VecDeque::new(),
            ghosts: VecDeque::new(),
            is_ghost: vec![false; pages.len()],
            uses: vec![0; pages.len()],
            small_slots,
            main_slots: slots.saturating_sub(small_slots).max(1),
        }
    }

    fn remember(&mut self, page: u32) {
        self.ghosts.push_back(page);
        self.is_ghost[page as usize] = true;
        if self.ghosts.len() > self.main_slots
            && let Some(oldest) = self.ghosts.pop_front()
        {
            self.is_ghost[oldest as usize] = false;
        }
    }

    /// The oldest page on trial: a victim, or `None` if it goes on.
    fn try_small(&mut self, pool: &Pool<'_>) -> Option<u32> {
        let page = self.small.pop_front()?;
        if self.uses[page as usize] > 1 {
            self.uses[page as usize] = 0;
            self.main.push_back(page);
        } else if pool.may_evict(page) {
            self.remember(page);
            return Some(page);
        } else {
            self.small.push_back(page);
        }
        None
    }

    fn try_main(&mut self, pool: &Pool<'_>) -> Option<u32> {
        let page = self.main.pop_front()?;
        let uses = &mut self.uses[page as usize];
        if *uses == 0 && pool.may_evict(page) {
            return Some(page);
        }
        *uses = uses.saturating_sub(1);
        self.main.push_back(page);
        None
    }
}

impl Evictor for S3Fifo {
    fn begin_frame(&mut self, pool: &Pool<'_>) {
        for &page in pool.set().iter().filter(|&&page| pool.is_resident(page)) {
            let uses = &mut self.uses[page as usize];
            *uses = (*uses + 1).min(MAX_USES);
        }
    }

    fn admit(&mut self, page: u32) {
        self.uses[page as usize] = 0;
        if std::mem::take(&mut self.is_ghost[page as usize]) {
            self.ghosts.retain(|&ghost| ghost != page);
            self.main.push_back(page);
        } else {
            self.small.push_back(page);
        }
    }

    fn victim(&mut self, pool: &Pool<'_>) -> Option<u32> {
        // Enough turns for every page to use up its requests in either queue.
        let turns = (usize::from(MAX_USES) + 2) * (self.small.len() + self.main.len());
        for turn in 0..turns {
            // Where the queue on trial holds only what must stay, the main one has its turn.
            let trial = self.small.len() >= self.small_slots && turn < 2 * self.small.len();
            let victim =
                if trial || self.main.is_empty() { self.try_small(pool) } else { self.try_main(pool) };
            if victim.is_some() {
                return victim;
            }
        }
        [&mut self.main, &mut self.small].into_iter().find_map(|queue| {
            let at = queue.iter().position(|&page| pool.may_evict(page))?;
            queue.remove(at)
        })
    }
}
