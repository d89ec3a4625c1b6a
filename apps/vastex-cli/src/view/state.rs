//! What the program remembers from one run to the next: small files of JSON in the system's place for state.
//!
//! Nothing but convenience is in them: what cannot be read counts as empty, and what cannot be written is left.

use std::path::{Path, PathBuf};
use std::{env, fs, io, process};

use serde::Serialize;
use serde::de::DeserializeOwned;

/// `vastex/NAME` in `$XDG_STATE_HOME`, in `%LOCALAPPDATA%` on Windows, or else in `~/.local/state`; nothing where the system names none of
/// them.
pub(super) fn place_of(name: &str) -> Option<PathBuf> {
    let named =
        |variable: &str| env::var_os(variable).map(PathBuf::from).filter(|directory| directory.is_absolute());
    let of_system = if cfg!(windows) { named("LOCALAPPDATA") } else { None };
    let states = named("XDG_STATE_HOME").or(of_system);
    Some(states.or_else(|| Some(named("HOME")?.join(".local/state")))?.join("vastex").join(name))
}

/// What is written down in a file.
pub(super) fn load<T: DeserializeOwned + Default>(place: &Path) -> T {
    let text = fs::read(place).unwrap_or_default();
    serde_json::from_slice(&text).unwrap_or_default()
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
