//! The tiles that the RAM caches of a budget keep, the order of their last uses, and which tile makes room.
//!
//! Uses are numbered over all caches. A tile was used in the last jitter cycle if the number of its last use
//! is not below `cycle_from`, so the oldest tile of all tells whether any is older than the cycle.

use std::collections::{BTreeMap, VecDeque};

use rustc_hash::FxHashMap;
use vastex_core::PagePos;
use vastex_core::shader_constants::JITTER_CYCLE;

use crate::sources::TierStats;
use crate::tile::Tile;

/// The cost of keeping a tile besides its bytes, so that the budget holds for constant tiles too.
pub(super) const ENTRY_BYTES: u64 = 128;

/// What the caches of a budget keep.
pub(super) struct Kept {
    budget: u64,
    /// Bytes of all tiles, the cost of keeping them included.
    bytes: u64,
    /// By number.
    caches: FxHashMap<u64, Cache>,
    /// The number of the next cache; none is used twice.
    next_cache: u64,
    /// The tiles of all caches by their last uses.
    by_use: BTreeMap<u64, (u64, PagePos)>,
    /// Uses so far.
    uses: u64,
    /// The first use of each frame of the last jitter cycle, oldest first; never empty.
    frames: VecDeque<u64>,
    /// The sum of all caches' `used_bytes`.
    used_bytes: u64,
    /// The tiles of the last jitter cycle that another cache has taken the place of, by their last uses.
    taken: VecDeque<Taken>,
}

/// What is kept of one source.
#[derive(Default)]
struct Cache {
    /// With the numbers of their last uses.
    tiles: FxHashMap<PagePos, (Tile, u64)>,
    by_use: BTreeMap<u64, PagePos>,
    /// How many times content has changed.
    changes: u64,
    stats: TierStats,
    /// Bytes of the tiles that were used in the last jitter cycle, those included that other caches have
    /// taken the place of since.
    used_bytes: u64,
    /// Bytes that this cache has taken of what others used in the last jitter cycle.
    taken_bytes: u64,
    /// The tiles of the last jitter cycle that others have taken the place of: last use and cost.
    lost: FxHashMap<PagePos, (u64, u64)>,
}

/// A tile that made room for a tile of another cache.
struct Taken {
    last_use: u64,
    cost: u64,
    taker: u64,
    owner: u64,
    pos: PagePos,
}

impl Kept {
    pub(super) fn new(budget: u64) -> Kept {
        Kept {
            budget,
            bytes: 0,
            caches: FxHashMap::default(),
            next_cache: 0,
            by_use: BTreeMap::new(),
            uses: 0,
            frames: VecDeque::from([0]),
            used_bytes: 0,
            taken: VecDeque::new(),
        }
    }

    /// The number of a new cache.
    pub(super) fn add_cache(&mut self) -> u64 {
        let number = self.next_cache;
        self.next_cache += 1;
        self.caches.insert(number, Cache::default());
        number
    }

    pub(super) fn remove_cache(&mut self, number: u64) {
        self.drop_changed(number, |_| true);
        if let Some(gone) = self.caches.remove(&number) {
            // What is left of it was lost to others.
            self.used_bytes -= gone.used_bytes;
        }
    }

    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    pub(super) fn stats(&self, cache: u64) -> TierStats {
        self.caches.get(&cache).map_or_else(TierStats::default, |cache| cache.stats)
    }

    /// How many times content of a source has changed.
    pub(super) fn changes(&self, cache: u64) -> u64 {
        self.caches.get(&cache).map_or(0, |cache| cache.changes)
    }

    /// A tile, without a use.
    pub(super) fn peek(&self, cache: u64, pos: PagePos) -> Option<Tile> {
        self.caches.get(&cache)?.tiles.get(&pos).map(|(tile, _)| tile.clone())
    }

