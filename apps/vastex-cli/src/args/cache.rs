//! The words of the cache of built images, for all commands that show something.

use std::path::PathBuf;

use clap::Args as ClapArgs;

/// Where images are kept that are built to be shown.
#[derive(Clone, Debug, ClapArgs)]
pub(crate) struct CacheArgs {
    /// A directory for images that are built to be shown, which programs may share; or off: nothing is built,
    /// and they are decoded into memory, reduced above 1 GiB [default: vastex in $XDG_CACHE_HOME or ~/.cache]
    #[arg(long, value_name = "DIR|off")]
    pub(crate) cache: Option<PathBuf>,
    /// GiB that --cache may have; what was not opened for longest goes first
    #[arg(long, default_value_t = 20, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    pub(crate) cache_gib: u64,
}

impl CacheArgs {
    /// Returns true if nothing is to be kept.
    #[cfg(feature = "build")]
    pub(crate) fn is_off(&self) -> bool {
        self.cache.as_ref().is_some_and(|cache| cache.as_os_str() == "off")
    }
}
