//! What `render` and `view` are given: a container, or a tile directory of another program.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use vastex::TileSource;

/// Opens a container or, where Vastex can read them, the tiles of a directory or of the file that describes one.
pub(crate) fn open(path: &Path) -> Result<Arc<dyn TileSource>> {
    match vastex::open(path) {
        Ok(container) => Ok(container),
        Err(error) => match directory(path)? {
            Some(tiles) => Ok(tiles),
            None => Err(error.into()),
        },
    }
}

/// The tiles of a directory; nothing where `path` is something else.
#[cfg(feature = "build")]
fn directory(path: &Path) -> Result<Option<Arc<dyn TileSource>>> {
    use vastex_build::{BuildError, DirectorySource, InputFault};

    if !path.is_dir() && !path.is_file() {
        return Ok(None);
    }
    match DirectorySource::open(path) {
        Ok(tiles) => {
            for notice in tiles.notices() {
                crate::report::say(&format!("note: {}: {notice}", path.display()));
            }
            Ok(Some(Arc::new(tiles)))
        }
        Err(BuildError::Input { fault: InputFault::NoTiles, .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

/// Without the readers of `vastex build` no directory is known.
#[cfg(not(feature = "build"))]
fn directory(_: &Path) -> Result<Option<Arc<dyn TileSource>>> {
    Ok(None)
}
