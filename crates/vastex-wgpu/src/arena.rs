//! Ranges of entries in one piece of memory that grows: a buddy allocator, without any memory of its own.
//!
//! A range has a power of two of entries and begins at a multiple of them. One that is freed joins the range
//! beside it, if that is free, to one twice as large, and so on, so that memory that is free all of a sudden
//! is in as few pieces as when nothing had lain there. Where nothing large enough is free the memory doubles,
//! up to a limit.

use std::collections::BTreeSet;

/// Some entries of an [`Arena`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Range {
    pub(crate) first: u32,
    order: u8,
}

impl Range {
    /// One entry at the beginning, for what has no range.
    pub(crate) const EMPTY: Range = Range { first: 0, order: 0 };

    /// The range's entries, a power of two.
    pub(crate) fn entries(self) -> u32 {
        1 << self.order
    }
}

/// Ranges of powers of two of entries: given, taken back, and joined with their neighbours.
#[derive(Clone, Debug)]
pub(crate) struct Arena {
    capacity: u32,
    most: u32,
    /// Of each order the free ranges, by where they begin.
    free: Vec<BTreeSet<u32>>,
}

impl Arena {
    /// Entries of the largest arena: 1 GiB of them.
    pub(crate) const MOST: u32 = 1 << 28;

    /// An arena with `capacity` entries, and with at most `most`, either rounded down to a power of two.
    pub(crate) fn new(capacity: u32, most: u32) -> Arena {
        let [capacity, most] =
            [capacity, most.min(Arena::MOST)].map(|entries| 1u32 << entries.max(1).ilog2());
        let capacity = capacity.min(most);
        let mut free = vec![BTreeSet::new(); most.ilog2() as usize + 1];
        free[capacity.ilog2() as usize].insert(0);
        Arena { capacity, most, free }
    }

    /// Entries that there is memory for, a power of two; twice as many after a [`take`](Arena::take) that
    /// found none free.
    pub(crate) fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Entries that it has at most.
    pub(crate) fn most(&self) -> u32 {
        self.most
    }

    /// Entries that a range for so many takes.
    pub(crate) fn rounded(entries: u64) -> u64 {
        entries.max(1).next_power_of_two()
    }

    /// A range of at least so many entries, the first of the smallest free ones that is large enough. `None`
    /// if none is and the memory may not double.
    pub(crate) fn take(&mut self, entries: u32) -> Option<Range> {
        let order = u8::try_from(Arena::rounded(entries.into()).ilog2()).ok()?;
        loop {
            if let Some(found) = (usize::from(order)..self.free.len()).find(|&of| !self.free[of].is_empty()) {
                let first = self.free[found].pop_first()?;
                // What is beyond the range stays free, in halves.
                (usize::from(order)..found).for_each(|half| {
                    self.free[half].insert(first + (1 << half));
                });
                return Some(Range { first, order });
            }
            if self.capacity == self.most {
                return None;
            }
            let order = self.capacity.ilog2() as u8;
            let upper = Range { first: self.capacity, order };
            self.capacity *= 2;
            self.give(upper);
        }
    }

    /// Frees a range that was taken.
    pub(crate) fn give(&mut self, range: Range) {
        let Range { mut first, order } = range;
        let mut order = usize::from(order);
        while order + 1 < self.free.len() && self.free[order].remove(&(first ^ (1 << order))) {
            first &= !(1 << order);
            order += 1;
        }
        self.free[order].insert(first);
    }

