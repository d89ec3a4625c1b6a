//! What tells one image in a cache from another, and from the same image before it was changed.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use twox_hash::XxHash3_128;

use crate::build::BuildOptions;

/// Bytes that are read of either end of a file.
const END: u64 = 1 << 20;
/// Files of one image of which the ends are read.
const MOST_READ: usize = 64;

/// Of an image that is made of these files.
///
/// The same for as long as no file changes; reads 2 MiB of each of the first 64 files.
pub(super) fn of(files: &[PathBuf], options: &BuildOptions) -> io::Result<u128> {
    let mut hash = XxHash3_128::new();
    for word in [env!("CARGO_PKG_VERSION"), &options.named()] {
        add_name(&mut hash, word.as_bytes());
    }
    hash.write(&(files.len() as u64).to_le_bytes());
    for (n, file) in files.iter().enumerate() {
        add_file(&mut hash, file, n < MOST_READ)?;
    }
    Ok(hash.finish_128())
}

fn add_file(hash: &mut XxHash3_128, path: &Path, is_read: bool) -> io::Result<()> {
    let place = fs::canonicalize(path)?;
    add_name(hash, place.as_os_str().as_encoded_bytes());
    let found = fs::metadata(&place)?;
    let modified = found.modified().unwrap_or(UNIX_EPOCH);
    let since = modified.duration_since(UNIX_EPOCH).unwrap_or_else(|before| before.duration());
    hash.write(&found.len().to_le_bytes());
    hash.write(&since.as_nanos().to_le_bytes());
    if !is_read || found.is_dir() {
        return Ok(());
    }
    let mut file = File::open(&place)?;
    let mut bytes = Vec::new();
    file.by_ref().take(END).read_to_end(&mut bytes)?;
    hash.write(&bytes);
    bytes.clear();
    file.seek(SeekFrom::Start(found.len().saturating_sub(END)))?;
    file.take(END).read_to_end(&mut bytes)?;
    hash.write(&bytes);
    Ok(())
}

/// With its length, so that no two lists of names are the same bytes.
fn add_name(hash: &mut XxHash3_128, name: &[u8]) {
    hash.write(&(name.len() as u64).to_le_bytes());
    hash.write(name);
}
