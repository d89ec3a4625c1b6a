//! Which source the window shows: another one than that which is to be shown, while that is being opened and
//! where it cannot be.

use std::path::{Path, PathBuf};

use super::App;

/// What is seen of a source, by the opening that brought it.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Shown {
    /// 0 before anything is seen.
    opening: u64,
    path: PathBuf,
}

impl Shown {
    /// From here on what an opening brought is seen. Returns true if that is of another source than before.
    pub(super) fn turn_to(&mut self, opening: u64, path: &Path) -> bool {
        let is_other = self.opening != opening;
        if is_other {
            (self.opening, self.path) = (opening, path.to_owned());
        }
        is_other
    }

    /// Returns true if it is what an opening brought: the source, or what has come of it so far.
    pub(super) fn is_of(&self, opening: u64) -> bool {
        self.opening == opening
    }

    /// Returns true if what is found in the file of an opening concerns somebody: the file is seen, or lies
    /// over what is seen, or is of the opening that goes on (`current`): if that fails, what is seen stays.
    #[cfg(feature = "build")]
    pub(super) fn concerns(&self, opening: u64, current: Option<u64>) -> bool {
        self.is_of(opening) || opening >= current.unwrap_or(self.opening)
    }

    /// The source; `None` before anything is seen.
    pub(super) fn path(&self) -> Option<&Path> {
        (self.opening > 0).then_some(&*self.path)
    }
}

impl App {
    /// The source that is seen; before anything is, the one that is to be.
    pub(super) fn shown_path(&self) -> &Path {
        self.shown.path().unwrap_or(self.files.current())
    }

    /// Returns true if what is seen is of the source that is being opened, and not of the one before.
    pub(super) fn is_opening_shown(&self) -> bool {
        self.openings.first().is_some_and(|opening| self.shown.is_of(opening))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_seen_stays_until_something_of_another_opening_is() {
        let mut shown = Shown::default();
        assert_eq!(shown.path(), None);
        assert!(shown.turn_to(1, Path::new("a")), "its preview");
        assert!(!shown.turn_to(1, Path::new("a")), "the source itself");
        #[cfg(feature = "build")]
        {
            assert!(shown.concerns(1, None) && shown.concerns(2, None) && !shown.concerns(0, None));
            assert!(shown.concerns(1, Some(3)) && shown.concerns(3, Some(3)), "3 may fail");
            assert!(!shown.concerns(2, Some(3)), "nobody waits for 2");
        }
        assert!(shown.is_of(1) && !shown.is_of(2) && shown.path() == Some(Path::new("a")));
        assert!(shown.turn_to(3, Path::new("c")), "2 brought nothing");
        assert_eq!(shown.path(), Some(Path::new("c")));
    }
}
