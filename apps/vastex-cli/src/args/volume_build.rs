//! What `vastex build` is told of volumes alone, and which of its other options mean nothing for them.

use clap::ValueEnum;
use vastex_build::{LevelsFrom, NodataRule};
use vastex_core::AddressMode;

use super::ClapArgs;
use super::build::{BuildArgs, Compress, Encode};

/// What `vastex build` is told of volumes alone.
#[derive(Clone, Copy, Debug, ClapArgs)]
pub(crate) struct VolumeArgs {
    /// Volume: how a voxel of a coarser level is made of the up to eight that it covers: mean, max, min or
    /// majority, the most frequent [default: mean; of labels majority]
    #[arg(long, value_enum, value_name = "RULE", hide_possible_values = true)]
    pub(crate) downsample: Option<Downsample>,
    /// Volume: leave z as it is while its voxels are larger than those along x and y; else all axes are halved
    /// alike
    #[arg(long)]
    pub(crate) keep_z: bool,
    /// Volume: the version of OME-Zarr, 0.4 or 0.5, also where OUT does not end in .zarr [default: 0.5]
    #[arg(long, value_enum, value_name = "VERSION", hide_possible_values = true)]
    pub(crate) zarr: Option<Zarr>,
    /// Volume: so many chunks along each axis in a file of OUT.zarr, 1 to 64 [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=64))]
    pub(crate) shards: Option<u64>,
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

impl BuildArgs {
    /// What is said to options that mean something for volumes alone, where an image is built.
    pub(crate) fn of_volumes_alone(&self) -> Option<&'static str> {
        let is_zarr = self.output.extension().is_some_and(|ending| ending == "zarr");
        let given = [
            (self.volume.downsample.is_some(), "--downsample is of volumes"),
            (self.volume.keep_z, "--keep-z is of volumes"),
            (self.volume.zarr.is_some(), "--zarr is of volumes"),
            (self.volume.shards.is_some(), "--shards is of volumes"),
            (
                self.compress == Some(Compress::Gzip),
                "--compress gzip is of OME-Zarr, which is made of volumes",
            ),
            (is_zarr, "an OME-Zarr (OUT.zarr) is made of volumes"),
        ];
        given.iter().find(|(is_given, _)| *is_given).map(|(_, why)| *why)
    }

    /// What is said to options that mean nothing where a volume is built.
    pub(crate) fn of_images_alone(&self) -> Option<&'static str> {
        let given = [
            (self.format.is_some(), "--format: values of volumes are kept as they are stored"),
            (self.quality != Encode::Normal, "--quality: volumes are not compressed in blocks"),
            (!self.linear, "--linear: values of volumes are never taken for colours"),
            (
                self.filter.is_some(),
                "--filter is of images; --downsample says how levels of a volume are made",
            ),
            (
                self.levels_from != LevelsFrom::Chain,
                "--levels-from: each level of a volume is made of the next finer one",
            ),
            (self.nodata != NodataRule::OfFile, "--nodata is of images"),
            (self.keep_levels, "--levels keep: levels of a volume are made anew"),
            (
                self.address.modes != [AddressMode::Clamp; 2],
                "--address: beyond the faces of a volume its last voxels are repeated",
            ),
            (self.mask.is_some(), "--mask is of images"),
            (self.drop_transparent, "--drop-transparent is of images"),
            (!self.insets.is_empty(), "--inset is of images"),
            (self.shard.is_some(), "--shard: a volume is built in one piece"),
            (self.resume, "--resume: the build of a volume begins anew"),
            (self.reorder, "--reorder: bricks of a volume are written near each other as they come"),
        ];
        given.iter().find(|(is_given, _)| *is_given).map(|(_, why)| *why)
    }
}
