//! Views of files that a person keeps, remembered from one run to the next.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::state;

/// So many files have bookmarks, and each so many.
const MOST_FILES: usize = 200;
const MOST: usize = 50;

/// The bookmarks of a file.
#[derive(Clone, Debug, Deserialize, Serialize)]
struct OfFile {
    file: PathBuf,
    /// Texts of poses, the first one the oldest.
    views: Vec<String>,
}

/// The bookmarks of the file that is displayed, and where those of all files are written down.
#[derive(Debug, Default)]
pub(super) struct Bookmarks {
    /// Nothing where no file is displayed that has a name of its own.
    file: Option<PathBuf>,
    views: Vec<String>,
    /// Nothing where the system names no place for them.
    kept_in: Option<PathBuf>,
}

impl Bookmarks {
    /// Those of the runs before, of no file yet.
    pub(super) fn load() -> Bookmarks {
        Bookmarks { kept_in: state::place_of("bookmarks.json"), ..Bookmarks::default() }
    }

    /// Another file is displayed. One whose name is no text keeps its bookmarks for this run alone: JSON has no other names.
    pub(super) fn turn_to(&mut self, file: &Path) {
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        self.views = self.all().into_iter().find(|of| of.file == file).map(|of| of.views).unwrap_or_default();
        self.file = Some(file);
    }

    /// Texts of poses, the first one the oldest.
    pub(super) fn views(&self) -> &[String] {
        &self.views
    }

    /// Keeps a view; of too many the oldest goes.
    pub(super) fn keep(&mut self, view: String) {
        self.change(|views| {
            views.retain(|other| *other != view);
            views.push(view);
            let surplus = views.len().saturating_sub(MOST);
            views.drain(..surplus);
        });
    }

    /// Forgets the view of an index.
    pub(super) fn forget(&mut self, index: usize) {
        let Some(gone) = self.views.get(index).cloned() else { return };
        self.change(|views| views.retain(|view| *view != gone));
    }

    /// Changes them as they are written down now: two programs may do so, and what the other one kept stays.
    fn change(&mut self, change: impl FnOnce(&mut Vec<String>)) {
        let mut all = self.all();
        let (Some(file), Some(place)) = (&self.file, &self.kept_in) else { return change(&mut self.views) };
        let mut views = match all.iter().position(|of| of.file == *file) {
            Some(at) => all.remove(at).views,
            // Where nothing could be written, what is known stays.
            None => std::mem::take(&mut self.views),
        };
        change(&mut views);
        self.views.clone_from(&views);
        if !views.is_empty() {
            all.insert(0, OfFile { file: file.clone(), views });
        }
        all.truncate(MOST_FILES);
        if file.to_str().is_some() {
            // Bookmarks that cannot be written are no reason to trouble the person.
            drop(state::write(place, &all));
        }
    }

    /// Those of all files, the one last changed first.
    fn all(&self) -> Vec<OfFile> {
        self.kept_in.as_deref().map(state::load).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_its_own_bookmarks_in_every_run() {
        let directory = tempfile::tempdir().unwrap();
        let kept_in = Some(directory.path().join("of/bookmarks.json"));
        let begin = |file: &str| {
            let mut bookmarks = Bookmarks { kept_in: kept_in.clone(), ..Bookmarks::default() };
            bookmarks.turn_to(&directory.path().join(file));
            bookmarks
        };
        let (mut moon, mut other) = (begin("moon.tif"), begin("moon.tif"));
        moon.keep("image:x=1,y=2,zoom=3".to_owned());
        other.keep("image:x=4,y=5,zoom=6".to_owned());
        begin("mars.tif").keep("image:x=7,y=8,zoom=9".to_owned());
        assert_eq!(begin("moon.tif").views(), ["image:x=1,y=2,zoom=3", "image:x=4,y=5,zoom=6"]);
        assert_eq!(begin("mars.tif").views(), ["image:x=7,y=8,zoom=9"]);
        assert!(begin("sun.tif").views().is_empty());
        other.forget(0);
        other.forget(9);
        assert_eq!(begin("moon.tif").views(), ["image:x=4,y=5,zoom=6"]);
        (0..MOST + 3).for_each(|n| moon.keep(n.to_string()));
        assert_eq!((moon.views().len(), &*moon.views()[0]), (MOST, "3"));
    }

    #[test]
    fn what_cannot_be_written_is_kept_for_this_run() {
        let mut bookmarks = Bookmarks::default();
        bookmarks.turn_to(Path::new("moon.tif"));
        bookmarks.keep("a".to_owned());
        bookmarks.keep("b".to_owned());
        bookmarks.forget(0);
        assert_eq!(bookmarks.views(), ["b"]);
        // In the place of the directory lies a file.
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("vastex"), "").unwrap();
        bookmarks.kept_in = Some(directory.path().join("vastex/bookmarks.json"));
        bookmarks.keep("c".to_owned());
        assert_eq!(bookmarks.views(), ["b", "c"]);
    }
}
