//! The RAM tier: encoded tiles of a source, kept within a budget of bytes that several sources may share.

mod budget;
mod kept;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use vastex_core::{Description, PagePos, Region};

use crate::ground::sync::lock;
use crate::sources::{ReadFuture, TierStats, Tiers, TileSource};
use crate::tile::Tile;
pub use budget::RamBudget;

/// A decorator that keeps the most recently used tiles of a source in memory, still encoded, within a budget
/// of bytes that holds at every instant.
///
/// A hit costs a look-up under the lock of the budget. A tile larger than the whole budget is passed through;
/// errors are not kept. Dropping the cache gives its part of the budget back.
pub struct RamCache<S> {
    source: S,
    budget: Arc<RamBudget>,
    /// The number of this cache within the budget.
    number: u64,
}

impl<S> RamCache<S> {
    /// Puts a cache of at most `bytes` before `source`.
    pub fn new(source: S, bytes: u64) -> RamCache<S> {
        RamCache::within(source, RamBudget::new(bytes))
    }

    /// Puts a cache before `source` that shares a budget with the other caches of that budget.
    pub fn within(source: S, budget: Arc<RamBudget>) -> RamCache<S> {
        let number = lock(&budget.kept).add_cache();
        RamCache { source, budget, number }
    }

    /// What the cache has done so far, and what it holds; each tile counts 128 bytes in addition to its own.
    pub fn stats(&self) -> TierStats {
        lock(&self.budget.kept).stats(self.number)
    }
}

impl<S> Drop for RamCache<S> {
    fn drop(&mut self) {
        lock(&self.budget.kept).remove_cache(self.number);
    }
}

impl<S: TileSource> TileSource for RamCache<S> {
    fn behind(&self) -> Option<&dyn TileSource> {
        Some(&self.source)
    }

    fn description(&self) -> &Arc<Description> {
        self.source.description()
    }

    fn add_tiers(&self, tiers: &mut Tiers) {
        tiers.ram += self.stats();
        self.source.add_tiers(tiers);
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            let changes = {
                let mut kept = lock(&self.budget.kept);
                if let Some(tile) = kept.get(self.number, pos) {
                    return Ok(tile);
                }
                kept.changes(self.number)
            };
            let tile = self.source.read(pos).await?;
            let mut kept = lock(&self.budget.kept);
            // What was read while something changed may be of before.
            if kept.changes(self.number) == changes {
                kept.insert(self.number, pos, tile.clone());
            }
            Ok(tile)
        })
    }

    fn at_hand(&self, pos: PagePos) -> Option<Tile> {
        let kept = lock(&self.budget.kept).peek(self.number, pos);
        kept.or_else(|| self.source.at_hand(pos))
    }

    fn changed(&self, region: &Region) {
        // The source first, so that nothing old is read between the two.
        self.source.changed(region);
        let geometry = &self.description().geometry;
        lock(&self.budget.kept).drop_changed(self.number, |pos| region.concerns(geometry, pos));
    }
}
