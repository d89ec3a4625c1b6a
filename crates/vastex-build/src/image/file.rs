//! Opens files for reading, and nothing else that a path may name.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use super::fault::InputFault;

/// Opens a file for reading, unless it is something else.
pub(super) fn open_file(path: &Path) -> Result<File, InputFault> {
    // Looked at before it is opened: opening a pipe would wait for a writer.
    match std::fs::metadata(path)? {
        found if found.is_dir() => Err(InputFault::Directory),
        found if !found.is_file() => Err(InputFault::NotAFile),
        _ => Ok(File::open(path)?),
    }
}

/// A buffered file with few system calls per row.
pub(super) fn buffered(file: File) -> BufReader<File> {
    BufReader::with_capacity(256 << 10, file)
}
