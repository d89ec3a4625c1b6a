//! What was found at a path, so that nobody looks for it again: the directories of a TIFF file.

use std::path::Path;
#[cfg(feature = "build")]
use std::sync::Arc;

#[cfg(feature = "build")]
use vastex_build::TiffDirectories;

/// What lies at a path, looked at once for all who ask.
#[derive(Clone, Default)]
pub(crate) struct Looked {
    #[cfg(feature = "build")]
    tiff: Option<Arc<TiffDirectories>>,
}

impl Looked {
    /// Looks at what a path means. What cannot be read is as if it were not there: who opens it says why.
    #[cfg(feature = "build")]
    pub(crate) fn at(path: &Path) -> Looked {
        Looked { tiff: TiffDirectories::read(path).ok().map(Arc::new) }
    }

    /// Without the readers of `vastex build` there is nothing to find.
    #[cfg(not(feature = "build"))]
    pub(crate) fn at(_: &Path) -> Looked {
        Looked::default()
    }

    /// The TIFF file of a path, if this is what was looked at.
    #[cfg(feature = "build")]
    pub(crate) fn tiff(&self, path: &Path) -> Option<&TiffDirectories> {
        self.tiff.as_deref().filter(|tiff| tiff.path() == path)
    }
}
