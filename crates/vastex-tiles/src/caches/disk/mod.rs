//! The disk tier: encoded tiles of slow sources, kept in a directory beyond the end of the program.
//!
//! It is meant for sources that are slower than a local disk: other media, network file systems, tiles that
//! must be computed. A [`DiskTier`] is one directory with one budget; any number of sources share it, each
//! behind its own [`DiskCache`].
//!
//! The contract:
//!
//! - **No wrong byte.** An entry is served only if head and tile have their checksums and the head names this
//!   source and this page. A damaged entry is dropped and its tile read from the source anew.
//! - **No other source's byte.** An entry belongs to a [`SourceKey`] and a description. A source that has no
//!   [`TileSource::identity`] needs a key from the caller, who must see to it that the key changes when the
//!   tiles do.
//! - **No old byte.** When a source says that a region has changed, no entry of the region is served or
//!   stored any more in this run; in the next run the source has another key.
//! - **The budget** holds at every instant: it counts the lengths of all files, and room is made before
//!   anything is written. Entries that were read since they were written are dropped last.
//! - **A crash** at any moment loses at most the entry that was being written, and nothing must be repaired.
//!   Files are not synced to the disk, so that a loss of power may cost more entries, none of which is
//!   served.
//! - **A failure** of the disk (full, read-only, gone) is counted and logged once, and never an error of a
//!   read: the source answers. After a failed write the next tiles are left out, 64 at first and twice as
//!   many each time; on a disk that is full, older tiles give way first.
//! - **One process** has a directory at a time; a second one is refused when it opens the directory. A file
//!   system without locks keeps nobody out: two processes then cost each other entries and exceed the budget,
//!   but get no wrong byte.
//! - **Delivered first, stored after.** A read ends when the source's read ends; a thread of the tier checks,
//!   writes and makes room, and no read waits for that. Up to 16 MiB of tiles wait to be stored; if the disk
//!   is slower than that, tiles are not stored and counted as `skipped`. [`DiskTier::flush`] waits for the
//!   tiles that wait; dropping the tier does so for up to two seconds.
//!
//! A hit costs a look-up, a read and a checksum on the thread that reads. A miss costs the source's read and
//! the handing over, and on the tier's thread a decode and a write. Memory: about 250 bytes a tile, and the
//! tiles that wait. `segment` and `entry` describe the files, `shelf` makes room, `write_queue` writes.

mod entry;
mod index;
mod medium;
mod segment;
mod shelf;
#[cfg(test)]
mod tests;
mod write_queue;

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use vastex_core::{Description, PagePos, Region};

use crate::container::description_bytes;
use crate::ground::hash::content_hash;
use crate::ground::sync::lock;
use crate::sources::{ReadFuture, SourceKey, TierStats, Tiers, TileSource};
use crate::tile::Tile;
use entry::EntryKey;
use index::{Index, Location};
use medium::{Directory, Medium};
use shelf::Shelf;
use write_queue::{Delivered, MOST_WAITING, WriteQueue};

/// The file by which processes keep each other out. It stays empty.
const LOCK: &str = "vastex.lock";
/// How long a tier that is dropped waits for what is still to be kept.
const LAST_WAIT: Duration = Duration::from_secs(2);
/// Regions that are remembered as changed; with more, all of a source counts as changed.
const MOST_REGIONS: usize = 64;

/// Why a directory cannot be a disk cache.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DiskTierError {
    /// Another process has the directory.
    #[error(
        "{directory}: is in use as a disk cache; wait until the other program ends, or name another directory"
    )]
    InUse {
        /// The directory.
        directory: String,
    },
    /// The directory cannot be written or read.
    #[error("{directory}: cannot be a disk cache: {error}; name another directory, or remove this one")]
    Unusable {
        /// The directory.
        directory: String,
        /// What the system said.
        error: String,
    },
}

/// A directory that holds tiles of any number of sources within a budget of bytes. Each source stands behind
/// its own [`DiskCache`].
///
/// The tier owns the files `vastex.lock`, `*.tiles` and `*.heads` of the directory and touches no others. A
/// thread of the tier writes them. Dropping the tier waits until all tiles that were read are stored, but no
/// longer than two seconds: a disk that does not answer then keeps the thread and the directory until it
/// does.
pub struct DiskTier {
    name: String,
    index: Arc<Mutex<Index>>,
    queue: Arc<WriteQueue>,
}

impl DiskTier {
    /// Opens a directory, or makes it, and takes up what earlier runs left there, up to `budget` bytes.
    ///
    /// Reads 64 bytes for each tile. Fails if another process has the directory, or if it cannot be written;
    /// an application then does without a disk cache.
    pub fn open(directory: impl AsRef<Path>, budget: u64) -> Result<DiskTier, DiskTierError> {
        let path = directory.as_ref();
        let directory = path.display().to_string();
        let unusable = |error: io::Error| DiskTierError::Unusable {
            directory: directory.clone(),
            error: error.to_string(),
        };
        let lock = lock_directory(path).map_err(unusable)?;
        let lock = lock.ok_or_else(|| DiskTierError::InUse { directory: directory.clone() })?;
        let medium = Box::new(Directory(PathBuf::from(path)));
        DiskTier::on(medium, directory.clone(), budget, Some(lock), MOST_WAITING).map_err(unusable)
    }

