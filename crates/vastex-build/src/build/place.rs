//! Whether there may be an output where it is asked for: never over the input, nor among its tiles.

use std::path::{Path, PathBuf};

use super::BuildError;

/// Refuses an output that is one of the files of an input, or lies in one of its directories of tiles.
pub(crate) fn check(files: &[PathBuf], output: &Path) -> Result<(), BuildError> {
    // Where there is no such directory, the writer says so.
    let Some(output_at) = resolved(output) else { return Ok(()) };
    for file in files {
        // What cannot be found any more is nothing that could be overwritten; reading it says so.
        let Ok(at) = file.canonicalize() else { continue };
        if at == output_at {
            return Err(BuildError::SameFile(file.clone()));
        }
        if output_at.starts_with(&at) && at.is_dir() {
            return Err(BuildError::AmongTiles { output: output.into(), directory: file.clone() });
        }
    }
    Ok(())
}

/// Where a file is or will be, links followed.
pub(crate) fn resolved(path: &Path) -> Option<PathBuf> {
    if let Ok(found) = path.canonicalize() {
        return Some(found);
    }
    let directory = path.parent().filter(|directory| !directory.as_os_str().is_empty());
    Some(directory.unwrap_or(Path::new(".")).canonicalize().ok()?.join(path.file_name()?))
}
