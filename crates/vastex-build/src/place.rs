//! Whether there may be an output where it is asked for: never over the input, nor among its tiles.

use std::path::{Path, PathBuf};

use crate::error::BuildError;

/// Refuses an output that is the input, or lies in a directory of it: `input` itself where it is one, or the directory
/// of the tiles that it tells of.
pub(crate) fn check(input: &Path, tiles: Option<&Path>, output: &Path) -> Result<(), BuildError> {
    // Where there is no such directory, the writer says so.
    let Some(output_at) = resolved(output) else { return Ok(()) };
    let is_within = |directory: &Path| {
        directory.is_dir() && directory.canonicalize().is_ok_and(|at| output_at.starts_with(at))
    };
    if input.canonicalize().is_ok_and(|input| input == output_at) {
        return Err(BuildError::SameFile(input.into()));
    }
    match [Some(input), tiles].into_iter().flatten().find(|directory| is_within(directory)) {
        Some(directory) => Err(BuildError::AmongTiles { output: output.into(), directory: directory.into() }),
        None => Ok(()),
    }
}

/// Where a file is or will be, links followed.
pub(crate) fn resolved(path: &Path) -> Option<PathBuf> {
    if let Ok(found) = path.canonicalize() {
        return Some(found);
    }
    let directory = path.parent().filter(|directory| !directory.as_os_str().is_empty());
    Some(directory.unwrap_or(Path::new(".")).canonicalize().ok()?.join(path.file_name()?))
}
