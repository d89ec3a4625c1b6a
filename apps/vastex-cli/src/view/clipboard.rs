//! The clipboard of the system, for texts that are copied and pasted in the window.

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
        self.clipboard()?.set_text(text).map_err(|error| error.to_string())
    }

    /// The text that was copied last, in any program. Says why where there is none.
    pub(super) fn text(&mut self) -> Result<String, String> {
        self.clipboard()?.get_text().map_err(|error| error.to_string())
    }

    fn clipboard(&mut self) -> Result<&mut Clipboard, String> {
        let clipboard = match self.clipboard.take() {
            Some(clipboard) => clipboard,
            None => Clipboard::new().map_err(|error| error.to_string())?,
        };
        Ok(self.clipboard.insert(clipboard))
    }
}
