//! What caches and stores count. The RAM cache and the disk cache count the same figures, so that they can
//! stand side by side; a store counts fewer.
//!
//! Each source adds its figures to [`Tiers`] and hands on to the source behind it: see
//! [`TileSource::add_tiers`](crate::TileSource::add_tiers).

use std::ops::{Add, AddAssign};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// What a tier (a cache) has done so far, and what it holds. The figures of several tiers add up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TierStats {
    /// Reads that the tier answered.
    pub hits: u64,
    /// Reads that the tier passed on to its source.
    pub misses: u64,
    /// Tiles that were dropped to make room for others.
    pub evictions: u64,
    /// Times that the tier could not store a tile, or could not give a tile that it had stored. Always 0 in
    /// memory.
    pub failures: u64,
    /// Tiles that were not stored because too many were waiting to be: the tier is slower than its source.
    /// Always 0 in memory.
    pub skipped: u64,
    /// Tiles that the tier holds.
    pub tiles: u64,
    /// Bytes that the tier holds, the cost of keeping tiles included; never more than the budget.
    pub bytes: u64,
    /// Encoded bytes of the tiles that the tier answered with.
    pub bytes_read: u64,
    /// Encoded bytes of the tiles that were put into the tier.
    pub bytes_written: u64,
}

impl TierStats {
    /// The share of the reads that the tier answered, 0 to 1; 0 if there were none.
    pub fn hit_share(&self) -> f64 {
        self.hits as f64 / (self.hits + self.misses).max(1) as f64
    }
}

/// What the tiers behind GPU memory have done so far, and what they hold.
///
/// Threads count while they read, so that two runs that show the same may count a read in different frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tiers {
    /// Encoded tiles in main memory.
    pub ram: TierStats,
    /// Tiles of slow sources on a disk.
    pub disk: TierStats,
    /// What was read of the stores from which tiles come.
    pub store: StoreStats,
    /// What was decoded of which tiles are put together.
    pub chunks: ChunkStats,
}

/// What has been read of stores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StoreStats {
    /// Reads of tiles, or of the files from which tiles are put together. A tile that was kept when its
    /// source was opened needs none.
    pub reads: u64,
    /// Bytes that these reads brought.
    pub bytes: u64,
}

/// Chunks of which tiles are put together, each decoded for all tiles that want a part of it: those of a
/// volume. Sources whose tiles are decoded one by one have none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChunkStats {
    /// Chunks that were read and decoded.
    pub decoded: u64,
    /// Bytes that these had, decoded.
    pub bytes_decoded: u64,
    /// How often a chunk was delivered without decoding it again: it was kept, or another read was decoding
    /// it.
    pub shared: u64,
    /// Bytes of decoded chunks that are kept for other tiles.
    pub bytes: u64,
}

impl Tiers {
    /// The figures since `earlier`: what was done since then, and what is held now.
    pub fn since(self, earlier: &Tiers) -> Tiers {
        Tiers {
            ram: self.ram.since(&earlier.ram),
            disk: self.disk.since(&earlier.disk),
            store: StoreStats {
                reads: self.store.reads.saturating_sub(earlier.store.reads),
                bytes: self.store.bytes.saturating_sub(earlier.store.bytes),
            },
            chunks: self.chunks.since(&earlier.chunks),
        }
    }

    /// What was done, without what is held: the figures of a source that is gone.
    pub fn done(mut self) -> Tiers {
        for tier in [&mut self.ram, &mut self.disk] {
            (tier.tiles, tier.bytes) = (0, 0);
        }
        self.chunks.bytes = 0;
        self
    }
}

impl ChunkStats {
    /// The figures since `earlier`: what was done since then, and what is kept now.
    pub fn since(self, earlier: &ChunkStats) -> ChunkStats {
        ChunkStats {
            decoded: self.decoded.saturating_sub(earlier.decoded),
            bytes_decoded: self.bytes_decoded.saturating_sub(earlier.bytes_decoded),
            shared: self.shared.saturating_sub(earlier.shared),
            bytes: self.bytes,
        }
    }
}

