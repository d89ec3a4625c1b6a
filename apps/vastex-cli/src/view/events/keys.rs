//! Which key is pressed: what it writes, and where it writes nothing that a shortcut is called by, where it
//! is.
//!
//! Letters of other alphabets are pressed where a keyboard of Latin letters has those of the shortcuts, as in
//! other programs; on keyboards whose digits want Shift, digits are where they are.

use vastex_viewer::input::Key;
use winit::keyboard::{Key as WinitKey, KeyCode, NamedKey, PhysicalKey};

/// The key of what it writes and where it is, while Shift is held or not. Letters may be in either case.
pub(super) fn key(written: &WinitKey, place: PhysicalKey, is_shifted: bool) -> Option<Key> {
    let text = match written {
        WinitKey::Named(named) => return of_name(*named),
        WinitKey::Character(text) => text.as_str(),
        WinitKey::Dead(_) | WinitKey::Unidentified(_) => "",
    };
    let mut characters = text.chars();
    let single = characters.next().filter(|_| characters.next().is_none());
    let of_place = match place {
        PhysicalKey::Code(code) => at_place(code, is_shifted),
        PhysicalKey::Unidentified(_) => None,
    };
    let is_digit = |key: &char| key.is_ascii_digit();
    match single {
        Some(letter) if letter.is_ascii_alphanumeric() => Some(Key::Char(letter)),
        // Signs that mean something.
        Some(sign @ ('+' | '-' | '=' | '_' | '?')) => Some(Key::Char(sign)),
        Some(sign) if sign.is_ascii_graphic() => Some(Key::Char(of_place.filter(is_digit).unwrap_or(sign))),
        _ => of_place.map(Key::Char),
    }
}

/// What a keyboard of Latin letters writes at a place; digits only without Shift.
fn at_place(code: KeyCode, is_shifted: bool) -> Option<char> {
    const LETTERS: [(KeyCode, char); 26] = [
        (KeyCode::KeyA, 'a'),
        (KeyCode::KeyB, 'b'),
        (KeyCode::KeyC, 'c'),
        (KeyCode::KeyD, 'd'),
        (KeyCode::KeyE, 'e'),
        (KeyCode::KeyF, 'f'),
        (KeyCode::KeyG, 'g'),
        (KeyCode::KeyH, 'h'),
        (KeyCode::KeyI, 'i'),
        (KeyCode::KeyJ, 'j'),
        (KeyCode::KeyK, 'k'),
        (KeyCode::KeyL, 'l'),
        (KeyCode::KeyM, 'm'),
        (KeyCode::KeyN, 'n'),
        (KeyCode::KeyO, 'o'),
        (KeyCode::KeyP, 'p'),
        (KeyCode::KeyQ, 'q'),
        (KeyCode::KeyR, 'r'),
        (KeyCode::KeyS, 's'),
        (KeyCode::KeyT, 't'),
        (KeyCode::KeyU, 'u'),
        (KeyCode::KeyV, 'v'),
        (KeyCode::KeyW, 'w'),
        (KeyCode::KeyX, 'x'),
        (KeyCode::KeyY, 'y'),
        (KeyCode::KeyZ, 'z'),
    ];
    const OTHERS: [(KeyCode, char); 12] = [
        (KeyCode::Digit0, '0'),
        (KeyCode::Digit1, '1'),
        (KeyCode::Digit2, '2'),
        (KeyCode::Digit3, '3'),
        (KeyCode::Digit4, '4'),
        (KeyCode::Digit5, '5'),
        (KeyCode::Digit6, '6'),
        (KeyCode::Digit7, '7'),
        (KeyCode::Digit8, '8'),
        (KeyCode::Digit9, '9'),
        (KeyCode::Equal, '='),
        (KeyCode::Minus, '-'),
    ];
    let others = OTHERS.iter().filter(|_| !is_shifted);
    LETTERS.iter().chain(others).find(|(there, _)| *there == code).map(|(_, written)| *written)
}

