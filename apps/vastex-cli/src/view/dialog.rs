//! The system's dialog for files, beside the loop of events.
//!
//! A dialog that is called off and one that never came up are told alike: nothing was chosen. So what is said
//! of that is true of both, and the window has a field for a path beside every dialog.

use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::thread;
use std::time::{Duration, Instant};

/// Hardly anybody calls a dialog off so soon: perhaps none came up.
const HARDLY_SEEN: Duration = Duration::from_millis(500);

/// What is asked for in a dialog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// A file in the place of what is shown.
    File,
    /// A folder in the place of what is shown.
    Folder,
    /// A file that is to lie over what is shown.
    FileOver,
}

/// What became of a dialog.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Chosen {
    Path(PathBuf),
    /// No answer: it was called off, or failed.
    Nothing,
    /// No answer, and so soon that there may be no dialog.
    NothingSoon,
}

impl Chosen {
    /// What an answer means that came after a time.
    fn of(answer: Option<PathBuf>, after: Duration) -> Chosen {
        match answer {
            Some(path) => Chosen::Path(path),
            None if after < HARDLY_SEEN => Chosen::NothingSoon,
            None => Chosen::Nothing,
        }
    }
}

/// What comes of a dialog that has begun.
type Asked = Pin<Box<dyn Future<Output = Option<rfd::FileHandle>> + Send>>;

/// Asks for what is wanted, beginning in the folder of `beside`; `send` is called on another thread with what
/// became of it.
pub(super) fn choose(wanted: Wanted, beside: &Path, send: impl FnOnce(Chosen) + Send + 'static) {
    let title = match wanted {
        Wanted::File => "Open",
        Wanted::Folder => "Open a folder",
        Wanted::FileOver => "Lay over",
    };
    let mut dialog = rfd::AsyncFileDialog::new().set_title(title);
    let folder = std::path::absolute(beside).ok().and_then(|path| Some(path.parent()?.to_owned()));
    if let Some(folder) = folder.filter(|folder| folder.is_dir()) {
        dialog = dialog.set_directory(folder);
    }
    // macOS has a dialog begun on the thread of the window, which this is called on; any thread may wait for
    // its end.
    let begun = Instant::now();
    let asked: Asked = match wanted {
        Wanted::Folder => Box::pin(dialog.pick_folder()),
        Wanted::File | Wanted::FileOver => Box::pin(dialog.pick_file()),
    };
    let answer = move || {
        let file = pollster::block_on(asked);
        send(Chosen::of(file.map(|file| file.path().to_owned()), begun.elapsed()));
    };
    // Where no thread can be started nothing comes, and a person asks again.
    drop(thread::Builder::new().name("vastex-dialog".into()).spawn(answer));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_chosen_counts_whenever_it_comes() {
        let [soon, late] = [0, 600].map(Duration::from_millis);
        let path = || Some(PathBuf::from("a.png"));
        for after in [soon, late] {
            assert_eq!(Chosen::of(path(), after), Chosen::Path("a.png".into()));
        }
        assert_eq!([soon, late].map(|after| Chosen::of(None, after)), [Chosen::NothingSoon, Chosen::Nothing]);
    }
}
