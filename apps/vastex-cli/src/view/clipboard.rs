//! The clipboard of the system, for texts that are copied in the window.

use arboard::Clipboard;

/// The clipboard, once something was copied. What is in it stays while this does, on systems where programs
/// keep what they copied.
#[derive(Default)]
pub(super) struct Copied {
    clipboard: Option<Clipboard>,
}

impl Copied {
    /// Copies a text. Says why where that cannot be.
    pub(super) fn copy(&mut self, text: &str) -> Result<(), String> {
        let said = |error: arboard::Error| error.to_string();
        let clipboard = match self.clipboard.take() {
            Some(clipboard) => clipboard,
            None => Clipboard::new().map_err(said)?,
        };
        self.clipboard.insert(clipboard).set_text(text).map_err(said)
    }
}
