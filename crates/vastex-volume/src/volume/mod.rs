//! A volume: what it says of itself, and its levels, channels and times as arrays of chunks.

mod about;
mod assembly;
mod boxes;
mod bricks;
mod cache;
mod crop;
mod gather;
mod region;

use std::sync::{Arc, Mutex, PoisonError};

use rustc_hash::FxHashMap;
use vastex_tiles::StoreStats;

use crate::chunks::{ChunkSource, Grid, Presence};
use crate::spare::Spare;
use crate::values::DType;
pub use about::{Convention, VolumeAbout, VolumeChannel, VolumeLevel};
pub use assembly::{Brick, BrickLayout, BrickPos, BrickWork};
pub(crate) use boxes::{BoxValues, Plane, Shared, VoxelBox, filled, paste};
pub use bricks::{BRICK, BrickCount};
pub(crate) use cache::ChunkCache;
pub use cache::ChunkWork;
pub use crop::{VolumeCropError, crop};
pub use region::VolumeRegion;

/// Bytes of decoded chunks that are kept, and of boxes beside them.
const MOST_KEPT: usize = 256 << 20;
/// Bytes of levels that are made and not stored which are kept: of coarse ones, and of finer ones.
pub(crate) const COARSE_MADE_KEPT: usize = 192 << 20;
const FINE_MADE_KEPT: usize = 64 << 20;

/// One level as it is stored.
pub(crate) struct LevelArray {
    pub(crate) dtype: DType,
    pub(crate) grid: Grid,
    pub(crate) source: Arc<dyn ChunkSource>,
}

/// A volume, opened. Its levels are read where they lie; shared by threads.
pub struct Volume {
    about: VolumeAbout,
    arrays: Vec<LevelArray>,
    cache: ChunkCache,
    /// Boxes of which many bricks are cut, where chunks are large.
    boxes: ChunkCache,
    /// Chunks of levels that are made: of coarse ones, and of finer ones.
    made: [ChunkCache; 2],
    /// Memory of bricks.
    spare: Arc<Spare>,
    /// What was told of reads.
    told: Mutex<StoreStats>,
    /// Which chunks are stored, of levels that were asked about.
    presence: Mutex<FxHashMap<usize, Arc<Presence>>>,
}

impl std::fmt::Debug for Volume {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Volume").field("about", &self.about).finish_non_exhaustive()
    }
}

impl Volume {
    /// Of levels, the finest first, as many as `about` has, at least one.
    pub(crate) fn new(about: VolumeAbout, arrays: Vec<LevelArray>) -> Volume {
        debug_assert_eq!(about.levels.len(), arrays.len());
        Volume {
            about,
            arrays,
            cache: ChunkCache::new(MOST_KEPT),
            boxes: ChunkCache::new(MOST_KEPT),
            made: [COARSE_MADE_KEPT, FINE_MADE_KEPT].map(ChunkCache::new),
            spare: Arc::default(),
            told: Mutex::default(),
            presence: Mutex::default(),
        }
    }

    /// How many chunks were read and decoded since it was opened, and how often one was shared.
    pub fn chunk_work(&self) -> ChunkWork {
        self.cache.work()
    }

    /// Keeps up to so many bytes of decoded chunks for later reads from now on, and as much of boxes beside
    /// them where chunks are large; 256 MiB each unless this is called. What is more goes at once. Where less
    /// is kept than a brick wants chunks, each is decoded again for every brick.
    pub fn keep_at_most(&self, bytes: usize) {
        self.cache.keep_at_most(bytes);
        self.boxes.keep_at_most(bytes);
    }

    /// What was read of the store since this was last asked, so that sources that share the volume tell each
    /// read once between them.
    pub(crate) fn take_reads(&self) -> StoreStats {
        let work = self.cache.work();
        let now = StoreStats { reads: work.decoded, bytes: work.bytes_read };
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let before = std::mem::replace(&mut *told, now);
        StoreStats {
            reads: now.reads.saturating_sub(before.reads),
            bytes: now.bytes.saturating_sub(before.bytes),
        }
    }

    /// What keeps chunks of levels that are made, for all channels and times: of coarse ones, and of finer
    /// ones.
    pub(crate) fn made(&self) -> &[ChunkCache; 2] {
        &self.made
    }

    /// Memory for bricks, which comes back.
    pub(crate) fn spare(&self) -> &Arc<Spare> {
        &self.spare
    }

    /// Which chunks of a level that exists are stored, as far as `most` keys tell: listed once, and kept.
    pub(crate) async fn stored_chunks(&self, level: usize, most: usize) -> Arc<Presence> {
        let kept = || self.presence.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = kept().get(&level) {
            return found.clone();
        }
        match self.arrays[level].source.presence(most).await {
            Ok(found) => kept().entry(level).or_insert(Arc::new(found)).clone(),
            // A listing that fails tells nothing; reading will say what is wrong.
            Err(_) => Arc::new(Presence::Unknown),
        }
    }

    /// The value of voxels of the finest level that nothing is stored of: the bytes of one value,
    /// little-endian.
    pub fn fill(&self) -> Vec<u8> {
        self.arrays[0].source.fill()[..self.about.dtype.bytes()].to_vec()
    }

    /// What is known of it without reading its values.
    pub fn about(&self) -> &VolumeAbout {
        &self.about
    }
}
