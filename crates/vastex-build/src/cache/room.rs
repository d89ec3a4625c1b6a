//! What lies in a cache's directory, and which of it goes where there is too much.
//!
//! `KEY.vastex` is a container, `.KEY.vastex.partial` and `.KEY.vastex.journal` are what a build has made so
//! far of one; KEY has 32 hexadecimal digits. Files of other names are nobody's business here.

use std::fs::{self, DirEntry, File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

const ENDING: &str = ".vastex";
const PARTIAL: &str = ".partial";
const JOURNAL: &str = ".journal";
const DIGITS: usize = 32;

/// The name of a container.
pub(super) fn name_of(key: u128) -> String {
    format!("{key:032x}{ENDING}")
}

/// A container, or an unfinished one.
struct Kept {
    path: PathBuf,
    bytes: u64,
    /// When it was opened or written last.
    used: SystemTime,
}

/// Removes what was not used for longest, until the rest fits into a budget; but not the file `but`, and not
/// what another program writes.
///
/// What cannot be listed or removed stays: the next program tries again.
pub(super) fn make(directory: &Path, budget: u64, but: &Path) {
    let Ok(entries) = fs::read_dir(directory) else { return };
    let mut kept: Vec<Kept> = entries.flatten().filter_map(|entry| of_entry(&entry)).collect();
    let mut bytes: u64 = kept.iter().map(|kept| kept.bytes).sum();
    kept.sort_by_key(|kept| kept.used);
    for Kept { path, bytes: of_file, .. } in kept {
        if bytes <= budget {
            return;
        }
        if path == but || is_written(&path) {
            continue;
        }
        match path.extension().is_some_and(|ending| ending == "vastex") {
            true => remove(&path),
            false => remove_unfinished(&path.with_file_name(target(&path))),
        }
        if !path.exists() {
            bytes -= of_file;
        }
    }
}

/// Removes a container, if it is there.
pub(super) fn remove(place: &Path) {
    let _ = fs::remove_file(place);
}

/// Removes what was made so far of a container.
pub(super) fn remove_unfinished(place: &Path) {
    for ending in [PARTIAL, JOURNAL] {
        let name = place.file_name().unwrap_or_default().to_string_lossy();
        remove(&place.with_file_name(format!(".{name}{ending}")));
    }
}

/// The container that an unfinished one is to become.
fn target(partial: &Path) -> String {
    let name = partial.file_name().unwrap_or_default().to_string_lossy();
    name.trim_start_matches('.').trim_end_matches(PARTIAL).to_owned()
}

fn of_entry(entry: &DirEntry) -> Option<Kept> {
    let name = entry.file_name();
    let name = name.to_str()?;
    let container = name.strip_prefix('.').and_then(|name| name.strip_suffix(PARTIAL)).unwrap_or(name);
    let key = container.strip_suffix(ENDING)?;
    let is_key = key.len() == DIGITS && key.bytes().all(|byte| byte.is_ascii_hexdigit());
    let found = entry.metadata().ok().filter(|found| is_key && found.is_file())?;
    let used = [found.accessed(), found.modified()].into_iter().flatten().max().unwrap_or(UNIX_EPOCH);
    Some(Kept { path: entry.path(), bytes: found.len(), used })
}

/// Whether another program is at it. A build holds a lock on what it writes.
fn is_written(path: &Path) -> bool {
    File::open(path).is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
}
