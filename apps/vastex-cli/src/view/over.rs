//! Files that are laid over the one that is displayed: those that the command line names, and those that a
//! person adds in the window.
//!
//! They are opened one after another once the file beneath is there, and go with it.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::opening::OpeningEvent;
use super::viewer::OF_FILE;
use super::{App, name_of};
use crate::report;

/// Files that are yet to be laid over the one that is displayed.
#[derive(Default)]
pub(super) struct Over {
    /// The first of them is being opened, if `opening` says so.
    files: VecDeque<PathBuf>,
    /// The number of its opening.
    opening: Option<u64>,
    /// Those that lie there.
    laid: Vec<PathBuf>,
    /// The same of the file that is displayed, while another one is being opened in its place.
    aside: Option<(VecDeque<PathBuf>, Vec<PathBuf>)>,
}

impl Over {
    pub(super) fn new<'a>(files: impl Iterator<Item = &'a Path>) -> Over {
        Over { files: files.map(Path::to_owned).collect(), ..Over::default() }
    }

    /// Returns true if this is the opening of one of them.
    pub(super) fn is_of(&self, opening: u64) -> bool {
        self.opening == Some(opening)
    }

    /// Those that lie over what is seen, the lowest first. While another file is being opened that is the one
    /// before, unless something is seen of the other one already.
    pub(super) fn laid(&self, is_opening_shown: bool) -> &[PathBuf] {
        match &self.aside {
            Some((_, laid)) if !is_opening_shown => laid,
            _ => &self.laid,
        }
    }

    /// Those that lie over what is seen and those that are to, the lowest first.
    pub(super) fn all(&self, is_opening_shown: bool) -> impl Iterator<Item = &Path> {
        let files = match &self.aside {
            Some((files, _)) if !is_opening_shown => files,
            _ => &self.files,
        };
        self.laid(is_opening_shown).iter().chain(files).map(PathBuf::as_path)
    }

    /// Files that are to lie over the one that is being opened.
    pub(super) fn add(&mut self, files: Vec<PathBuf>) {
        self.files.extend(files);
    }

    /// Nothing is being opened any more. What was begun is opened again from its start.
    pub(super) fn begin_again(&mut self) {
        self.opening = None;
    }

    /// Another file is to be displayed in the place of the one that is: nothing is to lie over that.
    pub(super) fn set_aside(&mut self) {
        let before = (std::mem::take(&mut self.files), std::mem::take(&mut self.laid));
        self.opening = None;
        // Those of one that never was displayed go with it.
        self.aside.get_or_insert(before);
    }

    /// The other file is displayed: what was to lie over the one before is not needed.
    pub(super) fn drop_aside(&mut self) {
        self.aside = None;
    }

    /// The other file cannot be displayed: what was to lie over the one before goes on.
    pub(super) fn take_back(&mut self) {
        let (files, laid) = self.aside.take().unwrap_or_default();
        *self = Over { files, laid, ..Over::default() };
    }

    /// Another file is to be displayed, and nothing is, or it cannot be, but for what has come of it: nothing
    /// lies over that.
    pub(super) fn forget(&mut self) {
        *self = Over::default();
    }
}

impl App {
    /// Lays a file over the one that is displayed, as soon as what is being opened is there.
    pub(super) fn lay_over(&mut self, path: &Path) -> Result<()> {
        self.over.files.push_back(path.to_owned());
        self.open_next_over()
    }

    /// Begins to open the next file that is to lie over the one that is displayed, where there is one and
    /// nothing else is being opened.
    pub(super) fn open_next_over(&mut self) -> Result<()> {
        let (Some(open), Some(path)) = (&mut self.open, self.over.files.front().cloned()) else {
            return Ok(());
        };
        if self.openings.is_opening() || open.viewer.scene.is_empty() {
            return Ok(());
        }
        let number = self.begin(&path, false, false)?;
        self.over.opening = Some(number);
        Ok(())
    }

