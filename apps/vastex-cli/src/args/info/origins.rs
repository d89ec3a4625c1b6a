//! What translations of an OME-Zarr are taken to be of, for all commands that open volumes.

use clap::{Args as ClapArgs, ValueEnum};

/// What translations are of, where somebody knows better than the metadata.
#[derive(Clone, Copy, Debug, Default, ClapArgs)]
pub(crate) struct OriginsArgs {
    /// What translations of the levels of an OME-Zarr are of, whatever its metadata look like: corner or
    /// center of the first voxel. Without it, `vastex info` says what they are taken to be of
    #[arg(long, value_enum, value_name = "CONVENTION", hide_possible_values = true)]
    pub(crate) origins: Option<Origins>,
}

/// A place of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Origins {
    /// Its corner
    Corner,
    /// Its middle
    Center,
}

#[cfg(feature = "volumes")]
impl OriginsArgs {
    /// In the words of the library.
    pub(crate) fn convention(self) -> Option<vastex_volume::Convention> {
        self.origins.map(|origins| match origins {
            Origins::Corner => vastex_volume::Convention::Corner,
            Origins::Center => vastex_volume::Convention::Center,
        })
    }
}