    /// A tile, which is used by that.
    pub(super) fn get(&mut self, number: u64, pos: PagePos) -> Option<Tile> {
        let cycle_from = self.cycle_from();
        let cache = self.caches.get_mut(&number)?;
        let Some((tile, last_use)) = cache.tiles.get_mut(&pos) else {
            cache.stats.misses += 1;
            return None;
        };
        cache.stats.hits += 1;
        cache.stats.bytes_read += tile.bytes.len() as u64;
        if *last_use < cycle_from {
            cache.used_bytes += cost(tile);
            self.used_bytes += cost(tile);
        }
        self.uses += 1;
        self.by_use.remove(last_use);
        cache.by_use.remove(last_use);
        *last_use = self.uses;
        self.by_use.insert(self.uses, (number, pos));
        cache.by_use.insert(self.uses, pos);
        Some(tile.clone())
    }

    /// Keeps a tile, if room can be made for it.
    pub(super) fn insert(&mut self, number: u64, pos: PagePos, tile: Tile) {
        let cost = cost(&tile);
        // Another thread may have read it at the same time.
        self.remove(number, pos);
        if !self.make_room(number, cost) {
            return;
        }
        let Some(cache) = self.caches.get_mut(&number) else { return };
        // A tile that was lost in this cycle was counted all the time.
        let counted = cache.lost.remove(&pos).map_or(0, |(_, cost)| cost);
        cache.used_bytes = cache.used_bytes + cost - counted;
        self.used_bytes = self.used_bytes + cost - counted;
        self.uses += 1;
        self.by_use.insert(self.uses, (number, pos));
        cache.by_use.insert(self.uses, pos);
        cache.stats.bytes_written += tile.bytes.len() as u64;
        cache.tiles.insert(pos, (tile, self.uses));
        cache.stats.bytes += cost;
        cache.stats.tiles += 1;
        self.bytes += cost;
    }

    /// Drops the tiles of a source whose content has changed.
    pub(super) fn drop_changed(&mut self, number: u64, is_concerned: impl Fn(PagePos) -> bool) {
        let Some(cache) = self.caches.get_mut(&number) else { return };
        cache.changes += 1;
        let concerned: Vec<_> = cache.tiles.keys().copied().filter(|&pos| is_concerned(pos)).collect();
        for pos in concerned {
            self.remove(number, pos);
        }
    }

    /// Begins a frame: what was last used in the frame that leaves the jitter cycle is free for all.
    pub(super) fn begin_frame(&mut self) {
        let before = self.cycle_from();
        self.frames.push_back(self.uses + 1);
        if self.frames.len() > JITTER_CYCLE as usize {
            self.frames.pop_front();
        }
        let now = self.cycle_from();
        for (_, (number, pos)) in self.by_use.range(before..now) {
            if let Some(cache) = self.caches.get_mut(number)
                && let Some((tile, _)) = cache.tiles.get(pos)
            {
                cache.used_bytes -= cost(tile);
                self.used_bytes -= cost(tile);
            }
        }
        while let Some(taken) = self.taken.pop_front_if(|taken| taken.last_use < now) {
            if let Some(taker) = self.caches.get_mut(&taken.taker) {
                taker.taken_bytes -= taken.cost;
            }
            if let Some(owner) = self.caches.get_mut(&taken.owner)
                && owner.lost.get(&taken.pos).is_some_and(|(last_use, _)| *last_use == taken.last_use)
            {
                owner.lost.remove(&taken.pos);
                owner.used_bytes -= taken.cost;
                self.used_bytes -= taken.cost;
            }
        }
    }

    /// The first use of the last jitter cycle.
    fn cycle_from(&self) -> u64 {
        self.frames.front().copied().unwrap_or(0)
    }

    /// Makes room for a tile of a cache, oldest use first; returns true if there is room now.
    fn make_room(&mut self, number: u64, cost: u64) -> bool {
        if cost > self.budget {
            return false;
        }
        while self.bytes + cost > self.budget {
            let Some((&last_use, &(owner, pos))) = self.by_use.first_key_value() else { return false };
            if owner == number || last_use < self.cycle_from() {
                self.evict(owner, pos);
            } else if self.may_take(number, owner, pos) {
                self.take(number, owner, pos);
            } else {
                let own = self.caches.get(&number).and_then(|cache| cache.by_use.first_key_value());
                let Some((_, &pos)) = own else { return false };
                self.evict(number, pos);
            }
        }
        true
    }

