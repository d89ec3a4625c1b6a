//! Disk caches: what every test of them shares. Each file asks one question of the contract at the head of
//! `disk`.

mod budget;
mod changes;
mod damage;
mod directory;
mod memory_disk;
mod random;
mod slow;
mod troubles;

use std::sync::Arc;
use std::time::Duration;

use pollster::block_on;
use vastex_core::{Geometry, GeometrySpec, PagePos};

use crate::caches::disk::entry::HEAD_BYTES;
use crate::caches::disk::write_queue::MOST_WAITING;
use crate::caches::disk::{DiskCache, DiskTier, lock};
use crate::sources::PropertySource;
use crate::sources::{SourceKey, TileSource};
use crate::testing::{Faults, Injection};
use memory_disk::MemoryDisk;

/// Bytes of an entry: a tile of 10x10 texels and its head.
const ENTRY: u64 = 400 + HEAD_BYTES as u64;

/// Tiles of 400 bytes, no two alike.
fn source() -> PropertySource {
    let spec = GeometrySpec { page: 8, border: 1, ..GeometrySpec::image(100, 100) };
    PropertySource::new(Geometry::new(spec).unwrap())
}

/// The `n`th page of level 0, which has 169.
fn page(n: u32) -> PagePos {
    PagePos::new_2d(0, n % 13, n / 13)
}

fn key() -> SourceKey {
    SourceKey::of("tests")
}

fn open(disk: &MemoryDisk, budget: u64) -> Arc<DiskTier> {
    open_with(disk, budget, MOST_WAITING)
}

fn open_with(disk: &MemoryDisk, budget: u64, most_waiting: u64) -> Arc<DiskTier> {
    Arc::new(DiskTier::on(Box::new(disk.clone()), "memory".into(), budget, None, most_waiting).unwrap())
}

/// Waits until all that was read is kept.
fn flush(tier: &DiskTier) {
    assert!(tier.flush(DEADLINE), "nothing is kept in {DEADLINE:?}");
}

/// What takes longer than this never comes.
const DEADLINE: Duration = Duration::from_secs(120);

/// A source that counts its reads, behind a cache.
type Counted = DiskCache<Arc<Faults<PropertySource, fn(PagePos, u32) -> Option<Injection>>>>;

fn cached(tier: &Arc<DiskTier>) -> Counted {
    let counting: fn(PagePos, u32) -> Option<Injection> = |_, _| None;
    DiskCache::new(Arc::new(Faults::new(source(), counting)), tier.clone(), key())
}

/// Reads a page, compares it and lets it be kept; returns true if the tier had it.
fn read(cache: &Counted, pos: PagePos) -> bool {
    let before = cache.tier.stats();
    let tile = block_on(cache.read(pos)).unwrap();
    assert_eq!(tile, block_on(source().read(pos)).unwrap(), "{pos}");
    flush(&cache.tier);
    let after = cache.tier.stats();
    assert_eq!(after.hits + after.misses, before.hits + before.misses + 1);
    after.hits > before.hits
}

/// Reads pages one after the other; how many the tier had.
fn hits(cache: &Counted, pages: impl IntoIterator<Item = u32>) -> usize {
    pages.into_iter().filter(|&n| read(cache, page(n))).count()
}
