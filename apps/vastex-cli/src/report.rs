//! What is said: results on stdout, everything else on stderr. A reader that has gone away is no error.

use std::io::{self, Write};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use anyhow::{Context, Result};
use serde::Serialize;

/// Prints a result, a line or several, on stdout.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut stdout = io::stdout().lock();
    match writeln!(stdout, "{text}").and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(error).context("stdout cannot be written")
        }
        _ => Ok(()),
    }
}

/// Prints a result as one JSON object on stdout.
pub(crate) fn print_json(value: &impl Serialize) -> Result<()> {
    print(&serde_json::to_string(value)?)
}

/// Says something on stderr; where that cannot be written, there is nobody to tell.
pub(crate) fn say(text: &str) {
    let _ = writeln!(io::stderr(), "vastex: {text}");
}

/// Does something, and says a text where it takes longer than a second.
pub(crate) fn say_if_slow<T>(text: &str, work: impl FnOnce() -> T) -> T {
    if_slow(Duration::from_secs(1), || say(text), work)
}

/// Does something, and something else beside it where it takes longer than that.
fn if_slow<T>(patience: Duration, tell: impl FnOnce() + Send, work: impl FnOnce() -> T) -> T {
    let (working, ended) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            if ended.recv_timeout(patience) == Err(RecvTimeoutError::Timeout) {
                tell();
            }
        });
        let done = work();
        drop(working);
        done
    })
}

/// Says what was left out of an image, or what it cost.
#[cfg(feature = "build")]
pub(crate) fn say_of_image(image: &std::path::Path, notice: &vastex_build::Notice) {
    say(&format!("note: {}: {notice}", image.display()));
}

/// The whole story of an error on one line. Causes that the message before them tells already are left out.
pub(crate) fn message(error: &anyhow::Error) -> String {
    let mut message = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if message.is_empty() {
            message = cause;
        } else if !message.contains(&cause) {
            message = if cause.starts_with(&message) { cause } else { format!("{message}: {cause}") };
        }
    }
    message
}

/// A number of bytes for people.
pub(crate) fn bytes(count: u64) -> String {
    indicatif::BinaryBytes(count).to_string()
}

/// A share of 1 for people, in percent.
pub(crate) fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

/// The name of the file that a page is of, where its texture has a name.
pub(crate) fn file_of(textures: &vastex::Textures, page: vastex_core::PageId) -> Option<&str> {
    let texture = textures.inspect().id_of(page.texture())?;
    textures.texture(texture).ok()?.name()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_slow_is_told_and_what_is_not_is_not() {
        let (said, told) = mpsc::channel();
        let slow = || told.recv_timeout(Duration::from_secs(60)).is_ok();
        let say = move || {
            let _ = said.send(());
        };
        assert!(if_slow(Duration::ZERO, say, slow));
        let is_told = std::sync::atomic::AtomicBool::new(false);
        let tell = || is_told.store(true, std::sync::atomic::Ordering::Relaxed);
        assert_eq!(if_slow(Duration::from_secs(600), tell, || 7), 7);
        assert!(!is_told.into_inner());
    }

    #[test]
    fn no_cause_is_told_twice() {
        let error = anyhow::anyhow!("disk full").context("a.png: disk full").context("a.png");
        assert_eq!(message(&error), "a.png: disk full");
        let error = anyhow::anyhow!("too small").context("a.vastex");
        assert_eq!(message(&error), "a.vastex: too small");
    }
}
