//! Texts that are copied and pasted in the fields of the window. A text that is pasted comes when the program
//! that copied it gives it, and goes into the field that it was asked for in.

use std::sync::mpsc::{Receiver, channel};

use egui::{Context, Event, Id};
use winit::event::KeyEvent;
use winit::keyboard::{Key as WinitKey, ModifiersState, NamedKey};

use super::super::clipboard::Copied;
use super::super::events;

/// What fields copy and paste.
#[derive(Default)]
pub(super) struct Pasting {
    copied: Copied,
    /// What was copied here last, where no other program can be given it.
    own: Option<String>,
    coming: Option<Coming>,
}

/// A text that was asked for.
struct Coming {
    text: Receiver<Result<String, String>>,
    /// The field that had the keys.
    field: Option<Id>,
}

/// Returns true if a key that goes down asks for what was copied.
pub(super) fn is_paste(event: &KeyEvent, held: ModifiersState) -> bool {
    use vastex_viewer::input::Key;
    let command = if cfg!(target_os = "macos") { ModifiersState::SUPER } else { ModifiersState::CONTROL };
    match &event.logical_key {
        WinitKey::Named(NamedKey::Paste) => true,
        WinitKey::Named(NamedKey::Insert) => held == ModifiersState::SHIFT,
        _ => held == command && matches!(events::key(event, false), Some(Key::Char('v' | 'V'))),
    }
}

impl Pasting {
    /// Copies a text; without a system's clipboard for the fields of this window.
    pub(super) fn copy(&mut self, text: &str) {
        self.own = self.copied.copy(text).is_err().then(|| text.to_owned());
    }

    /// Asks for the text that was copied last, for the field that has the keys; `wake` is called on another
    /// thread once it has come. While one is coming nothing more is asked for.
    pub(super) fn ask(&mut self, context: &Context, wake: impl FnOnce() + Send + 'static) {
        let (send, text) = channel();
        let send = move |text| {
            // Nobody listens where the window is closed.
            drop(send.send(text));
            wake();
        };
        if self.copied.read(send).is_ok() {
            self.coming = Some(Coming { text, field: context.memory(|memory| memory.focused()) });
        }
    }

    /// A text that has come, for the field that has the keys, as egui is told of it. One that was asked for
    /// in another field is nobody's.
    pub(super) fn arrived(&mut self, context: &Context) -> Option<Event> {
        let text = self.coming.as_ref()?.text.try_recv();
        if let Err(std::sync::mpsc::TryRecvError::Empty) = text {
            return None;
        }
        let Coming { field, .. } = self.coming.take()?;
        let text = text.ok()?.ok().or_else(|| self.own.clone())?.replace("\r\n", "\n");
        let is_there = field == context.memory(|memory| memory.focused());
        (is_there && !text.is_empty()).then_some(Event::Paste(text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What has come of a text that was asked for in a field, while another one has the keys or the same.
    fn pasted(asked_in: &str, has_keys: &str, text: Option<Result<&str, &str>>) -> (Option<Event>, bool) {
        let (context, (send, coming)) = (Context::default(), channel());
        let focus = |name: &str| context.memory_mut(|memory| memory.request_focus(Id::unique(name)));
        focus(asked_in);
        let field = context.memory(|memory| memory.focused());
        let mut pasting = Pasting { coming: Some(Coming { text: coming, field }), ..Pasting::default() };
        focus(has_keys);
        if let Some(text) = text {
            send.send(text.map(str::to_owned).map_err(str::to_owned)).unwrap();
        }
        let event = pasting.arrived(&context);
        (event, pasting.coming.is_some())
    }

    #[test]
    fn a_text_that_comes_late_goes_into_the_field_that_it_was_asked_for_in_and_into_no_other() {
        let paste = |text: &str| Some(Event::Paste(text.to_owned()));
        assert_eq!(pasted("path", "path", None), (None, true), "it has not come");
        assert_eq!(pasted("path", "path", Some(Ok("a\r\nb"))), (paste("a\nb"), false));
        assert_eq!(pasted("path", "name", Some(Ok("a"))), (None, false));
        assert_eq!(pasted("path", "path", Some(Ok(""))), (None, false));
        assert_eq!(pasted("path", "path", Some(Err("no text"))), (None, false));
    }

    #[test]
    fn without_a_clipboard_what_was_copied_in_the_window_is_pasted_there() {
        let (context, (send, text)) = (Context::default(), channel());
        let coming = Some(Coming { text, field: None });
        let mut pasting = Pasting { own: Some("mine".to_owned()), coming, ..Pasting::default() };
        send.send(Err("there is no clipboard".to_owned())).unwrap();
        assert_eq!(pasting.arrived(&context), Some(Event::Paste("mine".to_owned())));
    }
}
