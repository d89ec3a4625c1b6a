//! Events of the window system in the words of the viewer.

use glam::DVec2;
use vastex_viewer::input::{Button, InputEvent, Key, Modifiers};
use winit::event::{ElementState, MouseButton, MouseScrollDelta, TouchPhase, WindowEvent};
use winit::keyboard::{Key as WinitKey, NamedKey};

/// What an event is to the viewer; `None` if it is none of keys and pointer.
pub(super) fn translated(event: &WindowEvent) -> Option<InputEvent> {
    Some(match event {
        WindowEvent::KeyboardInput { event, is_synthetic: false, .. } => InputEvent::Key {
            key: key(&event.logical_key)?,
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
        WindowEvent::MouseWheel { delta: MouseScrollDelta::PixelDelta(pixels), .. } => {
            InputEvent::Scroll(DVec2::new(pixels.x, pixels.y))
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

fn key(key: &WinitKey) -> Option<Key> {
    Some(match key {
        WinitKey::Named(NamedKey::ArrowLeft) => Key::Left,
        WinitKey::Named(NamedKey::ArrowRight) => Key::Right,
        WinitKey::Named(NamedKey::ArrowUp) => Key::Up,
        WinitKey::Named(NamedKey::ArrowDown) => Key::Down,
        WinitKey::Named(NamedKey::Escape) => Key::Escape,
        WinitKey::Named(NamedKey::Enter) => Key::Enter,
        WinitKey::Named(NamedKey::Home) => Key::Home,
        WinitKey::Named(NamedKey::Tab) => Key::Tab,
        WinitKey::Named(NamedKey::Backspace) => Key::Backspace,
        WinitKey::Named(NamedKey::PageDown) => Key::PageDown,
        WinitKey::Named(NamedKey::PageUp) => Key::PageUp,
        WinitKey::Named(NamedKey::F1) => Key::F(1),
        WinitKey::Named(NamedKey::F2) => Key::F(2),
        WinitKey::Named(NamedKey::F3) => Key::F(3),
        WinitKey::Named(NamedKey::F4) => Key::F(4),
        WinitKey::Named(NamedKey::F5) => Key::F(5),
        WinitKey::Named(NamedKey::F6) => Key::F(6),
        WinitKey::Named(NamedKey::F7) => Key::F(7),
        WinitKey::Named(NamedKey::F8) => Key::F(8),
        WinitKey::Named(NamedKey::F9) => Key::F(9),
        WinitKey::Named(NamedKey::F10) => Key::F(10),
        WinitKey::Named(NamedKey::F11) => Key::F(11),
        WinitKey::Character(text) => {
            let mut characters = text.chars();
            match (characters.next(), characters.next()) {
                (Some(character), None) => Key::Char(character),
                _ => return None,
            }
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_error_names_a_place_of_the_machine_that_built_the_program() {
        let error = "os error at /home/builder/.cargo/registry/winit/mod.rs:765: no display is named";
        assert_eq!(without_place(error), "no display is named");
        assert_eq!(without_place("no display is named"), "no display is named");
    }
}
