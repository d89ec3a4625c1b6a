//! Views of files that a person keeps, remembered from one run to the next.

use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vastex_viewer::VolumeViewText;
use vastex_viewer::panels::Bookmark;

use super::state;
use crate::open;

/// So many files have bookmarks, and each so many.
const MOST_FILES: usize = 200;
const MOST: usize = 50;

/// The bookmarks of a file.
#[derive(Clone, Debug, Deserialize, Serialize)]
struct OfFile {
    file: PathBuf,
    /// The first one the oldest.
    views: Vec<Kept>,
}

/// A bookmark as it is written down: one without a name as the text of its view.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(untagged)]
enum Kept {
    View(String),
    Named { name: String, view: String },
}

impl From<Kept> for Bookmark {
    fn from(kept: Kept) -> Bookmark {
        match kept {
            Kept::View(view) => Bookmark { name: String::new(), view },
            Kept::Named { name, view } => Bookmark { name, view },
        }
    }
}

impl From<Bookmark> for Kept {
    fn from(Bookmark { name, view }: Bookmark) -> Kept {
        if name.is_empty() { Kept::View(view) } else { Kept::Named { name, view } }
    }
}

/// The bookmarks of the file that is displayed, and where those of all files are written down.
#[derive(Debug, Default)]
pub(super) struct Bookmarks {
    /// `None` if no file is displayed that has a name of its own.
    file: Option<PathBuf>,
    /// True if it is displayed as a volume. A stack is one, and an image, too: what is kept of either cannot
    /// be shown of the other.
    is_volume: bool,
    views: Vec<Bookmark>,
    /// `None` if the system names no place for them.
    kept_in: Option<PathBuf>,
    /// True if it was said that they cannot be read or written.
    is_said: bool,
}

impl Bookmarks {
    /// Those of the runs before, of no file yet.
    pub(super) fn load() -> Bookmarks {
        Bookmarks { kept_in: state::place_of("bookmarks.json"), ..Bookmarks::default() }
    }

    /// Another file is displayed, as a volume or not. One whose name is no text keeps its bookmarks for this
    /// run alone: JSON has no other names.
    pub(super) fn turn_to(&mut self, file: &Path, is_volume: bool) {
        let file = open::file_of_stack(file);
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        (self.file, self.is_volume) = (Some(file), is_volume);
        let mut all = self.all().unwrap_or_else(|error| {
            self.say(&error);
            Vec::new()
        });
        [self.views, _] = self.taken_out_of(&mut all);
    }

    /// Takes those of the file out of all: those of how it is displayed, and others. Lists of before may have
    /// the pages of a stack by a name of their own.
    fn taken_out_of(&self, all: &mut Vec<OfFile>) -> [Vec<Bookmark>; 2] {
        let file = self.file.as_deref();
        let is_of_it = |of: &mut OfFile| file.is_some_and(|file| open::is_file_or_its_stack(&of.file, file));
        let views = all.extract_if(.., is_of_it).flat_map(views_of);
        let (views, others) = views.partition(|view| VolumeViewText::is_meant(&view.view) == self.is_volume);
        [views, others]
    }

    /// The first one the oldest.
    pub(super) fn views(&self) -> &[Bookmark] {
        &self.views
    }