    /// Frees everything.
    pub(crate) fn clear(&mut self) {
        *self = Arena::new(self.capacity, self.most);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// What no allocator can get wrong: who has each entry.
    struct Naive {
        owners: Vec<Option<usize>>,
    }

    impl Naive {
        fn take(&mut self, range: Range, owner: usize) {
            let end = (range.first + range.entries()) as usize;
            assert_eq!(range.first % range.entries(), 0, "a range begins at a multiple of its size");
            self.owners.resize(self.owners.len().max(end), None);
            for place in &mut self.owners[range.first as usize..end] {
                assert_eq!(*place, None, "taken twice");
                *place = Some(owner);
            }
        }

        fn give(&mut self, range: Range, owner: usize) {
            for place in &mut self.owners[range.first as usize..(range.first + range.entries()) as usize] {
                assert_eq!(*place, Some(owner));
                *place = None;
            }
        }

        /// Returns true if somewhere so many entries are free in a row, from a multiple of them on.
        fn has_room(&self, entries: u32, capacity: u32) -> bool {
            (0..capacity / entries).any(|n| {
                let mut places = (n * entries..(n + 1) * entries).map(|at| at as usize);
                places.all(|at| self.owners.get(at).is_none_or(Option::is_none))
            })
        }
    }

    struct Random(u64);

    impl Random {
        fn below(&mut self, n: usize) -> usize {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 16) as usize % n
        }
    }

    /// 2,000 textures at most come, grow by ranges of their own, and go.
    fn play(most: u32, largest: u32, seed: u64) -> (u32, usize, usize) {
        let (mut arena, mut naive) = (Arena::new(1024, most), Naive { owners: Vec::new() });
        let mut random = Random(seed);
        let mut textures: BTreeMap<usize, Vec<Range>> = BTreeMap::new();
        let (mut refused, mut peak) = (0, 0);
        for step in 0..12_000 {
            let number = random.below(2000);
            // Many come in the beginning, many go in the end.
            if random.below(12_000) < step / 2 && textures.contains_key(&number) {
                for range in textures.remove(&number).unwrap() {
                    naive.give(range, number);
                    arena.give(range);
                }
                continue;
            }
            let size = random.below(largest.ilog2() as usize + 1);
            let entries = 1 + random.below(1 << size) as u32;
            let before = arena.capacity();
            match arena.take(entries) {
                Some(range) => {
                    assert!(range.entries() >= entries && range.entries() < 2 * entries);
                    let doubled = arena.capacity() != before;
                    if doubled || step % 16 == 0 {
                        let room = naive.has_room(range.entries(), before);
                        assert_eq!(room, !doubled, "it doubles where there is no room, and then alone");
                    }
                    naive.take(range, number);
                    textures.entry(number).or_default().push(range);
                }
                None => {
                    refused += 1;
                    assert_eq!(arena.capacity(), arena.most());
                    let entries = Arena::rounded(entries.into()) as u32;
                    assert!(entries > arena.most() || !naive.has_room(entries, arena.capacity()));
                }
            }
            peak = peak.max(textures.len());
        }
        for (number, ranges) in textures {
            for range in ranges {
                naive.give(range, number);
                arena.give(range);
            }
        }
        // All pieces have joined: one range of everything.
        let all = arena.capacity();
        assert_eq!(arena.take(all), Some(Range { first: 0, order: all.ilog2() as u8 }));
        (all, refused, peak)
    }

    #[test]
    fn two_thousand_textures_come_grow_and_go() {
        let (capacity, refused, peak) = play(1 << 25, 1 << 9, 7);
        assert!(capacity > 1 << 16 && refused == 0 && peak > 1500, "{capacity} {refused} {peak}");
    }

    /// What `downlevel_webgl2_defaults` allows of a texture, 2048 x 2048, and less than that, which is full.
    #[test]
    fn an_arena_that_may_not_double_any_more_refuses_what_has_no_room() {
        let side = wgpu::Limits::downlevel_webgl2_defaults().max_texture_dimension_2d;
        let (capacity, refused, peak) = play(side * side, 1 << 9, 8);
        assert!(capacity <= side * side && refused == 0 && peak > 1500, "{capacity} {refused} {peak}");
        let (capacity, refused, peak) = play(1 << 16, 1 << 12, 9);
        assert!(capacity == 1 << 16 && refused > 100 && peak > 100, "{capacity} {refused} {peak}");
    }

    #[test]
    fn limits_are_rounded_down() {
        let arena = Arena::new(5000, 10_000);
        assert_eq!((arena.capacity(), arena.most()), (4096, 8192));
        let mut arena = Arena::new(1 << 20, 16);
        assert_eq!(
            (arena.capacity(), arena.take(17), arena.take(16).map(Range::entries)),
            (16, None, Some(16))
        );
    }
}
