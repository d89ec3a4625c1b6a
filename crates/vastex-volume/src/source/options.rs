//! What of a volume is a source, why one is none, and what is told of its levels.

use std::path::PathBuf;

use vastex_core::{LayerError, VoxelLevelsError};

use crate::fault::VolumeError;
use crate::made::MadeProgress;
use crate::reduce::Reduction;

/// What of a volume is a source, and how.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VolumeOptions {
    /// The channel, from 0.
    pub channel: u64,
    /// The time, from 0.
    pub time: u64,
    /// Voxels of a brick along each side, without its borders: 64, or 32 where the pool is small.
    pub brick: u32,
    /// Voxels of border on each side; one is enough for filters and gradients.
    pub border: u32,
    /// `Some(true)` to take values for labels, which are never mixed, `Some(false)` for numbers; `None` for
    /// what the volume says.
    pub labels: Option<bool>,
    /// How levels are made that are not stored; `None` for the mean, and of labels for the most frequent.
    pub reduction: Option<Reduction>,
    /// A directory that keeps levels that are made in the background, a seventh of the coarsest stored one at
    /// most; `None` for 256 MiB of main memory, which all sources of a volume share.
    pub cache: Option<PathBuf>,
    /// True if all levels that are not stored are made as soon as somebody makes any. If not, bricks of them
    /// that are read as tiles stay a preview, of an eighth of the stored chunks, until they are wanted
    /// ([`VolumeSource::want`](super::VolumeSource::want)): all coarser bricks of what is in view are read.
    pub makes_all: bool,
    /// True if bricks come before the chunks beside them, with their last voxels repeated in the border, and
    /// are to be read again later ([`VolumeSource::take_changes`](super::VolumeSource::take_changes)): for
    /// who shows what has come, and asks that in every frame. Values for a usual window are then those of a
    /// preview, as long as a level is one. If not, each brick is whole when it comes.
    pub borders_later: bool,
}

impl Default for VolumeOptions {
    fn default() -> VolumeOptions {
        VolumeOptions {
            channel: 0,
            time: 0,
            brick: 64,
            border: 1,
            labels: None,
            reduction: None,
            cache: None,
            makes_all: true,
            borders_later: false,
        }
    }
}

/// Why a volume is no source of tiles.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VolumeSourceError {
    /// The volume cannot be read, or has no such channel or time.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The volume's levels cannot be those of a texture.
    #[error("{path}: {error}")]
    Levels {
        /// The volume.
        path: String,
        /// What is wrong with the levels.
        error: VoxelLevelsError,
    },
    /// The volume's bricks cannot be tiles of a texture.
    #[error("{path}: {error}")]
    Layer {
        /// The volume.
        path: String,
        /// What is wrong with the bricks.
        error: LayerError,
    },
}

/// A level of a source, as it is told to people.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelState {
    /// Voxels along x, y and z.
    pub size: [u32; 3],
    /// Sides of a voxel in the world.
    pub scale: [f64; 3],
    /// The corner of the first voxel in the world.
    pub origin: [f64; 3],
    /// True if the level is made and not stored.
    pub is_made: bool,
    /// How far levels are that are made; of those that are stored, and of those made at opening, all is done.
    pub made: Option<MadeProgress>,
}
