//! The files that were opened lately, remembered from one run to the next.

use std::path::{Path, PathBuf};
use std::{env, fs, io, process};

/// So many are remembered.
const MOST: usize = 12;

/// The files that were opened lately, the last one first, and where they are written down.
#[derive(Debug, Default)]
pub(super) struct Recent {
    files: Vec<PathBuf>,
    /// Nothing where the system names no place for it.
    kept_in: Option<PathBuf>,
}

impl Recent {
    /// Those of the runs before. What cannot be read counts as none: nothing but convenience is lost.
    pub(super) fn load() -> Recent {
        default_place().map(Recent::load_from).unwrap_or_default()
    }

    fn load_from(place: PathBuf) -> Recent {
        let text = fs::read(&place).unwrap_or_default();
        let files = serde_json::from_slice(&text).unwrap_or_default();
        Recent { files, kept_in: Some(place) }
    }

    /// The files, the last one first.
    pub(super) fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// A file was opened. Two programs may do so at once: what the other one wrote down stays.
    pub(super) fn add(&mut self, file: &Path) {
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        // A list in JSON has none of the others.
        if file.to_str().is_none() {
            return;
        }
        if let Some(place) = self.kept_in.take() {
            let Recent { files, kept_in } = Recent::load_from(place);
            self.kept_in = kept_in;
            // Where nothing could be written, what is known stays.
            if !files.is_empty() {
                self.files = files;
            }
        }
        self.files.retain(|other| *other != file);
        self.files.insert(0, file);
        self.files.truncate(MOST);
        if let Some(place) = &self.kept_in {
            // A list that cannot be written is no reason to trouble the person.
            drop(self.write(place));
        }
    }

    fn write(&self, place: &Path) -> io::Result<()> {
        let text = serde_json::to_vec_pretty(&self.files)?;
        if let Some(directory) = place.parent() {
            fs::create_dir_all(directory)?;
        }
        let unfinished = place.with_extension(format!("{}.tmp", process::id()));
        let written = fs::write(&unfinished, text).and_then(|()| fs::rename(&unfinished, place));
        written.inspect_err(|_| drop(fs::remove_file(&unfinished)))
    }
}

/// `vastex/recent.json` in `$XDG_STATE_HOME`, in `%LOCALAPPDATA%` on Windows, or else in `~/.local/state`.
fn default_place() -> Option<PathBuf> {
    let named =
        |variable: &str| env::var_os(variable).map(PathBuf::from).filter(|directory| directory.is_absolute());
    let of_system = if cfg!(windows) { named("LOCALAPPDATA") } else { None };
    let states = named("XDG_STATE_HOME").or(of_system);
    Some(states.or_else(|| Some(named("HOME")?.join(".local/state")))?.join("vastex").join("recent.json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_come_first_when_they_are_opened() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("of/vastex/recent.json");
        let file = |n: usize| directory.path().join(format!("{n}.png"));
        let mut recent = Recent::load_from(place.clone());
        let mut other = Recent::load_from(place.clone());
        (0..MOST + 2).for_each(|n| recent.add(&file(n)));
        other.add(&file(5));
        recent.add(&file(99));
        let files = Recent::load_from(place.clone()).files;
        assert_eq!((files.len(), &files[..3]), (MOST, &[file(99), file(5), file(MOST + 1)][..]));
        let names: Vec<_> =
            fs::read_dir(place.parent().unwrap()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(names, ["recent.json"]);
        // Nonsense is no list of files.
        fs::write(&place, "[1, {").unwrap();
        assert!(Recent::load_from(place).files().is_empty());
    }
}
