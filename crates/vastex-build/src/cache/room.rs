//! What lies in a cache's directory, who may change it, and which of it goes where there is too much.
//!
//! `KEY.vastex` is a container, `.KEY.vastex.partial` and `.KEY.vastex.journal` are what a build has made so
//! far of one, and `.KEY.vastex.lock`, which is empty, keeps programs apart; KEY has 32 hexadecimal digits.
//! Files of other names are nobody's business here.
//!
//! A lock that nobody holds goes when room is made. Only who holds a lock removes its file, and who has got
//! one looks whether the file still lies there: else another program has removed it meanwhile, and a third
//! one may hold the next one by the same name.

use std::collections::HashMap;
use std::fs::{self, DirEntry, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

const ENDING: &str = ".vastex";
const LOCK: &str = "lock";
/// Endings of what a build has made so far.
const UNFINISHED: [&str; 2] = ["partial", "journal"];
const DIGITS: usize = 32;

/// The name of a container.
pub(super) fn name_of(key: u128) -> String {
    format!("{key:032x}{ENDING}")
}

/// A file that belongs to a container which is not finished.
fn beside(directory: &Path, name: &str, ending: &str) -> PathBuf {
    directory.join(format!(".{name}.{ending}"))
}

/// The right to build a container, or to remove it with what was made so far of it.
pub(super) enum Lock {
    /// This program has the right until the file is closed.
    Ours(File),
    /// Another program has it.
    Taken,
    /// The file system knows no locks.
    Unknown(File),
}

/// How often a lock is asked for that others remove meanwhile.
const TRIES: usize = 8;

/// Asks for the right to a container. Where others remove its file again and again it counts as taken, so
/// that who waits for it asks again later.
pub(super) fn lock(directory: &Path, name: &str) -> io::Result<Lock> {
    let place = beside(directory, name, LOCK);
    for _ in 0..TRIES {
        let file = File::options().create(true).append(true).open(&place)?;
        match file.try_lock() {
            // One that was removed since it was opened keeps nobody out.
            Ok(()) if !lies_at(&file, &place) => {}
            Ok(()) => return Ok(Lock::Ours(file)),
            Err(TryLockError::WouldBlock) => return Ok(Lock::Taken),
            Err(TryLockError::Error(_)) => return Ok(Lock::Unknown(file)),
        }
    }
    Ok(Lock::Taken)
}

/// Returns true if an open file is the one that lies at a place.
#[cfg(unix)]
fn lies_at(file: &File, place: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;

    let number = |found: fs::Metadata| (found.dev(), found.ino());
    let [open, there] = [file.metadata(), fs::metadata(place)].map(|found| found.ok().map(number));
    open.is_some() && open == there
}

/// Where files have no numbers that can be asked for, no lock is removed.
#[cfg(not(unix))]
fn lies_at(_: &File, _: &Path) -> bool {
    true
}

/// Removes the locks that nobody holds.
fn remove_locks(directory: &Path) {
    if cfg!(not(unix)) {
        return;
    }
    let Ok(entries) = fs::read_dir(directory) else { return };
    for entry in entries.flatten() {
        if let Some((name, LOCK)) = parts_of(&entry).as_ref().map(|(name, ending)| (name, &**ending))
            // Held until its file is gone.
            && let Ok(Lock::Ours(_lock)) = lock(directory, name)
        {
            remove(&entry.path());
        }
    }
}

/// What there is of one container.
struct Kept {
    bytes: u64,
    /// When it was opened or written last.
    used: SystemTime,
}

/// Removes what was not used for longest, until the rest fits into a budget; but not the container `but`, nor
/// what another program has a lock on.
///
/// Locks that nobody holds go in any case. What cannot be listed or removed stays: the next program tries
/// again.
pub(super) fn make(directory: &Path, budget: u64, but: &str) {
    make_room(directory, budget, but);
    remove_locks(directory);
}

fn make_room(directory: &Path, budget: u64, but: &str) {
    let mut kept: Vec<(String, Kept)> = list(directory).into_iter().collect();
    let mut bytes: u64 = kept.iter().map(|(_, kept)| kept.bytes).sum();
    kept.sort_by_key(|(_, kept)| kept.used);
    for (name, kept) in kept {
        if bytes <= budget {
            return;
        }
        if name == but || kept.bytes == 0 {
            continue;
        }
        let Ok(Lock::Ours(_lock)) = lock(directory, &name) else { continue };
        let place = directory.join(&name);
        remove(&place);
        remove_unfinished(&place);
        let left = list(directory).get(&name).map_or(0, |left| left.bytes);
        bytes -= kept.bytes.saturating_sub(left);
    }
}

/// Everything in a directory, by the names of containers.
fn list(directory: &Path) -> HashMap<String, Kept> {
    let mut kept = HashMap::new();
    let Ok(entries) = fs::read_dir(directory) else { return kept };
    for (name, entry) in entries.flatten().filter_map(|entry| Some((container_of(&entry)?, entry))) {
        let Ok(found) = entry.metadata() else { continue };
        let used = [found.accessed(), found.modified()].into_iter().flatten().max().unwrap_or(UNIX_EPOCH);
        let of_name = kept.entry(name).or_insert(Kept { bytes: 0, used: UNIX_EPOCH });
        of_name.bytes += found.len();
        of_name.used = of_name.used.max(used);
    }
    kept
}

/// The name of the container that a file is, or whose build it belongs to.
fn container_of(entry: &DirEntry) -> Option<String> {
    let (container, ending) = parts_of(entry)?;
    (ending.is_empty() || UNFINISHED.contains(&&*ending)).then_some(container)
}

/// The name of the container that a file belongs to, and its own ending; none for a container.
fn parts_of(entry: &DirEntry) -> Option<(String, String)> {
    let name = entry.file_name();
    let name = name.to_str()?;
    let hidden = name.strip_prefix('.').and_then(|name| name.rsplit_once('.'));
    let (container, ending) = hidden.unwrap_or((name, ""));
    let key = container.strip_suffix(ENDING)?;
    let is_key = key.len() == DIGITS && key.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_key.then(|| (container.to_owned(), ending.to_owned()))
}

/// Removes a container, if it is there.
pub(super) fn remove(place: &Path) {
    let _ = fs::remove_file(place);
}

/// Removes what was made so far of a container.
pub(super) fn remove_unfinished(place: &Path) {
    let (Some(directory), Some(name)) = (place.parent(), place.file_name()) else { return };
    for ending in UNFINISHED {
        remove(&beside(directory, &name.to_string_lossy(), ending));
    }
}
