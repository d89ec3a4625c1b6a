//! What was found at a path, so that nobody looks for it again: the directories of a TIFF file.

use std::path::Path;
#[cfg(feature = "build")]
use std::path::PathBuf;
#[cfg(feature = "build")]
use std::sync::Arc;

#[cfg(feature = "build")]
use vastex_build::TiffDirectories;

/// What lies at a path, looked at once for all who ask.
#[derive(Clone, Default)]
pub(crate) struct Looked {
    #[cfg(feature = "build")]
    path: PathBuf,
    #[cfg(feature = "build")]
    tiff: Option<Arc<TiffDirectories>>,
}

impl Looked {
    /// Looks at what a path means. What cannot be read is as if it were not there: who opens it says why.
    #[cfg(feature = "build")]
    pub(crate) fn at(path: &Path) -> Looked {
        Looked { path: path.to_owned(), tiff: TiffDirectories::read(path).ok().map(Arc::new) }
    }

    /// Without the readers of `vastex build` there is nothing to find.
    #[cfg(not(feature = "build"))]
    pub(crate) fn at(_: &Path) -> Looked {
        Looked::default()
    }

    /// Returns true if this is what was found at a path.
    #[cfg(feature = "build")]
    pub(crate) fn is_of(&self, path: &Path) -> bool {
        self.path == path
    }

    /// The TIFF file of a path, if this is what was looked at.
    #[cfg(feature = "build")]
    pub(crate) fn tiff(&self, path: &Path) -> Option<&TiffDirectories> {
        self.tiff.as_deref().filter(|_| self.is_of(path))
    }

    /// Returns true if the file of a path, if this is what was looked at, can be shown where it lies, but all
    /// of it would have to be read first, with nothing to look at meanwhile: it is built before it is shown.
    #[cfg(feature = "build")]
    pub(crate) fn is_built_first(&self, path: &Path) -> bool {
        self.tiff(path).is_some_and(TiffDirectories::lacks_levels)
    }
}
