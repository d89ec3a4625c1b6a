//! Whether there may be an output where it is asked for: never over the input, nor among its tiles.

use std::path::{Path, PathBuf};

use vastex_tiles::{lies_in, same_file};

use super::BuildError;

/// Refuses an output that is one of the files of an input, or lies in one of its directories of tiles.
pub(crate) fn check(files: &[PathBuf], output: &Path) -> Result<(), BuildError> {
    for file in files {
        // What cannot be found any more is nothing that could be overwritten; reading it says so.
        if same_file(file, output) {
            return Err(BuildError::SameFile(file.clone()));
        }
        if lies_in(output, file) {
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
