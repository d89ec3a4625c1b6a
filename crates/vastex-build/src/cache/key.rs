//! What tells one image in a cache from another, and from the same image before it was changed.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use twox_hash::XxHash3_128;

use super::room;
use crate::build::{self, BuildError, BuildOptions, OpenLayer};
use crate::progress::Progress;

/// Bytes that are read of either end of a file.
const END: u64 = 1 << 20;
/// Files of one image of which the ends are read.
const MOST_READ: usize = 64;

/// The name of the container of an image, the same for as long as no file of it changes: of the fingerprint
/// of a build, which has lengths, times and a sample of all files and of a mask, of where the files lie and
/// of their ends.
pub(super) fn of(
    image: &Path,
    layers: &[OpenLayer],
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<String, BuildError> {
    let mut hash = XxHash3_128::new();
    let same = build::fingerprint_of(layers, options, progress)?;
    for word in [&same.here, &options.named()] {
        add(&mut hash, word.as_bytes());
    }
    let of_image = |error: io::Error| BuildError::Input { path: image.into(), fault: error.into() };
    let files: Vec<&PathBuf> = layers.iter().flat_map(OpenLayer::files).collect();
    for (n, file) in files.into_iter().enumerate() {
        if progress.opening().is_break() {
            return Err(BuildError::Cancelled);
        }
        add_file(&mut hash, file, n < MOST_READ).map_err(of_image)?;
    }
    Ok(room::name_of(hash.finish_128()))
}

fn add_file(hash: &mut XxHash3_128, path: &Path, is_read: bool) -> io::Result<()> {
    let place = fs::canonicalize(path)?;
    add(hash, place.as_os_str().as_encoded_bytes());
    let found = fs::metadata(&place)?;
    if !is_read || found.is_dir() {
        return Ok(());
    }
    let mut file = File::open(&place)?;
    let mut bytes = Vec::new();
    file.by_ref().take(END).read_to_end(&mut bytes)?;
    add(hash, &bytes);
    bytes.clear();
    file.seek(SeekFrom::Start(found.len().saturating_sub(END)))?;
    file.take(END).read_to_end(&mut bytes)?;
    add(hash, &bytes);
    Ok(())
}

/// With the length, so that no two lists are the same bytes.
fn add(hash: &mut XxHash3_128, bytes: &[u8]) {
    hash.write(&(bytes.len() as u64).to_le_bytes());
    hash.write(bytes);
}