    /// Returns true if a cache, with this tile, has taken at most half of what others used in the last jitter
    /// cycle.
    fn may_take(&self, taker: u64, owner: u64, pos: PagePos) -> bool {
        let Some((tile, _)) = self.caches.get(&owner).and_then(|owner| owner.tiles.get(&pos)) else {
            return false;
        };
        let Some(taker) = self.caches.get(&taker) else { return false };
        2 * (taker.taken_bytes + cost(tile)) <= self.used_bytes - taker.used_bytes
    }

    /// Evicts a tile of the last jitter cycle for another cache.
    fn take(&mut self, taker: u64, owner: u64, pos: PagePos) {
        let Some((cost, last_use)) = self.evict(owner, pos) else { return };
        if let Some(taker) = self.caches.get_mut(&taker) {
            taker.taken_bytes += cost;
        }
        if let Some(owner) = self.caches.get_mut(&owner) {
            owner.lost.insert(pos, (last_use, cost));
            owner.used_bytes += cost;
            self.used_bytes += cost;
        }
        self.taken.push_back(Taken { last_use, cost, taker, owner, pos });
    }

    /// Removes a tile for want of room; its cost and its last use.
    fn evict(&mut self, number: u64, pos: PagePos) -> Option<(u64, u64)> {
        let removed = self.remove(number, pos)?;
        if let Some(cache) = self.caches.get_mut(&number) {
            cache.stats.evictions += 1;
        }
        Some(removed)
    }

    /// Removes a tile, if it is kept; its cost and its last use.
    fn remove(&mut self, number: u64, pos: PagePos) -> Option<(u64, u64)> {
        let cycle_from = self.cycle_from();
        let cache = self.caches.get_mut(&number)?;
        let (tile, last_use) = cache.tiles.remove(&pos)?;
        let cost = cost(&tile);
        cache.by_use.remove(&last_use);
        self.by_use.remove(&last_use);
        cache.stats.bytes -= cost;
        cache.stats.tiles -= 1;
        self.bytes -= cost;
        if last_use >= cycle_from {
            cache.used_bytes -= cost;
            self.used_bytes -= cost;
        }
        Some((cost, last_use))
    }

    /// Checks that all figures are what the tiles come to.
    #[cfg(test)]
    pub(super) fn check(&self) {
        let (from, mut all, mut used) = (self.cycle_from(), 0, 0);
        for (number, cache) in &self.caches {
            let held: u64 = cache.tiles.values().map(|(tile, _)| cost(tile)).sum();
            assert_eq!((cache.stats.bytes, cache.stats.tiles as usize), (held, cache.tiles.len()));
            assert_eq!(cache.by_use.len(), cache.tiles.len());
            assert!(
                cache.tiles.iter().all(|(&pos, (_, last))| self.by_use.get(last) == Some(&(*number, pos)))
            );
            let recent = cache.tiles.values().filter(|(_, last)| *last >= from);
            assert!(
                cache.lost.iter().all(|(pos, (last, _))| *last >= from && !cache.tiles.contains_key(pos))
            );
            let lost = cache.lost.values().map(|(_, cost)| cost);
            let sum = recent.map(|(tile, _)| cost(tile)).sum::<u64>() + lost.sum::<u64>();
            assert_eq!(cache.used_bytes, sum, "used in the last cycle");
            let taken = self.taken.iter().filter(|taken| taken.taker == *number).map(|taken| taken.cost);
            assert_eq!(cache.taken_bytes, taken.sum::<u64>());
            (all, used) = (all + held, used + sum);
        }
        assert!(self.taken.iter().all(|taken| taken.last_use >= from));
        assert_eq!((self.bytes, self.used_bytes), (all, used));
        assert!(self.bytes <= self.budget);
    }
}

fn cost(tile: &Tile) -> u64 {
    tile.bytes.len() as u64 + ENTRY_BYTES
}
