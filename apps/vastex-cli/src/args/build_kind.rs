//! Which options of `vastex build` mean something for images alone, and which for volumes alone.

use vastex_build::{LevelsFrom, NodataRule};
use vastex_core::AddressMode;

use super::build::{BuildArgs, Compress, Encode};

impl BuildArgs {
    /// What is said to options that mean something for volumes alone, where an image is built.
    pub(crate) fn of_volumes_alone(&self) -> Option<&'static str> {
        let is_zarr = self.output.extension().is_some_and(|ending| ending == "zarr");
        let given = [
            (self.volume.downsample.is_some(), "--downsample is of volumes"),
            (self.volume.keep_z, "--keep-z is of volumes"),
            (self.volume.zarr.is_some(), "--zarr is of volumes"),
            (self.volume.shards.is_some(), "--shards is of volumes"),
            (self.volume.origins.is_given(), "--origins is of volumes"),
            (
                self.compress == Some(Compress::Gzip),
                "--compress gzip is of OME-Zarr, which is made of volumes",
            ),
            (is_zarr, "an OME-Zarr (OUT.zarr) is made of volumes"),
        ];
        given.iter().find(|(is_given, _)| *is_given).map(|(_, why)| *why)
    }

    /// What is said to options that mean nothing where a volume is built.
    #[cfg(feature = "volumes")]
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
