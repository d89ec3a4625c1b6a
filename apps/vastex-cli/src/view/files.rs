//! Which files there are to step through: those that a person named or dropped, or, for a single one, those
//! beside it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::open;

/// Endings of the files of a folder that are stepped through. Any file can be named.
const ENDINGS: [&str; 11] = ["vastex", "jpg", "jpeg", "png", "tif", "tiff", "svs", "tx", "exr", "dzi", "ctx"];
/// Files that are dropped within this time are dropped together.
const TOGETHER: Duration = Duration::from_millis(200);

/// A list of files and the one that is shown.
pub(super) struct Files {
    files: Vec<PathBuf>,
    current: usize,
    dropped_at: Option<Duration>,
}

impl Files {
    pub(super) fn new(first: &Path, others: &[PathBuf]) -> Files {
        let files = std::iter::once(first.to_owned()).chain(others.iter().cloned()).collect();
        Files { files, current: 0, dropped_at: None }
    }

    /// The file to show.
    pub(super) fn current(&self) -> &Path {
        &self.files[self.current]
    }

    /// Whether there may be others to show, which were named or dropped.
    pub(super) fn has_others(&self) -> bool {
        self.files.len() > 1 || self.dropped_at.is_some()
    }

    /// A file was dropped at a time. The first one dropped is shown, and those that come with it are stepped
    /// through.
    pub(super) fn drop_in(&mut self, path: &Path, now: Duration) -> bool {
        let is_first = self.dropped_at.is_none_or(|before| now.saturating_sub(before) > TOGETHER);
        self.dropped_at = Some(now);
        if is_first {
            (self.files, self.current) = (vec![path.to_owned()], 0);
        } else {
            self.files.push(path.to_owned());
        }
        is_first
    }

    /// Goes so many files on, round from the last to the first. Returns true if that is another one.
    pub(super) fn step(&mut self, step: i32) -> bool {
        if let [single] = &self.files[..] {
            // Beside an image in a file is what lies beside the file.
            let file = open::file_of(single);
            let Some((folder, current)) = folder_of(file) else { return false };
            (self.files, self.current) = (folder, current);
        }
        let before = self.current;
        let count = self.files.len() as i64;
        self.current = (before as i64 + i64::from(step)).rem_euclid(count) as usize;
        self.current != before
    }
}

/// The files of a folder that may be shown, in the order of their names, and which of them `file` is.
fn folder_of(file: &Path) -> Option<(Vec<PathBuf>, usize)> {
    let folder = match file.parent()? {
        folder if folder.as_os_str().is_empty() => Path::new("."),
        folder => folder,
    };
    let may_be_shown = |path: &PathBuf| {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        path.file_name() == file.file_name() || ENDINGS.contains(&ending.as_str()) && path.is_file()
    };
    let entries = std::fs::read_dir(folder).ok()?.filter_map(Result::ok).map(|entry| entry.path());
    let mut files: Vec<PathBuf> = entries.filter(may_be_shown).collect();
    files.sort();
    let current = files.iter().position(|path| path.file_name() == file.file_name())?;
    Some((files, current))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(files: &Files) -> String {
        files.current().file_name().unwrap().to_string_lossy().into_owned()
    }

    #[test]
    fn several_files_are_stepped_through_and_a_single_one_with_its_folder() {
        let mut files = Files::new(Path::new("b"), &["a".into(), "c".into()]);
        assert!(files.step(1) && name(&files) == "a");
        assert!(files.step(-2) && name(&files) == "c", "round the end");
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.txt", "b.PNG", "c.vastex", "d.tif"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        std::fs::create_dir(folder.path().join("e.png")).unwrap();
        let mut files = Files::new(&folder.path().join("c.vastex"), &[]);
        let steps: Vec<String> = (0..3).map(|_| (files.step(1), name(&files)).1).collect();
        assert_eq!(steps, ["d.tif", "b.PNG", "c.vastex"]);
        let mut alone = Files::new(&folder.path().join("a.txt"), &[]);
        assert!(alone.step(1) && name(&alone) == "b.PNG", "it is in the list though its ending is none");
        assert!(!Files::new(&folder.path().join("gone/x.png"), &[]).step(1));
    }

    #[test]
    fn what_is_dropped_together_is_stepped_through() {
        let (mut files, ms) = (Files::new(Path::new("first"), &[]), Duration::from_millis);
        assert!(files.drop_in(Path::new("a"), ms(1000)) && name(&files) == "a");
        assert!(!files.drop_in(Path::new("b"), ms(1010)) && name(&files) == "a");
        assert!(files.step(1) && name(&files) == "b");
        assert!(files.drop_in(Path::new("c"), ms(5000)) && name(&files) == "c");
    }
}