fn of_name(named: NamedKey) -> Option<Key> {
    Some(match named {
        NamedKey::ArrowLeft => Key::Left,
        NamedKey::ArrowRight => Key::Right,
        NamedKey::ArrowUp => Key::Up,
        NamedKey::ArrowDown => Key::Down,
        NamedKey::Escape => Key::Escape,
        NamedKey::Enter => Key::Enter,
        NamedKey::Home => Key::Home,
        NamedKey::Tab => Key::Tab,
        NamedKey::Space => Key::Char(' '),
        NamedKey::Backspace => Key::Backspace,
        NamedKey::PageDown => Key::PageDown,
        NamedKey::PageUp => Key::PageUp,
        NamedKey::F1 => Key::F(1),
        NamedKey::F2 => Key::F(2),
        NamedKey::F3 => Key::F(3),
        NamedKey::F4 => Key::F(4),
        NamedKey::F5 => Key::F(5),
        NamedKey::F6 => Key::F(6),
        NamedKey::F7 => Key::F(7),
        NamedKey::F8 => Key::F(8),
        NamedKey::F9 => Key::F(9),
        NamedKey::F10 => Key::F(10),
        NamedKey::F11 => Key::F(11),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pressed(written: &str, place: KeyCode, is_shifted: bool) -> Option<Key> {
        key(&WinitKey::Character(written.into()), PhysicalKey::Code(place), is_shifted)
    }

    #[test]
    fn a_key_is_what_it_writes_and_in_other_alphabets_where_it_is() {
        for (written, place, is_shifted, expected) in [
            ("v", KeyCode::KeyV, false, 'v'),
            ("V", KeyCode::KeyV, false, 'V'),
            // Where Dvorak has its v.
            ("v", KeyCode::Period, false, 'v'),
            // AZERTY: a letter by its name, a digit without Shift and with it.
            ("a", KeyCode::KeyQ, false, 'a'),
            ("&", KeyCode::Digit1, false, '1'),
            ("é", KeyCode::Digit2, false, '2'),
            ("(", KeyCode::Digit5, false, '5'),
            ("5", KeyCode::Digit5, true, '5'),
            ("à", KeyCode::Digit0, false, '0'),
            // The same keyboard has these there.
            ("-", KeyCode::Digit6, false, '-'),
            // Shift and 1 is no 1 where that writes a sign.
            ("!", KeyCode::Digit1, true, '!'),
            ("?", KeyCode::Slash, true, '?'),
            ("+", KeyCode::BracketRight, false, '+'),
            // Russian, Greek, Hebrew, Arabic.
            ("м", KeyCode::KeyV, false, 'v'),
            ("М", KeyCode::KeyV, true, 'v'),
            ("т", KeyCode::KeyN, false, 'n'),
            ("ς", KeyCode::KeyW, false, 'w'),
            ("ה", KeyCode::KeyV, false, 'v'),
            ("لا", KeyCode::KeyB, false, 'b'),
            ("١", KeyCode::Digit1, false, '1'),
            ("ı", KeyCode::KeyI, false, 'i'),
        ] {
            assert_eq!(
                pressed(written, place, is_shifted),
                Some(Key::Char(expected)),
                "{written} at {place:?}"
            );
        }
        assert_eq!(pressed("ö", KeyCode::Semicolon, false), None);
        let dead = WinitKey::Dead(Some('^'));
        assert_eq!(key(&dead, PhysicalKey::Code(KeyCode::BracketLeft), false), None);
        let space = WinitKey::Named(NamedKey::Space);
        assert_eq!(key(&space, PhysicalKey::Code(KeyCode::Space), false), Some(Key::Char(' ')));
        let named = WinitKey::Named(NamedKey::F11);
        assert_eq!(key(&named, PhysicalKey::Code(KeyCode::F11), true), Some(Key::F(11)));
    }
}
