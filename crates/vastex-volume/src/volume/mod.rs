//! A volume: what it says of itself, and its levels, channels and times as arrays of chunks.

mod about;
mod assembly;
mod boxes;
mod bricks;
mod cache;
mod crop;
mod gate;
mod gather;
mod last_used;
mod region;
mod told;
mod within;

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use rustc_hash::FxHashMap;

use crate::chunks::{ChunkSource, Grid, Presence};
use crate::fault::{VolumeError, VolumeFault};
use crate::spare::Spare;
use crate::stored::StoredChunks;
use crate::values::DType;
pub use about::{Convention, LevelLeftOut, VolumeAbout, VolumeChannel, VolumeLevel};
pub use assembly::{Brick, BrickLayout, BrickPos, BrickWork};
pub(crate) use boxes::{BoxValues, Plane, Shared, VoxelBox, filled, paste};
use bricks::KEYS_AT_HAND;
pub use bricks::{BRICK, BrickCount};
pub(crate) use cache::ChunkCache;
pub use cache::ChunkWork;
pub use crop::{VolumeCropError, crop};
use gate::Gate;
pub use region::VolumeRegion;
pub(crate) use told::{Telling, Told};

/// Bytes of decoded chunks that are kept, and of boxes beside them.
const MOST_KEPT: usize = 256 << 20;
/// Bytes of chunks that are decoded at once, by all threads together: as many as one chunk may have.
const MOST_DECODING: u64 = 1 << 30;
/// Bytes of levels that are made and not stored which are kept: of coarse ones, and of finer ones.
pub(crate) const COARSE_MADE_KEPT: usize = 192 << 20;
const FINE_MADE_KEPT: usize = 64 << 20;

/// One level as it is stored.
pub(crate) struct LevelArray {
    pub(crate) dtype: DType,
    pub(crate) grid: Grid,
    pub(crate) source: Arc<dyn ChunkSource>,
}

impl LevelArray {
    /// Bytes of a chunk, decoded.
    fn chunk_bytes(&self) -> u64 {
        self.grid.chunk.iter().fold(self.dtype.bytes() as u64, |bytes, side| bytes.saturating_mul(*side))
    }
}

/// A volume, opened. Its levels are read where they lie; shared by threads.
pub struct Volume {
    about: VolumeAbout,
    arrays: Vec<LevelArray>,
    cache: ChunkCache,
    /// Bounds the bytes of chunks that are decoded at once.
    decoding: Gate,
    /// Boxes of which many bricks are cut, where chunks are large.
    boxes: ChunkCache,
    /// Chunks of levels that are made: of coarse ones, and of finer ones.
    made: [ChunkCache; 2],
    /// Memory of bricks.
    spare: Arc<Spare>,
    /// What its sources have told of this.
    told: Mutex<Told>,
    /// Which chunks are stored, of levels that were asked about.
    stored: Mutex<FxHashMap<usize, Option<Arc<StoredChunks>>>>,
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
            decoding: Gate::new(MOST_DECODING),
            boxes: ChunkCache::new(MOST_KEPT),
            made: [COARSE_MADE_KEPT, FINE_MADE_KEPT].map(ChunkCache::new),
            spare: Arc::default(),
            told: Mutex::default(),
            stored: Mutex::default(),
        }
    }

    /// How many chunks were read and decoded since it was opened, and how often one was shared.
    pub fn chunk_work(&self) -> ChunkWork {
        self.cache.work()
    }

    /// Keeps up to so many bytes of decoded chunks for later reads from now on, and as much of boxes beside
    /// them where chunks are large; 256 MiB each unless this is called. Of chunks that have more bytes by
    /// themselves the last used ones are kept beside these, up to four times as many bytes and one at least,
    /// so that who reads a volume of one chunk box by box decodes it once; of 0 nothing is. What is more goes
    /// at once. Where less is kept than a brick wants chunks, each is decoded again for every brick.
    pub fn keep_at_most(&self, bytes: usize) {
        self.cache.keep_at_most(bytes);
        self.boxes.keep_at_most(bytes);
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

    /// Which chunks of a level that exists are stored, where not all are and a look at what is at hand tells:
    /// listed once, and kept.
    pub(crate) async fn stored_chunks(&self, level: usize) -> Option<Arc<StoredChunks>> {
        let kept = || self.stored.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = kept().get(&level) {
            return found.clone();
        }
        let array = &self.arrays[level];
        let found = match array.source.presence(KEYS_AT_HAND).await {
            Ok(Presence::These(list)) => {
                StoredChunks::new(&array.grid, &list).filter(|stored| !stored.are_all()).map(Arc::new)
            }
            // A listing that fails tells nothing; reading will say what is wrong.
            Ok(Presence::All | Presence::Unknown) | Err(_) => None,
        };
        kept().entry(level).or_insert(found).clone()
    }

    /// The value of voxels of the finest level that nothing is stored of: the bytes of one value,
    /// little-endian.
    pub fn fill(&self) -> Vec<u8> {
        self.arrays[0].source.fill()[..self.about.dtype.bytes()].to_vec()
    }

    /// With where it lies.
    pub(crate) fn lying_at(mut self, root: &Path) -> Volume {
        root.clone_into(&mut self.about.root);
        self
    }

    /// Takes the translations of its levels to be of corners, or of middles, of first voxels, in the place of
    /// what followed from the metadata. Fails of what is no OME-Zarr, which has no such translations.
    pub(crate) fn set_convention(&mut self, convention: Convention) -> Result<(), VolumeError> {
        let about = &mut self.about;
        if about.kind != "ome-zarr" {
            let why = format!(
                "is no OME-Zarr, which alone has translations that may be of corners or of middles; leave out --origins {}",
                convention.name()
            );
            return Err(VolumeFault::Request(why).at(&about.path));
        }
        let moved = about.convention.inward() - convention.inward();
        for level in &mut about.levels {
            level.origin = std::array::from_fn(|axis| level.origin[axis] + moved * level.scale[axis]);
        }
        about.convention = convention;
        Ok(())
    }

    /// What is known of the volume without reading its values.
    pub fn about(&self) -> &VolumeAbout {
        &self.about
    }
}