    /// Hears of a file that is to lie over the one that is displayed.
    pub(super) fn on_report_of_over(&mut self, path: &Path, event: OpeningEvent) -> Result<()> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let (name, viewer) = (name_of(path), &mut open.viewer);
        let laid = match event {
            OpeningEvent::Shapes(_) => return Ok(()),
            OpeningEvent::Progress(share) => return Ok(viewer.scene.set_opening(&name, share)?),
            OpeningEvent::Note(note) => {
                viewer.scene.beside.show_note(OF_FILE, &note);
                return Ok(());
            }
            #[cfg(feature = "build")]
            OpeningEvent::Mending(_) | OpeningEvent::LaterNote(_) => return Ok(()),
            // Only what is there lies over something.
            OpeningEvent::Preview(_) => return Ok(()),
            OpeningEvent::Opened(source) => match viewer.scene.lay_over(&name, source) {
                // The next frame finds that the device was lost, and opens the file again.
                Err(error) if error.is_device_lost() => return Ok(()),
                laid => laid.with_context(|| path.display().to_string()),
            },
            OpeningEvent::Failed(error) => Err(error),
            #[cfg(feature = "volumes")]
            OpeningEvent::Listed(listed) => Err(listed.into()),
            #[cfg(feature = "volumes")]
            OpeningEvent::Volume(_) => Err(anyhow::anyhow!(
                "{}: is a volume, which cannot lie over an image; open it alone",
                path.display()
            )),
        };
        viewer.scene.end_opening()?;
        self.openings.end();
        let file = self.over.files.pop_front();
        self.over.opening = None;
        if laid.is_ok() {
            self.over.laid.extend(file);
        }
        if let Err(error) = laid {
            self.outcome = Ok(std::process::ExitCode::FAILURE);
            let message = report::message(&error);
            report::say(&format!("error: {message}"));
            viewer.scene.beside.show_error("file over it", &message);
        }
        self.open_next_over()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A link and a picture of what is seen have the files over that.
    #[test]
    fn over_what_is_seen_lies_what_was_laid_over_it_while_another_file_is_opened() {
        let all = |over: &Over, is_opening_shown: bool| {
            over.all(is_opening_shown).map(|file| file.display().to_string()).collect::<Vec<_>>()
        };
        let mut over = Over { laid: vec!["a".into()], ..Over::default() };
        over.add(vec!["b".into()]);
        over.set_aside();
        over.add(vec!["of the next".into()]);
        assert_eq!((over.laid(false), all(&over, false)), (&["a".into()][..], vec!["a".into(), "b".into()]));
        // A preview of the next.
        assert_eq!((over.laid(true), all(&over, true)), (&[][..], vec!["of the next".to_owned()]));
        over.take_back();
        assert_eq!(
            (all(&over, false), all(&over, true)),
            (vec!["a".into(), "b".into()], vec!["a".into(), "b".into()])
        );
    }

    #[test]
    fn what_is_to_lie_over_a_file_waits_until_another_one_is_there() {
        let names =
            |over: &Over| over.files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>();
        let mut over = Over::new(["a".into(), "b".into()].iter().map(PathBuf::as_path));
        (over.opening, over.laid) = (Some(3), vec!["z".into()]);
        over.set_aside();
        assert!(names(&over).is_empty() && !over.is_of(3));
        // Over the other one, which is given up for a third.
        over.files.push_back("c".into());
        over.set_aside();
        over.take_back();
        assert_eq!((names(&over), &*over.laid), (vec!["a".to_owned(), "b".to_owned()], &["z".into()][..]));
        over.take_back();
        assert!(names(&over).is_empty(), "the file that they are for cannot be shown itself");
        let mut over = Over::new(["a".into()].iter().map(PathBuf::as_path));
        over.set_aside();
        over.files.push_back("d".into());
        over.drop_aside();
        assert_eq!(names(&over), ["d"]);
        over.set_aside();
        over.take_back();
        assert_eq!(names(&over), ["d"]);
    }
}
