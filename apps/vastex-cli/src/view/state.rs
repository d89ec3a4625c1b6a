//! What the program remembers from one run to the next: small files of JSON in the system's place for state.
//!
//! What cannot be written is left. What cannot be read counts as empty where it is of little worth; what a
//! person keeps is written only over what was read.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::Duration;
use std::{env, fs, io, process, thread};

use serde::Serialize;
use serde::de::DeserializeOwned;

/// `vastex/NAME` in `$XDG_STATE_HOME`, in `%LOCALAPPDATA%` on Windows, or else in `~/.local/state`; `None` if
/// the system names none of them.
pub(super) fn place_of(name: &str) -> Option<PathBuf> {
    let named =
        |variable: &str| env::var_os(variable).map(PathBuf::from).filter(|directory| directory.is_absolute());
    let of_system = if cfg!(windows) { named("LOCALAPPDATA") } else { None };
    let states = named("XDG_STATE_HOME").or(of_system);
    Some(states.or_else(|| Some(named("HOME")?.join(".local/state")))?.join("vastex").join(name))
}

/// How often a file that another program changes is tried again, and in how long.
const TRIES: u32 = 20;
const BETWEEN: Duration = Duration::from_millis(10);

/// What is written down in a file; the default if it cannot be read.
pub(super) fn load<T: DeserializeOwned + Default>(place: &Path) -> T {
    read(place).unwrap_or_default()
}

/// What is written down in a file; the default if there is no file.
pub(super) fn read<T: DeserializeOwned + Default>(place: &Path) -> io::Result<T> {
    match fs::read(place) {
        Ok(text) => Ok(serde_json::from_slice(&text)?),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(T::default()),
        Err(error) => Err(error),
    }
}

/// Keeps other programs from changing a file until what is given back is dropped. Fails where one takes
/// longer than that should take.
pub(super) fn lock(place: &Path) -> io::Result<File> {
    if let Some(directory) = place.parent() {
        fs::create_dir_all(directory)?;
    }
    let file = File::options().create(true).append(true).open(place.with_extension("lock"))?;
    for _ in 0..TRIES {
        match file.try_lock() {
            Ok(()) => return Ok(file),
            Err(TryLockError::WouldBlock) => thread::sleep(BETWEEN),
            Err(TryLockError::Error(error)) => return Err(error),
        }
    }
    Err(io::Error::new(io::ErrorKind::WouldBlock, "another program changes it"))
}

/// Writes it down, whole or not at all.
pub(super) fn write<T: Serialize>(place: &Path, kept: &T) -> io::Result<()> {
    let text = serde_json::to_vec_pretty(kept)?;
    if let Some(directory) = place.parent() {
        fs::create_dir_all(directory)?;
    }
    let unfinished = place.with_extension(format!("{}.tmp", process::id()));
    let written = fs::write(&unfinished, text).and_then(|()| fs::rename(&unfinished, place));
    written.inspect_err(|_| drop(fs::remove_file(&unfinished)))
}
