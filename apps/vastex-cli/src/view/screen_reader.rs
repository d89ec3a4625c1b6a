//! Screen readers: they are told of the panels each time egui has run, and what they ask for is what egui
//! hears next, as if it came from keys or the pointer.
//!
//! `connected` reaches them by AccessKit, where the system's own library is enough, and on Linux with the
//! feature `screen-reader`: there the way is D-Bus, and a client of that compiles as long as the rest of the
//! window. `silent` has the same functions where nobody is reached.

#[cfg(any(feature = "screen-reader", windows, target_os = "macos"))]
mod connected;
#[cfg(not(any(feature = "screen-reader", windows, target_os = "macos")))]
mod silent;

use egui::accesskit::TreeUpdate;

use super::Message;
#[cfg(any(feature = "screen-reader", windows, target_os = "macos"))]
pub(super) use connected::{Asked, Reader, create_window, hear};
#[cfg(not(any(feature = "screen-reader", windows, target_os = "macos")))]
pub(super) use silent::{Asked, Reader, create_window, hear};

impl From<Asked> for Message {
    fn from(asked: Asked) -> Message {
        Message::Reader(asked)
    }
}

/// The window has a name among what is told, by which it is found.
pub(super) fn name_window(told: &mut TreeUpdate, name: &str) {
    let Some(tree) = &mut told.tree else { return };
    tree.toolkit_name = Some("egui".to_owned());
    let window = told.nodes.iter_mut().find(|(id, _)| *id == tree.root);
    window.into_iter().for_each(|(_, window)| window.set_label(name));
}
