//! A map from pages to values whose memory follows the most pages that it has ever held.
//!
//! Pages come and go with every frame. A map that marks what has gone has to be cleaned now and then, and may
//! take more memory then; this one closes the gap at once, so that in a steady state it allocates nothing and
//! every look-up is as short as the first one was.

use crate::texture::page::PageId;

/// Places at first.
const FIRST_BUCKETS: usize = 16;

/// A map from pages to values whose memory follows the most pages that it has ever held.
///
/// Half of its buckets are always free.
#[derive(Clone, Debug)]
pub(crate) struct PageMap<V> {
    /// A power of two of them; those of no page are free.
    buckets: Vec<(PageId, V)>,
    len: usize,
}

impl<V> Default for PageMap<V> {
    fn default() -> PageMap<V> {
        PageMap { buckets: Vec::new(), len: 0 }
    }
}

impl<V: Default> PageMap<V> {
    /// Pages in the map.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The value of a page.
    #[inline]
    pub(crate) fn get(&self, page: PageId) -> Option<&V> {
        self.find(page).map(|at| &self.buckets[at].1)
    }

    /// Gives a page a value, in the place of the one that it may have.
    pub(crate) fn insert(&mut self, page: PageId, value: V) {
        debug_assert!(page != PageId::NONE);
        if let Some(at) = self.find(page) {
            self.buckets[at].1 = value;
            return;
        }
        self.len += 1;
        if self.len * 2 > self.buckets.len() {
            self.grow();
        }
        self.put(page, value);
    }

    /// Takes a page out; gives its value.
    pub(crate) fn remove(&mut self, page: PageId) -> Option<V> {
        let mut hole = self.find(page)?;
        let value = std::mem::take(&mut self.buckets[hole].1);
        let mask = self.buckets.len() - 1;
        let mut next = hole;
        loop {
            next = (next + 1) & mask;
            let other = self.buckets[next].0;
            if other == PageId::NONE {
                break;
            }
            // What lies beyond the hole moves into it, unless it belongs behind it.
            if next.wrapping_sub(self.home(other)) & mask >= next.wrapping_sub(hole) & mask {
                self.buckets.swap(hole, next);
                hole = next;
            }
        }
        self.buckets[hole] = (PageId::NONE, V::default());
        self.len -= 1;
        Some(value)
    }

    /// Keeps only the pages for which `keep` returns true. Costs a visit of every bucket, and allocates.
    pub(crate) fn retain(&mut self, mut keep: impl FnMut(PageId, &V) -> bool) {
        let mut kept = PageMap::default();
        for (page, value) in std::mem::take(&mut self.buckets) {
            if page != PageId::NONE && keep(page, &value) {
                kept.insert(page, value);
            }
        }
        *self = kept;
    }

    #[inline]
    fn find(&self, page: PageId) -> Option<usize> {
        if page == PageId::NONE {
            return None; // free buckets are of no page
        }
        let mask = self.buckets.len().checked_sub(1)?;
        let mut at = self.home(page);
        loop {
            match self.buckets[at].0 {
                found if found == page => return Some(at),
                PageId::NONE => return None,
                _ => at = (at + 1) & mask,
            }
        }
    }

    /// Where the search for a page begins.
    #[inline]
    fn home(&self, page: PageId) -> usize {
        // Fibonacci hashing: the highest bits of the product depend on all bits of the page, and no others on
        // the texture's number.
        let hash = page.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (hash >> (u64::BITS - self.buckets.len().trailing_zeros())) as usize
    }

    fn put(&mut self, page: PageId, value: V) {
        let mut at = self.home(page);
        while self.buckets[at].0 != PageId::NONE {
            at = (at + 1) & (self.buckets.len() - 1);
        }
        self.buckets[at] = (page, value);
    }

    fn grow(&mut self) {
        let buckets = (self.buckets.len() * 2).max(FIRST_BUCKETS);
        let free = std::iter::repeat_with(|| (PageId::NONE, V::default())).take(buckets).collect();
        for (page, value) in std::mem::replace(&mut self.buckets, free) {
            if page != PageId::NONE {
                self.put(page, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// The same page of each texture had one home.
    #[test]
    fn pages_of_many_textures_lie_near_their_homes() {
        let mut map = PageMap::default();
        for texture in 0..2000u64 {
            for level in 3..6u64 {
                map.insert(PageId::from_bits(texture << 53 | level << 48).unwrap(), ());
            }
        }
        let mask = map.buckets.len() - 1;
        let probes = map.buckets.iter().enumerate().filter(|(_, (page, ()))| *page != PageId::NONE);
        let probes: usize = probes.map(|(at, (page, ()))| at.wrapping_sub(map.home(*page)) & mask).sum();
        assert!(probes < 2 * map.len(), "{probes} probes beside the first for {} pages", map.len());
    }

    proptest! {
        #[test]
        fn it_is_a_map(steps in prop::collection::vec((0u64..40, 0u8..8, any::<u32>()), 0..400)) {
            // Few pages, so that they meet again, and bits far apart, so that homes wrap round.
            let page = |n: u64| PageId::from_bits(n.wrapping_mul(0x0010_0421_8000_0421) & u64::MAX >> 1).unwrap();
            let (mut map, mut model) = (PageMap::default(), BTreeMap::new());
            for (n, what, value) in steps {
                match what {
                    0..5 => {
                        map.insert(page(n), value);
                        model.insert(page(n), value);
                    }
                    5 | 6 => prop_assert_eq!(map.remove(page(n)), model.remove(&page(n))),
                    _ => {
                        map.retain(|_, &kept| kept % 4 != value % 4);
                        model.retain(|_, &mut kept| kept % 4 != value % 4);
                    }
                }
                prop_assert_eq!((map.len(), map.is_empty()), (model.len(), model.is_empty()));
                prop_assert!(map.get(PageId::NONE).is_none() && map.remove(PageId::NONE).is_none());
                for n in 0..40 {
                    prop_assert_eq!(map.get(page(n)), model.get(&page(n)));
                }
            }
        }
    }
}
