//! The words of the disk cache, for all commands that show something.

use std::path::PathBuf;

use clap::Args as ClapArgs;

/// Whether tiles are kept on a disk, and where.
#[derive(Clone, Debug, ClapArgs)]
pub(crate) struct DiskCacheArgs {
    /// Keep tiles in this directory, beyond the end of the program; for sources on slow media and network
    /// file systems. It is made if need be, may be shared by all sources, and is removed by removing it
    #[arg(long, value_name = "DIR")]
    pub(crate) disk_cache: Option<PathBuf>,
    /// MiB that the files of --disk-cache may have; what was not read again goes first
    #[arg(long, default_value_t = 1024, value_name = "N", requires = "disk_cache", value_parser = clap::value_parser!(u64).range(1..=1 << 24))]
    pub(crate) disk_cache_mib: u64,
}
