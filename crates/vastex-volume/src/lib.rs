//! The reading part of volumes: OME-Zarr of every version, NIfTI, raw files, TIFF stacks and the project's
//! own containers, where they lie.
//!
//! [`open`] turns a path into a [`Volume`]: its levels, channels and times, with what its metadata say and
//! what was odd about them ([`VolumeAbout`]). Values are read as boxes of a level ([`Volume::read`]), exactly
//! as they are stored; chunks are decoded one by one, absent ones are never read. No GPU, no thread and no
//! clock is in here: a caller's threads read and decode.
//!
//! Whatever lies there may be damaged or hostile: every length is checked before memory is taken for it, and
//! errors name the path.

mod chunks;
mod codecs;
mod fault;
mod flat;
mod json;
mod keys;
mod made;
mod ome;
mod open;
mod reduce;
mod source;
mod spare;
mod stack;
mod stored;
mod tiled;
mod units;
mod values;
mod volume;
mod zarr;

pub use codecs::crc32c;
pub use fault::{SourceFault, VolumeError, VolumeFault};
pub use made::MadeProgress;
pub use open::{ImageList, Opened, are_pictures, files_of_volume, is_volume, open, open_placed};
pub use reduce::{Reduction, reduce_into, reduced_size};
pub use source::{
    BINS, BrickStats, LevelState, PointValue, SliceAxis, ValueCodes, VolumeOptions, VolumePlane,
    VolumeSource, VolumeSourceError, VoxelValue, levels_of, made_levels_kept, makes_levels_at_opening,
};
pub use tiled::container_volume;
pub use values::{DType, npy_header};
pub use volume::{
    BRICK, Brick, BrickCount, BrickLayout, BrickPos, BrickWork, ChunkWork, Convention, LevelLeftOut, Volume,
    VolumeAbout, VolumeChannel, VolumeCropError, VolumeLevel, VolumeRegion, crop,
};
