//! What keys do that are pressed once, alone and with others.

use super::{Action, Key};
use crate::camera::Move;
use crate::scene::Scene;

/// What a letter does with control: what other programs have on it. What it does alone it does not do by
/// accident with control.
pub(super) fn action_with_control(letter: char) -> Option<Action> {
    Some(match letter.to_ascii_lowercase() {
        'c' if letter == 'C' => Action::CopyLink,
        'o' => Action::Open,
        's' => Action::Screenshot(1),
        'c' => Action::CopyView,
        'v' => Action::PasteView,
        'q' => Action::Quit,
        _ => return None,
    })
}

/// What a key does with Alt.
pub(super) fn action_with_alt(key: Key) -> Option<Action> {
    Some(match key {
        Key::Left => Action::File(-1),
        Key::Right => Action::File(1),
        Key::Enter => Action::FillScreen,
        // Alone they do the same.
        Key::F(_) => return action_of(key),
        _ => return None,
    })
}

/// What a key does alone, once.
pub(super) fn action_of(key: Key) -> Option<Action> {
    Some(match key {
        Key::Escape | Key::Char('q' | 'Q') => Action::Quit,
        Key::Home | Key::Char('r' | 'R' | '0') => Action::Reset,
        Key::PageDown | Key::Char('n' | 'N') => Action::File(1),
        Key::PageUp | Key::Char('p' | 'P') => Action::File(-1),
        Key::Tab => Action::EnterPanel,
        Key::Char('e' | 'E') => Action::Scene(None),
        Key::Char('u' | 'U') => Action::Hud,
        Key::F(11) | Key::Char('f' | 'F') => Action::FillScreen,
        Key::Char('l' | 'L') => Action::Overlay,
        Key::Char('c' | 'C') => Action::AutoRange,
        Key::Char('g' | 'G') => Action::Guides,
        Key::Char('j' | 'J') => Action::Values,
        Key::Char('v' | 'V') => Action::Compare,
        Key::Char('b' | 'B') => Action::Beside,
        Key::Char('k' | 'K') => Action::Measure,
        Key::Backspace => Action::Undo,
        Key::Char('t') => Action::Move(Move::Turn(90.0)),
        Key::Char('T') => Action::Move(Move::Turn(-90.0)),
        Key::Char('x' | 'X') => Action::Move(Move::Flip { is_vertical: false }),
        Key::Char('y' | 'Y') => Action::Move(Move::Flip { is_vertical: true }),
        Key::Char('z' | 'Z') => Action::Move(Move::Upright),
        Key::Char('m' | 'M') => Action::Panel,
        Key::Char('?' | 'h' | 'H') => Action::Keys,
        Key::F(5) => Action::Screenshot(1),
        Key::F(6) => Action::Screenshot(2),
        Key::F(7) => Action::Screenshot(4),
        Key::F(8) => Action::Record,
        Key::F(9) => Action::Play,
        Key::F(1) => Action::Scene(Some(Scene::Image)),
        Key::F(2) => Action::Scene(Some(Scene::Plane)),
        Key::F(3) => Action::Scene(Some(Scene::Globe)),
        Key::F(4) => Action::Scene(Some(Scene::Terrain)),
        Key::F(10) => Action::Scene(Some(Scene::Planet)),
        _ => return None,
    })
}
