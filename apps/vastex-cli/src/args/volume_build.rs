//! What `vastex build` is told of volumes alone.

use clap::ValueEnum;

use super::{ClapArgs, OriginsArgs};

/// What `vastex build` is told of volumes alone.
#[derive(Clone, Copy, Debug, ClapArgs)]
pub(crate) struct VolumeArgs {
    /// Volume: how a voxel of a coarser level is made of the up to eight that it covers: mean, max, min or
    /// majority, the most frequent [default: mean; of labels majority]
    #[arg(long, value_enum, value_name = "RULE", hide_possible_values = true)]
    pub(crate) downsample: Option<Downsample>,
    /// Volume: leave z as it is while its voxels are larger than those along x and y; else all axes are
    /// halved alike
    #[arg(long)]
    pub(crate) keep_z: bool,
    /// Volume: the version of OME-Zarr, 0.4 or 0.5, also where OUT does not end in .zarr [default: 0.5]
    #[arg(long, value_enum, value_name = "VERSION", hide_possible_values = true)]
    pub(crate) zarr: Option<Zarr>,
    /// Volume: so many chunks along each axis in a file of OUT.zarr, 1 to 64 [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=64))]
    pub(crate) shards: Option<u64>,
    #[command(flatten)]
    pub(crate) origins: OriginsArgs,
}

/// How coarser levels of a volume are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Downsample {
    /// The mean
    Mean,
    /// The greatest
    Max,
    /// The least
    Min,
    /// The most frequent
    Majority,
}

/// A version of OME-Zarr.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Zarr {
    /// In Zarr v2
    #[value(name = "0.4")]
    V04,
    /// In Zarr v3
    #[value(name = "0.5")]
    V05,
}
