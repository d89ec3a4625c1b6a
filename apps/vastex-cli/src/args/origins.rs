//! What translations of an OME-Zarr are taken to be of, for all commands that open volumes.

use clap::{Args as ClapArgs, ValueEnum};

/// What translations are of, where somebody knows better than the metadata.
#[derive(Clone, Copy, Debug, Default, ClapArgs)]
pub(crate) struct OriginsArgs {
    /// What translations of the levels of an OME-Zarr that is named here, and of labels beside it, are of,
    /// whatever its metadata look like: corner or center of the first voxel. Without it, `vastex info` says
    /// what they are taken to be of
    #[arg(long, value_enum, value_name = "CONVENTION", hide_possible_values = true)]
    origins: Option<Origins>,
}

/// A place of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Origins {
    /// Its corner
    Corner,
    /// Its middle
    Center,
}

impl OriginsArgs {
    /// Returns true if somebody says so.
    pub(crate) fn is_given(self) -> bool {
        self.origins.is_some()
    }

    /// In the words of a command line.
    #[cfg(feature = "view")]
    pub(crate) fn name(self) -> Option<&'static str> {
        self.origins.map(|origins| match origins {
            Origins::Corner => "corner",
            Origins::Center => "center",
        })
    }

    /// In the words of the library.
    #[cfg(feature = "volumes")]
    pub(crate) fn convention(self) -> Option<vastex_volume::Convention> {
        self.origins.map(|origins| match origins {
            Origins::Corner => vastex_volume::Convention::Corner,
            Origins::Center => vastex_volume::Convention::Center,
        })
    }
}