    /// A tier on any medium, with at most `most_waiting` bytes waiting to be stored.
    fn on(
        medium: Box<dyn Medium>,
        name: String,
        budget: u64,
        lock: Option<File>,
        most_waiting: u64,
    ) -> io::Result<DiskTier> {
        let index = Arc::<Mutex<Index>>::default();
        let shelf = Shelf::open(medium, budget, &index)?;
        let queue = WriteQueue::start(name.clone(), index.clone(), shelf, lock, most_waiting)?;
        Ok(DiskTier { name, index, queue })
    }

    /// Waits until every tile that was read so far is stored, at most for `most`. Returns true if all are;
    /// the others are stored later.
    pub fn flush(&self, most: Duration) -> bool {
        self.queue.flush(most)
    }

    /// What the tier has done in this run for all sources, and what it holds: the bytes are the lengths of
    /// its files. Never waits for the disk.
    pub fn stats(&self) -> TierStats {
        lock(&self.index).total()
    }

    /// The tile of an entry, or `None` if there is no sound one.
    fn find(&self, key: &EntryKey) -> Option<Tile> {
        let location = lock(&self.index).find(key);
        // Read without the lock: others go on meanwhile.
        let tile = location.as_ref().map(Location::read);
        let mut index = lock(&self.index);
        match (tile, location) {
            (Some(Ok(tile)), _) => {
                index.count(key, |stats| {
                    stats.hits += 1;
                    stats.bytes_read += tile.bytes.len() as u64;
                });
                return Some(tile);
            }
            (Some(Err(why)), Some(location)) => {
                index.drop_damaged(&location);
                index.count(key, |stats| stats.failures += 1);
                let (name, pos) = (&self.name, key.pos);
                tracing::info!("{name}: {pos}: {why}; it is read from the source anew");
            }
            _ => {}
        }
        index.count(key, |stats| stats.misses += 1);
        None
    }
}

impl Drop for DiskTier {
    fn drop(&mut self) {
        self.queue.stop(LAST_WAIT);
    }
}

impl std::fmt::Debug for DiskTier {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DiskTier")
            .field("name", &self.name)
            .field("stats", &self.stats())
            .finish_non_exhaustive()
    }
}

/// Makes the directory if need be and locks it; `None` if another process has it.
fn lock_directory(directory: &Path) -> io::Result<Option<File>> {
    fs::create_dir_all(directory)?;
    let file = OpenOptions::new().write(true).create(true).truncate(false).open(directory.join(LOCK))?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Ok(None),
        // A file system without locks keeps nobody out.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(Some(file)),
    }
}

/// A decorator that keeps the tiles of a source in a [`DiskTier`], and so beyond the end of the program.
///
/// A tile that does not decode is handed on but not stored, so that the next read may fare better; errors are
/// not stored.
pub struct DiskCache<S> {
    source: S,
    tier: Arc<DiskTier>,
    /// The hash of the source's key and description, under which its entries are filed.
    entries_of: u128,
    /// Regions that have changed in this run: their entries are older than the change.
    changed: Arc<Mutex<Vec<Region>>>,
}

impl<S: TileSource> DiskCache<S> {
    /// Puts a cache before `source`, in `tier`.
    ///
    /// `key` is the source's [`TileSource::identity`] if it has one, else a key that the caller vouches for:
    /// under the same key and the same description the tiles must be the same in every run.
    pub fn new(source: S, tier: Arc<DiskTier>, key: SourceKey) -> DiskCache<S> {
        let mut bytes = key.to_bits().to_le_bytes().to_vec();
        bytes.extend(description_bytes(source.description()));
        DiskCache { entries_of: content_hash(&bytes), source, tier, changed: Arc::default() }
    }

    /// Returns true if the entries of a page may be older than a change.
    fn has_changed(&self, pos: PagePos) -> bool {
        let geometry = &self.description().geometry;
        lock(&self.changed).iter().any(|region| region.concerns(geometry, pos))
    }

    /// What the tier has done for this source, and what it holds of it: a tile counts 64 bytes in addition to
    /// its own.
    pub fn stats(&self) -> TierStats {
        lock(&self.tier.index).of_source(self.entries_of)
    }
}

impl<S: TileSource> TileSource for DiskCache<S> {
    fn behind(&self) -> Option<&dyn TileSource> {
        Some(&self.source)
    }

    fn description(&self) -> &Arc<Description> {
        self.source.description()
    }

    fn add_tiers(&self, tiers: &mut Tiers) {
        tiers.disk += self.stats();
        self.source.add_tiers(tiers);
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            let key = EntryKey { source: self.entries_of, pos };
            if self.has_changed(pos) {
                return self.source.read(pos).await;
            }
            if let Some(tile) = self.tier.find(&key) {
                return Ok(tile);
            }
            let tile = self.source.read(pos).await?;
            // It may have changed while it was read, and may yet before it is kept.
            if !self.has_changed(pos) {
                let (tile, description) = (tile.clone(), self.source.description().clone());
                let changed = self.changed.clone();
                self.tier.queue.hand_over(Delivered { key, tile, description, changed });
            }
            Ok(tile)
        })
    }

    fn changed(&self, region: &Region) {
        {
            let mut changed = lock(&self.changed);
            if changed.len() == MOST_REGIONS {
                *changed = vec![Region::whole()];
            }
            changed.push(region.clone());
        }
        // After that, so that what is read of before is never kept.
        self.source.changed(region);
    }
}
