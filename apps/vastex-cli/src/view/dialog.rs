//! The system's dialog for files, beside the loop of events.

use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

/// Nobody calls a dialog off so soon: none came up.
const NOT_SEEN: Duration = Duration::from_millis(500);

/// What became of a dialog.
#[derive(Debug)]
pub(super) enum Chosen {
    File(PathBuf),
    /// It was called off.
    Nothing,
    /// The system has none.
    NoDialog,
}

/// Asks for a file under a title, beginning in the folder of `beside`; `send` is called on another thread
/// with what became of it.
pub(super) fn choose(title: &str, beside: &Path, send: impl FnOnce(Chosen) + Send + 'static) {
    let mut dialog = rfd::AsyncFileDialog::new().set_title(title);
    let folder = std::path::absolute(beside).ok().and_then(|path| Some(path.parent()?.to_owned()));
    if let Some(folder) = folder.filter(|folder| folder.is_dir()) {
        dialog = dialog.set_directory(folder);
    }
    let asked = dialog.pick_file();
    let answer = move || {
        let begun = Instant::now();
        // No answer is all that is told of a failure.
        let file = pollster::block_on(asked).map(|file| file.path().to_owned());
        send(match file {
            Some(file) => Chosen::File(file),
            None if begun.elapsed() < NOT_SEEN => Chosen::NoDialog,
            None => Chosen::Nothing,
        });
    };
    // Where no thread can be started nothing comes, and a person asks again.
    drop(thread::Builder::new().name("vastex-dialog".into()).spawn(answer));
}
