//! CLOCK: a hand goes round the pages in the order in which they came and gives those a second chance that
//! were wanted.

use std::collections::VecDeque;

use crate::lab::pages::Pages;
use crate::lab::policies::Evictor;
use crate::lab::pool::Pool;

pub(crate) struct Clock {
    /// The next page under the hand first.
    ring: VecDeque<u32>,
    wanted: Vec<bool>,
}

impl Clock {
    pub(crate) fn new(pages: &Pages) -> Clock {
        Clock { ring: VecDeque::new(), wanted: vec![false; pages.len()] }
    }
}

impl Evictor for Clock {
    fn begin_frame(&mut self, pool: &Pool<'_>) {
        for &page in pool.set() {
            self.wanted[page as usize] = true;
        }
    }

    fn admit(&mut self, page: u32) {
        self.ring.push_back(page);
    }

    fn victim(&mut self, pool: &Pool<'_>) -> Option<u32> {
        // In two rounds every page has been asked for its second chance and without it.
        for _ in 0..2 * self.ring.len() {
            let page = self.ring.pop_front()?;
            if pool.may_evict(page) && !std::mem::take(&mut self.wanted[page as usize]) {
                return Some(page);
            }
            self.ring.push_back(page);
        }
        // What is left had descendants when it was asked.
        let at = self.ring.iter().position(|&page| pool.may_evict(page))?;
        self.ring.remove(at)
    }
}
