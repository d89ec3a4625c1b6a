//! Where the parts of levels go: what each kind of output asks of a pass over a volume, and is given.

use std::sync::atomic::{AtomicBool, Ordering};

use super::block::Block;
use super::error::VolumeBuildError;

/// Whose part it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) channel: u64,
    pub(super) time: u64,
    pub(super) level: usize,
}

/// Set once who asked for a build wants no more of it; looked at between chunks.
#[derive(Debug, Default)]
pub(super) struct Stop(AtomicBool);

impl Stop {
    pub(super) fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Fails once it is set.
    pub(super) fn check(&self) -> Result<(), VolumeBuildError> {
        match self.0.load(Ordering::Relaxed) {
            true => Err(VolumeBuildError::Cancelled),
            false => Ok(()),
        }
    }
}

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Counts {
    /// Bricks, chunks or shards that have bytes of their own.
    pub(super) pieces: u64,
    /// Pieces that hold the fill value alone, or one value, and take no room.
    pub(super) empty: u64,
    /// Bytes of all of them.
    pub(super) bytes: u64,
}

/// An output of one image.
pub(super) trait Sink: Send {
    /// Voxels of a level that are written at once, along x, y and z.
    fn quantum(&self, level: usize) -> [u64; 3];

    /// Voxels around them that are written with them.
    fn border(&self) -> u64;

    /// How many levels, from the finest on, come in parts; the next coarser one comes whole.
    fn by_block(&self) -> usize;

    /// Writes a part of a level, by the threads of the pool that the caller runs in. Its inner box holds
    /// whole pieces, and the border is there where the level goes on.
    /// Ends early where `stop` says so.
    fn write(&mut self, place: Place, block: &Block, stop: &Stop) -> Result<(), VolumeBuildError>;

    /// Takes the level that comes whole.
    fn write_rest(&mut self, place: Place, block: Block) -> Result<(), VolumeBuildError>;

    /// What is written so far.
    fn counts(&self) -> Counts;
}
