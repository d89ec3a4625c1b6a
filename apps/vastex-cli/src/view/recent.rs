//! The files that were opened lately, remembered from one run to the next.

use std::io;
use std::path::{Path, PathBuf};

use super::state;
use crate::open;

/// So many are remembered.
const MOST: usize = 12;

/// The files that were opened lately, the last one first, and where they are written down.
#[derive(Debug, Default)]
pub(super) struct Recent {
    files: Vec<String>,
    /// Those of them that could not be written down yet, the last one first.
    unwritten: Vec<String>,
    /// `None` if the system names no place for it.
    kept_in: Option<PathBuf>,
    /// True if it was said that they cannot be read or written.
    is_said: bool,
}

impl Recent {
    /// Those of the runs before. What cannot be read counts as none: nothing but convenience is lost.
    pub(super) fn load() -> Recent {
        state::place_of("recent.json").map(Recent::load_from).unwrap_or_default()
    }

    fn load_from(place: PathBuf) -> Recent {
        Recent { files: state::load(&place), kept_in: Some(place), ..Recent::default() }
    }

    /// The files, the last one first.
    pub(super) fn files(&self) -> &[String] {
        &self.files
    }

    /// A file was opened. Two programs may do so at once: what the other one wrote down stays. Where that
    /// cannot be read or written, the file is remembered for this run alone.
    pub(super) fn add(&mut self, file: &Path) {
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        // A list in JSON has none of the others.
        let Some(file) = file.to_str() else { return };
        if let Err(error) = self.add_in_file(file) {
            put_first(&mut self.files, file);
            put_first(&mut self.unwritten, file);
            // Another program that changes them is soon done.
            if error.kind() != io::ErrorKind::WouldBlock {
                self.say(&error);
            }
        }
    }

    /// Adds a file to those that are written down now. Where that fails, all is as it was.
    fn add_in_file(&mut self, file: &str) -> io::Result<()> {
        let mut files = self.files.clone();
        if let Some(place) = &self.kept_in {
            let _lock = state::lock(place)?;
            let written: Vec<String> = state::read(place)?;
            // Where nothing could be written, what is known stays.
            if !written.is_empty() {
                files = written;
            }
            self.unwritten.iter().rev().for_each(|file| put_first(&mut files, file));
            put_first(&mut files, file);
            state::write(place, &files)?;
        } else {
            put_first(&mut files, file);
        }
        (self.files, self.unwritten) = (files, Vec::new());
        Ok(())
    }

    /// Says once why they are for this run alone, and what to do.
    fn say(&mut self, error: &io::Error) {
        state::say_once(&mut self.is_said, self.kept_in.as_deref(), "opened files are remembered", error);
    }
}

/// Puts a file before all others, by the words by which it was opened last: a stack as a volume, or page by
/// page.
fn put_first(files: &mut Vec<String>, file: &str) {
    let opened = open::file_of_stack(Path::new(file));
    files.retain(|other| !open::is_file_or_its_stack(Path::new(other), opened));
    files.insert(0, file.to_owned());
    files.truncate(MOST);
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    /// A stack is a volume and pages, in one file.
    #[cfg(feature = "build")]
    #[test]
    fn a_stack_is_one_file_however_it_is_shown() {
        let directory = tempfile::tempdir().unwrap();
        let [file, other] = ["a.tif", "b.tif"].map(|name| directory.path().join(name));
        [&file, &other].into_iter().for_each(|file| fs::write(file, "").unwrap());
        let named = |name: &str| format!("{}{name}", file.display());
        let mut recent = Recent::default();
        for name in ["", ":volume", ":first"] {
            recent.add(&other);
            recent.add(Path::new(&named(name)));
            assert_eq!(recent.files(), [named(name), other.display().to_string()]);
        }
        // Other images of a file, and its bands, are other pictures.
        recent.add(Path::new(&named(":label")));
        recent.add(Path::new(&named(":bands=1")));
        assert_eq!(recent.files()[..3], [":bands=1", ":label", ":first"].map(named));
    }

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
        let mut names: Vec<_> =
            fs::read_dir(place.parent().unwrap()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["recent.json", "recent.lock"]);
        // Nonsense is no list of files, and is not written over: it may be mended.
        fs::write(&place, "[1, {").unwrap();
        let mut recent = Recent::load_from(place.clone());
        assert!(recent.files().is_empty());
        (0..2).for_each(|n| recent.add(&file(n)));
        assert_eq!(recent.files(), [named(1), named(0)], "for this run alone");
        assert_eq!(fs::read_to_string(&place).unwrap(), "[1, {");
        // Mended, it has those of this run as well.
        fs::write(&place, format!("[{:?}]", named(7))).unwrap();
        recent.add(&file(2));
        let files = [named(2), named(1), named(0), named(7)];
        assert_eq!((recent.files(), Recent::load_from(place.clone()).files), (&files[..], files.to_vec()));
        // So it has those of while another program changed it.
        let lock = state::lock(&place).unwrap();
        recent.add(&file(3));
        drop(lock);
        recent.add(&file(4));
        assert_eq!(Recent::load_from(place).files[..3], [named(4), named(3), named(2)]);
    }
}
