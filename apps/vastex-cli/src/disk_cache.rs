//! The disk cache of `render` and `view`. Where it cannot be had, they do without and say so.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;
use vastex::TileSource;
use vastex_tiles::{DiskCache, DiskTier, TierStats};

use crate::args::DiskCacheArgs;
use crate::report;

/// The source of `path`, behind the cache that was asked for; and that cache, where it can be had.
pub(crate) fn before(
    tiles: Arc<dyn TileSource>,
    path: &Path,
    args: &DiskCacheArgs,
) -> (Arc<dyn TileSource>, Option<Arc<DiskTier>>) {
    let Some(directory) = &args.disk_cache else { return (tiles, None) };
    let Some(key) = tiles.identity() else {
        let path = path.display();
        report::say(&format!("note: {path}: not kept on disk: the dates of its files cannot be read"));
        return (tiles, None);
    };
    match DiskTier::open(directory, args.disk_cache_mib << 20) {
        Ok(tier) => {
            let tier = Arc::new(tier);
            (Arc::new(DiskCache::new(tiles, tier.clone(), key)), Some(tier))
        }
        Err(error) => {
            report::say(&format!("note: {error}; nothing is kept on disk in this run"));
            (tiles, None)
        }
    }
}

/// What `--json` says of the cache. Scripts rely on these names.
#[derive(Serialize)]
pub(crate) struct Summary {
    hits: u64,
    misses: u64,
    evictions: u64,
    failures: u64,
    /// Not kept since the disk was slower than what was read.
    skipped: u64,
    tiles: u64,
    /// Of all its files.
    bytes: u64,
    bytes_read: u64,
    bytes_written: u64,
}

impl Summary {
    pub(crate) fn new(tier: &DiskTier) -> Summary {
        // So that what is told is what a later run finds. A disk that takes longer is not waited for.
        tier.flush(Duration::from_secs(2));
        let TierStats { hits, misses, evictions, failures, skipped, tiles, bytes, bytes_read, bytes_written } =
            tier.stats();
        Summary { hits, misses, evictions, failures, skipped, tiles, bytes, bytes_read, bytes_written }
    }

    pub(crate) fn text(&self) -> String {
        let Summary { hits, misses, evictions, failures, tiles, .. } = self;
        let bytes = report::bytes(self.bytes);
        let reads = hits + misses;
        let mut text =
            format!("disk cache: {hits} of {reads} reads, {evictions} evicted; holds {tiles} tiles, {bytes}");
        if *failures > 0 {
            text += &format!("; {failures} failures");
        }
        if self.skipped > 0 {
            text += &format!("; {} not kept, since the disk is slower than the source", self.skipped);
        }
        text
    }
}
