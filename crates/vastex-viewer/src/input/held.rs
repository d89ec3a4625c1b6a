//! Keys that are held: what they move, and how far in a time.

use std::time::Duration;

use glam::DVec2;

use super::Key;
use crate::camera::Move;

/// Steps per second of a key that is held; see [`crate::Pose::walked`].
pub(super) const WALK_PER_SECOND: f64 = 0.8;
/// Factor per second of a zoom key that is held.
pub(super) const ZOOM_PER_SECOND: f64 = 3.0;
/// Radians a second of a key that turns or tilts the camera.
const ORBIT_PER_SECOND: f64 = 0.8;
/// How many times as fast keys walk with Shift.
pub(super) const FASTER: f64 = 4.0;

/// A motion that goes on while its key is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    Left,
    Right,
    Forward,
    Back,
    In,
    Out,
    TurnLeft,
    TurnRight,
    TiltUp,
    TiltDown,
}

/// What keys that are held are worth, perhaps walking faster: those that turn and tilt the camera go first.
pub(super) fn held_move(motions: &[Motion], time: Duration, is_faster: bool) -> Move {
    let mut angles = DVec2::ZERO;
    for motion in motions {
        match motion {
            Motion::TurnLeft => angles.x -= 1.0,
            Motion::TurnRight => angles.x += 1.0,
            Motion::TiltUp => angles.y += 1.0,
            Motion::TiltDown => angles.y -= 1.0,
            _ => {}
        }
    }
    if angles == DVec2::ZERO {
        walk(motions, time, if is_faster { FASTER } else { 1.0 })
    } else {
        Move::Orbit(angles * ORBIT_PER_SECOND * time.as_secs_f64())
    }
}

pub(super) fn walk(motions: &[Motion], time: Duration, times: f64) -> Move {
    let (mut step, mut zoom) = (DVec2::ZERO, 0.0);
    for motion in motions {
        match motion {
            Motion::Left => step.x -= 1.0,
            Motion::Right => step.x += 1.0,
            Motion::Forward => step.y += 1.0,
            Motion::Back => step.y -= 1.0,
            Motion::In => zoom += 1.0,
            Motion::Out => zoom -= 1.0,
            Motion::TurnLeft | Motion::TurnRight | Motion::TiltUp | Motion::TiltDown => {}
        }
    }
    let seconds = time.as_secs_f64();
    Move::Walk(step * WALK_PER_SECOND * times * seconds, ZOOM_PER_SECOND.powf(zoom * seconds))
}

/// Where an arrow points, to the right and downwards, and how it walks.
pub(super) fn arrow_of(key: Key) -> Option<(DVec2, Motion)> {
    Some(match key {
        Key::Left => (DVec2::NEG_X, Motion::Left),
        Key::Right => (DVec2::X, Motion::Right),
        Key::Up => (DVec2::NEG_Y, Motion::Forward),
        Key::Down => (DVec2::Y, Motion::Back),
        _ => return None,
    })
}

pub(super) fn motion_of(key: Key) -> Option<Motion> {
    Some(match key {
        Key::Left | Key::Char('a' | 'A') => Motion::Left,
        Key::Right | Key::Char('d' | 'D') => Motion::Right,
        Key::Up | Key::Char('w' | 'W') => Motion::Forward,
        Key::Down | Key::Char('s' | 'S') => Motion::Back,
        // The same key, with Shift let go before it.
        Key::Char('+' | '=' | 'i' | 'I') => Motion::In,
        Key::Char('-' | '_' | 'o' | 'O') => Motion::Out,
        _ => return None,
    })
}

/// What keys do while control is held.
pub(super) fn orbit_of(key: Key) -> Option<Motion> {
    Some(match key {
        Key::Left => Motion::TurnLeft,
        Key::Right => Motion::TurnRight,
        Key::Up => Motion::TiltUp,
        Key::Down => Motion::TiltDown,
        _ => return None,
    })
}