impl TierStats {
    fn since(self, earlier: &TierStats) -> TierStats {
        TierStats {
            hits: self.hits.saturating_sub(earlier.hits),
            misses: self.misses.saturating_sub(earlier.misses),
            evictions: self.evictions.saturating_sub(earlier.evictions),
            failures: self.failures.saturating_sub(earlier.failures),
            skipped: self.skipped.saturating_sub(earlier.skipped),
            tiles: self.tiles,
            bytes: self.bytes,
            bytes_read: self.bytes_read.saturating_sub(earlier.bytes_read),
            bytes_written: self.bytes_written.saturating_sub(earlier.bytes_written),
        }
    }
}

impl AddAssign for Tiers {
    fn add_assign(&mut self, other: Tiers) {
        self.ram += other.ram;
        self.disk += other.disk;
        self.store += other.store;
        self.chunks += other.chunks;
    }
}

impl AddAssign for ChunkStats {
    fn add_assign(&mut self, other: ChunkStats) {
        let ChunkStats { decoded, bytes_decoded, shared, bytes } = other;
        self.decoded += decoded;
        self.bytes_decoded += bytes_decoded;
        self.shared += shared;
        self.bytes += bytes;
    }
}

impl AddAssign for StoreStats {
    fn add_assign(&mut self, other: StoreStats) {
        self.reads += other.reads;
        self.bytes += other.bytes;
    }
}

/// Counts what a source reads of its store, on whichever thread.
#[derive(Debug, Default)]
pub struct StoreCounter {
    reads: AtomicU64,
    bytes: AtomicU64,
}

impl StoreCounter {
    /// Counts a read that brought so many bytes.
    pub fn note(&self, bytes: u64) {
        self.reads.fetch_add(1, Relaxed);
        self.bytes.fetch_add(bytes, Relaxed);
    }

    /// All reads so far.
    pub fn stats(&self) -> StoreStats {
        StoreStats { reads: self.reads.load(Relaxed), bytes: self.bytes.load(Relaxed) }
    }
}

impl AddAssign for TierStats {
    fn add_assign(&mut self, other: TierStats) {
        let TierStats { hits, misses, evictions, failures, skipped, tiles, bytes, bytes_read, bytes_written } =
            other;
        self.skipped += skipped;
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

    #[test]
    fn what_was_done_since_is_a_difference_and_what_is_held_is_not() {
        let counter = StoreCounter::default();
        counter.note(70);
        let ram = TierStats { hits: 3, misses: 1, tiles: 2, bytes: 50, ..TierStats::default() };
        let chunks = ChunkStats { decoded: 2, bytes_decoded: 30, shared: 5, bytes: 20 };
        let mut now = Tiers { ram, store: counter.stats(), chunks, ..Tiers::default() };
        let earlier = now;
        now += Tiers { ram: TierStats { hits: 4, bytes: 9, ..TierStats::default() }, ..Tiers::default() };
        counter.note(5);
        now.store = counter.stats();
        now.chunks += ChunkStats { decoded: 1, bytes_decoded: 7, shared: 2, bytes: 7 };
        let since = now.since(&earlier);
        assert_eq!(since.chunks, ChunkStats { decoded: 1, bytes_decoded: 7, shared: 2, bytes: 27 });
        assert_eq!(now.done().chunks, ChunkStats { decoded: 3, bytes_decoded: 37, shared: 7, bytes: 0 });
        let expected = TierStats { hits: 4, tiles: 2, bytes: 59, ..TierStats::default() };
        assert_eq!((since.ram, since.store), (expected, StoreStats { reads: 1, bytes: 5 }));
        assert_eq!(now.done().ram, TierStats { hits: 7, misses: 1, ..TierStats::default() });
        assert_eq!(now.done().since(&now).ram, TierStats::default(), "a source that is gone undoes nothing");
    }
}
