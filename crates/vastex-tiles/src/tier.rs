//! What a tier counts: the same figures for the RAM cache and the disk cache, so that they can stand side by side.

use std::ops::{Add, AddAssign};

/// What a tier has done so far, and what it holds. Those of several tiers add up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TierStats {
    /// Reads answered from the tier.
    pub hits: u64,
    /// Reads passed on to the source.
    pub misses: u64,
    /// Tiles given up for others.
    pub evictions: u64,
    /// Times that the tier could not keep a tile, or could not give one that it had kept. Always 0 in memory.
    pub failures: u64,
    /// Tiles held.
    pub tiles: u64,
    /// Bytes held, what keeping them costs included; never more than the budget.
    pub bytes: u64,
    /// Encoded bytes of the tiles that were answered from the tier.
    pub bytes_read: u64,
    /// Encoded bytes of the tiles that were put into the tier.
    pub bytes_written: u64,
}

impl TierStats {
    /// The share of the reads that the tier answered, 0 to 1; 0 where there were none.
    pub fn hit_share(&self) -> f64 {
        self.hits as f64 / (self.hits + self.misses).max(1) as f64
    }
}

impl AddAssign for TierStats {
    fn add_assign(&mut self, other: TierStats) {
        let TierStats { hits, misses, evictions, failures, tiles, bytes, bytes_read, bytes_written } = other;
        self.hits += hits;
        self.misses += misses;
        self.evictions += evictions;
        self.failures += failures;
        self.tiles += tiles;
        self.bytes += bytes;
        self.bytes_read += bytes_read;
        self.bytes_written += bytes_written;
    }
}

impl Add for TierStats {
    type Output = TierStats;

    fn add(mut self, other: TierStats) -> TierStats {
        self += other;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiers_add_up() {
        let one = TierStats { hits: 3, misses: 1, bytes: 50, ..TierStats::default() };
        let other = TierStats { misses: 4, evictions: 2, bytes_read: 9, ..TierStats::default() };
        let both =
            TierStats { hits: 3, misses: 5, evictions: 2, bytes: 50, bytes_read: 9, ..TierStats::default() };
        assert_eq!(one + other, both);
        assert_eq!([one, both, TierStats::default()].map(|stats| stats.hit_share()), [0.75, 0.375, 0.0]);
    }
}
