//! Events of the window system in the words of the viewer.

mod keys;

use glam::DVec2;
use vastex_viewer::input::{Button, InputEvent, Key, Modifiers};
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, TouchPhase, WindowEvent};

/// True if the system goes on to scroll by itself when fingers leave a touchpad. Windows does, too, but winit
/// tells of lines there, as of a wheel.
const SYSTEM_HAS_MOMENTUM: bool = cfg!(any(target_os = "macos", target_os = "ios"));

/// What an event is to the viewer, while Shift is held or not; `None` if it is none of keys and pointer.
pub(super) fn translated(event: &WindowEvent, is_shifted: bool) -> Option<InputEvent> {
    Some(match event {
        WindowEvent::KeyboardInput { event, is_synthetic: false, .. } => InputEvent::Key {
            key: key(event, is_shifted)?,
            is_pressed: event.state == ElementState::Pressed,
            is_repeat: event.repeat,
        },
        WindowEvent::CursorMoved { position, .. } => {
            InputEvent::PointerMoved(DVec2::new(position.x, position.y))
        }
        WindowEvent::ModifiersChanged(modifiers) => {
            let held = modifiers.state();
            let (control, shift, alt) = (held.control_key(), held.shift_key(), held.alt_key());
            InputEvent::Modifiers(Modifiers { control, shift, alt })
        }
        WindowEvent::Touch(touch) => InputEvent::Touch {
            finger: touch.id,
            is_down: matches!(touch.phase, TouchPhase::Started | TouchPhase::Moved),
            place: DVec2::new(touch.location.x, touch.location.y),
        },
        WindowEvent::CursorLeft { .. } => InputEvent::PointerLeft,
        WindowEvent::MouseInput { state, button, .. } => {
            let button = match button {
                MouseButton::Left => Button::Primary,
                MouseButton::Right => Button::Secondary,
                _ => return None,
            };
            InputEvent::Button { button, is_pressed: *state == ElementState::Pressed }
        }
        // A wheel tells lines, a touchpad pixels.
        WindowEvent::MouseWheel { delta: MouseScrollDelta::LineDelta(_, y), .. } => {
            InputEvent::Wheel(f64::from(*y))
        }
        WindowEvent::MouseWheel { delta: MouseScrollDelta::PixelDelta(pixels), phase, .. } => {
            scrolled(DVec2::new(pixels.x, pixels.y), *phase, SYSTEM_HAS_MOMENTUM)
        }
        WindowEvent::PinchGesture { delta, .. } => InputEvent::Spread(1.0 + delta),
        WindowEvent::Focused(false) => InputEvent::FocusLost,
        WindowEvent::Focused(true) | WindowEvent::Occluded(false) => InputEvent::Shown,
        _ => return None,
    })
}

/// What winit says without the line of its source that says it.
pub(super) fn without_place(error: &str) -> &str {
    let said = error.strip_prefix("os error at ").and_then(|placed| placed.split_once(": "));
    said.map_or(error, |(_, why)| why)
}

/// The key that an event is of.
pub(super) fn key(event: &KeyEvent, is_shifted: bool) -> Option<Key> {
    keys::key(&event.logical_key, event.physical_key, is_shifted)
}

/// What fingers on a touchpad do that moved by so many pixels, where the system may go on by itself.
fn scrolled(pixels: DVec2, phase: TouchPhase, has_momentum: bool) -> InputEvent {
    match phase {
        TouchPhase::Ended if !has_momentum => InputEvent::ScrollEnd(pixels),
        _ => InputEvent::Scroll(pixels),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What macOS sends after the fingers is its own, and nothing is added to it.
    #[test]
    fn fingers_that_leave_a_touchpad_let_go_where_the_system_does_not_go_on_by_itself() {
        let step = DVec2::new(3.0, -4.0);
        for phase in [TouchPhase::Started, TouchPhase::Moved, TouchPhase::Cancelled] {
            for has_momentum in [false, true] {
                assert_eq!(scrolled(step, phase, has_momentum), InputEvent::Scroll(step));
            }
        }
        assert_eq!(scrolled(step, TouchPhase::Ended, true), InputEvent::Scroll(step));
        assert_eq!(scrolled(DVec2::ZERO, TouchPhase::Ended, false), InputEvent::ScrollEnd(DVec2::ZERO));
    }

    #[test]
    fn no_error_names_a_place_of_the_machine_that_built_the_program() {
        let error = "os error at /home/builder/.cargo/registry/winit/mod.rs:765: no display is named";
        assert_eq!(without_place(error), "no display is named");
        assert_eq!(without_place("no display is named"), "no display is named");
    }
}
