//! The files that were opened lately, remembered from one run to the next.

use std::path::{Path, PathBuf};

use super::state;

/// So many are remembered.
const MOST: usize = 12;

/// The files that were opened lately, the last one first, and where they are written down.
#[derive(Debug, Default)]
pub(super) struct Recent {
    files: Vec<String>,
    /// `None` if the system names no place for it.
    kept_in: Option<PathBuf>,
}

impl Recent {
    /// Those of the runs before. What cannot be read counts as none: nothing but convenience is lost.
    pub(super) fn load() -> Recent {
        state::place_of("recent.json").map(Recent::load_from).unwrap_or_default()
    }

    fn load_from(place: PathBuf) -> Recent {
        Recent { files: state::load(&place), kept_in: Some(place) }
    }

    /// The files, the last one first.
    pub(super) fn files(&self) -> &[String] {
        &self.files
    }

    /// A file was opened. Two programs may do so at once: what the other one wrote down stays.
    pub(super) fn add(&mut self, file: &Path) {
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        // A list in JSON has none of the others.
        let Some(file) = file.to_str().map(str::to_owned) else { return };
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
            drop(state::write(place, &self.files));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn files_come_first_when_they_are_opened() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("of/vastex/recent.json");
        let file = |n: usize| directory.path().join(format!("{n}.png"));
        let named = |n: usize| file(n).to_str().unwrap().to_owned();
        let mut recent = Recent::load_from(place.clone());
        let mut other = Recent::load_from(place.clone());
        (0..MOST + 2).for_each(|n| recent.add(&file(n)));
        other.add(&file(5));
        recent.add(&file(99));
        let files = Recent::load_from(place.clone()).files;
        assert_eq!((files.len(), &files[..3]), (MOST, &[named(99), named(5), named(MOST + 1)][..]));
        let names: Vec<_> =
            fs::read_dir(place.parent().unwrap()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(names, ["recent.json"]);
        // Nonsense is no list of files.
        fs::write(&place, "[1, {").unwrap();
        assert!(Recent::load_from(place).files().is_empty());
    }
}
