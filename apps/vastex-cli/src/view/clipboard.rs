//! The clipboard of the system, for texts that are copied and pasted in the window.
//!
//! What another program copied is asked of that program, which may take its time to give it or never does. So
//! it is read on a thread, and nothing here waits.

use std::thread::{self, JoinHandle};

use arboard::Clipboard;

/// The clipboard, once something was copied. What is in it stays while this does, on systems where programs
/// keep what they copied.
#[derive(Default)]
pub(super) struct Copied {
    clipboard: Option<Clipboard>,
    /// What reads it.
    reading: Option<JoinHandle<()>>,
}

impl Copied {
    /// Copies a text. Says why where that cannot be.
    pub(super) fn copy(&mut self, text: &str) -> Result<(), String> {
        let clipboard = match self.clipboard.take() {
            Some(clipboard) => clipboard,
            None => Clipboard::new().map_err(|error| error.to_string())?,
        };
        self.clipboard.insert(clipboard).set_text(text).map_err(|error| error.to_string())
    }

    /// Hands the text that was copied last, in any program, to `send` on another thread, or why there is
    /// none. Says why where that cannot be, as while a text that was asked for before has not come.
    pub(super) fn read(
        &mut self,
        send: impl FnOnce(Result<String, String>) + Send + 'static,
    ) -> Result<(), String> {
        let get = || Clipboard::new().and_then(|mut clipboard| clipboard.get_text());
        self.read_by(move || get().map_err(|error| error.to_string()), send)
    }

    /// The same by `get`, which may take its time.
    pub(super) fn read_by(
        &mut self,
        get: impl FnOnce() -> Result<String, String> + Send + 'static,
        send: impl FnOnce(Result<String, String>) + Send + 'static,
    ) -> Result<(), String> {
        if self.reading.as_ref().is_some_and(|thread| !thread.is_finished()) {
            return Err("the program that copied it has not given it yet".to_owned());
        }
        let thread = thread::Builder::new().name("vastex-paste".into()).spawn(move || send(get()));
        self.reading = Some(thread.map_err(|error| error.to_string())?);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;
    use std::time::Duration;

    use super::*;

    const PATIENCE: Duration = Duration::from_secs(60);

    /// A program that gives nothing holds up neither the window nor, once it has, the next text.
    #[test]
    fn who_asks_for_a_text_does_not_wait_for_it_and_no_more_than_one_is_asked_for() {
        let (mut copied, (give, given), (send, sent)) = (Copied::default(), channel::<()>(), channel());
        let get = move || {
            given.recv_timeout(PATIENCE).unwrap();
            Ok("slow".to_owned())
        };
        let to = send.clone();
        copied.read_by(get, move |text| to.send(text).unwrap()).unwrap();
        let refused = copied.read_by(|| unreachable!("it is asked twice"), |_| {}).unwrap_err();
        assert!(refused.contains("not given it yet"), "{refused}");
        assert!(sent.try_recv().is_err());
        give.send(()).unwrap();
        assert_eq!(sent.recv_timeout(PATIENCE).unwrap(), Ok("slow".to_owned()));
        copied.reading.take().unwrap().join().unwrap();
        copied.read_by(|| Err("empty".to_owned()), move |text| send.send(text).unwrap()).unwrap();
        assert_eq!(sent.recv_timeout(PATIENCE).unwrap(), Err("empty".to_owned()));
    }
}