    /// Keeps a view, which one name is enough for; of too many the oldest goes.
    pub(super) fn keep(&mut self, view: &Bookmark) {
        self.change(|views| {
            views.retain(|other| other.view != view.view);
            views.push(view.clone());
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
    /// Where that cannot be read or written, they are changed for this run alone.
    fn change(&mut self, change: impl Fn(&mut Vec<Bookmark>)) {
        if let Err(error) = self.change_in_file(&change) {
            self.say(&error);
            change(&mut self.views);
        }
    }

    /// Changes what is written down. Where that fails, all is as it was.
    fn change_in_file(&mut self, change: &impl Fn(&mut Vec<Bookmark>)) -> io::Result<()> {
        let (Some(file), Some(place)) = (&self.file, &self.kept_in) else {
            change(&mut self.views);
            return Ok(());
        };
        let _lock = state::lock(place)?;
        let mut all = self.all()?;
        let [mut views, others] = self.taken_out_of(&mut all);
        // Where nothing could be written before, what is known stays.
        if views.is_empty() {
            views.clone_from(&self.views);
        }
        change(&mut views);
        if file.to_str().is_some() {
            let views: Vec<Kept> = others.into_iter().chain(views.iter().cloned()).map(Kept::from).collect();
            if !views.is_empty() {
                all.insert(0, OfFile { file: file.clone(), views });
            }
            all.truncate(MOST_FILES);
            state::write(place, &all)?;
        }
        self.views = views;
        Ok(())
    }

    /// Says once why they are for this run alone, and what to do.
    fn say(&mut self, error: &io::Error) {
        state::say_once(&mut self.is_said, self.kept_in.as_deref(), "bookmarks are kept", error);
    }

    /// Those of all files, the one last changed first.
    fn all(&self) -> io::Result<Vec<OfFile>> {
        self.kept_in.as_deref().map_or_else(|| Ok(Vec::new()), state::read)
    }
}

fn views_of(of: OfFile) -> Vec<Bookmark> {
    of.views.into_iter().map(Bookmark::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(text: &str) -> Bookmark {
        Bookmark { name: String::new(), view: text.to_owned() }
    }

    fn texts(bookmarks: &Bookmarks) -> Vec<&str> {
        bookmarks.views().iter().map(|bookmark| &*bookmark.view).collect()
    }

    #[test]
    fn a_bookmark_has_a_name_or_none_and_those_of_before_are_read() {
        let directory = tempfile::tempdir().unwrap();
        let kept_in = directory.path().join("bookmarks.json");
        let file = directory.path().join("moon.tif");
        let before = serde_json::json!([{ "file": file, "views": ["a", "b"] }]);
        std::fs::write(&kept_in, before.to_string()).unwrap();
        let begin = || {
            let mut bookmarks = Bookmarks { kept_in: Some(kept_in.clone()), ..Bookmarks::default() };
            bookmarks.turn_to(&file, false);
            bookmarks
        };
        let mut moon = begin();
        assert_eq!(moon.views(), [view("a"), view("b")]);
        let tycho = Bookmark { name: "Tycho".to_owned(), view: "a".to_owned() };
        moon.keep(&tycho);
        assert_eq!(begin().views(), [view("b"), tycho]);
        assert!(std::fs::read_to_string(&kept_in).unwrap().contains("\"Tycho\""));
    }

    /// A stack is a volume and pages, in one file, of either of which a bookmark shows nothing of the other.
    #[cfg(feature = "build")]
    #[test]
    fn a_stack_has_one_list_of_each_kind_of_views() {
        let directory = tempfile::tempdir().unwrap();
        let (file, kept_in) = (directory.path().join("a.tif"), directory.path().join("bookmarks.json"));
        std::fs::write(&file, "").unwrap();
        let named = |name: &str| format!("{}{name}", file.display());
        // Of before, when each name had a list.
        let [of_volume, page] = ["volume:slices;x=1", "image:x=1,y=2,zoom=3"];
        assert!(VolumeViewText::is_meant(of_volume) && !VolumeViewText::is_meant(page));
        let before = serde_json::json!([
            { "file": named(":first"), "views": [page] },
            { "file": named(""), "views": [of_volume] },
        ]);
        std::fs::write(&kept_in, before.to_string()).unwrap();
        let begin = |name: &str, is_volume| {
            let mut bookmarks = Bookmarks { kept_in: Some(kept_in.clone()), ..Bookmarks::default() };
            bookmarks.turn_to(Path::new(&named(name)), is_volume);
            bookmarks
        };
        for name in ["", ":first"] {
            assert_eq!(texts(&begin(name, false)), [page]);
        }
        begin("", false).keep(&view("b"));
        begin(":volume", true).keep(&view("volume:slices;x=2"));
        begin("", true).forget(0);
        assert_eq!(texts(&begin(":first", false)), [page, "b"]);
        assert_eq!(texts(&begin("", true)), ["volume:slices;x=2"]);
        let kept: Vec<OfFile> = state::load(&kept_in);
        assert_eq!((kept.len(), &kept[0].file), (1, &file));
        (0..2).for_each(|_| begin("", false).forget(0));
        assert_eq!(texts(&begin(":volume", true)), ["volume:slices;x=2"]);
    }

    #[test]
    fn a_file_has_its_own_bookmarks_in_every_run() {
        let directory = tempfile::tempdir().unwrap();
        let kept_in = Some(directory.path().join("of/bookmarks.json"));
        let begin = |file: &str| {
            let mut bookmarks = Bookmarks { kept_in: kept_in.clone(), ..Bookmarks::default() };
            bookmarks.turn_to(&directory.path().join(file), false);
            bookmarks
        };
        let (mut moon, mut other) = (begin("moon.tif"), begin("moon.tif"));
        moon.keep(&view("image:x=1,y=2,zoom=3"));
        other.keep(&view("image:x=4,y=5,zoom=6"));
        begin("mars.tif").keep(&view("image:x=7,y=8,zoom=9"));
        assert_eq!(texts(&begin("moon.tif")), ["image:x=1,y=2,zoom=3", "image:x=4,y=5,zoom=6"]);
        assert_eq!(texts(&begin("mars.tif")), ["image:x=7,y=8,zoom=9"]);
        assert!(begin("sun.tif").views().is_empty());
        other.forget(0);
        other.forget(9);
        assert_eq!(texts(&begin("moon.tif")), ["image:x=4,y=5,zoom=6"]);
        (0..MOST + 3).for_each(|n| moon.keep(&view(&n.to_string())));
        assert_eq!((moon.views().len(), texts(&moon)[0]), (MOST, "3"));
    }

    #[test]
    fn bookmarks_that_cannot_be_read_are_not_written_over() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("bookmarks.json");
        let begin = || {
            let mut bookmarks = Bookmarks { kept_in: Some(place.clone()), ..Bookmarks::default() };
            bookmarks.turn_to(Path::new("moon.tif"), false);
            bookmarks
        };
        // Cut off, of another version, or something that is no file at all.
        for text in ["[{\"file\": \"mars.tif\", \"vie", "{\"version\": 2}"] {
            std::fs::write(&place, text).unwrap();
            let mut bookmarks = begin();
            bookmarks.keep(&view("a"));
            bookmarks.keep(&view("b"));
            assert_eq!(texts(&bookmarks), ["a", "b"]);
            assert_eq!(std::fs::read_to_string(&place).unwrap(), text);
        }
        std::fs::remove_file(&place).unwrap();
        std::fs::create_dir(&place).unwrap();
        let mut bookmarks = begin();
        bookmarks.keep(&view("a"));
        assert!(texts(&bookmarks) == ["a"] && place.is_dir());
    }

    #[test]
    fn bookmarks_that_another_program_changes_are_waited_for() {
        let directory = tempfile::tempdir().unwrap();
        let place = directory.path().join("bookmarks.json");
        let begin = || {
            let mut bookmarks = Bookmarks { kept_in: Some(place.clone()), ..Bookmarks::default() };
            bookmarks.turn_to(Path::new("moon.tif"), false);
            bookmarks
        };
        let programs: Vec<_> = (0..4)
            .map(|program| {
                let mut bookmarks = begin();
                std::thread::spawn(move || {
                    (0..5).for_each(|n| bookmarks.keep(&view(&format!("{program}.{n}"))));
                })
            })
            .collect();
        programs.into_iter().for_each(|program| program.join().unwrap());
        assert_eq!(begin().views().len(), 20);
        // One that holds them for good is not waited for.
        let lock = state::lock(&place).unwrap();
        let mut bookmarks = begin();
        bookmarks.keep(&view("late"));
        assert_eq!((bookmarks.views().len(), begin().views().len()), (21, 20));
        drop(lock);
    }

    #[test]
    fn what_cannot_be_written_is_kept_for_this_run() {
        let mut bookmarks = Bookmarks::default();
        bookmarks.turn_to(Path::new("moon.tif"), false);
        bookmarks.keep(&view("a"));
        bookmarks.keep(&view("b"));
        bookmarks.forget(0);
        assert_eq!(texts(&bookmarks), ["b"]);
        // In the place of the directory lies a file.
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("vastex"), "").unwrap();
        bookmarks.kept_in = Some(directory.path().join("vastex/bookmarks.json"));
        bookmarks.keep(&view("c"));
        assert_eq!(texts(&bookmarks), ["b", "c"]);
    }
}
