//! Screen readers are reached.

use egui_winit::State;
use egui_winit::accesskit_winit::{Adapter, WindowEvent};
use winit::error::OsError;
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::window::{Window, WindowAttributes};

use super::super::Message;

/// What the system says for screen readers: that one wants to know what there is, or asks for something.
pub(in super::super) use egui_winit::accesskit_winit::Event as Asked;

/// What tells them of a window.
pub(in super::super) struct Reader(Adapter);

/// Opens a window. Nobody sees it before it is connected: some systems ask for what is in it once only.
pub(in super::super) fn create_window(
    events: &ActiveEventLoop,
    attributes: WindowAttributes,
    proxy: &EventLoopProxy<Message>,
) -> Result<(Window, Reader), OsError> {
    // A window that is not seen is no larger for it under X11, and seen for it on Windows.
    let is_maximized = attributes.maximized;
    let window = events.create_window(attributes.with_visible(false).with_maximized(false))?;
    let reader = Reader(Adapter::with_event_loop_proxy(events, &window, proxy.clone()));
    window.set_visible(true);
    if is_maximized {
        window.set_maximized(true);
    }
    Ok((window, reader))
}

impl Reader {
    /// Hands what egui says of the window to it from now on.
    pub(in super::super) fn join(self, state: &mut State) {
        state.accesskit = Some(self.0);
    }
}

/// The next run of egui is as they ask.
pub(in super::super) fn hear(state: &mut State, asked: Asked) {
    match asked.window_event {
        WindowEvent::InitialTreeRequested => state.egui_ctx().enable_accesskit(),
        WindowEvent::ActionRequested(request) => state.on_accesskit_action_request(request),
        WindowEvent::AccessibilityDeactivated => state.egui_ctx().disable_accesskit(),
    }
}
