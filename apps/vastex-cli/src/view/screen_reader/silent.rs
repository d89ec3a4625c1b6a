//! Screen readers are not reached.

use egui_winit::State;
use winit::error::OsError;
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::window::{Window, WindowAttributes};

use super::super::Message;

/// What they ask for: nothing.
#[derive(Clone, Copy)]
pub(in super::super) enum Asked {}

/// What tells them of a window: nothing.
pub(in super::super) struct Reader;

/// Opens a window.
pub(in super::super) fn create_window(
    events: &ActiveEventLoop,
    attributes: WindowAttributes,
    _: &EventLoopProxy<Message>,
) -> Result<(Window, Reader), OsError> {
    Ok((events.create_window(attributes)?, Reader))
}

impl Reader {
    pub(in super::super) fn join(self, _: &mut State) {}
}

pub(in super::super) fn hear(_: &mut State, asked: Asked) {
    match asked {}
}
