//! What `render` and `view` are given: a container, a tile directory of another program, or a generated planet, behind a disk cache if one is asked
//! for.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use vastex::TileSource;
use vastex_tiles::{Container, DirectStore, DiskTier};

use crate::args::{PLANET, SceneArgs};
use crate::{disk_cache, planet, report};

/// What a scene shows.
pub(crate) struct Opened {
    /// Behind the disk cache, where there is one.
    pub(crate) tiles: Arc<dyn TileSource>,
    pub(crate) disk: Option<Arc<DiskTier>>,
}

/// Opens the source of a scene, and its disk cache if there is to be one.
pub(crate) fn open(args: &SceneArgs) -> Result<Opened> {
    let planet = args.source.to_str().and_then(|source| source.strip_prefix(PLANET));
    let tiles = match planet {
        Some(words) => planet::open(words, |path| open_path(path, args.direct))
            .with_context(|| args.source.display().to_string())?,
        None => open_path(&args.source, args.direct)?,
    };
    Ok(disk_cache::before(tiles, &args.source, &args.disk_cache))
}

/// Opens a container or, where Vastex can read them, the tiles of a directory or of the file that describes one.
///
/// The tiles of a container are read past the system's cache if `direct` and if they can be; what cannot be is said.
fn open_path(path: &Path, direct: bool) -> Result<Arc<dyn TileSource>> {
    match if direct { open_direct(path) } else { vastex::open(path) } {
        Ok(container) => Ok(container),
        Err(error) => match directory(path)? {
            Some(tiles) => Ok(tiles),
            None => Err(error.into()),
        },
    }
}

fn open_direct(path: &Path) -> Result<Arc<dyn TileSource>, vastex::Error> {
    let container = Container::open_file_direct(path, DirectStore::DEFAULT_DEPTH)?;
    if !container.is_direct() {
        let why = match container.align() {
            1 => "its tiles are not aligned; `vastex build --align 4K` aligns them",
            _ => "the file system refuses it, or asks for a larger alignment",
        };
        report::say(&format!("note: {}: not read directly: {why}", path.display()));
    }
    Ok(Arc::new(container))
}

/// Whether a path is the directory of tiles of another program, or the file that describes one.
#[cfg(feature = "build")]
pub(crate) fn is_directory_of_tiles(path: &Path) -> bool {
    (path.is_dir() || path.is_file()) && vastex_build::DirectorySource::open(path).is_ok()
}

/// Without the readers of `vastex build` no directory is known.
#[cfg(not(feature = "build"))]
pub(crate) fn is_directory_of_tiles(_: &Path) -> bool {
    false
}

/// The tiles of a directory; nothing where `path` is something else.
#[cfg(feature = "build")]
fn directory(path: &Path) -> Result<Option<Arc<dyn TileSource>>> {
    use vastex_build::{DirectorySource, InputFault, SourceError};

    if !path.is_dir() && !path.is_file() {
        return Ok(None);
    }
    match DirectorySource::open(path) {
        Ok(tiles) => {
            for notice in tiles.notices() {
                report::say(&format!("note: {}: {notice}", path.display()));
            }
            Ok(Some(Arc::new(tiles)))
        }
        Err(SourceError::Input { fault: InputFault::NoTiles, .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

/// Without the readers of `vastex build` no directory is known.
#[cfg(not(feature = "build"))]
fn directory(_: &Path) -> Result<Option<Arc<dyn TileSource>>> {
    Ok(None)
}
